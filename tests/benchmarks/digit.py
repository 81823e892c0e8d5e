"""Core seconds of one more digit of plateau, μ_s and μ_k, by more members or longer records: `python -m tests.benchmarks.digit`.

Three cases whose starts differ for different reasons, with the paper's drive: few nodes, unlike nodes, many nodes. Errors are
those of means over disjoint groups of members, each against all other members' longest records; seconds those of contact, record
and drive. It takes six minutes, and writes tests/benchmarks/digit.csv.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import Case, Heterogeneity
from nanoslip.solver.drive import Scales
from nanoslip.solver.dynamics.duration import measure_motion
from nanoslip.solver.elasticity.compliance import Compliance, surface_compliance
from nanoslip.solver.ensemble import FEWEST, Ensemble, mean_of
from nanoslip.solver.outcome import SolverError
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.slide import slide
from nanoslip.solver.view import with_error
from nanoslip.study.manifest.manifest import USUAL_MEMBERS, NamedDrive
from nanoslip.study.manifest.parameters import LIMITS
from tests.benchmarks.table import timed
from tests.written_tables import show

Vector = NDArray[np.float64]
WithError = tuple[float, float]
"""A number and its standard error."""

CASES: Final = {
    "few nodes": Case(intrinsic_friction=0.25, normal_load=2.5e-4, slab=Slab(33)),
    "unlike nodes": Case(slab=Slab(65), heterogeneity=Heterogeneity(spread=0.3)),
    "many nodes": Case(),
}
OBSERVABLES: Final = ("plateau", "μ_s", "μ_k")
LENGTH: Final = float(LIMITS["max_presliding"])
LENGTHS: Final = (3.0, 4.0, 6.0, LENGTH, 16.0, 32.0)
"""Of records, in presliding lengths."""
GROUPS_OF: Final = (3, 6, USUAL_MEMBERS, 16, 32, 64)
"""Members of the means whose errors are measured."""
STARTS, FEWER_STARTS = 512, 256
"""Members with records of the default and of the largest length, and of the others."""


class Sample(NamedTuple):
    """Members with records of one length: values (observables, n), NaN where one has none; core seconds (n,)."""

    values: Vector
    seconds: Vector

    @property
    def each(self) -> WithError:
        """Mean core seconds."""
        return float(self.seconds.mean()), float(self.seconds.std()) / math.sqrt(len(self.seconds))


class Errors(NamedTuple):
    """Squares of the relative errors of means over groups (groups,), NaN where one has no mean; the median ± stated."""

    squares: Vector
    stated: float

    @property
    def error(self) -> WithError:
        """Root mean square."""
        there = self.squares[np.isfinite(self.squares)]
        error = math.sqrt(there.mean()) if len(there) else math.nan
        return error, error / math.sqrt(2.0 * len(self.squares))


def samples_of(case: Case) -> dict[float, Sample]:
    """Length -> its members, the same starts for all; lengths are timed in turn, after a few that are not."""
    member = partial(_member, case, surface_compliance(case.slab))
    for number in range(FEWEST):
        member(LENGTH, number)
    found: dict[float, list[tuple[tuple[float, ...], float]]] = {length: [] for length in LENGTHS}
    for number in range(STARTS):
        for length in LENGTHS if number < FEWER_STARTS else (LENGTH, LENGTHS[-1]):
            found[length].append(timed(partial(member, length, number)))
    return {
        length: Sample(np.array([values for values, _ in each]).T, np.array([seconds for _, seconds in each]))
        for length, each in found.items()
    }


def _member(case: Case, compliance: Compliance, length: float, number: int) -> tuple[float, float, float]:
    """Plateau, μ_s and μ_k of one member; NaN where it has none."""
    long = replace(case, max_events=int(LIMITS["max_events"]), max_presliding=length)
    try:
        record = slide(Ensemble(USUAL_MEMBERS).case(long, number), compliance)
        plateau = plateau_of(record)
        _, friction = measure_motion(record, plateau, NamedDrive("paper").dimensionless(Scales()))
    except SolverError:
        return math.nan, math.nan, math.nan
    return plateau.mean, friction.static_friction, friction.kinetic_friction


def errors_of(values: Vector, longest: Vector, members: int) -> Errors:
    """Errors of the means over disjoint groups of so many of `values` (n,), each against the other members of `longest`
    (n or more,), over the mean of that. The share that is these members' own is taken out. NaN where members do not differ."""
    shape = (len(values) // members, members)
    own, found = longest[: shape[0] * members].reshape(shape), mean_of(values[: shape[0] * members].reshape(shape))
    mean, stated = float(mean_of(longest).mean), found.uncertainty[np.isfinite(found.uncertainty)]
    if not abs(mean) > 0.0 or not len(stated) or not np.nanstd(longest):
        return Errors(np.full(shape[0], math.nan), math.nan)
    others = np.isfinite(longest).sum() - np.isfinite(own).sum(axis=1)
    truth = (np.nansum(longest) - np.nansum(own, axis=1)) / others
    variance, theirs = float(np.nanvar(values)) / members, float(np.nanvar(longest)) / others
    squares = (found.mean - truth) ** 2 * variance / (variance + theirs)
    return Errors(squares / mean**2, float(np.median(stated)) / abs(mean))


def exponent(errors: Mapping[int, Errors]) -> WithError:
    """p of seconds ∝ members ∝ error^p: a line through the logarithms, by generalized least squares.

    The logarithm of a root mean square over g groups has a variance of 1/(2g), which it shares with those over fewer groups of
    the same members, and is 1/(2g) too small in the mean.
    """
    variance = np.array([0.5 / len(each.squares) for each in errors.values()])
    x, y = np.log(list(errors)), np.log([each.error[0] for each in errors.values()]) + variance
    line, weights = np.stack((np.ones_like(x), x)), np.linalg.inv(np.minimum.outer(variance, variance))
    covariance = np.linalg.inv(line @ weights @ line.T)
    slope = float((covariance @ line @ weights @ y)[1])
    return 1.0 / slope, math.sqrt(covariance[1, 1]) / slope**2


def time_for_the_same_error(one: Errors, other: Errors, seconds: WithError, usual: WithError) -> WithError:
    """Core seconds of an observable with other records, over those with the usual ones: the error falls as the root of the
    members, so that their ratio is that of error² × seconds. Its standard error: the jackknife's over groups, and the times'."""
    groups = slice(min(len(one.squares), len(other.squares)))  # of the same members
    squares = np.stack((one.squares[groups], other.squares[groups]))
    squares = squares[:, np.isfinite(squares).all(axis=0)]
    left_out = np.divide(*(squares.sum(axis=1, keepdims=True) - squares))
    ratio, error = float(np.divide(*squares.sum(axis=1))), math.sqrt((squares.shape[1] - 1.0) * float(np.var(left_out)))
    scale, times = seconds[0] / usual[0], math.hypot(seconds[1] / seconds[0], usual[1] / usual[0])
    return scale * ratio, scale * math.hypot(error, ratio * times)


def bias(values: Vector, longest: Vector) -> WithError:
    """Difference from the longest records of the same members, over their mean; and its uncertainty."""
    off = mean_of((values - longest[: len(values)]) / float(mean_of(longest).mean))
    return float(off.mean), float(off.uncertainty)


def rows_of(samples: Mapping[float, Sample]) -> Iterator[dict[str, str]]:
    """What a case's members show of each observable."""
    for place, name in enumerate(OBSERVABLES):
        values = {length: sample.values[place] for length, sample in samples.items()}
        longest = values[LENGTHS[-1]]
        by_members = {members: errors_of(values[LENGTH], longest, members) for members in GROUPS_OF}
        usual, mean = by_members[USUAL_MEMBERS], mean_of(longest)
        row = {"of": name, "mean": with_error(float(mean.mean), float(mean.uncertainty))}
        row |= {"seconds": f"{USUAL_MEMBERS * samples[LENGTH].each[0]:.3g}", "error": with_error(*usual.error)}
        row |= {"stated": f"{usual.stated:.3g}", "exponent": with_error(*exponent(by_members))}
        for length in (each for each in LENGTHS if each != LENGTH):
            errors = errors_of(values[length], longest, USUAL_MEMBERS)
            times = samples[length].each, samples[LENGTH].each
            row[f"time {length:g}"] = with_error(*time_for_the_same_error(errors, usual, *times))
        row["short bias"] = with_error(*bias(values[LENGTHS[0]], longest))
        yield row | {"default bias": with_error(*bias(values[LENGTH], longest))}


def main() -> None:
    """Measure all cases and write the table."""
    rows = [{"case": name, **row} for name, case in CASES.items() for row in rows_of(samples_of(case))]
    show([rows[0], *(row.values() for row in rows)], Path(__file__).with_suffix(".csv"))


if __name__ == "__main__":
    main()
