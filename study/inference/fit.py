"""Parameters that agree with measured numbers, by a Gaussian process over computed points; points are added where that is open.

A point agrees at 68 or 95 % if the sum of its squared misfits is below that quantile of chi-square, one degree of freedom for
each number. The unit of a misfit combines the number's ±, scatter of computed values beyond theirs, and the surrogate's error.
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
from nanoslip.solver.sliding.validity import FLAGS
from nanoslip.solver.view import with_error
from nanoslip.study.inference.surrogate import Surrogate, TooFewError, regress

# Measured numbers, and the ranges of parameters that are searched.


class Target(NamedTuple):
    """A measured number with its ± (one standard deviation), by the name that it has in a dataset.

    one_start: True if it was measured at a single place on the surface, as a trace is: its ± then lacks the scatter
        between starts.
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
    """The standard deviation over starts."""
    common: Floats
    """The part of ± that is the same draw at all points, as that of starts at the same places."""
    flags: NDArray[np.int64]
    """(n,) Bits of the validity flags of each point."""

    def with_these(self, other: "ComputedPoint") -> "ComputedPoint":
        """All points of both."""
        return ComputedPoint(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))


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
        found = [surrogate.predict(x) for surrogate in self.surrogates]
        means, errors = (np.column_stack([each[part] for each in found]) for part in (0, 1))
        _, nearest = scipy.spatial.KDTree(self.computed.x).query(x)
        means[~np.isfinite(self.computed.values[nearest]).all(axis=1)] = np.nan
        return means, errors

    def misfit(self, x: Floats, unsure: bool = True) -> Floats:
        """Sum of the squared misfits at points (m, d); infinite if a number is missing.

        unsure: whether the surrogate's error counts. Else the least one is the nearest point, not the least known one.
        """
        means, errors = self.predict(x)
        squares = (means - [target.value for target in self.targets]) ** 2
        found = np.sum(squares / ((errors**2 if unsure else 0.0) + self.noise**2), axis=1)
        return np.where(np.isfinite(found), found, np.inf)

    @cached_property
    def noise(self) -> Floats:
        """Standard deviation (targets,) of a measured number beside the surrogate's error: its ±, and for a
        measurement of a single start the scatter between starts.

        The scatter is the same share of the number at all points, as friction is proportional to μ_i. Scatter of
        computed means is not added: the surrogate's error contains it.
        """
        there = np.isfinite(self.computed.values + self.computed.starts)
        values, starts = (np.where(there, each, 0.0) for each in (self.computed.values, self.computed.starts))
        shares = np.linalg.norm(starts, axis=0) / np.maximum(np.linalg.norm(values, axis=0), 1e-300)
        starts_of = shares * [target.one_start * target.value for target in self.targets]
        return np.asarray(np.hypot([target.error for target in self.targets], starts_of))

    def limit(self, level: float) -> float:
        """The misfit up to which points agree at this level."""
        # At the true parameters the misfit is a sum of so many squared standard normal errors.
        return float(scipy.stats.chi2.ppf(level, len(self.targets)))

    @cached_property
    def cloud(self) -> tuple[Floats, Floats]:
        """Points (m, d) that fill the set that agrees, or the surroundings of the nearest point; and their misfits.

        Where none agrees these are without the surrogate's error.
        """
        cube = scipy.stats.qmc.Sobol(len(self.ranges), seed=SEED).random(CLOUD)
        low, high = np.zeros(len(self.ranges)), np.ones(len(self.ranges))
        for _ in range(ZOOMS):
            cloud = low + (high - low) * cube
            misfit = self.misfit(cloud)
            if misfit.min() > self.limit(LEVELS[-1]):
                misfit = self.misfit(cloud, unsure=False)
            inside = cloud[misfit <= self.acceptable_misfit(misfit)]
            if not 0 < len(inside) < ENOUGH:
                break
            room = 2.0 * (high - low) * CLOUD ** (-1.0 / len(self.ranges)) + 0.25 * np.ptp(inside, axis=0)
            low, high = np.maximum(inside.min(axis=0) - room, low), np.minimum(inside.max(axis=0) + room, high)
        return cloud, misfit

    def acceptable_misfit(self, misfit: Floats) -> float:
        """The misfit up to which points may agree, or are near the nearest."""
        return max(self.limit(LEVELS[-1]), float(misfit.min()) + self.limit(LEVELS[0]))

    @property
    def reached(self) -> bool:
        """True if any point agrees at 95 %."""
        return bool(self.cloud[1].min() <= self.limit(LEVELS[-1]))

    @cached_property
    def best(self) -> Floats:
        """The point (d,) of the least misfit, in the unit cube."""
        cloud, misfit = self.cloud
        start = cloud[misfit.argmin()]
        minimize: Any = scipy.optimize.minimize

        def misfit_at(x: Floats) -> float:
            return float(self.misfit(x[None], self.reached)[0])

        found = minimize(misfit_at, start, method="Nelder-Mead", bounds=[(0.0, 1.0)] * len(start))
        return np.asarray(found.x if found.fun < misfit.min() else start)

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
        own = misfit <= self.limit(LEVELS[-1])
        x = np.vstack([self.best, cloud[own]])
        misfit = np.array([self.misfit(self.best[None])[0], *misfit[own]])
        x, misfit = x[order := misfit.argsort()], misfit[order]
        labels = _separate((x - cloud.min(axis=0)) / np.ptp(cloud, axis=0))
        return tuple((x[labels == each], misfit[labels == each]) for each in dict.fromkeys(labels.tolist()))

    def intervals(self, axis: int, level: float) -> list[tuple[float, float] | None]:
        """The range of a parameter over the points of each separate set that agree; None if none do."""
        found: list[tuple[float, float] | None] = []
        for x, misfit in self.islands:
            inside = self.ranges[axis].at(x[misfit <= self.limit(level), axis])
            found.append((float(inside.min()), float(inside.max())) if len(inside) else None)
        return found

    def undetermined_parameters(self) -> list[str]:
        """Parameters whose whole range agrees at 95 %."""
        inside = self.agreeing(LEVELS[-1])
        spans = np.ptp(inside, axis=0) if len(inside) else np.zeros(len(self.ranges))
        return [each.name for each, span in zip(self.ranges, spans, strict=True) if span > WIDE_SHARE]

    def tied(self) -> Iterator[tuple[Range, Range, Floats]]:
        """Pairs of parameters that cannot be distinguished, and their values (2, 2) at both ends of the set at 95 %."""
        inside = self.islands[0][0] if self.islands else np.empty((0, len(self.ranges)))
        if len(inside) < FEW_POINTS:
            return
        for first, second in itertools.combinations(range(len(self.ranges)), 2):
            x, y = inside[:, first], inside[:, second]
            if min(np.ptp(x), np.ptp(y)) > LEAST_TIED and abs(float(scipy.stats.spearmanr(x, y).statistic)) > TIED:
                order = np.argsort(x)
                ends = [np.median(inside[part], axis=0) for part in (order[:FEW_POINTS], order[-FEW_POINTS:])]
                pair = (self.ranges[first], self.ranges[second])
                places = zip(pair, (first, second), strict=True)
                yield *pair, np.array([[each.at(end[place]) for end in ends] for each, place in places])

    def differs(self, other: "Fit") -> float:
        """Share of the set at 95 %, or of the surroundings of the nearest point, in which another fit differs."""
        cloud, misfit = self.cloud
        limit = self.acceptable_misfit(misfit)
        own, others = misfit <= limit, other.misfit(cloud, other.reached) <= limit
        return float((own ^ others).sum() / max((own | others).sum(), 1))


