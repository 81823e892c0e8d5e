"""The damped linear oscillator in closed form: a stretch of motion whose friction force is linear in the position."""

import math
from typing import NamedTuple

from nanoslip.solver.compiled import compiled
from nanoslip.solver.dynamics.kernels.slips import driving_force
from nanoslip.solver.dynamics.kernels.state import Motion, Pin


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


@compiled(error_model="numpy")
def segment_from(motion: Motion, pin: Pin, slope: float) -> Segment:
    """The segment that begins at `pin`, where F changes by `slope` per distance."""
    c, total = motion.damping, motion.spring + slope
    ramp = motion.spring * motion.stage
    q = driving_force(motion, pin) - pin.friction_force
    jerk = ramp - c * q - total * pin.velocity
    return Segment(pin, slope, c, total, q + c * pin.velocity, ramp, q, jerk, max(math.sqrt(abs(total)), c))


@compiled(error_model="numpy")
def series(segment: Segment, tau: float) -> tuple[float, float, float]:
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


@compiled(error_model="numpy")
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


@compiled(error_model="numpy")
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


@compiled(error_model="numpy")
def brief_responses(c: float, stiffness: float, tau: float) -> tuple[float, float, float, float, float]:
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


@compiled(error_model="numpy")
def state_at(segment: Segment, tau: float) -> tuple[float, float, float]:
    """y, y' and ∫y at time τ."""
    v, load, ramp = segment.pin.velocity, segment.load, segment.ramp
    if tau <= 0.0:
        return 0.0, v, 0.0
    phase = segment.pace * tau
    if phase <= 0.06 and segment.damping * tau <= 0.01:
        rate, h, one, two, three = brief_responses(segment.damping, segment.stiffness, tau)
    elif phase <= 1.0:
        return series(segment, tau)
    else:
        rate, h, one, two, three = _responses(segment.damping, segment.stiffness, tau)
    return v * h + load * one + ramp * two, v * rate + load * h + ramp * one, v * one + load * two + ramp * three
