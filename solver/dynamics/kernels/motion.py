"""State of the kernels of Eq. 12-14: the drive, the teeth of F̃, the pin, slips, and the quantities that a run records.

Units make the pin's mass 1: x'' = D - F with the driving force D = k(Vt - x) + c(V - x'). The friction force F carries
the history: the relaxation point is x_R = x - F/K at all times (Eq. 14), so F is kept instead. Within one tooth of the
limit F̃, F is linear in x with slope K (stuck: elastic contact), with F̃'s own (following the limit), or with minus F̃'s
(following -F̃ on the way back), and the motion is that of a damped linear oscillator.
"""

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.compiled import declare_kernel

Floats = NDArray[np.float64]

SlipRow = tuple[float, float, float, float, float]
"""A row of `Course.slips`."""


# A stuck pin without inertia has k(Vt - x) + c(V - x') = K(x - x_R). Once its velocity is steady,
# differentiated, k(V - x') = K x': the stick velocity kV/(k + K), whatever the damper.
class Motion(NamedTuple):
    """Eq. 12 as its kernels see it; `stick_velocity` is kV/(k + K), at which the stage drags a stuck pin along."""

    spring: float
    damping: float
    stage: float
    surface_stiffness: float
    """K; infinite for a rigid contact."""
    stick_velocity: float
    presliding: float
    """Mean F̃ over K: only a longer slip is macroscopic."""
    duration: float
    instant: float
    """Time after a segment's start within which an extremum of the velocity is ignored: a phase of 1e-8 of the
    fastest motion. It changes the velocity by the square, 1e-16, which is rounding."""
    most_slips: int
    """Number of macroscopic slips after which the run ends."""
    recorded: float
    """Time over which samples and impulse are spread; the spring force's range is that of its second half."""
    stretched: float
    """Position up to which the contact is stretched before it slides for the first time."""
    stage_start: float
    """Place at time 0 of a stage that had this velocity all the time."""


class ToothTable(NamedTuple):
    """The limit F̃: see nanoslip.solver.dynamics.friction_limit.FrictionLimit."""

    edges: Floats
    force: Floats
    slope: Floats
    periodic_from: int


class PinState(NamedTuple):
    """State at one instant; friction_force is F of Eq. 13."""

    time: float
    position: float
    velocity: float
    friction_force: float


class Slip(NamedTuple):
    """A stretch of motion faster than the stick velocity, while it lasts, and the sum of stretches too short to be
    macroscopic."""

    sliding: bool
    climbing: bool
    """True until the pin is as fast as the stage."""
    time: float
    position: float
    peak: float
    micro_slips: int
    micro_travel: float


class Course(NamedTuple):
    """Result of every method."""

    reached: float
    """Time up to which it came."""
    steps: int
    samples: Floats
    """(n + 1, 3): position, velocity, friction force at evenly spaced times."""
    impulse: Floats
    """(b + 1,): time integral of the friction force up to the edges of equal stretches of time."""
    slips: Floats
    """(s, 5): time and position of slip, largest driving force, time and position of re-stick."""
    micro_slips: int
    micro_travel: float
    friction_work: float
    least_spring_force: float
    largest_spring_force: float
    """Largest spring force in the second half of the time recorded."""


class Record(NamedTuple):
    """Arrays filled during a run: see `Course`."""

    samples: Floats
    impulse: Floats
    duration: float
    spring_range: Floats
    """(2,): least and largest spring force since `half`; infinite, the wrong way round, before."""
    half: float


class Tally(NamedTuple):
    """Sums during a run, up to the last edge or other end of a segment."""

    steps: int
    resisted: float
    """∫F dt."""
    work: float
    """∫F dx."""
    row: int
    edge: int
    """The first row of `samples` and entry of `impulse` still to be written."""


# Teeth of the limit F̃: any of infinitely many, and the one that holds a position.


@declare_kernel(error_model="numpy")
def find_repeated_tooth(teeth: ToothTable, index: int) -> tuple[int, float]:
    """Find the given tooth that tooth `index` ≥ 0 repeats, and its distance to the right."""
    count = teeth.force.size
    if index < count:
        return index, 0.0
    # Teeth before `periodic_from` (run-in) do not repeat.
    laps = (index - teeth.periodic_from) // (count - teeth.periodic_from)
    shift = laps * (teeth.edges[count] - teeth.edges[teeth.periodic_from])
    return index - laps * (count - teeth.periodic_from), shift


