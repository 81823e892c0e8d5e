"""A measured profile or image of a surface in a text file, with units, and statistics of its roughness."""

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal, get_args

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.case import FARTHEST_POINT, LEAST_APART, Heterogeneity, Image
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.parameter import Parameter, Roughness, parameter, require, validate
from nanoslip.study.manifest.parameters import compact, plain
from nanoslip.study.measured import columns
from nanoslip.study.measured.units import factor

Detrend = Literal["none", "mean", "line", "parabola"]
Missing = Literal["refuse", "fill"]
PIXEL: Final = Parameter("pixel", unit="m")


@dataclass(frozen=True, slots=True)
class NamedSurface:
    """Measured profile named by a campaign: `roughness = {file = "afm.csv", x = "nm", z = "nm", detrend = "line"}`.

    x, z: units of positions and heights; empty for the header's units, or m if it has none. detrend: polynomial
    removed from the heights, fitted by least squares; of an image a plane or a paraboloid.
    An image has columns x, y, z, or is a matrix of heights, line by line along the drag: pixel is then its spacing,
    as "20 nm", if not the lines `# Width: 5 µm`, `# Height: 5 µm` and `# Value units: nm` above it say so, as
    Gwyddion writes them.
    missing: "fill" takes missing heights of an image as means of their neighbours.
    """

    file: str = parameter("", meaning="the path of a text file with two columns")
    x: str = parameter("", meaning="unit of positions, by default the header's, or m")
    z: str = parameter("", meaning="unit of heights, by default the header's, or m")
    detrend: Detrend = parameter("line", meaning="trend removed from the heights")
    y: str = parameter("", meaning="unit of an image's positions across, by default the header's, or m")
    pixel: str = parameter("", meaning="distance of an image's heights in a matrix", unit="m")
    missing: Missing = parameter("refuse", meaning="what becomes of missing heights of an image")

    def __post_init__(self) -> None:
        validate(self)
        for name in ("file", "x", "z", "y", "pixel"):
            require(name, getattr(self, name), isinstance(getattr(self, name), str), "a text")
        if self.pixel:
            apart = plain("pixel", self.pixel, PIXEL)
            require("pixel", self.pixel, not isinstance(apart, str) and 0.0 < apart < math.inf, 'a length, as "20 nm"')
        for name in ("x", "z", "y"):
            unit = getattr(self, name)
            require(name, unit, not unit or math.isfinite(factor(unit, "m")), "a unit of length, as nm")


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """A profile: x and heights (n,) in m, x from its middle and increasing; and how its file was read.

    y: positions (k,) across of an image, whose heights are (k, n), also from its middle and increasing.
    """

    x: Floats
    height: Floats
    source: columns.FileColumns | None = None
    rows: columns.OneWay | None = None
    holes: int = 0
    """Lines without a position or a height."""
    y: Floats = field(default_factory=lambda: np.zeros(1))
    filled: int = 0
    """Missing heights of an image that were filled from their neighbours."""

    @property
    def rms_height(self) -> float:
        """Root mean square of the heights about their mean, in m."""
        return float(self.height.std())

    def _even(self) -> tuple[Floats, Floats]:
        """Evenly spaced x, (n,), and the heights there less their mean, (lines, n)."""
        even = np.linspace(self.x[0], self.x[-1], len(self.x))
        mean = self.height.mean()
        lines = [np.interp(even, self.x, line) - mean for line in np.atleast_2d(self.height)]
        return even, np.array(lines)

    @property
    def correlation_length(self) -> float:
        """Distance in m along x at which the autocorrelation of the heights first falls below 1/e; NaN where it never does."""
        even, lines = self._even()
        amplitudes = np.abs(np.fft.rfft(lines, 2 * len(even)))
        power = (amplitudes**2).mean(axis=0)
        pairs = np.arange(len(even), 0, -1)  # points that far apart
        correlated = np.fft.irfft(power)[: len(even)] / pairs
        low = np.flatnonzero(correlated < correlated[0] / math.e)
        return float(even[low[0]] - even[0]) if len(low) else math.nan

    @property
    def spectrum(self) -> tuple[Any, Any]:
        """Wavenumbers 2π/λ in 1/m and the power of the heights, in m³; of the profile or lines in a Hann window."""
        even, lines = self._even()
        window, apart = np.hanning(len(even)), float(even[1] - even[0])
        amplitudes = np.abs(np.fft.rfft(lines * window))
        norm = 2.0 * np.pi * (window**2).sum()
        power = (amplitudes**2).mean(axis=0) * apart / norm
        wavenumbers = 2.0 * np.pi * np.fft.rfftfreq(len(even), apart)[1:]
        return wavenumbers, 2.0 * power[1:]

    def image(self, slab_width: float) -> Image:
        """The heights on their grid, in L_x (m)."""
        return Image(self.x / slab_width, self.y / slab_width, np.atleast_2d(self.height) / slab_width)

    def roughness(self, slab_width: float) -> Roughness:
        """Points of a case's roughness, in L_x (m). Raises InvalidInput if a case cannot have them."""
        return Heterogeneity(roughness=self.image(slab_width).points).roughness


