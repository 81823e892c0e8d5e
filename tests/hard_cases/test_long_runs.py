"""Long runs: a million events and ten million slips without drift."""

from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.slide import slide_to_state
from tests.hard_cases.following import compliance_of
from tests.physics import ROWS, energy, half_plane, law_errors


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ROWS)
def test_a_million_events_do_not_drift(scheme: str) -> None:
    """A light load on a blunt pin: a million events move it by less than the slab's width."""
    rule = SlipRule(event_floor=1e-9)
    case = Case(slab=Slab(17, scheme=scheme), normal_load=1e-6, radius=2e5, slip_rule=rule, max_events=1_000_000)
    record, end = slide_to_state(case, compliance_of(case.slab))
    assert record.outcome.ok
    assert len(record.kind) == 1_000_000
    assert max(law_errors(end, case, compliance_of(case.slab)).values()) < 1e-9
    assert abs(record.force_after[-1] - end.friction_force) < 1e-9 * record.normal_load
    # Every tooth begins where the last event ended, all the way.
    after = np.concatenate(([record.initial_force], record.force_after[:-1]))
    slope = np.concatenate(([record.initial_stiffness], record.stiffness[:-1]))
    rise = slope * np.diff(record.displacement, prepend=0.0)
    # The steps are differences of displacements, each rounded.
    assert np.abs(after + rise - record.force_before).max() < 1e-9 * record.normal_load


@pytest.mark.slow
def test_ten_million_slips_keep_laws_and_energy() -> None:
    """On a reciprocal operator."""
    slab = Slab(33, poisson=0.2)
    compliance = half_plane(slab)
    case = Case(slab=slab, intrinsic_friction=1e-4, slip_rule=SlipRule(residual_shear=0.999), max_events=150_000)
    case = replace(case, initial_contact="frictionless", radius=1e5)  # flat against so small a μ_i
    start = initial_contact(case, compliance)
    record, end = slide_to_state(case, compliance, start)
    assert record.slips.sum() > 10_000_000
    # The load's work is 1/μ_i times the pin's, and so is its rounding.
    assert energy(case, start, record, end).missing < 1e-7
    assert max(law_errors(end, case, compliance).values()) < 1e-9
