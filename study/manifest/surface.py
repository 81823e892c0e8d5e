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
            text = getattr(self, name)
            require(name, text, isinstance(text, str), "a text")
        if self.pixel:
            spacing = plain("pixel", self.pixel, PIXEL)
            # What has no unit stays a text.
            is_length = not isinstance(spacing, str) and 0.0 < spacing < math.inf
            require("pixel", self.pixel, is_length, 'a length, as "20 nm"')
        for name in ("x", "z", "y"):
            unit = getattr(self, name)
            is_length = not unit or math.isfinite(factor(unit, "m"))
            require(name, unit, is_length, "a unit of length, as nm")


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
        # Wiener and Khinchin: the autocorrelation is the inverse transform of the power. Padding to twice the length
        # keeps the end of the profile from being correlated with its beginning.
        amplitudes = np.abs(np.fft.rfft(lines, 2 * len(even)))
        power = (amplitudes**2).mean(axis=0)
        # Fewer pairs of points are far apart: a sum over them becomes a mean.
        pairs = np.arange(len(even), 0, -1)
        correlated = np.fft.irfft(power)[: len(even)] / pairs
        low = np.flatnonzero(correlated < correlated[0] / math.e)
        return float(even[low[0]] - even[0]) if len(low) else math.nan

    @property
    def spectrum(self) -> tuple[Any, Any]:
        """Wavenumbers 2π/λ in 1/m and the power of the heights, in m³; of the profile or lines in a Hann window."""
        even, lines = self._even()
        # A profile does not end as it begins: without the window that step would be a tail of the spectrum.
        window, spacing = np.hanning(len(even)), float(even[1] - even[0])
        amplitudes = np.abs(np.fft.rfft(lines * window))
        norm = 2.0 * np.pi * (window**2).sum()
        power = (amplitudes**2).mean(axis=0) * spacing / norm
        wavenumbers = 2.0 * np.pi * np.fft.rfftfreq(len(even), spacing)[1:]
        # Twice, for the waves of negative wavenumber, which have the same power.
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


def read_surface(path: Path, text: str, named: NamedSurface) -> Surface:
    """A profile from its file's text, one from right to left is turned; or an image. Raises InvalidInput with line and value."""
    stated = dict(_STATED.findall(text))
    is_matrix = bool(named.pixel) or {"Width", "Height"} <= stated.keys()
    source = columns.read_columns(path, text, titled=not is_matrix)
    names = {column.name.casefold() for column in source.columns}
    if is_matrix or named.y or {"x", "y", "z"} <= names or _is_xyz(source):
        return _read_image(source, named, stated if is_matrix else None)
    chosen = [_column(source, _LATERAL, 0), _column(source, _HEIGHT, 1)]
    lateral, vertical = (source.columns[number] for number in chosen)
    across = _column_scale("x", named.x, lateral)
    up = _column_scale("z", named.z, vertical)
    rows = source.rows(chosen)
    # Beyond that the squares of a fit overflow: a wrong unit is named by its line, before any arithmetic.
    metres = np.abs(rows.values) * [[across], [up]]
    far = np.flatnonzero((metres > FARTHEST_POINT).any(axis=0))
    if far.size:
        (x, height), line = rows.values[:, far[0]], rows.lines[far[0]]
        need = f"needs both within {FARTHEST_POINT / 1e3:g} km"
        raise InvalidInput(f"line {line}: x = {x:g}, height = {height:g}: {need}")
    profile = columns.one_way(rows, "x", "goes one way, by 1e-12 m at least")
    near = np.flatnonzero(np.diff(profile.at) * across < LEAST_APART)
    if near.size:
        first = int(near[0])
        before, now = np.abs(profile.at[first : first + 2]).tolist()
        line = profile.lines[first + 1]
        raise InvalidInput(f"line {line}: x = {now:g} after {before:g}: needs x that goes one way, by 1e-12 m at least")
    # A scan from right to left has increasing -x: turned round, its heights are those from left to right.
    turn = slice(None, None, -1 if profile.reversed else 1)
    along = -profile.at if profile.reversed else profile.at
    x = _centre(along[turn] * across)
    height = profile.others[0][turn] * up
    # "none" is -1, "mean" 0, "line" 1, "parabola" 2.
    degree = get_args(Detrend).index(named.detrend) - 1
    if degree >= 0:
        trend = np.polynomial.Polynomial.fit(x, height, degree)
        height = height - trend(x)
    return Surface(x, height, source, profile, rows.holes)