@declare_kernel(error_model="numpy")
def find_tooth(teeth: ToothTable, index: int) -> tuple[float, float, float, float]:
    """Left edge, right edge, force at the left edge and slope of any tooth: periodic to the right, mirrored about 0."""
    j, shift = find_repeated_tooth(teeth, index if index >= 0 else -1 - index)
    left, right = teeth.edges[j] + shift, teeth.edges[j + 1] + shift
    force, slope = teeth.force[j], teeth.slope[j]
    if index >= 0:
        return left, right, force, slope
    # F̃ is even in x: a tooth's force at its left edge is that at the right edge of its image.
    return -right, -left, force + slope * (right - left), -slope


_NEARBY = 8
"""Number of teeth tried one by one before the period and bisection are used."""

_COUNTABLE = 4.5e15
"""Number of teeth that a position in double precision can distinguish: 2^52."""


@declare_kernel(error_model="numpy")
def _tooth_nearby(teeth: ToothTable, x: float) -> int:
    """The tooth that holds x, or one beside it where rounding blurs an edge: by whole periods, then bisection."""
    count, first = teeth.force.size, teeth.periodic_from
    start, far = teeth.edges[first], abs(x)
    period = teeth.edges[count] - start
    laps = max(0, int((far - start) / period))
    # After `laps` periods off, the position lies in the first of the repeated stretches, or before all of them.
    within = int(np.searchsorted(teeth.edges, far - laps * period, side="right")) - 1
    index = min(max(within, 0), count - 1) + laps * (count - first)
    return index if x >= 0.0 else -1 - index


@declare_kernel(error_model="numpy")
def tooth_holding(teeth: ToothTable, index: int, x: float) -> tuple[int, float, float, float, float]:
    """Find the tooth that holds x, searching from tooth `index` on: its index, and the values of `find_tooth`.

    NaN for an x that is no number, or so far out that rounding exceeds the width of teeth.
    """
    count, first = teeth.force.size, teeth.periodic_from
    # Written so that NaN is too far out as well.
    if not abs(x) <= _COUNTABLE / (count - first) * (teeth.edges[count] - teeth.edges[first]):
        return index, math.nan, math.nan, math.nan, math.nan
    left, right, base, slope = find_tooth(teeth, index)
    for _ in range(_NEARBY):  # nearly every step ends in one of the next teeth
        if left <= x < right:
            return index, left, right, base, slope
        index += 1 if x >= right else -1
        left, right, base, slope = find_tooth(teeth, index)
    index = _tooth_nearby(teeth, x)
    left, right, base, slope = find_tooth(teeth, index)
    # Rounding of whole periods may miss the tooth by one.
    while x >= right:
        index += 1
        left, right, base, slope = find_tooth(teeth, index)
    while x < left:
        index -= 1
        left, right, base, slope = find_tooth(teeth, index)
    return index, left, right, base, slope


# Driving force, and slips: from stick to slip and back.


@declare_kernel(error_model="numpy")
def stage_place(motion: Motion, time: float) -> float:
    """Place of the stage."""
    return motion.stage_start + motion.stage * time


@declare_kernel(error_model="numpy")
def find_motion(motion: Motion, pieces: Floats, time: float) -> Motion:
    """The motion from a time on; the same until its piece of the stage's way ends, and after the last one.

    pieces: (p, 3) of the stage's way after the first: end, velocity, and `stage_start` of each.
    """
    if time < motion.duration or len(pieces) == 0 or time >= pieces[-1, 0]:
        return motion
    number = np.searchsorted(pieces[:, 0], time, side="right")
    stage = pieces[number, 1]
    return Motion(
        motion.spring,
        motion.damping,
        stage,
        motion.surface_stiffness,
        motion.spring * stage / (motion.spring + motion.surface_stiffness),
        motion.presliding,
        pieces[number, 0],
        motion.instant,
        motion.most_slips,
        motion.recorded,
        motion.stretched,
        pieces[number, 2],
    )


@declare_kernel(error_model="numpy")
def driving_force(motion: Motion, pin: PinState) -> float:
    """Spring and damper together."""
    # Eq. 12: k(Vt - x) + c(V - x').
    stretch = stage_place(motion, pin.time) - pin.position
    return motion.spring * stretch + motion.damping * (motion.stage - pin.velocity)


