"""Eq. 12 over a contact: closed-form segments from one event of the contact to the next, in both directions.

Between events the friction force is linear in the position, with the contact's own tangential stiffness in place of K; where the
pin turns the contact is unloaded elastically, event by event, as it is. No relaxation point and no limit F̃ are needed.
"""

from typing import NamedTuple

from nanoslip.solver.compiled import declare_kernel
from nanoslip.solver.contact.kernels.events import next_event, project_onto_pin
from nanoslip.solver.contact.kernels.path import (
    CHECK_EVENTS,
    answer_event,
    has_left_window,
    limits_together,
    smallest_step,
    step_blur,
    stretching,
)
from nanoslip.solver.contact.kernels.state import (
    RESIDUAL_LIMIT,
    EventKind,
    KernelConstants,
    KernelState,
    Stop,
    advance_path,
    equilibrium_residual,
    set_rate,
    total_shear,
)
from nanoslip.solver.dynamics.kernels.motion import (
    Floats,
    Motion,
    PinState,
    Record,
    Slip,
    Tally,
    driving_force,
    find_motion,
    follow_slip,
    make_segment,
    no_slips,
    slip_table,
)
from nanoslip.solver.dynamics.kernels.steps import highest_driving_force, moves_forward, pass_segment, segment_end


class Frame(NamedTuple):
    """The direction in which the stage of a pin moves: δ_p of the contact is origin + sign·x."""

    origin: float
    """δ_p of the contact at x = 0."""
    sign: float
    """1 or -1; the friction force on the pin is that of the contact times it."""


class Ahead(NamedTuple):
    """The next event of the contact in the direction of the pin, and how its friction force rises until then."""

    position: float
    """Pin position at the event; infinite if there is none."""
    kind: EventKind
    node: int
    slope: float
    """dF/dx."""


class Pulled(NamedTuple):
    """A pin and its contact where a stretch of a drive ended."""

    stop: Stop
    """DONE, or why the contact cannot go on as it is set up."""
    pin: PinState
    slip: Slip
    tally: Tally
    slips: Floats
    """(s, 5) macroscopic slips that ended in this stretch (see `Course.slips`)."""
    events: int
    lost: float
    """Energy that events dissipated."""


@declare_kernel(inline="always")
def _ahead(state: KernelState, constants: KernelConstants, frame: Frame) -> Ahead:
    """The next event, at least the event floor away."""
    scalars = state.scalars
    stiffness = stretching(state)
    step, kind, node = next_event(state, constants, step_blur(constants.slip, stiffness))
    # As in `follow_path`: events nearer than the floor are answered at the floor.
    limits = limits_together(state, constants.slip)
    least = smallest_step(constants.slip, limits, stiffness, abs(scalars.displacement))
    # F on the pin is sign·F(δ_p), and dδ_p/dx = sign: in dF/dx both signs cancel.
    position = scalars.displacement + scalars.pin_rate * max(step, least) - frame.origin
    return Ahead(frame.sign * position, kind, node, total_shear(state.contact, state.rate) * scalars.pin_rate)


@declare_kernel(inline="always")
def _move_pin(state: KernelState, delta: float) -> None:
    """Move the pin to δ_p = delta, all nodes stuck."""
    advance_path(state, (delta - state.scalars.displacement) * state.scalars.pin_rate)


@declare_kernel(inline="always")
def _turn(state: KernelState, forward: bool) -> None:
    """Head the pin the other way."""
    state.scalars.pin_rate = 1.0 if forward else -1.0
    state.scalars.ahead = 1 if forward else -1
    set_rate(state)


@declare_kernel(inline="always")
def _is_at_last_node(state: KernelState, constants: KernelConstants) -> bool:
    """True if a node in contact is at an end of the surface."""
    contact, outer, last = state.contact, constants.outer, len(state.x) - 1
    # Nodes are outer where there are others beyond the window.
    return bool((contact[0] and not outer[0]) or (contact[last] and not outer[last]))


