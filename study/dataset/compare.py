"""A dataset and the same one computed again, case by case: the same bits, within rounding or uncertainty, or different."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from enum import IntEnum
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.parameter import Quantity
from nanoslip.study.dataset import file
from nanoslip.study.dataset.file import flattened, groups_of
from nanoslip.study.dataset.variables import (
    COMPUTED_BY,
    DISCRETIZATION_ERROR,
    OUTCOMES,
    Group,
    all_groups,
    companions,
    scalars,
    windows,
)
from nanoslip.study.manifest.cases import CampaignCase
from nanoslip.study.origin import Origin

ROUNDING: Final = 1e-9
"""Largest difference that is taken for rounding, as a share of the variable's scale.

Another processor or library changes last digits, 1e-16, and operators of condition 1e5 make 1e-11 of that.
"""
STANDARD_ERRORS: Final = 5.0
"""Combined standard errors by which two means over records that took different paths may differ."""


class Verdict(IntEnum):
    """How a recomputed value compares with the one that was kept; the worst of several is their largest."""

    IDENTICAL = 0
    WITHIN = 1
    DIFFERENT = 2

    def __str__(self) -> str:
        return ("bit-identical", "within tolerance", "different")[self]


@dataclass(frozen=True, slots=True)
class Difference:
    """How one variable differs."""

    name: str
    verdict: Verdict
    size: float
    """Largest difference over the variable's scale; infinite for what cannot be subtracted."""
    words: str = ""
    """What it is, where a number says nothing."""

    def __str__(self) -> str:
        return f"{self.name}: {self.words}" if self.words else f"{self.name} by {self.size:.2g} of its scale"


def worst(differences: Iterable[Difference]) -> Verdict:
    """The verdict on all of them together."""
    return max((each.verdict for each in differences), default=Verdict.IDENTICAL)


def compared(name: str, kept: NDArray[Any], again: NDArray[Any], scale: float | None = None) -> Difference:
    """Compare the stored values of a variable with recomputed ones. Whole numbers and texts have no rounding.

    scale: magnitude of the variable; without it the largest of `again`.
    """
    kept, again = np.asarray(kept), np.asarray(again)
    if kept.shape != again.shape:
        return Difference(name, Verdict.DIFFERENT, np.inf, f"{_size(kept)} kept, {_size(again)} recomputed")
    if identical(kept, again):
        return Difference(name, Verdict.IDENTICAL, 0.0)
    if not (_real(kept) and _real(again)):
        return Difference(name, Verdict.DIFFERENT, np.inf, _first_two(kept, again))
    size = relative(kept, again, magnitude(again) if scale is None else scale)
    verdict = Verdict.WITHIN if size <= ROUNDING else Verdict.DIFFERENT
    return Difference(name, verdict, size, "" if np.isfinite(size) else _first_two(kept, again))


def identical(kept: NDArray[Any], again: NDArray[Any]) -> bool:
    """Whether both have the same bits; NaN is NaN, whatever its payload, but -0.0 is not 0.0."""
    if not (_real(kept) and _real(again)):
        return bool(np.array_equal(kept, again))
    nothing = np.isnan(kept) & np.isnan(again)
    return bool(np.all(nothing | ((kept == again) & (np.signbit(kept) == np.signbit(again)))))


def relative(kept: NDArray[Any], again: NDArray[Any], scale: float) -> float:
    """Largest |kept - again| over the scale; infinite where only one is a number, or where the scale is 0."""
    both = np.isfinite(kept) & np.isfinite(again)
    if not np.all(both | (kept == again) | (np.isnan(kept) & np.isnan(again))):
        return np.inf
    apart = float(np.max(np.abs(kept[both] - again[both]), initial=0.0))
    return apart / scale if scale > 0.0 else (np.inf if apart > 0.0 else 0.0)


def magnitude(values: NDArray[Any]) -> float:
    """The largest finite magnitude."""
    return float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))


def within_uncertainty(kept: NDArray[Any], again: NDArray[Any], errors: tuple[NDArray[Any], NDArray[Any]]) -> bool:
    """Whether two means agree within `STANDARD_ERRORS` of both; two that are missing (NaN) agree."""
    missing = np.isnan(kept) & np.isnan(again)
    return bool(np.all(missing | (np.abs(kept - again) <= STANDARD_ERRORS * np.hypot(*errors))))


def _real(values: NDArray[Any]) -> bool:
    return bool(np.issubdtype(values.dtype, np.floating))


