"""Sliding from event to event: the contact laws after every event, an exact record between events, a balanced energy.

Also in its limits: constant pressures, where a slip is one row of the tangential tableau, and classical friction (residual_shear
1), where F/W ends at μ_i.
"""

import math
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from nanoslip.solver import layout
from nanoslip.solver.case import Case, Effects, Heterogeneity, InitialContact, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.kernels import events as kernels
from nanoslip.solver.contact.pin import node_friction
from nanoslip.solver.contact.soundness import DOWNHILL
from nanoslip.solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from nanoslip.solver.outcome import Ending, InvalidInput
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding import full_contact, record as friction_record, slide as sliding, way
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.record import EVENT_KINDS, EVENT_TYPES, drops
from nanoslip.solver.sliding.slide import find_states, slide, slide_to_state
from nanoslip.solver.sliding.validity import lawfulness
from tests.conftest import for_python
from tests.physics import assert_contact_laws, coupled_half_plane, energy, half_plane, smallest_step

SLAB = Slab(n_x=33)
COMPLIANCE = surface_compliance(SLAB)
WAYS = get_args(InitialContact)
FROZEN = Effects(pin_translation=False)
SIMULTANEOUS = SlipRule(slip_order="simultaneous")
CASE = Case(slab=SLAB, max_events=300)
CLASSICAL = Case(slab=SLAB, slip_rule=SlipRule(residual_shear=1.0), max_events=None, max_displacement=4e-3)


def case_with(residual_shear=0.0, slip_order="worst_first", **changes):
    return replace(CASE, **{"slip_rule": SlipRule(slip_order=slip_order, residual_shear=residual_shear), **changes})


def walk(case, state, events=60):
    """So many events one at a time, the laws looked at after each, or up to the case's displacement."""
    assert_contact_laws(state, case, COMPLIANCE)
    for _ in range(events):
        record, state = slide_to_state(replace(case, max_events=1), COMPLIANCE, state)
        assert record.outcome.ok, record.outcome
        assert_contact_laws(state, case, COMPLIANCE)
        if state.displacement >= (case.max_displacement or math.inf):
            break


@pytest.mark.everyday
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
def test_the_contact_laws_hold_after_every_event(friction, changes, slip_order, residual_shear):
    case = case_with(residual_shear, slip_order, intrinsic_friction=friction, **changes)
    walk(case, initial_contact(case, COMPLIANCE))


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("friction", [0.0, 0.1, 0.5, 1.0])
def test_the_contact_laws_hold_after_every_event_of_classical_friction(friction, way):
    case = replace(CLASSICAL, intrinsic_friction=friction, initial_contact=way)
    walk(case, initial_contact(case, COMPLIANCE), 10_000)


@pytest.mark.parametrize("slip_order", ["worst_first", "simultaneous"])
def test_where_only_forward_shear_is_limited_the_laws_hold_and_nodes_keep_more_shear_backwards(slip_order):
    """A pin that sticks as it comes down pulls both sides inwards: its right half keeps shear beyond μ_i·pressure."""
    case = case_with(intrinsic_friction=0.05, slip_rule=SlipRule(slip_order=slip_order, limited_shear="forward"))
    state = initial_contact(case, COMPLIANCE)
    assert (-state.nodal_force[0] + 0.05 * state.nodal_force[1])[state.contact].max() > 1e-3 * case.normal_load
    walk(case, state)


def test_without_shear_against_the_drag_it_does_not_matter_which_shear_is_limited():
    """Without coupling no node is pushed back until all of them slip: the same bits."""
    rules = (SlipRule(limited_shear=limited) for limited in ("both_ways", "forward"))
    one, other = (slide(case_with(slip_rule=rule, max_events=40), half_plane(SLAB)) for rule in rules)
    np.testing.assert_array_equal(one.displacement, other.displacement)
    np.testing.assert_array_equal(one.force_after, other.force_after)


@pytest.mark.parametrize(("limited", "there"), [("both_ways", False), ("forward", True)])
def test_releases_trigger_events_only_where_shear_against_the_drag_is_free(limited, there):
    """With |shear| limited a node slips before its pressure is gone."""
    case = case_with(radius=1000.0, slip_rule=SlipRule(limited_shear=limited), max_events=1000)
    assert np.any(slide(case, COMPLIANCE).kind == EVENT_KINDS.index("release")) == there


