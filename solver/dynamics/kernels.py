"""Compiled integration of Eq. 12 with the friction of Eq. 13-14: all functions that call each other, in one module,
because numba's cache does not notice a changed callee elsewhere.

Units make the pin's mass 1: x'' = D - F with the driving force D = k(Vt - x) + c(V - x'). The friction force F carries
the history: the relaxation point is x_R = x - F/K at all times (Eq. 14), so F is kept instead. Within one tooth of the
limit F̃, F is linear in x with slope K (stuck: elastic contact), with F̃'s own (following the limit), or with minus F̃'s
(following -F̃ on the way back), and the motion is that of a damped linear oscillator.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
SlipRow = tuple[float, float, float, float, float]

_compiled = njit(cache=True, nogil=True, error_model="numpy")


class Motion(NamedTuple):
    """Eq. 12 as its kernels see it; `creep` is the velocity kV/(k + K) at which the stage drags a stuck pin along."""

    spring: float
    damping: float
    stage: float
    contact: float
    """K; infinite for a rigid contact."""
    creep: float
    presliding: float
    duration: float
    instant: float
    """Time after a segment's start within which an extremum of the velocity is ignored: a phase of 1e-8 of the fastest
    motion, which changes the velocity by the square of that. It is rounding."""


class Teeth(NamedTuple):
    """The limit F̃: see solver.dynamics.friction_limit.Profile."""

    edges: Floats
    force: Floats
    slope: Floats
    periodic_from: int


class Pin(NamedTuple):
    """State at one instant; friction is F of Eq. 13."""

    time: float
    position: float
    velocity: float
    friction: float


class Slip(NamedTuple):
    """A stretch of motion faster than creep, while it lasts, and the sum of those too short to be macroscopic."""

    sliding: bool
    climbing: bool
    """Not yet as fast as the stage."""
    time: float
    position: float
    peak: float
    micro_slips: int
    micro_travel: float


class Run(NamedTuple):
    """What every method delivers."""

    reached: float
    """Time up to which it came."""
    steps: int
    samples: Floats
    """(n + 1, 3): position, velocity, friction at evenly spaced times."""
    impulse: Floats
    """(b + 1,): time integral of the driving force up to the edges of equal stretches of time."""
    slips: Floats
    """(s, 5): time and position of slip, largest driving force, time and position of re-stick."""
    micro_slips: int
    micro_travel: float
    friction_work: float


class Record(NamedTuple):
    """What a run fills while it goes on: see `Run`."""

    samples: Floats
    impulse: Floats
    duration: float


class Tally(NamedTuple):
    """What a run adds up while it goes on; sums up to the last edge or other end of a segment."""

    steps: int
    resisted: float
    """∫F dt."""
    work: float
    """∫F dx."""
    row: int
    edge: int
    """The first row of `samples` and entry of `impulse` still to be written."""


@_compiled
def _place(teeth: Teeth, index: int) -> tuple[int, float]:
    """Which of the given teeth tooth `index` ≥ 0 repeats, and how far to the right."""
    count = teeth.force.size
    if index < count:
        return index, 0.0
    laps = (index - teeth.periodic_from) // (count - teeth.periodic_from)
    shift = laps * (teeth.edges[count] - teeth.edges[teeth.periodic_from])
    return index - laps * (count - teeth.periodic_from), shift


@_compiled
def _tooth(teeth: Teeth, index: int) -> tuple[float, float, float, float]:
    """Left edge, right edge, force at the left edge and slope of any tooth: periodic to the right, mirrored about 0."""
    j, shift = _place(teeth, index if index >= 0 else -1 - index)
    left, right = teeth.edges[j] + shift, teeth.edges[j + 1] + shift
    force, slope = teeth.force[j], teeth.slope[j]
    if index >= 0:
        return left, right, force, slope
    return -right, -left, force + slope * (right - left), -slope


# --- slips ----------------------------------------------------------------------------------------------------------


@_compiled
def _driving_force(motion: Motion, pin: Pin) -> float:
    """Spring and damper together."""
    stretch = motion.stage * pin.time - pin.position
    return motion.spring * stretch + motion.damping * (motion.stage - pin.velocity)


@_compiled
def _doubt(motion: Motion, pin: Pin) -> float:
    """What rounding may make of an acceleration of 0: it is a small difference of large forces and positions."""
    far = motion.stage * pin.time + abs(pin.position)
    forces = motion.spring * far + motion.damping * (motion.stage + abs(pin.velocity)) + abs(pin.friction)
    return 4.4e-16 * forces


@_compiled
def _no_slips() -> list[SlipRow]:
    finished = [(0.0, 0.0, 0.0, 0.0, 0.0)]  # tells the compiler the type
    finished.clear()
    return finished


@_compiled
def _followed(slip: Slip, finished: list[SlipRow], motion: Motion, old: Pin, new: Pin, peak: float) -> Slip:
    """Follow the pin from one instant to the next, from slip to stick and back; macroscopic slips that end are added
    to `finished`.

    Between the two the velocity passes the creep velocity at most once. peak: the largest driving force between them.
    """
    sliding, climbing, time, position, highest, micro_slips, micro_travel = slip
    change = new.velocity - old.velocity
    share = (motion.creep - old.velocity) / change if change != 0.0 else 1.0
    passing_time = old.time + share * (new.time - old.time)
    passing_position = old.position + share * (new.position - old.position)
    if not sliding and new.velocity > motion.creep:
        sliding = climbing = True
        time, position, highest = passing_time, passing_position, peak
    if climbing:
        highest = max(highest, peak)
        climbing = new.velocity < motion.stage
    if sliding and new.velocity <= motion.creep:
        if passing_position - position > motion.presliding:
            finished.append((time, position, highest, passing_time, passing_position))
        else:
            micro_slips += 1
            micro_travel += passing_position - position
        sliding = climbing = False
    return Slip(sliding, climbing, time, position, highest, micro_slips, micro_travel)


@_compiled
def _slip_table(slip: Slip, rows: list[SlipRow], motion: Motion, pin: Pin) -> Floats:
    """Slips as rows of an array; one that still lasts has no re-stick."""
    if slip.sliding and pin.position - slip.position > motion.presliding:
        rows.append((slip.time, slip.position, slip.peak, math.nan, math.nan))
    table = np.empty((len(rows), 5))
    for row in range(len(rows)):
        table[row, 0], table[row, 1], table[row, 2], table[row, 3], table[row, 4] = rows[row]
    return table


# --- the damped linear oscillator, in closed form -------------------------------------------------------------------


class Segment(NamedTuple):
    """A stretch of motion from `pin` on, in τ and y since then: y'' + c y' + κ y = load + ramp·τ, F = F_0 + slope·y.

    q, p: acceleration and its rate at the start. pace: bound on the rates of the motion.
    """

    pin: Pin
    slope: float
    damping: float
    stiffness: float
    load: float
    ramp: float
    q: float
    p: float
    pace: float


@_compiled
def _segment(motion: Motion, pin: Pin, slope: float) -> Segment:
    c, total = motion.damping, motion.spring + slope
    ramp = motion.spring * motion.stage
    q = _driving_force(motion, pin) - pin.friction
    jerk = ramp - c * q - total * pin.velocity
    return Segment(pin, slope, c, total, q + c * pin.velocity, ramp, q, jerk, max(math.sqrt(abs(total)), c))


@_compiled
def _series(segment: Segment, tau: float) -> tuple[float, float, float]:
    """y, y' and ∫y by the Taylor series at the start: for phases up to about 1."""
    damped, stiff = segment.damping * tau, segment.stiffness * tau * tau
    first = segment.pin.velocity * tau
    before, term = 0.5 * segment.q * tau * tau, segment.p * tau * tau * tau / 6.0
    y, moved, area = first + before + term, first + 2.0 * before + 3.0 * term, first / 2.0 + before / 3.0 + term / 4.0
    scale = 1e-18 * (abs(first) + abs(before) + abs(term))
    for n in range(4, 60):
        before, term = term, -(damped * (n - 1) * term + stiff * before) / (n * (n - 1))
        y += term
        moved += n * term
        area += term / (n + 1)
        if abs(term) + abs(before) <= scale:
            break
    return y, moved / tau, area * tau


