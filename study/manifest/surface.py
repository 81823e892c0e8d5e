"""A measured surface profile: positions and heights in a text file, with units, and statistics of its roughness."""

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import FARTHEST_POINT, LEAST_APART, Heterogeneity
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.parameter import Roughness, check, parameter, require
from nanoslip.study.manifest.columns import Columns, OneWay, one_way, read_columns, scale_of, unit_of
from nanoslip.study.manifest.units import factor

Detrend = Literal["none", "mean", "line", "parabola"]


@dataclass(frozen=True, slots=True)
class NamedSurface:
    """Measured profile named by a campaign: `roughness = {file = "afm.csv", x = "nm", z = "nm", detrend = "line"}`.

    x, z: units of positions and heights; empty for those of the header, or m if it has none. detrend: polynomial removed from
    the heights, fitted by least squares.
    """

    file: str = parameter("", meaning="the path of a text file with two columns", unit="")
    x: str = parameter("", meaning="unit of positions, by default the header's, or m", unit="")
    z: str = parameter("", meaning="unit of heights, by default the header's, or m", unit="")
    detrend: Detrend = parameter("line", meaning="trend removed from the heights", unit="")

    def __post_init__(self) -> None:
        check(self)
        for name in ("file", "x", "z"):
            require(name, getattr(self, name), isinstance(getattr(self, name), str), "a text")
        for name in ("x", "z"):
            require(
                name,
                getattr(self, name),
                not getattr(self, name) or math.isfinite(factor(getattr(self, name), "m")),
                "a unit of length, as nm",
            )


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """A profile: x and heights (n,) in m, x from its middle and increasing; and how its file was read."""

    x: NDArray[np.float64]
    height: NDArray[np.float64]
    source: Columns | None = None
    rows: OneWay | None = None
    holes: int = 0
    """Lines without a position or a height."""

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
        """Points of a case's roughness, in L_x (m). Raises InvalidInput if a case cannot have them."""
        points = tuple(zip((self.x / slab_width).tolist(), (self.height / slab_width).tolist(), strict=True))
        return Heterogeneity(roughness=points).roughness


_LATERAL: Final = re.compile(
    r"^[xs]$|lateral|distance|position|length|displacement|scan|weg|abstand|strecke", re.IGNORECASE
)
_HEIGHT: Final = re.compile(r"^[zyh]$|height|profile|topograph|raw|depth|amplitude|h(ö|oe)he|profil", re.IGNORECASE)
"""Names of the columns of a profile."""


def read_surface(path: Path, text: str, given: NamedSurface) -> Surface:
    """A profile from its file's text; one from right to left is turned. Raises InvalidInput with line and value."""
    source = read_columns(path, text)
    chosen = [_column(source, _LATERAL, 0), _column(source, _HEIGHT, 1)]
    across, up = (
        scale_of(unit_of(name, getattr(given, name), source.columns[column], "m"), "m")
        for name, column in zip("xz", chosen, strict=True)
    )
    rows = source.rows(chosen)
    far = np.flatnonzero((np.abs(rows.values) * [[across], [up]] > FARTHEST_POINT).any(axis=0))
    if far.size:
        (x, height), line = rows.values[:, far[0]], rows.lines[far[0]]
        raise InvalidInput(
            f"line {line}: x = {x:g}, height = {height:g}: needs both within {FARTHEST_POINT / 1e3:g} km"
        )
    found = one_way(rows, "x", "goes one way, by 1e-12 m at least")
    if (near := np.flatnonzero(np.diff(found.at) * across < LEAST_APART)).size:
        before, now = (abs(float(found.at[place])) for place in (near[0], near[0] + 1))
        line = found.lines[near[0] + 1]
        raise InvalidInput(f"line {line}: x = {now:g} after {before:g}: needs x that goes one way, by 1e-12 m at least")
    turn = slice(None, None, -1 if found.reversed else 1)  # the heights are those from left to right
    x, height = (-found.at if found.reversed else found.at)[turn] * across, found.others[0][turn] * up
    x = x - (x[0] + x[-1]) / 2.0
    degree = get_args(Detrend).index(given.detrend) - 1
    if degree >= 0:
        height = height - np.polynomial.Polynomial.fit(x, height, degree)(x)
    return Surface(x, height, source, found, rows.holes)


def _column(source: Columns, names: re.Pattern[str], place: int) -> int:
    """The column of a length that has such a name, or this place of two. Raises InvalidInput with the columns that there are."""
    lengths = [number for number, each in enumerate(source.columns) if each.dimension in ("m", "1")]
    named = [number for number in lengths if names.search(source.columns[number].name)]
    if len(named) == 1:
        return named[0]
    if len(lengths) == 2:
        return lengths[place]
    with_unit = [number for number in lengths if source.columns[number].dimension == "m"]
    if len(with_unit) == 2:
        return with_unit[place]
    raise InvalidInput(f"columns {source}: needs two columns, or the names x and z above them")
