"""Parameters that agree with measured numbers, by a Gaussian process over computed points; points are added where that is open.

A point agrees at 68 or 95 % if its misfit is below that quantile of chi-square, one degree of freedom for each number. The
misfit is (y - f)ᵀ C⁻¹ (y - f) of measured numbers y and computed ones f. C is the covariance of all errors: the ± of y, the
scatter of starts, and the surrogate's error. Numbers of one start deviate together, so C is no diagonal.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.ensemble import student
from nanoslip.solver.sliding.validity import FLAGS
from nanoslip.solver.view import with_error
from nanoslip.study.inference.surrogate import JITTER, Surrogate, TooFewError, regress

# Measured numbers, and the ranges of parameters that are searched.


class Target(NamedTuple):
    """A measured number with its ± (one standard deviation), by the name that it has in a dataset.

    one_start: True if it was measured at a single place on the surface, as a trace is: its ± then lacks the scatter
        between starts. All such numbers are of one recording.
    """

    name: str
    value: float
    error: float
    one_start: bool = False


class Range(NamedTuple):
    """A parameter's range."""

    name: str
    low: float
    high: float
    logarithmic: bool

    def at(self, shares: Floats) -> Floats:
        """Values at these shares of the range."""
        if self.logarithmic:
            return np.asarray(self.low * (self.high / self.low) ** shares)
        return np.asarray(self.low + shares * (self.high - self.low))

    def shares(self, values: Floats) -> Floats:
        """The inverse."""
        if self.logarithmic:
            return np.asarray(np.log(values / self.low) / np.log(self.high / self.low))
        return np.asarray((values - self.low) / (self.high - self.low))


class ComputedPoint(NamedTuple):
    """Numbers (n, targets) at points (n, parameters) in the unit cube, and their errors, each (n, targets).

    NaN if unknown.
    """

    x: Floats
    values: Floats
    errors: Floats
    """The ± of each."""
    starts: Floats
    """(n, targets, targets) Covariance over starts that have all numbers, which share their place on the surface."""
    freedom: Floats
    """(n,) Degrees of freedom of that: these starts less one."""
    common: Floats
    """The part of ± that is the same draw at all points, as that of starts at the same places."""
    flags: NDArray[np.int64]
    """(n,) Bits of the validity flags of each point."""

    def with_these(self, other: "ComputedPoint") -> "ComputedPoint":
        """All points of both."""
        return ComputedPoint(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))


class StartScatter(NamedTuple):
    """Scatter of numbers of a single start, each (targets, targets)."""

    covariance: Floats
    """In shares of the numbers; 0 if unknown."""
    correlation: Floats
    """Widened for few starts: above 1 on its diagonal."""


Simulate = Callable[[Floats], ComputedPoint]
"""Computes points (n, parameters) in the unit cube, in their order."""

# The set that agrees.

LEVELS: Final = (0.68, 0.95)
CLOUD: Final = 2**14
"""Points at which the surrogate is looked at."""
ENOUGH: Final = 400
"""Fewest points of the cloud in the agreeing set, below which the cloud is contracted around it."""
ZOOMS: Final = 8
MOST_COMPUTED: Final = 256
"""Default number of computed points."""
PRECISE: Final = 0.3
"""Error of the surrogate over the error of a number, below which it widens the set by less than 5 % (0.3²/2)."""
SETTLED: Final = 0.05
"""Share of the set that further points have changed, up to which it is settled."""
WIDE_SHARE: Final = 0.9
"""Share of a range from which a parameter is not determined."""
TIED: Final = 0.8
"""Rank correlation of two parameters over the set, above which they cannot be distinguished."""
LEAST_TIED: Final = 0.15
"""Share of both ranges over which they are tied then, at least."""


