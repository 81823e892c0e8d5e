"""All numbers of a single case, and the few that are its answer, with their sizes in SI and what to do if it failed."""

import math
from collections import Counter
from collections.abc import Collection, Iterator
from typing import Final

import numpy as np
import xarray as xr

from nanoslip.solver.outcome import Ending
from nanoslip.study.dataset import variables
from nanoslip.study.dataset.access import read_run
from nanoslip.study.dataset.file import read_groups
from nanoslip.study.dataset.units import is_given_in_si, read_scales, readable, si_factor, total_load
from nanoslip.study.dataset.variables import MEASURES
from nanoslip.study.manifest.parameters import as_written, compact, span
from nanoslip.study.report.console import Table
from nanoslip.study.report.summary import (
    COMPLETED,
    CRITICAL,
    NOTHING,
    OF_STAGES,
    SHOWN,
    UNCERTAINTY,
    format_scalar,
    read_endings,
    search_results,
)

_SAID_APART: Final = {
    *(variable.name for outcome in variables.OUTCOMES.values() for variable in outcome),
    *(variable.name for variable in variables.OWN_MESSAGES.values()),
    *variables.run_names(),
    variables.VALIDITY.name,
    "advice",
}
"""Variables that are no numbers of the case, or appear in its line."""
_ANSWER: Final = ("static_friction", "kinetic_friction", "regime", *OF_STAGES, "leg_regime", "plateau_mean")


def case_table(case: xr.Dataset, names: Collection[str] = ()) -> tuple[Table, dict[str, list[str]]]:
    """Name, value with its unit, and meaning of each scalar that one case has; and why others are not among them -> their names.

    case: of nanoslip.study.dataset.access; variables along a dimension are left out. names: only these; () all.
    """
    rows: list[tuple[str, ...]] = []
    others: dict[str, list[str]] = {}
    # Numbers of tables come first, in the order of their columns.
    for name in sorted(map(str, case.data_vars), key=lambda name: (*SHOWN, name).index(name)):
        if (names and name not in names) or case[name].dims or name in _SAID_APART:
            continue
        # A ±, a count of members and a size in SI are shown with their variable.
        if name.endswith((UNCERTAINTY, "members", "_si")):
            continue
        value = format_scalar(case, name, 6)
        if value == NOTHING:
            others.setdefault("not known here", []).append(name)
        elif value in ("0", "0 ± ?"):
            others.setdefault("0 here", []).append(name)
        else:
            rows.append(_number_row(case, name, value))
    table = Table(("quantity", "value", "meaning"), tuple(rows), labels=2)
    return table, others


def _number_row(case: xr.Dataset, name: str, value: str) -> tuple[str, str, str]:
    """Name, value with its unit, and meaning of a number; in brackets its size in SI and what else it holds for."""
    meaning, unit = _meaning_and_unit(case[name])
    size = _si_size(case, name, unit, case.variables.get(f"{name}{UNCERTAINTY}"))
    in_si = size != "" and is_given_in_si(case)
    in_scales = f"{value} {unit}".rstrip()
    remarks = [in_scales if in_si else _si_size(case, name, unit)]
    if name == CRITICAL:
        remarks += _critical_condition(case)
    beside = "; ".join(filter(None, remarks))
    cell = (size if in_si else in_scales) + variables.fewer(case, name)
    return name, cell, f"{meaning} ({beside})" if beside else meaning


def ending_lines(case: xr.Dataset, brief: bool = False, names: Collection[str] = ()) -> Iterator[str]:
    """Outcomes of a case and its drive with messages, advice for validity flags, and the meaning of means and ±.

    brief: without outcomes that are `completed` and have no message, or are in the answer. names: numbers that are shown,
        () all.
    """
    for label, (ended, why) in read_endings(case).items():
        # Its message is about numbers of this one drive, which were not asked for.
        if label == "drive" and ended == COMPLETED and CRITICAL in case:
            continue
        if not brief or (why and ended not in _failures(case)):
            yield ": ".join(filter(None, (label, ended, why)))
    yield from variables.own_messages(case)
    advice = str(case["advice"].item()) if "advice" in case else ""
    if advice:
        yield f"advice: {advice}"
    yield from filter(None, [variables.explain_means(case, names or case.data_vars)])


