"""Tables of a dataset: a row for each case, or all numbers of a single case; advice in sentences, and the error of
each number."""

import functools
import math
import operator
from collections import Counter
from collections.abc import Collection, Hashable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.drive import Scales
from nanoslip.solver.dynamics.coefficients import INERTIAL
from nanoslip.solver.effects import LeftOut, SpacingChange
from nanoslip.solver.load_path import Loops
from nanoslip.solver.outcome import Ending
from nanoslip.solver.parameter import quantities
from nanoslip.solver.sliding.validity import decode_flags
from nanoslip.solver.view import with_error
from nanoslip.study.dataset import variables
from nanoslip.study.dataset.access import read_run
from nanoslip.study.dataset.file import read_groups
from nanoslip.study.dataset.table import CASE, CaseRows, case_rows, read_scales
from nanoslip.study.dataset.texts import are_texts
from nanoslip.study.figures.points import (
    format_value,
    format_words,
    hyphenate,
    readable,
    symbol,
    symbol_with_unit,
    unit_text,
)
from nanoslip.study.manifest.manifest import Stage, TargetTable
from nanoslip.study.manifest.parameters import Value, as_written, compact, si_text
from nanoslip.study.plan.expectations import flag_lines
from nanoslip.study.report.console import Table
from nanoslip.study.tasks.kind import KINDS
from nanoslip.study.tasks.task import PENDING
from nanoslip.study.toml_text import from_toml

# Values that are the same in all rows of a table: printed once above it, not in every row.

LARGEST_WHOLE: float = 1e12
"""Whole numbers below it are written without an exponent."""
FEW_COUNTED: Final = 10.0
"""Means of counts are whole numbers from here on, and have one digit below it."""
NOTHING = "–"
"""Cell of an unknown number."""


def format_number(value: float, digits: int) -> str:
    """Format a number with this number of digits; a longer whole number in full, in groups of three."""
    if 10**digits <= abs(value) < LARGEST_WHOLE and value == round(value):
        return f"{value:,.0f}".replace(",", "\N{NO-BREAK SPACE}")
    return f"{value:.{digits}g}"


def factor_out_columns(table: Table) -> tuple[Table, list[str]]:
    """Remove columns whose cells are all equal from a table, and return sentences with their values.

    Labels and the last column stay, and a table with a single row stays as it is.
    """
    if len(table.rows) < 2:
        return table, []
    last = len(table.header) - 1
    columns = list(zip(*table.rows, strict=True))
    alike = [place for place in range(table.labels, last) if len(set(columns[place])) == 1]
    kept = [place for place in range(last + 1) if place not in alike]
    asked = sum(table.labels <= place < table.labels + table.asked for place in kept)
    header = tuple(table.header[place] for place in kept)
    rows = tuple(zip(*(columns[place] for place in kept), strict=True))
    cells = [(table.header[place], columns[place][0]) for place in alike]
    return replace(table, header=header, rows=rows, asked=asked), list(_cell_sentences(cells))


def _cell_sentences(cells: Sequence[tuple[str, str]]) -> Iterator[str]:
    """Sentences with the titles of columns and the cell that all of their rows have."""
    known = [f"{title} = {cell}" for title, cell in cells if cell != NOTHING]
    if known:
        yield f"In all rows: {', '.join(known)}."
    unknown = [title for title, cell in cells if cell == NOTHING]
    if unknown:
        yield f"Not known in any row: {', '.join(unknown)}."


# Every number that is known of one case, with its uncertainty, unit and meaning; and the names of those that are not.

UNCERTAINTY: Final = "_uncertainty"
"""Suffix of a number's name for its ±."""
CRITICAL: Final = "critical_velocity"
"""Variable with the velocity of the stage above which the pin no longer sticks."""
_SAID_APART: Final = {
    *(variable.name for outcome in variables.OUTCOMES.values() for variable in outcome),
    *(variable.name for variable in variables.OWN_MESSAGES.values()),
    *variables.run_names(),
    variables.VALIDITY.name,
    "advice",
}
"""Variables that are no numbers of the case, or appear in its line."""