@dataclass(frozen=True, eq=False)
class Fit:
    """The parameters that agree with measured numbers."""

    targets: tuple[Target, ...]
    ranges: tuple[Range, ...]
    computed: ComputedPoint
    surrogates: tuple[Surrogate, ...]
    """One for each target."""
    why: tuple[str, ...] = ()
    """Reasons for points without a number, and remedies."""
    at_best: ComputedPoint | None = None
    """The best point, computed as well."""

    def __str__(self) -> str:
        return "\n".join(sentences(self))

    def predict(self, x: Floats) -> tuple[Floats, Floats]:
        """The numbers at points (m, d) and their standard errors, each (m, targets); NaN where the nearest one has none."""
        predictions = [surrogate.predict(x) for surrogate in self.surrogates]
        means = np.column_stack([mean for mean, _ in predictions])
        errors = np.column_stack([error for _, error in predictions])
        _, nearest = scipy.spatial.KDTree(self.computed.x).query(x)
        is_known = np.isfinite(self.computed.values[nearest])
        means[~is_known.all(axis=1)] = np.nan
        return means, errors

    def misfit(self, x: Floats, unsure: bool = True) -> Floats:
        """The squared misfit of all numbers together at points (m, d); infinite if a number is missing.

        unsure: whether the surrogate's error counts. Else the least one is the nearest point, not the least known one.
        """
        means, errors = self.predict(x)
        missed = means - [target.value for target in self.targets]
        covariance = self.noise_covariance
        if unsure:
            covariance = covariance + self.surrogate_covariance(x, errors)
        is_known = np.asarray(np.isfinite(missed).all(axis=1))
        misfits = _whiten(covariance, np.where(is_known[:, None], missed, 0.0)[..., None])
        squares = np.sum(misfits[..., 0] ** 2, axis=1)
        return np.where(is_known, squares, np.inf)

    @cached_property
    def noise_covariance(self) -> Floats:
        """Covariance (targets, targets) of the measured numbers' errors: their ±, and for numbers of a single start
        the scatter between starts. Scatter of computed means is not added: the surrogate's error contains it.

        Stated ± are independent, except those of one recording, which shares its noise, offset and drift among them.
        """
        is_recorded = np.array([target.one_start for target in self.targets])
        # No correlation matrix R of k numbers has an eigenvalue above its trace, k: C = k·D² bounds any D R D.
        recorded = np.where(is_recorded, is_recorded.sum(), 1)
        variances = recorded * np.array([target.error for target in self.targets]) ** 2
        sizes = is_recorded * np.abs([target.value for target in self.targets])
        scatter = sizes * np.sqrt(np.diag(self.starts.covariance))
        return np.diag(variances) + np.outer(scatter, scatter) * self.starts.correlation

    @cached_property
    def starts(self) -> "StartScatter":
        """Scatter of numbers of a single start, over all points."""
        return scatter_of_starts(self.computed)

    def surrogate_covariance(self, x: Floats, errors: Floats) -> Floats:
        """Covariance (m, targets, targets) of the surrogates' errors at points (m, d). errors: their standard errors.

        The part of starts at the same places deviates as these starts do, the rest as values left out.
        """
        common = np.column_stack([surrogate.common_error(x) for surrogate in self.surrogates])
        own_errors = np.sqrt(np.maximum(errors**2 - common**2, 0.0))
        of_starts = common[:, :, None] * common[:, None, :] * self.starts.correlation
        return np.asarray(of_starts + own_errors[:, :, None] * own_errors[:, None, :] * self._left_out_correlation)

    @cached_property
    def _left_out_correlation(self) -> Floats:
        """Correlation (targets, targets) of what the surrogates miss of values left out, widened for few values."""
        missed = np.column_stack([surrogate.left_out for surrogate in self.surrogates])
        missed = missed[np.isfinite(missed).all(axis=1)]
        # Of n values a smooth dependence with k parameters leaves n - k that tell of errors.
        degrees = len(missed) - max(surrogate.parameters for surrogate in self.surrogates)
        return _widened_correlation(missed.T @ missed, degrees, 1.0)

    def limit(self, level: float) -> float:
        """The misfit up to which points agree at this level."""
        # At the true parameters the misfit is a sum of so many squared standard normal errors.
        return float(scipy.stats.chi2.ppf(level, len(self.targets)))

    @cached_property
    def cloud(self) -> tuple[Floats, Floats]:
        """Points (m, d) that fill the set that agrees, and misfits; if none does, around the nearest, without surrogate error."""
        dimensions = len(self.ranges)
        cube = scipy.stats.qmc.Sobol(dimensions, seed=SEED).random(CLOUD)
        low, high = np.zeros(dimensions), np.ones(dimensions)
        # A small set has few points of the first cloud: zoom in on it.
        for _ in range(ZOOMS):
            cloud = low + (high - low) * cube
            misfit = self.misfit(cloud)
            if misfit.min() > self.limit(LEVELS[-1]):
                misfit = self.misfit(cloud, unsure=False)
            inside = cloud[misfit <= self.acceptable_misfit(misfit)]
            if not 0 < len(inside) < ENOUGH:
                break
            # The set may reach beyond its outermost points by their spacing, and a quarter of its width is left around it.
            spacing = (high - low) * CLOUD ** (-1.0 / dimensions)
            room = 2.0 * spacing + 0.25 * np.ptp(inside, axis=0)
            low = np.maximum(inside.min(axis=0) - room, low)
            high = np.minimum(inside.max(axis=0) + room, high)
        return cloud, misfit

    def acceptable_misfit(self, misfit: Floats) -> float:
        """The misfit up to which points may agree, or are near the nearest."""
        near_least = float(misfit.min()) + self.limit(LEVELS[0])
        return max(self.limit(LEVELS[-1]), near_least)

    @property
    def reached(self) -> bool:
        """True if any point agrees at 95 %."""
        _, misfit = self.cloud
        return bool(misfit.min() <= self.limit(LEVELS[-1]))

    @cached_property
    def best(self) -> Floats:
        """The point (d,) of the least misfit, in the unit cube."""
        cloud, misfit = self.cloud
        start = cloud[misfit.argmin()]
        minimize: Any = scipy.optimize.minimize

        def misfit_at(x: Floats) -> float:
            return float(self.misfit(x[None], self.reached)[0])

        cube = [(0.0, 1.0)] * len(start)
        # Without slopes: the misfit is infinite where a number is missing.
        minimum = minimize(misfit_at, start, method="Nelder-Mead", bounds=cube)
        return np.asarray(minimum.x if minimum.fun < misfit.min() else start)

    def agreeing(self, level: float) -> Floats:
        """Points (m, d) of the cloud that agree at this level, in the unit cube."""
        cloud, misfit = self.cloud
        return cloud[misfit <= self.limit(level)]

    @cached_property
    def islands(self) -> tuple[tuple[Floats, Floats], ...]:
        """Each separate set at 95 %, the best one first: its points (m, d) in the unit cube and misfits, in rising order."""
        if not self.reached:
            return ()
        cloud, misfit = self.cloud
        is_inside = misfit <= self.limit(LEVELS[-1])
        x = np.vstack([self.best, cloud[is_inside]])
        misfit_of_best = self.misfit(self.best[None])
        misfit = np.concatenate([misfit_of_best, misfit[is_inside]])
        order = misfit.argsort()
        x, misfit = x[order], misfit[order]
        in_unit_cube = (x - cloud.min(axis=0)) / np.ptp(cloud, axis=0)
        labels = _separate(in_unit_cube)
        # Points come in rising order: the first of a set is its best.
        best_first = dict.fromkeys(labels.tolist())
        return tuple((x[labels == label], misfit[labels == label]) for label in best_first)

    def intervals(self, axis: int, level: float) -> list[tuple[float, float] | None]:
        """The range of a parameter over the points of each separate set that agree; None if none do."""
        intervals: list[tuple[float, float] | None] = []
        for x, misfit in self.islands:
            inside = x[misfit <= self.limit(level), axis]
            values = self.ranges[axis].at(inside)
            interval = (float(values.min()), float(values.max())) if len(values) else None
            intervals.append(interval)
        return intervals

    def undetermined_parameters(self) -> list[str]:
        """Parameters whose whole range agrees at 95 %."""
        inside = self.agreeing(LEVELS[-1])
        if not len(inside):
            return []
        spans = np.ptp(inside, axis=0)
        pairs = zip(self.ranges, spans, strict=True)
        return [its_range.name for its_range, span in pairs if span > WIDE_SHARE]

    def tied(self) -> Iterator[tuple[Range, Range, Floats]]:
        """Pairs of parameters that cannot be distinguished, and their values (2, 2) at both ends of the set at 95 %."""
        if not self.islands:
            return
        # Of the best set alone: two separate sets would look tied by lying apart.
        inside, _ = self.islands[0]
        if len(inside) < FEW_POINTS:
            return
        for first, second in itertools.combinations(range(len(self.ranges)), 2):
            x, y = inside[:, first], inside[:, second]
            if min(np.ptp(x), np.ptp(y)) <= LEAST_TIED:
                continue
            # Of ranks, as a valley may be bent.
            correlation = scipy.stats.spearmanr(x, y).statistic
            if not abs(float(correlation)) > TIED:
                continue
            order = np.argsort(x)
            # Medians of a few points: the outermost one alone is a matter of the draw.
            low = np.median(inside[order[:FEW_POINTS]], axis=0)
            high = np.median(inside[order[-FEW_POINTS:]], axis=0)
            ends = np.array([low, high])
            one, other = self.ranges[first], self.ranges[second]
            values = np.array([one.at(ends[:, first]), other.at(ends[:, second])])
            yield one, other, values

    def differs(self, other: "Fit") -> float:
        """Share of the set at 95 %, or of the surroundings of the nearest point, in which another fit differs."""
        cloud, misfit = self.cloud
        limit = self.acceptable_misfit(misfit)
        mine = misfit <= limit
        its = other.misfit(cloud, other.reached) <= limit
        in_one_only, in_any = (mine ^ its).sum(), (mine | its).sum()
        return float(in_one_only / max(in_any, 1))