@_compiled
def _exponential_integrals(r: float, tau: float) -> tuple[float, float, float]:
    """∫e^(rs) from 0 to τ once, twice and three times over, without cancellation where z = rτ is small."""
    z = r * tau
    if abs(z) > 0.5:
        one = math.expm1(z) / r
        two = (one - tau) / r
        return one, two, (two - 0.5 * tau * tau) / r
    term, one, two, three = 1.0, 1.0, 0.5, 1.0 / 6.0
    for n in range(2, 18):
        term *= z / n
        one += term
        two += term / (n + 1)
        three += term / ((n + 1) * (n + 2))
    return one * tau, two * tau * tau, three * tau * tau * tau


@_compiled
def _responses(c: float, stiffness: float, tau: float) -> tuple[float, float, float, float, float]:
    """h', h, ∫h, ∬h, ∭h of h'' + c h' + κ h = 0 with h(0) = 0, h'(0) = 1.

    Divides by κ only where that is harmless, which phases of at least 1 ensure.
    """
    a = 0.5 * c
    square = a * a - stiffness
    if square > 0.25 * a * a:  # two real rates far apart: κ may vanish
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
    elif w * tau < 1e-4:
        sine, cosine = tau * (1.0 + square * tau * tau / 6.0), 1.0 + 0.5 * square * tau * tau
    elif square > 0.0:
        sine, cosine = math.sinh(w * tau) / w, math.cosh(w * tau)
    else:
        sine, cosine = math.sin(w * tau) / w, math.cos(w * tau)
    decay = math.exp(-a * tau)
    h, rate = decay * sine, decay * (cosine - a * sine)
    one = (1.0 - rate - c * h) / stiffness
    two = (tau - h - c * one) / stiffness
    return rate, h, one, two, (0.5 * tau * tau - one - c * two) / stiffness