def test_between_events_the_force_rises_with_the_recorded_stiffness():
    record = slide(CASE, COMPLIANCE)
    after = np.concatenate(([record.initial_force], record.force_after[:-1]))
    slope = np.concatenate(([record.initial_stiffness], record.stiffness[:-1]))
    steps = np.diff(record.displacement, prepend=0.0)
    np.testing.assert_allclose(after + slope * steps, record.force_before, atol=1e-11 * record.normal_load)
    assert steps.min() >= smallest_step(CASE, 3.0 * record.stiffness.max()) * (1 - 1e-6)


@pytest.mark.parametrize("changes", [{}, {"effects": Effects(pin_translation=False, coupling=False)}])
def test_a_displacement_limit_is_met_exactly_and_room_for_events_grows(changes, monkeypatch):
    monkeypatch.setattr(way, "FIRST_CAPACITY", 8)
    case = case_with(max_events=None, max_displacement=1.5e-3, **changes)
    record, state = slide_to_state(case, COMPLIANCE)
    assert record.outcome.ok
    assert len(record.kind) > 16
    assert record.final_displacement == state.displacement == 1.5e-3 > record.displacement[-1]
    assert record.final_force == pytest.approx(state.friction_force, abs=1e-11 * case.normal_load)
    same = slide(replace(case, max_events=len(record.kind)), COMPLIANCE)
    np.testing.assert_array_equal(same.displacement, record.displacement)


@pytest.mark.parametrize("far", [1e-3, 0.2], ids=["one window", "many windows"])
def test_following_a_window_of_nodes_changes_nothing(far, monkeypatch):
    """The same events as with every surface node followed, also where the contact walks out of its first window."""
    slab, rule = Slab(n_x=65), SlipRule(residual_shear=0.5)
    compliance = surface_compliance(slab)
    case = Case(0.2, 1.0, 1e-4, slab=slab, slip_rule=rule, max_events=None, max_displacement=far)
    windowed, state = slide_to_state(case, compliance)
    assert_contact_laws(state, case, compliance)
    monkeypatch.setattr(layout, "MARGIN", slab.n_x)
    whole = slide(case, compliance)
    count = min(len(whole.node), 200)  # beyond, rounding decides ties differently and the records part
    assert count > 20
    np.testing.assert_array_equal(windowed.node[:count], whole.node[:count])
    np.testing.assert_allclose(windowed.displacement[:count], whole.displacement[:count], rtol=1e-7)
    late = (each.force_before[each.displacement > far / 2].mean() for each in (windowed, whole))
    assert next(late) == pytest.approx(next(late), rel=0.02)


def test_with_constant_pressures_a_run_in_pieces_is_the_run_in_one():
    """To rounding: every piece starts from fresh sums. (With moving ones it has the same bits: see test_long_records.py.)"""
    case, found = case_with(effects=Effects(pin_translation=False, coupling=False)), []
    whole, state = slide(case, COMPLIANCE), initial_contact(case, COMPLIANCE)
    for _ in range(2):
        record, state = slide_to_state(replace(case, max_events=150), COMPLIANCE, state)
        found.append(record)
    for name in ("node", "slips", "displacement", "force_after"):
        np.testing.assert_allclose(
            np.concatenate([getattr(each, name) for each in found]), getattr(whole, name), rtol=1e-9
        )


def test_every_event_has_a_trigger_and_a_cascade_that_answers_it():
    record = slide(case_with(intrinsic_friction=0.25), COMPLIANCE)
    answers = np.column_stack((record.slips, record.releases, record.touches))
    assert np.all(answers[np.arange(300), record.kind] >= 1)
    sizes = np.concatenate(([record.initial_contact_size], record.contact_size))
    np.testing.assert_array_equal(np.diff(sizes), record.touches - record.releases)


