"""The laws every contact state obeys, checked from the compliance alone; and a reciprocal operator to check energies with."""

import math
from typing import NamedTuple

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.contact.pin import make_pin, node_limit, surface_from_pin
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.elasticity.compliance import Compliance, SurfaceCompliance
from nanoslip.solver.layout import Row
from nanoslip.solver.slab import SCHEMES, Slab
from nanoslip.solver.sliding.record import FrictionRecord

ROWS = tuple(name for name, kind in SCHEMES.items() if kind.LAYOUT is Row)
"""Schemes of plane strain; a plane of nodes has hard cases of its own (tests/solver/test_half_space.py)."""

LIMITS = {
    "equilibrium": 1e-10,
    "load": 1e-10,
    "tension": 1e-11,
    "shear": 1e-11,
    "penetration": 1e-10,
    "pin": 1e-11,
    "complementarity": 1e-11,
}
"""What `law_errors` may reach."""
ROUNDING = 8.0 * np.finfo(float).eps
"""Share of a pin's height that is lost to rounding."""
CARRIED = 64.0 * np.finfo(float).eps
"""The same of approach and δ_p where forces and displacements follow from them: rounded at every step, 34 ε seen in 60 events."""


def law_errors(state: ContactState, case: Case, compliance: Compliance) -> dict[str, float]:
    """How far the state is from every law, as a share of the load (forces) or of what the load displaces (lengths).

    equilibrium: displacements are those the compliance gives for the forces; load: ΣN = W; tension: pressure ≥ 0;
    shear: limited shear ≤ its limit; penetration: gap ≥ 0; pin: nodes in contact lie on it; complementarity: gap·pressure = 0.
    Infinite where a value is not finite.
    """
    values = (state.nodal_force, state.u, state.w, state.pressure, state.shear, state.slip, state.gap[state.contact])
    if not (all(np.isfinite(value).all() for value in values) and math.isfinite(state.approach)):
        return dict.fromkeys(LIMITS, math.inf)
    normal_load, force, inside = case.normal_load, state.nodal_force.ravel(), state.contact
    displacement = np.concatenate((state.u, state.w))
    normal, shear = -state.nodal_force[1], limited_shear(state.nodal_force[0], case)
    # Rounding of heights cannot be told from gaps; where a node is far out on a sharp pin that is more than the load moves.
    height = make_pin(case).height(surface_from_pin(case, state.first_node) + state.u - state.displacement)
    blur = np.where(np.isfinite(height), ROUNDING * np.abs(height), 0.0)
    off = np.maximum(np.abs(state.w + state.approach - height) - blur, 0.0)[inside]
    below = np.maximum(-state.gap - blur, 0.0)
    finite_gap = np.where(np.isfinite(state.gap), state.gap, 0.0)
    limited = math.isfinite(case.intrinsic_friction)
    limit = node_limit(case, compliance.widths, normal, state.first_node) if limited else np.full(len(normal), np.inf)
    # The limit itself is known to rounding of μ_i·pressure and of the strength.
    largest = float(limit[inside].max(initial=0.0)) if limited else normal_load
    borne = max(normal_load * max(case.intrinsic_friction, 1.0), largest)
    pressed = force.nonzero()[0]  # on a large plane of nodes only these columns fit in memory
    columns = compliance.entries(np.arange(len(force)), pressed)
    moved = float((np.abs(columns) @ np.abs(force[pressed])).max())
    stray = float(np.abs(state.nodal_force[:, ~inside]).max(initial=0.0))
    # Forces follow from heights less approach and from displacements along with the pin, whose rounding they carry.
    haze = CARRIED * max(abs(state.approach), abs(state.displacement))
    # They follow by an inverse: rounding of its entries, ε each, comes back through the compliance. Beneath two nodes on a
    # pillar that bends, 72 high and 1 wide, shear's rows differ in the eighth digit: 2e-10 of what moves.
    stiffness = np.abs(np.linalg.inv(columns[pressed]))
    turned = np.finfo(float).eps * np.abs(columns) @ (stiffness @ np.abs(displacement[pressed]))
    astray = np.abs(columns @ force[pressed] - displacement) - turned
    return {
        "equilibrium": float(np.maximum(astray - haze, 0.0).max()) / moved,
        "load": abs(state.normal_force - normal_load) / normal_load,
        "tension": max(float(-normal.min()) - haze, stray, 0.0) / normal_load,
        "shear": max(float(np.max((shear - limit)[inside], initial=0.0)) - haze, 0.0) / borne,
        "penetration": float(below.max()) / moved,
        "pin": float(off.max(initial=0.0)) / moved,
        "complementarity": float(np.abs(finite_gap * normal).max()) / (normal_load * moved),
    }


def limited_shear(shear: NDArray[np.float64], case: Case) -> NDArray[np.float64]:
    """What the case's friction law limits of shear (any shape): its size, or what of it is along the drag."""
    return np.abs(shear) if case.slip_rule.limited_shear == "both_ways" else shear


