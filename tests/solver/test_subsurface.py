"""Stresses inside: a patch of uniform strain is met exactly, the surface agrees with what contact saw, rows carry the load."""

import numpy as np
import pytest

from solver.case import Case, Slab
from solver.compliance import slab_compliance
from solver.contact import first_touch
from solver.grid import binary_hierarchy
from solver.subsurface import gradient, interior_fields

CASE = Case(slab=Slab(n_x=65), radius=50.0)


def test_linear_fields_have_their_gradient() -> None:
    grid = binary_hierarchy(Slab(n_x=17, scheme="biquadratic"))
    x, z = grid.coordinates().T
    along, across = gradient(grid, 3.0 * x - 2.0 * z + 1.0)
    np.testing.assert_allclose(along, 3.0, atol=1e-13)
    np.testing.assert_allclose(across, -2.0, atol=1e-13)


def test_the_gradient_of_a_smooth_field_converges() -> None:
    """sin(3x)·e^(2z) on the two fine rows: second order in the spacing (rates of 3.7 and more seen for 4)."""
    errors = []
    for n_x in (33, 65, 129):
        grid = binary_hierarchy(Slab(n_x=n_x, scheme="biquadratic"))
        x, z = grid.coordinates().T
        _, across = gradient(grid, np.sin(3 * x) * np.exp(2 * z))
        exact = 2 * np.sin(3 * x) * np.exp(2 * z)
        errors.append(np.abs(across - exact)[:n_x].max())
    assert min(errors[0] / errors[1], errors[1] / errors[2]) > 3.5


def test_the_surface_moves_as_contact_saw_it() -> None:
    """The same stiffness condensed and solved whole: 1e-10 of the load, as for every state."""
    compliance = slab_compliance(CASE.slab)
    state = first_touch(CASE, compliance)
    inside = interior_fields(CASE.slab, state.nodal_force)
    surface = slice(0, 65)
    np.testing.assert_allclose(inside.u[surface], state.u, atol=1e-10 * CASE.load)
    np.testing.assert_allclose(inside.w[surface], state.w, atol=1e-10 * CASE.load)
    np.testing.assert_array_equal(inside.x[surface], compliance.x)


def test_stress_under_the_pin_is_its_pressure_and_rows_carry_the_load() -> None:
    """The middle of the contact is smooth: 4 % of the pressure; the stencil does not conserve force, its rows carry the load to
    10 %."""
    state = first_touch(CASE, slab_compliance(CASE.slab))
    inside = interior_fields(CASE.slab, state.nodal_force)
    assert inside.stress_zz[32] == pytest.approx(-state.pressure[32], rel=0.04)
    for z in np.unique(inside.z)[2:-1]:
        row = inside.z == z
        carried = -np.trapezoid(inside.stress_zz[row], inside.x[row])
        print(f"z = {z:.3f}: carries {carried / CASE.load:.3f} of the load")
        assert carried == pytest.approx(CASE.load, rel=0.1)