@_compiled
def _brief_responses(c: float, stiffness: float, tau: float) -> tuple[float, float, float, float, float]:
    """`_responses` by their series at τ = 0, to rounding where cτ ≤ 0.01 and |κ|τ² ≤ 0.004."""
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


@_compiled
def _state(segment: Segment, tau: float) -> tuple[float, float, float]:
    """y, y' and ∫y at time τ."""
    v, load, ramp = segment.pin.velocity, segment.load, segment.ramp
    if tau <= 0.0:
        return 0.0, v, 0.0
    phase = segment.pace * tau
    if phase <= 0.06 and segment.damping * tau <= 0.01:
        rate, h, one, two, three = _brief_responses(segment.damping, segment.stiffness, tau)
    elif phase <= 1.0:
        return _series(segment, tau)
    else:
        rate, h, one, two, three = _responses(segment.damping, segment.stiffness, tau)
    return v * h + load * one + ramp * two, v * rate + load * h + ramp * one, v * one + load * two + ramp * three


_POSITION, _VELOCITY, _DRIVING_RATE = 0, 1, 2


@_compiled
def _residue(segment: Segment, motion: Motion, quantity: int, level: float, tau: float) -> tuple[float, float, float]:
    """A quantity minus `level`, and its first two rates: position, velocity, or D' = k(V - v) - c a."""
    y, v, _ = _state(segment, tau)
    c, stiffness = segment.damping, segment.stiffness
    a = segment.load + segment.ramp * tau - c * v - stiffness * y
    if quantity == _POSITION:
        return y - level, v, a
    jerk = segment.ramp - c * a - stiffness * v
    if quantity == _VELOCITY:
        return v - level, a, jerk
    k, fourth = motion.spring, -c * jerk - stiffness * a
    return k * (motion.stage - v) - c * a - level, -k * a - c * jerk, -k * jerk - c * fourth


@_compiled
def _root(segment: Segment, motion: Motion, quantity: int, level: float, end: float, rising: bool) -> float:
    """Where a quantity that is monotone on [0, end] passes `level`: Halley's method kept in its bracket."""
    low, high = 0.0, end
    tau = 0.5 * end
    for attempt in range(300):
        value, rate, curvature = _residue(segment, motion, quantity, level, tau)
        if value == 0.0:
            break
        if (value > 0.0) == rising:
            high = tau
        else:
            low = tau
        new = tau - value * rate / (rate * rate - 0.5 * value * curvature)
        # Far out, where large terms cancel, the curvature is rounding and Halley's steps lead nowhere.
        if not low <= new <= high or (attempt >= 60 and attempt % 2 == 0):
            tau = 0.5 * (low + high)
            continue
        step, tau = abs(new - tau), new
        bend = abs(curvature / rate) + segment.pace
        if step * (bend * step) ** 2 <= 1e-17 * tau or step <= 2e-16 * tau:  # the first is about what is still missing
            break
    return tau


@_compiled
def _next_zero(c: float, stiffness: float, g: float, rate: float, earliest: float) -> float:
    """First zero after `earliest` of the solution of g'' + c g' + κ g = 0 that starts with g and g' = rate."""
    a = 0.5 * c
    square = a * a - stiffness
    slanted = rate + a * g
    if g == 0.0 and slanted == 0.0:
        return math.inf
    if square < 0.0:
        w = math.sqrt(-square)
        phase = math.atan2(-g * w, slanted)
        while phase <= earliest * w:
            phase += math.pi
        return phase / w
    s = math.sqrt(square)
    ratio = -g * s / slanted
    if s == 0.0 or abs(ratio) < 1e-8:
        tau = -g / slanted
    elif 0.0 < ratio < 1.0:
        tau = math.atanh(ratio) / s
    else:
        return math.inf
    return tau if tau > earliest else math.inf


# --- the event-driven method ----------------------------------------------------------------------------------------


@_compiled
def _quick_crossing(segment: Segment, distance: float) -> float:
    """When the pin reaches `distance`, if it surely keeps between half and 3/2 of its velocity until then; else NaN.

    Within the phases allowed here |q| and |p| grow by less than a fifth, which makes the bound on the velocity a proof.
    """
    speed = segment.pin.velocity
    late = 2.0 * distance / speed
    if segment.damping * late > 0.1 or abs(segment.stiffness) * late * late > 0.01:
        return math.nan
    if 2.4 * (abs(segment.q) + abs(segment.p) * late) * late > abs(speed):
        return math.nan
    tau = 0.5 * late
    for _ in range(50):
        y, v, _ = _state(segment, tau)
        step = (y - distance) / v
        tau -= step
        if abs(step) <= 1e-9 * tau:  # Newton's next step would be the square of this
            break
    return tau


