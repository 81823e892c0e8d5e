"""Every number that is known of one case, with its uncertainty, unit and meaning; and the names of those that are not."""

import math
from collections.abc import Iterator
from typing import Any, Final

import xarray as xr

from solver.view import with_error
from study.dataset.collection.counted import in_short, joined
from study.dataset.members import fewer, means_of, modelled
from study.dataset.variables import OUTCOMES, VALIDITY, all_groups
from study.figures.sweep.label import readable
from study.report.common import plain
from study.report.console import Table

_UNCERTAINTY: Final = "_uncertainty"
_SAID_APART: Final = {
    *(each.name for both in OUTCOMES.values() for each in both),
    *(group.id.name for group in all_groups().values()),
    VALIDITY.name,
    "advice",
    "computed_by",
    "drive_computed_by",
}
"""What is no number of the case, or is said in its line."""


def case_table(case: xr.Dataset) -> tuple[Table, list[str]]:
    """Name, value with its unit, and meaning of each scalar that one case has, and the names of those that it lacks (NaN, empty).

    case: of study.dataset.access.single; what lies along a dimension is left out.
    """
    rows, missing = [], []
    case = in_short(case)
    for name, each in _scalars(case):
        value = each.item()
        if value == "" or (isinstance(value, float) and math.isnan(value)):
            missing.append(name)
        else:
            meaning, unit = _meaning_and_unit(each)
            rows.append(
                (name, f"{_shown(value, _uncertainty(case, each))} {unit}".rstrip() + fewer(case, name), meaning)
            )
    return Table(("quantity", "value", "meaning"), tuple(rows), labels=2, prose=True), missing


def ending_lines(case: xr.Dataset) -> Iterator[str]:
    """Outcomes of a case and its drive with their messages, advice for validity flags, and what its means and ± are."""
    for label, (ending, message) in zip(("outcome", "drive"), (OUTCOMES[""], OUTCOMES["drive"]), strict=True):
        if ending.name in case and not case[ending.name].dims:
            why = joined(str(case[message.name].item()))
            yield f"{label}: {case[ending.name].item()}" + (f": {why}" if why else "")
    if "advice" in case and (advice := joined(str(case["advice"].item()))):
        yield f"advice: {advice}"
    yield from filter(None, [means_of(case), modelled(case)])


def _scalars(case: xr.Dataset) -> Iterator[tuple[str, xr.DataArray]]:
    """What is shown of a case: ± and count of members are shown with their variable."""
    for name in map(str, case.data_vars):
        if not case[name].dims and name not in _SAID_APART and not name.endswith((_UNCERTAINTY, "members")):
            yield name, case[name]


def _uncertainty(case: xr.Dataset, each: xr.DataArray) -> float | None:
    """The ± of a number, NaN where it is not known; None of a number that has none."""
    name = f"{each.name}{_UNCERTAINTY}"
    return float(case[name]) if name in case else None


def _shown(value: Any, uncertainty: float | None) -> str:
    """A number, rounded beside an uncertainty as in the table of cases."""
    if uncertainty is not None:
        return with_error(value, uncertainty)
    return plain(value, 6) if isinstance(value, float) else str(value)


def _meaning_and_unit(each: xr.DataArray) -> tuple[str, str]:
    """What a number is, and its unit: one of SI, or what its meaning says that it is measured in."""
    meaning, unit = str(each.attrs["long_name"]), readable(str(each.attrs.get("units", "1")))
    if unit:
        return meaning, unit
    head, _, own = meaning.partition(", in ")
    return head, own
