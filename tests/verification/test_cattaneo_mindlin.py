"""Cattaneo and Mindlin: at residual_shear 1, and on the way to it, an uncoupled contact slips from its edges as they found."""

import numpy as np
import pytest

from nanoslip.solver.case import Case, SlipRule
from nanoslip.solver.contact.closed_forms import cattaneo_mindlin, hertz
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.slide import slide_to_state
from tests.physics import half_plane
from tests.verification.seen import seen

FRICTION, RADIUS, LOAD = 0.5, 200.0, 1e-3


@pytest.mark.parametrize(
    ("residual_shear", "displacement", "shear_error"),
    # Seen: 8.2 % at residual_shear 0.9 (shear anywhere in 0.9-1 of its limit), then 2.4 %: what the pressure's edge nodes leave.
    [(0.9, 1.6e-4, 0.11), (0.99, 1.6e-4, 0.03), (0.99, 0.8e-4, 0.03), (1.0, 1.6e-4, 0.03)],
)
def test_shear_and_stick_zone(residual_shear: float, displacement: float, shear_error: float) -> None:
    slab = Slab(n_x=129)
    compliance = half_plane(slab)
    case = Case(
        intrinsic_friction=FRICTION, radius=RADIUS, normal_load=LOAD, slab=slab,
        slip_rule=SlipRule(residual_shear=residual_shear),
        max_events=None, max_displacement=displacement,
    )  # fmt: skip
    record, state = slide_to_state(case, compliance)
    assert record.outcome.ok
    theory = hertz(LOAD, RADIUS, slab.poisson)
    ratio = state.friction_force / (FRICTION * LOAD)
    assert 0.1 < ratio < 0.9
    shear = cattaneo_mindlin(theory, FRICTION, ratio, compliance.x)
    error = np.abs(state.shear - shear).max() / (FRICTION * theory.peak_pressure)
    stuck = compliance.x[state.contact & (state.slip == 0.0)]
    stick = theory.half_width * np.sqrt(1 - ratio)
    borders = np.array([-stuck.min(), stuck.max()])
    line = seen(
        f"partial slip, F/μW = {ratio:.2f}, residual {residual_shear}", "Cattaneo 1938, Mindlin 1949; Johnson, §7.2",
        f"n_x = 129: shear off by {100 * error:.1f} % of its peak, stick zone's ends by "
        f"{np.abs(borders - stick).max() / slab.spacing:.1f} nodes",
    )  # fmt: skip
    assert error <= shear_error, line
    # The border lies between the last stuck node and the next one.
    assert np.abs(borders - stick).max() <= slab.spacing, line
