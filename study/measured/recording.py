"""A force that a laboratory recorded: its columns by their names and units, in SI, less single samples that are none."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.parameter import require
from nanoslip.study.measured.columns import (
    FileColumn,
    FileColumns,
    OneWay,
    Rows,
    column_unit,
    one_way,
    read_columns,
    unit_factor,
)

FEWEST_POINTS: Final = 16
"""Fewest points of a trace."""
NOISE: Final = 10.0
"""Standard deviations of noise by which a force, or its means, falls in a slip: a million values of noise are that far apart."""
SMALLEST, LARGEST = 1e-50, 1e50
"""Differences and sizes of forces and times: squares of their ratios, and products of two of these, are floats."""
_BESIDE: Final = 3
"""Neighbours on each side of a sample in Hampel's filter, and robust standard deviations from their median of an outlier: the
usual values (Pearson, IEEE Trans. Control Syst. Technol. 10, 55, 2002)."""
_NORMAL: Final = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""


def _words(text: str) -> re.Pattern[str]:
    return re.compile(text, re.IGNORECASE)


_ROLES: Final = {
    "load": _words(r"normal|\bload|\blast\b|^f_?[nz]$|^w$"),
    "coefficient": _words(r"coeff|\bcof\b|^mu|^[μµ]|reib(wert|ungszahl)"),
    "time": _words(r"time|zeit|temps|elapsed|^t$|^sec"),
    "force": _words(r"force|kraft|friction|reibung|tangential|drag|shear|pull|^f(_?[xt])?$"),
    "displacement": _words(r"position|distance|displacement|weg|stroke|travel|stage|extension|^[xsδ]$"),
}
"""Role of a column -> words in its name, the first that fits."""
_FRICTION: Final = _words(r"friction|reib|tangential|lateral|drag|shear|pull|^f_?[xt]$")
"""Names of the friction force among forces."""
_OF_DIMENSION: Final = {"s": "time", "m": "displacement", "N": "force"}


@dataclass(frozen=True, slots=True, eq=False)
class TraceSource:
    """Provenance of a trace: the file's columns, the columns used, omissions and repairs."""

    columns: FileColumns
    taken: tuple[str, ...]
    rows: OneWay
    holes: int
    """Lines without one of the numbers."""
    spikes: int
    """Samples far from their neighbours, left out."""
    unloaded: int = 0
    """Samples whose normal load is below half its median, left out."""


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """A measured force (n,) over time in s, or over the displacement of the stage in m; and how its file was read."""

    at: Floats
    force: Floats
    over: str
    """`time` or `displacement`."""
    unit: str = "N"
    """Unit of the force; 1 for a friction coefficient."""
    load: Floats | None = None
    """Measured normal load in N (n,)."""
    source: TraceSource | None = None
    position: Floats | None = None
    """Measured position of the stage in m (n,), of a force over time or over the way of a stage that turns."""
    mean_load: float = math.nan
    """Mean normal load in N by which measured forces were divided."""

    def __post_init__(self) -> None:
        least_step = np.diff(self.at).min()
        _require_numbers(self.over, self.at, least_step)
        _require_numbers("force", self.force, np.ptp(self.force))

    def subtract(self, offset: float, drift: float) -> "Trace":
        """The trace less a constant force, and less a drift that grows from its start on."""
        since = self.at - self.at[0]
        return replace(self, force=self.force - offset - drift * since)

    def average(self, width: int) -> "Trace":
        """Average neighbouring samples in groups of `width`."""
        kept = len(self.at) // width * width
        columns = (self.at[:kept], self.force[:kept])
        groups = (values.reshape(-1, width) for values in columns)
        at, force = (samples.mean(axis=1) for samples in groups)
        return replace(self, at=at, force=force, load=None, position=None)

    def convert_to_time(self, velocity: float) -> "Trace":
        """Over time instead of displacement, of a stage with this velocity (m/s)."""
        if self.over == "time":
            return self
        return replace(self, at=self.at / velocity, over="time")

    def part(self, first: int, last: int, sign: float = 1.0, offset: float = 0.0) -> "Trace":
        """Samples from `first` up to `last`, times `sign` after an offset is subtracted."""
        at = self.at[first:last]
        force = sign * (self.force[first:last] - offset)
        return replace(self, at=at, force=force, load=None, position=None)

    def select_span(self, start: float, end: float) -> "Trace":
        """The samples from `start` to `end` (s or m, as in the file; NaN for no limit). Raises InvalidInput of too few."""
        # Comparisons with NaN are false: it cuts nothing off.
        outside = (self.at < start) | (self.at > end)
        count = int((~outside).sum())
        require("number of points", count, count >= FEWEST_POINTS, f"at least {FEWEST_POINTS}")
        return self._select(~outside)

    def _select(self, kept: NDArray[np.bool_]) -> "Trace":
        load = None if self.load is None else self.load[kept]
        position = None if self.position is None else self.position[kept]
        at, force = self.at[kept], self.force[kept]
        return replace(self, at=at, force=force, load=load, position=position)

    def divide_by_load(self) -> "Trace":
        """Friction coefficients, if the file has a load column; samples with less than half of its median are left out."""
        if self.load is None:
            return self
        sign = math.copysign(1.0, float(np.median(self.load)))  # some cells count pressing as negative
        load = self.load * sign
        kept = load > np.median(load) / 2.0
        if not kept.any():
            raise InvalidInput(f"normal load = {load.min():.4g} to {load.max():.4g} N: needs values other than 0")
        source = self.source
        if source is not None:
            source = replace(source, unloaded=int((~kept).sum()))
        loaded = self._select(kept)
        mean_load = math.nan
        if self.unit == "N":
            mean_load = float(load[kept].mean())
        coefficients = loaded.force / load[kept]
        coefficient = replace(loaded, force=coefficients, unit="1", load=None)
        return replace(coefficient, source=source, mean_load=mean_load)


