"""A stage that goes to and fro (model of Eq. 12): one leg from turn to turn, each in a frame of its own.

In the frame of a leg the stage starts at 0 and moves forward, as in any other drive: at a turn position, velocity and friction
force of the pin change their sign, and the place of the stage is the new origin. Kernels then know of one direction only. Within
a leg the way of the stage is cut into pieces of constant velocity: one of a triangle, SINE_PIECES in a quarter of a sine.

Over a record friction belongs to the way slid, not to the place. A leg first stretches the contact the other way, under a level
limit; then it meets the steady part of the record, from where the leg before left it.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Final, NamedTuple

import numpy as np

from nanoslip.solver.arrays import Floats
from nanoslip.solver.drive import SINE_PIECES, Drive, settling_time
from nanoslip.solver.dynamics.friction_limit import FrictionLimit, make_friction_limit
from nanoslip.solver.dynamics.integrators import (
    make_motion,
    make_result,
    outcome_of_segments,
    peak_force,
    rounding_outcome,
)
from nanoslip.solver.dynamics.kernels.motion import Course, Motion, PinState, ToothTable
from nanoslip.solver.dynamics.kernels.steps import integrate_exactly
from nanoslip.solver.dynamics.result import BINS, LEG_WORDS, DynamicsResult, LegWord, StageLegs, StageLoops
from nanoslip.solver.outcome import COMPLETED, Ending, Outcome
from nanoslip.solver.parameter import quantities
from nanoslip.solver.sliding.plateau import Plateau
from nanoslip.solver.sliding.record import FrictionRecord

MIDDLE: Final = slice(7 * BINS // 16, 9 * BINS // 16)
"""The middle eighth of the time of a leg."""
RUN_IN: Final = 3
"""Legs that are left out of means: the way from the middle to the first turn, and the first cycle."""
LATE: Final = 0.1
"""Share of a leg from which on the turn of the pin is late: what it shows then is inertia."""


@dataclass(frozen=True, slots=True, eq=False)
class Leg:
    """One leg in its own frame: the stage starts at 0, and forces count against its motion."""

    sign: int
    begin: float
    """Time at which it begins."""
    origin: float
    """Place of the stage there, from the middle of its way."""
    duration: float
    stage: Floats
    """(n + 1,) place of the stage, from the last turn."""
    spring_force: Floats
    """(n + 1,) k times stage less pin."""
    run: Course
    stretched: float
    """Position at which the contact is stretched as far as sliding takes."""
    spring_work: float
    """Area under the spring force over the stage."""
    stage_work: float
    """Work through spring and damper, ∫(F + dv/dt) dS, piece by piece from the impulse of friction and the pin's momentum."""
    stored: float
    """Energy that spring and pin gain."""
    damper: float
    """Force c·V of the damper on a pin at rest, after the turn."""

    @property
    def mean_force(self) -> float:
        """Mean friction force over the time."""
        return float(self.run.impulse[-1]) / self.duration

    @property
    def middle_force(self) -> float:
        """Mean friction force in the middle of the time; NaN unless the pin has slid by a presliding length before."""
        impulses = np.diff(self.run.impulse)[MIDDLE]
        return float(impulses.mean()) * BINS / self.duration

    def slides_by_the_middle(self, presliding: float) -> bool:
        """True if the pin has slid by a presliding length before the middle of the time."""
        position = self.run.samples[:, 0]
        return bool(position[7 * (len(position) - 1) // 16] - self.stretched > presliding)

    @property
    def delay(self) -> float:
        """Share of the time after which the pin moves in the direction of the stage."""
        forward = self.run.samples[:, 1] >= 0.0
        return float(np.argmax(forward)) / (len(forward) - 1) if forward.any() else 1.0

    def regime(self, presliding: float) -> LegWord:
        """Motion of the pin."""
        slips = len(self.run.slips)
        if slips:
            return "slides" if slips == 1 else "stick_slip"
        goes_beyond = self.run.samples[:, 0].max() - self.stretched > presliding
        return "micro_slip" if goes_beyond else "partial_slip"


def stage_pieces(drive: Drive, quarter: bool) -> Floats:
    """(p, 3) Pieces of constant velocity of a leg, or of the quarter of a cycle before: end, velocity, place at time 0."""
    assert drive.stage_stroke is not None
    duration = 0.5 * drive.stroke_duration if quarter else drive.stroke_duration
    if drive.stage_motion == "triangle":
        return np.array([[duration, drive.stage_velocity, 0.0]])
    count = SINE_PIECES if quarter else 2 * SINE_PIECES
    share = np.arange(count + 1) / count
    amplitude = 0.5 * drive.stage_stroke
    places = amplitude * (np.sin(0.5 * math.pi * share) if quarter else 1.0 - np.cos(math.pi * share))
    time = duration * share
    # Chords of the sine: the stage is where it should be at the end of each piece.
    velocity = np.diff(places) / np.diff(time)
    return np.column_stack((time[1:], velocity, places[:-1] - velocity * time[:-1]))


LegPull = Callable[[Motion, Floats, PinState, int, int], tuple[Course, Outcome]]
"""A way to pull the pin along a leg: motion on its first piece, later pieces, the pin, direction, samples -> the run."""


def pull_to_and_fro(drive: Drive, motion: Motion, pull: LegPull) -> tuple[list[Leg], Outcome]:
    """Pull the pin along all legs from rest; those before one that fails, and how it ended."""
    pin, legs = PinState(0.0, 0.0, 0.0, 0.0), list[Leg]()
    count = 1 + 2 * drive.stage_cycles
    origin, begin, sign = 0.0, 0.0, 1
    for number in range(count):
        pieces = stage_pieces(drive, quarter=number == 0)
        on_leg = _motion_of_leg(motion, pieces, pin)
        samples = drive.samples_to_middle * (1 if number == 0 else 2)
        run, outcome = pull(on_leg, pieces[1:], pin, sign, samples)
        if not outcome.ok:
            message = f"on leg {number + 1} of {count}: {outcome.message}"
            return legs, Outcome(outcome.ending, message, cause=outcome.kind)
        leg = _make_leg(run, on_leg, pieces, sign, begin, origin)
        legs.append(leg)
        # The last sample falls on the end of the leg.
        position, velocity, friction_force = map(float, run.samples[-1])
        way = float(leg.stage[-1])
        # In the frame of the next leg the stage stands at 0 and moves the other way: a place x there is way -
        # x here.
        pin = PinState(0.0, way - position, -velocity, -friction_force)
        origin, begin, sign = origin + sign * way, begin + leg.duration, -sign
    return legs, COMPLETED


def _motion_of_leg(motion: Motion, pieces: Floats, pin: PinState) -> Motion:
    """The motion on the first piece of a leg."""
    k, surface = motion.spring, motion.surface_stiffness
    end, stage, _ = map(float, pieces[0])
    return motion._replace(
        stage=stage,
        stick_velocity=k * stage / (k + surface),
        duration=end,
        recorded=float(pieces[-1, 0]),
        # Friction grows from x_R = x - F/K (Eq. 14) over a presliding length:
        # The contact is first unloaded, then stretched.
        stretched=pin.position + motion.presliding - pin.friction_force / surface,
    )


def _make_leg(run: Course, motion: Motion, pieces: Floats, sign: int, begin: float, origin: float) -> Leg:
    """A leg from its run. motion: on its first piece."""
    k, c, duration = motion.spring, motion.damping, motion.recorded
    count, last = len(pieces), len(run.samples) - 1
    edges = np.append(0.0, pieces[:, 0])
    velocity, lasting = pieces[:, 1], np.diff(edges)
    places = np.append(0.0, np.cumsum(velocity * lasting))
    position, speed, _ = run.samples.T
    at_edges = np.arange(count + 1) * last // count
    impulse = run.impulse[np.arange(count + 1) * BINS // count]
    # The driving force is F + dv/dt, as the mass is 1, and dS = V dt with a V in each piece.
    stage_work = float(velocity @ (np.diff(impulse) + np.diff(speed[at_edges])))
    # ∫c (V - v) dS = c V (V Δt - Δx), piece by piece.
    damper_work = c * float(velocity @ (velocity * lasting - np.diff(position[at_edges])))
    stage = np.interp(np.arange(last + 1) / last, edges / duration, places)
    stretch = stage - position
    # Twice the energy, with mass 1.
    spring_gain = k * (stretch[-1] ** 2 - stretch[0] ** 2)
    stored = spring_gain + speed[-1] ** 2 - speed[0] ** 2
    return Leg(
        sign=sign,
        begin=begin,
        origin=origin,
        duration=duration,
        stage=stage,
        spring_force=k * stretch,
        run=run,
        stretched=motion.stretched,
        spring_work=stage_work - damper_work,
        stage_work=stage_work,
        stored=0.5 * float(stored),
        damper=c * float(velocity[0]),
    )


class _RecordByLegs:
    """A record that is met leg by leg."""

    def __init__(self, limit: FrictionLimit, drive: Drive) -> None:
        self.limit, self.drive = limit, drive
        self.phase = 0.0
        """Way slid so far along the part that repeats, less whole periods."""

    def pull_leg(self, motion: Motion, later: Floats, pin: PinState, sign: int, samples: int) -> tuple[Course, Outcome]:
        """Pull the pin along a leg."""
        level = max(abs(pin.friction_force), self.limit.steady_force)
        # Without the level, F would drop at a turn to what the first tooth begins with.
        way = max(pin.position, 0.0) + (level - pin.friction_force) / motion.surface_stiffness
        teeth = leg_teeth(self.limit, self.phase, way, level)
        run = integrate_exactly(teeth, motion, samples, BINS, self.drive.step_limit, None, pin, later, True)
        whole_leg = motion._replace(duration=motion.recorded)
        slid = float(run.samples[:, 0].max()) - way
        self.phase = math.fmod(self.phase + max(slid, 0.0), self.limit.period)
        return run, outcome_of_segments(run, whole_leg, self.drive.step_limit)


def leg_teeth(limit: FrictionLimit, phase: float, way: float, level: float) -> ToothTable:
    """The teeth of a leg: level on its first `way`, then the part of a limit that repeats, from `phase` on."""
    first = limit.periodic_from
    edges = limit.edges[first:] - limit.edges[first]
    width, force, slope = np.diff(edges), limit.force[first:], limit.slope[first:]
    cut = int(np.clip(np.searchsorted(edges, phase, side="right") - 1, 0, len(width) - 1))
    over = phase - edges[cut]
    # The tooth in which the leg begins comes first with its right part, last with its left part.
    order = np.append(np.arange(cut, len(width)), np.arange(cut + 1))
    widths, forces, slopes = width[order], force[order], slope[order]
    widths[0] -= over
    forces[0] += slopes[0] * over
    widths[-1] = over
    starts = way + np.append(0.0, np.cumsum(widths))
    # A cut at an edge, but for rounding, leaves a part without width.
    parts = np.diff(starts) > 0.0
    starts = np.append(starts[0], starts[1:][parts])
    forces, slopes = forces[parts], slopes[parts]
    if way <= 0.0:
        return ToothTable(starts, forces, slopes, 0)
    forces, slopes = np.append(level, forces), np.append(0.0, slopes)
    return ToothTable(np.append(0.0, starts), forces, slopes, 1)


class StageMotion(NamedTuple):
    """A drive whose stage goes to and fro: its motion, numbers of its cycles and legs, and how it ended."""

    motion: DynamicsResult
    loops: StageLoops
    legs: StageLegs
    outcome: Outcome


LegsPull = Callable[[Motion], tuple[list[Leg], Outcome]]
"""A way to pull the pin along all legs."""


def measure_strokes(
    record: FrictionRecord, plateau: Plateau, drive: Drive, pull: LegsPull | None = None
) -> StageMotion:
    """The motion of a drive with a stroke over `record`, and its loops. pull: pulls the pin over the contact itself instead.

    Raises NoPlateauError if the record has no steady part that could be continued.
    """
    limit = make_friction_limit(record, plateau, drive.profile)
    motion = make_motion(limit, drive, record.initial_stiffness, drive.stroke_duration)
    outcome, legs = rounding_outcome(limit, motion), list[Leg]()
    if outcome.ok:
        legs, outcome = pull(motion) if pull else pull_to_and_fro(drive, motion, _RecordByLegs(limit, drive).pull_leg)
    numbers = leg_numbers(legs, motion.presliding, limit, record.highest_force)
    loops = _NO_LOOPS
    if outcome.ok:
        # From one turn to the next sliding, spring and contact go from F one way to F the other: a way of 2F
        # (1/k + 1/K), which half of the stroke has to exceed.
        sliding_stroke = 4.0 * limit.steady_force * (1.0 / drive.spring_stiffness + 1.0 / record.initial_stiffness)
        loops = stage_loops(legs, numbers, sliding_stroke, damped=drive.damping_ratio > 0.0)
        outcome = _remark(loops, drive)
    run, stage = _join_legs(legs, drive)
    time = drive.cycles_duration * (np.arange(drive.output_times + 1) / drive.output_times)
    settling = settling_time(drive, peak_force(limit))
    result = make_result(run, motion._replace(recorded=run.reached), time, stage, settling, outcome)
    return StageMotion(result, loops, numbers, outcome)


_NO_LOOPS: Final = StageLoops(
    **{name: None if each.words else math.nan for name, each in quantities(StageLoops).items()}  # type: ignore[arg-type]
)


def leg_numbers(legs: Sequence[Leg], presliding: float, limit: FrictionLimit, highest_force: float) -> StageLegs:
    """The numbers of each leg. presliding: F/K. highest_force: of the contact's record, twice which is inertia."""
    static = [_static_force(leg, limit, highest_force) for leg in legs]
    words = list(LEG_WORDS)
    middle = [leg.middle_force if leg.slides_by_the_middle(presliding) else math.nan for leg in legs]
    return StageLegs(
        direction=np.array([leg.sign for leg in legs], np.int8),
        begin=np.array([leg.begin for leg in legs]),
        static_force=np.array(static),
        middle_force=np.array(middle),
        spring_work=np.array([leg.spring_work for leg in legs]),
        stage_work=np.array([leg.stage_work for leg in legs]),
        friction_work=np.array([leg.run.friction_work for leg in legs]),
        stored=np.array([leg.stored for leg in legs]),
        slips=np.array([len(leg.run.slips) for leg in legs], np.int64),
        regime=np.array([words.index(leg.regime(presliding)) for leg in legs], np.int8),
    )


ROUNDED: Final = 1e-6
"""Share of a force that may be rounding: springs stretch by differences of ways that are far longer."""


def _static_force(leg: Leg, limit: FrictionLimit, highest_force: float) -> float:
    """Largest driving force of a leg's first macroscopic slip; NaN without one, and where the pin never stuck before it.

    A pin breaks away where the driving force exceeds what friction holds. With a strong damper it moves on with the stage while
    its contact is still unloaded, so that less force is enough. After a turn at once by 2V sliding friction holds the pin
    back by F, and its damper pulls by c·V when it comes to rest: by more than 2F that moves the pin at once.
    """
    if not len(leg.run.slips):
        return math.nan
    static = float(leg.run.slips[0, 2])
    sticks = static >= (1.0 - ROUNDED) * limit.lowest_force and leg.damper <= 2.0 * limit.steady_force
    return static if sticks and static <= 2.0 * highest_force else math.nan


def stage_loops(legs: Sequence[Leg], numbers: StageLegs, sliding_stroke: float, damped: bool) -> StageLoops:
    """The numbers of the cycles but for the first."""
    later = legs[RUN_IN:]
    cycles = len(later) / 2.0
    kept = {item.name: getattr(numbers, item.name)[RUN_IN:] for item in fields(numbers)}
    energy = {
        name: float(kept[name].sum()) / cycles for name in ("spring_work", "stage_work", "friction_work", "stored")
    }
    static = kept["static_force"][np.isfinite(kept["static_force"])]
    time = math.fsum(leg.duration for leg in later)
    impulse = math.fsum(leg.sign * leg.mean_force * leg.duration for leg in later)
    last_cycles = zip(legs[-4:-2], legs[-2:], strict=True)
    gaps = [np.abs(one.spring_force - other.spring_force).max() for one, other in last_cycles]
    most = int(np.bincount(kept["regime"], minlength=len(LEG_WORDS)).argmax())
    return StageLoops(
        loop_energy=energy["spring_work"],
        stage_energy=energy["stage_work"],
        contact_energy=energy["friction_work"],
        # Without a damper the difference is rounding.
        damper_energy=energy["stage_work"] - energy["friction_work"] - energy["stored"] if damped else 0.0,
        midstroke_friction=float(kept["middle_force"].mean()),
        turn_static_friction=float(static.mean()) if len(static) else math.nan,
        friction_offset=impulse / time,
        pin_stroke=float(np.mean([np.ptp(leg.run.samples[:, 0]) for leg in later])),
        sliding_stroke=sliding_stroke,
        stage_closure=float(max(gaps)),
        turn_delay=float(np.mean([leg.delay for leg in later])),
        leg_regime=list(LEG_WORDS)[most],
    )


def _remark(loops: StageLoops, drive: Drive) -> Outcome:
    """`COMPLETED`, with a remark on what a stroke cannot show."""
    assert drive.stage_stroke is not None
    if loops.turn_delay > LATE:
        message = f"the pin turns {loops.turn_delay:.0%} of a leg after the stage: forces there are inertia; lower stage_velocity"
        return Outcome(Ending.COMPLETED, message, cause="late_turn")
    longer = loops.sliding_stroke / drive.stage_stroke
    # Half of the stroke then stretches spring and contact by less than friction does.
    if longer >= 2.0 and loops.leg_regime == "partial_slip" and not drive.memory:
        message = "the pin does not slide, and over a record a contact that does not slide loses nothing: memory = true"
        return Outcome(Ending.COMPLETED, message, cause="elastic_record")
    if math.isnan(loops.midstroke_friction):
        message = "the pin does not slide by the middle of the stroke, so there is no friction at mid-stroke"
        if longer > 1.0:
            message += f": raise stage_stroke by a factor of more than {longer:.3g}"
        return Outcome(Ending.COMPLETED, message, cause="short_stroke")
    return COMPLETED


def _join_legs(legs: Sequence[Leg], drive: Drive) -> tuple[Course, Floats]:
    """The run along all legs in the frame of the slab, and the place of the stage; NaN beyond the last leg."""
    count = drive.output_times
    samples = np.full((count + 1, 3), math.nan)
    stage = np.full(count + 1, math.nan)
    row, slips = 0, [np.empty((0, 5))]
    for leg in legs:
        # In its own frame a leg begins at 0 and moves ahead: sign and origin lead back to the slab.
        rows = slice(row, row + len(leg.stage))
        samples[rows] = leg.sign * leg.run.samples
        samples[rows, 0] += leg.origin
        stage[rows] = leg.origin + leg.sign * leg.stage
        # A turn is the last sample of one leg and the first of the next.
        row += len(leg.stage) - 1
        # Rows as in `Course.slips`: times count from the begin of the drive, positions along the slab.
        leg_slips = leg.run.slips.copy()
        leg_slips[:, [0, 3]] += leg.begin
        leg_slips[:, [1, 4]] = leg.origin + leg.sign * leg_slips[:, [1, 4]]
        slips.append(leg_slips)
    # In the second half of the time recorded, as `Course` has it.
    later = drive.spring_stiffness * (stage - samples[:, 0])[count // 2 : row + 1]
    course = Course(
        reached=math.fsum(leg.duration for leg in legs),
        steps=sum(leg.run.steps for leg in legs),
        samples=samples,
        impulse=np.full(BINS + 1, math.nan),
        slips=np.concatenate(slips),
        micro_slips=sum(leg.run.micro_slips for leg in legs),
        micro_travel=math.fsum(leg.run.micro_travel for leg in legs),
        friction_work=math.fsum(leg.run.friction_work for leg in legs),
        least_spring_force=later.min(initial=math.inf),
        largest_spring_force=later.max(initial=-math.inf),
    )
    return course, stage