def _size(values: NDArray[Any]) -> str:
    return " x ".join(map(str, values.shape)) or "one value"


def _first_two(kept: NDArray[Any], again: NDArray[Any]) -> str:
    """The first place where both differ, in words."""
    pairs = zip(kept.ravel().tolist(), again.ravel().tolist(), strict=True)
    here, there = next(pair for pair in pairs if pair[0] != pair[1] and not (_nan(pair[0]) and _nan(pair[1])))
    return f"{_short(here)} kept, {_short(there)} recomputed"


def _nan(value: object) -> bool:
    return isinstance(value, float) and value != value  # noqa: PLR0124  only NaN is not itself


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."


# A dataset and the same one computed again, side by side: first what all cases share, then case by case.

LITTLE: Final = 1e-2
"""Share of its scale by which a number may differ that took another path and does not know its uncertainty."""
_NOT_COMPARED: Final = "not compared"
_SOFTWARE: Final = {quantity.name for quantity in COMPUTED_BY.values()}
_ADVICE: Final = {message.name for _, message in OUTCOMES.values()}


@dataclass(frozen=True, slots=True)
class Finding:
    """The verdict on one case, or on what all cases share."""

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
        found, again = flattened(self._found), flattened(self._again)
        names = sorted({*found, *again})
        missing = [_odd(name, "is missing") for name in names if name not in found]
        strange = [_odd(name, "is in no dataset of this manifest") for name in names if name not in again]
        common = [name for name in names if name in found and name in again]
        words = [
            compared(f"{kind} of {name}", np.array(one), np.array(other))
            for name in common
            for kind, one, other in _properties(found[name], again[name])
        ]
        values = [compared(name, found[name].values, again[name].values) for name in common if self._for_all(name)]
        return [*missing, *strange, *words, *self._attributes(), *values]

    def _for_all(self, name: str) -> bool:
        """Whether a variable belongs to no case, and is not in a group: runs are compared with their case."""
        along = set(self._again["case_id"].dims)
        return "/" not in name and (name in self._again.coords or not set(self._again[name].dims) & along)

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

    def __init__(self, found: xr.Dataset, again: xr.Dataset, left_out: set[str]) -> None:
        """left_out: variables that are not compared."""
        self._found, self._again = found, again
        self._groups = [
            _Runs(group, groups_of(found)[name], groups_of(again)[name])
            for name, group in all_groups().items()
            if name in groups_of(found) and name in groups_of(again)
        ]
        along = set(again["case_id"].dims)
        apart = {group.id.name for group in all_groups().values()} | left_out | _SOFTWARE
        self._names = [
            str(name)
            for name, values in again.data_vars.items()
            if along <= set(values.dims) and str(name) not in apart and name in found.variables
        ]
        self._scales = {name: _scale(again[name]) for name in self._names}
        self._before_sliding, self._of_records = before_sliding(), of_records()
        self._parted, self._moved = (np.zeros(again["case_id"].shape, np.bool_) for _ in range(2))

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
        """The verdict on one case."""
        place = place_of(self._again, case.case_id) or {}
        parted = bool(self._parted[tuple(place.values())])
        moved = bool(self._moved[tuple(place.values())])
        kept, now = self._values(place, self._names)
        differences = [self._scalar(name, kept, now, moved, parted) for name in self._names]
        for runs in self._groups:
            if not (parted and runs.group.kinds != ("contact",)):
                differences += self._run(runs, place, moved)
        skipped = any(each.words == _NOT_COMPARED for each in differences)
        turned = "its record" if parted else "a drive" if skipped else ""
        remark = f"{turned} takes another path: compared within uncertainties" if turned else ""
        label = ", ".join(f"{name} = {value}" for name, value in case.parameters.items())
        return finding_of(label, differences, remark)

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
        error = f"{name}_uncertainty"
        if error not in now:
            return Difference(name, Verdict.WITHIN, 0.0, _NOT_COMPARED)
        # An error that nobody knows is taken for `LITTLE` in all.
        little = LITTLE * self._scales[name] / STANDARD_ERRORS
        errors = (np.nan_to_num(kept[error].values, nan=little), np.nan_to_num(now[error].values, nan=little))
        close = within_uncertainty(kept[name].values, now[name].values, errors)
        return replace(found, verdict=Verdict.WITHIN) if close else found

    def _run(self, runs: "_Runs", place: "Place", moved: bool) -> list[Difference]:
        """The runs of one group that belong to a case, a run for each of its drives."""
        name = runs.group.id.name
        ids = (each.variables[name].isel(place).values.ravel() for each in (self._found, self._again))
        found = []
        for kept, now in zip(*ids, strict=True):
            if bool(kept) != bool(now):
                found.append(_odd(name, "recomputed, but none kept" if now else "kept, but none recomputed"))
            elif kept:
                found += runs.differences(kept, now, moved)
        return found