@_compiled
def _monotone_end(segment: Segment, motion: Motion, watched: bool, horizon: float) -> float:
    """How far the velocity (and, if watched, the driving force's rate) is monotone, at most to the horizon.

    An extremum that the last segment ended at is not met again, although rounding leaves a little acceleration there.
    """
    c, stiffness, q, p, doubt = segment.damping, segment.stiffness, segment.q, segment.p, _doubt(motion, segment.pin)
    end = min(horizon, _next_zero(c, stiffness, q if abs(q) > doubt else 0.0, p, motion.instant))
    if watched:
        k = motion.spring
        g, rate = k * q + c * p, k * p - c * (c * p + stiffness * q)
        doubt = (k + c * c) * doubt + 4.4e-16 * c * (segment.ramp + abs(stiffness * segment.pin.velocity))
        end = min(end, _next_zero(c, stiffness, g if abs(g) > doubt else 0.0, rate, motion.instant))
    if stiffness < 0.0:  # growth: stay far from overflow
        end = min(end, 20.0 / math.sqrt(-stiffness))
    return end


@_compiled
def _velocity_level(motion: Motion, v0: float, v1: float) -> float:
    """The first of the velocities 0 and creep that lies strictly between v0 and v1, or NaN."""
    creep = motion.creep
    if v1 < v0:
        if v0 > creep > v1:
            return creep
        return 0.0 if v0 > 0.0 > v1 else math.nan
    if v0 < 0.0 < v1:
        return 0.0
    return creep if v0 < creep < v1 else math.nan


@_compiled
def _segment_end(
    segment: Segment, motion: Motion, watched: bool, distance: float, forward: bool
) -> tuple[float, bool, float, float, float]:
    """When the segment ends, whether by reaching `distance`, and y, y' and ∫y then."""
    v, horizon = segment.pin.velocity, motion.duration - segment.pin.time
    if v < 0.0 or (v > 2.0 * motion.creep and not watched):
        tau = _quick_crossing(segment, distance)
        if tau <= horizon:
            _, v1, area = _state(segment, tau)
            return tau, True, distance, v1, area
    tau = _monotone_end(segment, motion, watched, horizon)
    y, v1, area = _state(segment, tau)
    level = _velocity_level(motion, v, v1)
    if not math.isnan(level):
        tau = _root(segment, motion, _VELOCITY, level, tau, v1 > v)
        y, _, area = _state(segment, tau)
        v1 = level
    if y < distance if forward else y > distance:
        return tau, False, y, v1, area
    tau = _root(segment, motion, _POSITION, distance, tau, forward)
    _, v1, area = _state(segment, tau)
    return tau, True, distance, max(v1, 0.0) if forward else min(v1, 0.0), area


@_compiled
def _highest_driving_force(segment: Segment, motion: Motion, end: float, new: Pin) -> float:
    """Maximum over [0, end] of the driving force, whose rate is monotone there; `new` is the pin at the end."""
    at_start = _driving_force(motion, segment.pin)
    highest = max(at_start, _driving_force(motion, new))
    rate = motion.spring * (motion.stage - segment.pin.velocity) - motion.damping * segment.q
    if rate > 0.0 and _residue(segment, motion, _DRIVING_RATE, 0.0, end)[0] < 0.0:
        tau = _root(segment, motion, _DRIVING_RATE, 0.0, end, False)
        y, v, _ = _state(segment, tau)
        change = motion.spring * (motion.stage * tau - y) - motion.damping * (v - segment.pin.velocity)
        highest = max(highest, at_start + change)
    return highest


@_compiled
def _moves_forward(motion: Motion, pin: Pin) -> bool:
    """Direction of the motion; from rest the acceleration decides, or its rate where that is 0 to rounding."""
    if pin.velocity != 0.0:
        return pin.velocity > 0.0
    q = _driving_force(motion, pin) - pin.friction
    jerk = motion.spring * motion.stage - motion.damping * q
    return q > 0.0 if abs(q) > max(abs(jerk) * motion.instant, _doubt(motion, pin)) else jerk >= 0.0


@_compiled
def _branch(friction: float, limit: float, slope: float, contact: float, forward: bool) -> int:
    """1 or -1 where F follows F̃ or -F̃, because elastic contact would exceed it; 0 where the contact sticks."""
    if friction >= limit and slope != contact and (slope < contact) == forward:
        return 1
    if friction <= -limit and slope != -contact and (slope < -contact) == forward:
        return -1
    return 0


@_compiled
def _stuck_reach(friction: float, limit: float, slope: float, contact: float, forward: bool) -> float:
    """How far F = K(x - x_R) stays between -F̃ and F̃ in the direction of motion: a signed distance."""
    reach = math.inf if forward else -math.inf
    if slope != contact and (slope < contact) == forward:
        reach = (limit - friction) / (contact - slope)
    if slope != -contact and (slope < -contact) == forward:
        down = -(limit + friction) / (slope + contact)
        reach = min(reach, down) if forward else max(reach, down)
    return reach


@_compiled
def _due(record: Record, row: int, edge: int) -> float:
    """When the next row of `samples` or entry of `impulse` is to be written."""
    last, bins = record.samples.shape[0] - 1, record.impulse.size - 1
    sample = record.duration * (row / last) if row <= last else math.inf
    return min(sample, record.duration * (edge / bins)) if edge <= bins else sample


