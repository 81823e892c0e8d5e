"""Ensembles: a case computed from several independent starts, with mean and ± (68 % interval of Student's t over the members).

Members differ in the start between two surface nodes, the nodes' random μ_i and the position on a rough profile. Each
member follows from the case and the member's number only: the first 8 of 16 members equal the members of an ensemble
of 8.
"""

import math
import struct
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Final, Literal, NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.case import LEAST_APART, PIN_SIZES, Case, Image, make_image
from nanoslip.solver.parameter import Roughness, quantity

Places = Literal["drawn", "given"]
LEVEL: Final = math.erf(math.sqrt(0.5))
"""Probability that a normal variable lies within a standard error of its mean: 68.27 %."""
FEWEST: Final = 3
"""Fewest members, or parts of a stretch, for a mean, if there are enough: two may agree by chance."""
SEEDS: Final = 2**32
"""Difference between the seeds of successive members; large, so that seeds of an axis do not coincide with them."""


@dataclass(frozen=True, slots=True)
class Ensemble:
    """Number of starts of a case that are computed: `members`, or as many up to `members` as `within` needs.

    within: largest relative error (2 ±) of the means of the variables in `of`; members double from FEWEST until it is reached.
    places: positions on a rough profile, `drawn` at random (measured surfaces) or `given`, all the same (designed ones).
    """

    members: int = 1
    within: float | None = None
    of: tuple[str, ...] = ()
    places: Places = "drawn"

    def case(self, case: Case, number: int) -> Case:
        """The case of a member, by its number from 0."""
        if self.members == 1:
            return case
        drawn = draw_start(case, number, *_start_numbers(case))
        return self.move_case(case, drawn._replace(seed=case.heterogeneity.seed + number * SEEDS))

    def move_case(self, case: Case, chance: "Chance") -> Case:
        """The case moved by a number of spacings, at another place on its profile, with nodes of another seed."""
        drawn = case.heterogeneity
        if drawn.spread:
            drawn = replace(drawn, seed=chance.seed)
        if drawn.roughness and self.places == "drawn":
            drawn = replace(drawn, roughness=elsewhere(drawn.roughness, chance.place, chance.place_y))
        start_y = case.slab.layout.repeat_across(case.start_y + chance.start_y)
        start = (case.start + chance.start) % 1.0
        return replace(case, start=start, start_y=start_y, heterogeneity=drawn)

    def sizes(self) -> Iterator[int]:
        """Numbers of members at which the target is tested; the last is the largest."""
        size = self.likely
        while size < self.members:
            yield size
            size *= 2
        yield self.members

    def meets_target(self, values: Sequence[float], shared: float = 0.0) -> bool:
        """True if the mean over these members meets the target. shared: see `mean_of`."""
        if self.within is None:
            return False
        mean = mean_of(np.array(values, float), shared)
        return bool(2.0 * mean.uncertainty <= self.within * abs(mean.mean))

    @property
    def likely(self) -> int:
        """Number of members planned before the run: the smallest possible one with a target."""
        return self.members if self.within is None else min(FEWEST, self.members)

    def select_observables(self, names: Collection[str]) -> "Ensemble":
        """The ensemble with only these variables in its target; the fewest members if there are none."""
        of = tuple(name for name in self.of if name in names)
        if of or self.within is None:
            return replace(self, of=of)
        return Ensemble(min(FEWEST, self.members), places=self.places)


def _start_numbers(case: Case) -> tuple[float, ...]:
    """The start of a case as further numbers of a draw, so that members of cases with other starts are independent of each other:
    the same ones, moved together, would be no fair sample of all starts. None of the usual start at a node, which tells no
    cases apart."""
    return (case.start, case.start_y) if case.start or case.start_y else ()


class Chance(NamedTuple):
    """Random numbers of a start: position between two nodes (spacings, along and across) and on the profile or image (along and
    across), in [0, 1); a seed below 2^63."""

    start: float
    place: float
    seed: int
    start_y: float
    place_y: float


def draw_start(case: Case, number: int, *further: float) -> Chance:
    """Place where a member comes down, in spacings from its case's start.

    Drawn by load, size of the pin and nodes, on which every result depends, and by further numbers: independent from one contact
    to another.
    """
    numbers = (case.normal_load, getattr(case, PIN_SIZES[case.pin]), *further)
    # The bits of the numbers, so that cases which differ at all draw other starts.
    words = [number, case.slab.n_x, *struct.unpack(f"<{2 * len(numbers)}I", struct.pack(f"<{len(numbers)}d", *numbers))]
    drawn = np.random.PCG64(np.array(words, np.uint32)).random_raw(5).tolist()
    # The upper 53 bits of a random word are as many as a float in [0, 1) holds.
    start, place, _, start_y, place_y = ((raw >> 11) * 2.0**-53 for raw in drawn)
    return Chance(start, place, drawn[2] >> 1, start_y, place_y)


@lru_cache(maxsize=16)
def elsewhere(profile: Roughness, place: float, place_y: float = 0.0) -> Roughness:
    """A profile or image continued by its mirror image, again and again, at places in [0, 1) of its periods; of the same size."""
    image = make_image(profile)
    xi, heights = _shift_profile(image.xi, image.height, place)
    if len(image.y) == 1:
        return Image(xi, image.y, heights).points
    y, across = _shift_profile(image.y, heights.T, place_y)
    return Image(xi, y, across.T).points


