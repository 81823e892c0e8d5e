"""What a reader would write first: a record by dense solves slip by slip, a drive by scipy's solve_ivp; both give our numbers."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from nanoslip import Case, ContactState, Effects, Slab, contact_state, surface_compliance
from nanoslip.solver.elasticity.compliance import Compliance
from nanoslip.solver.sliding.slide import slide
from tests.benchmarks.table import Row, best, timed, verdict, versus
from tests.physics import smallest_step
from tests.solver.drives import SMALL_TEETH, reference

CASE: Final = Case(
    intrinsic_friction=0.5,
    radius=200.0,
    slab=Slab(n_x=129),
    effects=Effects(coupling=False, pin_translation=False),
    max_events=100,
)
"""Of constant pressures: they stay as at initial contact, so that shear alone is solved for."""
TIE: Final = 1e-9
"""Share of the limit within which two nodes slip at once."""


def _last(these: NDArray[np.bool_]) -> int:
    """The node furthest ahead: of those that slip at once it is the first."""
    return int(np.flatnonzero(these)[-1])


def record_by_solving(case: Case, compliance: Compliance, start: ContactState) -> float:
    """Spring force at the end of a record of frozen pressures: all forces from all displacements, anew for every slip."""
    (nodes,) = np.nonzero(start.contact)
    matrix = compliance.entries(nodes, nodes)
    shear, limit = start.nodal_force[0, nodes], case.intrinsic_friction * np.abs(start.nodal_force[1, nodes])
    u, per_step = matrix @ shear, np.linalg.solve(matrix, np.ones(len(nodes)))
    least = smallest_step(case, float(per_step.sum()))
    for _ in range(case.max_events or 0):
        steps = (np.copysign(limit, per_step) - shear) / per_step
        node = _last(steps <= steps.min() * (1.0 + TIE))
        u, offends = u + max(steps[node], least), True
        while offends:
            shear = np.linalg.solve(matrix, u)
            own = np.linalg.solve(matrix, np.eye(len(nodes))[node])[node]
            u[node] -= (shear[node] - np.copysign(case.slip_rule.residual_shear * limit[node], shear[node])) / own
            shear = np.linalg.solve(matrix, u)
            ratio = np.abs(shear) / limit
            node, offends = _last(ratio >= ratio.max() * (1.0 - TIE)), bool(ratio.max() > 1.0 + TIE)
    return float(shear.sum())


def rows() -> list[Row]:
    """Ours over theirs, which come to the same end."""
    compliance = surface_compliance(CASE.slab)
    start = contact_state(CASE, compliance)
    record, (force, dense) = slide(CASE, compliance, start), timed(lambda: record_by_solving(CASE, compliance, start))
    ours = best(lambda: slide(CASE, compliance, start), repeats=20)
    end = SMALL_TEETH.driven()
    (position, *_), stepped = timed(lambda: reference(SMALL_TEETH, SMALL_TEETH.duration))
    driven = best(SMALL_TEETH.driven, repeats=20)
    slips = f"{record.slips.sum()} slips of {start.contact.sum()} nodes with constant pressures"
    return [
        _row(slips, ours, dense, "dense solves for each slip", abs(record.final_force / force - 1.0)),
        _row(
            f"drive of {end.steps} segments",
            driven,
            stepped,
            "scipy's solve_ivp",
            abs(end.position[-1] / position - 1.0),
        ),
    ]


def _row(what: str, ours: float, peer: float, name: str, off: float) -> Row:
    return versus(what, ours, peer, name, verdict("same end to 1e-9", off <= 1e-9), ratio=f"1/{peer / ours:.0f}")