def test_adhesive_stick_never_slips():
    record = slide(case_with(intrinsic_friction=math.inf, max_events=None, max_displacement=1e-3), COMPLIANCE)
    assert record.outcome.ok
    assert record.slips.sum() == 0
    assert record.final_force == pytest.approx(record.initial_stiffness * 1e-3, rel=0.2)  # releases soften it
    frozen = case_with(intrinsic_friction=math.inf, effects=FROZEN)
    stuck = slide(frozen, COMPLIANCE)
    assert stuck.outcome.ending is Ending.NO_EVENT
    pulled = slide(replace(frozen, max_events=None, max_displacement=1e-3), COMPLIANCE)
    assert pulled.final_force == pytest.approx(1e-3 * stuck.initial_stiffness + stuck.initial_force, rel=1e-12)


def test_where_nothing_can_ever_happen_the_record_says_so():
    """Every node in contact, none can slip, and without coupling no pressure changes."""
    slab = Slab(n_x=9)
    record = slide(Case(slab=slab, radius=1e6, intrinsic_friction=math.inf), half_plane(slab))
    assert record.outcome.ending is Ending.NO_EVENT
    assert "limits.displacement" in record.outcome.message
    assert len(record.kind) == 0


def test_a_punch_edge_that_comes_upon_the_next_node_is_an_outcome():
    slab = Slab(n_x=9)
    case = Case(0.05, slab=slab, pin="flat_punch", half_width=0.13, max_events=None, max_displacement=2.0)
    record = slide(case, surface_compliance(slab))
    assert record.outcome.ending is Ending.EDGE_REACHED
    assert "edge" in record.outcome.message
    # The next node stands at 0.25 and counts as reached half a node spacing before the punch's edge, 0.13, is there.
    assert record.final_displacement == pytest.approx(0.25 - 0.13 - 0.125 / 2, rel=0.01)


def test_a_cascade_can_be_given_up_and_a_contact_that_failed_to_form_gives_an_empty_record_with_its_reason():
    frozen = slide(case_with(effects=FROZEN, slip_rule=SlipRule(cascade_limit=3)), COMPLIANCE)
    unformed = slide(case_with(intrinsic_friction=0.05, slip_rule=SlipRule(cascade_limit=1)), COMPLIANCE)
    assert frozen.outcome.ending is unformed.outcome.ending is Ending.CASCADE_LIMIT
    assert len(unformed.kind) == 0


@pytest.mark.parametrize("limits", [{"max_events": 7}, {"max_displacement": 1e-3}], ids=["events", "displacement"])
@pytest.mark.parametrize(
    "changes", [{}, {"effects": FROZEN}, {"slip_rule": CLASSICAL.slip_rule}], ids=["whole", "frozen", "coulomb"]
)
def test_states_after_events_end_where_the_record_does(changes, limits):
    case = case_with(**(changes | limits))
    last = len(slide(case, COMPLIANCE).displacement)
    assert last > 1
    found, outcome = find_states(case, COMPLIANCE, (0, last, last + 1, 100_000))
    assert (len(found), outcome.ok) == (2, True)
    assert find_states(case, COMPLIANCE, (100_000,))[0] == []


def test_states_of_a_record_that_only_its_length_limits():
    case = replace(CASE, max_events=None, max_presliding=2.0)
    found, outcome = find_states(case, COMPLIANCE, (0, 3, 10**6))
    assert (len(found), outcome.ok) == (2, True)
    np.testing.assert_array_equal(found[1].u, find_states(replace(CASE, max_events=3), COMPLIANCE, (3,))[0][0].u)


@pytest.mark.parametrize(("load", "radius", "ending"), [(1e-2, 1.0, Ending.COMPLETED), (3e-2, 0.3, Ending.STEEP_PIN)])
def test_energy_created_on_a_flank_is_a_share_of_the_load_s_square(load, radius, ending):
    """Flanks steeper than μ_i, classical friction: at most 6e-5 W²/G is created in an event, and 3e-4 in the first one."""
    case = Case(
        0.03, radius, load, slab=Slab(17, 1.0, 0.0, scheme="half_plane"), slip_rule=SlipRule(residual_shear=1.0)
    )
    case = replace(case, max_events=60, max_displacement=0.2)
    record = slide(case, surface_compliance(case.slab))
    assert record.outcome.ending is ending
    assert -1e-4 < record.dissipated.min(initial=0.0) / load**2 < -2e-5 or not record.outcome.ok


