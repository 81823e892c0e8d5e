"""Static and kinetic friction of a drive, with uncertainties (§3.3): μ_s from its first slip, μ_k where it slides steadily."""

import math
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.drive import Drive
from solver.dynamics.friction_limit import friction_limit_of
from solver.dynamics.integrate import DynamicsResult, integrate
from solver.outcome import COMPLETED, Ending, InvalidInput, Outcome
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

LONGER: Final = 1.25
"""How much longer a drive is tried that is to know kinetic friction to a given uncertainty: all together take at most five times
as long as the last one."""
FALLS: Final = 1.5
"""Power of the error by its length with which the time grows that a pin has to slide: 1 of the rest of a period, 2 of chance."""
LARGEST_LEAP: Final = 8.0
"""Most by which that time is taken to grow from one try to the next; `LEAP` where the error is not known."""
LEAP: Final = 1.5
FEWEST_SPACINGS: Final = 2.0
"""Node spacings that a pin has to slide until what a longer drive would change is known."""
BY_LENGTH: Final = 0.5
"""What of the standard error of blocks is left of it then: scatter of blocks within a spacing averages out. Longer drives of 65
scenes differed by up to the whole of it in 95 of 100."""
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
    means, from the plateau that it repeats, and from how much of a node spacing the pin travels. of_length: the part of it
    that a longer drive makes smaller.
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
    of_length: float
    outcome: Outcome

    @property
    def relative_uncertainty(self) -> float:
        """The uncertainty of kinetic friction over it; infinite where one of them is not known."""
        return self._relative(self.kinetic_friction_uncertainty)

    @property
    def relative_length_error(self) -> float:
        """The same of the part that a longer drive makes smaller."""
        return self._relative(self.of_length)

    def known_to(self, drive: Drive) -> bool:
        """Whether kinetic friction is known as well as a drive is to know it; False of one that is to know nothing."""
        if drive.uncertainty is not None and self.relative_uncertainty > drive.uncertainty:
            return False
        if drive.length_error is not None and self.relative_length_error > drive.length_error:
            return False
        return drive.uncertainty is not None or drive.length_error is not None

    def _relative(self, error: float) -> float:
        known = self.outcome.ok and self.kinetic_friction and not math.isnan(error)
        return error / abs(self.kinetic_friction) if known else math.inf

    def _facts(self) -> Iterator[str]:
        yield f"μ_s {with_error(self.static_friction, self.static_friction_uncertainty)}"
        yield f"μ_k {with_error(self.kinetic_friction, self.kinetic_friction_uncertainty)}"
        yield in_words(self.outcome)


def measured(record: FrictionRecord, plateau: Plateau, drive: Drive) -> tuple[DynamicsResult, FrictionCoefficients]:
    """The motion of a drive over `record`, and its friction.

    A drive with an `uncertainty` or a `length_error` is the one of the shortest duration tried that knows kinetic friction so
    well, or the longest.
    Raises NoPlateauError where the record has no steady part that could be continued.
    """
    friction_limit = friction_limit_of(record, plateau, drive.profile)
    slides = _time_to_slide(record, plateau, drive)
    tries = deque((*_shorter(slides, record.spacing, plateau, drive), drive))
    while True:
        each = tries.popleft()
        motion = integrate(friction_limit, each, record.initial_stiffness)
        friction = friction_coefficients(motion, record, plateau)
        if not tries or friction.known_to(drive):
            break
        while len(tries) > 1 and tries[0].duration < _expected_duration(each, friction, drive, slides):
            tries.popleft()
    return motion, replace(friction, outcome=_as_asked(friction, record, plateau, drive))


def _time_to_slide(record: FrictionRecord, plateau: Plateau, drive: Drive) -> float:
    """When the spring pulls as hard as the plateau holds; infinite with a stage at rest."""
    pace = drive.spring_stiffness * drive.stage_velocity
    return plateau.mean * record.normal_load / pace if pace else math.inf


def _shorter(slides: float, spacing: float, plateau: Plateau, drive: Drive) -> Iterator[Drive]:
    """Shorter drives to try first, the shortest one first: from where the pin may have slid for long enough."""
    if (drive.uncertainty is None and drive.length_error is None) or math.isinf(slides):
        return
    if drive.uncertainty is not None and plateau.relative_uncertainty > drive.uncertainty:
        return
    least = slides + PERIODS * 2.0 * math.pi / math.sqrt(drive.spring_stiffness)
    if drive.uncertainty is None:
        least = max(least, slides + FEWEST_SPACINGS * spacing / drive.stage_velocity)
    tries = math.floor(math.log(drive.duration / least, LONGER)) if drive.duration > least else 0
    for number in range(tries, 0, -1):
        with suppress(InvalidInput):  # shorter than a step of the integrator
            yield replace(drive, duration=drive.duration / LONGER**number)


def _expected_duration(tried: Drive, friction: FrictionCoefficients, drive: Drive, slides: float) -> float:
    """The duration that a drive with a `length_error` is expected to need, from a shorter one; 0 of others, which try all."""
    if drive.length_error is None or drive.uncertainty is not None:
        return 0.0
    found = friction.relative_length_error
    growth = min((found / drive.length_error) ** FALLS, LARGEST_LEAP) if math.isfinite(found) else LEAP
    return slides + (tried.duration - slides) * growth


def _as_asked(friction: FrictionCoefficients, record: FrictionRecord, plateau: Plateau, drive: Drive) -> Outcome:
    """How a drive ended, which says so where it is less certain than it was to be."""
    enough, found = drive.uncertainty, friction.relative_uncertainty
    if enough is None or found <= enough or not friction.outcome.ok:
        return friction.outcome
    if math.isnan(plateau.uncertainty):
        why = (
            "the contact is at an end of the surface"
            if record.at_an_end
            else "its nodes overshoot as they slip at once"
        )
        return _and(friction.outcome, f"kinetic friction is not known to {enough:.2%}: {why}")
    why = "raise duration"
    if plateau.relative_uncertainty > enough:
        why = f"its record knows the plateau to {plateau.relative_uncertainty:.2%} only: lower limits.uncertainty"
    return _and(friction.outcome, f"kinetic friction is known to {found:.2%}, not {enough:.2%}: {why}")


def friction_coefficients(result: DynamicsResult, record: FrictionRecord, plateau: Plateau) -> FrictionCoefficients:
    """μ_s and μ_k of a drive over `record`. The outcome is the drive's, or `NO_SLIP`, or `NO_PLATEAU` of its force."""
    nan = float("nan")
    if not len(result.slip_force):
        failed = result.outcome if not result.outcome.ok else _no_slip(result, plateau, record.normal_load)
        return FrictionCoefficients(nan, nan, nan, result.slip_force, nan, nan, nan, nan, failed)
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
        of_length=_of_length(result, record, uncertainty, not_travelled),
        outcome=_and(outcome, excess),
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


def _and(outcome: Outcome, more: str) -> Outcome:
    """The outcome with more in its message."""
    return outcome.adding(more)


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


def _of_length(result: DynamicsResult, record: FrictionRecord, uncertainty: float, not_travelled: float) -> float:
    """What a longer drive would change of the mean force over load; infinite where the pin has hardly slid.

    uncertainty: of the blocks. not_travelled: see `_not_travelled`.
    """
    spacings = _travelled(result) / record.spacing
    return math.hypot(BY_LENGTH * uncertainty, not_travelled) if spacings >= FEWEST_SPACINGS else math.inf


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