def case_table(case: xr.Dataset, names: Collection[str] = ()) -> tuple[Table, dict[str, list[str]]]:
    """Name, value with its unit, and meaning of each scalar that one case has; and why others are not among them -> their names.

    case: of nanoslip.study.dataset.access; variables along a dimension are left out. names: only these; () all.
    """
    rows: list[tuple[str, ...]] = []
    others: dict[str, list[str]] = {}
    for name in sorted(map(str, case.data_vars), key=lambda name: (*SHOWN, name).index(name)):
        if (names and name not in names) or case[name].dims or name in _SAID_APART:
            continue
        if name.endswith((UNCERTAINTY, "members", "_si")):
            continue  # ±, count of members and size in SI are shown with their variable
        value = _text(case, name, 6)
        if value == NOTHING:
            others.setdefault("not known here", []).append(name)
        elif value in ("0", "0 ± ?"):
            others.setdefault("0 here", []).append(name)
        else:
            rows.append(_number_row(case, name, value))
    return Table(("quantity", "value", "meaning"), tuple(rows), labels=2), others


def _number_row(case: xr.Dataset, name: str, value: str) -> tuple[str, str, str]:
    """Name, value with its unit, and meaning of a number; in brackets its size in SI and what else it holds for."""
    meaning, unit = _meaning_and_unit(case[name])
    remarks = [_si_size(case, name, unit)]
    if name == CRITICAL:
        remarks += _critical_condition(case)
    beside = "; ".join(filter(None, remarks))
    cell = f"{value} {unit}".rstrip() + variables.fewer(case, name)
    return name, cell, f"{meaning} ({beside})" if beside else meaning


def ending_lines(case: xr.Dataset, brief: bool = False) -> Iterator[str]:
    """Outcomes of a case and its drive with messages, advice for validity flags, and the meaning of means and ±.

    brief: without outcomes that are `completed` and have no message, or are in the answer.
    """
    for label, (ended, why) in _endings(case).items():
        if label == "drive" and ended == COMPLETED and CRITICAL in case:
            continue  # its message is about numbers of this one drive, which were not asked for
        if not brief or (why and ended not in _failures(case)):
            yield ": ".join(filter(None, (label, ended, why)))
    yield from variables.own_messages(case)
    advice = str(case["advice"].item()) if "advice" in case else ""
    if advice:
        yield f"advice: {advice}"
    yield from filter(None, [variables.explain_means(case)])


def answer(case: xr.Dataset) -> str:
    """Numbers that answer for one case in a line, and why it failed, if so.

    A drive without a slip is named by its regime. Numbers with a size in SI begin with it.
    """
    return "; ".join(filter(None, (answer_numbers(case), *failure_lines(case))))


def answer_numbers(case: xr.Dataset) -> str:
    """A case's friction, regime and plateau in a line; for a contact its half-width, for loops their loss and
    stroke."""
    numbers = [f"{_size(case, name)}{SHOWN[name]} {value}" for name, value in answer_values(case).items()]
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
    force = case["turn_friction"].item() * case["normal_load"].item() * scales.force
    return f"{words}, for which a stage of {compact(spring, 'N/m')} moves ±{compact(amplitude + force / spring, 'm')}"


def _has_stroke(case: xr.Dataset) -> bool:
    """True if a single drive is shown, and its stage went to and fro."""
    return "pin_stroke" in case and not case["pin_stroke"].dims and math.isfinite(case["pin_stroke"].item())


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
    return (": ".join(filter(None, failure)) for failure in _failures(case).items())


def _endings(case: xr.Dataset) -> dict[str, tuple[str, str]]:
    """Outcome and message of a case, and of its drive if it has one: `outcome` and `drive` -> both."""
    endings = {}
    for label, run in (("outcome", ""), ("drive", "drive")):
        outcome = variables.OUTCOMES[run]
        if outcome.ending.name in case and not case[outcome.ending.name].dims:
            message = str(case[outcome.message.name].item())
            endings[label] = (str(case[outcome.ending.name].item()), message)
    return endings


def _failures(case: xr.Dataset) -> dict[str, str]:
    """Outcomes that leave a case without its answer, with their messages."""
    good = {COMPLETED}
    if "regime" in answer_values(case):
        good.add(Ending.NO_SLIP.value)
    return {ended: why for ended, why in reversed(_endings(case).values()) if ended not in good}


def _size(case: xr.Dataset, name: str) -> str:
    """Meaning and size in SI of a number, for before its value: `half-width of the contact 958.7 ± 1.1 μm, `."""
    meaning, unit = _meaning_and_unit(case[name])
    si = _si_size(case, name, unit, case.get(f"{name}{UNCERTAINTY}"))
    return f"{meaning} {si}, " if si else ""


def with_meaning(case: xr.Dataset, name: str) -> str:
    """A number with its meaning, in SI if its dataset has scales: `F over the contact area 0.41 ± 0.01 MPa`."""
    meaning, unit = _meaning_and_unit(case[name])
    si = _si_size(case, name, unit, case.get(f"{name}{UNCERTAINTY}"))
    return f"{meaning} {si or f'{_text(case, name, 4)} {unit}'}"