_LATERAL: Final = re.compile(
    r"^[xs]$|lateral|distance|position|length|displacement|scan|weg|abstand|strecke", re.IGNORECASE
)
_HEIGHT: Final = re.compile(r"^[zyh]$|height|profile|topograph|raw|depth|amplitude|h(ö|oe)he|profil", re.IGNORECASE)
"""Names of the columns of a profile."""
_STATED: Final = re.compile(r"^#[ \t]*(Width|Height|Value units):[ \t]*+(.*\S)", re.MULTILINE)
"""Size and unit of an image above its matrix of heights, as Gwyddion writes them."""


def read_surface(path: Path, text: str, given: NamedSurface) -> Surface:
    """A profile from its file's text, one from right to left is turned; or an image. Raises InvalidInput with line and value."""
    stated = dict(_STATED.findall(text))
    matrix = bool(given.pixel) or {"Width", "Height"} <= stated.keys()
    source = columns.read_columns(path, text, titled=not matrix)
    if matrix or given.y or {"x", "y", "z"} <= {each.name.casefold() for each in source.columns} or _is_xyz(source):
        return _read_image(source, given, stated if matrix else None)
    chosen = [_column(source, _LATERAL, 0), _column(source, _HEIGHT, 1)]
    lateral, vertical = (source.columns[number] for number in chosen)
    across = _column_scale("x", given.x, lateral)
    up = _column_scale("z", given.z, vertical)
    rows = source.rows(chosen)
    metres = np.abs(rows.values) * [[across], [up]]
    far = np.flatnonzero((metres > FARTHEST_POINT).any(axis=0))
    if far.size:
        (x, height), line = rows.values[:, far[0]], rows.lines[far[0]]
        raise InvalidInput(
            f"line {line}: x = {x:g}, height = {height:g}: needs both within {FARTHEST_POINT / 1e3:g} km"
        )
    found = columns.one_way(rows, "x", "goes one way, by 1e-12 m at least")
    near = np.flatnonzero(np.diff(found.at) * across < LEAST_APART)
    if near.size:
        first = int(near[0])
        before, now = np.abs(found.at[first : first + 2]).tolist()
        line = found.lines[first + 1]
        raise InvalidInput(f"line {line}: x = {now:g} after {before:g}: needs x that goes one way, by 1e-12 m at least")
    turn = slice(None, None, -1 if found.reversed else 1)  # the heights are those from left to right
    along = -found.at if found.reversed else found.at
    x, height = along[turn] * across, found.others[0][turn] * up
    x = _centre(x)
    degree = get_args(Detrend).index(given.detrend) - 1
    if degree >= 0:
        height = height - np.polynomial.Polynomial.fit(x, height, degree)(x)
    return Surface(x, height, source, found, rows.holes)


def _centre(places: Floats) -> Floats:
    """Places along an axis from the middle between its ends."""
    centred: Floats = places - (places[0] + places[-1]) / 2.0
    return centred


def _is_xyz(source: columns.FileColumns) -> bool:
    """True of three columns without names, of which two have the places of a grid: an `.xyz` file."""
    if len(source.columns) != 3 or any(each.name for each in source.columns):
        return False
    x, y = (each.values[np.isfinite(each.values)] for each in source.columns[:2])
    along, across = len(np.unique(x)), len(np.unique(y))
    return min(along, across) > 1 and 2 * len(x) > along * across