def _centre(places: Floats) -> Floats:
    """Places along an axis from the middle between its ends."""
    centred: Floats = places - (places[0] + places[-1]) / 2.0
    return centred


def _is_xyz(source: columns.FileColumns) -> bool:
    """True of three columns without names, of which two have the places of a grid: an `.xyz` file."""
    if len(source.columns) != 3 or any(column.name for column in source.columns):
        return False
    x, y = (column.values[np.isfinite(column.values)] for column in source.columns[:2])
    along, across = len(np.unique(x)), len(np.unique(y))
    # At least half of a grid's places: points of a profile and two of its heights would all differ.
    return min(along, across) > 1 and 2 * len(x) > along * across


def _read_image(source: columns.FileColumns, named: NamedSurface, stated: Mapping[str, str] | None) -> Surface:
    """An image from a matrix of heights with the header above it, or from columns x, y, z in any order."""
    image = _from_columns(source, named) if stated is None else _matrix(source, named, stated)
    height, filled = _fill_holes(image.height, named.missing)
    x, y = _centre(image.xi), _centre(image.y)
    degree = get_args(Detrend).index(named.detrend) - 1
    if degree < 0:
        return Surface(x, height, source, y=y, filled=filled)
    # All products x^i y^j with i + j up to the degree: 1; x, y; x², xy, y². Over the half-widths they are of the same size,
    # else the columns of lengths in m would differ by a factor of a million.
    powers = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    along, across = x / x[-1], y / y[-1]
    terms = [np.outer(across**j, along**i).ravel() for i, j in powers]
    basis = np.stack(terms, axis=1)
    coefficients = np.linalg.lstsq(basis, height.ravel())[0]
    level = (height.ravel() - basis @ coefficients).reshape(height.shape)
    return Surface(x, level, source, y=y, filled=filled)


def _matrix(source: columns.FileColumns, named: NamedSurface, stated: Mapping[str, str]) -> Image:
    require("x", named.x, not (named.x or named.y), "no unit of x or y of a matrix")
    values = np.array([column.values for column in source.columns]).T
    heights = columns.FileColumn("heights", stated.get("Value units", ""), values)
    # A header that states sizes states a unit of heights, too; without a header they are in m.
    usual = "m" if named.pixel else ""
    height = values * _column_scale("z", named.z, heights, usual)
    counts = height.shape[::-1]
    spacings = zip(_apart(named.pixel, stated, counts), counts, strict=True)
    x, y = (apart * np.arange(float(count)) for apart, count in spacings)
    # A line that is left out would shift all lines below it by one pixel.
    if source.left_out.number or source.below:
        where = f"line {source.left_out.line}" if source.left_out.number else f"below line {source.lines[-1]}"
        raise InvalidInput(f"{where}: needs {height.shape[1]} heights, as other lines have")
    return Image(x, y, height)


def _apart(pixel: str, stated: Mapping[str, str], counts: tuple[int, ...]) -> Iterator[float]:
    """Spacings of a matrix in m along and across: given, or the stated sizes over the numbers of heights.

    Raises InvalidInput where a file states another spacing than the given one.
    """
    pixel_size = _length("pixel", pixel) if pixel else math.nan
    for name, count in zip(("Width", "Height"), counts, strict=True):
        if name not in stated:
            yield pixel_size
            continue
        size = _length(name, stated[name].replace(",", "."))
        by_heights = size / count
        # Instruments divide the size by the number of heights, or by that of the intervals between them.
        by_intervals = size / max(count - 1, 1)
        least, most = by_heights * (1.0 - PIXEL_ROUNDING), by_intervals * (1.0 + PIXEL_ROUNDING)
        need = f"{compact(by_heights, 'm')}, as the file states ({name}: {stated[name]}), or no pixel"
        require("pixel", pixel, not pixel or least <= pixel_size <= most, need)
        yield pixel_size if pixel else by_heights