def answer_values(case: xr.Dataset) -> dict[str, str]:
    """Variables that answer for one case, and their values as text, the first one first."""
    names = [name for name in _ANSWER if name in case and not case[name].dims]
    if not names:
        names = [name for name in ("loss_per_cycle", "contact_half_width") if name in case][:1]
    texts = {name: _text(case, name, 4) for name in names}
    values = {name: text for name, text in texts.items() if text != NOTHING}
    if "kinetic_friction" in values:
        values.pop("plateau_mean", None)  # which is the same
    return values


def _text(values: xr.Dataset, name: str, digits: int) -> str:
    """Format a scalar with this number of digits, or rounded beside its ±; NOTHING if unknown."""
    value, error = values[name].item(), f"{name}{UNCERTAINTY}"
    if value in ("", NOTHING) or value != value:  # noqa: PLR0124  NaN is not
        return _not_found(values, name)
    if error in values:
        parts = _two_parts(values) if name == "static_friction" else ""
        return with_error(value, float(values[error])) + parts
    if isinstance(value, str | bool):
        return format_words(case_rows(values, name).tallies(name)[0])
    if name in variables.counts() and value != round(value):
        decimals = 0 if abs(value) >= FEW_COUNTED else 1
        return format_number(round(value, decimals), digits)
    return format_number(value, digits)


def _not_found(values: xr.Dataset, name: str) -> str:
    """Reason why a critical velocity is missing, as `always sticks`; NOTHING for other numbers, or if it is unknown."""
    parts = [*_searches(values, name)]
    if len(parts) == 1:
        return NOTHING if parts[0][0] == "unknown" else parts[0][0]
    return "; ".join(f"{count} {word}" for word, count in parts) or NOTHING


def _searches(values: xr.Dataset, name: str) -> Iterator[tuple[str, int]]:
    """Results of the search for a critical velocity, in words, and how many starts have each; none of other numbers."""
    search = f"{name}_search"
    if search in values:
        for word, count in case_rows(values, search).tallies(search)[0].items():
            yield word.replace("_", " "), count


def _critical_condition(case: xr.Dataset) -> Iterator[str]:
    """Spring and starts of a critical velocity."""
    if "spring_stiffness" in case.coords:
        yield f"at {compact(float(case['spring_stiffness']), 'N/m')}"
    yield from start_range(case, CRITICAL)


def start_range(case: xr.Dataset, name: str) -> Iterator[str]:
    """Range of a critical velocity over single starts, as a single machine would show it, and the reason if starts
    have none."""
    failures = Counter({word: count for word, count in _searches(case, name) if word != "found"})
    if "drive_ensemble" in read_groups(case):
        starts = read_run(case, "drive_ensemble", {})[0]
        values = starts[name].values
        failed = np.isnan(values) & np.isnan(starts["time_stuck"].values)
        endings = list(Ending)
        failures.update(endings[code].value for code in starts["member_outcome"].values[failed])
        if np.isfinite(values).any():
            unit = as_written(variables.variables_by_name()[name].units)
            low, high = compact(np.nanmin(values), unit), compact(np.nanmax(values), unit)
            yield f"single starts: {low} to {high}"
    yield from (f"{count} {word}" for word, count in failures.items())


def _inertial(values: xr.Dataset) -> xr.DataArray:
    """True if inertia and damper add more than INERTIAL to the contact's own peak in μ_s."""
    excess = values.get("static_friction_excess", xr.DataArray(0.0))
    return excess > INERTIAL * (values["static_friction"] - excess)


def _two_parts(values: xr.Dataset) -> str:
    """The contact's own part of μ_s and that of inertia and damper, as ` (0.498 + 0.415)`; empty if that is within its ±."""
    excess = values.get("static_friction_excess", xr.DataArray(0.0)).item()
    if not (excess > values["static_friction_uncertainty"].item() or bool(_inertial(values))):
        return ""
    return f" ({values['static_friction'].item() - excess:.3g} + {excess:.3g})"