def _require_numbers(name: str, values: Floats, least: float) -> None:
    """Raise InvalidInput if values are too large, or differ by less than `SMALLEST`. least: their smallest difference."""
    if not (least >= SMALLEST and np.abs(values).max() <= LARGEST):
        needs = f"needs numbers up to {LARGEST:g} that differ, by {SMALLEST:g} or more"
        raise InvalidInput(f"{name} = {values.min():.4g} to {values.max():.4g}: {needs}")


class TraceOptions(NamedTuple):
    """Units of the columns from the user, and names or numbers of the columns; empty to use the header."""

    time: str = ""
    displacement: str = ""
    force: str = ""
    columns: Sequence[str] = ()


def read_trace(path: Path, text: str, options: TraceOptions = TraceOptions()) -> Trace:  # noqa: B008  frozen
    """A trace from its file's text. Raises InvalidInput with line and value."""
    source = read_columns(path, text)
    columns = _column_positions(source, options)
    at = source.columns[columns.at]
    force = source.columns[columns.force]
    named_displacement = not options.time and _role(at) == "displacement"
    is_displacement = bool(options.displacement) or named_displacement
    over = "displacement" if is_displacement else "time"
    if columns.position is not None and options.displacement:
        over = "time"  # a stage that turns
    unit_stated = options.displacement if over == "displacement" else options.time
    scale = _scale_of_place(over, unit_stated, at)
    up, unit = _scale_of_force(force, options.force)
    places = columns.places()
    rows = source.rows(places)
    count = len(rows.lines)
    require("number of points", count, count >= FEWEST_POINTS, f"at least {FEWEST_POINTS}")
    require_representable(rows, [source.columns[place].name for place in places])
    turning = over == "displacement" and has_turns(rows.values[0])
    if over == "displacement":
        rows = _rows_along_way(rows)
    goes = "goes on" if over == "time" else "goes one way: one stroke"
    selected = one_way(rows, over, goes, turns=over == "displacement")
    spikes = outliers(selected.others[0])
    others = selected.others[:, ~spikes]
    values = dict(zip(places[1:], others, strict=False))
    measured = values[columns.force]
    # Some cells count the other way.
    sign = 1.0
    if not is_two_way(measured):
        sign = math.copysign(1.0, float(measured.mean()))
    load = position = None
    if columns.load is not None:
        load_column = source.columns[columns.load]
        load = values[columns.load] * _scale_of_load(load_column, unit)
    if turning:
        position = selected.others[-1][~spikes] * scale
    elif columns.position is not None:
        column = source.columns[columns.position]
        position = values[columns.position] * _scale_of_place("displacement", options.displacement, column)
    names = tuple(source.columns[place].name for place in places)
    spike_count = int(spikes.sum())
    facts = TraceSource(source, names, selected, rows.holes, spike_count)
    places_in_si = selected.at[~spikes] * scale
    forces = sign * measured * up
    return Trace(places_in_si, forces, over, unit, load, facts, position)


