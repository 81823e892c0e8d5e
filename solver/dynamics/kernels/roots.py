"""When a quantity of a segment passes a level, and when a free oscillation next passes 0."""

import math

from nanoslip.solver.compiled import compiled
from nanoslip.solver.dynamics.kernels.oscillator import Segment, state_at
from nanoslip.solver.dynamics.kernels.state import Motion

POSITION, VELOCITY, DRIVING_RATE = 0, 1, 2
"""Quantities of a segment; the last is the rate of the driving force."""


@compiled(error_model="numpy")
def offset_from_level(
    segment: Segment, motion: Motion, quantity: int, level: float, tau: float
) -> tuple[float, float, float]:
    """A quantity minus `level`, and its first two rates: position, velocity, or D' = k(V - v) - c a."""
    y, v, _ = state_at(segment, tau)
    c, stiffness = segment.damping, segment.stiffness
    a = segment.load + segment.ramp * tau - c * v - stiffness * y
    if quantity == POSITION:
        return y - level, v, a
    jerk = segment.ramp - c * a - stiffness * v
    if quantity == VELOCITY:
        return v - level, a, jerk
    k, fourth = motion.spring, -c * jerk - stiffness * a
    return k * (motion.stage - v) - c * a - level, -k * a - c * jerk, -k * jerk - c * fourth


@compiled(error_model="numpy")
def root(segment: Segment, motion: Motion, quantity: int, level: float, end: float, rising: bool) -> float:
    """Where a quantity that is monotone on [0, end] passes `level`: Halley's method kept in its bracket."""
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


@compiled(error_model="numpy")
def next_zero(c: float, stiffness: float, g: float, rate: float, earliest: float) -> float:
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