def _si_size(case: xr.Dataset, name: str, unit: str, error: xr.DataArray | None = None) -> str:
    """Size in SI of a number in units of the scales, as `269.8 μm`, and perhaps its ±; empty without scales."""
    scales = read_scales(case.attrs)
    if scales is None:
        return ""
    load = case["normal_load"].item() * case.get("contacts", 1) * scales.force
    area = scales.slab_width * scales.slab_depth
    units = {
        "L_x": (scales.slab_width, "m"),
        "G·L_y": (scales.stiffness, "N/m"),
        "W·L_x": (load * scales.slab_width, "J"),
        "W/(L_x·L_y)": (load / area, "Pa"),
    }
    if unit not in units:
        return ""
    scale, si = units[unit]
    size = case[name].item() * float(scale)
    size_error = None if error is None else error.item() * float(scale)
    return compact(size, si, size_error)


def _meaning_and_unit(number: xr.DataArray) -> tuple[str, str]:
    """Meaning and unit of a number as it is declared, else as the dataset states them."""
    variable = variables.variables_by_name().get(str(number.name))
    if variable:
        return variable.meaning, variable.measure or readable(variable.units)
    meaning = number.attrs.get("long_name", number.name)
    unit = number.attrs.get("units", "1")
    return str(meaning), readable(str(unit))


MOST_ROWS: Final = 500
"""The most rows of a table on the page."""
MOST_LINES: Final = 40
"""Most rows of a table on the terminal, so that the text below it stays visible."""
COMPLETED: Final = Ending.COMPLETED.value
FEW: Final = 50
"""Drives whose endings are not counted."""
SYMBOLS: Final = {name: each.symbol for name, each in variables.parameters().items() if each.symbol}
"""Parameter -> its name in tables and figures."""


def each_case(rows: CaseRows, most: int) -> list[xr.Dataset]:
    """Scalars of at most `most` rows, in their order; finished cases come before unfinished ones."""
    endings = (ending.name for ending, *_ in variables.OUTCOMES.values() if ending.name in rows.root)
    waiting = np.any([rows.values(name) == PENDING for name in endings], axis=0)
    shown = np.sort(np.argsort(waiting, kind="stable")[:most])
    scalars = [name for name in rows.root.data_vars if rows.has(str(name))]
    return list(replace(rows, root=rows.root[scalars].load()).at(shown))


def scalar_table(dataset: xr.Dataset, why: bool = True, most: int = MOST_ROWS, scales: Scales | None = None) -> Table:
    """Table with one row for each case and drive, at most `most`.

    why: behind an outcome its message, too. scales: to have lengths and loads of the axes in SI beside them.
    """
    asked = _answer_columns(dataset)
    names = [name for name in (*asked, *SHOWN) if name in dataset and not _has_no_cycles(dataset, name)]
    names = [name for name in names if name not in _OF_CYCLES or dataset[name].notnull().any()]
    columns = {name: SHOWN.get(name, symbol(name)) for name in names}
    dataset = _select_shown(dataset, columns)
    all_rows = case_rows(dataset)
    varying = _varying(all_rows)
    labels = [symbol_with_unit(_name(name), name) for name in varying]
    # A punch is given its own half-width.
    titles = [f"{title} of contact" if title in labels else title for title in columns.values()]
    flagged = _has_flags_in_rows(dataset)
    header = (*labels, *titles, "outcome [flag]" if flagged else "outcome")
    rows: list[tuple[str, ...]] = []
    failed = set()
    for case in each_case(all_rows, most):
        ending, flags, message = _ending(case)
        if ending not in _UNHURT and bool(_has_missing_number(case)) and not _has_regime_answer(case).item():
            failed.add(len(rows))
        outcome = f"{ending}{flags if flagged else ''}{message if why else ''}"
        parameters = [with_size(name, case[name].item(), scales) for name in varying]
        numbers = [_text(case, name, 5) + variables.fewer(case, name) for name in columns]
        rows.append((*parameters, *numbers, outcome))
    more = len(all_rows) - len(rows)
    if more:
        rows.append((*["…"] * (len(header) - 1), f"{more} more"))
    return Table(header, tuple(rows), len(varying), frozenset(failed), len(asked))


def _answer_columns(dataset: xr.Dataset) -> list[str]:
    """Columns of a table that a campaign requests: its main numbers and the regime of its drives."""
    asked = (*main_numbers(dataset), "regime", *variables.own_numbers(dataset))
    names = [name for name in asked if name in dataset]
    if "static_friction" not in names or "plateau_mean" not in dataset or "plateau_mean" in names:
        return names
    # A pin that never slips has the friction of the plateau.
    never_slips = bool(dataset["static_friction"].isnull().any())
    return [*names, "plateau_mean"] if never_slips else names