def _next_points(fit: Fit, count: int) -> Floats:
    """Points to be computed next: spread over the set while the surrogate's error matters there; none when it does not."""
    cloud, misfit = fit.cloud
    inside = cloud[misfit <= fit.acceptable_misfit(misfit)]
    # Where no point has the numbers the search goes everywhere.
    if not len(inside):
        inside = cloud
    least = float(misfit.min())
    # Far from agreement the surrogate need not be precise: errors count beside what is missed there anyway.
    beyond = max(least / fit.limit(LEVELS[-1]), 1.0) if math.isfinite(least) else 1.0
    _, errors = fit.predict(inside)
    covariance = fit.surrogate_covariance(inside, errors)
    # In the combination of numbers in which it is largest: the root of the largest eigenvalue of N⁻¹ C.
    noise = fit.noise_covariance * beyond
    half = _whiten(noise, covariance)
    whitened = _whiten(noise, np.swapaxes(half, 1, 2))
    shares = np.sqrt(np.maximum(np.linalg.eigvalsh(whitened)[:, -1], 0.0))
    if np.percentile(shares, 95) <= PRECISE:
        return np.empty((0, len(fit.ranges)))
    distances, _ = scipy.spatial.KDTree(fit.computed.x).query(inside)
    distances = np.asarray(distances)
    chosen = []
    # Each next point is the one farthest from all computed and chosen ones.
    for _ in range(min(count, len(inside))):
        farthest = inside[distances.argmax()]
        chosen.append(farthest)
        distances = np.minimum(distances, np.linalg.norm(inside - farthest, axis=1))
    return np.array(chosen)


