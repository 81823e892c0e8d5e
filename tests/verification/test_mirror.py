"""A slab and its mirror image, with other μ_i at every node so that no rule about ties is asked."""

from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, Heterogeneity
from nanoslip.solver.contact import compiled_contact
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.pin import node_friction
from nanoslip.solver.contact.state import ContactState, mirrored
from nanoslip.solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from nanoslip.solver.slab import SCHEMES, Slab
from nanoslip.solver.sliding.slide import slide
from tests.verification.seen import seen

EVENTS = 1000


def touched_on_the_mirror_image(case: Case, compliance: SurfaceCompliance) -> ContactState:
    """Initial contact where every node has the μ_i of its mirror node."""

    def turned(case: Case) -> np.ndarray:
        return node_friction(case)[::-1].copy()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compiled_contact, "node_friction", turned)
        return initial_contact(case, compliance)


@pytest.mark.parametrize("seed", [7, 8])
@pytest.mark.parametrize(
    "scheme", [name for name, kind in SCHEMES.items() if kind.continuum]
)  # pressing a chain slips nothing
def test_the_mirror_image_slides_to_the_left_as_the_slab_does_to_the_right(scheme: str, seed: int) -> None:
    """Touched stuck, both slip hundreds of nodes to rest; then the pin slides to the right over the one and to the left over
    the other (the mirror image of which is again the one): the same nodes, slips and forces.

    The two touches differ by the order of their sums: 1e-14 of u, 1e-14 of the forces were seen. 1000 events of nodes that
    stick and slip pass that on to forces 3e-11 apart at most; 1e-9 leaves room for another machine's sums.
    """
    drawn = Heterogeneity(spread=0.3, seed=seed)
    case = Case(slab=Slab(n_x=65, scheme=scheme), intrinsic_friction=0.1, heterogeneity=drawn, max_events=EVENTS)
    compliance = surface_compliance(case.slab)
    state, image = initial_contact(case, compliance), touched_on_the_mirror_image(case, compliance)
    assert state.slips == image.slips > 100
    # Its nodes are the case's own again: only the state is turned.
    back = mirrored(replace(case, heterogeneity=Heterogeneity()), image)
    apart = float(np.abs(back.nodal_force - state.nodal_force).max()) / case.normal_load
    record, other = slide(case, compliance, state), slide(case, compliance, back)
    assert record.outcome.ok
    off = float(np.abs(other.force_before - record.force_before).max()) / case.normal_load
    line = seen(
        f"mirror image without ties, {scheme}, seed {seed}", "symmetry",
        f"{state.slips} slips at initial contact, forces then differ by {apart:.0e} W, over {EVENTS} events by {off:.0e} W",
    )  # fmt: skip
    np.testing.assert_array_equal(other.node, record.node, err_msg=line)
    np.testing.assert_array_equal(other.slips, record.slips, err_msg=line)
    assert apart < 1e-12, line
    assert off < 1e-9, line
