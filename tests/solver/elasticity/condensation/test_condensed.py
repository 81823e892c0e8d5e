"""The compliance of the surface has right digits whatever the slab's shape, or is refused."""

from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.elasticity.condensation import condensed
from nanoslip.solver.elasticity.grid_scheme import stiffness
from nanoslip.solver.elasticity.schemes.biquadratic import Biquadratic
from nanoslip.solver.elasticity.schemes.galerkin import Galerkin
from nanoslip.solver.outcome import Ending, SingularOperator
from nanoslip.solver.simulate import contact_state
from nanoslip.solver.slab import Slab
from tests.solver.elasticity.condensation.exact_stencil import exact_compliance

HIGH, NARROW = 1e4, 0.4999
"""Cells 20 000 times as high as wide, ten thousand times as hard to press together as to shear."""


@pytest.mark.parametrize(
    "slab",
    [
        Slab(9, HIGH, NARROW, scheme="biquadratic"),
        Slab(9, HIGH, NARROW, "frictionless", scheme="biquadratic"),
        Slab(9, HIGH, NARROW, "right_side", scheme="biquadratic"),
        Slab(9, HIGH, NARROW, scheme=Biquadratic(first_spacing="doubling")),
        Slab(9, scheme="biquadratic"),
    ],
    ids=lambda slab: f"{slab.aspect_ratio:g}-{slab.support}-{slab.scheme.first_spacing}",
)
def test_the_stencils_compliance_is_that_of_exact_arithmetic_however_narrow_its_cells(slab: Slab) -> None:
    """Rows move as a whole under 1e-12 of the stiffness of their cells: where that was a sum of these, 3e-3 was wrong."""
    expected = exact_compliance(slab)
    # 9e-11 seen: a tenth of a percent of what 1e-12 of the stiffness would lose.
    np.testing.assert_allclose(surface_compliance(slab).matrix, expected, rtol=0, atol=3e-10 * np.abs(expected).max())


@pytest.mark.parametrize("height", [147.0, 300.0])
def test_a_modulus_of_another_unit_changes_no_digit_of_a_high_paper_grid(height: float) -> None:
    """All stiffnesses are rounded otherwise then; 4e-7 to 1e-5 of the compliance used to change."""
    k = stiffness(Slab(513, height, NARROW, scheme="biquadratic"))
    assert k.per_row is not None
    parts = {name: 1.1 * getattr(k, name) for name in ("matrix", "per_row")}
    expected = condensed(k)
    # 8e-10 seen, at three times the height.
    np.testing.assert_allclose(
        1.1 * condensed(replace(k, **parts)), expected, rtol=0, atol=5e-9 * np.abs(expected).max()
    )


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