def scatter_of_starts(points: ComputedPoint) -> StartScatter:
    """Pool the scatter of starts over all points.

    It is the same share of a number at all points, as friction is proportional to μ_i.
    """
    is_known = np.asarray(np.isfinite(points.starts).all(axis=(1, 2)) & _has_all_numbers(points))
    squares = points.values[is_known] ** 2
    whole = squares.sum(axis=0)
    sizes = np.where(whole > 0.0, np.sqrt(whole), np.inf)
    covariance = points.starts[is_known].sum(axis=0) / sizes[:, None] / sizes
    # Welch and Satterthwaite: the degrees of freedom of a sum of variances with these shares. Starts at the same places are
    # the same draw at all points, whose shares add up before they are squared.
    shares = (squares / sizes**2).mean(axis=1)
    freedom = points.freedom[is_known]
    is_shared = np.nan_to_num(points.common[is_known]).any(axis=1)
    inverse = float(np.sum(shares[~is_shared] ** 2 / freedom[~is_shared]))
    if is_shared.any():
        inverse += float(shares[is_shared].sum() ** 2 / freedom[is_shared].max())
    degrees = 1.0 / inverse if inverse else 0.0
    # From too few starts no correlation is known: a bound, with the ± of so few.
    bound = student(degrees + 1.0) ** 2
    return StartScatter(covariance, _widened_correlation(covariance, degrees, bound))


