"""Slide the pin quasistatically from event to event (§2.1.1, §3.2): slip, release, touch -> FrictionRecord."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from solver.case import MOST_EVENTS, Case
from solver.contact import kernels
from solver.contact.coulomb import LONGEST_STEP, CoulombContact, CoulombError
from solver.contact.initial import doubted, initial_contact
from solver.contact.node_friction import node_friction
from solver.contact.pin import pin_of, surface_from_pin
from solver.contact.soundness import STEEPEST
from solver.contact.state import BROKEN, ENDINGS, ContactState, beyond_window, contact_state, coulomb_state
from solver.contact.tableau import Core, core_of, steadied
from solver.elasticity.compliance import SurfaceCompliance, uncoupled
from solver.outcome import COMPLETED, Ending, InvalidInput, Outcome, SingularOperator, TooFarApart
from solver.sliding.record import EVENT_KINDS, EVENT_TYPES, FrictionRecord
from solver.sliding.tangential import FrozenContact

OFF_THE_SLAB = 2.0
"""δ_p in L_x at which a pin that slides on and on has certainly left the slab."""
RESUMABLE = 10_000
"""Events after which a run starts afresh from its own state: a run in pieces of so many events has the bits of one in one."""
FIRST_CAPACITY = 4096
"""Events for which room is made first; it doubles as they come."""
CREATED_ON_THE_WAY = 1e-4
"""Energy that an event may create at residual_shear 1, in W²/G: it is an integral over steps there, not known to rounding."""
CREATED = 1e-6
"""Energy that events may create, as a share of the pin's work and of what others lose: a touch pays back what a coarse event
floor overshot."""
ROUNDING = 2e-16
"""Energy that rounding may create in one event on average, as a share of the load times what is displaced."""
ENERGY_CREATED = Outcome(
    Ending.ENERGY_CREATED,
    "events created energy, more than a millionth of the work: slips of many nodes at once overshoot, or the operator is "
    'not an elastic body\'s; use slip.slip_order = "worst_first", or the scheme galerkin',
)
GOING_ON = (kernels.FULL, kernels.DRIFTED, kernels.OUTGROWN)
"""Why the compiled core stops though the run does not."""


def slide(case: Case, compliance: SurfaceCompliance, start: ContactState | None = None) -> FrictionRecord:
    """Slide the pin of `case` from initial contact (or from `start`) to its limits, event by event.

    Between events all is linear in δ_p (free gaps: quadratic), so the next event is found in closed form: the smallest step
    at which |shear| = μ_i·pressure, pressure = 0 or gap = 0; a step below the event floor is raised to it. The event's node
    is answered first, then the worst offender until constraints I-III hold. Never raises for physics: the record holds the
    events so far and the outcome says why it ended.
    """
    return slide_to_state(case, compliance, start)[0]


def slide_to_state(
    case: Case, compliance: SurfaceCompliance, start: ContactState | None = None
) -> tuple[FrictionRecord, ContactState]:
    """Like `slide`, and the contact as it is where the record ends."""
    if not case.effects.friction:
        raise InvalidInput("friction = false: needs the stage contact alone, there is nothing to slide against")
    start = initial_contact(case, compliance) if start is None else start
    if not start.outcome.ok:
        return _record(case, start, math.nan, _empty_events(0), 0, start), start
    try:
        if not case.effects.pin_translation:
            record, end = _slide_with_frozen_pressures(case, start, compliance)
        else:
            follow = _slide_with_coulomb_friction if case.slip_rule.residual_shear == 1.0 else _slide
            record, end = follow(case, start, compliance if case.effects.coupling else uncoupled(compliance))
    except (SingularOperator, TooFarApart) as error:
        end = replace(start, outcome=error.outcome)
        record = _record(case, start, math.nan, _empty_events(0), 0, end)
    end = doubted(case, compliance, end)
    if end.outcome.ok and not (found := _in_hindsight(case, record, end)).ok:
        end = doubted(case, compliance, replace(end, outcome=found))
    return replace(record, outcome=end.outcome), end


def _in_hindsight(case: Case, record: FrictionRecord, end: ContactState) -> Outcome:
    """COMPLETED, or what only the whole record shows: a slab that pushes where it is pushed, energy from nowhere."""
    stiffness = record.initial_stiffness
    if case.slip_rule.residual_shear < 1.0 and stiffness <= 0.0:
        return Outcome(
            Ending.SINGULAR_OPERATOR,
            f"lateral stiffness K = {stiffness:.3g}: an elastic slab's is above 0; use the scheme galerkin",
        )
    if case.slip_rule.residual_shear == 1.0 or not _creates_energy(
        case, record, end
    ):  # classical sliding has looked itself
        return COMPLETED
    xi = (surface_from_pin(case) + end.u - end.displacement)[end.contact]
    steep = (np.abs(pin_of(case).slope(xi)) > 0.5 * node_friction(case)[end.contact]).any()
    return BROKEN[Ending.STEEP_PIN] if steep else ENERGY_CREATED


def _creates_energy(case: Case, record: FrictionRecord, end: ContactState) -> bool:
    """Whether little by little events have created more energy than rounding can."""
    created, lost = -np.minimum(record.dissipated, 0.0).sum(), np.maximum(record.dissipated, 0.0).sum()
    steps = np.diff(record.displacement)
    work = float(np.abs(record.force_after[:-1] + record.force_before[1:]) @ steps) / 2.0
    moved = (
        case.normal_load
        + abs(end.approach)
        + abs(end.displacement)
        + float(np.abs(end.u[end.contact]).max(initial=0.0))
    )
    return bool(created > CREATED * (lost + work) + ROUNDING * case.normal_load * moved * len(record.dissipated))


def states_at(case: Case, compliance: SurfaceCompliance, events: Sequence[int]) -> tuple[list[ContactState], Outcome]:
    """The contact after each of these events (increasing; 0 is initial contact), as far as the record of `case` gets; and how
    that went."""
    state, done = initial_contact(case, compliance), 0
    states: list[ContactState] = []
    for event in events:
        if event > done and state.outcome.ok:
            record, state = slide_to_state(replace(case, max_events=event - done), compliance, state)
            done += len(record.displacement)
        if done < event or not state.outcome.ok:
            break
        states.append(state)
    return states, state.outcome


def _slide(
    case: Case, start: ContactState, compliance: SurfaceCompliance, *, whole: bool = False
) -> tuple[FrictionRecord, ContactState]:
    """The run; `whole` follows every surface node, which is needed only where a far node proves to lie inside the pin."""
    core = _core_at(case, compliance, start, whole)
    initial_stiffness = kernels.total_shear(core.state, core.state.rate)
    most = case.max_events or MOST_EVENTS
    events, held = _empty_events(min(most, FIRST_CAPACITY)), 0
    while True:
        stop = min(len(events.displacement), most, (held // RESUMABLE + 1) * RESUMABLE)
        status, held = kernels.slide_events(core.state, core.rules, _first(events, stop), held, case.farthest)
        if status not in GOING_ON or (status == kernels.FULL and held == most):
            break
        if held == len(events.displacement):
            events = _grown(events)
        mended, status = _mended(core, status, whole, anew=held % RESUMABLE == 0)
        if mended is None:
            return _slide(case, start, compliance, whole=True)
        core = mended
        if status != kernels.DONE:
            break
    end = contact_state(core, ENDINGS[steadied(core, status)])
    if beyond_window(core, end):
        return _slide(case, start, compliance, whole=True)
    return _record(case, start, initial_stiffness, events, held, end), end


def _slide_with_frozen_pressures(
    case: Case, start: ContactState, compliance: SurfaceCompliance
) -> tuple[FrictionRecord, ContactState]:
    """The run without pin_translation: the tangential problem alone."""
    contact = FrozenContact(case, compliance, start)
    most = case.max_events or MOST_EVENTS
    events, held = _empty_events(min(most, FIRST_CAPACITY)), 0
    outcome, held = contact.slide(_first(events, most), held, case.farthest)
    while outcome is None and held < most:
        events = _grown(events)
        outcome, held = contact.slide(_first(events, most), held, case.farthest)
    end = contact.state(outcome or COMPLETED)
    return _record(case, start, contact.stiffness, events, held, end), end


def _slide_with_coulomb_friction(
    case: Case, start: ContactState, compliance: SurfaceCompliance
) -> tuple[FrictionRecord, ContactState]:
    """The run at residual_shear 1: an event is a node that begins to slide, is released or touches; forces do not jump.

    The energy dissipated in sliding since the last event is counted at the event.
    """
    slides = np.abs(start.nodal_force[0]) >= node_friction(case) * -start.nodal_force[1] * (1 - 1e-9)
    sign = np.where(start.contact & slides, np.sign(start.nodal_force[0]), 0.0)
    solved = CoulombContact(
        case, compliance, start.contact.copy(), sign, start.u.copy(), case.normal_load, start.displacement
    )
    rows: list[tuple[float, ...]] = []
    dissipated, initial_stiffness, outcome = 0.0, math.nan, COMPLETED
    farthest = min(case.farthest, OFF_THE_SLAB)
    try:
        rates = solved.settle(1.0)
        initial_stiffness = float(rates[0][0].sum())
        while len(rows) < (case.max_events or math.inf) and solved.displacement < farthest:
            step, kind, node = solved.next_change(rates, 1.0)
            longest = min(LONGEST_STEP * case.slab.spacing, farthest - solved.displacement)
            dissipated += solved.advance(min(step, longest), rates, 1.0)
            before, touching, slips = float(solved.force[0].sum()), solved.contact.copy(), solved.slips
            solved.change(kind if step <= longest else "", node)
            rates = solved.settle(1.0)
            if step <= longest:
                _refuse_flanks(solved, dissipated)
                gone, come = int((touching & ~solved.contact).sum()), int((solved.contact & ~touching).sum())
                forces = (solved.displacement, before, float(solved.force[0].sum()), float(rates[0][0].sum()))
                counts = (solved.slips - slips, gone, come, int(solved.contact.sum()))
                row: tuple[float, ...] = (*forces, dissipated, EVENT_KINDS.index(kind), node, *counts)
                if rows and rows[-1][0] == solved.displacement:
                    row = _as_one(rows.pop(), row)
                rows.append(row)
                dissipated = 0.0
        if math.isinf(case.farthest) and solved.displacement >= OFF_THE_SLAB:
            outcome = BROKEN[Ending.CONTACT_LOST]
    except CoulombError as error:
        outcome = BROKEN[error.ending]
    events = _empty_events(len(rows))
    for name, column in zip(kernels.Events._fields, zip(*rows, strict=True), strict=False):
        getattr(events, name)[:] = column
    end = coulomb_state(solved, outcome)
    return _record(case, start, initial_stiffness, events, len(rows), end), end


def _refuse_flanks(solved: CoulombContact, dissipated: float) -> None:
    """Raises CoulombError where a node is on a flank above 45°, or on one above its μ_i in an event that creates energy."""
    slope = np.abs(solved.pin.slope(solved.xi))[solved.contact]
    creates = dissipated < -CREATED_ON_THE_WAY * solved.normal_load**2 and bool(
        (slope > solved.friction[solved.contact]).any()
    )
    if creates or not (slope <= STEEPEST).all():
        raise CoulombError(Ending.STEEP_PIN)


def _as_one(first: tuple[float, ...], then: tuple[float, ...]) -> tuple[float, ...]:
    """Two events at one displacement as one: the first one's trigger and force before, the sums of what happened."""
    displacement, before, _, _, dissipated, kind, node, slips, releases, touches, _ = first
    _, _, after, stiffness, more_dissipated, _, _, *more, contact_size = then
    counts = (old + new for old, new in zip((slips, releases, touches), more, strict=True))
    return (displacement, before, after, stiffness, dissipated + more_dissipated, kind, node, *counts, contact_size)