def assert_contact_laws(state: ContactState, case: Case, compliance: Compliance) -> None:
    """Equilibrium, ΣN = W, constraints I-III and complementarity, within LIMITS."""
    errors = law_errors(state, case, compliance)
    broken = {law: error for law, error in errors.items() if not error <= LIMITS[law]}
    assert not broken, broken


def assert_friction_law(case: Case, record: FrictionRecord, compliance: Compliance) -> None:
    """What is limited of F is at most the sum of all limits at the record's start and before and after every event.

    But for the share of it that a smallest step may push nodes beyond their limit (1e-4), and rounding; of nodes with different
    limits, the largest times the most nodes in contact.

    Forces carry the rounding of the heights that nodes in contact have on the pin, stiffened by the slab.
    """
    if math.isinf(case.intrinsic_friction):
        return
    most_nodes = max(record.contact_size.max(initial=1), record.initial_contact_size)
    strengths = node_limit(case, compliance.widths, np.zeros(case.slab.nodes))
    most = float(node_limit(case, 0.0, np.full(case.slab.nodes, case.normal_load)).max()) + most_nodes * strengths.max()
    forces = np.concatenate((record.force_before, record.force_after, [record.initial_force]))
    pin, reach = make_pin(case), case.slab.spacing * most_nodes
    highest = pin.curvature * reach**2 / 2 + float(np.abs(pin.rises).max())
    ones = compliance.window(np.arange(case.slab.n_x))  # all nodes of a row; on a plane all are alike
    rounding = ROUNDING * highest / float(np.abs(np.diag(ones)).max())
    assert limited_shear(forces, case).max(initial=0.0) <= most * (1.0 + 1e-4) + 1e-10 * case.normal_load + rounding


def half_plane(slab: Slab, depth: float = math.e**2) -> SurfaceCompliance:
    """A reciprocal operator without coupling: the half-plane's u and w under uniform tractions on one node's width,
    -(1 - ν)/π ln|x| per unit force, measured against a point `depth` away."""
    h, distance = slab.spacing, np.arange(slab.n_x) * slab.spacing

    def primitive(t: np.ndarray) -> np.ndarray:
        return t * np.log(np.abs(t)) - t

    column = (
        -(1 - slab.poisson)
        / np.pi
        * ((primitive(distance + h / 2) - primitive(distance - h / 2)) / h - math.log(depth))
    )
    block, none = la.toeplitz(column), np.zeros((slab.n_x, slab.n_x))
    return SurfaceCompliance(np.block([[block, none], [none, block]]), slab)


def coupled_half_plane(slab: Slab) -> SurfaceCompliance:
    """The same with the half-plane's coupling (1 - 2ν)/4·sign(x): still reciprocal."""
    plain = half_plane(slab).matrix.copy()
    n, nodes = slab.n_x, np.arange(slab.n_x)
    coupling = (1 - 2 * slab.poisson) / 4 * np.sign(nodes[:, None] - nodes[None, :])
    plain[n:, :n] = -coupling
    plain[:n, n:] = coupling
    return SurfaceCompliance(plain, slab)


def stored_energy(state: ContactState) -> float:
    """½ f·d, in G·L_x²·L_y."""
    return 0.5 * float(state.nodal_force.ravel() @ np.concatenate((state.u, state.w)))


class Energy(NamedTuple):
    """Of a stretch of record, in G·L_x²·L_y."""

    work: float
    """Done by the pin: between events all nodes stick to it, and forces are straight, so that the mean of both ends is exact."""
    kept: float
    """Gained by the slab, less what the load has done."""
    lost: float
    largest: float
    """The pin's work if all of it had one sign, or what is kept if that is more."""
    rounding: float
    """Of `kept`, the difference of much larger energies."""

    @property
    def missing(self) -> float:
        """Work that is neither kept nor lost, beyond rounding, as a share."""
        return max(abs(self.work - self.kept - self.lost) - self.rounding, 0.0) / self.largest


def energy(case: Case, start: ContactState, record: FrictionRecord, end: ContactState) -> Energy:
    """The balance of a record that begins and ends with these states."""
    steps = np.diff(record.displacement, prepend=start.displacement, append=record.final_displacement)
    before = np.append(record.force_before, record.final_force)
    after = np.append(record.initial_force, record.force_after)
    kept = stored_energy(end) - stored_energy(start) - case.normal_load * (end.approach - start.approach)
    largest = max(float((np.abs(before) + np.abs(after)) @ steps) / 2, abs(kept))
    rounding = CARRIED * (stored_energy(end) + case.normal_load * abs(end.approach))
    return Energy(float((before + after) @ steps) / 2, kept, float(record.dissipated.sum()), largest, rounding)


def smallest_step(case: Case, stiffness: float) -> float:
    """The event floor in L_x: in node spacings, or in 24 times what μ_i·W stretches the contact by if that is less (no strength).
    stiffness: of all nodes in contact, shear and μ_i·pressure added up without sign."""
    return case.slip_rule.event_floor * min(
        case.slab.spacing, 24.0 * case.intrinsic_friction * case.normal_load / stiffness
    )