@declare_kernel(error_model="numpy")
def acceleration_rounding(motion: Motion, pin: PinState, slope: float) -> float:
    """Rounding error of an acceleration of 0, which is a small difference of large forces and positions.

    slope: of the friction force, which is read off the position.
    """
    # The spring's force is a difference of two ways that grow with the run, as its error does.
    # 4.4e-16: two units in the last place of the large terms.
    ways = abs(stage_place(motion, pin.time)) + abs(pin.position)
    far = motion.spring * ways + abs(slope * pin.position)
    return 4.4e-16 * (far + motion.damping * (motion.stage + abs(pin.velocity)) + abs(pin.friction_force))


@declare_kernel(allocates=True, error_model="numpy")
def no_slips() -> list[SlipRow]:
    """An empty table of slips."""
    finished = [(0.0, 0.0, 0.0, 0.0, 0.0)]  # tells the compiler the type
    finished.clear()
    return finished


@declare_kernel(error_model="numpy")
def _macroscopic(motion: Motion, begin: float, end: float) -> bool:
    """True if a slip is longer than the presliding length, without the part that stretches the contact for the first time.

    A pin that a damper sets in motion at once swings on its contact, up to twice as far as a slow pull would stretch it.
    """
    return end - max(begin, motion.stretched) > motion.presliding


@declare_kernel(allocates=True, error_model="numpy")
def follow_slip(slip: Slip, finished: list[SlipRow], motion: Motion, old: PinState, new: PinState, peak: float) -> Slip:
    """Follow the pin from one instant to the next, from slip to stick and back; macroscopic slips that end are added
    to `finished`.

    Between the two the velocity passes the stick velocity at most once. peak: the largest driving force between them.
    """
    # A slip is motion faster than the stick velocity, and macroscopic beyond the presliding length
    # (model.md, Glossary).
    sliding, climbing, time, position, highest, micro_slips, micro_travel = slip
    change = new.velocity - old.velocity
    # Linear between the two instants; segments end at the stick velocity, so that theirs is exact.
    share = (motion.stick_velocity - old.velocity) / change if change != 0.0 else 1.0
    # The stick velocity changes with that of the stage, and may have passed the pin's before.
    share = min(max(share, 0.0), 1.0)
    passing_time = old.time + share * (new.time - old.time)
    passing_position = old.position + share * (new.position - old.position)
    if not sliding and new.velocity > motion.stick_velocity:
        sliding = climbing = True
        time, position, highest = passing_time, passing_position, peak
    # Before the slip is ended below: its last instants may hold the largest force.
    if climbing:
        highest = max(highest, peak)
        climbing = new.velocity < motion.stage
    if sliding and new.velocity <= motion.stick_velocity:
        if _macroscopic(motion, position, passing_position):
            finished.append((time, position, highest, passing_time, passing_position))
        else:
            micro_slips += 1
            micro_travel += passing_position - position
        sliding = climbing = False
    return Slip(sliding, climbing, time, position, highest, micro_slips, micro_travel)


@declare_kernel(allocates=True, error_model="numpy")
def slip_table(slip: Slip, rows: list[SlipRow], motion: Motion, pin: PinState) -> Floats:
    """Slips as rows of an array; a slip that still lasts has no re-stick."""
    if slip.sliding and _macroscopic(motion, slip.position, pin.position):
        rows.append((slip.time, slip.position, slip.peak, math.nan, math.nan))
    table = np.empty((len(rows), 5))
    for row in range(len(rows)):
        table[row, 0], table[row, 1], table[row, 2], table[row, 3], table[row, 4] = rows[row]
    return table


# The damped linear oscillator in closed form: a stretch of motion whose friction force is linear in the position.


class Segment(NamedTuple):
    """A stretch of motion from `pin` on, in τ and y since then: y'' + c y' + κ y = load + ramp·τ, F = F_0 + slope·y.

    q, p: acceleration and its rate at the start. pace: bound on the rates of the motion.
    """

    pin: PinState
    slope: float
    damping: float
    stiffness: float
    load: float
    ramp: float
    q: float
    p: float
    pace: float


