"""Static and kinetic friction of a drive (§3.3): μ_s from its first slip, μ_k where it slides steadily."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from nanoslip.solver.arrays import Floats
from nanoslip.solver.dynamics.result import DynamicsResult, raising
from nanoslip.solver.outcome import COMPLETED, Ending, Outcome
from nanoslip.solver.parameter import quantity
from nanoslip.solver.sliding.plateau import Plateau
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.view import Labels, describe_outcome

FEWEST_PERIODS: Final = 2.0
"""Oscillation periods that a pin has to slide before its mean friction is that of steady sliding."""
BLOCKS: Final = 32
"""Number of equal parts of the steady friction force. Their mean is its mean; groups of four show whether it changes."""
LEAST_SHARE: Final = 0.25
"""Share of the binned force that truncation always keeps."""
LARGEST_CHANGE: Final = 0.01
"""Change along the steady part, as a fraction of its mean, that still counts as steady."""
SIGNIFICANT_CHANGE: Final = 5.0
"""Standard errors beyond which a change is no accident (one motion in four hundred with eight blocks)."""


INERTIAL: Final = 0.1
"""Share of the contact's peak above which the part of inertia and damper is no friction, and is reported beside
μ_s."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FrictionCoefficients(Labels):
    """Macroscopic friction of a drive, as forces over W; NaN if it could not be measured (see `outcome`).

    static_friction: μ_s, largest driving force of the first macroscopic slip; NaN above twice the record's largest
        force.
    kinetic_friction: μ_k, mean driving force while the pin slides steadily, less the pin's change of momentum.
    """

    every_static_friction: Floats
    outcome: Outcome
    static_friction: float = quantity(
        "static friction coefficient", symbol="μ_s", comment="from the first macroscopic slip", ensemble=True
    )
    static_friction_excess: float = quantity(
        "μ_s beyond the record",
        comment="by inertia and damper: excess over all forces of the record, as F/W, also if there is no μ_s; "
        "the same for all starts",
    )
    kinetic_friction: float = quantity(
        "kinetic friction coefficient", symbol="μ_k", comment="from steady sliding", ensemble=True, shared="plateau"
    )

    def _facts(self) -> Iterator[str]:
        yield f"μ_s {self.static_friction:.4g}"
        yield f"μ_k {self.kinetic_friction:.4g}"
        yield describe_outcome(self.outcome)


def friction_coefficients(
    result: DynamicsResult, record: FrictionRecord, plateau: Plateau, ended_by: str = "duration"
) -> FrictionCoefficients:
    """μ_s and μ_k of a drive over `record`. The outcome is the drive's, or `NO_SLIP`, or `NO_PLATEAU` of its force.

    ended_by: the parameter of the drive that ended it.
    """
    nan = math.nan
    if not len(result.slip_force):
        failed = result.outcome if not result.outcome.ok else _no_slip(result, plateau, record.normal_load)
        return FrictionCoefficients(result.slip_force, failed, nan, nan, nan)
    static = result.slip_force / record.normal_load
    first, excess = _first_slip(record, static)
    kinetic, outcome = nan, result.outcome
    slides = float(result.time[-1] - result.slip_time[0])
    if outcome.ok and slides < FEWEST_PERIODS * result.settling_time:
        periods = math.floor(100.0 * slides / result.settling_time) / 100.0  # never rounded up to those that are needed
        message = f"the pin slid for {periods:g} oscillation periods; averaging μ_k needs {FEWEST_PERIODS:g}{raising(ended_by)}"
        message = f"the friction force is not steady: {message}"
        outcome = Outcome(Ending.NO_PLATEAU, message, ended_by == "duration", "few_periods")
    if outcome.ok:
        blocks, complaint = steady_blocks(result.binned_force / record.normal_load)
        kinetic = nan if complaint else float(blocks.mean())
        if complaint:
            message = f"the friction force {complaint}{raising(ended_by)}"
            outcome = Outcome(Ending.NO_PLATEAU, message, ended_by == "duration", "unsteady_force")
    return FrictionCoefficients(
        static_friction=first,
        static_friction_excess=_start_excess(record, float(static[0])),
        every_static_friction=static,
        kinetic_friction=kinetic,
        outcome=outcome.adding(excess),
    )