def test_a_ball_too_steep_for_its_friction_slides_with_constant_pressures_as_advised():
    """The slope at the contact's edge is 0.22. With μ_i = 0.5 both ways agree, within 1 % (0.8 %)."""
    slab = Slab(13, 2.0 / 3.0, 0.49, scheme="layer")
    case = Case(0.5, 5.0 / 3.0, 0.1656, slab)
    found = {}
    for friction in (0.5, 0.3):
        for translation in (True, False):
            one = replace(case, intrinsic_friction=friction, effects=Effects(pin_translation=translation))
            record = slide(one, surface_compliance(slab))
            found[friction, translation] = plateau_of(record).mean / friction if record.outcome.ok else record.outcome
    assert found[0.3, True] is DOWNHILL
    assert found[0.5, False] == pytest.approx(found[0.5, True], rel=0.01)
    assert found[0.3, False] == pytest.approx(found[0.5, False], rel=0.02)


def test_energy_is_not_laid_to_a_slope_below_the_mean_shear_of_a_slip() -> None:
    """The slope at the contact's edge is 0.7 to 0.8 of μ_i, the mean shear of a slip 0.9 of μ_i·N."""
    case = case_with(0.8, max_events=9)
    start = initial_contact(case, COMPLIANCE)
    case = replace(case, intrinsic_friction=float(np.abs(start.x[start.contact]).max()) / case.radius / 0.7)
    record, end = slide_to_state(case, COMPLIANCE)
    created = replace(record, dissipated=-np.abs(record.dissipated))
    assert lawfulness(case, start, created, end).ending is Ending.ENERGY_CREATED


def test_a_failure_behind_the_end_of_the_record_is_not_the_cases():
    """This pin gets too steep where it touches, but long after its seventh event."""
    case = case_with(radius=25.0, max_events=7)
    behind = slide(replace(case, max_events=100_000), COMPLIANCE)
    assert (behind.outcome.ending, len(behind.displacement) > case.max_events) == (Ending.STEEP_PIN, True)
    found, outcome = find_states(case, COMPLIANCE, (0, 5, 100_000))
    assert (len(found), outcome.ending) == (2, Ending.COMPLETED)


FORCES = ("force_before", "force_after", "stiffness", "dissipated", "displacement")
COUNTS = ("kind", "slips", "releases", "touches", "contact_size")
ENDS = ("initial_force", "initial_stiffness", "final_displacement", "final_force", "outcome")
FLAT = Case(radius=20.0, slab=Slab(129, scheme="half_plane", poisson=0.3), max_events=300)
"""23 nodes in contact, far from the ends."""


@pytest.mark.everyday(3)
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(
    ("effects", "residual_shear"), [(Effects(), 0.0), (Effects(), 0.5), (Effects(), 1.0), (FROZEN, 0.0), (FROZEN, 0.5)]
)
def test_one_spacing_on_a_half_plane_is_the_same_one_node_further(way, effects, residual_shear):
    """Its matrix is Toeplitz to the bit and the positions are binary fractions: every number is computed from the same ones.
    Sums over all nodes may be added up in another order, by the shift of the window: 1e-12 allows for 300 events of that."""
    case = replace(FLAT, initial_contact=way, effects=effects, slip_rule=SlipRule(residual_shear=residual_shear))
    case = replace(case, max_events=60) if residual_shear == 1.0 else case
    here, next_to = (slide(replace(case, start=start), surface_compliance(FLAT.slab)) for start in (0.0, 1.0))
    assert here.outcome.ok
    assert len(here.node) == case.max_events
    assert np.array_equal(next_to.node, here.node + 1)
    for name in COUNTS:
        assert np.array_equal(getattr(next_to, name), getattr(here, name)), name
    for name in FORCES:
        mine, other = getattr(here, name), getattr(next_to, name)
        np.testing.assert_allclose(other, mine, rtol=0.0, atol=1e-12 * np.abs(mine).max(), err_msg=name)