@declare_kernel(error_model="numpy")
def make_segment(motion: Motion, pin: PinState, slope: float) -> Segment:
    """The segment that begins at `pin`, where F changes by `slope` per distance."""
    # Eq. 12 with x = x_0 + y and F = F_0 + slope·y, mass 1:
    # y'' = D_0 - F_0 + kVτ - (k + slope) y - c (y' - v_0).
    # So κ = k + slope, ramp = kV and load = q + c v_0 with q = D_0 - F_0. At the start y''' = ramp - c y'' - κ y' is p.
    c, total = motion.damping, motion.spring + slope
    ramp = motion.spring * motion.stage
    q = driving_force(motion, pin) - pin.friction_force
    jerk = ramp - c * q - total * pin.velocity
    # Rates are the roots of r² + c r + κ = 0: of size c or √κ at most for κ ≥ 0, and up to 1.62 times the
    # larger of c and √-κ for κ < 0, where c = √-κ.
    pace = max(math.sqrt(abs(total)), c)
    return Segment(pin, slope, c, total, q + c * pin.velocity, ramp, q, jerk, pace)


@declare_kernel(error_model="numpy")
def series(segment: Segment, tau: float) -> tuple[float, float, float]:
    """y, y' and ∫y by the Taylor series at the start: for phases up to about 1."""
    damped, stiff = segment.damping * tau, segment.stiffness * tau * tau
    first = segment.pin.velocity * tau
    before, term = 0.5 * segment.q * tau * tau, segment.p * tau * tau * tau / 6.0
    y, moved = first + before + term, first + 2.0 * before + 3.0 * term
    area = first / 2.0 + before / 3.0 + term / 4.0
    scale = 1e-18 * (abs(first) + abs(before) + abs(term))
    # With cτ ≤ 1 and |κ|τ² ≤ 1 a term is at most 1/(n-1) of the larger of the two before it: all that is
    # left out of y is then less than `scale`.
    for n in range(4, 60):
        # Two terms are kept, as the damper couples each to the last one and the spring to the one before.
        # The n-th derivative is -c times the one before less κ times the one before that, as load and ramp are
        # gone after two derivatives of the equation. Times τⁿ/n!, term_n = -cτ/n term_(n-1) - κτ²/(n(n-1)) term_(n-2);
        # n term_n adds up to τ y', and term_n/(n+1) to ∫y/τ.
        before, term = term, -(damped * (n - 1) * term + stiff * before) / (n * (n - 1))
        y += term
        moved += n * term
        area += term / (n + 1)
        # Both, as one alone may vanish in passing.
        if abs(term) + abs(before) <= scale:
            break
    return y, moved / tau, area * tau


@declare_kernel(error_model="numpy")
def _exponential_integrals(r: float, tau: float) -> tuple[float, float, float]:
    """∫e^(rs) from 0 to τ once, twice and three times over, without cancellation where z = rτ is small."""
    z = r * tau
    # Below that the quotients would cancel, two and three times over.
    if abs(z) > 0.5:
        one = math.expm1(z) / r
        two = (one - tau) / r
        return one, two, (two - 0.5 * tau * tau) / r
    # e^(rs) = Σ (rs)^m/m!, integrated j times from 0 to τ, is τ^j Σ z^m/(m + j)!.
    term, one, two, three = 1.0, 1.0, 0.5, 1.0 / 6.0
    # At |z| = 0.5 the next term is 1e-21 of the first.
    for n in range(2, 18):
        term *= z / n
        one += term
        two += term / (n + 1)
        three += term / ((n + 1) * (n + 2))
    return one * tau, two * tau * tau, three * tau * tau * tau