def _select_shown(dataset: xr.Dataset, columns: Collection[str]) -> xr.Dataset:
    """The variables that a table with these columns needs: of millions of cases, other numbers stay in their file."""
    names = {"static_friction_excess", variables.VALIDITY.name, *columns}
    names |= {variables.MEMBERS.name, variables.DRIVE_MEMBERS.name}
    for column in columns:
        names |= {f"{column}{UNCERTAINTY}", f"{column}_members"}
        names.update(variables.words_counted().get(column, {}).values())
    shown = [name for name, values in dataset.data_vars.items() if name in names or are_texts(values.variable)]
    return dataset[shown]


def _has_flags_in_rows(dataset: xr.Dataset) -> bool:
    """True if validity flags differ between cases, or a single case has one: one that all cases have is named below."""
    if variables.VALIDITY.name not in dataset:
        return False
    masks = dataset[variables.VALIDITY.name].values
    return bool(masks.any()) if masks.size == 1 else bool((masks != masks.flat[0]).any())


def _has_no_cycles(dataset: xr.Dataset, name: str) -> bool:
    """True for a number of cycles where no path has any."""
    return name in quantities(Loops) and bool(dataset[name].isnull().all())


def main_numbers(dataset: xr.Dataset) -> list[str]:
    """Requested numbers of a campaign: the numbers in [target] and the main numbers of the last stage."""
    named = _target(dataset)[1]
    if "drive_outcome" in dataset:
        named = (*named, *(name for name in ("static_friction", "kinetic_friction", *_OF_STAGES) if name in dataset))
    elif "plateau_mean" in dataset:
        named = (*named, "plateau_mean")
    elif "loss_per_cycle" in dataset and not _has_no_cycles(dataset, "loss_per_cycle"):
        named = (*named, "loss_per_cycle")
    critical = (CRITICAL,) if CRITICAL in dataset else ()
    return list(dict.fromkeys(filter(None, (*named, *critical))))


def _has_missing_number(dataset: xr.Dataset) -> xr.DataArray:
    """True if a requested number is missing: of [target], or μ_s of a drive with `max_slips`."""
    names = _target(dataset)[1]
    if not names and {"max_slips", "static_friction"} <= set(dataset.variables):
        return dataset["static_friction"].isnull() | dataset["max_slips"].isnull()
    if not names or any(name not in dataset for name in names):
        return xr.DataArray(True)
    return _missing_mask(dataset, names)


def _has_regime_answer(dataset: xr.Dataset) -> xr.DataArray:
    """True for drives whose regime is the answer without μ_s, unless [target] names numbers.

    A pin follows in micro slips, or sticks below a critical velocity that is known.
    """
    if "regime" not in dataset or _target(dataset)[1]:
        return xr.DataArray(False)
    known = dataset[CRITICAL].notnull() if CRITICAL in dataset else xr.DataArray(False)
    return (dataset["regime"] == "micro_slip") | (dataset["regime"] == "sticks") & known


def flag_summary(dataset: xr.Dataset) -> dict[str, str]:
    """Validity flag -> a line: how many cases have it, the first of them, and the advice."""
    if variables.VALIDITY.name not in dataset:
        return {}
    masks = dataset[variables.VALIDITY.name]
    first = partial(_place, case_rows(dataset, str(masks.name))) if masks.size > 1 else lambda _: ""
    return flag_lines(masks.values.ravel().tolist(), first)


def _target(dataset: xr.Dataset) -> tuple[float, tuple[str, ...]]:
    """Target of a campaign: its relative error, NaN without one, and its variables."""
    document = from_toml(dataset.attrs.get("manifest", ""))
    if "target" not in document:
        return math.nan, ()
    last: Stage = "contact"
    if "drive_outcome" in dataset:
        last = "dynamics"
    elif "plateau_mean" in dataset:
        last = "slip"
    target = TargetTable(**document["target"])
    return target.within, target.variables(last, "leg_regime" in dataset and "regime" not in dataset)


def short_summary(dataset: xr.Dataset) -> list[str]:
    """A line for each number that misses its target, or has no mean, in some complete cases."""
    enough, names = _target(dataset)
    lines = []
    for name in names:
        if not {name, f"{name}_uncertainty"} <= set(dataset.data_vars):
            continue
        for short, remark in _shortfalls(dataset, name, enough):
            positions = np.flatnonzero(short.values).tolist()
            if positions:
                where = _where(case_rows(dataset, name), positions)
                lines.append(f"{name} is not known within {enough:.2g}: {where}; {remark}")
    return lines