@_compiled
def _written(record: Record, row: int, edge: int, segment: Segment, resisted: float, until: float) -> tuple[int, int]:
    """Write what falls into the segment; the first row and entry left. resisted: ∫F dt up to the segment's start."""
    samples, impulse, duration = record
    pin, last, bins = segment.pin, samples.shape[0] - 1, impulse.size - 1
    while row <= last and duration * (row / last) <= until:
        y, v, _ = _state(segment, duration * (row / last) - pin.time)
        samples[row, 0] = pin.position + y
        samples[row, 1] = v
        samples[row, 2] = pin.friction + segment.slope * y
        row += 1
    while edge <= bins and duration * (edge / bins) <= until:
        tau = duration * (edge / bins) - pin.time
        _, v, area = _state(segment, tau)
        impulse[edge] = v + resisted + (pin.friction * tau + segment.slope * area)  # balance: the momentum is v
        edge += 1
    return row, edge


@_compiled
def _passed(record: Record, segment: Segment, tally: Tally, until: float, tau: float, y: float, area: float) -> Tally:
    """Write and add up what falls into the segment, which ends at the time `until` and lasts τ; y and ∫y then."""
    steps, resisted, work, row, edge = tally
    friction, slope = segment.pin.friction, segment.slope
    row, edge = _written(record, row, edge, segment, resisted, until)
    return Tally(
        steps + 1, resisted + (friction * tau + slope * area), work + (friction + 0.5 * slope * y) * y, row, edge
    )


@_compiled
def _turns(segment: Segment, motion: Motion, tau: float) -> bool:
    """Whether the driving force might have an extremum within a short τ: its rate changes by less than the bound."""
    k, c, q, p = motion.spring, motion.damping, segment.q, segment.p
    rate = k * (motion.stage - segment.pin.velocity) - c * q
    return abs(rate) <= 2.0 * tau * (k * (abs(q) + tau * abs(p)) + c * abs(p))


class Forecast(NamedTuple):
    """The start of a tooth as the tooth before foretold it, less than 1e-6 off."""

    time: float
    velocity: float
    inverse: float
    """1/velocity."""


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)  # a call costs a fifth of the time
def _crossing(
    c: float, stiffness: float, pull: float, ramp: float, width: float, t: float, v: float, old: Forecast
) -> tuple[bool, float, float, float, Forecast]:
    """Whether the pin surely crosses `width` within a small phase, hardly changing its velocity v; if so the time τ
    this takes, y' and ∫y then, all to rounding, and the forecast for the next tooth.

    A second-order guess of the time and one step of Newton's method are exact here. The way from one velocity to the
    next decides the speed: guesses live on forecasts, so that they need not wait for the exact velocity.
    """
    g = width * old.inverse
    q = pull + ramp * old.time - c * old.velocity
    p = ramp - c * q - stiffness * old.velocity
    a, b = 0.5 * g * old.inverse * q, (1 / 3 * g) * (0.5 * g * old.inverse * p)  # y(gθ) = w (θ + a θ² + b/2 θ³ + …)
    tau = g - g * ((a + b) - 2.0 * (a * (a + b)))
    u = v + tau * (q + 0.5 * tau * p)
    new = Forecast(t + tau, u, 1.0 / u)

    load = pull + ramp * t
    rate, h, one, two, three = _brief_responses(c, stiffness, tau)
    y = v * h + (load * one + ramp * two)
    v_end = v * rate + (load * h + ramp * one)
    area = v * one + (load * two + ramp * three)
    late = (width - y) * new.inverse * (2.0 - v_end * new.inverse)  # over v_end, to the square of the forecast's error
    v_end += late * (load + ramp * tau - c * v_end - stiffness * width)
    sure = abs(a) + abs(b) <= 0.005 and c * g <= 0.01 and abs(stiffness) * (g * g) <= 0.004 and abs(late) <= 1e-6 * g
    return sure, tau + late, v_end, area + width * late, new


