"""Sensitivity of a number to parameters: first-order and total Sobol' indices (Sobol' 2001) from the existing cases.

Sums over the table of a complete product of axes; else indices of functions drawn from a Gaussian process over known cases.
Their uncertainty is the spread of the draws and the share of variance that the process does not predict at cases left out.
Cases of the same starts deviate together as far as their members do: that part of a ± is one draw for each set of starts.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

import numpy as np
import scipy
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.case import PIN_SIZES
from nanoslip.solver.ensemble import student
from nanoslip.study.dataset.access import read_members
from nanoslip.study.dataset.table import CaseRows
from nanoslip.study.figures.points import Points, longest_rows, points_named, unevenness
from nanoslip.study.inference.surrogate import ALIKE, MOST_REGRESSED, Surrogate, TooFewError, regress

# The parameters of cases as numbers in the unit cube, and how likely each value is.

SPARSE: Final = 0.5
"""Share of the cases up to which values of an axis are levels, all as likely; more different ones fill a range."""


@dataclass(frozen=True, slots=True, eq=False)
class Axis:
    """A parameter in which cases differ."""

    name: str
    levels: tuple[Any, ...]
    """Values of a discrete axis, equally likely; empty for a range."""
    low: float = 0.0
    high: float = 0.0
    """Ends of the range, of logarithms where they lie more evenly."""
    logarithmic: bool = False

    @property
    def worded(self) -> bool:
        """True if its values are no numbers, so that all are equally far apart."""
        return self.low == self.high

    def places(self, values: NDArray[Any]) -> Floats:
        """Values (n,) as columns (n, k) in the unit cube."""
        if self.worded:
            return np.array([[float(value == level) for level in self.levels] for value in values.tolist()])
        numbers = values.astype(float)
        if self.logarithmic:
            numbers = np.log(numbers)
        return np.asarray((numbers[:, None] - self.low) / (self.high - self.low))

    def drawn(self, shares: Floats) -> Floats:
        """Positions (n, k) of values at these quantiles of its distribution, shares (n,) in [0, 1)."""
        if not self.levels:
            return shares[:, None]
        levels = self.places(np.array(self.levels))
        chosen = (shares * len(self.levels)).astype(int)
        return np.asarray(levels[chosen])


def find_axis(name: str, values: NDArray[Any]) -> Axis:
    """The axis that cases have these values of."""
    if values.dtype.kind in "OUb":
        return Axis(name, tuple(dict.fromkeys(values.tolist())))
    levels = np.unique(values.astype(float))
    logarithmic = False
    if levels[0] > 0.0 and len(levels) > 2:
        logarithmic = unevenness(np.log(levels)) < unevenness(levels)
    ends = np.log(levels) if logarithmic else levels
    low, high = float(ends[0]), float(ends[-1])
    if len(levels) <= max(2.0, SPARSE * len(values)):
        return Axis(name, tuple(levels.tolist()), low, high, logarithmic)
    # Values that fill a range evenly are the middles of equal parts of it: its ends are half a spacing further out.
    room = 0.5 * (high - low) / (len(levels) - 1)
    return Axis(name, (), low - room, high + room, logarithmic)


# Errors that cases of the same starts share.


@dataclass(frozen=True, slots=True, eq=False)
class SharedStarts:
    """Sets of starts of cases, and how far the ± of cases of one set is one draw."""

    sets: NDArray[np.int_]
    """(n,) Number of each case's set, from 0."""
    share: float
    """Share of the variance of a ± that all cases of a set have in common, 0 to 1."""

    def variance_share(self) -> float:
        """Share of the variance of a ± that is in the variance over all cases: a draw that all have in common is not."""
        shares = np.bincount(self.sets) / len(self.sets)
        return 1.0 - self.share * float(np.sum(shares**2))

    def common_part(self, errors: Floats) -> Floats:
        """The part of each ± (n,) that it has in common with others: none of a case that is alone in its set."""
        is_alone = np.bincount(self.sets)[self.sets] == 1
        part = np.where(is_alone, 0.0, math.sqrt(self.share))
        # An infinite ± without a common part has none.
        return np.multiply(part, errors, where=part > 0.0, out=np.zeros(len(errors)))

    def draw(self, errors: Floats, random: np.random.Generator) -> Floats:
        """Draw errors of these standard deviations (n,)."""
        chance = math.sqrt(1.0 - self.share) * random.standard_normal(len(self.sets))
        if self.share:
            common = random.standard_normal(self.sets.max() + 1)
            chance += math.sqrt(self.share) * common[self.sets]
        return np.asarray(errors * chance)