def require_representable(rows: Rows, names: Sequence[str]) -> None:
    """Refuse the first number above LARGEST: products of such numbers overflow."""
    beyond = np.argwhere(np.abs(rows.values) > LARGEST)
    if len(beyond):
        column, row = beyond[0]
        number = f"line {rows.lines[row]}: {names[column]} = {rows.values[column, row]:g}"
        raise InvalidInput(f"{number}: needs numbers up to {LARGEST:g}")


class ChosenColumns(NamedTuple):
    """Places of the columns of a trace; `position` beside time alone."""

    at: int
    force: int
    load: int | None = None
    position: int | None = None

    def places(self) -> list[int]:
        """Positions of the columns that the file has, in this order."""
        return [place for place in self if place is not None]


def has_turns(position: Floats) -> bool:
    """True if a stage goes back by more than its noise and a tenth of its range, between two legs of more than few samples.

    A jump in the readings goes back, too, but within few samples. So does a stage that turns near a gap, or near an end.
    """
    lengths = np.diff(turning_points(position))
    is_leg = lengths >= FEWEST_POINTS
    return bool((is_leg[:-1] & is_leg[1:]).any())


def turning_points(position: Floats) -> list[int]:
    """The first sample, all samples at which the stage turns, and the last sample."""
    tenth = LEAST_DROP * float(np.ptp(position))
    least = max(NOISE * noise_deviation(position), tenth)
    away = np.flatnonzero(np.abs(position - position[0]) > least)
    if not len(away):
        return [0, len(position) - 1]
    # A stage may rest before it goes: its way is that of the first place clearly away from the start.
    first_away = float(position[away[0]] - position[0])
    way = math.copysign(1.0, first_away)
    turns, far = [0], 0
    for place, value in enumerate(position.tolist()):
        if way * value > way * position[far]:
            far = place
        elif way * (position[far] - value) > least:
            turns.append(far)
            way, far = -way, place
    return [*turns, len(position) - 1]


def _rows_along_way(rows: Rows) -> Rows:
    """Rows over the way that a stage has gone, without the noise of its position, which becomes the last column if it turns.

    Between turns the way is the increasing one nearest to the measured positions.
    """
    position = rows.values[0]
    turns = turning_points(position)
    if len(turns) > 2 and not has_turns(position):
        return rows
    overall = position[-1] - position[0]
    forward = np.diff(position) * overall
    if len(turns) == 2 and (forward >= 0.0).all():
        return rows
    least = NOISE * noise_deviation(position)
    fallen = np.maximum.accumulate(position) - position
    risen = position - np.minimum.accumulate(position)
    back, forth = float(fallen.max()), float(risen.max())
    if len(turns) == 2 and min(back, forth) > least:
        return rows  # a step back that is no noise: `one_way` names its line
    way, gone = np.empty_like(position), 0.0
    for first, last in pairwise(turns):
        leg = slice(first, last + 1)
        leg_length = float(position[last] - position[first])
        sign = math.copysign(1.0, leg_length)
        smooth = scipy.optimize.isotonic_regression(sign * position[leg]).x
        way[leg] = gone + smooth - smooth[0]
        gone = float(way[last])
    others = list(rows.values[1:])
    if len(turns) > 2:
        others.append(position)
    return rows._replace(values=np.array([way, *others]))


def _scale_of_place(key: str, stated: str, column: FileColumn) -> float:
    """Factor to SI of the unit of a time or a displacement."""
    si = "m" if key == "displacement" else "s"
    unit = column_unit(key, stated, column, si)
    scale = unit_factor(unit, si)
    need = "a unit of time, as ms" if key == "time" else "a unit of length, as um"
    require(key, unit, scale > 0.0, need)
    return scale


def _scale_of_load(column: FileColumn, unit: str) -> float:
    """Factor to SI of the unit of a normal load, or of a normal stress beside a shear stress."""
    si = "Pa" if unit == "Pa" else "N"
    load_unit = column_unit("load", "", column, si)
    scale = unit_factor(load_unit, si)
    need = "a unit of stress, as MPa" if si == "Pa" else "a unit of force, as mN"
    require("load", load_unit, scale > 0.0, need)
    return scale


def _scale_of_force(column: FileColumn, stated: str) -> tuple[float, str]:
    """Factor to SI of the force's unit, and its SI unit: N, or 1 for a coefficient."""
    coefficient = _role(column) == "coefficient" and not stated
    unit = column_unit("force", stated, column, "1" if coefficient else "N")
    for si_unit in ("N", "1", "Pa"):
        scale = unit_factor(unit, "" if si_unit == "1" else si_unit)
        if scale > 0.0:
            return scale, si_unit
    raise InvalidInput(
        "force", unit, "a unit of force, as mN, of stress beside a normal stress, or 1 for a coefficient"
    )