@_compiled
def _cruise(
    teeth: Teeth,
    motion: Motion,
    record: Record,
    index: int,
    pin: Pin,
    slip: Slip,
    tally: Tally,
    step_limit: int,
    rigid: bool | None,
) -> tuple[int, Pin, Slip, Tally]:
    """Slide on from the left edge of tooth `index` ≥ 0 over whole teeth, as long as `_crossing` is sure of them, F
    does not meet its limit within one, and the velocity stays well above creep. Nearly all of a long drive is this.

    rigid: unless None (which compiles a function without it), F is F̃ from the start of every tooth on.
    """
    edges, force, slope = teeth.edges, teeth.force, teeth.slope  # in locals: whole tuples cost reference counts
    k, c, V, contact, duration = motion.spring, motion.damping, motion.stage, motion.contact, motion.duration
    ramp, drag, slowest = k * V, c * V, 2.0 * motion.creep
    count, first = force.size, teeth.periodic_from
    j, shift = _place(teeth, index)
    laps = (index - j) // (count - first)
    (t, x, v, friction), climbing, peak = pin, slip.climbing, slip.peak
    steps, resisted, work, row, edge = tally
    due = _due(record, row, edge)
    forecast = Forecast(t, v, 1.0 / v)
    while steps < step_limit:
        right, base, rise = edges[j + 1] + shift, force[j], slope[j]
        width, friction = right - x, min(friction, base) if rigid is None else base
        rate = rise if friction == base and rise < contact else contact
        after = friction + rate * width
        pull = drag - k * x - friction
        sure, tau, v_end, area, forecast = _crossing(c, k + rate, pull, ramp, width, t, v, forecast)
        end = t + tau
        if not (sure and after <= base + rise * width and v_end > slowest and end < duration):
            break
        if climbing:
            if _turns(_segment(motion, Pin(t, x, v, friction), rate), motion, tau):
                break
            peak = max(peak, k * (V * end - right) + c * (V - v_end))
            climbing = v_end < V
        if end >= due:
            segment = _segment(motion, Pin(t, x, v, friction), rate)
            row, edge = _written(record, row, edge, segment, resisted, end)
            due = _due(record, row, edge)
        resisted += friction * tau + rate * area
        work += 0.5 * width * (friction + after)
        t, x, v, friction = end, right, v_end, after
        steps += 1
        j += 1
        if j == count:
            j = first
            laps += 1
            shift = laps * (edges[count] - edges[first])
    slip = Slip(slip.sliding, climbing, slip.time, slip.position, peak, slip.micro_slips, slip.micro_travel)
    return index + steps - tally.steps, Pin(t, x, v, friction), slip, Tally(steps, resisted, work, row, edge)


@_compiled
def integrate_exactly(
    teeth: Teeth,
    motion: Motion,
    sample_count: int,
    bin_count: int,
    step_limit: int,
    one_way: bool | None,
    cruising: bool,
) -> Run:
    """Follow the pin from rest, segment by segment, each in closed form and ended by the first of: an edge of the
    tooth, F meeting ±F̃, a velocity of 0 or creep, an extremum of the velocity, the end.

    one_way: unless None (which compiles a function without it), stop where F would follow -F̃. cruising: cross teeth
    the short way where that is exact.
    """
    K, duration = motion.contact, motion.duration
    record = Record(np.full((sample_count + 1, 3), np.nan), np.full(bin_count + 1, np.nan), duration)
    slip, finished = Slip(False, False, 0.0, 0.0, 0.0, 0, 0.0), _no_slips()
    pin, tally, index = Pin(0.0, 0.0, 0.0, 0.0), Tally(0, 0.0, 0.0, 0, 0), 0
    while pin.time < duration and tally.steps < step_limit:
        left, right, base, slope = _tooth(teeth, index)
        if (
            cruising
            and slip.sliding
            and pin.velocity > 2.0 * motion.creep
            and pin.friction >= 0.0
            and left >= max(pin.position, 0.0)
        ):
            index, pin, slip, tally = _cruise(teeth, motion, record, index, pin, slip, tally, step_limit, None)
            if tally.steps == step_limit:
                break
            left, right, base, slope = _tooth(teeth, index)
        t, x, v, friction = pin
        limit = max(base + slope * (x - left), 0.0)
        if one_way is not None and friction < -limit:
            break
        friction = min(max(friction, -limit), limit)
        pin = Pin(t, x, v, friction)
        forward = _moves_forward(motion, pin)
        way = right - x if forward else left - x
        if way <= 0.0 if forward else way >= 0.0:
            index += 1 if forward else -1
            tally = Tally(tally.steps + 1, tally.resisted, tally.work, tally.row, tally.edge)
            continue

        branch = _branch(friction, limit, slope, K, forward)
        if one_way is not None and branch < 0:
            break
        segment = _segment(motion, pin, branch * slope if branch else K)
        reach = way if branch else _stuck_reach(friction, limit, slope, K, forward)
        distance = min(way, reach) if forward else max(way, reach)
        watched = v >= motion.creep and (slip.climbing or not slip.sliding)
        tau, met, y, v, area = _segment_end(segment, motion, watched, distance, forward)
        t = duration if tau >= duration - t else t + tau
        tally = _passed(record, segment, tally, t, tau, y, area)

        x += y
        friction += segment.slope * y
        if met and distance == way:
            x = right if forward else left
            index += 1 if forward else -1
        elif met:
            branch = 1 if friction >= 0.0 else -1
        if branch:  # exactly on the limit, or the next segment would have to find it again
            friction = branch * (base + slope * (x - left))
        pin = Pin(t, x, v, friction)
        peak = _highest_driving_force(segment, motion, tau, pin) if watched else _driving_force(motion, pin)
        slip = _followed(slip, finished, motion, segment.pin, pin, peak)
    table = _slip_table(slip, finished, motion, pin)
    return Run(
        pin.time, tally.steps, record.samples, record.impulse, table, slip.micro_slips, slip.micro_travel, tally.work
    )


# --- the rigid contact ----------------------------------------------------------------------------------------------


