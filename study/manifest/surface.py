"""A measured surface profile: two columns of a text file, with units, and statistics of its roughness."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import FARTHEST_POINT, LEAST_APART, Heterogeneity
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.parameter import Roughness, check, parameter, require
from nanoslip.study.manifest.columns import read_columns
from nanoslip.study.manifest.parameters import factor

Detrend = Literal["none", "mean", "line", "parabola"]


@dataclass(frozen=True, slots=True)
class NamedSurface:
    """How a campaign names a measured profile: `roughness = {file = "afm.csv", x = "nm", z = "nm", detrend = "line"}`.

    x, z: units of the two columns. detrend: polynomial removed from the heights, fitted by least squares.
    """

    file: str = parameter("", meaning="the path of a text file with two columns", unit="")
    x: str = parameter("m", meaning="unit of the first column", unit="")
    z: str = parameter("m", meaning="unit of the second column", unit="")
    detrend: Detrend = parameter("line", meaning="what is taken off the heights", unit="")

    def __post_init__(self) -> None:
        check(self)
        for name in ("file", "x", "z"):
            require(name, getattr(self, name), isinstance(getattr(self, name), str), "a text")
        for name in ("x", "z"):
            require(
                name,
                getattr(self, name),
                math.isfinite(factor(getattr(self, name), "m")),
                "a unit of length, as nm",
            )


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """A profile: x and heights (n,) in m, x from its middle and increasing; and how its file was read."""

    x: NDArray[np.float64]
    height: NDArray[np.float64]
    separator: str
    skipped: int
    """Lines before the numbers."""

    @property
    def rms_height(self) -> float:
        """Root mean square of the heights about their mean, in m."""
        return float(self.height.std())

    @property
    def correlation_length(self) -> float:
        """Distance in m at which the autocorrelation of the heights first falls below 1/e; NaN where it never does."""
        even = np.linspace(self.x[0], self.x[-1], len(self.x))
        heights = np.interp(even, self.x, self.height) - self.height.mean()
        power = np.abs(np.fft.rfft(heights, 2 * len(heights))) ** 2
        correlated = np.fft.irfft(power)[: len(heights)] / np.arange(len(heights), 0, -1)
        low = np.flatnonzero(correlated < correlated[0] / math.e)
        return float(even[low[0]] - even[0]) if len(low) else math.nan

    @property
    def spectrum(self) -> tuple[Any, Any]:
        """Wavenumbers 2π/λ in 1/m and the power of the heights, in m³; of the profile in a Hann window."""
        even = np.linspace(self.x[0], self.x[-1], len(self.x))
        window = np.hanning(len(even))
        apart = float(even[1] - even[0])
        heights = (np.interp(even, self.x, self.height) - self.height.mean()) * window
        power = np.abs(np.fft.rfft(heights)) ** 2 * apart / (2.0 * np.pi * (window**2).sum())
        return 2.0 * np.pi * np.fft.rfftfreq(len(even), apart)[1:], 2.0 * power[1:]

    def roughness(self, slab_width: float) -> Roughness:
        """Points of a case's roughness, in L_x (m). Raises InvalidInput where a case cannot have them."""
        points = tuple(zip((self.x / slab_width).tolist(), (self.height / slab_width).tolist(), strict=True))
        return Heterogeneity(roughness=points).roughness


def read_surface(path: Path, text: str, given: NamedSurface) -> Surface:
    """A profile from its file's text; one from right to left is turned. Raises InvalidInput with line and value."""
    columns = read_columns(path, text)
    rows = columns.rows
    across, up = factor(given.x, "m"), factor(given.z, "m")
    way = 1 if rows[0][1][:1] < rows[-1][1][:1] else -1
    for (number, row), (_, before) in zip(rows, rows[:1] + rows, strict=False):
        if max(abs(row[0]) * across, abs(row[1]) * up) > FARTHEST_POINT:
            raise InvalidInput(
                f"line {number}: x = {row[0]:g}, height = {row[1]:g}: needs both within {FARTHEST_POINT / 1e3:g} km"
            )
        if across * (row[0] - before[0]) * way < LEAST_APART and number != rows[0][0]:
            raise InvalidInput(
                f"line {number}: x = {row[0]:g} after {before[0]:g}: needs x that goes one way, by 1e-12 m at least"
            )
    points = np.array([row for _, row in rows])[::way]
    x, height = points[:, 0] * across, points[:, 1] * up
    x = x - (x[0] + x[-1]) / 2.0
    degree = get_args(Detrend).index(given.detrend) - 1
    if degree >= 0:
        height = height - np.polynomial.Polynomial.fit(x, height, degree)(x)
    return Surface(x, height, columns.separator, columns.skipped)