def share_of_starts(sets: NDArray[np.int_], members: Sequence[NDArray[Any]]) -> float:
    """Share of the variance over members that cases of one set of starts have in common; NaN without members to compare.

    The mean correlation of members by their number. Of k cases with a common share φ the means of deviations, each in its
    standard deviations, have the variance φ + (1 - φ)/k. members: of each case, (members,).
    """
    found, weights = [], []
    for number in range(sets.max() + 1):
        scattered = [members[case] for case in np.flatnonzero(sets == number).tolist() if _is_scattered(members[case])]
        if len(scattered) < 2:
            continue
        count = min(map(len, scattered))
        table = np.array([_standardized(values[:count]) for values in scattered])
        cases = len(table)
        variance = float(table.mean(axis=0).var(ddof=1))
        found.append((cases * variance - 1.0) / (cases - 1.0))
        weights.append((cases - 1.0) * (count - 1.0))
    if not found:
        return math.nan
    return float(np.clip(np.average(found, weights=weights), 0.0, 1.0))


def _is_scattered(members: NDArray[Any]) -> bool:
    """True if all members (members,) have a number, and the first two differ: only such ones are compared with others."""
    return len(members) > 1 and bool(np.isfinite(members).all() and members[0] != members[1])


def _standardized(values: NDArray[Any]) -> Floats:
    """Deviations from the mean, in standard deviations."""
    return np.asarray((values - values.mean()) / values.std(ddof=1))


# Indices, with the interval that holds them with 95 %.

LEAST_PREDICTED: Final = 0.8
"""Predictivity below which a surrogate is no ground for indices."""
PATHS: Final = 96
"""Functions, or tables, that intervals are taken from."""
SETS: Final = 8
"""Number of point sets for integrals over ranges. Sets share the functions, so that the spread includes the sets' errors."""
POINTS: Final = 2**10
"""Number of points in a set (scipy.stats.sobol_indices), times the number of axes and two."""
ENDS: Final = (2.5, 97.5)
"""Percentiles of an interval."""
SEED_OF_DRAWS: Final = 1


@dataclass(frozen=True, slots=True, eq=False)
class Sensitivity:
    """Shares of the variance of a number over a campaign's cases; each (axes, 3): the index, and its interval's ends."""

    of: str
    axes: tuple[str, ...]
    first: Floats
    """First-order indices: each axis alone."""
    total: Floats
    """Total indices: each axis with all its interactions."""
    noise: float
    """Share of the numbers' variance that is due to their ± and not in the indices; NaN if no ± is known."""
    scatter: float
    """Share that follows no smooth dependence, nor is in the indices; 0 for a complete table, whose total indices
    contain it."""
    predictivity: float
    """Share of the variance that the surrogate predicts at cases left out; 1 of a complete table."""
    known: int
    """Cases that the indices rest on."""
    holes: int
    """Cases without the number."""
    unsure: int
    """Cases with the number and without a ±, whose error counts as that of the others."""
    complete: bool
    """True if the cases are a complete product of axes."""
    unknown: str = ""
    """Reason why indices are unknown: they are NaN then."""
    starts: int = 0
    """Sets of starts among the cases with the number: one set is at the same places in all its cases. 0 if not counted."""
    common: float = math.nan
    """Share of the variance of a ± that cases of one set have in common, from their members; NaN if unknown."""


