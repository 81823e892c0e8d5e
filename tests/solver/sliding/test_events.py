"""Sliding from event to event: the contact laws after every event, an exact record between events, a balanced energy."""

import math
from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects, SlipOrder, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.kernels import state as window
from nanoslip.solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from nanoslip.solver.outcome import Ending
from nanoslip.solver.slab import Slab, Support
from nanoslip.solver.sliding import slide as columns
from nanoslip.solver.sliding.record import EVENT_KINDS
from nanoslip.solver.sliding.slide import slide, slide_to_state, states_at
from tests.physics import assert_contact_laws, coupled_half_plane, half_plane, smallest_step, stored_energy

SLAB = Slab(n_x=33)
COMPLIANCE = surface_compliance(SLAB)


def case_with(residual_shear: float = 0.0, slip_order: SlipOrder = "worst_first", **changes: object) -> Case:
    return replace(
        Case(slab=SLAB, slip_rule=SlipRule(slip_order=slip_order, residual_shear=residual_shear), max_events=300),
        **changes,
    )  # type: ignore[arg-type]


@pytest.mark.parametrize("residual_shear", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("slip_order", ["worst_first", "simultaneous"])
@pytest.mark.parametrize(
    ("friction", "changes"),
    [
        (0.5, {}),
        (0.1, {}),
        (1.0, {}),
        (0.5, {"radius": 10.0, "normal_load": 1e-4}),
        (0.5, {"radius": 2000.0}),
        (0.3, {"pin": "flat_punch"}),
        (0.3, {"initial_contact": "frictionless"}),
    ],
    ids=["paper", "slippery", "rough", "small", "full", "punch", "frictionless touch"],
)
def test_the_contact_laws_hold_after_every_event(
    friction: float, changes: dict[str, object], slip_order: SlipOrder, residual_shear: float
) -> None:
    case = case_with(residual_shear, slip_order, intrinsic_friction=friction, max_events=1, **changes)
    state = initial_contact(case, COMPLIANCE)
    for _ in range(60):
        record, state = slide_to_state(case, COMPLIANCE, state)
        assert record.outcome.ok, record.outcome
        assert_contact_laws(state, case, COMPLIANCE)


@pytest.mark.parametrize("slip_order", ["worst_first", "simultaneous"])
def test_where_only_forward_shear_is_limited_the_laws_hold_and_nodes_keep_more_shear_backwards(
    slip_order: SlipOrder,
) -> None:
    """A pin that sticks as it comes down pulls both sides inwards: its right half keeps shear beyond μ_i·pressure."""
    rule = SlipRule(slip_order=slip_order, limited_shear="forward")
    case = case_with(intrinsic_friction=0.05, slip_rule=rule, max_events=1)
    state = initial_contact(case, COMPLIANCE)
    backwards = (-state.nodal_force[0] + 0.05 * state.nodal_force[1])[state.contact].max()
    assert backwards > 1e-3 * case.normal_load
    for _ in range(60):
        record, state = slide_to_state(case, COMPLIANCE, state)
        assert record.outcome.ok, record.outcome
        assert_contact_laws(state, case, COMPLIANCE)


def test_without_shear_against_the_drag_it_does_not_matter_which_shear_is_limited() -> None:
    """Without coupling no node is pushed back until all of them slip: the same bits."""
    operator = half_plane(SLAB)
    records = [
        slide(case_with(slip_rule=SlipRule(limited_shear=limited), max_events=40), operator)
        for limited in ("both_ways", "forward")
    ]
    np.testing.assert_array_equal(records[0].displacement, records[1].displacement)
    np.testing.assert_array_equal(records[0].force_after, records[1].force_after)


def test_releases_trigger_events_only_where_shear_against_the_drag_is_free() -> None:
    """With |shear| limited a node slips before its pressure is gone."""
    triggers = {}
    for limited in ("both_ways", "forward"):
        case = case_with(radius=1000.0, slip_rule=SlipRule(limited_shear=limited), max_events=1000)
        record = slide(case, COMPLIANCE)
        triggers[limited] = int(np.sum(record.kind == EVENT_KINDS.index("release")))
    assert triggers["both_ways"] == 0
    assert triggers["forward"] > 0


@pytest.mark.parametrize("support", ["frictionless", "right_side"])
def test_other_supports_slide_as_well(support: Support) -> None:
    slab = replace(SLAB, support=support)
    compliance = surface_compliance(slab)
    case = case_with(slab=slab)
    record, state = slide_to_state(case, compliance)
    assert record.outcome.ok
    assert len(record.kind) == 300
    assert_contact_laws(state, case, compliance)


def test_between_events_the_force_rises_with_the_recorded_stiffness() -> None:
    record = slide(case_with(), COMPLIANCE)
    after = np.concatenate(([record.initial_force], record.force_after[:-1]))
    slope = np.concatenate(([record.initial_stiffness], record.stiffness[:-1]))
    steps = np.diff(record.displacement, prepend=0.0)
    np.testing.assert_allclose(after + slope * steps, record.force_before, atol=1e-11 * record.normal_load)
    assert steps.min() >= smallest_step(case_with(), 3.0 * record.stiffness.max()) * (1 - 1e-6)


@pytest.mark.parametrize("operator", [half_plane, coupled_half_plane])
@pytest.mark.parametrize("residual_shear", [0.0, 0.8])
def test_the_work_of_pin_and_load_is_stored_or_dissipated(operator: object, residual_shear: float) -> None:
    """∫F dδ_p + W·Δapproach = Δ(½ f·d) + Σ dissipated, for a reciprocal operator; no event creates energy."""
    slab = replace(SLAB, poisson=0.2)
    compliance: SurfaceCompliance = operator(slab)  # type: ignore[operator]
    case = case_with(residual_shear, slab=slab)
    start = initial_contact(case, compliance)
    record, end = slide_to_state(case, compliance, start)
    assert len(record.kind) == 300
    before = np.concatenate(([record.initial_force], record.force_after[:-1]))
    pin_work = float(((before + record.force_before) / 2) @ np.diff(record.displacement, prepend=0.0))
    load_work = case.normal_load * (end.approach - start.approach)
    stored = stored_energy(end) - stored_energy(start)
    lost = float(record.dissipated.sum())
    # 300 events, each summed to rounding of the work done so far.
    assert pin_work + load_work == pytest.approx(stored + lost, abs=1e-10 * pin_work)
    assert lost > 0.1 * pin_work
    assert record.dissipated.min() >= -1e-12 * pin_work


def test_a_displacement_limit_is_met_exactly_and_room_for_events_grows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(columns, "FIRST_CAPACITY", 8)
    case = case_with(max_events=None, max_displacement=1.5e-3)
    record, state = slide_to_state(case, COMPLIANCE)
    assert record.outcome.ok
    assert len(record.kind) > 16
    assert record.final_displacement == state.displacement == 1.5e-3
    assert record.final_force == state.friction_force
    assert record.displacement[-1] < 1.5e-3
    same = slide(replace(case, max_events=len(record.kind)), COMPLIANCE)
    np.testing.assert_array_equal(same.displacement, record.displacement)


@pytest.mark.parametrize("far", [1e-3, 0.2], ids=["one window", "many windows"])
def test_following_a_window_of_nodes_changes_nothing(far: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same events as with every surface node followed, also where the contact walks out of its first window."""
    slab = Slab(n_x=65)
    compliance = surface_compliance(slab)
    rule = SlipRule(residual_shear=0.5)
    case = Case(
        slab=slab,
        radius=1.0,
        normal_load=1e-4,
        intrinsic_friction=0.2,
        slip_rule=rule,
        max_events=None,
        max_displacement=far,
    )
    windowed, state = slide_to_state(case, compliance)
    assert_contact_laws(state, case, compliance)
    monkeypatch.setattr(window, "MARGIN", slab.n_x)
    whole = slide(case, compliance)
    count = min(len(whole.node), 200)  # beyond, rounding decides ties differently and the records part
    assert count > 20
    np.testing.assert_array_equal(windowed.node[:count], whole.node[:count])
    np.testing.assert_allclose(windowed.displacement[:count], whole.displacement[:count], rtol=1e-7)
    late = whole.displacement > far / 2
    assert windowed.force_before[windowed.displacement > far / 2].mean() == pytest.approx(
        whole.force_before[late].mean(), rel=0.02
    )


def test_a_run_in_pieces_is_the_run_in_one() -> None:
    """To rounding: every piece starts from a freshly inverted operator."""
    whole = slide(case_with(max_events=40), COMPLIANCE)
    state, pieces = initial_contact(case_with(), COMPLIANCE), []
    for _ in range(4):
        record, state = slide_to_state(case_with(max_events=10), COMPLIANCE, state)
        pieces.append(record)
    np.testing.assert_allclose(np.concatenate([p.displacement for p in pieces]), whole.displacement, rtol=1e-9)
    np.testing.assert_array_equal(np.concatenate([p.node for p in pieces]), whole.node)
    np.testing.assert_array_equal(np.concatenate([p.slips for p in pieces]), whole.slips)


def test_the_same_case_gives_the_same_bits() -> None:
    first, second = slide(case_with(), COMPLIANCE), slide(case_with(), COMPLIANCE)
    for name in ("displacement", "force_before", "force_after", "dissipated", "node"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))


def test_every_event_has_a_trigger_and_a_cascade_that_answers_it() -> None:
    record = slide(case_with(intrinsic_friction=0.25), COMPLIANCE)
    answers = np.column_stack((record.slips, record.releases, record.touches))
    assert np.all(answers[np.arange(300), record.kind] >= 1)
    assert set(record.kind) <= set(range(len(EVENT_KINDS)))
    sizes = np.concatenate(([record.initial_contact_size], record.contact_size))
    np.testing.assert_array_equal(np.diff(sizes), record.touches - record.releases)


def test_adhesive_stick_never_slips() -> None:
    record = slide(case_with(intrinsic_friction=math.inf, max_events=None, max_displacement=1e-3), COMPLIANCE)
    assert record.outcome.ok
    assert record.slips.sum() == 0
    assert record.final_force == pytest.approx(record.initial_stiffness * 1e-3, rel=0.2)  # releases soften it


def test_where_nothing_can_ever_happen_the_record_says_so() -> None:
    """Every node in contact, none can slip, and without coupling no pressure changes."""
    slab = Slab(n_x=9)
    case = Case(slab=slab, radius=1e6, intrinsic_friction=math.inf)
    record = slide(case, half_plane(slab))
    assert record.outcome.ending is Ending.NO_EVENT
    assert "limits.displacement" in record.outcome.message
    assert len(record.kind) == 0


def test_without_friction_the_pin_feels_none() -> None:
    record = slide(case_with(intrinsic_friction=0.0, max_events=50), COMPLIANCE)
    assert record.outcome.ok
    # Every step is as small as the force's tolerance allows.
    assert record.force_before.max() <= 1e-12 * record.normal_load


def test_a_punch_edge_that_comes_upon_the_next_node_is_an_outcome() -> None:
    slab = Slab(n_x=9)
    case = Case(
        slab=slab, pin="flat_punch", half_width=0.13, intrinsic_friction=0.05, max_events=None, max_displacement=2.0
    )
    record = slide(case, surface_compliance(slab))
    assert record.outcome.ending is Ending.EDGE_REACHED
    assert "edge" in record.outcome.message
    # The next node stands at 0.25 and counts as reached half a node spacing before the punch's edge, 0.13, is there.
    assert record.final_displacement == pytest.approx(0.25 - 0.13 - 0.125 / 2, rel=0.01)


def test_a_pin_can_be_dragged_off_the_slab_or_until_it_carries_on_one_corner() -> None:
    """Contact follows the pin by touch and release; past the slab's end the last node carries the whole load.

    Slopes stay below half of μ_i: a pin twice as sharp creates energy on its way, and is named for it.
    """
    slab = Slab(n_x=9)
    case = Case(slab=slab, radius=2.0, normal_load=1e-3, intrinsic_friction=0.1, max_events=None, max_displacement=0.6)
    compliance = surface_compliance(slab)
    record, state = slide_to_state(case, compliance)
    assert record.outcome.ok
    assert_contact_laws(state, case, compliance)
    assert list(np.flatnonzero(state.contact)) == [8]
    assert record.releases.sum() > 0
    assert record.touches.sum() > 0


def test_a_contact_that_failed_to_form_gives_an_empty_record_with_its_reason() -> None:
    case = case_with(intrinsic_friction=0.05, slip_rule=SlipRule(cascade_limit=1))
    record = slide(case, COMPLIANCE)
    assert record.outcome.ending is Ending.CASCADE_LIMIT
    assert len(record.kind) == 0


@pytest.mark.parametrize("limits", [{"max_events": 7}, {"max_displacement": 1e-3}], ids=["events", "displacement"])
@pytest.mark.parametrize(
    "changes",
    [{}, {"effects": Effects(pin_translation=False)}, {"slip_rule": SlipRule(residual_shear=1.0)}],
    ids=["whole", "frozen", "coulomb"],
)
def test_states_after_events_end_where_the_record_does(changes: dict[str, object], limits: dict[str, object]) -> None:
    case = replace(case_with(), **(changes | limits))  # type: ignore[arg-type]
    last = len(slide(case, COMPLIANCE).displacement)
    assert last > 1
    found, outcome = states_at(case, COMPLIANCE, (0, last, last + 1, 100_000))
    assert (len(found), outcome.ok) == (2, True)
    assert states_at(case, COMPLIANCE, (100_000,))[0] == []


def test_a_failure_behind_the_end_of_the_record_is_not_the_cases() -> None:
    """This pin gets too steep where it touches, but long after its seventh event."""
    case = case_with(radius=25.0, max_events=7)
    behind = slide(replace(case, max_events=100_000), COMPLIANCE)
    assert (behind.outcome.ending, len(behind.displacement) > case.max_events) == (Ending.STEEP_PIN, True)
    found, outcome = states_at(case, COMPLIANCE, (0, 5, 100_000))
    assert (len(found), outcome.ending) == (2, Ending.COMPLETED)
