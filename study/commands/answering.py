"""The answer of a case in a line: friction with the ± of its starts, and the other main errors."""

import math
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
import xarray as xr

from nanoslip.solver.sliding.validity import decode_flags
from nanoslip.study.accuracy.deciding import (
    MAIN,
    SECONDS,
    Deciding,
    deciding,
    deciding_lines,
    missing_words,
    numbers_of_tasks,
    times,
)
from nanoslip.study.dataset.table import case_rows
from nanoslip.study.dataset.units import symbol
from nanoslip.study.dataset.variables import DRIVE_NAME, VALIDITY, fewer, missing_error_reasons, variables_by_name
from nanoslip.study.manifest.cases import CampaignCase, expand
from nanoslip.study.manifest.manifest import CampaignDrive, Manifest, drive_sizes
from nanoslip.study.manifest.parameters import YOUNG, as_written, compact
from nanoslip.study.report import budget, single_case, summary
from nanoslip.study.report.console import Table, note
from nanoslip.study.run.progress import roughly
from nanoslip.study.toml_text import from_toml


def influences_on_case(
    case: xr.Dataset, manifest: Manifest, of: CampaignCase, out: Path | None, most: float, case_rate: float = math.inf
) -> Deciding | None:
    """Influences on a computed case beside its starts; None if its main number is unknown.

    out, most, case_rate: see `deciding`.
    """
    if of.case is None:
        return None
    # A critical velocity that was asked for is the answer; then the requested numbers; the last one every case has.
    for main in ("critical_velocity", *summary.main_numbers(case), MAIN["slip" in manifest.stages]):
        computed = main in case and main in numbers_of_tasks()
        if computed and not case[main].dims and math.isfinite(float(case[main])):
            first = _first_drive(case, manifest)
            drive = first.drive if first else None
            return deciding(manifest, of, main, most, out, drive, _report_grid_time, case_rate)
    return None


def _report_grid_time(n_x: int, seconds: float) -> None:
    """Report a grid that is computed to find the main errors, and its time, unless that is short."""
    if seconds >= 1.0:
        note(f"computing n_x = {n_x}, {roughly(seconds)}", stderr=True)


def _first_drive(case: xr.Dataset, manifest: Manifest) -> CampaignDrive | None:
    """The drive of a case of a dataset; of several the first, None without any."""
    scalars = [coordinate for coordinate in case.coords.values() if not coordinate.dims]
    coordinates = {str(coordinate.name): coordinate.item() for coordinate in scalars}
    for drive in manifest.drives:
        labels = {DRIVE_NAME.name: drive.name, **drive.point}
        if all(coordinates.get(name, value) == value for name, value in labels.items()):
            return drive
    return None


def friction_answer(
    case: xr.Dataset,
    manifest: Manifest,
    of: CampaignCase,
    stated: Collection[str],
    out: Path | None,
    case_rate: float = math.inf,
) -> list[str]:
    """Friction of a case with its ± in a line, then a line for each cause that decides it beside the starts.

    stated: parameters that its author gave. out, case_rate: see `deciding`.
    """
    names = list(single_case.answer_values(case))
    influences = influences_on_case(case, manifest, of, out, SECONDS, case_rate)
    if influences is None:
        return [single_case.answer(case)]
    number = "" if names == [influences.variable] else f"{number_name(influences.variable)} "
    parts = [single_case.answer_numbers(case)]
    if "critical_velocity" in case:
        parts.insert(0, critical_words(case))
        names.insert(0, summary.CRITICAL)
    parts[-1] += _error_remarks(case, names)
    # F/W alone says nothing of another load, where part of the friction needs no pressure.
    if of.case and of.case.slip_rule.strength > 0.0 and math.isfinite(float(case.get(STRESS, math.nan))):
        parts.append(single_case.with_meaning(case, STRESS))
    lines = ["; ".join(parts), *single_case.failure_lines(case)]
    mask = int(case.get(VALIDITY.name, 0))
    flags = ", ".join(flag.name for flag in decode_flags(mask))
    if flags:
        lines.append(f"flagged {flags}")
    defaults = _defaults(case, manifest, of, stated)
    return [*lines, *deciding_lines(influences, number), *defaults]


