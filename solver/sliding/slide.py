"""Slide a case from initial contact to the end of its record, by its rules."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import MOST_EVENTS, Case, Interface
from nanoslip.solver.contact.compiled_contact import (
    CompiledContact,
    answer_violations,
    beyond_window,
    compiled_contact,
    corrected_for_rounding,
    following,
    in_lines,
    left_behind,
    slip_constants,
    state_of,
    within_reach,
)
from nanoslip.solver.contact.coulomb import (
    CoulombContact,
    CoulombError,
    advance,
    change,
    coulomb_state,
    next_change,
    stick_and_slide_in_motion,
)
from nanoslip.solver.contact.initial import checked, initial_contact
from nanoslip.solver.contact.kernels.events import STEEPEST
from nanoslip.solver.contact.kernels.path import Events, empty_events, follow_path
from nanoslip.solver.contact.kernels.state import FORWARD, Direction, EventKind, Stop, new_scalars, total_shear
from nanoslip.solver.contact.pin import LONGEST_STEP, node_friction, pin_of, surface_from_pin
from nanoslip.solver.contact.soundness import NOT_FINITE, OUTCOME_OF_ENDING, OUTCOME_OF_STOP
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.elasticity.compliance import Compliance, inverse
from nanoslip.solver.outcome import COMPLETED, Ending, InvalidInput, Outcome, SingularOperator, TooFarApart
from nanoslip.solver.slab import surface_x
from nanoslip.solver.sliding.kernels.slide import TangentialState, refresh, slide_tangentially
from nanoslip.solver.sliding.record import (
    FIRST_CAPACITY,
    FrictionRecord,
    extended,
    farthest,
    off_the_slab,
    presliding_length,
)
from nanoslip.solver.sliding.validity import lawfulness


class Way(NamedTuple):
    """Way of pin and load from where they are."""

    load: float
    """Load at its start, in G·L_x·L_y."""
    direction: Direction = FORWARD
    until: float = math.nan
    """δ_p at its end, or the load where the pin rests; NaN where the limits of a case end it."""

    def end(self, case: Case, stiffness: float) -> float:
        """Displacement (or load) at the end of the leg. stiffness: of the contact before it slides."""
        return farthest(case, stiffness) if math.isnan(self.until) else self.until


class Run(NamedTuple):
    """Record of a way, displacements and forces with their signs, and what a record does not hold."""

    record: FrictionRecord
    end: ContactState
    load: NDArray[np.float64]
    """(e,) after each event."""
    load_work: float
    """Work of the load, in G·L_x²·L_y."""
    lost: float
    """Energy lost, also after the last event."""


@dataclass(eq=False)
class SlippedNodes:
    """Slips of each surface node in a run, from node `first` on; they grow with the grid."""

    first: int
    slips: NDArray[np.int64]

    def of_grid(self, first: int, nodes: int) -> NDArray[np.int64]:
        """Slip counts of a grid whose first node is `first`, (nodes,), to be added to."""
        left, right = max(self.first - first, 0), max(first + nodes - self.first - len(self.slips), 0)
        if left or right:
            self.first -= left
            self.slips = np.pad(self.slips, (left, right))
        return self.slips[first - self.first :][:nodes]


def first_room(most: int) -> Events:
    """Allocate the first columns of a run of at most `most` events."""
    return empty_events(min(most, FIRST_CAPACITY))


def first_of(events: Events, count: int) -> Events:
    """Room for the first `count` events."""
    return Events(**{name: column[:count] for name, column in events._asdict().items()})


def grown(events: Events) -> Events:
    """Copy events into arrays with room for twice as many."""
    grown = empty_events(2 * len(events.displacement))
    for name in events._fields:
        old = getattr(events, name)
        getattr(grown, name)[: len(old)] = old
    return grown


def record_of(
    case: Case,
    start: ContactState,
    initial_stiffness: float,
    events: Events,
    slipped: SlippedNodes,
    held: int,
    end: ContactState,
    load_work: float = 0.0,
    rest: float = 0.0,
) -> Run:
    """The record of a run of `held` events from `start` to `end`, read-only. rest: energy lost after the last event."""
    full = held == len(events.displacement)
    columns = {name: column if full else column[:held].copy() for name, column in events._asdict().items()}
    for column in (*columns.values(), slipped.slips):
        column.setflags(write=False)
    load = columns.pop("load")
    final, rows = (end.displacement, end.friction_force), case.slab.rows
    at_ends = (start.contact | end.contact).reshape(-1, rows)[[0, -1]]
    if held and not end.outcome.ok:
        # A run that broke off inside an event ends, as a record, with its last whole event.
        final = (float(columns["displacement"][-1]), float(columns["force_after"][-1]))
    record = FrictionRecord(
        **columns,
        node_x=np.repeat(surface_x(case.slab.n_x, slipped.first // rows, len(slipped.slips) // rows), rows),
        node_slips=slipped.slips,
        normal_load=case.normal_load,
        spacing=case.slab.spacing if case.effects.pin_translation else math.inf,
        presliding_length=presliding_length(case, initial_stiffness),
        initial_force=start.friction_force,
        initial_stiffness=initial_stiffness,
        initial_slips=start.slips,
        initial_contact_size=int(start.contact.sum()),
        end_nodes=int(at_ends.any(axis=1).sum()),
        final_displacement=final[0],
        final_force=final[1],
        outcome=end.outcome,
    )
    return Run(record, end, load, load_work, float(record.dissipated.sum()) + rest)


# Slide with the whole contact: nodes slip, are released and touch as the pin moves over them (residual_shear below 1).

RESUMABLE = 10_000
"""Number of events, for each row of nodes, after which a run restarts from its state: a run in such pieces has the same bits as
one run. To set up the window of a plane takes as long as thousands of events."""
LASTING = 100
"""Events that a rough pin's windows have to last on average to be worth their setting up, else the whole surface is followed."""
AT_FIRST = 8
"""Windows that do not count: while shear builds up the surface heaves."""
GOING_ON = (Stop.FULL, Stop.INACCURATE, Stop.WINDOW_TOO_NARROW)
"""Stops of the kernel after which the run continues."""


