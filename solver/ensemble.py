"""Ensembles: a case computed from several independent starts, and what these tell of the mean over all starts.

What a pin meets depends on where between two surface nodes it comes down, and on the draw of the nodes' μ_i. Both are chance, so
one record is one draw. The members of an ensemble differ in both, and derive from the case and their number alone: members 0 to 7
of 16 are those of 8. Their mean's uncertainty, written ±, is the half-width of the 68 % interval of Student's t over the members.
"""

import math
import struct
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from solver.case import Case

LEVEL: Final = math.erf(math.sqrt(0.5))
"""Probability of an interval of one standard error of a normal distribution: 68.27 %."""
FEWEST: Final = 3
"""Members that a mean needs, where there are as many: two may agree by chance."""
SEEDS: Final = 2**32
"""Difference between the seeds of successive members; large, so that seeds of an axis do not coincide with them."""


@dataclass(frozen=True, slots=True)
class Ensemble:
    """How many starts of a case are computed.

    members: their number; 1 is the case as it stands. uncertainty: relative, of the mean of each variable in `of`: `members` are
    then the most, from FEWEST on by doubling, until all these means are known so well.
    """

    members: int = 1
    uncertainty: float | None = None
    of: tuple[str, ...] = ()

    def case(self, case: Case, number: int) -> Case:
        """The case of a member, by its number from 0."""
        if self.members == 1:
            return case
        drawn = case.heterogeneity
        if drawn.spread:
            drawn = replace(drawn, seed=drawn.seed + number * SEEDS)
        return replace(case, start=(case.start + start_of(case, number)) % 1.0, heterogeneity=drawn)

    def sizes(self) -> Iterator[int]:
        """Numbers of members after which it is asked whether they are enough; the last one is the most."""
        size = self.likely
        while size < self.members:
            yield size
            size *= 2
        yield self.members

    def known(self, values: Sequence[float]) -> bool:
        """Whether the mean over these members is known as well as it is to be."""
        if self.uncertainty is None:
            return False
        mean = mean_of(np.array(values, float))
        return bool(mean.uncertainty <= self.uncertainty * abs(mean.mean))

    @property
    def likely(self) -> int:
        """Members that are computed, as far as that is known before: the fewest where a target decides."""
        return self.members if self.uncertainty is None else min(FEWEST, self.members)

    def asked_of(self, names: Collection[str]) -> "Ensemble":
        """The ensemble with those variables of its target that have these names; the fewest members if there are none."""
        of = tuple(name for name in self.of if name in names)
        return replace(self, of=of) if of or self.uncertainty is None else Ensemble(min(FEWEST, self.members))


def start_of(case: Case, number: int) -> float:
    """Where between two nodes a member comes down, in node spacings from its case's start: uniform in [0, 1).

    Drawn by load, size of the pin and nodes, on which every result depends: independent from one contact to another.
    """
    size = case.radius if case.pin == "parabola" else case.half_width
    words = np.array(
        [number, case.slab.n_x, *struct.unpack("<4I", struct.pack("<2d", case.normal_load, size))], np.uint32
    )
    return float(np.random.PCG64(words).random_raw() >> 11) * 2.0**-53


ALONE: Final = Ensemble()
"""One start: the case as it stands."""


class Mean(NamedTuple):
    """Means over members (...), their ±, and how many members have a value; NaN where that are too few."""

    mean: NDArray[np.float64]
    uncertainty: NDArray[np.float64]
    members: NDArray[np.int64]


def mean_of(values: NDArray[np.float64]) -> Mean:
    """The mean over members, the last axis of `values` (..., m); NaN: a member without a value.

    No mean of fewer than half of the members, or of fewer than FEWEST of as many. No ± of one alone.
    """
    there = np.isfinite(values)
    having, most = there.sum(axis=-1), values.shape[-1]
    enough = having >= max(min(FEWEST, most), most / 2.0)
    count = np.where(enough, having, 1)
    mean = np.where(there, values, 0.0).sum(axis=-1) / count
    off = np.where(there, values - mean[..., None], 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        error = student(count) * np.sqrt((off * off).sum(axis=-1) / (count - 1.0) / count)
    return Mean(np.where(enough, mean, np.nan), np.where(enough & (count > 1), error, np.nan), having)


def student(members: Any) -> Any:
    """Half-width of the interval of probability LEVEL, in standard errors of the mean over so many members."""
    return scipy.special.stdtrit(np.maximum(np.asarray(members, float) - 1.0, 1.0), 0.5 + 0.5 * LEVEL)
