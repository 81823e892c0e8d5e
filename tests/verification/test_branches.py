"""With friction initial contact is not unique. The code's is the one that comes down sticking at every node that touches.

The case alone decides it: neither rounding, nor what was computed before, nor left and right.
"""

import math
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects, InitialContact, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from nanoslip.solver.layout import Row
from nanoslip.solver.slab import SCHEMES, Slab
from nanoslip.solver.sliding.slide import slide
from tests.physics import assert_contact_laws
from tests.verification.branches import SAME, SETS, WAYS, apart, drawn, slipped_from
from tests.verification.seen import seen

CASES = (0, 1, 2, 3, 5, 6, 7, 8, 9, 10, 11)
"""Random cases with every pin, residual_shear 0 to 1.

Number 4 has no stuck contact: an edge node pulls in contact and pushes when free."""
SMOOTH = [number for number in range(10) if not drawn(number).heterogeneity.roughness]
CONTINUA = [name for name, kind in SCHEMES.items() if kind.continuum and kind.LAYOUT is Row]


def rounded_otherwise(compliance, seed):
    """The compliance with errors of some roundings, other ones on the left than on the right."""
    matrix = compliance.matrix * (1.0 + 1e-15 * np.random.default_rng(seed).standard_normal(compliance.matrix.shape))
    matrix = (matrix + matrix.T) / 2 if compliance.slab.scheme.reciprocal else matrix
    matrix.setflags(write=False)
    return SurfaceCompliance(matrix, compliance.slab)


@pytest.mark.parametrize("number", CASES)
def test_the_branch_is_the_one_reached_from_the_stuck_contact_whatever_is_tried_first(number):
    """The stuck contact is that of a pin on which nothing slips. From other sets of slipping nodes other contacts are reached;
    all of them obey the laws."""
    case = drawn(number)
    compliance = surface_compliance(case.slab)
    own = initial_contact(case, compliance)
    stuck = initial_contact(replace(case, slip_rule=SlipRule(), intrinsic_friction=math.inf), compliance)
    assert stuck.outcome.ok
    assert apart(own, slipped_from(case, compliance, stuck.contact), case) < SAME
    found = {
        (use, name): reached(case, compliance, sets) for use, reached in WAYS.items() for name, sets in SETS.items()
    }
    others = [name for name, state in found.items() if apart(own, state, case) > SAME]
    line = seen(f"case {number}", "the code's own branch", f"{int(own.contact.sum())} nodes, another from {others}")
    for state in (own, *found.values()):
        assert_contact_laws(state, case, compliance)
    assert all(use == "begin to slip" for use, _ in others), line
    assert ("begin to slip", "one node") in others, line  # so it is a choice


@pytest.mark.everyday(5)
@pytest.mark.parametrize("residual_shear", [0.0, 1.0])
@pytest.mark.parametrize("number", SMOOTH)
def test_rounding_does_not_choose_a_branch(number, residual_shear):
    """Over the slab's middle mirror nodes are ties: the one further right answers first, however sums are rounded. Forces then
    differ by rounding of a few hundred slips at most: 3e-15 of the load was seen."""
    case = replace(drawn(number), start=0.0, slip_rule=SlipRule(residual_shear=residual_shear))
    compliance = surface_compliance(case.slab)
    own = initial_contact(case, compliance)
    for seed in range(3):
        assert apart(own, initial_contact(case, rounded_otherwise(compliance, seed)), case) < 1e-12


@pytest.mark.everyday(6)
@pytest.mark.parametrize("scheme", CONTINUA)
@pytest.mark.parametrize(
    ("effects", "way", "residual_shear"),
    [
        *((Effects(coupling=False), "stick", residual_shear) for residual_shear in (0.0, 1.0)),
        (Effects(coupling=False, pin_translation=False), "stick", 0.0),
        *((Effects(), "frictionless", residual_shear) for residual_shear in (0.0, 1.0)),
        (Effects(pin_translation=False), "frictionless", 0.0),
    ],
)
def test_rounding_does_not_choose_the_node_that_slips_first(scheme, effects, way, residual_shear):
    """Contacts without shear are their own mirror image: two nodes reach their limit at once."""
    rule = SlipRule(residual_shear=residual_shear)
    slab = Slab(n_x=65, scheme=scheme)
    case = Case(slab=slab, effects=effects, initial_contact=way, slip_rule=rule, max_events=10)
    compliance = surface_compliance(case.slab)
    record = slide(case, compliance)
    for seed in range(3):
        other = slide(case, rounded_otherwise(compliance, seed))
        np.testing.assert_array_equal(other.node, record.node)
        np.testing.assert_allclose(other.force_after, record.force_after, atol=1e-9 * case.normal_load)


def _table(slab):
    """The slab's compliance as a matrix."""
    matrix = surface_compliance(slab).matrix
    matrix.setflags(write=False)
    return SurfaceCompliance(matrix, slab)


@pytest.mark.parametrize("way", get_args(InitialContact))
def test_what_was_computed_before_does_not_choose_a_branch(way):
    """Alone, after other cases on the same table and on those of other grids, with the table elsewhere in memory: same bits."""
    cases = [replace(drawn(number), initial_contact=way) for number in (1, 5)]
    tables = {case: _table(case.slab) for case in cases}
    alone = {}
    for case, compliance in tables.items():
        own = SurfaceCompliance(compliance.matrix.copy(), case.slab)  # nothing is kept of one that may change
        alone[case] = initial_contact(case, own)
    for case in reversed(cases):
        for load in (0.3, 3.0):
            initial_contact(replace(case, normal_load=load * case.normal_load), tables[case])
        shifted = np.empty(tables[case].matrix.size + 1)[1:].reshape(tables[case].matrix.shape)
        shifted[:] = tables[case].matrix
        for compliance in (tables[case], _table(case.slab), SurfaceCompliance(shifted, case.slab)):
            found = initial_contact(case, compliance)
            np.testing.assert_array_equal(found.nodal_force, alone[case].nodal_force)
            np.testing.assert_array_equal(found.slip, alone[case].slip)


@pytest.mark.parametrize("friction", [0.1, 0.3, 0.8])
@pytest.mark.parametrize("residual_shear", [0.0, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("start", [0.13, 0.3, 0.45])
def test_the_mirror_image_of_a_contact_is_the_contact_of_the_mirror_image(start, residual_shear, friction):
    """On a half-plane a start of 0.3 spacings seen in a mirror is one of 0.7, one node further. No nodes are ties there."""
    slab = Slab(n_x=65, scheme="half_plane")
    rule = SlipRule(residual_shear=residual_shear)
    case = Case(slab=slab, radius=50.0, intrinsic_friction=friction, start=start, slip_rule=rule)
    compliance = surface_compliance(case.slab)
    state, image = (initial_contact(each, compliance) for each in (case, replace(case, start=1.0 - start)))
    back = np.array([[-1.0], [1.0]]) * image.nodal_force[:, ::-1]
    assert state.outcome.ok
    assert state.slips == image.slips
    # Nodes 0 to n-2 of the one are 1 to n-1 of the other.
    np.testing.assert_allclose(back[:, :-1], state.nodal_force[:, 1:], atol=1e-12 * case.normal_load)