def slide_full_contact(case: Case, start: ContactState, compliance: Compliance, way: Way) -> Run:
    """Follow the way from `start`.

    Without the effect `coupling` shear and pressure do not act on each other.
    """
    compliance = compliance if case.effects.coupling else compliance.uncoupled()
    found = _slide(case, start, compliance, way, whole=False)
    if found is None:
        found = _slide(case, start, compliance, way, whole=True)
        assert found is not None  # there are no nodes beyond the whole surface
    return found


def _slide(case: Case, start: ContactState, compliance: Compliance, way: Way, whole: bool) -> Run | None:
    """The run within windows, or on the whole surface; None if a node beyond a window proves to lie inside the pin."""
    compiled = compiled_at(case, compliance, start, whole, way)
    initial_stiffness = _stiffness(way.direction, total_shear(compiled.state.contact, compiled.state.rate))
    most, end_at = case.max_events or MOST_EVENTS, way.end(case, initial_stiffness)
    piece = RESUMABLE * case.slab.rows
    events, held, windows, load_work = first_room(most), 0, 0, 0.0
    slipped = SlippedNodes(start.first_node, np.zeros(case.slab.nodes, np.int64))
    while True:
        stop = min(len(events.displacement), most, (held // piece + 1) * piece)
        room, before, first, window = first_of(events, stop), held, compiled.first_node, compiled.window
        slips = np.zeros(len(window), np.int64)
        status, held = follow_path(compiled.state, compiled.constants, room, slips, held, end_at)
        slipped.of_grid(first, case.slab.nodes)[window] += slips
        events.node[before:held] = first + window[events.node[before:held]]
        beyond = extended(case, initial_stiffness, held) if math.isnan(way.until) else end_at
        if status == Stop.DONE and end_at < beyond:
            end_at = beyond
            continue
        if status not in GOING_ON or (status == Stop.FULL and held == most):
            break
        if held == len(events.displacement):
            events = grown(events)
        windows += status == Stop.WINDOW_TOO_NARROW
        short = bool(case.heterogeneity.roughness) and windows > AT_FIRST + held % piece / LASTING
        going_on, status = continued(compiled, status, whole, whole or short, anew=held % piece == 0)
        if going_on is None:
            return None
        if going_on is not compiled:
            load_work += compiled.state.scalars["load_work"]
        compiled, windows = going_on, windows if held % piece else 0
        if status != Stop.DONE:
            break
    end = state_of(compiled, OUTCOME_OF_STOP[corrected_for_rounding(compiled, status)])
    if beyond_window(compiled, end):
        return None
    load_work += compiled.state.scalars["load_work"]
    return record_of(case, start, initial_stiffness, events, slipped, held, end, load_work)


def _stiffness(direction: Direction, shear_rate: float) -> float:
    """dF/dδ_p before the first event from the rate of shear; NaN where the load changes, too."""
    return math.nan if direction.load_rate else shear_rate * direction.pin_rate


def continued(
    compiled: CompiledContact, status: Stop, whole: bool, widest: bool, anew: bool
) -> tuple[CompiledContact | None, Stop]:
    """A compiled contact to go on with after `status`, one of GOING_ON, and DONE or why it cannot go on.

    widest: whether what follows a window is the whole surface. anew: set up from its own state, as a resumed run is. None if
    a node beyond the window lies inside the pin.
    """
    followed: CompiledContact | None = compiled
    if status == Stop.WINDOW_TOO_NARROW:
        followed = _set_up_again(compiled, widest)
        if followed is None:
            return None, status
        compiled, status = followed, answer_violations(followed)
    else:
        status = corrected_for_rounding(compiled, Stop.DONE)
    if anew and status == Stop.DONE:
        status = corrected_for_rounding(compiled, status)
        followed = _set_up_again(compiled, whole)
    return followed, status


def _set_up_again(compiled: CompiledContact, whole: bool) -> CompiledContact | None:
    """The contact set up from its own state; None if a node beyond the window lies inside the pin."""
    state = state_of(compiled, COMPLETED)
    if beyond_window(compiled, state):
        return None
    scalars, load = compiled.state.scalars, float(-compiled.state.inputs[-1])
    way = Way(load, Direction(*(scalars[name] for name in Direction._fields)))
    compiled.give_up()
    return compiled_at(compiled.case, compiled.compliance, state, whole, way)


def compiled_at(
    case: Case, compliance: Compliance, state: ContactState, whole: bool, way: Way | None = None
) -> CompiledContact:
    """A compiled contact in this state; on a surface without ends with a grid that has gone on where the contact has."""
    load, direction, _ = way or Way(case.normal_load)
    followed = _followed(case, state, whole)
    if nodes := left_behind(case, followed, state.contact, direction.pin_rate):
        state = following(case, compliance, state, nodes)
        followed = _followed(case, state, whole)
    contact, u, displacement, first = state.contact, state.u, state.displacement, state.first_node
    height = pin_of(case).height(np.where(contact, surface_from_pin(case, first) + u - displacement, 0.0))
    place = (displacement, first, load, direction)
    return compiled_contact(case, compliance, contact, u, height, followed, *place, slides=True)


def _followed(case: Case, state: ContactState, whole: bool) -> NDArray[np.bool_]:
    where = (state.u, state.w + state.approach, state.displacement, state.first_node)
    return np.ones_like(state.contact) if whole else within_reach(case, state.contact, *where)


# Slide with the pressures of initial contact (pin_translation off): the tangential problem alone.
#
# Nodes in contact keep their normal forces, [u] = C_uu [f_x] + C_uw [f_z], whatever the pin and their slips do; nothing
# touches, nothing is released. That is right while δ_p is small against the contact's width and, unless the coupling is off
# too, while shear lifts the surface by little (ν near 0.5).


def slide_with_constant_pressures(case: Case, start: ContactState, compliance: Compliance, way: Way) -> Run:
    """Follow the way of the pin from `start`.

    Raises SingularOperator if the tangential compliance of the contact cannot be inverted.
    """
    nodes = start.contact.nonzero()[0]
    state, constants = _tangential_state(case, compliance, start, nodes, way.direction), slip_constants(case)
    stiffness, slips = float(state.rate.sum()) * way.direction.pin_rate, np.zeros(len(nodes), np.int64)
    most, end_at = case.max_events or MOST_EVENTS, way.end(case, stiffness)
    events, held = first_room(most), 0
    while True:
        status, held = slide_tangentially(state, constants, first_of(events, most), slips, held, end_at)
        # No comparison in the kernel sees a NaN, and none ever leaves the shear again.
        finite = bool(np.isfinite(state.shear).all())
        if status != Stop.FULL or held == most or not finite:
            break
        events = grown(events)
    end = _tangential_end(case, compliance, start, state, OUTCOME_OF_STOP[status] if finite else NOT_FINITE)
    node_slips = np.zeros(case.slab.nodes, np.int64)
    node_slips[nodes] = slips
    return record_of(case, start, stiffness, events, SlippedNodes(start.first_node, node_slips), held, end)


def _tangential_end(
    case: Case, compliance: Compliance, start: ContactState, state: TangentialState, outcome: Outcome
) -> ContactState:
    """Build the current contact; its normal fields are those of initial contact."""
    force = start.nodal_force.copy()
    force[0, state.nodes] = state.shear
    u = compliance.displacements(force, case.effects.coupling)[0]
    u[state.nodes] = state.u
    displacement = float(state.scalars["displacement"])
    slip = np.where(start.contact, u - displacement, 0.0)
    values = {"shear": force[0] / compliance.widths, "slip": slip, "u": u, "nodal_force": force}
    for value in values.values():
        value.setflags(write=False)
    slips = int(state.scalars["slips"])
    return replace(start, **values, displacement=displacement, slips=slips, outcome=outcome)


def _tangential_state(
    case: Case, compliance: Compliance, start: ContactState, nodes: NDArray[np.int64], direction: Direction
) -> TangentialState:
    block = compliance.entries(nodes, nodes)
    stiffness = inverse(block, f"tangential compliance of {len(nodes)} nodes")
    limits = node_friction(case, start.first_node)[nodes] * -start.nodal_force[1, nodes]
    # A node without pressure has no shear either, even where μ_i is infinite.
    limits = np.where(np.isnan(limits), 0.0, np.maximum(limits, 0.0))
    u = start.u[nodes].copy()
    tableau = in_lines(len(nodes))
    tableau[:, : len(nodes)] = stiffness.T
    state = TangentialState(
        tableau=tableau,
        base=start.nodal_force[0, nodes] - stiffness @ u,
        shear=np.empty(len(nodes)),
        u=u,
        rate=stiffness.sum(axis=1) * direction.pin_rate,
        shear_limit=limits,
        weights=1.0 / np.maximum(limits, 1e-12 * case.normal_load),
        nodes=nodes.astype(np.int32),
        node_slips=np.zeros(len(nodes), np.int64),
        scalars=new_scalars(start.displacement, direction),
    )
    refresh(state)
    return state


# Slide with classical Coulomb friction, residual_shear 1: forces are continuous, roles of nodes change.

CREATED_ON_THE_WAY = 1e-4
"""Energy that an event may create at residual_shear 1, in W²/G: it is an integral over steps there, not exact to rounding."""


def slide_with_coulomb_friction(case: Case, start: ContactState, compliance: Compliance, way: Way) -> Run:
    """Follow the way from `start`.

    An event is a node that begins to slide, is released or touches; forces do not jump. The energy dissipated in sliding
    since the last event is counted at the event.
    """
    compliance = compliance if case.effects.coupling else compliance.uncoupled()
    run, outcome = _Run(case, _contact_at(case, start, compliance, way), way), COMPLETED
    try:
        run.follow()
        if math.isinf(way.end(case, run.initial_stiffness)) and run.solved.displacement >= off_the_slab(case):
            outcome = OUTCOME_OF_ENDING[Ending.CONTACT_LOST]
    except CoulombError as error:
        outcome = OUTCOME_OF_ENDING[error.ending]
    end = coulomb_state(run.solved, outcome)
    energies = (run.solved.load_work, run.dissipated)
    return record_of(case, start, run.initial_stiffness, run.events(), run.slipped, len(run.rows), end, *energies)


def _contact_at(case: Case, start: ContactState, compliance: Compliance, way: Way) -> CoulombContact:
    """The contact in this state; nodes at their limit of friction slide."""
    limits = node_friction(case, start.first_node) * -start.nodal_force[1]
    slides = np.abs(start.nodal_force[0]) >= limits * (1 - 1e-9)
    sign = np.where(start.contact & slides, np.sign(start.nodal_force[0]), 0.0)
    place = (start.u.copy(), way.load, start.displacement, start.first_node)
    return CoulombContact(case, compliance, start.contact.copy(), sign, *place, way.direction)


@dataclass(eq=False)
class _Run:
    """A run in the making: the contact, and a row per event in the order of `Events`."""

    case: Case
    solved: CoulombContact
    way: Way
    rows: list[tuple[float, ...]] = field(default_factory=list)
    initial_stiffness: float = math.nan
    dissipated: float = 0.0
    """Energy lost since the last event."""
    slipped: SlippedNodes = field(init=False)
    """Number of times that each node began to slide in an event of the record; in the last row, (n,)."""
    last_slips: NDArray[np.int64] = field(init=False)

    def __post_init__(self) -> None:
        self.last_slips = np.zeros(self.case.slab.nodes, np.int64)
        self.slipped = SlippedNodes(self.solved.first_node, self.last_slips.copy())

    def _left(self) -> float:
        """Length of the way that is left."""
        solved, (pin_rate, load_rate, _) = self.solved, self.way.direction
        if not pin_rate:
            return (self.way.until - solved.normal_load) * load_rate
        end = min(self.way.end(self.case, self.initial_stiffness) * pin_rate, off_the_slab(self.case))
        return end - solved.displacement * pin_rate

    def _longest(self) -> float:
        """The longest step: LONGEST_STEP, or what load shifts the edges of a parabola's contact by as much: a² ~ W."""
        if self.way.direction.pin_rate:
            return LONGEST_STEP * self.case.slab.spacing
        return 4.0 * LONGEST_STEP / int(self.solved.contact.sum()) * self.solved.normal_load

    def follow(self) -> None:
        """Step from change of roles to change of roles. Raises CoulombError if the contact has no solution."""
        case, solved = self.case, self.solved
        rates = stick_and_slide_in_motion(solved)
        self.initial_stiffness = _stiffness(self.way.direction, float(rates[0][0].sum()))
        while len(self.rows) < (case.max_events or math.inf) and (left := self._left()) > 0.0:
            step, kind, node = next_change(solved, rates)
            longest = min(self._longest(), left)
            self.dissipated += advance(solved, min(step, longest), rates)
            before, touching, slips = float(solved.force[0].sum()), solved.contact.copy(), solved.node_slips.copy()
            change(solved, kind if step <= longest else EventKind.NOTHING, node)
            rates = stick_and_slide_in_motion(solved)
            if step <= longest:
                _refuse_flanks(solved, self.dissipated)
                changes = ((touching & ~solved.contact).sum(), (solved.contact & ~touching).sum())
                stiffness = float(rates[0][0].sum()) * solved.direction.pin_rate
                self._add((kind, node, before, stiffness), solved.node_slips - slips, changes)
            if nodes := left_behind(case, solved.contact, solved.contact, self.way.direction.pin_rate):
                solved.go_on(nodes)
                rates, self.last_slips = solved.rates(), np.roll(self.last_slips, -nodes)

    def _add(
        self, event: tuple[EventKind, int, float, float], slips: NDArray[np.int64], changes: tuple[int, int]
    ) -> None:
        """The row of an event: its kind, node, force before and stiffness after; slips of each node (n,); releases, touches."""
        solved, (kind, node, before, stiffness) = self.solved, event
        of_grid = self.slipped.of_grid(solved.first_node, len(slips))
        of_grid += slips
        forces = (solved.displacement, before, float(solved.force[0].sum()), stiffness)
        again = bool(self.rows) and self.rows[-1][0] == solved.displacement
        self.last_slips = self.last_slips + slips if again else slips
        sizes = (int(solved.contact.sum()), int(np.count_nonzero(self.last_slips)))
        row: tuple[float, ...] = (
            *forces,
            self.dissipated,
            kind,
            solved.first_node + node,
            int(slips.sum()),
            *changes,
            *sizes,
            solved.normal_load,
        )
        self.rows.append(_as_one(self.rows.pop(), row) if again else row)
        self.dissipated = 0.0

    def events(self) -> Events:
        """The rows as columns."""
        events = empty_events(len(self.rows))
        for name, column in zip(Events._fields, zip(*self.rows, strict=True), strict=False):
            getattr(events, name)[:] = column
        return events


def _refuse_flanks(solved: CoulombContact, dissipated: float) -> None:
    """Raises CoulombError if a node is on a flank above 45°, or on one above its μ_i in an event that creates energy."""
    slope = np.abs(solved.pin.slope(solved.xi))[solved.contact]
    creates = dissipated < -CREATED_ON_THE_WAY * solved.normal_load**2
    above_friction = bool((slope > solved.node_friction[solved.contact]).any())
    if (creates and above_friction) or not (slope <= STEEPEST).all():
        raise CoulombError(Ending.STEEP_PIN)


def _as_one(first: tuple[float, ...], then: tuple[float, ...]) -> tuple[float, ...]:
    """Two events at one displacement as one: the first one's trigger and force before, the sums of what happened."""
    old, new = Events(*first), Events(*then)  # type: ignore[arg-type]
    more = {name: getattr(old, name) + getattr(new, name) for name in ("dissipated", "slips", "releases", "touches")}
    return new._replace(force_before=old.force_before, kind=old.kind, node=old.node, **more)  # type: ignore[return-value]


# Slide the pin quasistatically from event to event (§2.1.1, §3.2): slip, release, touch -> FrictionRecord.


def slide(case: Case, compliance: Compliance, start: ContactState | None = None) -> FrictionRecord:
    """Slide the pin of `case` from initial contact (or from `start`) to its limits, event by event.

    The next event is the smallest step, at least the event floor, to |shear| = μ_i·pressure, pressure = 0 or gap = 0; then the
    worst offender until constraints I-III hold. Failures of the physics are the record's outcome.
    """
    return slide_to_state(case, compliance, start)[0]


def slide_to_state(
    case: Case, compliance: Compliance, start: ContactState | None = None
) -> tuple[FrictionRecord, ContactState]:
    """Like `slide`, and the contact as it is where the record ends."""
    return followed(case, compliance, start)[:2]


def followed(case: Case, compliance: Compliance, start: ContactState | None = None, way: Way | None = None) -> Run:
    """The run along a way from `start`: without one, the record of the case."""
    if not case.effects.friction:
        raise InvalidInput("friction", False, "the stage contact alone, there is nothing to slide against")
    start = initial_contact(case, compliance) if start is None else start
    if not start.outcome.ok:
        return _no_record(case, start, start)
    try:
        run = _method(case)(case, start, compliance, way or Way(case.normal_load))
    except (SingularOperator, TooFarApart) as error:
        run = _no_record(case, start, replace(start, outcome=error.outcome))
    end = checked(case, compliance, run.end)
    if end.outcome.ok and not (found := lawfulness(case, start, run.record, end, run.load_work)).ok:
        end = checked(case, compliance, replace(end, outcome=found))
    record = run.record
    record = record if end.outcome is record.outcome else replace(record, outcome=end.outcome)
    return run._replace(record=record, end=end)


def _no_record(case: Case, start: ContactState, end: ContactState) -> Run:
    """The record of a run without events."""
    slipped = SlippedNodes(start.first_node, np.zeros(case.slab.nodes, np.int64))
    return record_of(case, start, math.nan, empty_events(0), slipped, 0, end)


def _method(case: Case) -> Callable[[Case, ContactState, Compliance, Way], Run]:
    """Select one of the three ways to slide, by the case."""
    if not case.effects.pin_translation:
        return slide_with_constant_pressures
    return slide_with_coulomb_friction if case.slip_rule.residual_shear == 1.0 else slide_full_contact


def states_at(case: Case, compliance: Compliance, events: Sequence[int]) -> tuple[list[ContactState], Outcome]:
    """The contact after each of these events, as far as the record of `case` gets, and how that went.

    events: increasing numbers; 0 is initial contact. Of an interface it is the first contact, by itself.
    """
    case = replace(case, interface=Interface())
    state, done = initial_contact(case, compliance), 0
    states: list[ContactState] = []
    events = [event for event in events if event <= (case.max_events or event)]  # pieces know nothing of that limit
    if case.max_presliding is not None and any(events):  # nor of that one: their first contact is another
        reached = len(slide(case, compliance, state).displacement)
        case = replace(case, max_presliding=None, max_events=max(reached, 1))
        events = [event for event in events if event <= reached]
    for event in events:
        if event > done and state.outcome.ok:
            record, state = slide_to_state(replace(case, max_events=event - done), compliance, state)
            done += len(record.displacement)
        if done < event or not state.outcome.ok:
            break
        states.append(state)
    return states, state.outcome