def answer(case: xr.Dataset) -> str:
    """Numbers that answer for one case in a line, and why it failed, if so.

    A drive without a slip is named by its regime. Numbers with a size in SI begin with it.
    """
    parts = (answer_numbers(case), *failure_lines(case))
    return "; ".join(filter(None, parts))


def answer_numbers(case: xr.Dataset) -> str:
    """A case's friction, regime and plateau in a line; for a contact its half-width, for loops their loss and
    stroke."""
    values = answer_values(case).items()
    numbers = [_answer_number(case, name, value) for name, value in values]
    if "cycle_stroke" in case and math.isfinite(case["cycle_stroke"].item()):
        numbers.append(_stroke_words(case))
    if _has_stroke(case):
        numbers.append(_stage_words(case))
    return ", ".join(numbers)


def _stroke_words(case: xr.Dataset) -> str:
    """Stroke and amplitude of the pin; and, if a spring is given, of the stage that pulls the pin so far."""
    stroke = case["cycle_stroke"].item()
    scales = read_scales(case.attrs)
    if scales is None:
        return f"stroke {stroke:.3g} L_x end to end, ±{stroke / 2.0:.3g} L_x of the pin"
    amplitude = stroke * scales.slab_width / 2.0
    words = f"stroke {compact(2.0 * amplitude, 'm')} end to end, ±{compact(amplitude, 'm')} of the pin"
    if "spring_stiffness" not in case.coords or case["spring_stiffness"].dims:
        return words
    # Friction at the turns stretches the spring: the stage goes further than the pin.
    spring = case["spring_stiffness"].item()
    load = case["normal_load"].item() * scales.force
    force = case["turn_friction"].item() * load
    stage = compact(amplitude + force / spring, "m")
    return f"{words}, for which a stage of {compact(spring, 'N/m')} moves ±{stage}"


def _has_stroke(case: xr.Dataset) -> bool:
    """True if a single drive is shown, and its stage went to and fro."""
    if "pin_stroke" not in case or case["pin_stroke"].dims:
        return False
    return math.isfinite(case["pin_stroke"].item())


def _stage_words(case: xr.Dataset) -> str:
    """Stroke and amplitude of a stage that went to and fro, and of the pin that it pulled."""
    stroke = case["stage_stroke"].item()
    words = f"the stage moves {compact(stroke, 'm')} end to end, ±{compact(stroke / 2.0, 'm')}"
    pin = case["pin_stroke"].item()
    scales = read_scales(case.attrs)
    if scales is None:
        return f"{words}, the pin {pin:.3g} L_x, ±{pin / 2.0:.3g} L_x"
    length = pin * scales.slab_width
    return f"{words}, the pin {compact(length, 'm')}, ±{compact(length / 2.0, 'm')}"


def failure_lines(case: xr.Dataset) -> Iterator[str]:
    """Outcomes that leave a case without its answer, with what to do."""
    failures = _failures(case).items()
    return (": ".join(filter(None, failure)) for failure in failures)


def _failures(case: xr.Dataset) -> dict[str, str]:
    """Outcomes that leave a case without its answer, with their messages."""
    good = {COMPLETED}
    # A pin that does not slip has a regime, and that is the answer.
    if "regime" in answer_values(case):
        good.add(Ending.NO_SLIP.value)
    # The drive's ending comes first; if the case ended alike, its message stands for both.
    endings = reversed(read_endings(case).values())
    return {ended: why for ended, why in endings if ended not in good}


