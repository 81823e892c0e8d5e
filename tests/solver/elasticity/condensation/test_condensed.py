"""The compliance of the surface has right digits whatever the slab's shape, or is refused."""

import numpy as np
import pytest

from nanoslip.solver.case import Case
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.elasticity.schemes.galerkin import Galerkin
from nanoslip.solver.outcome import Ending, SingularOperator
from nanoslip.solver.simulate import contact_state
from nanoslip.solver.slab import Slab, Support
from tests.solver.elasticity.condensation.exact_stencil import exact_compliance

HIGH, NARROW = 1e4, 0.4999
"""Cells 20 000 times as high as wide, ten thousand times as hard to press together as to shear."""


@pytest.mark.parametrize("poisson", [1 / 3, NARROW])
@pytest.mark.parametrize("height", [1.0, 30.0, 1e3, HIGH])
@pytest.mark.parametrize("support", ["bonded", "frictionless", "right_side"])
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
    """What bends a column is a difference of pressures 1/(1-2ν) as large: at 0.5 - 1e-10 a tenth of its sway was rounding."""
    slab = Slab(33, 10.0, poisson, scheme=Galerkin(rows_per_level=1))
    with pytest.raises(SingularOperator, match=r"uncertain by .* use a poisson further from 0\.5"):
        surface_compliance(slab)


def test_a_contact_on_it_ends_with_the_same_advice() -> None:
    with pytest.raises(SingularOperator) as refused:
        contact_state(Case(slab=Slab(33, 10.0, 0.5 - 1e-10)))
    assert refused.value.ending is Ending.SINGULAR_OPERATOR


@pytest.mark.parametrize("scheme", ["galerkin", "biquadratic"])
@pytest.mark.parametrize("poisson", [-0.999999, 0.4999])
@pytest.mark.parametrize("height", [1e-4, 1.0, 10.0])
def test_every_other_poissons_ratio_is_computed(height: float, poisson: float, scheme: str) -> None:
    assert np.isfinite(surface_compliance(Slab(33, height, poisson, scheme=scheme)).matrix).all()
