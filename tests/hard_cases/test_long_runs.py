"""Long runs: a million events and ten million slips without drift, and the same bits in one piece or in ten."""

from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.slab import SCHEMES, Slab
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.slide import slide_to_state
from tests.hard_cases.following import compliance_of
from tests.physics import energy, half_plane, law_errors

COLUMNS = (
    "displacement", "force_before", "force_after", "stiffness", "kind", "node", "slips", "contact_size", "dissipated",
)  # fmt: skip


def _long(scheme: str, events: int) -> Case:
    """A light load on a blunt pin: a million events move the pin by less than the slab's width."""
    rule = SlipRule(event_floor=1e-9)
    return Case(slab=Slab(17, scheme=scheme), normal_load=1e-6, radius=2e5, slip_rule=rule, max_events=events)


def _in_pieces(case: Case, pieces: int) -> tuple[list[FrictionRecord], ContactState]:
    compliance = compliance_of(case.slab)
    assert case.max_events is not None
    piece = replace(case, max_events=case.max_events // pieces)
    state, records = initial_contact(case, compliance), []
    for _ in range(pieces):
        record, state = slide_to_state(piece, compliance, state)
        records.append(record)
    return records, state


def _assert_same(whole: FrictionRecord, pieces: list[FrictionRecord]) -> None:
    assert whole.outcome.ok
    for name in COLUMNS:
        joined = np.concatenate([getattr(piece, name) for piece in pieces])
        np.testing.assert_array_equal(joined, getattr(whole, name), err_msg=name)


def _million(scheme: str) -> tuple[FrictionRecord, ContactState, dict[str, float]]:
    case = _long(scheme, 1_000_000)
    compliance = compliance_of(case.slab)
    record, end = slide_to_state(case, compliance)
    return record, end, law_errors(end, case, compliance)


@pytest.mark.slow
@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_million_events_do_not_drift(scheme: str) -> None:
    record, end, errors = _million(scheme)
    assert record.outcome.ok
    assert len(record.kind) == 1_000_000
    assert max(errors.values()) < 1e-9
    assert abs(record.force_after[-1] - end.friction_force) < 1e-9 * record.normal_load
    # Every tooth begins where the last event ended, all the way.
    after = np.concatenate(([record.initial_force], record.force_after[:-1]))
    slope = np.concatenate(([record.initial_stiffness], record.stiffness[:-1]))
    rise = slope * np.diff(record.displacement, prepend=0.0)
    # The steps are differences of displacements, each rounded.
    assert np.abs(after + rise - record.force_before).max() < 1e-9 * record.normal_load
    pieces, _ = _in_pieces(_long(scheme, 1_000_000), 10)
    _assert_same(record, pieces)


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