def _next_points(found: Fit, count: int) -> Floats:
    """Points to be computed next: spread over the set while the surrogate's error matters there; none when it does not."""
    cloud, misfit = found.cloud
    inside = cloud[misfit <= found.acceptable_misfit(misfit)]
    if not len(inside):  # no point has the numbers: look everywhere
        inside = cloud
    beyond = max(float(misfit.min()) / found.limit(LEVELS[-1]), 1.0) if np.isfinite(misfit.min()) else 1.0
    errors = found.predict(inside)[1] / (found.noise * beyond**0.5)
    if np.percentile(errors.max(axis=1), 95) <= PRECISE:
        return np.empty((0, len(found.ranges)))
    apart = np.asarray(scipy.spatial.KDTree(found.computed.x).query(inside)[0])
    chosen = []
    for _ in range(min(count, len(inside))):
        chosen.append(inside[apart.argmax()])
        apart = np.minimum(apart, np.linalg.norm(inside - chosen[-1], axis=1))
    return np.array(chosen)


def _separate(x: Floats) -> NDArray[np.int_]:
    """Number of the set of each point (m, d) in the unit cube. Empty boxes, wide enough for some points, separate sets."""
    boxes = max(int(min((CLOUD / FEW_POINTS) ** (1.0 / x.shape[1]), len(x) / FEW_POINTS)), 1)
    box = tuple(np.clip(boxes * x, 0, boxes - 1).astype(int).T)
    full = np.zeros((boxes,) * x.shape[1], dtype=np.bool_)
    full[box] = True
    return np.asarray(scipy.ndimage.label(full, np.ones((3,) * full.ndim))[0][box])


