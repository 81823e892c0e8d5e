"""Agreement of values: value, other value and ± of both -> one verdict, for whatever compares datasets."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from types import MappingProxyType
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.parameter import Quantity
from nanoslip.solver.view import ROUNDING
from nanoslip.study.dataset import variables


class Verdict(IntEnum):
    """Result of comparing two values; the worst of several is their largest."""

    IDENTICAL = 0
    ROUNDING = 1
    WITHIN = 2
    NOT_JUDGED = 3
    """They differ by more than rounding, and by how much they may is unknown."""
    DIFFERENT = 4

    def __str__(self) -> str:
        return ("bit-identical", "within rounding", "within uncertainties", "not judged", "different")[self]


def same_bits(one: NDArray[Any], other: NDArray[Any]) -> Any:
    """Compare the bits of two arrays of equal shape, element by element. All NaN are equal, but -0.0 is not 0.0."""
    # Texts and whole numbers have no NaN and no negative zero.
    if not (is_real(one) and is_real(other)):
        return one == other
    equal = (one == other) & (np.signbit(one) == np.signbit(other))
    return equal | (np.isnan(one) & np.isnan(other))


def are_identical(one: NDArray[Any], other: NDArray[Any]) -> bool:
    """True if two arrays have the same shape and the same bits."""
    return one.shape == other.shape and bool(np.all(same_bits(one, other)))


def is_real(values: NDArray[Any] | xr.Variable) -> bool:
    """True if values are floats."""
    return bool(np.issubdtype(values.dtype, np.floating))


def magnitude(values: NDArray[Any]) -> float:
    """The largest finite magnitude."""
    finite = values[np.isfinite(values)]
    return float(np.max(np.abs(finite), initial=0.0))


def distances(one: Any, other: Any) -> Any:
    """|one - other|, element by element: 0 if equal or missing (NaN) in both, infinite if missing in one."""
    # Infinity less infinity is NaN, with a warning; where both are infinite they are equal.
    with np.errstate(invalid="ignore"):
        apart = np.abs(np.subtract(one, other, dtype=float))
    both_missing = np.isnan(one) & np.isnan(other)
    same = (one == other) | both_missing
    # A number beside none, or over an error of 0, differs by as much as can be.
    finite = np.nan_to_num(apart, nan=np.inf, posinf=np.inf)
    return np.where(same, 0.0, finite)


def deviations(one: Any, other: Any, errors: tuple[Any, Any]) -> Any:
    """Difference in combined standard deviations, see `distances`: infinite beyond a double's range.

    An error of NaN counts as 0.
    """
    difference = distances(one, other)
    # Independent errors add in squares.
    combined = np.hypot(*np.nan_to_num(errors))
    unstated = np.where(difference == 0.0, 0.0, np.inf)
    with np.errstate(over="ignore"):
        return np.divide(difference, combined, out=unstated, where=combined > 0.0)


EXACT: Final = (0.0, 0.0)
"""Standard errors of numbers that may differ by rounding alone."""
UNKNOWN: Final = (np.nan, np.nan)
"""Standard errors of numbers that state none, though they may differ by more than rounding."""


def find_verdict(
    one: NDArray[Any],
    other: NDArray[Any],
    scale: float,
    errors: tuple[Any, Any] = EXACT,
    most: float = 0.0,
    rounding: float = ROUNDING,
) -> tuple[Verdict, float]:
    """Verdict on floats of equal shape, and their largest difference over `scale`, a magnitude of the variable.

    errors: standard error of each, or of each element; NaN if unknown. most: combined standard errors by which they
        may differ.
    rounding: difference over the scale that rounding may cause.
    """
    if are_identical(one, other):
        return Verdict.IDENTICAL, 0.0
    apart = deviations(one, other, (scale, 0.0))
    size, beyond = float(np.max(apart)), apart > rounding
    if not beyond.any():
        return Verdict.ROUNDING, size
    # Not `>`: a deviation of NaN is beyond, too.
    beyond &= ~(deviations(one, other, errors) <= most)
    # One value that differs beyond a known error decides, whatever is unknown of the others.
    unknown = np.isnan(errors[0]) | np.isnan(errors[1])
    if (beyond & ~unknown).any():
        return Verdict.DIFFERENT, size
    return Verdict.NOT_JUDGED if beyond.any() else Verdict.WITHIN, size


@dataclass(frozen=True, slots=True)
class Difference:
    """Difference of a variable between two datasets."""

    name: str
    verdict: Verdict
    size: float
    """Largest difference over the variable's scale; infinite for values that cannot be subtracted."""
    words: str = ""
    """Description of the difference, if a number cannot express it."""

    def __str__(self) -> str:
        return f"{self.name}: {self.words}" if self.words else f"{self.name} by {self.size:.2g} of its scale"


def worst(differences: Iterable[Difference]) -> Verdict:
    """The verdict on all of them together."""
    return max((difference.verdict for difference in differences), default=Verdict.IDENTICAL)


def odd(name: str, words: str) -> Difference:
    """A difference in words."""
    return Difference(name, Verdict.DIFFERENT, np.inf, words)