@declare_kernel(inline="always")
def _check(state: KernelState, constants: KernelConstants, begun: float, events: int) -> Stop:
    """Decide after an event whether the contact can go on: CONTACT_LOST where it has come to the end of its nodes.

    begun: δ_p where it was set up, for both directions from there.
    """
    # A pin that goes both ways may leave its window on either side.
    scalars = state.scalars
    if _is_at_last_node(state, constants):
        return Stop.CONTACT_LOST
    if scalars.touches_near_end or has_left_window(constants.window_until, state, abs(scalars.displacement - begun)):
        return Stop.WINDOW_TOO_NARROW
    if scalars.releases + scalars.touches > 0 or events % CHECK_EVENTS == 0:
        project_onto_pin(state, constants)
        if not equilibrium_residual(state) <= RESIDUAL_LIMIT:
            return Stop.INACCURATE
    return Stop.DONE


@declare_kernel(entry=True, allocates=True, error_model="numpy")
def drive_contact(
    state: KernelState,
    constants: KernelConstants,
    motion: Motion,
    record: Record,
    pin: PinState,
    slip: Slip,
    tally: Tally,
    step_limit: int,
    slips_left: int,
    pieces: Floats,
    frame: Frame,
) -> Pulled:
    """Follow pin and contact together until the duration, or until the contact needs to be set up again.

    slips_left: macroscopic slips with the last of which the drive ends. pieces: see `integrate_exactly`.
    """
    origin, sign = frame
    motion = find_motion(motion, pieces, pin.time)
    finished, events, lost, stop = no_slips(), 0, 0.0, Stop.DONE
    begun = state.scalars.displacement
    _turn(state, (pin.velocity >= 0.0) == (sign > 0.0))
    ahead = _ahead(state, constants, frame)
    pin = PinState(pin.time, pin.position, pin.velocity, sign * total_shear(state.contact, state.response))
    while stop == Stop.DONE and pin.time < motion.duration and tally.steps < step_limit and len(finished) < slips_left:
        forward = moves_forward(motion, pin, ahead.slope)
        # The contact lags behind the pin, as all is linear between events: it is moved at events, turns and the end.
        if forward != (sign * state.scalars.pin_rate > 0.0):
            _move_pin(state, sign * pin.position + origin)
            _turn(state, forward == (sign > 0.0))
            ahead = _ahead(state, constants, frame)
        t, x, v, friction_force = pin
        segment = make_segment(motion, pin, ahead.slope)
        watched = v >= motion.stick_velocity and (slip.climbing or not slip.sliding)
        way, tau, met = ahead.position - x, 0.0, True
        # By rounding the pin may already be past an event, which then comes without any motion.
        if way > 0.0 if forward else way < 0.0:
            tau, met, y, v, area = segment_end(segment, motion, watched, way, forward)
            until = motion.duration if tau >= motion.duration - t else t + tau
            tally = pass_segment(record, motion, segment, tally, until, tau, y, area)
            t, x, friction_force = until, x + y, friction_force + ahead.slope * y
        if met:
            _move_pin(state, sign * ahead.position + origin)
            stop = answer_event(state, constants, ahead.kind, ahead.node)
            events += 1
            lost += state.scalars.dissipated
            stop = _check(state, constants, begun, events) if stop == Stop.DONE else stop
            ahead = _ahead(state, constants, frame)
            # Read off the contact: what F rose by along the segment is rounded, and drops in the event.
            x = sign * (state.scalars.displacement - origin)
            friction_force = sign * total_shear(state.contact, state.response)
        pin = PinState(t, x, v, friction_force)
        if tau > 0.0:
            peak = highest_driving_force(segment, motion, tau, pin) if watched else driving_force(motion, pin)
            slip = follow_slip(slip, finished, motion, segment.pin, pin, peak)
        else:
            tally = Tally(tally.steps + 1, tally.resisted, tally.work, tally.row, tally.edge)
        motion = find_motion(motion, pieces, t)
    _move_pin(state, sign * pin.position + origin)
    # A contact that has to be set up again is driven on: its slip lasts into the next stretch, and is stated there.
    lasting = Slip(slip.sliding and stop == Stop.DONE, slip.climbing, slip.time, slip.position, slip.peak, 0, 0.0)
    return Pulled(stop, pin, slip, tally, slip_table(lasting, finished, motion, pin), events, lost)