def _error_remarks(case: xr.Dataset, names: Collection[str]) -> str:
    """Parts of the ± of these numbers, or the reason why they have none, in brackets."""
    errors = [float(case.get(f"{name}_uncertainty", 0.0)) for name in names]
    has_error = any(0.0 < error < math.inf for error in errors)
    remarks = ["± by starts alone"] if has_error else []
    remarks += filter(None, [missing_error_reasons(case, names)])
    return f" ({'; '.join(remarks)})" if remarks else ""


STRESS: Final = "plateau_stress"
"""Friction over the true contact area."""


def number_name(variable: str) -> str:
    """Title of a number in tables; for a number with a unit, its symbol."""
    if variables_by_name()[variable].units != "1":
        return symbol(variable)
    return summary.SHOWN.get(variable, symbol(variable))


_DECIDE: Final = ("intrinsic_friction", "radius", "normal_load", "n_x")
"""Parameters that decide the answer of a case; the first one only if it slides."""


def _defaults(case: xr.Dataset, manifest: Manifest, of: CampaignCase, names_given: Collection[str]) -> Iterator[str]:
    """The deciding parameters that nobody gave, in a line: `not given, so by default: μ_i = 0.5, k = 200 kN/m`."""
    assert of.case is not None
    decide = _DECIDE["slip" not in manifest.stages :]
    flat = of.case.flat
    not_given = [name for name in flat if name not in names_given]
    values = {name: flat[name] for name in not_given if name in decide}
    scales = manifest.stated_scales
    sizes = [summary.label_text(values, scales)] if values else []
    stated = from_toml(manifest.text).get("scales", {})
    if scales and not {"shear_modulus", YOUNG} & stated.keys():
        sizes.append(f"G = {compact(scales.shear_modulus, 'Pa')}")
    drive = _first_drive(case, manifest)
    if drive and drive.drive:
        parameters = drive.drive.flat.items()
        defaults = {name: value for name, value in parameters if name not in drive.given}
        sizes += drive_sizes({name: (value,) for name, value in defaults.items() if value is not None})
    if sizes:
        yield f"not given, so by default: {', '.join(sizes)}"


def critical_words(case: xr.Dataset) -> str:
    """Critical velocity at the drive's stiffness in a sentence, with its ± and the range of its starts; or why there is none."""
    name, spring = summary.CRITICAL, compact(float(case["spring_stiffness"]), "N/m")
    value = float(case.get(name, math.nan))
    if math.isfinite(value):
        error = float(case.get(f"{name}_uncertainty", math.nan))
        velocity = compact(value, as_written(variables_by_name()[name].units), error)
        remarks = "; ".join((*single_case.start_range(case, name), _BELOW))
        return f"no stick-slip above stage velocity {velocity}{fewer(case, name)} ({remarks}) at {spring}"
    search = f"{name}_search"
    tally = case_rows(case, search).tallies(search)[0]
    starts = sum(tally.values())
    results = [f"{_SEARCH[word]} in {count} of {starts} starts" for word, count in tally.items()]
    # Where all starts agree, their number tells nothing more.
    if len(tally) == 1:
        results = [_SEARCH[word] for word in tally]
    return f"no critical velocity at {spring}: {', '.join(results)}"


_BELOW: Final = "below, windows of sliding or micro-slip are possible"
"""Meaning of a critical velocity, which is found from above."""
_SEARCH: Final = {
    "found": "one",
    "always_sticks": "the pin sticks at all velocities tried",
    "never_sticks": "the pin sticks at none of the velocities tried",
    "unknown": "not known, as a drive fails or has no damper",
}
"""Result of a search for a critical velocity, in words."""


