"""What a digit costs: error of plateau, μ_s and μ_k against core seconds, over members and record lengths.

Errors are measured: means over disjoint groups of members, each against all other members' longest records. Seconds are those of
contact, record and drive; the slab's compliance is computed once and not among them.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.dynamics.integrators import measured
from nanoslip.solver.elasticity.compliance import Compliance, surface_compliance
from nanoslip.solver.ensemble import FEWEST, Ensemble, mean_of
from nanoslip.solver.outcome import SolverError
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.slide import slide
from nanoslip.study.accuracy.setup import Diagram, Effort, Row, Setup, timed
from nanoslip.study.manifest.checker import ManifestError
from nanoslip.study.manifest.manifest import MEMBERS
from nanoslip.study.manifest.parameters import LIMITS, Value

Vector = NDArray[np.float64]
WithError = tuple[float, float]
"""A number and its standard error."""

OBSERVABLES: Final = {"plateau": "plateau", "static": "μ_s", "kinetic": "μ_k"}
LENGTH: Final = float(LIMITS["max_presliding"])
BY_MEMBERS, BY_LENGTH = "more members", "longer records"
DIGIT: Final = 100.0
"""Times the members: a tenth of the error."""
SURE: Final = 2.0
"""Standard errors beyond which a length is called cheaper."""


@dataclass(frozen=True, slots=True)
class Sample:
    """Members of one case at one record length: values (observables, n), NaN where one has none; core seconds (n,)."""

    values: Vector
    seconds: Vector


@dataclass(frozen=True, slots=True)
class Errors:
    """Squares of the errors of means over groups (groups,), and the median of the uncertainties stated."""

    squares: Vector
    stated: float

    @property
    def error(self) -> float:
        """Root mean square over the groups that have a mean."""
        there = self.squares[np.isfinite(self.squares)]
        return math.sqrt(there.mean()) if len(there) else math.nan


@dataclass(frozen=True, slots=True)
class Point:
    """One number of members with records of one length; core seconds of them all, and their standard error."""

    way: str
    members: int
    length: float
    seconds: float
    seconds_error: float
    found: tuple[Errors, ...]
    """Of each observable, relative."""

    @property
    def groups(self) -> int:
        """Number of groups."""
        return len(self.found[0].squares)


def measure_digit(setups: Sequence[Setup], effort: Effort) -> tuple[Diagram, Diagram]:
    """What each case says of each observable, and the errors and times that it is read off. Raises ManifestError."""
    verdicts: list[Row] = []
    rows: list[Row] = []
    for setup in setups:
        samples = _samples(setup, effort)
        points = list(points_of(samples, effort))
        verdicts += [{"case": setup.title, **row} for row in _verdicts(samples, points)]
        rows += [{"case": setup.title, **_row(point)} for point in points]
    return _verdict_sheet(tuple(verdicts), effort), _sheet(tuple(rows), effort)


def _samples(setup: Setup, effort: Effort) -> dict[float, Sample]:
    """Record length -> the first members, with the same starts for all lengths: timed in turn, after a few that are not."""
    member = partial(_member, setup, surface_compliance(setup.case.slab))
    if not any(math.isfinite(member(LENGTH, number)[0]) for number in range(FEWEST)):
        message = f"no plateau in {FEWEST} records of {LENGTH:g} presliding lengths, so that nothing can be measured"
        raise ManifestError([f"{setup.title}: {message}"])
    found: dict[float, list[tuple[tuple[float, ...], float]]] = {length: [] for length in effort.lengths}
    for number in range(effort.most_starts):
        for length in effort.lengths if number < effort.fewer_starts else (LENGTH, effort.lengths[-1]):
            found[length].append(timed(partial(member, length, number)))
    return {
        length: Sample(np.array([values for values, _ in each]).T, np.array([seconds for _, seconds in each]))
        for length, each in found.items()
    }


def _member(setup: Setup, compliance: Compliance, length: float, number: int) -> tuple[float, float, float]:
    """Plateau, μ_s and μ_k of one member; NaN where it has none."""
    case = replace(setup.case, max_events=int(LIMITS["max_events"]), max_displacement=None, max_spacings=None)
    try:
        record = slide(Ensemble(MEMBERS).case(replace(case, max_presliding=length), number), compliance)
        plateau = plateau_of(record)
        _, friction = measured(record, plateau, setup.drive.dimensionless(setup.scales))
    except SolverError:
        return math.nan, math.nan, math.nan
    return plateau.mean, friction.static_friction, friction.kinetic_friction


def points_of(samples: Mapping[float, Sample], effort: Effort) -> Iterator[Point]:
    """Each number of members at the default length, then each length at the default number of members."""
    truth = samples[effort.lengths[-1]].values
    ways = [(BY_MEMBERS, members, LENGTH, effort.most_starts) for members in effort.members]
    ways += [(BY_LENGTH, MEMBERS, length, effort.fewer_starts) for length in effort.lengths]
    for way, members, length, starts in ways:
        of = samples[length].values[:, :starts]
        found = tuple(errors_of(own, longest, members) for own, longest in zip(of, truth, strict=True))
        each = members * samples[length].seconds[:starts]
        yield Point(way, members, length, float(each.mean()), float(each.std(ddof=1)) / math.sqrt(len(each)), found)


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


def exponent(seconds: Vector, errors: Vector, groups: Vector) -> WithError:
    """p of seconds ∝ error^p: a line through the logarithms, by generalized least squares.

    The logarithm of a root mean square over g groups has a variance of 1/(2g), which it shares with those over fewer groups of
    the same members, and is 1/(2g) too small in the mean.
    """
    there = np.isfinite(errors)
    if there.sum() < FEWEST:
        return math.nan, math.nan
    variance = 0.5 / groups[there]
    x, y = np.log(seconds[there]), np.log(errors[there]) + variance
    line, weights = np.stack((np.ones_like(x), x)), np.linalg.inv(np.minimum.outer(variance, variance))
    covariance = np.linalg.inv(line @ weights @ line.T)
    slope = float((covariance @ line @ weights @ y)[1])
    return 1.0 / slope, math.sqrt(covariance[1, 1]) / slope**2


def time_for_the_same_error(point: Point, usual: Point, place: int) -> WithError:
    """Core seconds of an observable with these records, over those with the usual ones: the error falls as the root of the
    members, so that their ratio is that of error² × seconds. Its standard error: the jackknife's over groups, and the times'."""
    one, other = point.found[place].squares, usual.found[place].squares
    there = np.isfinite(one) & np.isfinite(other)
    one, other, count = one[there], other[there], there.sum()
    if count < FEWEST or min(one.sum(), other.sum()) <= 0.0:
        return math.nan, math.nan
    left_out = (one.sum() - one) / (other.sum() - other)
    ratio, error = float(one.sum() / other.sum()), math.sqrt((count - 1.0) * float(np.var(left_out)))
    scale, times = point.seconds / usual.seconds, (each.seconds_error / each.seconds for each in (point, usual))
    return scale * ratio, scale * math.hypot(error, ratio * math.hypot(*times))


def _verdicts(samples: Mapping[float, Sample], points: Sequence[Point]) -> Iterator[dict[str, Value]]:
    """What a case says of each observable."""
    by_members, by_length = ([point for point in points if point.way == way] for way in (BY_MEMBERS, BY_LENGTH))
    usual = next(point for point in by_members if point.members == MEMBERS)
    normal = next(point for point in by_length if point.length == LENGTH)
    seconds, groups = (np.array([getattr(each, name) for each in by_members], float) for name in ("seconds", "groups"))
    longest = samples[max(samples)].values
    for place, (name, values) in enumerate(zip(OBSERVABLES.values(), longest, strict=True)):
        mean = mean_of(values)
        row: dict[str, Value] = {"of": name, **_pair("mean", (float(mean.mean), float(mean.uncertainty)))}
        row |= {"seconds": usual.seconds, **_pair("error", _error(usual, place)), "stated": usual.found[place].stated}
        errors = np.array([point.found[place].error for point in by_members])
        row |= _pair("exponent", exponent(seconds, errors, groups))
        times = {point.length: time_for_the_same_error(point, normal, place) for point in by_length}
        biases = {length: bias(each.values[place], values) for length, each in samples.items()}
        for length, time in times.items():
            row |= _pair(f"time_{length:g}", time) if length != LENGTH else {}
        row |= {**_pair("short_bias", biases[min(samples)]), **_pair("default_bias", biases[LENGTH])}
        best = cheapest(times, biases, usual.found[place].error / math.sqrt(DIGIT))
        row["tenth"] = DIGIT * usual.seconds * (1.0 if best == LENGTH else times[best][0])
        yield row | {"cheapest": "members" if best == LENGTH else f"length {best:g}"}


def bias(values: Vector, longest: Vector) -> WithError:
    """Difference from the longest records of the same members, over their mean; and its uncertainty."""
    mean = float(mean_of(longest).mean)
    off = mean_of((values - longest[: len(values)]) / (mean or math.nan))
    return float(off.mean), float(off.uncertainty)


def cheapest(times: Mapping[float, WithError], biases: Mapping[float, WithError], error: float) -> float:
    """The length with the least seconds for the same error, of those that take less than the default beyond chance and whose
    bias is smaller than this error beyond its uncertainty; else the default: members take no bias away."""
    less = {length: time for length, (time, spread) in times.items() if time + SURE * spread < 1.0}
    sound = [length for length in less if abs(biases[length][0]) + biases[length][1] < error]
    return min(sound, key=less.__getitem__, default=LENGTH)


def _row(point: Point) -> dict[str, Value]:
    row: dict[str, Value] = {"way": point.way, "members": point.members, "length": point.length}
    row |= {"groups": point.groups, "seconds": point.seconds}
    for place, name in enumerate(OBSERVABLES):
        row |= {**_pair(name, _error(point, place)), f"{name}_stated": point.found[place].stated}
    return row


def _error(point: Point, place: int) -> WithError:
    error = point.found[place].error
    return error, error / math.sqrt(2.0 * point.groups)


def _pair(name: str, value: WithError) -> dict[str, Value]:
    return {name: value[0], f"{name}_uncertainty": value[1]}


def _verdict_sheet(rows: tuple[Row, ...], effort: Effort) -> Diagram:
    times = {f"time_{length:g}": f"{length:g}" for length in effort.lengths if length != LENGTH}
    words = {
        "case": "what is computed",
        "of": "observable",
        "seconds": f"core seconds of {MEMBERS} members with records of {LENGTH:g} presliding lengths, the default",
        "error": "their relative error, root mean square",
        "tenth": "core seconds for a tenth of this error, in the cheapest way",
        "stated": "median of the ± stated, relative",
        "exponent": "p of seconds ∝ error^p for more members",
        **{
            name: f"core seconds for the same error with records of {word}, over those of {LENGTH:g}"
            for name, word in times.items()
        },
        "short_bias": f"relative difference of records of {effort.lengths[0]:g} from the longest ones of the same starts",
        "default_bias": f"the same of records of {LENGTH:g}",
        "mean": "over the members that errors are measured against",
        "cheapest": f"more members, or first the length that takes least: {SURE:g} standard errors less than the default, "
        "and with a bias below a tenth of the error",
    }
    return _diagram("verdict", "One more digit", words, rows, effort)


def _sheet(rows: tuple[Row, ...], effort: Effort) -> Diagram:
    words = {
        "case": "what is computed",
        "way": "what is varied",
        "members": "members of a mean",
        "length": "length of their records in presliding lengths",
        "groups": "disjoint groups of so many members that errors are measured with",
        "seconds": "core seconds of the members: contact, record and drive",
    }
    for name, meaning in OBSERVABLES.items():
        words |= {
            name: f"relative error of {meaning}, root mean square",
            f"{name}_stated": f"median ± of {meaning}, relative",
        }
    return _diagram("digit", "Errors and times", words, rows, effort)


def _diagram(name: str, title: str, words: Mapping[str, str], rows: tuple[Row, ...], effort: Effort) -> Diagram:
    """A table without a front; its standard errors have the meanings of their values."""
    meanings = {
        each: words.get(each, f"standard error: {words.get(each.removesuffix('_uncertainty'))}") for each in rows[0]
    }
    against = f"means over all other of {effort.most_starts} members, with records of {effort.lengths[-1]:g} presliding lengths"
    return Diagram(name, title, against, "case", tuple(words), error="", rivals=False, words=meanings, rows=rows)
