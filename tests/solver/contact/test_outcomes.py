"""Advice is for the case that it is given to: it names nothing that is on already, and what it names helps."""

from dataclasses import replace

import pytest

from nanoslip.solver.case import Case, Heterogeneity, SlipOrder, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.kernels.state import Stop
from nanoslip.solver.contact.soundness import OUTCOME_OF_STOP, advised, energy_created
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.outcome import COMPLETED, Ending
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.slide import slide


@pytest.mark.parametrize("scheme", ["galerkin", "biquadratic", "half_plane", "chain"])
@pytest.mark.parametrize("slip_order", ["worst_first", "simultaneous"])
@pytest.mark.parametrize("rough", [False, True])
def test_no_advice_names_what_the_case_does_already(scheme: str, slip_order: SlipOrder, rough: bool) -> None:
    profile = ((0.0, 0.0), (0.1, 1e-6)) if rough else ()
    slab, rule = Slab(17, scheme=scheme), SlipRule(slip_order=slip_order)
    case = Case(slab=slab, slip_rule=rule, heterogeneity=Heterogeneity(roughness=profile))
    assert advised(case, COMPLETED) is COMPLETED
    given = [advised(case, outcome).message for outcome in OUTCOME_OF_STOP.values()] + [energy_created(case).message]
    for message in given:
        assert "galerkin" not in message or scheme == "biquadratic"
        assert "worst_first" not in message or slip_order == "simultaneous"
    assert ("smoother" in given[-1]) is rough
    assert any("galerkin" in message for message in given) is (scheme == "biquadratic")


def test_slips_without_end_are_advised_by_their_cause() -> None:
    """Without friction on a nearly incompressible slab; each advice but a higher limit is followed here, and helps."""
    slab = Slab(17, poisson=0.4999)
    case = Case(slab=slab, intrinsic_friction=0.0, slip_rule=SlipRule(cascade_limit=3000))
    outcome = initial_contact(case, surface_compliance(slab)).outcome
    assert outcome.ending is Ending.CASCADE_LIMIT
    assert 'raise it, or use initial_contact = "frictionless"' in outcome.message
    assert outcome.message.endswith(", or lower poisson")
    for other in (replace(case, initial_contact="frictionless"), replace(case, slab=replace(slab, poisson=0.3))):
        assert initial_contact(other, surface_compliance(other.slab)).outcome.ok
    with_friction = replace(case, intrinsic_friction=0.5, slab=Slab(17), slip_rule=SlipRule(residual_shear=0.5))
    found = advised(with_friction, OUTCOME_OF_STOP[Stop.CASCADE_LIMIT])
    assert found.message.endswith(": raise it, or lower slip.residual_shear")


def test_pillars_that_sway_are_to_be_lower() -> None:
    slab = Slab(17, aspect_ratio=3000.0)
    case = Case(slab=slab, intrinsic_friction=0.5, max_events=200)
    record = slide(case, surface_compliance(slab))
    assert record.outcome.ending is Ending.SLIP_UNBOUNDED
    assert record.outcome.message.count("an aspect_ratio nearer 1") == 1
    lower = replace(case, slab=replace(slab, aspect_ratio=10.0))
    assert slide(lower, surface_compliance(lower.slab)).outcome.ok