def middle_answer(dataset: xr.Dataset, manifest: Manifest, out: Path) -> str:
    """The answer of a campaign's middle case that is possible, with its parameters; empty if there is none.

    out: folder of the campaign.
    """
    possible = [campaign_case for campaign_case in expand(manifest) if campaign_case.case]
    if not possible:
        return ""
    # An end of an axis is often a limit at which something else decides.
    middle = possible[len(possible) // 2]
    ids = dataset["case_id"]
    places = np.argwhere(ids.values == middle.case_id)
    place = places[0].tolist()
    selection = dict(zip(ids.dims, place, strict=True))
    case = dataset.isel(selection).squeeze()
    axes = [name for name in manifest.axes if name in middle.parameters]
    parameters = {name: middle.parameters[name] for name in axes}
    label = summary.label_text(parameters, manifest.stated_scales)
    where = f"The middle of {len(possible)} cases, {label}" if len(possible) > 1 else "Answer"
    stated = {*manifest.fixed, *manifest.axes}
    answer = "; ".join(friction_answer(case, manifest, middle, stated, out))
    return f"{where}: {answer}." if answer else ""


# `nanoslip explain`: everything that decides the main number of a case, the largest first.

_HEADER = ("what decides", "by", "to know better")
NOT_MEASURED: Final = "not measured"
"""Cell of a share that nothing here computes."""


class Ranking(NamedTuple):
    """Influences on one number of a case."""

    variable: str
    title: str
    """Symbol and value of the number."""
    table: Table


def ranking(
    case: xr.Dataset, manifest: Manifest, of: CampaignCase, cost: str, most: float, out: Path
) -> Ranking | None:
    """The main number of a case with its value, and its errors, the largest first; None if it is unknown.

    cost: of four times its members, in words. most, out: see `deciding`.
    """
    influences = influences_on_case(case, manifest, of, out, most)
    if influences is None:
        return None
    # The number's own errors first, then those of the model that it comes from.
    name, value = influences.variable, float(case[influences.variable])
    model_errors = _model_errors(case, influences, value)
    errors = [*budget.error_parts(case, name, cost), *model_errors]
    errors.sort(key=budget.share_rank)
    rows = [(error.source, _share_text(error.share), error.cure) for error in errors]
    if not influences.computed:
        reasons = "; ".join(map(missing_words, influences.spacings))
        rows.append((_SPACING, NOT_MEASURED, reasons))
    assert of.case is not None
    if "y" not in of.case.slab.layout.AXES:
        rows.append(("the third dimension", NOT_MEASURED, "a scheme in three dimensions: this is plane strain"))
    title = f"{number_name(name)} {value:.4g}"
    return Ranking(name, title, Table(_HEADER, tuple(rows), labels=2))


_SPACING: Final = "the node spacing"


def _share_text(share: float) -> str:
    """A share of an error in percent, or that nothing measures it."""
    return f"{share:.1%}" if math.isfinite(share) else NOT_MEASURED


def _percent(share: float, error: float) -> str:
    """A share with its ±, ? if unknown."""
    uncertainty = f"{100.0 * error:.1f}" if math.isfinite(error) else "?"
    return f"{100.0 * share:.1f} ± {uncertainty} %"


def _model_errors(case: xr.Dataset, influences: Deciding, value: float) -> Iterator[budget.Error]:
    """Node spacing and drop of a slip as parts of a number's error, where they are known."""
    if influences.computed:
        yield _spacing_error(case, influences, value)
    if math.isfinite(influences.without_drop):
        contact = value
        if influences.variable == "static_friction":
            # What inertia and damper add does not depend on the drop of a slip.
            contact -= float(case.get("static_friction_excess", 0.0))
        share = abs(influences.without_drop / contact - 1.0)
        cure = "residual_shear from 0 to 1: nanoslip fit finds it from measured friction"
        yield budget.Error("slips that drop no stress", share, cure)
    if influences.strength > 0.0:
        cure = "measure friction under several loads: F/W that falls with the load is the strength's"
        yield budget.Error("the strength without pressure", influences.strength, cure)


def _spacing_error(case: xr.Dataset, influences: Deciding, value: float) -> budget.Error:
    """Change of a number by other node spacings, as a part of its error: the largest."""
    case_error = float(case.get(f"{influences.variable}_uncertainty", math.nan))
    shares, parts = [], []
    for spacing in influences.computed:
        share = abs(spacing.value / value - 1.0)
        error = math.hypot(case_error, spacing.error) / abs(value)
        shares.append(share)
        parts.append(f"{times(spacing)} the spacing (n_x = {spacing.n_x}): {_percent(share, error)}")
    parts += [missing_words(spacing) for spacing in influences.spacings if not spacing.has_value]
    parts.append("set n_x to the spacing of what slips on your surface")
    # Neither spacing is right: the larger change is the safer estimate.
    return budget.Error(_SPACING, max(shares), "; ".join(parts))
