"""A dataset and the same one computed again, side by side: first what all cases share, then case by case."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from study.dataset import file
from study.dataset.comparison import (
    ROUNDING,
    STANDARD_ERRORS,
    Difference,
    Verdict,
    compared,
    identical,
    magnitude,
    relative,
    within_uncertainty,
    worst,
)
from study.dataset.variables import (
    ABSENT,
    COMPUTED_BY,
    DISCRETIZATION_ERROR,
    OUTCOMES,
    SOFTWARE,
    Series,
    all_series,
    companions,
    scalars,
)
from study.manifest.cases import CampaignCase
from study.origin import Origin

LITTLE: Final = 1e-2
"""Share of its scale by which a number may differ that took another path and does not know its uncertainty."""
_NOT_COMPARED: Final = "not compared"
_SOFTWARE: Final = {quantity.name for quantity in COMPUTED_BY.values()}
_ADVICE: Final = {message.name for _, message in OUTCOMES.values()}


@dataclass(frozen=True, slots=True)
class Finding:
    """What came of one case, or of what all cases share."""

    label: str
    verdict: Verdict
    remark: str


def finding_of(label: str, differences: Sequence[Difference], remark: str = "") -> Finding:
    """The worst of some differences, in a line."""
    verdict = worst(differences)
    told = sorted((each for each in differences if each.verdict == verdict), key=lambda each: -each.size)
    if verdict is Verdict.IDENTICAL:
        return Finding(label, verdict, remark)
    others = list(dict.fromkeys(each.name for each in told if each.name != told[0].name))
    more = f", and {len(others)} more: " + ", ".join(others[:3]) if others else ""
    dots = ", ..." if len(others) > 3 else ""
    return Finding(label, verdict, "; ".join(part for part in (remark, f"{told[0]}{more}{dots}") if part))


class Shared:
    """Attributes, coordinates and the variables that there are at all."""

    def __init__(self, found: xr.Dataset, again: xr.Dataset) -> None:
        self._found, self._again = found, again
        same_front = found.attrs.get(_FRONT) == again.attrs.get(_FRONT)
        # A later package may come with a front measured anew: what it says of a grid is then another estimate.
        self.left_out = set() if same_front or "manifest_front" in again.attrs else {DISCRETIZATION_ERROR.name}

    @property
    def comparable(self) -> bool:
        """Whether the cases lie in the same places."""
        both = set(self._found.variables) & set(self._again.variables)
        lying = all(self._found[name].dims == self._again[name].dims for name in both)
        return lying and identical(self._found["case_id"].values, self._again["case_id"].values)

    def differences(self) -> list[Difference]:
        """How each attribute and each variable without a case of its own compares: one entry for each, identical ones too."""
        found, again = self._found, self._again
        names = {str(name) for name in (*found.variables, *again.variables)}
        missing = [_odd(name, "is missing") for name in sorted(names) if name not in found.variables]
        strange = [
            _odd(name, "is in no dataset of this manifest") for name in sorted(names) if name not in again.variables
        ]
        common = [name for name in sorted(names) if name in found.variables and name in again.variables]
        words = [
            compared(f"{kind} of {name}", np.array(one), np.array(other))
            for name in common
            for kind, one, other in _properties(found[name], again[name])
        ]
        values = [compared(name, found[name].values, again[name].values) for name in common if self._for_all(name)]
        return [*missing, *strange, *words, *self._attributes(), *values]

    def _for_all(self, name: str) -> bool:
        """Whether a variable belongs to no case, no run and no software alone."""
        dims = {str(dim) for dim in self._again[name].dims}
        apart = {SOFTWARE[0].name} | {part for series in all_series() for part in (series.instance, series.sample)}
        along = {str(dim) for dim in self._again["case_id"].dims}
        return not dims & apart and (name in self._again.coords or not dims & along)

    def _attributes(self) -> list[Difference]:
        apart = {item.name for item in fields(Origin)} | {file.MIXED} | ({_FRONT} if self.left_out else set())
        kept = self._found.attrs
        return [
            compared(f"attribute {name}", np.array(kept[name]), np.array(value))
            if name in kept
            else _odd(f"attribute {name}", "is missing")
            for name, value in self._again.attrs.items()
            if name not in apart
        ]


_FRONT: Final = "discretization_front"


class Pair:
    """A dataset and the same one computed again, case by case."""

    def __init__(self, found: xr.Dataset, again: xr.Dataset, left_out: set[str], missing: NDArray[np.bool_]) -> None:
        """missing: over the cases, those that the dataset has and that were not recomputed."""
        self._found, self._again, self._missing = found, again, missing
        self._series = all_series()
        self._along = tuple(map(str, again["case_id"].dims))
        apart = {series.index.name for series in self._series} | left_out | _SOFTWARE
        self._names = [
            str(name)
            for name, values in again.data_vars.items()
            if set(self._along) & set(values.dims) and str(name) not in apart and name in found.variables
        ]
        self._scales = {name: _scale(again[name]) for name in self._names}
        self._before_sliding, self._of_records = before_sliding(), of_records()
        self._parted, self._moved = (np.zeros(missing.shape, np.bool_) for _ in range(2))
        self._starts = {
            series.count.name: tuple(_starts(each[series.count.name].values) for each in (found, again))
            for series in self._series
            if series.count.name in found and series.count.name in again
        }

    def look(self, case: CampaignCase) -> None:
        """See whether a case's last digits moved, and whether its record took another path; for all of them first."""
        place = place_of(self._again, case.case_id) or {}
        names = [name for name in self._names if self._again.variables[name].dtype.kind == "f"]
        pairs = {name: (kept.values, now.values) for name, kept, now in self._pairs(place, names)}
        numbers = {name: pair for name, pair in pairs.items() if not np.isnan(pair).all()}
        self._moved[tuple(place.values())] = _half(not identical(*pair) for pair in numbers.values())
        self._parted[tuple(place.values())] = _half(
            relative(*pair, self._scales[name]) > ROUNDING for name, pair in numbers.items() if name in self._of_records
        )

    def _pairs(self, place: "Place", names: Sequence[str]) -> "Iterator[tuple[str, xr.Variable, xr.Variable]]":
        """Variables at a place, by name, as kept and as recomputed, where both have one shape."""
        kept, now = self._values(place, names)
        return ((name, kept[name], now[name]) for name in names if kept[name].shape == now[name].shape)

    def finding(self, case: CampaignCase) -> Finding:
        """What came of one case."""
        place = place_of(self._again, case.case_id) or {}
        parted = bool(self._parted[tuple(place.values())])
        # What is made of several cases, as the mean over an ensemble, needs all of them.
        names = [name for name in self._names if not self._missing[self._together(name, place)].any()]
        kept, now = self._values(place, names)
        moved = bool(self._moved[tuple(place.values())])
        differences = [
            self._scalar(name, kept, now, moved, bool(self._parted[self._together(name, place)].any()))
            for name in names
        ]
        for series in self._series:
            if series.count.name in self._starts and not (parted and series.kind != "contact"):
                differences += self._run(series, place, moved)
        turned = "its record takes" if parted else "a drive takes"
        elsewhere = parted or any(each.words == _NOT_COMPARED for each in differences)
        remark = f"{turned} another path: compared within uncertainties" if elsewhere else ""
        label = ", ".join(f"{name} = {value}" for name, value in case.parameters.items())
        return finding_of(label, differences, remark)

    def _together(self, name: str, place: "Place") -> tuple[Any, ...]:
        """The cases that a variable's value at a place is made of, as an index."""
        dims = self._again.variables[name].dims
        return tuple(place[dim] if dim in dims else slice(None) for dim in self._along)

    def _values(self, place: "Place", names: Sequence[str]) -> "tuple[_Values, _Values]":
        """The variables at a place, as kept and as recomputed."""
        kept, now = (
            {name: each.variables[name].isel(place, missing_dims="ignore") for name in names}
            for each in (self._found, self._again)
        )
        return kept, now

    def _scalar(self, name: str, kept: "_Values", now: "_Values", moved: bool, parted: bool) -> Difference:
        found = compared(name, kept[name].values, now[name].values, self._scales[name])
        if found.verdict is not Verdict.DIFFERENT:
            return found
        if name in _ADVICE:
            return replace(found, verdict=Verdict.WITHIN)
        elsewhere = parted if name in self._of_records else moved or parted
        if not elsewhere or name in self._before_sliding or now[name].dtype == object:
            return found
        error = str(now[name].attrs.get("ancillary_variables", ""))
        if not error.endswith("_uncertainty") or error not in now:
            return Difference(name, Verdict.WITHIN, 0.0, _NOT_COMPARED)
        # An error that nobody knows is taken for `LITTLE` in all.
        little = LITTLE * self._scales[name] / STANDARD_ERRORS
        errors = (np.nan_to_num(kept[error].values, nan=little), np.nan_to_num(now[error].values, nan=little))
        close = within_uncertainty(kept[name].values, now[name].values, errors)
        return replace(found, verdict=Verdict.WITHIN) if close else found

    def _run(self, series: Series, place: "Place", moved: bool) -> list[Difference]:
        """The runs of one series that belong to a case, a run for each of its drives."""
        index = series.index.name
        pairs = zip(
            *(each.variables[index].isel(place).values.ravel() for each in (self._found, self._again)), strict=True
        )
        found = []
        for kept, now in pairs:
            if (kept == ABSENT) != (now == ABSENT):
                found.append(_odd(index, "none kept" if kept == ABSENT else "none recomputed"))
            elif kept != ABSENT:
                found += self._columns(series, int(kept), int(now), moved)
        return found

    def _columns(self, series: Series, kept: int, now: int, moved: bool) -> list[Difference]:
        """One run beside the other: whose it is, and column by column."""
        owner = [
            compared(
                name,
                self._found.variables[name][kept : kept + 1].values,
                self._again.variables[name][now : now + 1].values,
            )
            for name in (owner.name for owner in series.owners)
            if name in self._again.variables and name in self._found.variables
        ]
        here, there = (
            _window(starts, at) for starts, at in zip(self._starts[series.count.name], (kept, now), strict=True)
        )
        names = [quantity.name for quantity in series.columns.values() if quantity.name in self._again.variables]
        found = [
            compared(name, self._found.variables[name][here].values, self._again.variables[name][there].values)
            for name in names
            if name in self._found.variables
        ]
        elsewhere = moved and series.kind == "drive" and worst(found) is Verdict.DIFFERENT
        return owner + (
            [Difference(name, Verdict.WITHIN, 0.0, _NOT_COMPARED) for name in names] if elsewhere else found
        )


