"""Stresses inside: a patch of uniform strain is met exactly, the surface agrees with what contact saw, rows carry the load."""

from typing import get_args

import numpy as np
import pytest

from nanoslip.solver.case import Case
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.elasticity.interior import gradient, interior_fields
from nanoslip.solver.slab import Slab, Support
from tests.synthetic import grid_of

CASE = Case(slab=Slab(n_x=65), radius=50.0)


def test_linear_fields_have_their_gradient() -> None:
    grid = grid_of(Slab(n_x=17, scheme="biquadratic"))
    x, z = grid.coordinates().T
    along, across = gradient(grid, 3.0 * x - 2.0 * z + 1.0)
    np.testing.assert_allclose(along, 3.0, atol=1e-13)
    np.testing.assert_allclose(across, -2.0, atol=1e-13)


def test_the_gradient_of_a_smooth_field_converges() -> None:
    """sin(3x)·e^(2z) on the two fine rows: second order in the spacing (rates of 3.7 and more seen for 4)."""
    errors = []
    for n_x in (33, 65, 129):
        grid = grid_of(Slab(n_x=n_x, scheme="biquadratic"))
        x, z = grid.coordinates().T
        _, across = gradient(grid, np.sin(3 * x) * np.exp(2 * z))
        exact = 2 * np.sin(3 * x) * np.exp(2 * z)
        errors.append(np.abs(across - exact)[:n_x].max())
    assert min(errors[0] / errors[1], errors[1] / errors[2]) > 3.5


def test_stress_under_the_pin_is_its_pressure_and_rows_carry_the_load() -> None:
    """The middle of the contact is smooth: 4 % of the pressure; the stencil does not conserve force, its rows carry the load to
    10 %."""
    state = initial_contact(CASE, surface_compliance(CASE.slab))
    inside = interior_fields(CASE.slab, state.nodal_force)
    assert inside.stress_zz[32] == pytest.approx(-state.pressure[32], rel=0.04)
    for z in np.unique(inside.z)[2:-1]:
        row = inside.z == z
        carried = -np.trapezoid(inside.stress_zz[row], inside.x[row])
        print(f"z = {z:.3f}: carries {carried / CASE.normal_load:.3f} of the load")
        assert carried == pytest.approx(CASE.normal_load, rel=0.1)


@pytest.mark.parametrize("support", get_args(Support))
@pytest.mark.parametrize("height", [1.0, 20.0, 1e4])
def test_the_surface_moves_as_contact_saw_it(height: float, support: Support) -> None:
    """Also a column's: two factorizations of one trunk, whose condition is 1e6, and the same rigid motions beside it."""
    slab = Slab(33, height, support=support)
    force = np.random.default_rng(3).standard_normal((2, 33))
    inside, moved = interior_fields(slab, force), surface_compliance(slab).matrix @ force.ravel()
    np.testing.assert_allclose(
        np.concatenate((inside.u[:33], inside.w[:33])), moved, rtol=0, atol=1e-9 * np.abs(moved).max()
    )


@pytest.mark.parametrize("height", [20.0, 1e4])
def test_deep_inside_a_column_is_a_bar(height: float) -> None:
    """Four widths from either end σ_zz = N + 12 M x, with the moment that the shear force has added on the way down, and
    σ_xx = 0: to parabolas through rows half a width apart, 1e-3 and 3e-3 seen, as in a slab ten widths high. The middle has
    no nodes."""
    nodes = np.linspace(-0.5, 0.5, 33)
    force = np.stack((np.exp(-3 * nodes), nodes**3 - 0.4)) / 33
    inside = interior_fields(Slab(33, height, 0.3), force)
    shear, axial, moment = force[0].sum(), force[1].sum(), nodes @ force[1]
    assert not ((inside.z < -6.0) & (inside.z > 6.0 - height)).any()
    for deep in ((inside.z < -3.5) & (inside.z > -4.5), (inside.z > 3.5 - height) & (inside.z < 4.5 - height)):
        x, z = inside.x[deep], inside.z[deep]
        expected = axial + 12 * (moment + shear * z) * x
        scale = np.abs(expected).max()
        assert deep.sum() >= 17
        np.testing.assert_allclose(inside.stress_zz[deep], expected, rtol=0, atol=2e-3 * scale)
        np.testing.assert_allclose(inside.stress_xx[deep], 0.0, rtol=0, atol=5e-3 * scale)


def test_with_next_to_nothing_let_in_a_column_is_its_trunk() -> None:
    """Both halves are then those of one field: to 4e-9 of its largest value, what Saint-Venant leaves half-way down."""
    force = np.zeros((2, 33))
    force[0], force[1, 20] = 0.01, -0.5
    plain, column = (interior_fields(Slab(33, height, 0.3), force) for height in (10.0, 10.0 + 1e-9))
    for name in ("u", "w", "stress_zz", "stress_xz", "stress_xx"):
        expected = getattr(plain, name)
        np.testing.assert_allclose(getattr(column, name), expected, rtol=0, atol=1e-8 * np.abs(expected).max())