def _answer_number(case: xr.Dataset, name: str, value: str) -> str:
    """A number of an answer: its title and value; if its dataset has scales, meaning and size in SI before them.

    If the campaign is given in SI, the size is all.
    """
    meaning, unit = _meaning_and_unit(case[name])
    si = _si_size(case, name, unit, case.variables.get(f"{name}{UNCERTAINTY}"))
    if not si:
        return f"{SHOWN[name]} {value}"
    return f"{meaning} {si}" if is_given_in_si(case) else f"{meaning} {si}, {SHOWN[name]} {value}"


def with_meaning(case: xr.Dataset, name: str) -> str:
    """A number with its meaning, in SI if its dataset has scales: `F over the contact area 0.41 ± 0.01 MPa`."""
    meaning, unit = _meaning_and_unit(case[name])
    si = _si_size(case, name, unit, case.variables.get(f"{name}{UNCERTAINTY}"))
    return f"{meaning} {si or f'{format_scalar(case, name, 4)} {unit}'}"


def answer_values(case: xr.Dataset) -> dict[str, str]:
    """Variables that answer for one case, and their values as text, the first one first."""
    names = [name for name in _ANSWER if name in case and not case[name].dims]
    if not names:
        # Without sliding a path answers by its loss, and a contact alone by its size.
        substitutes = [name for name in ("loss_per_cycle", "contact_half_width") if name in case]
        names = substitutes[:1]
    texts = {name: format_scalar(case, name, 4) for name in names}
    values = {name: text for name, text in texts.items() if text != NOTHING}
    # The plateau is the same number as kinetic friction.
    if "kinetic_friction" in values:
        values.pop("plateau_mean", None)
    return values


def _critical_condition(case: xr.Dataset) -> Iterator[str]:
    """Spring and starts of a critical velocity."""
    if "spring_stiffness" in case.coords:
        yield f"at {compact(float(case['spring_stiffness']), 'N/m')}"
    yield from start_range(case, CRITICAL)


def start_range(case: xr.Dataset, name: str) -> Iterator[str]:
    """Range of a critical velocity over single starts, as a single machine would show it, and the reason if starts
    have none."""
    results = search_results(case, name)
    words = {word: count for word, count in results if word != "found"}
    failures = Counter(words)
    if "drive_ensemble" in read_groups(case):
        starts = read_run(case, "drive_ensemble", {})[0]
        values = starts[name].values
        # A member with neither a velocity nor a time stuck has failed, and its outcome is the reason.
        failed = np.isnan(values) & np.isnan(starts["time_stuck"].values)
        endings = list(Ending)
        codes = starts["member_outcome"].values[failed]
        failures.update(endings[code].value for code in codes)
        if np.isfinite(values).any():
            unit = as_written(variables.variables_by_name()[name].units)
            yield f"single starts: {span(values[np.isfinite(values)].tolist(), unit)}"
    for word, count in failures.items():
        yield f"{count} {'start' if count == 1 else 'starts'}: {word}"


def _si_size(case: xr.Dataset, name: str, unit: str, error: xr.Variable | None = None) -> str:
    """Size in SI of a number in units of the scales, as `269.8 μm`, and perhaps its ±; empty without scales."""
    scales = read_scales(case.attrs)
    if scales is None or unit not in MEASURES:
        return ""
    # Numbers of a case with several pins are over the load of all of them.
    scale = float(si_factor(scales, unit, total_load(case, scales)))
    size_error = None if error is None else float(error) * scale
    size = case[name].item() * scale
    return compact(size, as_written(MEASURES[unit]), size_error)


def _meaning_and_unit(number: xr.DataArray) -> tuple[str, str]:
    """Meaning and unit of a number as it is declared, else as the dataset states them."""
    variable = variables.variables_by_name().get(str(number.name))
    if variable:
        return variable.meaning, variable.measure or readable(variable.units)
    meaning = number.attrs.get("long_name", number.name)
    unit = number.attrs.get("units", "1")
    return str(meaning), readable(str(unit))
