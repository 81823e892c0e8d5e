"""The laws every contact state obeys, checked from the compliance alone; and a reciprocal operator to check energies with."""

import math

import numpy as np
import scipy.linalg as la

from solver.case import Case, Slab
from solver.compliance import SurfaceCompliance
from solver.contact import ContactState
from solver.pin import pin_of


def assert_contact_laws(state: ContactState, case: Case, compliance: SurfaceCompliance) -> None:
    """Equilibrium, ΣN = W, constraints I-III and complementarity; tolerances in loads (forces) and load/G (lengths)."""
    n, load = case.slab.n_x, case.load
    force = state.nodal_force.ravel()
    displacement = np.concatenate((state.u, state.w))
    # The state's displacements are those the compliance gives for its forces: 1e-10 of the load is the promise.
    np.testing.assert_allclose(compliance.matrix @ force, displacement, atol=1e-10 * load)
    assert abs(state.normal_force - load) <= 1e-10 * load
    normal, shear = -state.nodal_force[1], np.abs(state.nodal_force[0])
    assert normal.min() >= -1e-11 * load
    assert np.all(force.reshape(2, n)[:, ~state.contact] == 0.0)
    if math.isfinite(case.intrinsic_friction):
        assert np.all(shear <= case.intrinsic_friction * normal + 1e-11 * load)
    assert state.gap.min() >= -1e-11 * load
    assert np.all(state.gap[state.contact] == 0.0)
    xi = compliance.x + state.u - state.displacement
    height = pin_of(case).height(np.where(state.contact, xi, 0.0)) - state.approach
    np.testing.assert_allclose(state.w[state.contact], height[state.contact], atol=1e-11 * load)


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
