"""Slide with classical Coulomb friction, residual_shear 1: forces are continuous, roles of nodes change."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.contact import coulomb
from nanoslip.solver.contact.compiled_contact import empty_events
from nanoslip.solver.contact.kernels.events import STEEPEST
from nanoslip.solver.contact.kernels.path import Events
from nanoslip.solver.contact.kernels.state import EventKind, Stop
from nanoslip.solver.contact.pin import LONGEST_STEP, limit_over_pressure, node_limit
from nanoslip.solver.contact.soundness import OUTCOME_OF_STOP
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.contact.window import dropped_nodes
from nanoslip.solver.elasticity.compliance import Compliance
from nanoslip.solver.outcome import COMPLETED
from nanoslip.solver.progress import report_progress
from nanoslip.solver.sliding.record import off_the_slab, presliding_length
from nanoslip.solver.sliding.way import Run, SlippedNodes, Way, make_record_view

CREATED_ON_THE_WAY = 1e-4
"""Energy that an event may create at residual_shear 1, in W²/G: it is an integral over steps there, not exact to rounding."""


def slide_with_coulomb_friction(case: Case, start: ContactState, compliance: Compliance, way: Way) -> Run:
    """Follow the way from `start`.

    An event is a node that begins to slide, is released or touches; forces do not jump, but for the shear that a strength leaves
    a node which is released. The energy dissipated in sliding since the last event is counted at the event.
    """
    compliance = compliance if case.effects.coupling else compliance.decouple()
    run, outcome = CoulombRun(case, _contact_at_limit(case, start, compliance, way), way), COMPLETED
    try:
        run.follow()
        if math.isinf(way.end(case, run.presliding)) and run.solved.displacement >= off_the_slab(case):
            outcome = OUTCOME_OF_STOP[Stop.CONTACT_LOST]
    except coulomb.CoulombError as error:
        outcome = error.outcome
    end = coulomb.coulomb_state(run.solved, outcome)
    energies = (run.solved.load_work, run.dissipated)
    return make_record_view(
        case, start, compliance, run.initial_stiffness, run.events(), run.slipped, len(run.rows), end, *energies
    )


def _contact_at_limit(case: Case, start: ContactState, compliance: Compliance, way: Way) -> coulomb.CoulombContact:
    """The contact in this state; nodes at their limit of friction slide."""
    limits = node_limit(case, compliance.widths, -start.nodal_force[1], start.first_node)
    # A state does not hold roles: a node at its limit, but for rounding, was sliding.
    slides = np.abs(start.nodal_force[0]) >= limits * (1 - 1e-9)
    sliding = start.contact & slides
    sign = np.where(sliding, np.sign(start.nodal_force[0]), 0.0)
    place = (start.u.copy(), way.load, start.displacement, start.first_node)
    return coulomb.CoulombContact(case, compliance, start.contact.copy(), sign, *place, way.direction)


@dataclass(eq=False)
class CoulombRun:
    """A run in the making: the contact, and a row per event in the order of `Events`."""

    case: Case
    solved: coulomb.CoulombContact
    way: Way
    rows: list[tuple[float, ...]] = field(default_factory=list)
    initial_stiffness: float = math.nan
    presliding: float = math.nan
    """Presliding length in L_x."""
    dissipated: float = 0.0
    """Energy lost since the last event."""
    slipped: SlippedNodes = field(init=False)
    """Number of times that each node began to slide in an event of the record; in the last row, (n,)."""
    last_slips: NDArray[np.int64] = field(init=False)

    def __post_init__(self) -> None:
        self.last_slips = np.zeros(self.case.slab.nodes, np.int64)
        self.slipped = SlippedNodes(self.solved.first_node, self.last_slips.copy())

    def _remaining_way(self) -> float:
        """Length of the way that is left."""
        solved, (pin_rate, load_rate, _) = self.solved, self.way.direction
        if not pin_rate:
            return (self.way.until - solved.normal_load) * load_rate
        end = min(self.way.end(self.case, self.presliding) * pin_rate, off_the_slab(self.case))
        return end - solved.displacement * pin_rate

    def _longest(self) -> float:
        """The longest step: LONGEST_STEP, or what load shifts the edges of a parabola's contact by as much: a² ~ W."""
        if self.way.direction.pin_rate:
            return LONGEST_STEP * self.case.slab.spacing
        # da = ½ a dW/W, and a is half as many spacings as nodes in contact.
        return 4.0 * LONGEST_STEP / int(self.solved.contact.sum()) * self.solved.normal_load

    def follow(self) -> None:
        """Step from change of roles to change of roles. Raises CoulombError if the contact has no solution."""
        case, solved = self.case, self.solved
        rates = coulomb.stick_and_slide_in_motion(solved)
        self.initial_stiffness = self.way.stiffness(float(rates[0][0].sum()))
        self.presliding = presliding_length(coulomb.limit_of_all(solved), self.initial_stiffness)
        while len(self.rows) < (case.max_events or math.inf) and (way_left := self._remaining_way()) > 0.0:
            share_of_events = len(self.rows) / (case.max_events or math.inf)
            report_progress(max(solved.gone / (solved.gone + way_left), share_of_events))
            step, kind, node = coulomb.next_change(solved, rates)
            # Rates hold until a role changes, and on a curved pin only so long: then they are computed anew.
            longest = min(self._longest(), way_left)
            self.dissipated += coulomb.advance(solved, min(step, longest), rates)
            before = float(solved.force[0].sum())
            touching, slips = solved.contact.copy(), solved.node_slips.copy()
            self.dissipated += coulomb.change(solved, kind if step <= longest else EventKind.NOTHING, node)
            rates = coulomb.stick_and_slide_in_motion(solved)
            if step <= longest:
                _refuse_flanks(solved, self.dissipated)
                changes = ((touching & ~solved.contact).sum(), (solved.contact & ~touching).sum())
                stiffness = float(rates[0][0].sum()) * solved.direction.pin_rate
                self._add((kind, node, before, stiffness), solved.node_slips - slips, changes)
            if nodes := dropped_nodes(case, solved.contact, solved.contact, self.way.direction.pin_rate):
                solved.move_grid(nodes)
                rates, self.last_slips = solved.rates(), np.roll(self.last_slips, -nodes)

    def _add(
        self, event: tuple[EventKind, int, float, float], slips: NDArray[np.int64], changes: tuple[int, int]
    ) -> None:
        """The row of an event: its kind, node, force before and stiffness after; slips of each node (n,); releases, touches."""
        solved, (kind, node, before, stiffness) = self.solved, event
        of_grid = self.slipped.grid_slips(solved.first_node, len(slips))
        of_grid += slips
        forces = (solved.displacement, before, float(solved.force[0].sum()), stiffness)
        again = bool(self.rows) and self.rows[-1][0] == solved.displacement
        self.last_slips = self.last_slips + slips if again else slips
        in_contact = int(solved.contact.sum())
        sizes = (in_contact, int(np.count_nonzero(self.last_slips)))
        what = (kind, solved.first_node + node, int(slips.sum()), *changes)
        row: tuple[float, ...] = (*forces, self.dissipated, *what, *sizes, solved.normal_load)
        self.rows.append(_as_one(self.rows.pop(), row) if again else row)
        self.dissipated = 0.0

    def events(self) -> Events:
        """The rows as columns."""
        events = empty_events(len(self.rows))
        for name, column in zip(Events._fields, zip(*self.rows, strict=True), strict=False):
            getattr(events, name)[:] = column
        return events


def _refuse_flanks(solved: coulomb.CoulombContact, dissipated: float) -> None:
    """Raises CoulombError if a node is on a flank above 45°, or on one above its limit over its pressure in an event that creates
    energy."""
    slope = np.abs(solved.pin.slope(solved.xi))[solved.contact]
    creates = dissipated < -CREATED_ON_THE_WAY * solved.normal_load**2
    pressure = solved.normal_force / solved.compliance.widths
    limit = limit_over_pressure(solved.case, pressure, solved.first_node)
    above_friction = bool((slope > limit[solved.contact]).any())
    if (creates and above_friction) or not (slope <= STEEPEST).all():
        raise coulomb.CoulombError(Stop.STEEP)


def _as_one(first: tuple[float, ...], then: tuple[float, ...]) -> tuple[float, ...]:
    """Two events at one displacement as one: the first one's trigger and force before, the sums of what happened."""
    old, new = Events(*first), Events(*then)  # type: ignore[arg-type]
    more = {name: getattr(old, name) + getattr(new, name) for name in ("dissipated", "slips", "releases", "touches")}
    return new._replace(force_before=old.force_before, kind=old.kind, node=old.node, **more)  # type: ignore[return-value]
