"""Whether the numbers of shared cases agree: the same bits, within their uncertainties, or beyond them."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import xarray as xr

from solver.quantity import GRID_ERROR
from study.dataset.access.tidy import values_over
from study.dataset.agreement.matching import Matched, Pair, ending_of
from study.dataset.collection.ensemble import PARTS, ensemble_name, observables
from study.dataset.comparison import ROUNDING, Verdict, identical, magnitude
from study.dataset.variables import COMPUTED_BY, DRIVE, MEMBERS_USED, OUTCOMES, all_groups, companions, scalars
from study.manifest.parameters import Value

STANDARD_DEVIATIONS: Final = 2.0
"""Combined ones by which two numbers may differ and still agree."""


@dataclass(frozen=True, slots=True)
class Observed:
    """One number or word of one shared case, in both datasets."""

    label: dict[str, Value]
    name: str
    values: tuple[Any, Any]
    verdict: Verdict | None
    """None where they differ, and how uncertain one of them is, is not known."""
    apart: float
    """Difference in combined standard deviations; infinite where one is missing or a word, NaN where these are not known."""


def observed(pair: Pair, kind: str, found: Matched) -> Iterator[Observed]:
    """Every number that states an uncertainty, and every word, of the shared cases ("") or drives."""
    for name in _names(pair, kind):
        if _judged(pair, name):
            columns = [_values(root, kind, name) for root in pair]
            errors = [_errors(root, kind, name) for root in pair]
            scale = magnitude(np.array(columns[0] + columns[1])) if _number(pair, name) else 0.0
            for label, at in zip(found.labels, found.rows, strict=True):
                both = columns[0][at[0]], columns[1][at[1]]
                yield Observed(label, name, both, *_verdict(both, (errors[0][at[0]], errors[1][at[1]]), scale))


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
    apart |= {ensemble_name(name, part) for name in observables() for part in PARTS}
    apart.add(MEMBERS_USED.name)
    both = [str(name) for name in pair[0].data_vars if name in pair[1].data_vars and name not in apart]
    told = ("_uncertainty", ensemble_name("", "members"))
    return [name for name in both if (name in of_drives) == bool(kind) and not name.endswith(told)]


def _judged(pair: Pair, name: str) -> bool:
    return not _number(pair, name) or all(_error_of(root, name) for root in pair)


def _number(pair: Pair, name: str) -> bool:
    return pair[0][name].dtype.kind in "fiub"


def _values(root: xr.Dataset, kind: str, name: str) -> list[Any]:
    return values_over(root[name], ending_of(root, kind))


def _error_of(root: xr.Dataset, name: str) -> str:
    """The variable that says how uncertain another is; empty where none does."""
    error = str(root[name].attrs.get("ancillary_variables", ""))
    return error if error in root else ""


def _errors(root: xr.Dataset, kind: str, name: str) -> list[float]:
    """The standard deviations that a dataset states; that of the grid is a share of the number. NaN where none is known."""
    error = _error_of(root, name)
    if not error:
        return [math.nan] * ending_of(root, kind).size
    stated = root[error] * abs(root[name]) if error == GRID_ERROR else root[error]
    return values_over(stated, ending_of(root, kind))


def _verdict(both: tuple[Any, Any], errors: tuple[float, float], scale: float) -> tuple[Verdict | None, float]:
    here, there = (np.array(value) for value in both)
    if identical(here, there):
        return Verdict.IDENTICAL, 0.0
    difference = abs(both[0] - both[1]) if here.dtype.kind in "fiu" else math.nan
    if math.isnan(difference):
        return Verdict.DIFFERENT, math.inf
    known = [error for error in errors if not math.isnan(error)]
    combined = math.hypot(*known)
    apart = difference / combined if combined > 0.0 else math.inf
    if difference <= ROUNDING * scale or apart <= STANDARD_DEVIATIONS:
        return Verdict.WITHIN, apart
    return (Verdict.DIFFERENT, apart) if len(known) == len(errors) else (None, math.nan)