def sentences(found: Fit) -> Iterator[str]:
    """Report the points that agree, or the closest points; and the parameters that cannot be distinguished."""
    targets, ranges = found.targets, found.ranges
    means, errors = (each[0] for each in found.predict(found.best[None]))
    there = zip(targets, means.tolist(), errors.tolist(), strict=True)
    shown = ", ".join(f"{target.name} = {with_error(mean, error)}" for target, mean, error in there)
    asked = ", ".join(f"{target.name} = {target.value:g} ± {target.error:g}" for target in targets)
    place = ", ".join(f"{own.name} = {own.at(found.best)[axis]:.3g}" for axis, own in enumerate(ranges))
    ratio = ""
    if len(targets) == 2 and targets[1].value and means[1]:
        ratio = f"; ratio {means[0] / means[1]:.3g}, measured {targets[0].value / targets[1].value:.3g}"
    if not found.reached:
        yield f"Not reached: {asked}. Nearest: {shown}{ratio}, at {place}."
    else:
        yield f"Best: {shown}{ratio}, at {place}."
        if not len(found.agreeing(LEVELS[0])):
            yield "Nothing agrees at 68 %."
    if ends := [own.name for own, share in zip(ranges, found.best, strict=True) if abs(share - 0.5) > 0.5 - EDGE_SHARE]:
        yield f"At an end of its range: {', '.join(ends)}. A wider one may come nearer."
    if found.at_best and np.isfinite(found.at_best.values).all():
        there = zip(targets, found.at_best.values[0].tolist(), found.at_best.errors[0].tolist(), strict=True)
        yield f"Computed there: {', '.join(f'{target.name} = {with_error(*known)}' for target, *known in there)}."
    if len(found.islands) > 1:
        yield f"{len(found.islands)} separate sets agree at 95 %, the best one first."
    for name in found.undetermined_parameters():
        yield f"{name} is not determined by these numbers: its whole range agrees at 95 %."
    for first, second, ((a, b), (c, d)) in found.tied():
        yield (
            f"{first.name} and {second.name} cannot be told apart: a larger {first.name} with a "
            f"{'larger' if d > c else 'smaller'} {second.name} agrees at 95 %, from {first.name} = {a:.3g}, {second.name} = "
            f"{c:.3g} to {first.name} = {b:.3g}, {second.name} = {d:.3g}. It needs a measurement of one of them."
        )
    yield f"{len(found.computed.x)} points are computed."
    if missing := int((~np.isfinite(found.computed.values).all(axis=1)).sum()):
        yield f"Without a number: {missing} of them; around these nothing agrees."
        yield from found.why
    for flag in FLAGS:
        if flagged := int((found.computed.flags & flag.mask != 0).sum()):
            yield f"Used with the validity flag {flag.name}: {flagged} of them ({flag.meaning}). Advice: {flag.advice}."


EDGE_SHARE: Final = 0.02
"""Share of a range that counts as its end."""
SEED: Final = 1
FEW_POINTS: Final = 10
"""Points at each end of a set whose middle is that end."""


def search_parameters(
    targets: Sequence[Target],
    ranges: Sequence[Range],
    simulate: Simulate,
    known: ComputedPoint | None = None,
    most: int = MOST_COMPUTED,
    why: Callable[[Floats], Sequence[str]] = lambda _: (),
) -> Fit:
    """Find the parameters that agree with measured numbers. Raises TooFewError if too few points have them.

    simulate: called with points that fill the ranges, then with more in doubtful places, until little changes or `most` are done.
    known: points computed before. why: called with points without a number; returns causes and advice.
    """

    def fitted(computed: ComputedPoint) -> Fit:
        holes = computed.x[~np.isfinite(computed.values).all(axis=1)]
        reasons = tuple(why(holes)) if len(holes) else ()
        return Fit(tuple(targets), tuple(ranges), computed, _surrogates(targets, computed, reasons), reasons)

    before: Fit | None
    found: Fit | None = None
    if known is not None:
        with suppress(TooFewError):
            found = fitted(known)
    if found is None or found.reached or len(_next_points(found, 1)):
        x = filling(len(ranges))[:most]
        computed, found = known.with_these(simulate(x)) if known else simulate(x), None
        while True:
            before, found = found, fitted(computed)
            x = _next_points(found, min(6 * len(ranges), most - len(computed.x)))
            if not len(x) or (before and found.differs(before) <= SETTLED):
                break
            computed = computed.with_these(simulate(x))
    return replace(found, at_best=simulate(found.best[None]))


def filling(dimensions: int) -> Floats:
    """The points that are computed first."""
    sobol = scipy.stats.qmc.Sobol(dimensions, seed=SEED)
    return np.asarray(sobol.random_base2(math.ceil(math.log2(10 * dimensions))))


def _surrogates(targets: Sequence[Target], computed: ComputedPoint, why: Sequence[str]) -> tuple[Surrogate, ...]:
    found = []
    for target, values, errors, common in zip(
        targets, computed.values.T, computed.errors.T, computed.common.T, strict=True
    ):
        try:
            found.append(regress(computed.x, values, errors, common=common))
        except TooFewError as error:
            missing = int(np.isnan(values).sum())
            holes = [f"; {missing} of {len(values)} points are without"] if missing else []
            raise TooFewError("\n".join([f"{target.name}: {error}{''.join(holes)}", *why])) from None
    return tuple(found)