def _shift_profile(xi: Floats, rows: Floats, place: float) -> tuple[Floats, ...]:
    """Knots ξ and heights (rows, knots) of profiles continued periodically by their mirror images, shifted by a share
    `place` of the period."""
    # Continued by its mirror image a profile has twice its length as period, and no jump where it begins
    # anew.
    first, period = xi[0], 2.0 * np.ptp(xi)
    places = np.concatenate((xi, 2.0 * xi[-1] - xi[-2:0:-1]))
    moved = first + (places - first - place * period) % period
    inside = np.sort(moved[(moved - first >= LEAST_APART) & (xi[-1] - moved >= LEAST_APART)])
    are_apart = np.diff(inside, prepend=-math.inf) >= LEAST_APART
    knots = np.concatenate((xi[:1], inside[are_apart], xi[-1:]))
    # To and fro over the heights: where one period ends, the next begins.
    back = (heights[-2:0:-1] for heights in rows)
    mirrored = map(np.append, rows, back)
    rises = [np.interp(knots + place * period, places, heights, period=period) for heights in mirrored]
    return knots, np.array(rises)


ALONE: Final = Ensemble()
"""One start: the case as it stands."""


def fewest_members(members: int) -> float:
    """Smallest number of members with a value for a mean to be reported: half, and at least FEWEST (or all, if fewer)."""
    return max(min(FEWEST, members), members / 2.0)


def omission_error(without: Sequence[float], with_all: Sequence[float]) -> float:
    """Relative error of a mean by omitted effects: |change| plus twice its ±, over the mean with all effects.

    Both are computed from the same members, so scatter cancels. Infinite if unknown.
    """
    change = mean_of(np.subtract(without, with_all))
    mean = mean_of(np.array(with_all, float))
    if not mean.mean:
        return math.inf
    error = float((abs(change.mean) + 2.0 * change.uncertainty) / abs(mean.mean))
    return error if math.isfinite(error) else math.inf


class Mean(NamedTuple):
    """Means over members (...), their ±, and how many members have a value; NaN where that are too few."""

    mean: Floats
    uncertainty: Floats
    members: NDArray[np.int64]


def mean_of(values: ArrayLike, shared: Floats | float = 0.0) -> Mean:
    """The mean over members, the last axis of `values` (..., m), with its ±; NaN marks a member without a value.

    ± is Student's t at 68.27 % times the standard deviation over √m: the rule of every dataset. No mean unless half
    of the members, and at least FEWEST of as many, have a value. No ± unless all members have a value: the others
    would be a biased sample.
    shared: error that all members share, a part of ± (...).
    """
    values = np.asarray(values, float)
    is_finite = np.isfinite(values)
    having, most = is_finite.sum(axis=-1), values.shape[-1]
    enough = having >= fewest_members(most)
    # 1 where no mean is stated: nothing is divided by 0.
    count = np.where(enough, having, 1)
    # Sums and squares of numbers near the largest float are infinite.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        mean = np.where(is_finite, values, 0.0).sum(axis=-1) / count
        off = values - mean[..., None]
        squared_error = (off * off).sum(axis=-1) / (most - 1.0) / most
        error = student(most) * np.sqrt(squared_error)
    # Scatter and shared error are independent: their squares add up.
    return Mean(np.where(enough, mean, np.nan), np.hypot(error, shared), having)


def jackknife(without: Sequence[float]) -> float:
    """Jackknife ± of a statistic of all members, from the statistic without each member in turn (Efron, SIAM CBMS 38,
    1982).

    Equals the ± of `mean_of` for a mean. NaN for a single member, or if the statistic is undefined without a member.
    """
    # Efron's variance is (m - 1)/m Σ(θ_i - mean)²: m - 1 times the mean square that np.var returns.
    count = len(without)
    if count <= 1:
        return math.nan
    variance = (count - 1) * float(np.var(without))
    return float(student(count) * math.sqrt(variance))


def student(members: Any) -> Any:
    """Half-width of the interval of probability LEVEL, in standard errors of the mean over this number of members."""
    # LEVEL lies between -t and t, so 1/2 + LEVEL/2 lies below t. Two members leave one degree of freedom.
    return scipy.special.stdtrit(np.maximum(np.asarray(members, float) - 1.0, 1.0), 0.5 + 0.5 * LEVEL)


# Numbers of a result that tell what its target has allowed, and what counts in it beside the starts.

SPARED_NAMES: Final = ("teeth", "fine_teeth")
"""Effects of a drive whose absence makes it far cheaper: a target leaves out the first whose change it allows."""


@dataclass(frozen=True, slots=True)
class LeftOut:
    """Effects left out for most members of a drive, as requested numbers do not depend on them, and the possible change."""

    left_out: str = quantity(
        "effect left out",
        comment="of all members except the first two, which are computed with and without it; nothing: none may be left out",
        words=("nothing", *SPARED_NAMES),
    )
    left_out_error: float = quantity(
        "relative error by effects left out",
        comment="|change| plus twice its ±, largest of all requested numbers, over two members",
    )


@dataclass(frozen=True, slots=True)
class SpacingChange:
    """Influence of the node spacing on the numbers of a target: it counts in the target as the error of starts does."""

    spacing_change: float = quantity(
        "change by twice the node spacing",
        comment="relative; largest of all requested numbers, of means over the first members; NaN if the scheme, too few nodes "
        "in contact, an interface or a drive over the contact exclude twice the spacing",
    )