def _role(column: FileColumn) -> str:
    """Role of a column by its unit and name; empty if these do not determine it."""
    roles = (role for role, words in _ROLES.items() if words.search(column.name))
    by_name = next(roles, "")
    if column.dimension in ("N", "Pa"):
        return "load" if by_name == "load" else "force"
    return by_name if column.dimension == "1" else _OF_DIMENSION.get(column.dimension, "")


def _column_positions(source: FileColumns, options: TraceOptions) -> ChosenColumns:
    """Columns of time or displacement, force and perhaps load. Raises InvalidInput if names do not determine them."""
    if options.columns:
        return ChosenColumns(*(source.find_column(name) for name in options.columns))
    of: dict[str, list[int]] = {role: [] for role in _ROLES}
    for place, column in enumerate(source.columns):
        role = _role(column)
        if role in of:
            of[role].append(place)
    names = [column.name for column in source.columns]
    names_force = any(_ROLES["force"].search(name) for name in names)
    if not names_force and len(of["load"]) == 1:
        name = source.columns[of["load"][0]].name.casefold()
        if "normal" not in name:
            of["force"], of["load"] = of["load"], []  # a tensile tester pulls by its load
    forces = of["force"] or of["coefficient"]
    if len(forces) > 1:
        of_friction = [place for place in forces if _FRICTION.search(names[place])]
        forces = of_friction or forces
    positions, times = of["displacement"], of["time"]
    turning = [place for place in positions if _is_turning(source, place)]
    # A stage that turns is followed over time, its position beside.
    is_followed_in_time = bool(turning) and len(times) == 1
    overs = positions if options.displacement and not is_followed_in_time else times or positions
    if len(overs) == len(forces) == 1:
        # A coefficient is over its load already.
        is_force = forces[0] in of["force"]
        load = of["load"][0] if of["load"] and is_force else None
        position = turning[0] if overs == times and len(turning) == 1 else None
        return ChosenColumns(overs[0], forces[0], load, position)
    if len(source.columns) == 2 and len(overs) < 2 and len(forces) < 2 and not of["load"]:
        first = 0
        if overs or forces:
            first = overs[0] if overs else 1 - forces[0]
        return ChosenColumns(first, 1 - first)
    raise InvalidInput(f"columns {source}: needs --columns, time or displacement and force, as --columns 1 2")


def _is_turning(source: FileColumns, place: int) -> bool:
    """True if a column of positions has most of its numbers, and turns."""
    values = source.columns[place].values
    finite = values[np.isfinite(values)]
    has_most = len(finite) >= max(FEWEST_POINTS, len(values) / 2)
    return has_most and has_turns(finite)


_PARTS: Final = 8
"""Parts of a trace with a noise of their own: one of them slides if a sixth of the trace does."""