@_compiled
def _held(record: Record, motion: Motion, pin: Pin, tally: Tally, until: float) -> Tally:
    """Let time pass at rest: friction balances the driving force, which grows as the stage moves on."""
    samples, impulse, duration = record
    last, bins = samples.shape[0] - 1, impulse.size - 1
    steps, resisted, work, row, edge = tally
    driving, ramp = _driving_force(motion, pin), motion.spring * motion.stage
    while row <= last and duration * (row / last) <= until:
        samples[row, 0] = pin.position
        samples[row, 1] = 0.0
        samples[row, 2] = driving + ramp * (duration * (row / last) - pin.time)
        row += 1
    while edge <= bins and duration * (edge / bins) <= until:
        tau = duration * (edge / bins) - pin.time
        impulse[edge] = resisted + (driving + 0.5 * ramp * tau) * tau
        edge += 1
    tau = until - pin.time
    return Tally(steps + 1, resisted + (driving + 0.5 * ramp * tau) * tau, work, row, edge)


@_compiled
def _balanced(segment: Segment) -> Segment:
    """The segment of a pin at rest that is just let go: its acceleration is 0 without rounding."""
    pin, slope, c, total, _, ramp, _, _, pace = segment
    return Segment(pin, slope, c, total, 0.0, ramp, 0.0, ramp, pace)


@_compiled
def integrate_rigidly(
    teeth: Teeth, motion: Motion, sample_count: int, bin_count: int, step_limit: int, one_way: bool | None
) -> Run:
    """`integrate_exactly` with a contact that does not yield: at rest while spring and damper pull no harder than F̃,
    in motion against a force of F̃.
    """
    duration = motion.duration
    record = Record(np.full((sample_count + 1, 3), np.nan), np.full(bin_count + 1, np.nan), duration)
    slip, finished = Slip(False, False, 0.0, 0.0, 0.0, 0, 0.0), _no_slips()
    pin, tally, index, heading = Pin(0.0, 0.0, 0.0, 0.0), Tally(0, 0.0, 0.0, 0, 0), 0, 0
    while pin.time < duration and tally.steps < step_limit:
        left, right, base, slope = _tooth(teeth, index)
        if heading > 0 and slip.sliding and pin.velocity > 2.0 * motion.creep and left >= max(pin.position, 0.0):
            index, pin, slip, tally = _cruise(teeth, motion, record, index, pin, slip, tally, step_limit, True)
            if tally.steps == step_limit:
                break
            left, right, base, slope = _tooth(teeth, index)
        limit = max(base + slope * (pin.position - left), 0.0)
        let_go = False
        if heading == 0:
            driving = _driving_force(motion, pin)
            heading = 1 if driving > 0.0 else -1
            if abs(driving) <= limit:
                wait = (limit - driving) / (motion.spring * motion.stage)
                let_go, heading = wait < duration - pin.time, 1
                until = pin.time + wait if let_go else duration
                tally = _held(record, motion, pin, tally, until)
                pin = Pin(until, pin.position, 0.0, limit)
                if not let_go:
                    break
            if one_way is not None and heading < 0:
                break
        forward = heading > 0
        x, way = pin.position, right - pin.position if forward else left - pin.position
        if way <= 0.0 if forward else way >= 0.0:
            index += heading
            heading = heading if pin.velocity != 0.0 else 0
            tally = Tally(tally.steps + 1, tally.resisted, tally.work, tally.row, tally.edge)
            continue

        segment = _segment(motion, Pin(pin.time, x, pin.velocity, heading * limit), heading * slope)
        segment = _balanced(segment) if let_go else segment
        friction = segment.pin.friction
        watched = pin.velocity >= motion.creep and (slip.climbing or not slip.sliding)
        tau, met, y, v, area = _segment_end(segment, motion, watched, way, forward)
        t = duration if tau >= duration - pin.time else pin.time + tau
        tally = _passed(record, segment, tally, t, tau, y, area)

        x += y
        if met:
            x = right if forward else left
            index += heading
        heading = heading if v != 0.0 else 0
        pin = Pin(t, x, v, friction + segment.slope * y)
        peak = _highest_driving_force(segment, motion, tau, pin) if watched else _driving_force(motion, pin)
        slip = _followed(slip, finished, motion, segment.pin, pin, peak)
    table = _slip_table(slip, finished, motion, pin)
    return Run(
        pin.time, tally.steps, record.samples, record.impulse, table, slip.micro_slips, slip.micro_travel, tally.work
    )


# --- Runge-Kutta ----------------------------------------------------------------------------------------------------

_NEARBY = 8
_COUNTABLE = 4.5e15
"""Teeth that a position in double precision can tell apart."""


@_compiled
def _tooth_near(teeth: Teeth, x: float) -> int:
    """The tooth that holds x, or one beside it where rounding blurs an edge: by whole periods, then bisection."""
    count, first = teeth.force.size, teeth.periodic_from
    start, far = teeth.edges[first], abs(x)
    period = teeth.edges[count] - start
    laps = max(0, int((far - start) / period))
    within = int(np.searchsorted(teeth.edges, far - laps * period, side="right")) - 1
    index = min(max(within, 0), count - 1) + laps * (count - first)
    return index if x >= 0.0 else -1 - index


