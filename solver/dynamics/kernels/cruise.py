"""Cross whole teeth the short way while the pin slides fast: nearly all of a long drive is this."""

from typing import NamedTuple

from nanoslip.solver.compiled import compiled
from nanoslip.solver.dynamics.kernels.oscillator import Segment, brief_responses, segment_from
from nanoslip.solver.dynamics.kernels.recording import next_due, note_brief, write_samples
from nanoslip.solver.dynamics.kernels.state import Motion, Pin, Record, Slip, Tally, Teeth
from nanoslip.solver.dynamics.kernels.teeth import repeated_tooth


@compiled(error_model="numpy")
def _may_turn(segment: Segment, motion: Motion, tau: float) -> bool:
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


@compiled(error_model="numpy", forceinline=True)  # a call costs a fifth of the time
def _cross_tooth(
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
    rate, h, one, two, three = brief_responses(c, stiffness, tau)
    y = v * h + (load * one + ramp * two)
    v_end = v * rate + (load * h + ramp * one)
    area = v * one + (load * two + ramp * three)
    late = (width - y) * new.inverse * (2.0 - v_end * new.inverse)  # over v_end, to the square of the forecast's error
    v_end += late * (load + ramp * tau - c * v_end - stiffness * width)
    sure = abs(a) + abs(b) <= 0.005 and c * g <= 0.01 and abs(stiffness) * (g * g) <= 0.004 and abs(late) <= 1e-6 * g
    return sure, tau + late, v_end, area + width * late, new


@compiled(error_model="numpy")
def cruise(
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
    """Slide on from the left edge of tooth `index` ≥ 0 over whole teeth, as long as `_cross_tooth` is sure of them, F
    does not meet its limit within one, and the velocity stays well above the stick velocity. Nearly all of a long drive is this.

    rigid: unless None (which compiles a function without it), F is F̃ from the start of every tooth on.
    """
    edges, force, slope = teeth.edges, teeth.force, teeth.slope  # in locals: whole tuples cost reference counts
    k, c, V, surface_stiffness, duration = (
        motion.spring,
        motion.damping,
        motion.stage,
        motion.surface_stiffness,
        motion.duration,
    )
    ramp, drag, slowest = k * V, c * V, 2.0 * motion.stick_velocity
    count, first = force.size, teeth.periodic_from
    j, shift = repeated_tooth(teeth, index)
    laps = (index - j) // (count - first)
    (t, x, v, friction_force), climbing, peak = pin, slip.climbing, slip.peak
    steps, resisted, work, row, edge = tally
    due, half = next_due(record, row, edge), record.half
    forecast = Forecast(t, v, 1.0 / v)
    while steps < step_limit:
        right, base, rise = edges[j + 1] + shift, force[j], slope[j]
        width, friction_force = right - x, min(friction_force, base) if rigid is None else base
        rate = rise if friction_force == base and rise < surface_stiffness else surface_stiffness
        after = friction_force + rate * width
        pull = drag - k * x - friction_force
        sure, tau, v_end, area, forecast = _cross_tooth(c, k + rate, pull, ramp, width, t, v, forecast)
        end = t + tau
        if not (sure and after <= base + rise * width and v_end > slowest and end < duration):
            break
        if climbing:
            if _may_turn(segment_from(motion, Pin(t, x, v, friction_force), rate), motion, tau):
                break
            peak = max(peak, k * (V * end - right) + c * (V - v_end))
            climbing = v_end < V
        if end >= due:
            segment = segment_from(motion, Pin(t, x, v, friction_force), rate)
            row, edge = write_samples(record, row, edge, segment, resisted, end)
            due = next_due(record, row, edge)
        if end >= half and (t < half or (v < V) != (v_end < V)):
            note_brief(record, motion, Pin(t, x, v, friction_force), tau, v_end)
        resisted += friction_force * tau + rate * area
        work += 0.5 * width * (friction_force + after)
        t, x, v, friction_force = end, right, v_end, after
        steps += 1
        j += 1
        if j == count:
            j = first
            laps += 1
            shift = laps * (edges[count] - edges[first])
    slip = Slip(slip.sliding, climbing, slip.time, slip.position, peak, slip.micro_slips, slip.micro_travel)
    return index + steps - tally.steps, Pin(t, x, v, friction_force), slip, Tally(steps, resisted, work, row, edge)