PIXEL_ROUNDING: Final = 5e-3
"""Relative rounding of a typed spacing, of two digits or more, against the spacing that a file states."""


def _length(key: str, text: str) -> float:
    """A length in m that is above 0. Raises InvalidInput of any other text."""
    size = plain(key, text, PIXEL)
    is_length = not isinstance(size, str) and 0.0 < size < math.inf
    require(key, text, is_length, 'a length, as "5 µm"')
    return float(size)


def _from_columns(source: columns.FileColumns, named: NamedSurface) -> Image:
    """An image from columns x, y and z of points on a grid, in any order."""
    lengths = [number for number, column in enumerate(source.columns) if _may_be_length(column)]
    by_name = {source.columns[number].name.casefold(): number for number in lengths}
    chosen = lengths
    if {"x", "y", "z"} <= by_name.keys():
        chosen = [by_name[name] for name in "xyz"]
    if len(chosen) != 3:
        raise InvalidInput(f"columns {source}: needs three columns, or the names x, y and z above them")
    metres = []
    for name, number in zip("xyz", chosen, strict=True):
        column = source.columns[number]
        metres.append(column.values * _column_scale(name, getattr(named, name), column))
    x, y, height = metres
    # A point without a place is on no grid; a place without a height is a hole, which may be filled.
    has_place = np.isfinite(x) & np.isfinite(y)
    return _grid_heights(x[has_place], y[has_place], height[has_place])


def _grid_heights(x: Floats, y: Floats, height: Floats) -> Image:
    """Heights of points in any order on the grid of their places, NaN where one has none. Raises InvalidInput of no grid."""
    along, column = np.unique(x, return_inverse=True)
    across, row = np.unique(y, return_inverse=True)
    places = {*zip(column.tolist(), row.tolist(), strict=True)}
    is_line = min(len(along), len(across)) < 2
    # Points scattered at random have all different x and y: their grid would have n² places for n heights.
    is_sparse = 2 * len(x) < len(along) * len(across)
    is_repeated = len(places) < len(x)
    if is_line or is_sparse or is_repeated:
        points = f"{len(x)} points at {len(along)} x and {len(across)} y"
        raise InvalidInput(f"{points}: needs an image, one height at each x and y of a grid")
    grid = np.full((len(across), len(along)), np.nan)
    grid[row, column] = height
    return Image(along, across, grid)


def _fill_holes(height: Floats, missing: Missing) -> tuple[Floats, int]:
    """Heights of an image without holes, and how many were filled. Raises InvalidInput if holes may not be filled.

    A hole is a height that is no number, is missing from the file, or repeats an instrument's sentinel value, far
    from all other heights.
    """
    holes = ~np.isfinite(height) | _is_sentinel(height)
    count = int(holes.sum())
    if not count:
        return height, 0
    # With fewer heights than holes the surface would be made up, whatever the campaign allows.
    is_mostly_holes = 2 * count > height.size
    if missing == "refuse" or is_mostly_holes:
        row, column = np.argwhere(holes)[0]
        where = f"the first in row {row + 1}, column {column + 1}"
        need = 'needs all heights, or missing = "fill" to take them from their neighbours'
        if is_mostly_holes:
            need = "needs half of the heights at least"
        image = f"image of {height.shape[1]} by {height.shape[0]}"
        raise InvalidInput(f"{image}: {count} heights are missing, {where}: {need}")
    return _fill_smoothly(height, holes), count


