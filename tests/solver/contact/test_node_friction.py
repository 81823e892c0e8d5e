"""μ_i per node: the drawn numbers have the asked mean and spread, depend on seed and n_x alone, and none are drawn when off."""

from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, Distribution, Heterogeneity, SlipRule
from nanoslip.solver.contact.pin import node_friction
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.slide import slide, slide_to_state
from tests.physics import assert_contact_laws

MANY = Case(intrinsic_friction=0.4, slab=Slab(n_x=16385))


@pytest.mark.parametrize("distribution", ["lognormal", "uniform", "normal"])
def test_mean_and_spread_are_those_asked_for(distribution: Distribution) -> None:
    """Of 16385 draws: four standard errors of a mean are 0.6 % at spread 0.2, of a standard deviation about 3 %."""
    drawn = node_friction(replace(MANY, heterogeneity=Heterogeneity(distribution, 0.2)))
    assert drawn.min() >= 0.0
    assert drawn.mean() == pytest.approx(0.4, rel=0.0063)
    assert drawn.std() == pytest.approx(0.08, rel=0.03)


def test_the_numbers_are_the_same_everywhere_and_for_ever() -> None:
    drawn = node_friction(Case(slab=Slab(n_x=5), heterogeneity=Heterogeneity("uniform", 0.5, seed=7)))
    once = [0.6083358519779096, 0.8439972423734283, 0.7387508112121854, 0.2620224457545418, 0.3269389262004996]
    np.testing.assert_allclose(drawn, once, rtol=1e-14)


def test_seeds_differ_and_other_parameters_do_not_matter() -> None:
    one = replace(MANY, heterogeneity=Heterogeneity(spread=0.3, seed=1))
    other = replace(MANY, heterogeneity=Heterogeneity(spread=0.3, seed=2))
    assert not np.any(node_friction(one) == node_friction(other))
    np.testing.assert_array_equal(node_friction(one), node_friction(replace(one, normal_load=1.0, radius=1.0)))
    np.testing.assert_allclose(
        2.0 * node_friction(one), node_friction(replace(one, intrinsic_friction=0.8)), rtol=1e-15
    )


def test_off_draws_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(np.random, "PCG64", None)
    case = Case(slab=Slab(n_x=17), heterogeneity=Heterogeneity("uniform", 0.0, seed=5))
    assert np.all(node_friction(case) == 0.5)


@pytest.mark.parametrize("residual_shear", [0.0, 1.0])
def test_every_node_obeys_its_own_limit(residual_shear: float) -> None:
    """The laws of contact hold at the end, with each node's own μ_i in place of the mean; some exceed the mean's limit."""
    case = Case(
        slab=Slab(n_x=33),
        radius=50.0,
        max_events=40,
        slip_rule=SlipRule(residual_shear=residual_shear),
        heterogeneity=Heterogeneity(spread=0.3),
    )
    compliance = surface_compliance(case.slab)
    record, state = slide_to_state(case, compliance)
    assert record.outcome.ok
    assert_contact_laws(state, replace(case, intrinsic_friction=np.inf, **OFF), compliance)
    normal, shear = -state.nodal_force[1], np.abs(state.nodal_force[0])
    assert np.all(shear <= node_friction(case) * normal + 1e-11 * case.normal_load)
    assert np.any(shear > 0.5 * normal)


OFF = {"heterogeneity": Heterogeneity(), "slip_rule": SlipRule()}


def test_a_vanishing_spread_is_no_spread() -> None:
    """Records agree event by event; 1e-9 is what a spread of 1e-12 and rounding make of forces in 60 events."""
    case = Case(slab=Slab(n_x=17), radius=50.0, max_events=60)
    compliance = surface_compliance(case.slab)
    one, other = (slide(each, compliance) for each in (case, replace(case, heterogeneity=Heterogeneity(spread=1e-12))))
    np.testing.assert_array_equal(one.node, other.node)
    np.testing.assert_allclose(one.force_after, other.force_after, atol=1e-9 * case.normal_load)


def test_what_means_nothing_is_refused() -> None:
    with pytest.raises(InvalidInput, match=r"spread = 0\.3: needs 0 ≤ spread ≤ 0\.25 with normal"):
        Heterogeneity("normal", 0.3)
    with pytest.raises(InvalidInput, match="needs a mean that can be spread"):
        Case(intrinsic_friction=np.inf, heterogeneity=Heterogeneity(spread=0.1))
