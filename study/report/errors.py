"""Error budget of each requested number (starts, grid, effects left out), and how to reduce it."""

import math
from collections.abc import Iterator, Mapping
from typing import Final, NamedTuple

import xarray as xr

from nanoslip.solver.effects import LeftOut
from nanoslip.solver.parameter import GRID_ERROR, quantities
from nanoslip.solver.sliding.validity import advice_on, flags_in
from nanoslip.solver.view import with_error
from nanoslip.study.dataset import variables
from nanoslip.study.report import summary

UNRESOLVED: Final = "unresolved"
"""Flags that begin so say that nodes miss what numbers depend on; by how much these change, no dataset knows."""
_LEFT_OUT, _LEFT_OUT_ERROR = (each.name for each in quantities(LeftOut).values())


class Error(NamedTuple):
    """A part of a number's error, relative to the number, and how to reduce it."""

    source: str
    share: float
    cure: str


def errors_of(case: xr.Dataset, name: str, cost: str = "", measured: Mapping[str, Error] | None = None) -> list[Error]:
    """The known parts of the error of a number of one case, the largest first.

    cost: of three times its members, in words. measured: other known parts, by name.
    """
    found = [measured[name]] if measured and name in measured else []
    attributes, value = case[name].attrs.get("ancillary_variables", ""), abs(float(case[name]))
    if f"{name}{summary.UNCERTAINTY}" in case and value > 0.0:
        members = int(case.get(f"{name}_members", case[variables.MEMBERS.name]))
        share = float(case[f"{name}{summary.UNCERTAINTY}"]) / value
        found.append(Error("starts", share, f"{4 * members} members halve it{cost and f': {cost} more'}"))
    if GRID_ERROR in attributes and GRID_ERROR in case:
        found.append(Error("the grid", float(case[GRID_ERROR]), "a finer grid"))
    if _LEFT_OUT_ERROR in case and case[_LEFT_OUT].item() != "nothing":
        left_out = f"{str(case[_LEFT_OUT].item()).replace('_', ' ')} left out"
        found.append(Error(left_out, float(case[_LEFT_OUT_ERROR]), "half of target.within halves it"))
    return sorted((each for each in found if each.share > 0.0), key=lambda each: -each.share)


def error_lines(
    dataset: xr.Dataset, cost: str = "", measured: Mapping[str, Error] | None = None, most: int = 1
) -> Iterator[str]:
    """A line for each requested number of the first cases or drives: its value and the largest part of its error.

    cost, measured: see `errors_of`.
    """
    of = dataset["static_friction" if "static_friction" in dataset else "outcome"]
    asked = summary.asked_of(dataset) or ["contact_half_width"]
    asked = [name for name in asked if name in dataset and dataset[name].dtype.kind == "f"]
    for case in summary.each_case(dataset, of, most):
        place = summary.words({str(dim): case[dim].item() for dim in of.dims if dataset.sizes[dim] > 1})
        for name in asked:
            yield _line(case, name, f" ({place})" if place else "", errors_of(case, name, cost, measured))
    mask = int(dataset[variables.VALIDITY.name].values.flat[0]) if variables.VALIDITY.name in dataset else 0
    if unresolved := [flag for flag in flags_in(mask) if flag.name.startswith(UNRESOLVED)]:
        yield f"nodes miss part of what these numbers depend on: {advice_on(unresolved)}"
    unknown = [name for name in asked if GRID_ERROR not in dataset[name].attrs.get("ancillary_variables", "")]
    if unknown and not measured:
        yield f"the grid's part of {', '.join(unknown)} is not known; explain --grid measures it"


def _line(case: xr.Dataset, name: str, where: str, errors: list[Error]) -> str:
    value, error = float(case[name]), float(case.get(f"{name}{summary.UNCERTAINTY}", math.nan))
    if math.isnan(value):
        return f"{name}{where}: not known"
    if not errors:
        return f"{name} {value:.4g}{where}: one start has no ±: ensemble.members = 8 tell"
    first, *others = errors
    beside = "".join(f"; {each.source} {each.share:.1%}" for each in others)
    verb = "dominates" if first.source.startswith("the ") else "dominate"
    return f"{name} {with_error(value, error)}{where}: {first.source} {verb} ({first.share:.1%}), {first.cure}{beside}"