def _whiten(covariance: Floats, columns: Floats) -> Floats:
    """L⁻¹ of columns (m, n, k), L Lᵀ the covariance (n, n) or (m, n, n). Numbers that deviate as one keep a rounding apart."""
    apart = 1.0 + JITTER * np.eye(covariance.shape[-1])
    return np.asarray(np.linalg.solve(np.linalg.cholesky(covariance * apart), columns))


def _widened_correlation(covariance: Floats, degrees: float, bound: float) -> Floats:
    """The correlation matrix of a covariance (n, n) from so many draws, widened as these are few: above 1 on its diagonal.

    Numbers without variance are independent. bound: variance from too few draws, where no correlation is known.
    """
    count = len(covariance)
    # No correlation matrix has an eigenvalue above its trace, n.
    if degrees <= count + 1.0:
        return count * bound * np.eye(count)
    # A misfit by a covariance from ν normal draws is no chi-square, but Hotelling's T², distributed as p·ν/(ν - p + 1) times F
    # with p and ν - p + 1 degrees of freedom (Ann. Math. Stat. 2, 360, 1931): 1.47 times as much at 95 % for 16 draws of three
    # numbers, which then holds 74 % at 68 %.
    level, rest = LEVELS[-1], degrees - count + 1.0
    largest = count * degrees / rest * float(scipy.stats.f.ppf(level, count, rest))
    factor = largest / float(scipy.stats.chi2.ppf(level, count))
    deviations = np.sqrt(np.diag(covariance))
    sizes = np.where(deviations > 0.0, deviations, np.inf)
    correlation = covariance / np.outer(sizes, sizes)
    np.fill_diagonal(correlation, 1.0)
    return np.asarray(factor * correlation)


def _separate(x: Floats) -> NDArray[np.int_]:
    """Number of the set of each point (m, d) in the unit cube. Empty boxes, wide enough for some points, separate sets."""
    dimensions = x.shape[1]
    widest = (CLOUD / FEW_POINTS) ** (1.0 / dimensions)
    boxes = max(int(min(widest, len(x) / FEW_POINTS)), 1)
    numbers = np.clip(boxes * x, 0, boxes - 1).astype(int)
    box = tuple(numbers.T)
    full = np.zeros((boxes,) * dimensions, dtype=np.bool_)
    full[box] = True
    # Boxes that meet at a corner belong together: all 3^d - 1 neighbours count.
    neighbours = np.ones((3,) * dimensions)
    labels, _ = scipy.ndimage.label(full, neighbours)
    return np.asarray(labels[box])


def sentences(fit: Fit) -> Iterator[str]:
    """Report the points that agree, or the closest points; and the parameters that cannot be distinguished."""
    targets, ranges = fit.targets, fit.ranges
    means, errors = (predicted[0] for predicted in fit.predict(fit.best[None]))
    shown = _numbers_with_errors(targets, means, errors)
    asked = ", ".join(f"{target.name} = {target.value:g} ± {target.error:g}" for target in targets)
    place = ", ".join(f"{parameter.name} = {parameter.at(fit.best)[axis]:.3g}" for axis, parameter in enumerate(ranges))
    ratio = ""
    if len(targets) == 2 and targets[1].value and means[1]:
        measured = targets[0].value / targets[1].value
        ratio = f"; ratio {means[0] / means[1]:.3g}, measured {measured:.3g}"
    if not fit.reached:
        yield f"Not reached: {asked}. Nearest: {shown}{ratio}, at {place}."
    else:
        yield f"Best: {shown}{ratio}, at {place}."
        if not len(fit.agreeing(LEVELS[0])):
            yield "Nothing agrees at 68 %."
    is_at_end = np.abs(fit.best - 0.5) > 0.5 - EDGE_SHARE
    if is_at_end.any():
        names = [parameter.name for parameter, at_end in zip(ranges, is_at_end, strict=True) if at_end]
        yield f"At an end of its range: {', '.join(names)}. A wider one may come nearer."
    if fit.at_best and np.isfinite(fit.at_best.values).all():
        computed = _numbers_with_errors(targets, fit.at_best.values[0], fit.at_best.errors[0])
        yield f"Computed there: {computed}."
    if len(fit.islands) > 1:
        yield f"{len(fit.islands)} separate sets agree at 95 %, the best one first."
    for name in fit.undetermined_parameters():
        yield f"{name} is not determined by these numbers: its whole range agrees at 95 %."
    for first, second, ((a, b), (c, d)) in fit.tied():
        pair = f"{first.name} and {second.name} cannot be told apart"
        change = f"a larger {first.name} with a {'larger' if d > c else 'smaller'} {second.name} agrees at 95 %"
        low_end = f"{first.name} = {a:.3g}, {second.name} = {c:.3g}"
        high_end = f"{first.name} = {b:.3g}, {second.name} = {d:.3g}"
        yield f"{pair}: {change}, from {low_end} to {high_end}. It needs a measurement of one of them."
    yield f"{len(fit.computed.x)} points are computed."
    missing = int((~_has_all_numbers(fit.computed)).sum())
    if missing:
        yield f"Without a number: {missing} of them; around these nothing agrees."
        yield from fit.why
    for flag in FLAGS:
        flagged = int((fit.computed.flags & flag.mask != 0).sum())
        if flagged:
            count = f"{flagged} of them ({flag.meaning})"
            yield f"Used with the validity flag {flag.name}: {count}. Advice: {flag.advice}."