def same(one, other):
    """Whether two records have the same bits."""
    columns = all(np.array_equal(getattr(one, name), getattr(other, name)) for name in (*FORCES, *COUNTS, "node"))
    return columns and all(getattr(one, name) == getattr(other, name) for name in ENDS)


LIMITED = {
    "slips": {},
    "some shear left": {"slip_rule": SlipRule(residual_shear=0.5)},
    "classical": {"slip_rule": CLASSICAL.slip_rule},
    "constant pressures": {"effects": FROZEN},
    "no coupling": {"effects": Effects(coupling=False)},
    "spread": {"heterogeneity": Heterogeneity(spread=0.2)},
}


@pytest.mark.parametrize("changes", LIMITED.values(), ids=LIMITED)
@pytest.mark.parametrize("spacings", [0.03, 0.7])
def test_a_limit_in_spacings_is_a_displacement(spacings, changes):
    """Ends at exactly that place, and has the bits of a record with that limit as displacement."""
    case, far = Case(radius=50.0, slab=SLAB, max_events=None, max_spacings=spacings, **changes), spacings * SLAB.spacing
    record = slide(case, COMPLIANCE)
    assert record.outcome.ok
    assert len(record.node) > 0 or spacings < 0.1
    assert record.final_displacement == far
    assert same(record, slide(replace(case, max_spacings=None, max_displacement=far), COMPLIANCE))


def test_whichever_limit_comes_first_ends_the_record():
    far, whole = SLAB.spacing, slide(Case(slab=SLAB, max_events=None, max_spacings=0.2), COMPLIANCE)
    for spacings, displacement in ((0.2, far), (5.0, 0.2 * far)):
        case = Case(slab=SLAB, max_events=10**6, max_spacings=spacings, max_displacement=displacement)
        assert same(whole, slide(case, COMPLIANCE))
    few = slide(Case(slab=SLAB, max_events=20, max_spacings=0.2), COMPLIANCE)
    assert len(few.node) == 20
    assert few.final_displacement == whole.displacement[19]


RECORDED = {
    "worst first": case_with(radius=50.0),
    "together": case_with(radius=50.0, slip_rule=SIMULTANEOUS),
    "constant pressures": case_with(radius=50.0, effects=FROZEN),
    "constant pressures, together": case_with(radius=50.0, effects=FROZEN, slip_rule=SIMULTANEOUS),
    "rough pin": case_with(radius=50.0, heterogeneity=Heterogeneity(roughness=((-0.1, 0.0), (0.0, 1e-5), (0.1, 0.0)))),
}


@pytest.mark.parametrize("case", RECORDED.values(), ids=RECORDED)
def test_extent_and_map_count_the_nodes_that_slipped(case):
    """Event by event: who slipped stands elsewhere on the pin. A node that slips there and back to the last bit was not seen."""
    state, slipped = initial_contact(case, COMPLIANCE), np.zeros(33, np.int64)
    for _ in range(12):
        before = state
        record, state = slide_to_state(replace(case, max_events=1), COMPLIANCE, state)
        # What rounding moves is 1e-16 of the slab's width, a slip at least 1e-9.
        moved = before.contact & (np.abs(state.slip - before.slip) > 1e-13) & state.contact
        gone = before.contact & ~state.contact  # a node may slip and leave
        assert int(moved.sum()) <= int(record.extent[0]) <= int(moved.sum() + gone.sum() + record.touches[0])
        assert (record.node_slips > 0).sum() == record.extent[0]
        slipped += record.node_slips
    whole = slide(replace(case, max_events=12), COMPLIANCE)
    np.testing.assert_array_equal(whole.node_slips, slipped)
    assert whole.extent.max() > 1


@pytest.mark.parametrize("changes", [{}, {"slip_rule": CLASSICAL.slip_rule}, {"effects": FROZEN}])
def test_columns_have_their_declared_types_and_the_map_holds_the_slips_of_all_events(changes):
    record = slide(case_with(radius=50.0, max_events=40, **changes), COMPLIANCE)
    for name, dtype in EVENT_TYPES.items():
        column = getattr(record, name)
        assert (column.dtype, column.shape, column.flags.writeable) == (np.dtype(dtype), (40,), False), name
    assert record.node_slips.sum() == record.slips.sum() > 0
    np.testing.assert_array_equal(record.extent > 0, record.slips > 0)
    assert (record.extent <= record.slips).all()
    np.testing.assert_allclose(record.node_x, np.linspace(-0.5, 0.5, 33))