@declare_kernel(error_model="numpy")
def _responses(c: float, stiffness: float, tau: float) -> tuple[float, float, float, float, float]:
    """h', h, ∫h, ∬h, ∭h of h'' + c h' + κ h = 0 with h(0) = 0, h'(0) = 1.

    Divides by κ only where that is harmless, which phases of at least 1 ensure.
    """
    a = 0.5 * c
    square = a * a - stiffness
    # h = e^(-aτ) sin(wτ)/w with a = c/2 and w² = κ - a², sinh for w² < 0: the solution of the characteristic
    # equation r² + c r + κ = 0 with h(0) = 0, h'(0) = 1. With two rates it is (e^(r_1 τ) - e^(r_2 τ))/(r_1 - r_2).
    if square > 0.25 * a * a:  # two real rates far apart: κ may vanish
        # No cancellation in this rate; the other would be a small difference.
        fast = -a - math.sqrt(square)
        slow = stiffness / fast  # the product of the rates is κ
        one, two, three = _exponential_integrals(slow, tau)
        one_f, two_f, three_f = _exponential_integrals(fast, tau)
        up, down, gap = math.exp(slow * tau), math.exp(fast * tau), slow - fast
        rate = (slow * up - fast * down) / gap
        return rate, (up - down) / gap, (one - one_f) / gap, (two - two_f) / gap, (three - three_f) / gap
    w = math.sqrt(abs(square))
    if a * tau > 700.0:  # nothing is left, and cosh would overflow
        sine = cosine = 0.0
    # Nearly critical damping: sin(wτ)/w by its series, whose next term is below rounding, as w may be 0.
    elif w * tau < 1e-4:
        sine, cosine = tau * (1.0 + square * tau * tau / 6.0), 1.0 + 0.5 * square * tau * tau
    elif square > 0.0:
        sine, cosine = math.sinh(w * tau) / w, math.cosh(w * tau)
    else:
        sine, cosine = math.sin(w * tau) / w, math.cos(w * tau)
    decay = math.exp(-a * tau)
    h, rate = decay * sine, decay * (cosine - a * sine)
    # Integrals of the equation itself give those of h, each from the ones before.
    # h' + c h + κ∫h = h'(0) = 1, then h + c∫h + κ∬h = τ, then ∫h + c∬h + κ∭h = τ²/2. Here κ ≥ 3/4 a².
    one = (1.0 - rate - c * h) / stiffness
    two = (tau - h - c * one) / stiffness
    return rate, h, one, two, (0.5 * tau * tau - one - c * two) / stiffness


@declare_kernel(error_model="numpy")
def brief_responses(c: float, stiffness: float, tau: float) -> tuple[float, float, float, float, float]:
    """`_responses` by their series at τ = 0, for cτ ≤ 0.01 and |κ|τ² ≤ 0.004. Relative errors at these bounds: 1e-15
    of h' and h, 2e-14 of ∫h, 1e-12 of ∬h, 3e-11 of ∭h."""
    # h = Σ h_n τⁿ/n! with h_1 = 1, h_2 = -c and h_(n+2) = -c h_(n+1) - κ h_n, so that h_3 is `third`.
    # Integrated twice and three times that is Σ h_n τ^(n+2)/(n+2)! and Σ h_n τ^(n+3)/(n+3)!. The lower integrals,
    # h and h' follow from the integrated equation, as in `_responses`, but with products: κ may vanish.
    third = c * c - stiffness
    fourth = c * (stiffness - third)
    fifth = -c * fourth - stiffness * third
    sixth = -c * fifth - stiffness * fourth
    square = tau * tau
    two = (1 / 6 - c * (1 / 24) * tau) + square * (
        (third * (1 / 120) + fourth * (1 / 720) * tau) + square * (fifth * (1 / 5040) + sixth * (1 / 40320) * tau)
    )
    three = (1 / 24 - c * (1 / 120) * tau) + square * (
        (third * (1 / 720) + fourth * (1 / 5040) * tau) + square * (fifth * (1 / 40320))
    )
    two, three = square * tau * two, square * square * three
    one = 0.5 * square - c * two - stiffness * three
    h = tau - c * one - stiffness * two
    return 1.0 - c * h - stiffness * one, h, one, two, three


@declare_kernel(error_model="numpy")
def motion_state(segment: Segment, tau: float) -> tuple[float, float, float]:
    """y, y' and ∫y at time τ."""
    v, load, ramp = segment.pin.velocity, segment.load, segment.ramp
    if tau <= 0.0:
        return 0.0, v, 0.0
    phase = segment.pace * tau
    # 0.06² is below the bound 0.004 of |κ|τ².
    if phase <= 0.06 and segment.damping * tau <= 0.01:
        rate, h, one, two, three = brief_responses(segment.damping, segment.stiffness, tau)
    elif phase <= 1.0:
        return series(segment, tau)
    else:
        rate, h, one, two, three = _responses(segment.damping, segment.stiffness, tau)
    # h is the response to a velocity of 1 at the start, which is an impulse; by Duhamel's integral ∫h is
    # that to a constant load of 1, and ∬h that to a load of τ.
    return v * h + load * one + ramp * two, v * rate + load * h + ramp * one, v * one + load * two + ramp * three


