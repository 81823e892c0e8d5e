"""Whether the numbers of shared cases agree: the same bits, within their uncertainties, or beyond them."""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import xarray as xr

from nanoslip.solver.parameter import GRID_ERROR
from nanoslip.study.dataset.access.tidy import values_over
from nanoslip.study.dataset.agreement.matching import Matched, Pair, ending_of
from nanoslip.study.dataset.comparison import ROUNDING, Verdict, identical, magnitude
from nanoslip.study.dataset.variables import (
    COMPUTED_BY,
    DRIVE,
    MEMBERS,
    OUTCOMES,
    all_groups,
    companions,
    scalars,
)
from nanoslip.study.manifest.parameters import Value

STANDARD_DEVIATIONS: Final = 2.0
"""Combined ones by which two numbers may differ and still agree."""
TELLING: Final = 4
"""Members of each ensemble from which on it tells that all of one say another word than all of the other.

Were both words as likely in both, four and four members would be apart like that 2 times in 70: less often than two numbers
are by `STANDARD_DEVIATIONS`.
"""
_COUNTED: Final = re.compile(r"\d+ ")
"""How words begin on which members do not agree."""


Judged = tuple[Verdict | None, float]
"""A verdict, and how far apart both are, as `Observed` has them."""
_APART: Final[Judged] = (Verdict.DIFFERENT, math.inf)
"""Of what cannot be subtracted."""
_NOT_KNOWN: Final[Judged] = (None, math.nan)


@dataclass(frozen=True, slots=True)
class Observed:
    """One number or word of one shared case, in both datasets."""

    label: dict[str, Value]
    name: str
    values: tuple[Any, Any]
    verdict: Verdict | None
    """None where they differ, and how uncertain one of them is, is not known; of an ensemble a missing number and most words."""
    apart: float
    """Difference in combined standard deviations; infinite where one is missing or a word, NaN where these are not known."""


def observed(pair: Pair, kind: str, found: Matched) -> Iterator[Observed]:
    """Every number that states an uncertainty, and every word, of the shared cases ("") or drives."""
    for name in _names(pair, kind):
        if _judged(pair, name):
            columns = [_values(root, kind, name) for root in pair]
            errors = [_errors(root, kind, name) for root in pair]
            members = [_members(root, kind) for root in pair]
            scale = magnitude(np.array(columns[0] + columns[1])) if _number(pair, name) else 0.0
            for label, at in zip(found.labels, found.rows, strict=True):
                both = columns[0][at[0]], columns[1][at[1]]
                of_both = members[0][at[0]], members[1][at[1]]
                verdict = _verdict(both, (errors[0][at[0]], errors[1][at[1]]), scale)
                yield Observed(label, name, both, *(_NOT_KNOWN if _by_chance(both, verdict, of_both) else verdict))


def unjudged(pair: Pair, kind: str, found: Matched) -> tuple[list[str], list[str]]:
    """The numbers that state no uncertainty: those that differ in any shared case, and those that do not."""
    differing: list[str] = []
    same: list[str] = []
    for name in _names(pair, kind):
        if not _judged(pair, name):
            columns = [_values(root, kind, name) for root in pair]
            picked = [np.array([column[at[side]] for at in found.rows]) for side, column in enumerate(columns)]
            (same if identical(*picked) else differing).append(name)
    return differing, same


def _names(pair: Pair, kind: str) -> list[str]:
    """The variables of cases or drives that both have; not those that are said of another, or say who computed it."""
    of_drives = {each.name for known in (scalars(DRIVE), companions(DRIVE)) for each in known.values()}
    of_drives |= {each.name for each in OUTCOMES[DRIVE]}
    apart = {each.name for each in COMPUTED_BY.values()} | {message.name for _, message in OUTCOMES.values()}
    apart |= {group.id.name for group in all_groups().values()} | {"advice", GRID_ERROR}
    both = [str(name) for name in pair[0].data_vars if name in pair[1].data_vars and name not in apart]
    told = ("_uncertainty", "members")
    return [name for name in both if (name in of_drives) == bool(kind) and not name.endswith(told)]


def _judged(pair: Pair, name: str) -> bool:
    return not _number(pair, name) or all(_error_of(root, name) for root in pair)


def _number(pair: Pair, name: str) -> bool:
    return pair[0][name].dtype.kind in "fiub"


def _values(root: xr.Dataset, kind: str, name: str) -> list[Any]:
    return values_over(root[name], ending_of(root, kind))


def _error_of(root: xr.Dataset, name: str) -> str:
    """The variable that says how uncertain another is; empty where none does."""
    error = f"{name}_uncertainty"
    return error if error in root else ""


def _errors(root: xr.Dataset, kind: str, name: str) -> list[float]:
    """The ± that a dataset states; NaN where none is known."""
    error = _error_of(root, name)
    if not error:
        return [math.nan] * ending_of(root, kind).size
    return values_over(root[error], ending_of(root, kind))


def _members(root: xr.Dataset, kind: str) -> list[float]:
    """How many members each row is of; NaN where it is one case."""
    if MEMBERS.name in root:
        return values_over(root[MEMBERS.name], ending_of(root, kind))
    return [math.nan] * ending_of(root, kind).size


def _by_chance(both: tuple[Any, Any], verdict: Judged, members: tuple[float, float]) -> bool:
    """Whether what cannot be subtracted may differ for the choice of members alone."""
    if verdict != _APART or all(map(math.isnan, members)):
        return False
    if not all(isinstance(value, str) for value in both):
        return any(value != value for value in both)  # noqa: PLR0124  only NaN is not itself
    return any(map(_COUNTED.match, both)) or not all(count >= TELLING for count in members)


def _verdict(both: tuple[Any, Any], errors: tuple[float, float], scale: float) -> Judged:
    here, there = (np.array(value) for value in both)
    if identical(here, there):
        return Verdict.IDENTICAL, 0.0
    difference = abs(both[0] - both[1]) if here.dtype.kind in "fiu" else math.nan
    if math.isnan(difference):
        return _APART
    known = [error for error in errors if not math.isnan(error)]
    combined = math.hypot(*known)
    apart = difference / combined if combined > 0.0 else math.inf
    if difference <= ROUNDING * scale or apart <= STANDARD_DEVIATIONS:
        return Verdict.WITHIN, apart
    return (Verdict.DIFFERENT, apart) if len(known) == len(errors) else _NOT_KNOWN