def _read_image(source: columns.FileColumns, given: NamedSurface, stated: Mapping[str, str] | None) -> Surface:
    """An image from a matrix of heights with the header above it, or from columns x, y, z in any order."""
    found = _from_columns(source, given) if stated is None else _matrix(source, given, stated)
    height, filled = _fill_holes(found.height, given.missing)
    found = found._replace(height=height)
    x, y = _centre(found.xi), _centre(found.y)
    degree = get_args(Detrend).index(given.detrend) - 1
    powers = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    along, across = x / x[-1], y / y[-1]
    terms = [np.outer(across**j, along**i).ravel() for i, j in powers or [(0, 0)]]
    basis = np.stack(terms, axis=1)
    trend = basis @ np.linalg.lstsq(basis, found.height.ravel())[0] if powers else 0.0
    level = (found.height.ravel() - trend).reshape(found.height.shape)
    return Surface(x, level, source, y=y, filled=filled)


def _matrix(source: columns.FileColumns, given: NamedSurface, stated: Mapping[str, str]) -> Image:
    require("x", given.x, not (given.x or given.y), "no unit of x or y of a matrix")
    values = np.array([each.values for each in source.columns]).T
    heights = columns.FileColumn("heights", stated.get("Value units", ""), values)
    height = values * _column_scale("z", given.z, heights, "m" if given.pixel else "")
    counts = height.shape[::-1]
    spacings = zip(_apart(given.pixel, stated, counts), counts, strict=True)
    x, y = (apart * np.arange(float(count)) for apart, count in spacings)
    if source.left_out.number or source.below:
        where = f"line {source.left_out.line}" if source.left_out.number else f"below line {source.lines[-1]}"
        raise InvalidInput(f"{where}: needs {height.shape[1]} heights, as other lines have")
    return Image(x, y, height)


def _apart(pixel: str, stated: Mapping[str, str], counts: tuple[int, ...]) -> Iterator[float]:
    """Spacings of a matrix in m along and across: given, or the stated sizes over the numbers of heights.

    Raises InvalidInput where a file states another spacing than the given one.
    """
    given = _length("pixel", pixel) if pixel else math.nan
    for name, count in zip(("Width", "Height"), counts, strict=True):
        if name not in stated:
            yield given
            continue
        size = _length(name, stated[name].replace(",", "."))
        own = size / count
        # Instruments divide the size by the number of heights, or by that of the intervals between them.
        least, most = own * (1.0 - PIXEL_ROUNDING), size / max(count - 1, 1) * (1.0 + PIXEL_ROUNDING)
        need = f"{compact(own, 'm')}, as the file states ({name}: {stated[name]}), or no pixel"
        require("pixel", pixel, not pixel or least <= given <= most, need)
        yield given if pixel else own


PIXEL_ROUNDING: Final = 5e-3
"""Relative rounding of a typed spacing, of two digits or more, against the spacing that a file states."""


def _length(key: str, text: str) -> float:
    """A length in m that is above 0. Raises InvalidInput of any other text."""
    size = plain(key, text, PIXEL)
    require(key, text, not isinstance(size, str) and 0.0 < size < math.inf, 'a length, as "5 µm"')
    return float(size)


def _from_columns(source: columns.FileColumns, given: NamedSurface) -> Image:
    lengths = [number for number, each in enumerate(source.columns) if _may_be_length(each)]
    named = {source.columns[number].name.casefold(): number for number in lengths}
    chosen = lengths
    if {"x", "y", "z"} <= named.keys():
        chosen = [named[name] for name in "xyz"]
    if len(chosen) != 3:
        raise InvalidInput(f"columns {source}: needs three columns, or the names x, y and z above them")
    axes = [source.columns[number] for number in chosen]
    scales = [_column_scale(name, getattr(given, name), column) for name, column in zip("xyz", axes, strict=True)]
    x, y, height = (column.values for column in axes)
    placed = np.isfinite(x) & np.isfinite(y)
    return _grid_heights(x[placed] * scales[0], y[placed] * scales[1], height[placed] * scales[2])


def _grid_heights(x: Floats, y: Floats, height: Floats) -> Image:
    """Heights of points in any order on the grid of their places, NaN where one has none. Raises InvalidInput of no grid."""
    along, column = np.unique(x, return_inverse=True)
    across, row = np.unique(y, return_inverse=True)
    count = len(along) * len(across)
    if (
        min(len(along), len(across)) < 2
        or 2 * len(x) < count
        or len({*zip(column.tolist(), row.tolist(), strict=True)}) < len(x)
    ):
        raise InvalidInput(
            f"{len(x)} points at {len(along)} x and {len(across)} y: needs an image, one height at each x and y of a grid"
        )
    found = np.full((len(across), len(along)), np.nan)
    found[row, column] = height
    return Image(along, across, found)