@_compiled
def _located(teeth: Teeth, index: int, x: float) -> tuple[int, float, float, float, float]:
    """The tooth that holds x, looked for from tooth `index` on: its index, and what `_tooth` says of it.

    NaN for an x so far out that teeth cannot be told apart any more, or that is no number.
    """
    count, first = teeth.force.size, teeth.periodic_from
    if not abs(x) <= _COUNTABLE / (count - first) * (teeth.edges[count] - teeth.edges[first]):
        return index, math.nan, math.nan, math.nan, math.nan
    left, right, base, slope = _tooth(teeth, index)
    for _ in range(_NEARBY):  # nearly every step ends in one of the next teeth
        if left <= x < right:
            return index, left, right, base, slope
        index += 1 if x >= right else -1
        left, right, base, slope = _tooth(teeth, index)
    index = _tooth_near(teeth, x)
    left, right, base, slope = _tooth(teeth, index)
    while x >= right:
        index += 1
        left, right, base, slope = _tooth(teeth, index)
    while x < left:
        index -= 1
        left, right, base, slope = _tooth(teeth, index)
    return index, left, right, base, slope


@_compiled
def _friction(x: float, relaxed: float, contact: float, limit: float) -> float:
    """Eq. 13, for a relaxation point that is known."""
    return max(-limit, min(contact * (x - relaxed), limit))


@_compiled
def _between(s: float, old: float, new: float, old_rate: float, new_rate: float) -> float:
    """Cubic interpolation a fraction s into a step, from values and rates per step at both ends."""
    return old + s * s * (3.0 - 2.0 * s) * (new - old) + s * (1.0 - s) * ((1.0 - s) * old_rate - s * new_rate)


@_compiled
def integrate_by_steps(
    teeth: Teeth, motion: Motion, steps: int, sample_count: int, bin_count: int, one_way: bool | None
) -> Run:
    """Classical Runge-Kutta steps of equal length; F at every stage with the relaxation point of the step's start,
    which Eq. 14 updates after the step. Samples by cubic interpolation, impulse by the trapezoidal rule.

    one_way: see `integrate_exactly`. A motion that runs away ends there, its `friction_work` NaN.
    """
    k, c, V, K, duration = motion.spring, motion.damping, motion.stage, motion.contact, motion.duration
    samples = np.full((sample_count + 1, 3), np.nan)
    impulse = np.full(bin_count + 1, np.nan)
    slip, finished = Slip(False, False, 0.0, 0.0, 0.0, 0, 0.0), _no_slips()
    pin = Pin(0.0, 0.0, 0.0, 0.0)
    driving = _driving_force(motion, pin)
    relaxed = pushed = work = 0.0
    index = next_sample = next_edge = computed = 0
    left, right, base, slope = _tooth(teeth, 0)
    for step in range(steps):
        t, end = pin.time, duration * ((step + 1) / steps)
        dt = end - t
        a = driving - pin.friction
        x, v, acceleration = pin.position, pin.velocity, a
        dx, dv = v, a
        for stage in range(1, 4):
            part = dt if stage == 3 else 0.5 * dt
            x, v = pin.position + part * v, pin.velocity + part * acceleration
            if not left <= x < right:
                index, left, right, base, slope = _located(teeth, index, x)
            friction = _friction(x, relaxed, K, base + slope * (x - left))
            acceleration = k * (V * (t + part) - x) + c * (V - v) - friction
            weight = 1.0 if stage == 3 else 2.0
            dx += weight * v
            dv += weight * acceleration
        x, v = pin.position + dt / 6.0 * dx, pin.velocity + dt / 6.0 * dv
        if not left <= x < right:
            index, left, right, base, slope = _located(teeth, index, x)
        if math.isnan(left):
            work = math.nan
            break
        if one_way is not None and K * (x - relaxed) < -(base + slope * (x - left)):
            break
        new = Pin(end, x, v, _friction(x, relaxed, K, base + slope * (x - left)))
        new_driving = _driving_force(motion, new)

        while next_sample <= sample_count and duration * (next_sample / sample_count) <= end:
            s = (duration * (next_sample / sample_count) - t) / dt
            samples[next_sample, 0] = _between(s, pin.position, x, dt * pin.velocity, dt * v)
            samples[next_sample, 1] = _between(s, pin.velocity, v, dt * a, dt * (new_driving - new.friction))
            samples[next_sample, 2] = pin.friction + s * (new.friction - pin.friction)
            next_sample += 1
        while next_edge <= bin_count and duration * (next_edge / bin_count) <= end:
            s = duration * (next_edge / bin_count) - t
            impulse[next_edge] = pushed + s * (driving + 0.5 * (new_driving - driving) * s / dt)
            next_edge += 1

        slip = _followed(slip, finished, motion, pin, new, max(driving, new_driving))
        pushed += 0.5 * dt * (driving + new_driving)
        work += 0.5 * (pin.friction + new.friction) * (x - pin.position)
        relaxed = x - new.friction / K
        pin, driving, computed = new, new_driving, computed + 1
    table = _slip_table(slip, finished, motion, pin)
    return Run(pin.time, computed, samples, impulse, table, slip.micro_slips, slip.micro_travel, work)