def test_nodes_that_begin_to_slide_at_once_are_one_event():
    """On a half-plane without coupling both edges of a contact begin to slide at once, one node on either side."""
    slab = Slab(33, scheme="half_plane")
    case = replace(CLASSICAL, slab=slab, radius=50.0, effects=Effects(coupling=False), max_events=2)
    record = slide(case, surface_compliance(slab))
    np.testing.assert_array_equal(record.extent, [2, 2])
    slid = np.flatnonzero(record.node_slips)
    np.testing.assert_array_equal(slid, 32 - slid[::-1])


def test_a_force_that_falls_by_rounding_alone_falls_by_nothing():
    """Classical sliding goes on at μ_i·p: what is left is how well its roles are solved, and rounding."""
    found = drops(np.full(4, 0.3), 0.3 - np.array([1e-3, 2e-12, 5e-17, -1e-13]))
    np.testing.assert_allclose(found, [1e-3, 2e-12, 0.0, 0.0], rtol=1e-4)  # 2e-12 of 0.3: to 1e-17/2e-12
    assert not np.any(found[2:])
    record = slide(replace(CLASSICAL, radius=50.0, slab=Slab(17), max_events=10), surface_compliance(Slab(17)))
    before, after = (force / record.normal_load for force in (record.force_before, record.force_after))
    found = drops(before, after)
    assert np.all((found == 0.0) | (np.abs(found) > 1e-12))
    assert np.any((found == 0.0) & (before != after))


WIDE = Slab(n_x=65)
N, OF_WIDE = WIDE.n_x, surface_compliance(WIDE)
CONSTANT = Case(slab=WIDE, radius=100.0, max_events=300, effects=FROZEN)
GOODMAN = replace(CONSTANT, effects=Effects(pin_translation=False, coupling=False))
BOTH = pytest.mark.parametrize("case", [CONSTANT, GOODMAN], ids=["coupled initial contact", "Goodman"])


@BOTH
@pytest.mark.parametrize("slip_order", ["worst_first", "simultaneous"])
def test_with_constant_pressures_friction_and_equilibrium_hold_where_the_record_ends(case, slip_order):
    rule = SlipRule(slip_order=slip_order, residual_shear=0.3)
    case = replace(case, slip_rule=rule, heterogeneity=Heterogeneity(spread=0.2))
    start = initial_contact(case, OF_WIDE)
    record, end = slide_to_state(case, OF_WIDE, start)
    assert record.outcome.ok
    np.testing.assert_array_equal(end.pressure, start.pressure)
    assert np.all(np.abs(end.nodal_force[0]) <= -node_friction(case) * end.nodal_force[1] + 1e-11 * case.normal_load)
    along = OF_WIDE.matrix[:N, :N] @ end.nodal_force[0]
    if case.effects.coupling:
        along += OF_WIDE.matrix[:N, N:] @ end.nodal_force[1]
    np.testing.assert_allclose(end.u, along, atol=1e-10 * case.normal_load)
    assert end.friction_force == pytest.approx(record.final_force, abs=1e-11 * case.normal_load)


@BOTH
def test_with_constant_pressures_every_event_is_a_slip_and_loses_energy(case):
    record = slide(case, OF_WIDE)
    assert len(record.displacement) == 300
    assert not np.any([record.kind, record.releases, record.touches])
    assert record.dissipated.min() > 0.0
    np.testing.assert_allclose(record.stiffness, record.initial_stiffness, rtol=1e-14)  # the same sum in two orders


def test_after_first_touch_only_the_tangential_block_is_read(monkeypatch):
    """Without coupling either; no tableau of normal and tangential entries is set up."""
    start, matrix = initial_contact(GOODMAN, OF_WIDE), np.full_like(OF_WIDE.matrix, np.nan)
    matrix[:N, :N] = OF_WIDE.matrix[:N, :N]
    whole = slide(GOODMAN, OF_WIDE, start)
    monkeypatch.setattr(sliding, "initial_contact", None)
    monkeypatch.setattr(full_contact, "compile_contact", None)
    alone = slide(GOODMAN, SurfaceCompliance(matrix, WIDE), start)
    for name in ("displacement", "force_after", "node", "slips", "dissipated"):
        np.testing.assert_array_equal(getattr(alone, name), getattr(whole, name))