# When a quantity of a segment passes a level, and when a free oscillation next passes 0.


class Passing(IntEnum):
    """Quantity of a segment that passes a level; an enumeration, as numba would compile plain integers one by one."""

    POSITION = 0
    VELOCITY = 1
    DRIVING_RATE = 2
    """Rate of the driving force."""


@declare_kernel(error_model="numpy")
def offset_from_level(
    segment: Segment, motion: Motion, quantity: Passing, level: float, tau: float
) -> tuple[float, float, float]:
    """A quantity minus `level`, and its first two rates: position, velocity, or D' = k(V - v) - c a."""
    y, v, _ = motion_state(segment, tau)
    c, stiffness = segment.damping, segment.stiffness
    a = segment.load + segment.ramp * tau - c * v - stiffness * y
    # y'' = load + ramp τ - c y' - κ y, differentiated once for the jerk and once more for `fourth`; likewise
    # D = k(Vt - x) + c(V - x').
    if quantity == Passing.POSITION:
        return y - level, v, a
    jerk = segment.ramp - c * a - stiffness * v
    if quantity == Passing.VELOCITY:
        return v - level, a, jerk
    k, fourth = motion.spring, -c * jerk - stiffness * a
    return k * (motion.stage - v) - c * a - level, -k * a - c * jerk, -k * jerk - c * fourth


@declare_kernel(error_model="numpy")
def root(segment: Segment, motion: Motion, quantity: Passing, level: float, end: float, rising: bool) -> float:
    """Find the time when a quantity that is monotone on [0, end] passes `level`: Halley's method kept in its bracket."""
    low, high = 0.0, end
    tau = 0.5 * end
    for attempt in range(300):
        value, rate, curvature = offset_from_level(segment, motion, quantity, level, tau)
        if value == 0.0:
            break
        if (value > 0.0) == rising:
            high = tau
        else:
            low = tau
        # Newton's method for f/√|f'|, whose second derivative vanishes at the root: each step cubes the error.
        new = tau - value * rate / (rate * rate - 0.5 * value * curvature)
        # Far out, where large terms cancel, rate and curvature are rounding and Halley's steps lead nowhere: of a rate that
        # has decayed to 0, as a strongly damped pin's acceleration, they even have no length.
        if rate == 0.0 or not low <= new <= high or (attempt >= 60 and attempt % 2 == 0):
            tau = 0.5 * (low + high)
            continue
        step, tau = abs(new - tau), new
        # The next error is about step³ times the square of the curvature of f over its rate, or of the pace.
        bend = abs(curvature / rate) + segment.pace
        if step * (bend * step) ** 2 <= 1e-17 * tau or step <= 2e-16 * tau:  # the first is about what is still missing
            break
    return tau


@declare_kernel(error_model="numpy")
def next_zero(c: float, stiffness: float, g: float, rate: float, earliest: float) -> float:
    """First zero after `earliest` of the solution of g'' + c g' + κ g = 0 that starts with g and g' = rate."""
    a = 0.5 * c
    square = a * a - stiffness
    # With g = e^(-aτ) u, u'' = (a² - κ) u, u(0) = g and u'(0) = `slanted`: u has the zeros of g. For w² = κ - a² > 0
    # u = g cos wτ + (slanted/w) sin wτ vanishes where tan wτ = -g w/slanted, every half turn. For s² = a² - κ > 0
    # u = g cosh sτ + (slanted/s) sinh sτ vanishes once at most, where tanh sτ = -g s/slanted, which must lie
    # between 0 and 1; for s = 0 u is the straight line g + slanted τ.
    slanted = rate + a * g
    # It stays 0: a motion without extremum.
    if g == 0.0 and slanted == 0.0:
        return math.inf
    if square < 0.0:
        w = math.sqrt(-square)
        phase = math.atan2(-g * w, slanted)
        # A zero at the start is the extremum at which the last segment ended.
        while phase <= earliest * w:
            phase += math.pi
        return phase / w
    s = math.sqrt(square)
    ratio = -g * s / slanted
    # atanh(x) is x there, to rounding.
    if s == 0.0 or abs(ratio) < 1e-8:
        tau = -g / slanted
    elif 0.0 < ratio < 1.0:
        tau = math.atanh(ratio) / s
    else:
        return math.inf
    return tau if tau > earliest else math.inf
