"""Static and kinetic friction of a drive, with uncertainties (§3.3): μ_s from its first slip, μ_k where it slides steadily."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.drive import Drive
from solver.dynamics.friction_limit import friction_limit_of
from solver.dynamics.integrate import DynamicsResult, integrate
from solver.outcome import COMPLETED, Ending, Outcome
from solver.quantity import quantity
from solver.sliding.plateau import (
    BLOCKS,
    Plateau,
    latest_truncation,
    mean_uncertainty,
    sampling_of,
    truncation,
    unsteadiness,
)
from solver.sliding.record import FrictionRecord
from solver.sliding.sampling import MODULATION
from solver.view import Labels, in_words, with_error

PERIODS: Final = 2.0
"""Of its own motion that a pin has to slide before a mean driving force is friction, not inertia."""
_BEYOND: Final = "how far {} is beyond all forces of the record, as F/W: inertia and damper, the same for all starts"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FrictionCoefficients(Labels):
    """Macroscopic friction of one drive, as forces over W; NaN where it could not be measured, for which see `outcome`.

    static_friction: largest driving force before the first macroscopic slip ran off (μ_s); NaN where it is beyond all that the
    record holds by more than that: most of it is inertia and damper then. every_static_friction: (s,) the driving force of each
    slip. static_friction_uncertainty: standard deviation between starts of the pin within a node spacing,
    from the scatter between stretches of the plateau or, where it is larger, from the model of solver.sampling, in which a force
    above all of the plateau counts as one that only initial contact holds.
    kinetic_friction: mean of the driving force where it is steady (μ_k). kinetic_friction_uncertainty: from its block
    means, from the plateau that it repeats, and from how much of a node spacing the pin travels.
    """

    static_friction: float = field(
        metadata=quantity(
            "static friction coefficient",
            symbol="μ_s",
            comment="from the first macroscopic slip",
            uncertainty="static_friction_uncertainty",
            in_common="static_friction_excess",
            ensemble="event",
        )
    )
    static_friction_uncertainty: float = field(
        metadata=quantity("uncertainty of static_friction", comment="standard deviation between starts")
    )
    static_friction_excess: float = field(
        metadata=quantity("μ_s beyond the record", comment=_BEYOND.format("static_friction")),
    )
    every_static_friction: NDArray[np.float64]
    kinetic_friction: float = field(
        metadata=quantity(
            "kinetic friction coefficient",
            symbol="μ_k",
            comment="from steady sliding",
            uncertainty="kinetic_friction_uncertainty",
            in_common="kinetic_friction_excess",
            ensemble="mean",
        )
    )
    kinetic_friction_uncertainty: float = field(
        metadata=quantity(
            "uncertainty of kinetic_friction", comment="standard error of an estimate of the mean over all starts"
        )
    )
    kinetic_friction_excess: float = field(
        metadata=quantity("μ_k beyond the record", comment=_BEYOND.format("kinetic_friction")),
    )
    outcome: Outcome

    def _facts(self) -> Iterator[str]:
        yield f"μ_s {with_error(self.static_friction, self.static_friction_uncertainty)}"
        yield f"μ_k {with_error(self.kinetic_friction, self.kinetic_friction_uncertainty)}"
        yield in_words(self.outcome)


def measured(record: FrictionRecord, plateau: Plateau, drive: Drive) -> tuple[DynamicsResult, FrictionCoefficients]:
    """The motion of a drive over `record`, and its friction.

    Raises NoPlateauError where the record has no steady part that could be continued.
    """
    friction_limit = friction_limit_of(record, plateau, drive.profile)
    motion = integrate(friction_limit, drive, record.initial_stiffness)
    return motion, friction_coefficients(motion, record, plateau)


def friction_coefficients(result: DynamicsResult, record: FrictionRecord, plateau: Plateau) -> FrictionCoefficients:
    """μ_s and μ_k of a drive over `record`. The outcome is the drive's, or `NO_SLIP`, or `NO_PLATEAU` of its force."""
    nan = float("nan")
    if not len(result.slip_force):
        failed = result.outcome if not result.outcome.ok else _no_slip(result, plateau, record.normal_load)
        return FrictionCoefficients(nan, nan, nan, result.slip_force, nan, nan, nan, failed)
    static = result.slip_force / record.normal_load
    first, excess = _first_slip(record, static)
    kinetic, uncertainty, outcome = nan, nan, result.outcome
    slides = float(result.time[-1] - result.slip_time[0])
    if outcome.ok and slides < PERIODS * result.settling_time:
        periods = math.floor(100.0 * slides / result.settling_time) / 100.0  # never rounded up to those that are needed
        message = f"the pin slides for {periods:g} of its periods, {PERIODS:g} are needed: raise duration"
        outcome = Outcome(Ending.NO_PLATEAU, f"the driving force is not steady: {message}")
    if outcome.ok:
        kinetic, uncertainty, outcome = _steady_mean(result.binned_force / record.normal_load)
    not_travelled = _not_travelled(result, record, kinetic)
    beyond = _beyond(record, first), _beyond(record, kinetic)
    return FrictionCoefficients(
        static_friction=first,
        static_friction_uncertainty=math.hypot(_uncertainty_of_peak(record, plateau, first), beyond[0]),
        static_friction_excess=beyond[0],
        every_static_friction=static,
        kinetic_friction=kinetic,
        kinetic_friction_uncertainty=math.hypot(uncertainty, plateau.uncertainty, not_travelled, beyond[1]),
        kinetic_friction_excess=beyond[1],
        outcome=outcome.adding(excess),
    )


