"""Choose members and record length of a case whose author gave neither, so that time is spent on the larger error.

A plateau has two errors: scatter between starts, and the node spacing. Members and long records reduce the scatter, which is ±;
only more nodes reduce the second. A probe with few nodes measures both. Length and members are then the smallest for which their
parts of ± are a tenth of the spacing's error; the saved time is left for more nodes.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from nanoslip.solver.ensemble import FEWEST, Ensemble, mean_of, student
from nanoslip.solver.parameter import SHARED_ERROR
from nanoslip.study.accuracy.effects import Done, compute_tasks, scalar_key, scene_tasks
from nanoslip.study.manifest.cases import expand
from nanoslip.study.manifest.manifest import USUAL_MEMBERS, Manifest
from nanoslip.study.manifest.parameters import LIMITS
from nanoslip.study.tasks.estimates import estimate

SHARE: Final = 0.1
"""A part of ± over the error by the node spacing: in quadrature it adds half a percent to that. Campaigns with a target stop
there, too."""
USUAL_LENGTH: Final = float(LIMITS["max_presliding"])
LENGTHS: Final = (USUAL_LENGTH / 2.0, USUAL_LENGTH)
"""Lengths of a record in presliding lengths. A plateau begins after 1.5 of them: half of the usual length has 2.5 on it."""
NUMBER: Final = "plateau_mean"
"""The number that is probed: others of friction follow it."""
ManifestOf = Callable[[int, float], Manifest]
"""n_x and the length of a record in presliding lengths -> the campaign of a case."""


@dataclass(frozen=True, slots=True)
class Sample:
    """The number on one grid, from FEWEST members."""

    n_x: int
    presliding: float
    mean: float
    scatter: float
    """Standard deviation of the members over the mean; NaN if one of them has no number."""
    shared: float
    """Error that all members share, over the mean."""
    excess: float
    """Core seconds beyond the estimated ones, over members and presliding lengths: the cost of events beside their
    nodes."""


@dataclass(frozen=True, slots=True)
class Spending:
    """Members and length of records for a grid."""

    members: int
    presliding: float
    error: float
    """Expected ± of the starts, relative."""
    change: float
    """Expected change of the number by half the node spacing, relative."""

    @property
    def share_of_usual(self) -> float:
        """Time of the records over that of the usual members and length."""
        return self.members * self.presliding / (USUAL_MEMBERS * USUAL_LENGTH)


def probe_lengths(manifest_of: ManifestOf, grids: Sequence[int]) -> Iterator[tuple[Sample, Sample]]:
    """Samples on a fine and a coarse grid, `grids`, with each length of record that has a plateau on both."""
    done: Done = {}
    # First once uncounted: it loads libraries, compiles kernels and computes compliances, which larger grids take no longer for.
    for n_x in grids:
        shortest = _tasks(manifest_of(n_x, LENGTHS[0]), Ensemble())
        compute_tasks(shortest, done)
    for presliding in LENGTHS:
        fine, coarse = (_sample(manifest_of(n_x, presliding), n_x, presliding, done) for n_x in grids)
        if math.isfinite(fine.scatter + coarse.scatter):
            yield fine, coarse


def spending(samples: Sequence[tuple[Sample, Sample]], n_x: int) -> Spending | None:
    """The cheapest members and length on a grid with which the parts of ± are SHARE of its spacing's error; None without samples.

    Members scatter less on finer grids, so that their scatter on the probe's is a bound. What all members share falls with the
    length alone, and what they scatter by with both: where that is too large, the usual length or the usual members remain.
    """
    choices = []
    for number, (fine, coarse) in enumerate(samples):
        error = _spacing_error(fine, coarse, n_x)
        is_longest = number == len(samples) - 1
        if fine.shared > SHARE * error and not is_longest:
            continue
        for members in range(FEWEST, USUAL_MEMBERS + 1):
            starts = float(student(members)) * fine.scatter / math.sqrt(members)
            is_usual = is_longest and members == USUAL_MEMBERS
            if starts <= SHARE * error or is_usual:
                uncertainty = math.hypot(starts, fine.shared)
                choices.append(Spending(members, fine.presliding, uncertainty, error / 2.0))
    return min(choices, key=lambda choice: choice.share_of_usual, default=None)


def _spacing_error(fine: Sample, coarse: Sample, n_x: int) -> float:
    """Relative error of the number by the node spacing h of a grid: to first order b·h, twice what half the spacing changes.

    Both grids of the samples differ by b (h_coarse - h_fine), from which b follows.
    """
    # Change of the spacing over the finer spacing.
    between = (fine.n_x - 1) / (coarse.n_x - 1) - 1.0
    relative = abs(coarse.mean / fine.mean - 1.0)
    return relative / between * (fine.n_x - 1) / (n_x - 1)


def _sample(manifest: Manifest, n_x: int, presliding: float, done: Done) -> Sample:
    tasks = _tasks(manifest, Ensemble(FEWEST, places=manifest.ensemble.places))
    compute_tasks(tasks, done)
    result, _ = done[tasks[-1][1].key]
    measured = sum(done[task.key][1] for _, task in tasks)
    expected = sum(estimate(task)[0] for _, task in tasks)
    excess = (measured - expected) / (FEWEST * presliding)
    key = scalar_key(NUMBER, result)
    no_values = [math.nan] * FEWEST
    values = np.array(result.scalars.get(key, no_values), float)
    shared = float(result.scalars.get(f"{key}{SHARED_ERROR}", [0.0])[0])
    mean = float(mean_of(values).mean)
    scatter = float(values.std(ddof=1)) / abs(mean)
    return Sample(n_x, presliding, mean, scatter, shared / abs(mean), excess)


def _tasks(manifest: Manifest, ensemble: Ensemble) -> list[tuple[str, Any]]:
    case = expand(manifest)[0].case
    return scene_tasks(manifest, case, {}, ensemble, (NUMBER,)) if case else []