def _mended(core: Core, status: int, whole: bool, anew: bool) -> tuple[Core | None, int]:
    """A core to go on with after `status`, one of GOING_ON, and whether it can (DONE); anew: as if resumed from its state.

    None where a node that the core does not follow proves to lie inside the pin.
    """
    followed: Core | None = core
    if status == kernels.OUTGROWN:
        followed = _afresh(core, whole)
        if followed is None:
            return None, status
        core, status = followed, kernels.resolve(followed.state, followed.rules, kernels.NOTHING, -1, 1.0)
    else:
        status = steadied(core, kernels.DONE)
    if anew and status == kernels.DONE:
        status = steadied(core, status)
        followed = _afresh(core, whole)
    return followed, status


def _afresh(core: Core, whole: bool) -> Core | None:
    """The core set up from its own state; None where a node that it does not follow lies inside the pin."""
    state = contact_state(core, COMPLETED)
    return None if beyond_window(core, state) else _core_at(core.case, core.compliance, state, whole)


def _core_at(case: Case, compliance: SurfaceCompliance, state: ContactState, whole: bool) -> Core:
    xi = np.where(state.contact, surface_from_pin(case) + state.u - state.displacement, 0.0)
    core = core_of(case, compliance, state.contact, state.u, pin_of(case).height(xi), state.displacement, whole=whole)
    kernels.aim_displacement(core.state)
    return core