SENTINEL_GAP: Final = 10.0
"""Ranges of all other heights from which on one that is repeated means a missing height, as -9999 does: no surface has steps
ten times as high as all that is on them."""


def _is_sentinel(height: Floats) -> NDArray[np.bool_]:
    """Heights equal to the largest or the least number, if that occurs several times, far outside the range of all
    other heights."""
    sentinel = np.zeros(height.shape, bool)
    finite = height[np.isfinite(height)]
    for extreme in (finite.min(), finite.max()):
        others = finite[finite != extreme]
        # A surface that has one height at most of its points is flat there, not missing.
        if len(others) < len(finite) / 2 or not len(others):
            continue
        gap = np.abs(others - extreme).min()
        if gap > SENTINEL_GAP * np.ptp(others):
            sentinel |= height == extreme
    return sentinel


def _fill_smoothly(height: Floats, holes: NDArray[np.bool_]) -> Floats:
    """Heights whose Laplacian vanishes in holes: each is the mean of its neighbours in the image."""
    # One equation for each hole: (number of neighbours)·z - (sum of unknown neighbours) = (sum of known neighbours).
    count = int(holes.sum())
    numbers = np.full(height.shape, -1)
    numbers[holes] = np.arange(count)
    equations, unknowns, values = [], [], []
    right = np.zeros(count)
    for line, column in np.argwhere(holes).tolist():
        equation = int(numbers[line, column])
        neighbours = _neighbours(line, column, height.shape)
        equations.append(equation)
        unknowns.append(equation)
        values.append(float(len(neighbours)))
        for place in neighbours:
            if numbers[place] < 0:
                right[equation] += height[place]
            else:
                equations.append(equation)
                unknowns.append(int(numbers[place]))
                values.append(-1.0)
    matrix = scipy.sparse.csc_array((values, (equations, unknowns)), shape=(count, count))
    filled = height.copy()
    filled[holes] = scipy.sparse.linalg.spsolve(matrix, right)
    return filled


def _neighbours(line: int, column: int, shape: tuple[int, ...]) -> list[tuple[int, int]]:
    """The neighbours of a pixel that are in an image: above, below, left and right."""
    height, width = shape
    places = ((line - 1, column), (line + 1, column), (line, column - 1), (line, column + 1))
    return [(row, place) for row, place in places if 0 <= row < height and 0 <= place < width]


def _column_scale(key: str, unit_stated: str, column: columns.FileColumn, usual: str = "m") -> float:
    """Metres per unit of a column. Raises InvalidInput if its unit is no length and none is given."""
    unit = columns.column_unit(key, unit_stated, column, usual)
    require(key, unit, columns.unit_factor(unit, "m") > 0.0, "a unit of length, as nm")
    return columns.unit_factor(unit, "m")


def _may_be_length(column: columns.FileColumn) -> bool:
    return column.dimension in ("m", "1") or not columns.is_unit(column.unit)


def _column(source: columns.FileColumns, names: re.Pattern[str], place: int) -> int:
    """The column of a length that has such a name, or this place of two. Raises InvalidInput with the columns that there are."""
    # From the surest sign to the weakest: a name, the only two lengths, the only two that say so by their unit.
    lengths = [number for number, column in enumerate(source.columns) if _may_be_length(column)]
    by_name = [number for number in lengths if names.search(source.columns[number].name)]
    if len(by_name) == 1:
        return by_name[0]
    if len(lengths) == 2:
        return lengths[place]
    with_unit = [number for number in lengths if source.columns[number].dimension == "m"]
    if len(with_unit) == 2:
        return with_unit[place]
    # Many columns without names are an image, whose file does not state its size.
    if len(lengths) > 3 and not any(column.name for column in source.columns):
        size = f"{len(lengths)} columns of {len(source.columns[0].values)} numbers without names"
        need = 'pixel = "20 nm", the distance of heights, of an image; x and z as names of columns'
        raise InvalidInput(f"{size}: needs {need}")
    raise InvalidInput(f"columns {source}: needs two columns, or the names x and z above them")