def _shortfalls(dataset: xr.Dataset, name: str, enough: float) -> Iterator[tuple[xr.DataArray, str]]:
    """Masks of the cases in which a number misses its target, or has no mean, and a remark on each mask."""
    mean = dataset[name]
    width = 2.0 * abs(dataset[f"{name}_uncertainty"] / mean)
    if LEFT_OUT_ERROR.name in dataset and set(dataset[LEFT_OUT_ERROR.name].dims) <= set(width.dims):
        width = width + dataset[LEFT_OUT_ERROR.name]
    spacing = _spacing_change(dataset, mean)
    decided = spacing > enough
    if decided.any():
        change = (
            f"twice the node spacing changes it by up to {float(spacing.max()):.1%}, which no further starts reduce"
        )
        yield decided, f"{change}: raise n_x; nanoslip explain estimates the time of half the spacing"
    width = (width + spacing.fillna(0.0)).where(~decided, 0.0)
    worst = float(width.max())
    yield width > enough, f"the worst to {worst:.1%}; raise target.most, or limits.presliding"
    endings = [dataset[ending.name] for ending, *_ in variables.OUTCOMES.values() if ending.name in dataset]
    endings = [ending for ending in endings if set(ending.dims) <= set(mean.dims)]
    if endings:
        yield width.isnull() & (endings[-1] == COMPLETED), "members lack a value, or do not differ"


def _spacing_change(dataset: xr.Dataset, number: xr.DataArray) -> xr.DataArray:
    """Relative change of a number by twice the node spacing: of its drive, else of its record; NaN if unknown."""
    for name in (f"drive_{SPACING_CHANGE}", SPACING_CHANGE):
        if name in dataset and set(dataset[name].dims) == set(number.dims):
            return dataset[name]
    return xr.full_like(number, math.nan)


def omission_summary(dataset: xr.Dataset) -> list[str]:
    """A line for each effect that was left out of most members of a drive, with the number of drives and the largest
    change."""
    if LEFT_OUT.name not in dataset:
        return []
    effects = np.ravel(dataset[LEFT_OUT.name].values)
    errors = np.ravel(dataset[LEFT_OUT_ERROR.name].values)
    lines = []
    for word in LEFT_OUT.words[1:]:
        without = effects == word
        if without.any():
            count = f"{without.sum()} of {effects.size} drives"
            change = f"the numbers asked for change by {errors[without].max():.2%} at most"
            effect = word.replace("_", " ")
            lines.append(f"left out: {effect} in {count}; {change}, what else depends on it is not known")
    return lines


def _ending_groups(rows: CaseRows, run: str) -> list[tuple[str, str, list[int]]]:
    """Outcome, cause and positions of cases, or drives, that ended alike by themselves; the most frequent first.

    Messages with the same cause count as the same. Drives that ended as their case did are left out.
    """
    endings = rows.values(variables.OUTCOMES[run].ending.name).tolist()
    case_endings = rows.values(variables.OUTCOMES[""].ending.name).tolist()
    groups: dict[tuple[str, str], list[int]] = {}
    pairs = zip(endings, case_endings, _kinds(rows, run), _kinds(rows, ""), strict=True)
    for number, (ending, case_ending, kind, case_kind) in enumerate(pairs):
        same_cause = kind != "" and kind == case_kind
        same_failure = ending == case_ending and case_ending not in _UNHURT
        if not run or not (same_cause or same_failure):
            groups.setdefault((ending, kind), []).append(number)
    listed = [(ending, kind, numbers) for (ending, kind), numbers in groups.items()]
    return sorted(listed, key=lambda group: -len(group[2]))


def _kinds(rows: CaseRows, run: str) -> list[str]:
    """Cause of each outcome, or else its message, as in `Outcome.kind`."""
    outcome = variables.OUTCOMES[run]
    messages: list[str] = rows.values(outcome.message.name).tolist()
    if not rows.has(outcome.cause.name):
        return messages
    causes = rows.values(outcome.cause.name).tolist()
    return [cause or message for cause, message in zip(causes, messages, strict=True)]