def indices(
    of: str,
    columns: Mapping[str, NDArray[Any]],
    values: Floats,
    errors: Floats,
    most: int = MOST_REGRESSED,
    starts: SharedStarts | None = None,
) -> Sensitivity:
    """Indices of a number over cases, from the coordinates in which they differ, each (n,).

    values: NaN of holes. errors: the ± of each, NaN where it is not known. most: values that a surrogate is made of.
    starts: default: each ± is independent of all others.
    """
    axes = [find_axis(name, column) for name, column in columns.items()]
    starts = starts or SharedStarts(np.arange(len(values)), 0.0)
    answer = _count_cases(of, columns, values, errors, starts)
    tied = _tied(axes, columns)
    if tied or len(axes) < 2:
        return replace(answer, unknown=tied or "only one parameter differs from case to case")
    table = _table(axes, columns, values, errors, starts)
    if table is not None:
        is_alike = np.ptp(values) <= ALIKE * np.abs(values).max()
        if answer.noise >= 1.0 or is_alike:
            return replace(answer, unknown="its values are alike, within their ± or rounding")
        first, total = _table_indices(*table)
        return replace(answer, first=first, total=total, scatter=0.0, predictivity=1.0, complete=True)
    places = [axis.places(columns[axis.name]) for axis in axes]
    try:
        surrogate = regress(np.hstack(places), values, errors, most, starts.common_part(errors), starts.sets)
    except TooFewError as error:
        return replace(answer, unknown=str(error))
    scatter = (surrogate.scatter / surrogate.scale) ** 2
    answer = replace(answer, scatter=scatter, predictivity=surrogate.predictivity)
    if surrogate.predictivity < LEAST_PREDICTED:
        # Down to a tenth of a percent, as 79.97 % are not the 80 % that are needed.
        thousandths = math.floor(1000.0 * max(surrogate.predictivity, 0.0))
        share = f"{thousandths / 10.0:g} %"
        least = f"{100.0 * LEAST_PREDICTED:.0f} %"
        why = f"a smooth dependence predicts {share} of the variance of cases left out, and {least} are needed"
        return replace(answer, unknown=f"{why}: add cases, or members")
    # Levels are finitely many combinations, of which all are evaluated; ranges are integrated by points.
    has_levels = all(axis.levels for axis in axes)
    draw_indices = _level_indices if has_levels else _range_indices
    first, total = draw_indices(axes, surrogate)
    missed = float(np.clip(1.0 - surrogate.predictivity, scatter, 1.0))
    return replace(answer, first=_interval(first, missed), total=_interval(total, missed))


def _count_cases(
    of: str, columns: Mapping[str, NDArray[Any]], values: Floats, errors: Floats, starts: SharedStarts
) -> Sensitivity:
    """A sensitivity whose indices are unknown so far: counts of cases, and the share of the ± in the variance."""
    is_known = np.isfinite(values)
    values_known = values[is_known]
    noise = np.nan
    if np.isfinite(errors[is_known]).any() and np.ptp(values_known) > 0.0:
        # The squares of numbers near the largest float overflow: noise is then infinite.
        with np.errstate(over="ignore"):
            variance_of_error = np.nanmean(errors[is_known] ** 2)
            noise = float(starts.variance_share() * variance_of_error / np.var(values_known))
    unsure = is_known & np.isnan(errors)
    none = np.full((len(columns), 3), np.nan)
    return Sensitivity(
        of,
        tuple(columns),
        first=none,
        total=none,
        noise=noise,
        scatter=np.nan,
        predictivity=np.nan,
        known=int(is_known.sum()),
        holes=int((~is_known).sum()),
        unsure=int(unsure.sum()),
        complete=False,
    )


def _level_indices(axes: Sequence[Axis], surrogate: Surrogate) -> tuple[Floats, Floats]:
    """First-order and total indices (paths, axes) of functions drawn over all combinations of levels."""
    shape = [len(axis.levels) for axis in axes]
    numbers = np.indices(shape).reshape(len(axes), -1)
    places = []
    for axis, number in zip(axes, numbers, strict=True):
        levels = axis.places(np.array(axis.levels))
        places.append(levels[number])
    tables = surrogate.paths(PATHS, SEED_OF_DRAWS)(np.hstack(places))
    shares = [_shares(table.reshape(shape), NOISELESS) for table in tables]
    first, total = zip(*shares, strict=True)
    return np.array(first), np.array(total)


def _range_indices(axes: Sequence[Axis], surrogate: Surrogate) -> tuple[Floats, Floats]:
    """First-order and total indices (paths, axes) of drawn functions, integrated over ranges by sets of points."""
    sums = [_set_indices(axes, surrogate, seed) for seed in range(SETS)]
    first, total = zip(*sums, strict=True)
    return np.concatenate(first), np.concatenate(total)