def _numbers_with_errors(targets: Sequence[Target], values: Floats, errors: Floats) -> str:
    numbers = zip(targets, values.tolist(), errors.tolist(), strict=True)
    return ", ".join(f"{target.name} = {with_error(value, error)}" for target, value, error in numbers)


def _has_all_numbers(points: ComputedPoint) -> NDArray[np.bool_]:
    """True (n,) for points that have all numbers."""
    return np.asarray(np.isfinite(points.values).all(axis=1))


EDGE_SHARE: Final = 0.02
"""Share of a range that counts as its end."""
SEED: Final = 1
FEW_POINTS: Final = 10
"""Points at each end of a set whose middle is that end."""


def search_parameters(
    targets: Sequence[Target],
    ranges: Sequence[Range],
    simulate: Simulate,
    finished: ComputedPoint | None = None,
    most: int = MOST_COMPUTED,
    why: Callable[[Floats], Sequence[str]] = lambda _: (),
) -> Fit:
    """Find the parameters that agree with measured numbers. Raises TooFewError if too few points have them.

    simulate: called with points that fill the ranges, then with more in doubtful places, until little changes or `most` are done.
    finished: points computed before. why: called with points without a number; returns causes and advice.
    """

    def fitted(computed: ComputedPoint) -> Fit:
        holes = computed.x[~_has_all_numbers(computed)]
        reasons = tuple(why(holes)) if len(holes) else ()
        surrogates = _surrogates(targets, computed, reasons)
        return Fit(tuple(targets), tuple(ranges), computed, surrogates, reasons)

    before: Fit | None
    fit: Fit | None = None
    if finished is not None:
        with suppress(TooFewError):
            fit = fitted(finished)
    if fit is None or fit.reached or len(_next_points(fit, 1)):
        computed = simulate(filling(len(ranges))[:most])
        if finished:
            computed = finished.with_these(computed)
        fit = None
        while True:
            before, fit = fit, fitted(computed)
            count = min(6 * len(ranges), most - len(computed.x))
            x = _next_points(fit, count)
            if not len(x) or (before and fit.differs(before) <= SETTLED):
                break
            computed = computed.with_these(simulate(x))
    return replace(fit, at_best=simulate(fit.best[None]))


def filling(dimensions: int) -> Floats:
    """The points that are computed first."""
    sobol = scipy.stats.qmc.Sobol(dimensions, seed=SEED)
    # Sobol' points are balanced in powers of two: the first of at least ten points for each parameter.
    power = math.ceil(math.log2(10 * dimensions))
    return np.asarray(sobol.random_base2(power))


def _surrogates(targets: Sequence[Target], computed: ComputedPoint, why: Sequence[str]) -> tuple[Surrogate, ...]:
    surrogates = []
    for target, values, errors, common in zip(
        targets, computed.values.T, computed.errors.T, computed.common.T, strict=True
    ):
        try:
            surrogates.append(regress(computed.x, values, errors, common=common))
        except TooFewError as error:
            missing = int(np.isnan(values).sum())
            holes = f"; {missing} of {len(values)} points are without" if missing else ""
            lines = [f"{target.name}: {error}{holes}", *why]
            raise TooFewError("\n".join(lines)) from None
    return tuple(surrogates)