def endings(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """Numbers of cases, then drives by ending, each with True if it is a failure: failures first, the most frequent first."""
    answered = _has_regime_answer(dataset)
    counts = []
    for kind, (ending, *_) in variables.OUTCOMES.items():
        if ending.name not in dataset:
            continue
        endings = dataset[ending.name]
        for word, count in Counter(filter(None, endings.values.ravel().tolist())).most_common():
            failed = word != COMPLETED and not bool(answered.where(endings == word, True).all())
            plural = "s" if count > 1 else ""
            counts.append((f"{count} {kind or 'case'}{plural}: {word.replace('_', ' ')}", failed))
    return sorted(counts, key=lambda line: not line[1])


def cautions(dataset: xr.Dataset) -> list[str]:
    """Cautions: effects left out, missed targets, validity flags."""
    others = failure_summary(dataset, asked=False).values()
    beside = (*own_number_summary(dataset), *others)
    return [*omission_summary(dataset), *short_summary(dataset), *beside, *flag_summary(dataset).values()]


def own_number_summary(dataset: xr.Dataset) -> list[str]:
    """A line for each message on one's own numbers: how many cases, or drives, have it, and the first of them."""
    lines = []
    for kind, variable in variables.OWN_MESSAGES.items():
        if variable.name not in dataset:
            continue
        rows = case_rows(dataset, variable.name)
        messages = rows.values(variable.name).tolist()
        for message in dict.fromkeys(filter(None, messages)):
            alike = [number for number, each in enumerate(messages) if each == message]
            lines.append(f"own numbers: {message}: {_where(rows, alike, 'drives' if KINDS[kind].driven else 'cases')}")
    return lines


def failure_summary(dataset: xr.Dataset, asked: bool = True) -> dict[Hashable, str]:
    """Cause -> a line for each way in which cases, then drives failed: how many, the first of them, why and what to
    do.

    asked: True for cases that miss a requested number, False for all other cases. A remark on a completed case, as on a number
    that nobody requested, is no failure.
    """
    lines: dict[Hashable, str] = {}
    missed = _has_missing_number(dataset) & ~_has_regime_answer(dataset)
    lacking = missed & _missing_mask(dataset, main_numbers(dataset))
    for run, (outcome, message, *_) in variables.OUTCOMES.items():
        if outcome.name not in dataset:
            continue
        rows = case_rows(dataset, outcome.name)
        hurt = _outcome_masks(dataset[outcome.name], missed)
        remarked = _outcome_masks(dataset[outcome.name], lacking)
        messages = rows.values(message.name).tolist()
        for ending, kind, alike in _ending_groups(rows, run):
            failed = remarked if ending in _UNHURT else hurt
            numbers = [number for number in alike if failed[number] == asked]
            if numbers and ending and (kind or ending not in _UNHURT):
                where = _where(rows, numbers, f"{run or 'case'}s")
                reason = _first_message([messages[number] for number in numbers])
                lines[run, ending, kind] = ": ".join(filter(None, (ending, where, reason)))
    return lines


def _first_message(messages: Sequence[str]) -> str:
    """First message of a cause, marked if other messages of the same cause differ in their numbers."""
    alike = len(set(messages)) == 1
    return messages[0] if alike else f"{messages[0]}; the others differ in numbers"


def _outcome_masks(outcomes: xr.DataArray, which: xr.DataArray) -> NDArray[np.bool_]:
    """A mask of each outcome, in their order; True of all where it lies along other dimensions."""
    mask = which if set(which.dims) <= set(outcomes.dims) else xr.DataArray(True)
    broad, _ = xr.broadcast(mask, outcomes)
    return np.asarray(broad.transpose(*outcomes.dims).values.ravel(), np.bool_)


def _missing_mask(dataset: xr.Dataset, names: Sequence[str]) -> xr.DataArray:
    """True where any of these numbers is missing."""
    missing = [dataset[name].isnull() for name in names if name in dataset]
    return functools.reduce(operator.or_, missing, xr.DataArray(False))


def _where(rows: CaseRows, numbers: Sequence[int], what: str = "cases") -> str:
    """Report the number of some rows, and the first of them."""
    place = _place(rows, numbers[0])
    return f"{len(numbers)} of {len(rows)} {what}" + (f", first {place}" if place else "")


def _place(rows: CaseRows, number: int) -> str:
    """Parameters of a row that differ between rows."""
    row = rows.at([number])
    return label_text({name: row.values(name).tolist()[0] for name in _varying(rows)})


def drive_summary(dataset: xr.Dataset) -> list[str]:
    """Number of drives by outcome and by regime (of most members), nothing of few, as the table shows them; and advice on μ_s."""
    lines = []
    for name in ("drive_outcome", "regime"):
        if name not in dataset or dataset[name].size <= FEW:
            continue
        tally = Counter(filter(None, dataset[name].values.ravel().tolist()))
        counts = ", ".join(f"{count} {hyphenate(word)}" for word, count in tally.most_common())
        if counts:
            lines.append(f"{name} of {dataset[name].size} drives: {counts}")
    inertial = _inertial(dataset) if "static_friction" in dataset else xr.DataArray(False)
    count = int(inertial.sum())
    if count:
        share = f"inertia and damper add over {INERTIAL:.0%} to the contact's peak, as (peak + addition)"
        cure = "lower stage_velocity, spring_stiffness or damping_ratio"
        lines.append(f"μ_s of {count} of {inertial.size} drives: {share}; {cure}")
    return lines


def label_text(label: Mapping[str, Value], scales: Scales | None = None) -> str:
    """Format a label by the names of a campaign file: `R/L_x = 200, slip_order = worst_first, V_o = 0.002 m/s`.

    Parameters that it has not, as a scheme its settings, are left out. scales: to have lengths and loads in SI: `R = 5 mm`.
    """
    parts = []
    for name, value in label.items():
        if value != "" and value == value:  # noqa: PLR0124  NaN is not
            si = si_text(scales, name, value) if scales else ""
            size = f"{variables.si_coordinates()[name].symbol} = {si}" if si else ""
            parts.append(size or f"{_name(name)} = {format_value(value)} {unit_text(name)}".rstrip())
    return ", ".join(parts)


def _name(parameter: str) -> str:
    """Symbol of a parameter, else its name in a campaign file."""
    return SYMBOLS.get(parameter, parameter)


SHOWN: Final = {
    "static_friction": "μ_s",
    "kinetic_friction": "μ_k",
    "regime": "regime",
    "stick_slip_period": "period (s)",
    "spring_force_amplitude": "amplitude/W",
    CRITICAL: "V_c (m/s)",
    **{"loop_energy": "loop/(W·L_x)", "midstroke_friction": "F/W at mid-stroke"},
    **{"turn_static_friction": "μ_s at turns", "leg_regime": "legs", "pin_stroke": "pin stroke/L_x"},
    "plateau_mean": "plateau F/W",
    "peak_friction": "peak F/W",
    "cycle_stroke": "stroke/L_x",
    "loss_per_cycle": "loss/(W·L_x)",
    "turn_friction": "F/W at turns",
    "equivalent_damping": "damping ζ",
    "closure": "closure F/W",
    "shaken_down": "shaken down",
    "slips_exponent": "τ of slips",
    "slips_goodness": "goodness of τ",
    "surface_stiffness": "K/(G·L_y)",
    "events": "events",
    "record_spacings": "spacings",
    "final_displacement": "δ_p/L_x",
    "contact_half_width": "a/L_x",
    "approach": "approach/L_x",
    "mean_pressure": "mean p·L_x·L_y/W",
    "maximum_pressure": "max p·L_x·L_y/W",
    "members": "members",
}
"""Variable -> title of its column in tables of cases, on the terminal and on a page; numbers of a single case have
this order, too. The main results come first, as a narrow terminal leaves out the last columns."""
_OF_CYCLES: Final = ("stick_slip_period", "spring_force_amplitude")
_OF_STAGES: Final = ("loop_energy", "midstroke_friction", "turn_static_friction")
_ANSWER: Final = ("static_friction", "kinetic_friction", "regime", *_OF_STAGES, "leg_regime", "plateau_mean")
_UNHURT: Final = (COMPLETED, PENDING)
"""Endings that are no failure."""
LEFT_OUT, LEFT_OUT_ERROR = quantities(LeftOut).values()
"""Variables: the effect that was left out of a case, and what it may change."""


(SPACING_CHANGE,) = quantities(SpacingChange)
"""Variable: the influence of the node spacing on a record's numbers; `drive_` before it, on a drive's."""


def _varying(rows: CaseRows) -> list[str]:
    """The coordinates in which rows differ; of a list of cases alike in all parameters their number."""
    names = list(rows.differing())
    alike = CASE in rows.sizes and set(names) <= rows.sizes.keys()
    return [CASE, *names] if alike else names


def with_size(name: str, value: Value, scales: Scales | None) -> str:
    """Value of a parameter, and beside a length or load its size in SI."""
    si = si_text(scales, name, value) if scales else ""
    return f"{format_value(value)} ({si})" if si else format_value(value)


def _ending(values: xr.Dataset) -> tuple[str, str, str]:
    """Outcome of a case and its drive: the first bad outcome, the case's flags in brackets, advice on that outcome."""
    good = (COMPLETED, "")
    ending, message = next((ended for ended in _endings(values).values() if ended != good), good)
    flags = decode_flags(int(values[variables.VALIDITY.name])) if variables.VALIDITY.name in values else ()
    names = ", ".join(flag.name for flag in flags)
    return ending, f" [{names}]" if flags else "", f": {message}" if message else ""
