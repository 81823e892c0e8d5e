"""Initial contact: constraints I-III and ΣN = W hold for every pin, load, friction and way of touching."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from nanoslip.solver.case import Case, InitialContact
from nanoslip.solver.contact import initial
from nanoslip.solver.contact.compiled_contact import CompiledContact, compiled_contact
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.outcome import Ending
from nanoslip.solver.slab import Slab
from tests.physics import assert_contact_laws

SLAB = Slab(n_x=65)
COMPLIANCE = surface_compliance(SLAB)
WAYS: tuple[InitialContact, ...] = ("stick", "frictionless", "gradual")


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(
    ("radius", "normal_load"),
    [(200.0, 1e-3), (50.0, 1e-3), (1.0, 1e-5), (500.0, 2e-3), (2000.0, 1e-3), (1e5, 1e-3), (200.0, 1e-9)],
    ids=["paper", "small", "tiny", "nearly full", "full", "flat", "one node"],
)
@pytest.mark.parametrize("friction", [0.1, 0.5])
def test_the_contact_laws_hold(way: InitialContact, radius: float, normal_load: float, friction: float) -> None:
    case = Case(slab=SLAB, radius=radius, normal_load=normal_load, intrinsic_friction=friction, initial_contact=way)
    state = initial_contact(case, COMPLIANCE)
    assert state.outcome.ok, state.outcome
    assert_contact_laws(state, case, COMPLIANCE)


@pytest.mark.parametrize("friction", [0.2, 0.5, math.inf])
@pytest.mark.parametrize("way", WAYS)
def test_a_flat_punch_keeps_its_width(way: InitialContact, friction: float) -> None:
    case = Case(slab=SLAB, pin="flat_punch", half_width=0.25, initial_contact=way, intrinsic_friction=friction)
    state = initial_contact(case, COMPLIANCE)
    assert state.outcome.ok, state.outcome
    assert_contact_laws(state, case, COMPLIANCE)
    np.testing.assert_array_equal(state.contact, np.abs(COMPLIANCE.x) <= 0.25)


def test_full_contact_takes_the_corners() -> None:
    state = initial_contact(Case(slab=SLAB, radius=2000.0), COMPLIANCE)
    assert state.contact.all()


def test_the_paper_case_touches_with_70_to_75_of_129_nodes() -> None:
    case = Case()
    state = initial_contact(case, surface_compliance(case.slab))
    assert 68 <= state.contact.sum() <= 76


@pytest.mark.parametrize("way", WAYS)
def test_pressure_and_gap_are_mirror_symmetric_before_the_pin_moves(way: InitialContact) -> None:
    case = Case(slab=SLAB, initial_contact=way, intrinsic_friction=math.inf)
    state = initial_contact(case, COMPLIANCE)
    # Without slips nothing breaks the mirror but rounding times the condition number.
    np.testing.assert_allclose(state.pressure, state.pressure[::-1], atol=1e-10 * state.pressure.max())
    np.testing.assert_allclose(state.gap, state.gap[::-1], atol=1e-10 * case.normal_load)
    assert abs(state.friction_force) <= 1e-10 * case.normal_load


def test_sticking_needs_slips_and_frictionless_touch_none() -> None:
    case = Case(slab=SLAB, intrinsic_friction=0.1)
    assert initial_contact(case, COMPLIANCE).slips > 0
    smooth = initial_contact(replace(case, initial_contact="frictionless"), COMPLIANCE)
    assert smooth.slips == 0
    assert np.abs(smooth.shear).max() <= 1e-11 * smooth.pressure.max()


@pytest.mark.parametrize("poisson", [-0.5, 0.0, 0.3])
@pytest.mark.parametrize("scheme", ["half_plane", "galerkin"])
def test_slips_that_decide_the_contact_stay_within_the_first_window(
    scheme: Any, poisson: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where no stuck set is settled the contact ends tens of nodes from where it began; all of the surface costs n_x³."""
    case = Case(slab=Slab(257, scheme=scheme, poisson=poisson, aspect_ratio=4.0), radius=100.0)
    compliance = surface_compliance(case.slab)
    windows: list[slice] = []

    def seen(*given: Any) -> CompiledContact:
        windows.append((compiled := compiled_contact(*given)).window)
        return compiled

    monkeypatch.setattr(initial, "compiled_contact", seen)
    state = initial_contact(case, compliance)
    assert state.outcome.ok
    assert len(windows) == 1
    assert windows[0] != slice(0, 257)
    monkeypatch.setattr(initial, "expected_half_width", lambda _: 1.0)
    everywhere = initial_contact(case, compliance)
    assert np.array_equal(everywhere.contact, state.contact)
    # A wider tableau is inverted with other rounding; slips multiply it, as they do an error of any kind.
    assert everywhere.pressure == pytest.approx(state.pressure, abs=1e-9 * np.nanmax(state.pressure))


def test_without_friction_every_way_leads_to_the_same_pressure() -> None:
    """μ_i = 0 leaves normal contact alone; slipped nodes sit where frictionless contact puts them."""
    pressures = [
        initial_contact(Case(slab=SLAB, intrinsic_friction=0.0, initial_contact=way), COMPLIANCE).pressure
        for way in ("stick", "frictionless")
    ]
    # Slips one at a time end within 1e-12 of the load per node of the common state.
    np.testing.assert_allclose(pressures[0], pressures[1], atol=1e-7 * pressures[1].max())


def test_the_compliance_of_another_slab_is_refused() -> None:
    with pytest.raises(ValueError, match="another slab"):
        initial_contact(Case(slab=Slab(n_x=33)), COMPLIANCE)


def test_too_few_slips_allowed_is_an_outcome_with_advice() -> None:
    rule = replace(Case().slip_rule, cascade_limit=1)
    state = initial_contact(Case(slab=SLAB, intrinsic_friction=0.1, slip_rule=rule), COMPLIANCE)
    assert state.outcome.ending is Ending.CASCADE_LIMIT
    assert "cascade_limit" in state.outcome.message