def noise_deviation(force: Floats, width: int = 1) -> float:
    """Standard deviation of noise where it is largest, at least that of rounding to the smallest step.

    It is that of the loudest of eight parts, fewer if these had less than 32 samples: a trace that begins or ends at rest is
    quieter there than where it slides. In each part it is the median size of second differences. width: of the means over
    neighbouring samples whose noise is meant.
    """
    steps = np.abs(np.diff(force))
    # A number rounded to steps of s is off by anything up to s/2, evenly: s/√12.
    smallest = steps[steps > 0.0].min(initial=math.inf)
    rounding = smallest / math.sqrt(12.0)
    # Sums from the first force on: a large offset would take digits of them.
    sums = np.concatenate(([0.0], np.cumsum(force - force[0])))
    means = (sums[width:] - sums[:-width]) / width
    # Means that share no sample: a drift and a slow rise cancel in their second difference.
    before, at, after = means[: -2 * width], means[width:-width], means[2 * width :]
    second = np.abs(after - 2.0 * at + before)
    parts = max(1, min(_PARTS, len(force) // (2 * FEWEST_POINTS)))
    sizes = [float(np.median(part)) for part in np.array_split(second, parts)]
    # Second differences of white noise have the variance (1 + 4 + 1)σ²; _NORMAL leads from their median size to √6 σ.
    noise = _NORMAL * max(sizes) / math.sqrt(6.0)
    if not math.isfinite(rounding):
        return noise
    return max(noise, float(rounding) / math.sqrt(width))


CHANCE_OF_STEP: Final = 1e-3
"""Probability with which the longest of all steps between samples that come at random counts as a gap."""


def find_gaps(at: Floats, cycle: float) -> NDArray[np.bool_]:
    """True for each step between samples (n - 1,) in which more than a tenth of a cycle of this length is not recorded.

    In less a stuck pin's force rises by less than what counts as a slip. Steps as long as those of a trace with samples at random
    are usual, and so are those that single spikes leave.
    """
    steps = np.diff(at)
    usual = float(np.median(steps))
    # Exponential steps of mean m: their median is m ln 2, their ninth decile m ln 10, and the longest of n exceeds m ln(n/p) with
    # probability p.
    mean = (float(np.quantile(steps, 0.9)) - usual) / math.log(5.0)
    by_chance = usual + mean * math.log(len(steps) / (2.0 * CHANCE_OF_STEP))
    longest = max(by_chance, (_BESIDE + 1) * usual, usual + LEAST_DROP * cycle)
    is_gap: NDArray[np.bool_] = steps > longest
    return is_gap


def outliers(force: Floats) -> NDArray[np.bool_]:
    """Samples far from the median of their neighbours (Hampel's filter), above all noise; and spikes of a single
    sample in a slip.

    A spike differs from both neighbours in the same direction, several times more than
    the samples around it differ from each other.
    """
    least = NOISE * noise_deviation(force)
    padded = np.pad(force, _BESIDE, mode="reflect")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * _BESIDE + 1)
    middle = np.median(windows, axis=1)
    distances = np.abs(windows - middle[:, None])
    spread = _NORMAL * np.median(distances, axis=1)
    apart = np.diff(windows, axis=1)
    before, behind = apart[:, _BESIDE - 1], -apart[:, _BESIDE]
    smaller = np.minimum(np.abs(before), np.abs(behind))
    lone = np.where(before * behind > 0.0, smaller, 0.0)
    # Without the sample its neighbours are next to each other: they differ by `before - behind`.
    earlier = apart[:, : _BESIDE - 1]
    later = apart[:, _BESIDE + 1 :]
    beside = np.column_stack((earlier, before - behind, later))
    others = np.abs(beside).max(axis=1)
    off = np.abs(force - middle)
    far: NDArray[np.bool_] = off > np.maximum(_BESIDE * spread, least)
    far |= lone > np.maximum(_BESIDE * others, least)
    return far


LEAST_DROP: Final = 0.1
"""Share of the largest drop of force, below which a drop is no slip but ringing of the pin, or noise."""


def is_two_way(force: Floats) -> bool:
    """True if the force has both signs, each as the median of its half of the range, the smaller above a tenth of the larger.

    Noise alone is no stroke.
    """
    extremes = float(force.max()) + float(force.min())
    middle = extremes / 2.0
    high = float(np.median(force[force >= middle]))
    low = float(np.median(force[force <= middle]))
    if not low < 0.0 < high:
        return False
    smaller, larger = sorted((high, -low))
    return smaller >= LEAST_DROP * larger and high - low > NOISE * noise_deviation(force)


class Limits(NamedTuple):
    """Numbers of samples at the least and at the largest force, if a sensor's limit cuts the force off there; else 0."""

    low: int
    high: int


def limits(force: Floats) -> Limits:
    """Find limits of the sensor: runs of three or more equal extremes, two runs at least, that the force enters by a jump.

    A force that is rounded and turns by itself comes to its extreme by the smallest step.
    """
    steps = np.abs(np.diff(force))
    smallest = float(steps[steps > 0.0].min())

    def cut(extreme: float) -> int:
        is_extreme = np.concatenate(([False], force == extreme, [False]))
        edges = np.flatnonzero(np.diff(is_extreme))
        # Each run as its first sample and the one after it; how a run at an end of the trace was entered is unknown.
        runs = [(low, high) for low, high in edges.reshape(-1, 2) if low > 0 and high < len(force)]
        runs = [(low, high) for low, high in runs if high - low >= 3]
        jumps = [max(steps[low - 1], steps[high - 1]) for low, high in runs]
        if len(runs) < 2 or not np.median(jumps) > 2.0 * smallest:
            return 0
        return sum(high - low for low, high in runs)

    lowest, highest = float(force.min()), float(force.max())
    return Limits(cut(lowest), cut(highest))