class _Runs:
    """The runs of one group, as kept and as recomputed."""

    def __init__(self, group: Group, found: xr.Dataset, again: xr.Dataset) -> None:
        self.group = group
        self._both = (found, again)
        self._numbers = tuple(
            {name: number for number, name in enumerate(each[group.name].values)} for each in self._both
        )
        self._windows = tuple(windows(each, group) for each in self._both)

    def differences(self, kept: str, now: str, moved: bool) -> list[Difference]:
        """One run beside the other, by their names: whose it is, and column by column."""
        places = [numbers.get(name, -1) for numbers, name in zip(self._numbers, (kept, now), strict=True)]
        if places[0] < 0:
            return [_odd(self.group.id.name, f"{kept} is not in the group {self.group.name}")]
        owner = self._compared(
            [each.name for each in self.group.owners], self.group.name, [slice(at, at + 1) for at in places]
        )
        found = []
        for sample in self._windows[1]:
            names = [name for name, quantity in self.group.columns.items() if quantity.along == sample]
            slices = [_window(each, sample, at) for each, at in zip(self._windows, places, strict=True)]
            found += self._compared(names, sample, slices)
        if moved and self.group.driven and worst(found) is Verdict.DIFFERENT:
            found = [Difference(each.name, Verdict.WITHIN, 0.0, _NOT_COMPARED) for each in found]
        return owner + found

    def _compared(self, names: Sequence[str], dim: str, slices: Sequence[slice]) -> list[Difference]:
        """The variables of these names that both have, where the slices say."""
        (found, again), (here, there) = self._both, slices
        return [
            compared(
                name, found.variables[name].isel({dim: here}).values, again.variables[name].isel({dim: there}).values
            )
            for name in names
            if name in found.variables and name in again.variables
        ]


def _half(votes: Iterable[bool]) -> bool:
    """Whether half or more are in favour, of one or more."""
    counted = list(votes)
    return bool(counted) and 2 * sum(counted) >= len(counted)


_Values = Mapping[str, xr.Variable]
Place = dict[str, int]
"""Dimension -> where along it."""


def before_sliding() -> set[str]:
    """Variables that no decision of sliding changes."""
    of_record = [each for each in scalars("record").values() if each.of_grid or each.name.startswith("initial_")]
    return {DISCRETIZATION_ERROR.name} | _names(scalars("contact").values()) | _names(of_record)


def of_records() -> set[str]:
    """Variables that sum up a record."""
    both = (*scalars("record").values(), *companions("record").values())
    return _names(both) - before_sliding()


def _names(quantities: Iterable[Quantity]) -> set[str]:
    """The variables of these quantities, and of their ±."""
    return {name for each in quantities for name in (each.name, each.uncertainty) if name}


def _odd(name: str, words: str) -> Difference:
    return Difference(name, Verdict.DIFFERENT, np.inf, words)


def _properties(found: xr.DataArray, again: xr.DataArray) -> Iterator[tuple[str, str, str]]:
    """What is said of a variable beside its values: what, as kept, as it comes out again."""
    yield "dimensions", " ".join(map(str, found.dims)), " ".join(map(str, again.dims))
    yield "units", str(found.attrs.get("units", "")), str(again.attrs.get("units", ""))


def _scale(values: xr.DataArray) -> float:
    return magnitude(values.values) if np.issubdtype(values.dtype, np.floating) else 1.0


def _window(found: Mapping[str, tuple[str, NDArray[np.int64]]], sample: str, number: int) -> slice:
    """Where a run lies along a sample dimension; empty where there is no such dimension."""
    if sample not in found:
        return slice(0, 0)
    first = found[sample][1]
    return slice(int(first[number]), int(first[number + 1]))


def place_of(found: xr.Dataset, case_id: str) -> "Place | None":
    """Where a case lies, by dimension; None where it is not."""
    ids = found["case_id"]
    places = np.argwhere(ids.values == case_id)
    return dict(zip(map(str, ids.dims), map(int, places[0]), strict=True)) if len(places) else None
