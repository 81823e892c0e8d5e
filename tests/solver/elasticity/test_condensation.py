"""The slab's stiffness is condensed to its surface exactly, by parts and by halves of one parity."""

import numpy as np
import pytest

from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.elasticity.condensation import eliminate, eliminate_definite
from nanoslip.solver.elasticity.schemes.biquadratic import Biquadratic
from nanoslip.solver.elasticity.schemes.galerkin import Galerkin
from nanoslip.solver.outcome import SingularOperator
from nanoslip.solver.slab import Slab, Support
from tests.benchmarks.compliance import sparse_compliance
from tests.solver.elasticity.exact_stencil import exact_compliance

# The compliance of the surface has right digits whatever the slab's shape, or is refused.

HIGH, NARROW = 1e4, 0.4999
"""Cells 20 000 times as high as wide, ten thousand times as hard to press together as to shear."""


@pytest.mark.everyday(1)
@pytest.mark.parametrize(
    ("support", "height", "poisson"),
    [("bonded", 1.0, 1 / 3), ("bonded", 1e3, NARROW), ("frictionless", 30.0, NARROW), ("right_side", HIGH, NARROW)],
)
def test_the_stencils_compliance_is_that_of_exact_arithmetic_or_refused(
    support: Support, height: float, poisson: float
) -> None:
    """High cells resist a row's motion as a whole by a small difference of large forces: at worst all of it is rounding."""
    slab = Slab(9, height, poisson, support, scheme="biquadratic")
    try:
        found = surface_compliance(slab).matrix
    except SingularOperator:
        assert height == HIGH or (height == 1e3 and poisson == NARROW)
        return
    expected = exact_compliance(slab)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-4 * np.abs(expected).max())


@pytest.mark.parametrize("poisson", [0.5 - 1e-10, 0.4999999])
def test_a_body_too_nearly_incompressible_is_refused_by_name(poisson: float) -> None:
    """A column is bent by a difference of pressures 1/(1-2ν) as large: at 0.5 - 1e-10 a tenth of its sway was rounding."""
    slab = Slab(33, 10.0, poisson, scheme=Galerkin(rows_per_level=1))
    with pytest.raises(SingularOperator, match="poisson"):
        surface_compliance(slab)


@pytest.mark.parametrize("scheme", ["galerkin", "biquadratic"])
@pytest.mark.parametrize("poisson", [-0.999999, 0.4999])
@pytest.mark.parametrize("height", [1e-4, 1.0, 10.0])
def test_every_other_poissons_ratio_is_computed(height: float, poisson: float, scheme: str) -> None:
    assert np.isfinite(surface_compliance(Slab(33, height, poisson, scheme=scheme)).matrix).all()


# Nested dissection gives the block of the inverse that a dense inverse has, however the fields lie and couple.


@pytest.mark.parametrize(
    "slab",
    [
        Slab(65),
        Slab(65, 0.01),
        Slab(65, support="right_side"),
        Slab(65, support="frictionless", poisson=0.0),
        Slab(65, 3.0, scheme="biquadratic"),
        Slab(33, scheme=Biquadratic(first_spacing="doubling")),
        Slab(17, scheme=Galerkin(rows_per_level=64, coarsest_row=5)),
    ],
    ids=lambda slab: f"{slab.n_x}-{slab.aspect_ratio}-{slab.support}-{slab.scheme}",
)
def test_a_slab_has_the_compliance_that_its_whole_stiffness_has(slab: Slab) -> None:
    expected = sparse_compliance(slab)
    # 3e-13 seen, the rounding of either way.
    np.testing.assert_allclose(surface_compliance(slab).matrix, expected, atol=2e-12 * np.abs(expected).max())


@pytest.mark.parametrize("pivot", [0.0, 1e-17, -1.0], ids=["none", "rounding alone", "negative"])
def test_what_no_spring_holds_is_refused_by_name(pivot: float) -> None:
    stiffness = np.diag([1.0, 1.0, pivot, 1.0])
    with pytest.raises(SingularOperator, match="singular"):
        eliminate_definite(stiffness, 3, np.ones((2, 4)))
    if pivot >= 0.0:
        with pytest.raises(SingularOperator, match="singular"):
            eliminate(stiffness, 3, np.ones((2, 4)), np.ones((4, 2)))