def _no_slip(result: DynamicsResult, plateau: Plateau, normal_load: float) -> Outcome:
    """Reason why a pin never slipped macroscopically: nothing pulls, nothing pulls hard enough, or its slips are too short."""
    spring = result.spring_force / normal_load
    highest = float(result.binned_force.max())
    reached = max(highest / normal_load, float(spring[-1]))
    if result.stick_velocity == 0.0:
        return Outcome(Ending.NO_SLIP, "the stage is at rest: raise stage_velocity")
    if reached < plateau.peak and spring[-1] == spring.max():  # that of a stuck pin only rises
        message = (
            f"the pin is pulled with F/W = {reached:.3g} in the end, it slips at {plateau.mean:.3g} to {plateau.peak:.3g}: "
            "raise stage_velocity or spring_stiffness"
        )
        return Outcome(Ending.NO_SLIP, message, True, "weak_pull")
    message = (
        f"pulled with F/W = {reached:.3g} the pin slips, but never by more than {result.presliding_length:.3g} L_x, which "
        "the contact stretches: it follows the stage in micro slips; raise stage_velocity, or lower spring_stiffness"
    )
    return Outcome(Ending.NO_SLIP, message, cause="short_slips")


def _first_slip(record: FrictionRecord, static: Floats) -> tuple[float, Outcome]:
    """μ_s of the first slip, from the driving force of each; NaN, and the reason with advice, where that is not friction."""
    first = float(static[0])
    highest = record.highest_force / record.normal_load
    if _start_excess(record, first) <= highest:
        return first, COMPLETED
    message = (
        f"the driving force of the first slip, F/W = {first:.3g}, is inertia and damper: the contact holds "
        f"{highest:.3g} at most; for static friction lower stage_velocity, spring_stiffness or damping_ratio"
    )
    return math.nan, Outcome(Ending.COMPLETED, message, cause="excess")


def _start_excess(record: FrictionRecord, coefficient: float) -> float:
    """Driving force by which a start exceeds all forces of the record, F/W, through inertia and damper; NaN without a force."""
    above = coefficient - record.highest_force / record.normal_load
    return max(above, 0.0) if math.isfinite(coefficient) else math.nan


def steady_blocks(bins: Floats) -> tuple[Floats, str]:
    """Means of equal parts of the steady part of evenly binned values; and why it is not steady, or "".

    It starts where the sum of squares about the mean, over the squared number of bins kept, is least (MSER). It is refused if a
    line through eight block means changes by more than LARGEST_CHANGE, unless the scatter explains that and it starts early.
    """
    first = truncation(bins)
    edges = np.linspace(first, len(bins), BLOCKS + 1)
    # By the integral, as blocks of equal length need not begin where bins do.
    sums = np.concatenate(([0.0], np.cumsum(bins)))
    impulse = np.interp(edges, np.arange(len(bins) + 1), sums)
    blocks = np.diff(impulse) / np.diff(edges)
    return blocks, unsteadiness(blocks, latest=first >= latest_truncation(len(bins)))


def latest_truncation(count: int) -> int:
    """The last bin, of `count`, at which a steady part may start."""
    return int(count * (1.0 - LEAST_SHARE))


def truncation(bins: Floats) -> int:
    """First bin of the steady part: it minimises the marginal standard error of the bins from there on."""
    # Sums run from the end, over what is kept; less a typical value, so that their difference keeps its digits.
    centred = (bins - bins[-1])[::-1]
    kept = np.arange(1, len(bins) + 1)
    # Σ(b - mean)² = Σb² - (Σb)²/m over the m bins kept; over m² it is the square of the standard error of their mean.
    squares = (centred**2).cumsum() - centred.cumsum() ** 2 / kept
    squared_errors = (squares / kept**2)[::-1]
    return int(squared_errors[: latest_truncation(len(bins)) + 1].argmin())


_PLACES: Final = (np.arange(8) - 3.5) / 8.0
"""Middles of eight equal parts of a stretch, from the stretch's middle, in its lengths."""


def unsteadiness(blocks: Floats, latest: bool) -> str:
    """Reason why 32 block means are not steady, as the end of a sentence; empty if they are.

    latest: the truncation is as late as it may be, so that scatter does not excuse a change.
    """
    means = blocks.reshape(8, -1).mean(axis=1)
    mean, place = float(means.mean()), _PLACES
    # Least squares: the slope of the line through the means, in which places are shares of the stretch, is its change.
    change = float(place @ means / (place @ place))
    rest = means - mean - change * place
    # Eight means less the two numbers of the line leave six degrees of freedom.
    error = float(np.sqrt(rest @ rest / 6.0 / (place @ place)))
    share = change / abs(mean) if mean else np.inf
    if abs(share) <= LARGEST_CHANGE or (abs(change) <= SIGNIFICANT_CHANGE * error and not latest):
        return ""
    return f"{'rises' if share > 0.0 else 'falls'} by {abs(share):.1%} along the best steady part"