def _empty_events(capacity: int) -> kernels.Events:
    return kernels.Events(**{name: np.empty(capacity, dtype) for name, dtype in EVENT_TYPES.items()})


def _first(events: kernels.Events, count: int) -> kernels.Events:
    """Room for the first `count` events."""
    return kernels.Events(**{name: column[:count] for name, column in events._asdict().items()})


def _grown(events: kernels.Events) -> kernels.Events:
    """The same events with room for twice as many."""
    grown = _empty_events(2 * len(events.displacement))
    for name in events._fields:
        old = getattr(events, name)
        getattr(grown, name)[: len(old)] = old
    return grown


def _record(
    case: Case, start: ContactState, initial_stiffness: float, events: kernels.Events, held: int, end: ContactState
) -> FrictionRecord:
    columns = {name: column[:held].copy() for name, column in events._asdict().items()}
    for column in columns.values():
        column.setflags(write=False)
    final = (end.displacement, end.friction_force)
    if held and not end.outcome.ok:
        # A run that broke off inside an event ends, as a record, with its last whole event.
        final = (float(columns["displacement"][-1]), float(columns["force_after"][-1]))
    return FrictionRecord(
        **columns,
        normal_load=case.normal_load,
        spacing=case.slab.spacing if case.effects.pin_translation else math.inf,
        residual_shear=case.slip_rule.residual_shear,
        spread=case.heterogeneity.spread,
        initial_force=start.friction_force,
        initial_stiffness=initial_stiffness,
        initial_slips=start.slips,
        initial_contact_size=int(start.contact.sum()),
        final_displacement=final[0],
        final_force=final[1],
        outcome=end.outcome,
    )
