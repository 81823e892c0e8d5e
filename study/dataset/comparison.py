"""One variable computed twice: the same bits, the same within rounding, the same within its uncertainty, or different."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

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