def _set_indices(axes: Sequence[Axis], surrogate: Surrogate, seed: int) -> tuple[Floats, Floats]:
    paths = surrogate.paths(PATHS // SETS, seed)
    evenly: Any = [scipy.stats.uniform()] * len(axes)

    def evaluate(shares: Floats) -> Floats:
        places = [axis.drawn(share) for axis, share in zip(axes, shares, strict=True)]
        return paths(np.hstack(places))

    draw = np.random.default_rng(seed)
    sobol = scipy.stats.sobol_indices(func=evaluate, n=POINTS, dists=evenly, rng=draw)
    return sobol.first_order, sobol.total_order


def _tied(axes: Sequence[Axis], columns: Mapping[str, NDArray[Any]]) -> str:
    """Two axes that vary together, so that their effects cannot be separated; empty without any."""
    numbers = [axis for axis in axes if not axis.worded]
    if len(numbers) < 2:
        return ""
    places = [axis.places(columns[axis.name])[:, 0] for axis in numbers]
    is_tied = np.abs(np.corrcoef(places)) > MOST_TIED
    pairs = np.argwhere(np.triu(is_tied, k=1))
    if not len(pairs):
        return ""
    first, second = (numbers[number].name for number in pairs[0])
    return f"{first} and {second} vary together: needs a design that varies each by itself"


MOST_TIED: Final = 0.7
"""Correlation of two axes over the cases from which they are not independent any more, as indices need them."""


class TableNoise(NamedTuple):
    """Errors of the numbers of a table."""

    own: float
    """Variance of errors that are independent of each other."""
    common: float = 0.0
    """Variance of errors that are equal along all axes but the deciding ones."""
    deciding: tuple[int, ...] = ()

    def variance_of_means(self, shape: Sequence[int], over: Sequence[int]) -> float:
        """Variance of the errors of means over these axes, about the mean of all."""
        kept = [size for axis, size in enumerate(shape) if axis not in over]
        sets = [size for axis, size in enumerate(shape) if axis in self.deciding]
        kept_sets = [size for axis, size in enumerate(shape) if axis in self.deciding and axis not in over]
        # Each of m means is over size/m values: noise adds noise·m/size to its variance, and (m - 1)/m of that to the
        # variance about their common mean. Of errors that sets of values share, sets are counted in place of values.
        own = self.own * (math.prod(kept) - 1.0) / math.prod(shape)
        return own + self.common * (math.prod(kept_sets) - 1.0) / math.prod(sets)

    def scaled(self, factor: float) -> "TableNoise":
        """Noise of this many times the variances."""
        return self._replace(own=factor * self.own, common=factor * self.common)


NOISELESS: Final = TableNoise(0.0)


def _table(
    axes: Sequence[Axis],
    columns: Mapping[str, NDArray[Any]],
    values: Floats,
    errors: Floats,
    starts: SharedStarts,
) -> tuple[Floats, Floats, SharedStarts] | None:
    """Values and errors over all combinations of levels, and sets of starts in that order; None if cases are missing, or
    have no value."""
    shape = tuple(len(axis.levels) for axis in axes)
    if np.prod(shape) != len(values) or not np.isfinite(values).all():
        return None
    places = []
    for axis in axes:
        numbers = [axis.levels.index(value) for value in columns[axis.name].tolist()]
        places.append(np.array(numbers))
    order = np.ravel_multi_index(tuple(places), shape)
    if len(np.unique(order)) < len(order):
        return None
    back = np.argsort(order)
    known_errors = errors[np.isfinite(errors)]
    # An unknown ± counts as the others do: with none at all its case would look exact.
    usual = float(np.sqrt(np.mean(known_errors**2))) if len(known_errors) else 0.0
    errors = np.nan_to_num(errors[back], nan=usual)
    return values[back].reshape(shape), errors.reshape(shape), replace(starts, sets=starts.sets[back])


def _table_indices(values: Floats, errors: Floats, starts: SharedStarts) -> tuple[Floats, Floats]:
    """Indices of a complete table: their error is that of its numbers, drawn once more."""
    variance = float(np.mean(errors**2))
    sets = starts.sets.reshape(values.shape)
    deciding = tuple(axis for axis in range(values.ndim) if np.diff(sets, axis=axis).any())
    noise = TableNoise((1.0 - starts.share) * variance, starts.share * variance, deciding)
    draw = np.random.default_rng(SEED_OF_DRAWS)
    first, total = _shares(values, noise)
    again = []
    for _ in range(PATHS):
        drawn = values + starts.draw(errors.ravel(), draw).reshape(values.shape)
        # A value drawn around one that has this error already has it twice.
        again.append(_shares(drawn, noise.scaled(2.0)))
    # (2 ends, first and total, axes).
    ends = np.percentile(again, ENDS, axis=0)
    first_with_ends = np.column_stack([first, *ends[:, 0]])
    total_with_ends = np.column_stack([total, *ends[:, 1]])
    return first_with_ends, total_with_ends


def _shares(table: Floats, noise: TableNoise) -> tuple[Floats, Floats]:
    """First-order and total indices of a table over equally likely levels, less the contribution of noise."""
    every = tuple(range(table.ndim))

    def variance(*over: int) -> float:
        of_means = float(table.mean(axis=over).var())
        return max(of_means - noise.variance_of_means(table.shape, over), 0.0)

    total_variance = max(variance(), 1e-300)
    # First: variance of the means at each level of the axis. Total: all that is no variance of the means over the axis.
    first, total = [], []
    for axis in every:
        others = tuple(other for other in every if other != axis)
        first.append(variance(*others) / total_variance)
        total.append(1.0 - variance(axis) / total_variance)
    return np.clip(first, 0.0, 1.0), np.clip(total, 0.0, 1.0)


def _interval(drawn: Floats, missed: float) -> Floats:
    """Mean and ends over draws (paths, axes), as (axes, 3): missed is the share of the variance that the draws do not have."""
    # 95 % of a normal distribution.
    means, spread = drawn.mean(axis=0), 1.96 * drawn.std(axis=0)
    # Indices are shares of the variance that is predicted: of the rest a parameter may have nothing, or all.
    low, high = np.clip([means - spread, means + spread], 0.0, 1.0) * (1.0 - missed)
    return np.column_stack([means, low, high + missed])


# Numbers with what is known of their errors.


LARGEST: Final = 1e100
"""Largest number that is used; squares and ratios must not overflow."""


def bounded(values: NDArray[Any]) -> Floats:
    """NaN instead of numbers above LARGEST."""
    numbers = values.astype(float)
    return np.where(np.abs(numbers) <= LARGEST, numbers, np.nan)


def values_of_members(dataset: xr.Dataset, points: Points) -> list[NDArray[Any]]:
    """The number of each member (members,), of each of all points; NaN above LARGEST."""
    rows = longest_rows(dataset, points.sources, {})
    columns = [read_members(rows, name) for name in points.sources]
    if len(columns) == 1:
        return [bounded(members) for members in columns[0]]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return [bounded(above / below) for above, below in zip(*columns, strict=True)]


def spread_of_members(dataset: xr.Dataset, points: Points) -> Floats:
    """Standard deviation over the members of each of all points, also where the mean has no ±; NaN of fewer than two members."""
    return _deviations(values_of_members(dataset, points))


def _deviations(members: Sequence[NDArray[Any]]) -> Floats:
    """Standard deviation over each list of members; NaN of fewer than two."""
    return np.array([_deviation(values[np.isfinite(values)]) for values in members])


def point_errors(points: Points, spread: Floats) -> Floats:
    """The ± of means (n,). If it is unknown, as for short records, a lower bound: the standard error from the scatter
    of members.

    spread: standard deviation over members, NaN for a single member.
    """
    members = np.where(points.members > 1, points.members, np.nan)
    standard_errors = student(members) * spread / np.sqrt(members)
    is_usable = (points.errors >= 0.0) & (points.errors <= LARGEST)
    return np.where(is_usable, points.errors, standard_errors)


def _deviation(values: NDArray[Any]) -> float:
    return float(np.std(values, ddof=1)) if len(values) > 1 else math.nan


# Indices of a dataset, and in words.


def sensitivity(dataset: xr.Dataset, of: str, most: int = MOST_REGRESSED) -> Sensitivity:
    """Compute the sensitivity of a number of a dataset; flagged numbers count as all others. Raises UnknownNameError, ValueError.

    of: a variable as `nanoslip describe` lists them, its symbol, or a ratio of two. most: values that a surrogate is made of.

    >>> import nanoslip
    >>> data = nanoslip.run({
    ...     "title": "Contact size over load and radius",
    ...     "stages": ["contact"],
    ...     "axes": {"normal_load": [2e-4, 4e-4, 8e-4], "radius": [50.0, 100.0]},
    ...     "numerics": {"n_x": 65},
    ... })
    >>> found = nanoslip.sensitivity(data, "contact_half_width")
    >>> found.axes, found.complete, found.first[:, 0].round(1).tolist()
    (('radius', 'normal_load'), True, [0.2, 0.7])
    """
    points = points_named(dataset, of)
    if points.text:
        raise ValueError(f"{of}: needs a number, and is words")
    members = values_of_members(dataset, points)
    errors = point_errors(points, _deviations(members))
    values = bounded(points.values)
    sets = _sets_of_starts(longest_rows(dataset, points.sources, {}))
    is_known = np.isfinite(values)
    common = share_of_starts(sets, members)
    starts = SharedStarts(sets, 0.0 if math.isnan(common) else common)
    answer = indices(points.name, points.axes, values, errors, most, starts)
    return replace(answer, starts=len(np.unique(sets[is_known])), common=common)


DECIDING_STARTS: Final = ("normal_load", "n_x", "start", "start_y")
"""Parameters of which, with the pin's size, the places follow where members come down (`nanoslip.solver.ensemble.draw_start`)."""


def _sets_of_starts(rows: CaseRows) -> NDArray[np.int_]:
    """(rows,) Number of the set of starts of each case, from 0, by its parameters as the solver has them.

    The coordinates in which points differ are no ground: in a campaign that is given in SI they have other names.
    """
    columns = [rows.values(name).astype(float) for name in DECIDING_STARTS if rows.has(name)]
    shapes = rows.values("pin") if rows.has("pin") else None
    for shape, size in PIN_SIZES.items():
        if rows.has(size):
            sizes = rows.values(size).astype(float)
            # A radius that is an axis is one of flat punches, too, which do not have it.
            columns.append(sizes if shapes is None else np.where(shapes == shape, sizes, 0.0))
    if not columns:
        return np.zeros(len(rows), int)
    # A number that some cases lack is NaN there, and no different number in each.
    numbers = np.nan_to_num(np.column_stack(columns))
    _, sets = np.unique(numbers, axis=0, return_inverse=True)
    return np.asarray(sets).ravel()


def caution(answer: Sensitivity) -> str:
    """State the certainty of the indices, in sentences, or why they are unknown."""
    points = f"all {answer.known} points"
    if answer.holes:
        points = f"{answer.known} of {answer.known + answer.holes} points"
    if answer.unknown:
        return f"What {answer.of} depends on is not known from {points}: {answer.unknown}."
    how = "a complete table"
    if not answer.complete:
        share = f"{100.0 * answer.predictivity:.3g} %"
        how = f"by a Gaussian process, which predicts {share} of the variance of cases left out, beyond their ±"
    told = [f"From {points}, {how}"]
    if np.isfinite(answer.noise):
        told.append(f"{100.0 * answer.noise:.2g} % of the variance is that of the ±, and in no index")
        if answer.unsure:
            told.append(f"{answer.unsure} have no ±: that of the others counts for them")
        if 0 < answer.starts < answer.known:
            sets = "one set" if answer.starts == 1 else f"{answer.starts} sets"
            why = "as cases of equal load, pin and n_x start at the same places"
            told.append(f"they have {sets} of starts, {why}: {_shared_part(answer)}")
    else:
        told.append("no ± is known")
    if answer.scatter > LEAST_SCATTER:
        told.append(f"{100.0 * answer.scatter:.2g} % is scatter without a smooth dependence, and in no index")
    return "; ".join(told) + "."


def _shared_part(answer: Sensitivity) -> str:
    """The part of each ± that cases of equal starts share, and how it counts."""
    if math.isnan(answer.common):
        return "each ± counts as independent, so indices of what decides the starts may be less sure"
    return f"by their members {100.0 * answer.common:.2g} % of the variance of each ± is the same draw in a set, and counts so"


LEAST_SCATTER: Final = 1e-3
"""Share of scatter that is worth a word."""