def test_what_means_nothing_is_refused():
    with pytest.raises(InvalidInput, match=r"residual_shear = 1\.0 with pin_translation = false"):
        replace(CONSTANT, slip_rule=CLASSICAL.slip_rule)
    with pytest.raises(InvalidInput, match="friction = false"):
        slide(replace(CONSTANT, effects=Effects(friction=False)), OF_WIDE)
    with pytest.raises(InvalidInput, match="needs a finite"):
        replace(CLASSICAL, intrinsic_friction=math.inf)


def test_a_record_takes_no_more_room_than_its_events_need(monkeypatch):
    """Not for all that it may hold: a limit of 1e9 events beside a displacement is 70 GB. The events are the same ones."""
    whole, room, empty = slide(CONSTANT, OF_WIDE), [], way.empty_events
    monkeypatch.setattr(way, "empty_events", lambda capacity: room.append(capacity) or empty(min(capacity, 1024)))
    monkeypatch.setattr(way, "FIRST_CAPACITY", 8)
    far = float(whole.displacement[-1]) * (1.0 + 1e-12)
    for limited in (CONSTANT, replace(CONSTANT, max_events=10**9, max_displacement=far)):
        record = slide(limited, OF_WIDE)
        for name in ("displacement", "force_before", "force_after", "node", "slips", "dissipated"):
            np.testing.assert_array_equal(getattr(record, name), getattr(whole, name))
    assert room == 2 * [8, 16, 32, 64, 128, 256, 512]


def test_a_pin_that_is_not_carried_along_is_as_steep_as_at_first_touch():
    """A parabola dragged three quarters of a slab to the side would stand on a flank of 50° there."""
    case = replace(
        CONSTANT, radius=0.5, normal_load=1e-4, intrinsic_friction=10.0, max_events=None, max_displacement=0.75
    )
    assert slide(case, OF_WIDE).outcome.ok


def test_a_shear_that_is_no_number_is_seen():
    """No comparison in the kernel is true of it: nothing would seem to slip."""
    start = initial_contact(GOODMAN, OF_WIDE)
    u = start.u.copy()
    u[np.flatnonzero(start.contact)[0]] = np.nan
    assert slide(GOODMAN, OF_WIDE, replace(start, u=u)).outcome.ending is Ending.ROUNDING


@pytest.mark.parametrize("friction", [0.25, 0.5, 1.0])
def test_classical_friction_ends_at_the_intrinsic_friction(friction):
    record, state = slide_to_state(replace(CLASSICAL, intrinsic_friction=friction), COMPLIANCE)
    assert record.final_force == pytest.approx(friction * record.normal_load, rel=1e-12)
    # On the way there the force only rises: nothing drops, and a step meets its event to rounding.
    assert np.all(np.diff(record.force_before) >= -1e-9 * record.normal_load)
    np.testing.assert_allclose(record.force_after, record.force_before, atol=1e-9 * record.normal_load)
    assert np.all(np.abs(state.slip[state.contact]) > 0.0)


def test_a_long_classical_slide_has_a_plateau_at_the_intrinsic_friction():
    """The pin walks over the slab: nodes are released behind it and touched in front, F/W stays μ_i."""
    case = replace(CLASSICAL, slab=WIDE, radius=20.0, intrinsic_friction=0.2, max_displacement=0.25)
    record = slide(case, OF_WIDE)
    assert record.outcome.ok, record.outcome
    assert min(record.releases.sum(), record.touches.sum()) > 5
    assert plateau_of(record).outcome.ok
    assert plateau_of(record).mean == pytest.approx(0.2, rel=1e-3)


