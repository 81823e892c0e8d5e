"""Energies of elliptic tangential and normal loads, a = 0.27 L_x, against an independent finite slab.

Bonded to its base the slab's corners are singular, displacements as r^λ (Williams 1952, clamped and free edge at a right
angle); a mesh of spacing h has an energy off by h^(2λ). Without the corner, the base frictionless, that error is gone.
"""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.elasticity.schemes import Galerkin
from nanoslip.solver.slab import Slab, Support
from nanoslip.study.accuracy.elastic_operator import nodal_forces
from tests.synthetic import grid_of
from tests.verification.finite_slab import elliptic_energies
from tests.verification.seen import listed, observed_order, seen

HALF_WIDTH = 0.27
SOURCE = "quadratic finite elements, scikit-fem"
PAST_A_THIRD = 0.49


def energies(slab: Slab) -> NDArray[np.float64]:
    """As `elliptic_energies`, on our slab."""
    compliance = surface_compliance(slab)
    n, force = slab.n_x, nodal_forces(compliance.x, HALF_WIDTH)
    return np.array([force @ block @ force for block in (compliance.matrix[:n, :n], compliance.matrix[n:, n:])])


def errors(slab: Slab) -> NDArray[np.float64]:
    return energies(slab) / elliptic_energies(HALF_WIDTH, slab.poisson, slab.aspect_ratio, slab.support) - 1


@pytest.mark.slow
@pytest.mark.parametrize("support", ["bonded", "frictionless"])
def test_the_reference_has_converged(support: Support) -> None:
    """Where it is worst: ν = 0.49; 1.4e-4 and less between these meshes, 4e-5 from one of half the elements' size."""
    coarse, fine = (
        elliptic_energies(HALF_WIDTH, PAST_A_THIRD, 1.0, support, smallest, growth)
        for smallest, growth in ((1e-3, 2.0), (2e-4, 1.7))
    )
    np.testing.assert_allclose(coarse[1], fine[1], rtol=2e-4)
    if support == "bonded":
        np.testing.assert_allclose(coarse, fine, rtol=2e-4)


@pytest.mark.parametrize("poisson", [0.0, 1 / 3, PAST_A_THIRD])
@pytest.mark.parametrize("aspect_ratio", [0.25, 1.0, pytest.param(4.0, marks=pytest.mark.slow)])
def test_the_default_grid_is_right_to_a_thousandth(aspect_ratio: float, poisson: float) -> None:
    """At ν = 0.49 and height 1 the corner leaves 0.13 %, although the bottom row is as fine as the surface: hence 0.0015."""
    slab = Slab(129, aspect_ratio, poisson)
    off, nodes = errors(slab), grid_of(slab).nodes / slab.n_x
    line = seen(
        f"elliptic loads, a = 0.27 L_x, height {aspect_ratio}, ν = {poisson:.2f}, n_x = 129", SOURCE,
        f"tangential off by {listed(off[:1])}, normal {listed(off[1:])}; {nodes:.1f} nodes per surface node",
    )  # fmt: skip
    assert np.abs(off).max() <= (0.0015 if poisson == PAST_A_THIRD and aspect_ratio == 1.0 else 0.001), line
    assert nodes <= 11, line


@pytest.mark.parametrize("poisson", [1 / 3, PAST_A_THIRD, 0.4999])
def test_without_a_singular_corner_poisson_does_not_matter(poisson: float) -> None:
    """No locking: 2e-4 and less for all ν, ten times less than with the corner at 0.49."""
    off = errors(Slab(129, 1.0, poisson, "frictionless"))[1]
    line = seen(
        f"elliptic pressure, frictionless base, ν = {poisson:.4f}, n_x = 129", SOURCE, f"normal off by {listed([off])}"
    )
    assert abs(off) <= 3e-4, line


def corner_exponent(poisson: float) -> float:
    """λ of displacements r^λ in a right angle of a clamped and a free edge: 4κ sin²(λπ/2) = (κ + 1)² - 4λ², κ = 3 - 4ν."""
    kappa = 3 - 4 * poisson
    return float(brentq(lambda x: 4 * kappa * np.sin(x * np.pi / 2) ** 2 - (kappa + 1) ** 2 + 4 * x**2, 0.4, 0.999))


@pytest.mark.parametrize("poisson", [1 / 3, PAST_A_THIRD])
def test_what_is_left_is_the_corners(poisson: float) -> None:
    """With the bottom row alone refined the shear's energy closes in at the corner's order, 2λ = 1.38 and 1.20."""
    rows = (33, 65, 129)
    off = [errors(Slab(129, 1.0, poisson, scheme=Galerkin(bottom_row=row)))[0] for row in rows]
    order, expected = observed_order([1 / (row - 1) for row in rows], off), 2 * corner_exponent(poisson)
    line = seen(
        f"elliptic shear, height 1, n_x = 129, ν = {poisson:.2f}", SOURCE,
        f"bottom_row = {rows}: off by {listed(off)}, order {order:.2f}, the corner's {expected:.2f}",
    )  # fmt: skip
    assert order == pytest.approx(expected, abs=0.3), line