def compare_values(
    name: str, kept: NDArray[Any], again: NDArray[Any], scale: float | None = None, rounding: float = ROUNDING
) -> Difference:
    """Compare the stored values of a variable with recomputed values. Whole numbers and texts have no rounding.

    scale: magnitude of the variable; without it the largest of `again`. rounding: as of `find_verdict`.
    """
    if kept.shape != again.shape:
        return odd(name, f"{_size(kept)} kept, {_size(again)} recomputed")
    if are_identical(kept, again):
        return Difference(name, Verdict.IDENTICAL, 0.0)
    if is_real(kept) and is_real(again):
        largest = magnitude(again) if scale is None else scale
        verdict, size = find_verdict(kept, again, largest, rounding=rounding)
        if np.isfinite(size):
            return Difference(name, verdict, size)
    # 0.0 and -0.0 are the same in words.
    same = same_bits(kept, again) | (kept == again)
    first = int(np.argmin(same))
    return odd(name, f"{_short(kept.item(first))} kept, {_short(again.item(first))} recomputed")


def _size(values: NDArray[Any]) -> str:
    return " x ".join(map(str, values.shape)) or "one value"


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."


class Runs:
    """The runs of a group in two datasets: records, trajectories, paths, contacts."""

    def __init__(self, group: variables.Group, both: Sequence[xr.Dataset]) -> None:
        self.group, self._both = group, both
        self._numbers = [_number_runs(root[group.name].values) for root in both]
        self._windows = [variables.windows(each, group) for each in both]

    def owners(self, kept: str, now: str) -> list[Difference]:
        """Compare whose two runs are, by their names (empty if there is none): what hinders a comparison of their columns."""
        if not kept or not now:
            said = "recomputed, but none kept" if now else "kept, but none recomputed"
            return [odd(self.group.id.name, said)] if kept or now else []
        if kept not in self._numbers[0]:
            return [odd(self.group.id.name, f"{kept} is not in the group {self.group.name}")]
        places = self._places(kept, now)
        ranges = [slice(at, at + 1) for at in places]
        owners = [owner.name for owner in self.group.owners]
        return self._compare_variables(owners, self.group.name, ranges)

    def compare_columns(self, kept: str, now: str, rounding: float = ROUNDING) -> list[Difference]:
        """Compare two runs column by column, over the largest magnitude in the same unit; empty if one of them is missing.

        Thus a shear that is nothing but rounding is compared with the pressure.
        """
        if kept not in self._numbers[0] or now not in self._numbers[1]:
            return []
        differences = []
        columns = self.group.columns.items()
        for sample in self._windows[1]:
            names = [name for name, quantity in columns if quantity.along == sample]
            pairs = zip(self._windows, self._places(kept, now), strict=True)
            slices = [_run_slice(boundaries, sample, run) for boundaries, run in pairs]
            scales = self._scales(names, sample, slices[1])
            differences += self._compare_variables(names, sample, slices, scales, rounding)
        return differences

    def _scales(self, names: Sequence[str], dim: str, run: slice) -> dict[str, float]:
        """Column -> largest magnitude of a recomputed run among the columns in its unit; places and times have their own."""
        group, declared = self._both[1], self.group.columns
        variables_of_run = group.variables
        present = [name for name in names if name in variables_of_run]
        floats = [name for name in present if is_real(variables_of_run[name])]
        within = {dim: run}
        sizes = {name: magnitude(variables_of_run[name].isel(within).values) for name in floats}
        units = {name: name for name in sizes}
        # A place differs from another by its own distance only, though both are lengths.
        in_shared_units = [name for name in sizes if not declared[name].coordinate]
        units |= {name: _unit_key(declared[name]) for name in in_shared_units}
        largest: dict[str, float] = {}
        for name, size in sizes.items():
            unit = units[name]
            largest[unit] = max(largest.get(unit, size), size)
        return {name: largest[units[name]] for name in sizes}

    def _places(self, *names: str) -> list[int]:
        return [numbers[name] for numbers, name in zip(self._numbers, names, strict=True)]

    def _compare_variables(
        self,
        names: Sequence[str],
        dim: str,
        slices: Sequence[slice],
        scales: Mapping[str, float] = MappingProxyType({}),
        rounding: float = ROUNDING,
    ) -> list[Difference]:
        """Compare the variables of these names that both have, within these slices."""
        kept, now = self._both
        here, other_run = ({dim: run} for run in slices)
        differences = []
        for name in names:
            if name in kept.variables and name in now.variables:
                # A kept column may lie along anything, whoever wrote it: then it has no values of this run.
                if kept.variables[name].dims != now.variables[name].dims:
                    differences.append(odd(name, "has other dimensions"))
                    continue
                one = kept.variables[name].isel(here).values
                other = now.variables[name].isel(other_run).values
                scale = scales.get(name)
                differences.append(compare_values(name, one, other, scale, rounding))
        return differences


def _number_runs(names: Iterable[str]) -> dict[str, int]:
    """Name of a run -> its place in the group."""
    return {name: number for number, name in enumerate(names)}


def _run_slice(boundaries: Mapping[str, NDArray[np.int64]], sample: str, run: int) -> slice:
    """The samples of a run along a dimension; none in a group without the dimension."""
    if sample not in boundaries:
        return slice(0)
    start, stop = boundaries[sample][run : run + 2].tolist()
    return slice(start, stop)


def _unit_key(quantity: Quantity) -> str:
    return f"{quantity.units} {quantity.per} {quantity.measure}"