def _no_slip(result: DynamicsResult, plateau: Plateau, normal_load: float) -> Outcome:
    """Why a pin never slipped macroscopically: nothing pulls, nothing pulls hard enough, or its slips are too short."""
    pull = result.binned_force / normal_load
    reached = max(float(pull.max()), float(result.spring_force[-1]) / normal_load)
    if result.stick_velocity == 0.0:
        message = "the stage is at rest: raise stage_velocity"
    elif reached < plateau.peak and pull[-1] == pull.max():
        message = (
            f"the pin is pulled with F/W = {reached:.3g} in the end, it slips at {plateau.mean:.3g} to {plateau.peak:.3g}: "
            "raise the drive's duration, stage_velocity or spring_stiffness"
        )
    else:
        message = (
            f"pulled with F/W = {reached:.3g} the pin slips, but never by more than {result.presliding_length:.3g} L_x, which "
            "the contact stretches: lower spring_stiffness, or raise stage_velocity"
        )
    return Outcome(Ending.NO_SLIP, message)


def _first_slip(record: FrictionRecord, static: NDArray[np.float64]) -> tuple[float, str]:
    """μ_s of the first slip, from the driving force of each; NaN, and the reason with advice, where that is not friction."""
    first = float(static[0])
    if _beyond(record, first) <= _highest(record):
        return first, ""
    return float("nan"), (
        f"the driving force of the first slip, F/W = {first:.3g}, is inertia and damper: the contact holds "
        f"{_highest(record):.3g} at most; for static friction lower stage_velocity, spring_stiffness or damping_ratio"
    )


def _steady_mean(bins: NDArray[np.float64]) -> tuple[float, float, Outcome]:
    """Mean of the steady part of evenly binned values, its uncertainty, and whether there is a steady part."""
    first = truncation(bins)
    edges = np.linspace(first, len(bins), BLOCKS + 1)
    impulse = np.interp(edges, np.arange(len(bins) + 1), np.concatenate(([0.0], np.cumsum(bins))))
    blocks = np.diff(impulse) / np.diff(edges)
    complaint = unsteadiness(blocks, latest=first >= latest_truncation(len(bins)))
    if complaint:
        return float("nan"), float("nan"), Outcome(Ending.NO_PLATEAU, f"the driving force {complaint}: raise duration")
    return float(blocks.mean()), mean_uncertainty(blocks), COMPLETED


def _uncertainty_of_peak(record: FrictionRecord, plateau: Plateau, static: float) -> float:
    """Standard deviation of F/W where the pin first slides, between starts; NaN without a plateau or a peak."""
    if not plateau.outcome.ok or math.isnan(static):
        return float("nan")
    sampling = sampling_of(record, plateau.first_event, plateau.end - plateau.start)
    expected = sampling.of_peak(1.0 - plateau.peak / static) * static if static else 0.0
    return float(np.fmax(_scatter_of_peaks(record, plateau) / record.normal_load, expected))


def _beyond(record: FrictionRecord, coefficient: float) -> float:
    """By how much a coefficient lies outside all that the record holds, F/W: inertia and damper are in the driving force too.

    NaN of none.
    """
    return max(coefficient - _highest(record), -coefficient, 0.0) if math.isfinite(coefficient) else math.nan


def _highest(record: FrictionRecord) -> float:
    """The largest F/W of a record."""
    return float(max(record.force_before.max(), record.initial_force, record.final_force)) / record.normal_load


def _travelled(result: DynamicsResult) -> float:
    """How far the pin has gone since it slides, in L_x."""
    return float(np.nanmax(result.position)) - result.presliding_length


def _not_travelled(result: DynamicsResult, record: FrictionRecord, kinetic: float) -> float:
    """What the part of a node spacing that the pin does not travel leaves open of the mean force over load."""
    travelled = sampling_of(record, 0, _travelled(result))
    return travelled.unseen * MODULATION * travelled.discreteness * kinetic


def _scatter_of_peaks(record: FrictionRecord, plateau: Plateau) -> float:
    """Standard deviation of the highest force in eight equal stretches of the plateau; NaN without a plateau."""
    if not plateau.outcome.ok:
        return float("nan")
    within = slice(plateau.first_event + 1, plateau.last_event + 1)
    place = (record.displacement[within] - plateau.start) / (plateau.end - plateau.start)
    stretch = np.minimum((8.0 * place).astype(np.int64), 7)
    highest = np.maximum.reduceat(record.force_before[within], np.flatnonzero(np.diff(stretch, prepend=-1)))
    return float(np.std(highest, ddof=1)) if len(highest) > 1 else float("nan")
