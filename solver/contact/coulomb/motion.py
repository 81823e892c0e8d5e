"""Motion of pin or load up to the next change of a node's role: its distance, and the step. Forces are continuous."""

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.contact.coulomb.contact import CoulombContact, CoulombError, Rates, Vector
from nanoslip.solver.contact.coulomb.roles import resolve_violations, stick_and_slide_in_motion
from nanoslip.solver.contact.kernels.enumerations import EventKind
from nanoslip.solver.contact.kernels.violations import TIE
from nanoslip.solver.outcome import Ending

LONGEST_STEP = 0.05
"""Longest step in node spacings: the pin's slope under a sliding node changes by as much of a node's."""
PROGRESS = 1e-6
"""Motion in node spacings, or growth of the load as a share of it, that counts as progress."""
PATIENCE = 20
"""Steps per node without progress after which no motion is found consistent."""


def raise_load_of_sliding(solved: CoulombContact, target: float) -> None:
    """Raise the load to `target`, the pin held."""
    while solved.normal_load < target:
        rates = stick_and_slide_in_motion(solved, 0.0)
        step, kind, node = next_change(solved, rates, 0.0)
        # The contact grows from one node to many: steps keep to the load's own size.
        longest = min(solved.normal_load, target - solved.normal_load)
        advance(solved, min(step, longest), rates, 0.0)
        change(solved, kind if step <= longest else EventKind.NOTHING, node)


def change(solved: CoulombContact, kind: EventKind, node: int) -> None:
    """Answer an event (none where `kind` is NOTHING) and all that follows from it at once."""
    if kind != EventKind.NOTHING:
        answers = {EventKind.SLIP: solved.let_slide, EventKind.RELEASE: solved.release, EventKind.TOUCH: solved.touch}
        answers[kind](node)
    resolve_violations(solved)


def next_change(solved: CoulombContact, rates: Rates, pin_rate: float) -> tuple[float, EventKind, int]:
    """Step after which a role changes, how, and whose; infinite where none does. The gap is taken as linear."""
    force_rate, _, u_rate, v_rate = rates
    mu, stick = solved.node_friction, solved.contact & (solved.sliding == 0.0)
    steps = {EventKind.RELEASE: _time(solved.normal_force, force_rate[1], solved.contact)}
    for sign in (1.0, -1.0):
        room = mu * solved.normal_force - sign * solved.force[0]
        until = _time(room, sign * force_rate[0] + mu * force_rate[1], stick)
        steps[EventKind.SLIP] = np.minimum(steps.get(EventKind.SLIP, until), until)
    closing = v_rate - solved.pin.curvature * solved.xi * (u_rate - pin_rate)
    steps[EventKind.TOUCH] = _time(solved.gap, closing, ~solved.contact & np.isfinite(solved.gap))
    kind = min(steps, key=lambda each: float(steps[each].min()))
    step = float(steps[kind].min())
    # Of ties the node further right, as in `next_event`.
    return step, kind, int(np.flatnonzero(steps[kind] <= step * (1.0 + TIE))[-1])


def advance(solved: CoulombContact, step: float, rates: Rates, pin_rate: float) -> float:
    """Move the pin (pin_rate = 1) or raise the load (pin_rate = 0) by `step`; returns the energy dissipated."""
    solved.stalled += 1
    progress = PROGRESS * (solved.case.slab.spacing if pin_rate else solved.normal_load)
    if solved.displacement + solved.normal_load > solved.mark + progress:
        solved.mark, solved.stalled = solved.displacement + solved.normal_load, 0
    if solved.stalled > PATIENCE * len(solved.u):
        # A node that touches is pulled off at once, and closes in at once when free: no motion is consistent.
        raise CoulombError(Ending.SLIP_UNBOUNDED)
    before, slip, height = solved.force, solved.u - solved.displacement, solved.v
    moved = np.where(solved.contact & (solved.sliding == 0.0), pin_rate, rates[2])
    solved.u = solved.u + step * moved
    solved.displacement += pin_rate * step
    solved.normal_load += (1.0 - pin_rate) * step
    solved.solve()
    mean = (before + solved.force) / 2
    return float(-(mean[0] @ (solved.u - solved.displacement - slip) + mean[1] @ (solved.v - height)))


def _time(room: Vector, rate: Vector, which: NDArray[np.bool_]) -> Vector:
    """Step after which a falling margin is used up, where it applies; infinite elsewhere."""
    falling = which & (rate > 0.0)
    return np.where(falling, np.maximum(room, 0.0) / np.where(falling, rate, 1.0), np.inf)