def test_friction_too_large_for_any_motion_is_an_outcome():
    record = slide(replace(CLASSICAL, intrinsic_friction=10.0, max_displacement=0.3), COMPLIANCE)
    assert record.outcome.ending is Ending.SLIP_UNBOUNDED
    assert "friction law" in record.outcome.message
    assert np.isfinite(record.force_after).all()


@pytest.mark.parametrize("operator", [half_plane, coupled_half_plane])
def test_the_work_of_pin_and_load_is_stored_or_dissipated_in_classical_sliding(operator):
    """To what the pin's curvature bends of forces between events: 5e-10 of the work seen."""
    case = replace(CLASSICAL, slab=replace(SLAB, poisson=0.2), max_displacement=1e-3)
    compliance = operator(case.slab)
    start, events = initial_contact(case, compliance), len(slide(case, compliance).node)
    # Up to the last event: what is lost on the way to a next one is not in the record.
    record, end = slide_to_state(replace(case, max_events=events, max_displacement=None), compliance, start)
    found = energy(case, start, record, end)
    assert events > 5
    assert found.missing < 1e-8
    assert found.lost > 0.1 * found.work
    assert record.dissipated.min() >= -1e-9 * found.work


def test_a_pin_that_slides_on_and_on_leaves_the_slab(monkeypatch):
    monkeypatch.setattr(friction_record, "OFF_THE_SLAB", 5e-3)
    record = slide(replace(CLASSICAL, max_displacement=None, max_events=10**6), COMPLIANCE)
    assert record.outcome.ending is Ending.CONTACT_LOST
    assert record.final_displacement == record.displacement[-1]
    assert "half_width" not in record.outcome.message


def test_a_punch_that_passes_between_two_nodes_is_too_narrow_for_them():
    """It has not left the slab: shorter records, as advised before, would only end before they say so."""
    punch = Case(slab=SLAB, pin="flat_punch", half_width=1e-9, start=0.51, normal_load=1e-3)
    record = slide(punch, COMPLIANCE)
    assert record.outcome.ending is Ending.CONTACT_LOST
    assert "raise half_width, or n_x" in record.outcome.message


worst_violation = for_python(kernels.worst_violation)


def worst(shear, pressure, friction, strength=None, opposite=-1.0, ahead=1):
    strength = np.zeros(len(shear)) if strength is None else strength
    node, tension = worst_violation(shear, -pressure, friction, strength, np.isfinite(friction), 1e-15, opposite, ahead)
    return int(node), float(tension)


@pytest.mark.parametrize("seed", range(20))
def test_the_worst_offender_is_the_node_with_the_largest_ratio_and_of_mirror_twins_the_one_further_ahead(seed):
    rng = np.random.default_rng(seed)
    shear, pressure, limits = rng.normal(size=45), rng.uniform(0.1, 1.0, 45), rng.uniform(0.1, 1.0, 45)
    limits[rng.random(45) < 0.3] = np.nan  # free or stuck for ever
    ratio = np.nan_to_num(np.abs(shear) / (limits * pressure))
    assert worst(shear, pressure, limits) == (int(np.argmax(ratio)), 0.0)
    strength = rng.uniform(0.0, 0.3, 45)
    with_strength = np.nan_to_num(np.abs(shear) / (limits * pressure + strength))
    assert worst(shear, pressure, limits, strength) == (int(np.argmax(with_strength)), 0.0)
    assert worst(shear * 0.99 / ratio.max(), pressure, limits) == (-1, 0.0)
    pressure[np.flatnonzero(np.isfinite(limits))[3]] = -2.0
    assert worst(shear, pressure, limits)[1] == 2.0
    # Ratios over all magnitudes, so that some lie on the edge of a cut; a few ulps more or less on the left twin.
    for ratio in (*(1.0 + 10.0 ** rng.uniform(-6, 2, 200)), *(1.0 + rng.integers(1, 2**20, 200) * 2.0**-37)):
        shear = np.full(45, 0.5)
        left, right = sorted(rng.choice(45, 2, replace=False))
        shear[right] = ratio
        shear[left] = -ratio * (1.0 + rng.integers(-4, 5) * np.finfo(float).eps)
        assert worst(shear, np.ones(45), np.ones(45))[0] == right
        assert worst(shear, np.ones(45), np.ones(45), ahead=-1)[0] == left