def _half(votes: Iterable[bool]) -> bool:
    """Whether half or more are in favour, of one or more."""
    counted = list(votes)
    return bool(counted) and 2 * sum(counted) >= len(counted)


_Values = Mapping[str, xr.Variable]
Place = dict[str, int]
"""Dimension -> where along it."""


def before_sliding() -> set[str]:
    """Variables that no decision of sliding changes."""
    of_contact = {quantity.name for quantity in scalars("contact").values()}
    of_record = {
        quantity.name
        for quantity in scalars("record").values()
        if quantity.uncertainty == DISCRETIZATION_ERROR.name or quantity.name.startswith("initial_")
    }
    return {DISCRETIZATION_ERROR.name} | of_contact | of_record


def of_records() -> set[str]:
    """Variables that sum up a record."""
    both = (*scalars("record").values(), *companions("record").values())
    return {quantity.name for quantity in both} - before_sliding()


def _odd(name: str, words: str) -> Difference:
    return Difference(name, Verdict.DIFFERENT, np.inf, words)


def _properties(found: xr.DataArray, again: xr.DataArray) -> Iterator[tuple[str, str, str]]:
    """What is said of a variable beside its values: what, as kept, as it comes out again."""
    yield "dimensions", " ".join(map(str, found.dims)), " ".join(map(str, again.dims))
    yield "units", str(found.attrs.get("units", "")), str(again.attrs.get("units", ""))


def _scale(values: xr.DataArray) -> float:
    return magnitude(values.values) if np.issubdtype(values.dtype, np.floating) else 1.0


def _starts(counts: NDArray[Any]) -> NDArray[np.int64]:
    return np.concatenate(([0], np.cumsum(counts, dtype=np.int64)))


def _window(starts: NDArray[np.int64], number: int) -> slice:
    """Where a run lies; empty where there is no such run."""
    return slice(int(starts[number]), int(starts[number + 1])) if 0 <= number < len(starts) - 1 else slice(0, 0)


def place_of(found: xr.Dataset, case_id: str) -> "Place | None":
    """Where a case lies, by dimension; None where it is not."""
    ids = found["case_id"]
    places = np.argwhere(ids.values == case_id)
    return dict(zip(map(str, ids.dims), map(int, places[0]), strict=True)) if len(places) else None
