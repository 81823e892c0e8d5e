"""Error budget of each requested number (starts, grid, effects left out), and how to reduce it."""

import math
from collections.abc import Iterator, Mapping
from typing import Final, NamedTuple

import numpy as np
import xarray as xr

from nanoslip.solver.effects import LeftOut
from nanoslip.solver.parameter import GRID_ERROR, quantities
from nanoslip.solver.sliding.validity import advice_on, flags_in
from nanoslip.solver.view import with_error
from nanoslip.study.dataset import variables
from nanoslip.study.figures.points import symbol
from nanoslip.study.report import summary

UNRESOLVED: Final = "unresolved"
"""Flags that begin so say that nodes miss what numbers depend on; by how much these change, no dataset knows."""
_LEFT_OUT, _LEFT_OUT_ERROR = (each.name for each in quantities(LeftOut).values())


class Error(NamedTuple):
    """A part of a number's error, relative to the number, and how to reduce it."""

    source: str
    share: float
    cure: str


def _parts(dataset: xr.Dataset, name: str) -> dict[str, xr.DataArray]:
    """The known parts of a number's error, relative to it, of all cases; by what they come from."""
    attributes, value = dataset[name].attrs.get("ancillary_variables", ""), abs(dataset[name])
    found = {}
    if f"{name}{summary.UNCERTAINTY}" in dataset:
        found["starts"] = dataset[f"{name}{summary.UNCERTAINTY}"] / value.where(value > 0.0)
    if GRID_ERROR in attributes and GRID_ERROR in dataset:
        found["the grid"] = dataset[GRID_ERROR]
    if _LEFT_OUT_ERROR in dataset:
        found[_LEFT_OUT] = dataset[_LEFT_OUT_ERROR].where(dataset[_LEFT_OUT] != "nothing")
    return found


def errors_of(case: xr.Dataset, name: str, cost: str = "", measured: Mapping[str, Error] | None = None) -> list[Error]:
    """The known parts of the error of a number of one case, the largest first.

    cost: of three times its members, in words. measured: what else is known, by name.
    """
    members = case.get(f"{name}_members", case.get(variables.MEMBERS.name, math.nan))
    cures = {
        "starts": f"{4 * float(members):g} members halve it{cost and f': {cost} more'}",
        "the grid": "a finer grid",
        _LEFT_OUT: "half of target.within halves it",
    }
    left_out = f"{str(case[_LEFT_OUT].item()).replace('_', ' ')} left out" if _LEFT_OUT in case else ""
    found = [measured[name]] if measured and name in measured else []
    for source, share in _parts(case, name).items():
        found.append(Error(left_out if source == _LEFT_OUT else source, float(share), cures[source]))
    return sorted((each for each in found if each.share > 0.0), key=lambda each: -each.share)


LARGEST: Final = "largest_error"
"""Column of tables of cases."""


def _asked(dataset: xr.Dataset) -> list[str]:
    asked = summary.asked_of(dataset) or ["contact_half_width"]
    return [name for name in asked if name in dataset and dataset[name].dtype.kind == "f"]


def with_largest(dataset: xr.Dataset) -> xr.Dataset:
    """A dataset of several cases with `largest_error` of each: of the numbers asked for, and what it comes from."""
    of = summary.cases_of(dataset)
    parts = {(name, source): share for name in _asked(dataset) for source, share in _parts(dataset, name).items()}
    if of.size == 1 or not parts:
        return dataset
    shares = np.stack(
        [np.asarray(share.broadcast_like(of).transpose(*of.dims).fillna(0.0)) for share in parts.values()]
    )
    words = [f"{summary.SHOWN.get(name, symbol(name))} {{:.1%}}, {source.replace('_', ' ')}" for name, source in parts]
    texts = [
        words[which].format(share) if share else summary.NOTHING
        for which, share in zip(shares.argmax(0).ravel(), shares.max(0).ravel(), strict=True)
    ]
    return dataset.assign({LARGEST: (of.dims, np.array(texts, object).reshape(of.shape))})


def spread_lines(dataset: xr.Dataset) -> Iterator[str]:
    """A line for each number asked for, over all cases: from the least to the most of its largest error, and what that is.

    Of a single case `error_lines`.
    """
    of = summary.cases_of(dataset)
    what = "cases" if of.name == "outcome" else "drives"
    if of.size == 1:
        yield from error_lines(dataset)
        return
    for name in _asked(dataset):
        parts = {source: share.broadcast_like(of).fillna(0.0) for source, share in _parts(dataset, name).items()}
        largest = np.max([share.values for share in parts.values()], axis=0, initial=0.0)
        known = largest > 0.0
        ruling = ((source, int((known & (share.values == largest)).sum())) for source, share in parts.items())
        named = ", ".join(f"{source.replace('_', ' ')} in {count}" for source, count in ruling if count)
        if named:
            span = f"{largest[known].min():.1%} to {largest.max():.1%} in {known.sum()} of {of.size} {what}"
            yield f"{name}: {span}; largest: {named}"
    yield f"nanoslip explain says how to make each smaller; {_UNKNOWN}"


_UNKNOWN: Final = "nanoslip explain --grid measures what a finer grid changes"


def error_lines(
    dataset: xr.Dataset, cost: str = "", measured: Mapping[str, Error] | None = None, most: int = 1
) -> Iterator[str]:
    """A line for each number asked for, of so many cases or drives: its value, and what its error is mostly made of.

    cost, measured: see `errors_of`.
    """
    cases, asked = summary.cases_of(dataset), _asked(dataset)
    attributes = {name: dataset[name].attrs.get("ancillary_variables", "") for name in asked}
    partly = [name for name in asked if not measured and GRID_ERROR not in attributes[name]]
    if cases.size > most > 1:
        yield f"{most} of {cases.size} drives, the first to the last:"
    for case in summary.each_case(dataset, cases, most):
        place = summary.words({str(dim): case[dim].item() for dim in cases.dims if dataset.sizes[dim] > 1})
        for name in asked:
            of = "of what is known, " if name in partly else ""
            yield _line(case, name, f" ({place})" if place else "", of, errors_of(case, name, cost, measured))
    mask = int(dataset[variables.VALIDITY.name].values.flat[0]) if variables.VALIDITY.name in dataset else 0
    if unresolved := [flag for flag in flags_in(mask) if flag.name.startswith(UNRESOLVED)]:
        yield f"nodes miss part of what these numbers depend on: {advice_on(unresolved)}"
    if partly:
        yield f"the grid's part of {', '.join(partly)} is not known; {_UNKNOWN}"


def _line(case: xr.Dataset, name: str, where: str, of: str, errors: list[Error]) -> str:
    value, error = float(case[name]), float(case.get(f"{name}{summary.UNCERTAINTY}", math.nan))
    if math.isnan(value):
        return f"{name}{where}: not known"
    if not errors:
        return f"{name} {value:.4g}{where}: no ± without several starts that differ (ensemble.members)"
    first, *others = errors
    beside = "".join(f"; {each.source} {each.share:.1%}" for each in others)
    verb = "dominates" if first.source.startswith("the ") else "dominate"
    return (
        f"{name} {with_error(value, error)}{where}: {of}{first.source} {verb} ({first.share:.1%}), {first.cure}{beside}"
    )
