"""Error budget of each requested number of a dataset (starts, grid, effects left out), and how to reduce it."""

import math
from collections.abc import Collection, Iterator
from typing import Final, NamedTuple

import xarray as xr

from nanoslip.solver.parameter import SHARED_ERROR
from nanoslip.solver.sliding.record import SPACINGS
from nanoslip.solver.sliding.validity import Flag, decode_flags, flag_advice
from nanoslip.solver.view import with_error
from nanoslip.study.dataset import variables
from nanoslip.study.dataset.table import case_rows
from nanoslip.study.report.summary import LEFT_OUT, LEFT_OUT_ERROR, UNCERTAINTY, each_case, label_text, main_numbers


class Error(NamedTuple):
    """A part of a number's error, relative to the number, and how to reduce it."""

    source: str
    share: float
    """NaN if nothing measures it."""
    cure: str


SHARED: Final = "length of the record"
"""Part of ± that all starts share."""
LEAST_RECORD: Final = SPACINGS + 0.1
"""Node spacings of the shortest record that is advised: as many as show how much a start matters, and a run-in."""


def longer_record(case: xr.Dataset) -> str:
    """Advice to compute a case with a longer record, with the present length and the cost of the longer record."""
    spans = float(case.variables.get("record_spacings", math.nan))
    if not (math.isfinite(spans) and spans > 0.0):
        return "a longer record"
    longer = max(2.0 * spans, LEAST_RECORD)
    advice = f"limits.spacings = {longer:.2g}, in about {longer / spans:.2g} times the time"
    return f"{advice}: the record spans {spans:.2g} of the node spacings with which the surface repeats"


def error_parts(case: xr.Dataset, name: str, cost: str = "") -> list[Error]:
    """Parts of the error of a case's number, the largest first, unknown parts last.

    The part that all starts share is unknown where its record is flagged as short, whatever that record itself shows.
    cost: cost of four times as many members, in words.
    """
    parts = []
    if f"{name}{UNCERTAINTY}" in case:
        parts += _start_errors(case, name, cost)
    effect = "nothing"
    if LEFT_OUT.name in case:
        effect = str(case[LEFT_OUT.name].item())
    if effect != "nothing":
        share = float(case[LEFT_OUT_ERROR.name])
        parts.append(Error(f"{effect.replace('_', ' ')} left out", share, "half of target.within halves it"))
    # NaN stays: a part that nothing measures may have any size.
    errors = [part for part in parts if part.share != 0.0]
    return sorted(errors, key=share_rank)


def _start_errors(case: xr.Dataset, name: str, cost: str) -> list[Error]:
    """The part of a number's ± that starts differ in, and the part that they share."""
    # An error has no share of a number that is 0.
    value = abs(float(case[name])) or math.nan
    error = float(case[f"{name}{UNCERTAINTY}"])
    shared = float(case.variables.get(f"{name}{SHARED_ERROR}", 0.0))
    starts = math.nan
    if math.isfinite(shared):
        # Independent parts add in squares: what the starts do not share is the rest of ±.
        starts = math.sqrt(max(error**2 - shared**2, 0.0))
    all_members = case.variables.get(variables.MEMBERS.name, math.nan)
    members = float(case.variables.get(f"{name}_members", all_members))
    cure = f"[ensemble] members = {4.0 * members:g} halves this part{cost and f': {cost}'}"
    mask = int(case.variables.get(variables.VALIDITY.name, 0))
    short = Flag.short_record in decode_flags(mask)
    # A short record has too few events to show its own scatter.
    shared_share = math.nan if short and shared else shared / value
    of_starts = Error("starts", starts / value, cure)
    return [of_starts, Error(SHARED, shared_share, longer_record(case))]


def share_rank(part: Error) -> float:
    """Place of a part among others: the largest first, unknown ones last."""
    return -part.share if math.isfinite(part.share) else math.inf


def error_lines(dataset: xr.Dataset, cost: str = "", most: int = 1, apart: Collection[str] = ()) -> Iterator[str]:
    """Report, for each requested number of some cases or drives, its value and the main source of its error.

    cost: see `error_parts`. apart: numbers that are reported elsewhere.
    """
    rows = case_rows(dataset)
    names = main_numbers(dataset) or ["contact_half_width"]
    names = [name for name in names if name in dataset and name not in apart]
    shown = [name for name in names if dataset[name].dtype.kind == "f"]
    if len(rows) > most > 1:
        yield f"{most} of {len(rows)} drives, the first to the last:"
    several = [dim for dim, size in rows.sizes.items() if size > 1]
    for case in each_case(rows, most):
        label = {dim: case[dim].item() for dim in several}
        place = label_text(label)
        where = f" ({place})" if place else ""
        for name in shown:
            yield _line(case, name, where, error_parts(case, name, cost))
    mask = 0
    if variables.VALIDITY.name in dataset:
        mask = int(dataset[variables.VALIDITY.name].values.flat[0])
    unresolved = [flag for flag in decode_flags(mask) if flag.unresolved]
    if unresolved:
        yield f"nodes miss part of what these numbers depend on: {flag_advice(unresolved)}"


def _line(case: xr.Dataset, name: str, where: str, errors: list[Error]) -> str:
    value = float(case[name])
    error = float(case.variables.get(f"{name}{UNCERTAINTY}", math.nan))
    if math.isnan(value):
        return f"{name}{where}: not known"
    measured = [part for part in errors if math.isfinite(part.share)]
    if not measured:
        return f"{name} {value:.3g}{where} {variables.missing_error_reasons(case, [name])}"
    first, *others = measured
    beside = "".join(f"; {part.source} {part.share:.1%}" for part in others)
    largest = f"largest part of its error: {first.source} ({first.share:.1%})"
    return f"{name} {with_error(value, error)}{where}: {largest}, {first.cure}{beside}"
