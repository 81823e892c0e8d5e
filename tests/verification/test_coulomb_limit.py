"""Amontons' law in the limit: as the residual goes to 1, every node slides at μ_i·pressure, so F/W goes to μ_i."""

import numpy as np
import pytest

from nanoslip.solver.case import Case, SlipRule
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.slide import slide
from tests.verification.seen import seen

SLAB = Slab(n_x=33)


def plateau(friction: float, residual_shear: float) -> float:
    rule = SlipRule(residual_shear=residual_shear)
    case = Case(slab=SLAB, intrinsic_friction=friction, slip_rule=rule, max_events=None, max_displacement=2.5e-3)
    record = slide(case, surface_compliance(SLAB))
    assert record.outcome.ok
    late = record.displacement > 1.7e-3
    return float((record.force_before[late] + record.force_after[late]).mean() / 2 / record.normal_load)


@pytest.mark.parametrize("friction", [0.25, 0.5])
def test_friction_tends_to_the_intrinsic_friction(friction: float) -> None:
    """Every shear lies between residual_shear·μ_i p and μ_i p, more of them above the middle than below: the deficit of F/W
    is a little less than (1 - residual_shear)/2 (0.41-0.42 and 0.39 of 1 - residual_shear seen)."""
    residuals = np.array([0.9, 0.99])
    deficits = np.array([1 - plateau(friction, residual_shear) / friction for residual_shear in residuals])
    ratios = deficits / (1 - residuals)
    friction_left = ", ".join(
        f"{1 - deficit:.4f} at {residual_shear}" for residual_shear, deficit in zip(residuals, deficits, strict=True)
    )
    line = seen(f"Amontons' law as residual → 1, μ = {friction}", "limit", f"F/μW = {friction_left}")
    assert np.all(np.abs(ratios - 0.4) <= 0.05), line