def _fill_holes(height: Floats, missing: Missing) -> tuple[Floats, int]:
    """Heights of an image without holes, and how many were filled. Raises InvalidInput if holes may not be filled.

    A hole is a height that is no number, is missing from the file, or repeats an instrument's sentinel value, far
    from all other heights.
    """
    holes = ~np.isfinite(height) | _is_sentinel(height)
    count, first = int(holes.sum()), np.argwhere(holes)
    if not count:
        return height, 0
    if missing == "refuse" or 2 * count > height.size:
        where = f"the first in row {first[0][0] + 1}, column {first[0][1] + 1}"
        need = 'needs all heights, or missing = "fill" to take them from their neighbours'
        if 2 * count > height.size:
            need = "needs half of the heights at least"
        raise InvalidInput(
            f"image of {height.shape[1]} by {height.shape[0]}: {count} heights are missing, {where}: {need}"
        )
    return _fill_smoothly(height, holes), count


SENTINEL_GAP: Final = 10.0
"""Ranges of all other heights from which on one that is repeated means a missing height, as -9999 does: no surface has steps
ten times as high as all that is on them."""


def _is_sentinel(height: Floats) -> NDArray[np.bool_]:
    """Heights equal to the largest or the least number, if that occurs several times, far outside the range of all
    other heights."""
    found = np.zeros(height.shape, bool)
    known = height[np.isfinite(height)]
    for extreme in (known.min(), known.max()):
        others = known[known != extreme]
        if len(others) < len(known) / 2 or not len(others):
            continue
        gap = np.abs(others - extreme).min()
        if gap > SENTINEL_GAP * np.ptp(others):
            found |= height == extreme
    return found


def _fill_smoothly(height: Floats, holes: NDArray[np.bool_]) -> Floats:
    """Heights whose Laplacian vanishes in holes: each is the mean of its neighbours in the image."""
    places = np.full(height.shape, -1)
    places[holes] = np.arange(int(holes.sum()))
    rows, columns_, values, right = [], [], [], np.zeros(int(holes.sum()))
    for line, column in np.argwhere(holes).tolist():
        own = int(places[line, column])
        inside = _neighbours(line, column, height.shape)
        rows.append(own)
        columns_.append(own)
        values.append(float(len(inside)))
        for each in inside:
            if places[each] < 0:
                right[own] += height[each]
            else:
                rows.append(own)
                columns_.append(int(places[each]))
                values.append(-1.0)
    count = len(right)
    matrix = scipy.sparse.csc_array((values, (rows, columns_)), shape=(count, count))
    whole = height.copy()
    whole[holes] = scipy.sparse.linalg.spsolve(matrix, right)
    return whole


def _neighbours(line: int, column: int, shape: tuple[int, ...]) -> list[tuple[int, int]]:
    """The places beside one that are in an image: above, below, left and right."""
    lines, columns_ = shape
    beside = ((line - 1, column), (line + 1, column), (line, column - 1), (line, column + 1))
    return [(row, place) for row, place in beside if 0 <= row < lines and 0 <= place < columns_]


def _column_scale(key: str, given: str, column: columns.FileColumn, usual: str = "m") -> float:
    """Metres per unit of a column. Raises InvalidInput if its unit is no length and none is given."""
    unit = columns.column_unit(key, given, column, usual)
    require(key, unit, columns.unit_factor(unit, "m") > 0.0, "a unit of length, as nm")
    return columns.unit_factor(unit, "m")


def _may_be_length(column: columns.FileColumn) -> bool:
    return column.dimension in ("m", "1") or not columns.is_unit(column.unit)


def _column(source: columns.FileColumns, names: re.Pattern[str], place: int) -> int:
    """The column of a length that has such a name, or this place of two. Raises InvalidInput with the columns that there are."""
    lengths = [number for number, each in enumerate(source.columns) if _may_be_length(each)]
    named = [number for number in lengths if names.search(source.columns[number].name)]
    if len(named) == 1:
        return named[0]
    if len(lengths) == 2:
        return lengths[place]
    with_unit = [number for number in lengths if source.columns[number].dimension == "m"]
    if len(with_unit) == 2:
        return with_unit[place]
    if len(lengths) > 3 and not any(each.name for each in source.columns):
        size = f"{len(lengths)} columns of {len(source.columns[0].values)} numbers without names"
        raise InvalidInput(
            f'{size}: needs pixel = "20 nm", the distance of heights, of an image; x and z as names of columns'
        )
    raise InvalidInput(f"columns {source}: needs two columns, or the names x and z above them")
