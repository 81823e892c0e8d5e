"""A rough pin: straight pieces added to the parabola; and nodes with μ_i of their own. The laws of contact are the same.

No node beyond the window that its kernels follow can touch the pin, so the record is that of the whole surface.
"""

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from nanoslip.solver.case import Case, Distribution, Effects, Heterogeneity, InitialContact, SlipRule, make_image
from nanoslip.solver.contact.compiled_contact import contact_value, has_node_beyond_window
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.kernels.path import follow_path
from nanoslip.solver.contact.kernels.state import Rise, Stop, slip_on_rough
from nanoslip.solver.contact.pin import make_pin, node_friction, roughness_slopes
from nanoslip.solver.contact.window import nodes_in_reach
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.ensemble import Ensemble
from nanoslip.solver.outcome import COMPLETED, Ending, InvalidInput
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding import full_contact
from nanoslip.solver.sliding.full_contact import compile_state, slide_full_contact
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.slide import slide, slide_to_state
from nanoslip.solver.sliding.validity import Flag, contact_flags, predict_flags
from nanoslip.solver.sliding.way import Way, allocate_events, first_room
from tests.conftest import for_python
from tests.physics import assert_contact_laws

SLAB = Slab(n_x=33)
CASE = Case(slab=SLAB, radius=50.0, max_events=60)
COMPLIANCE = surface_compliance(SLAB)
WAYS = get_args(InitialContact)


def profile(xi, heights):
    return tuple(zip(xi.tolist(), heights.tolist(), strict=True))


def rough(points, case=CASE, **changes):
    return replace(case, heterogeneity=Heterogeneity(roughness=points), **changes)


def random_profile(height, points=301, seed=3):
    return profile(np.linspace(-0.6, 0.6, points), height * np.random.default_rng(seed).standard_normal(points))


@pytest.mark.parametrize("height", [1e-5, 3e-4])
@pytest.mark.parametrize("way", WAYS)
def test_the_laws_of_contact_hold_at_first_touch_and_where_the_record_ends(height, way):
    case = rough(random_profile(height), initial_contact=way)
    assert_contact_laws(initial_contact(case, COMPLIANCE), case, COMPLIANCE)
    record, state = slide_to_state(case, COMPLIANCE)
    assert record.outcome.ok
    assert record.touches.any()
    assert_contact_laws(state, case, COMPLIANCE)


XI = np.linspace(-0.6, 0.6, 40_001)
EQUAL = {
    # Any height, as only differences matter; 1e-10 of the load: other sums lead to the same events.
    "level": (Heterogeneity(roughness=profile(XI[::1000], np.full(41, 1e-3))), 50.0, 60, 1e-10),
    # Half of the curvature given as 40 000 straight pieces: heights off by 1e-12, so are the first ten events' forces.
    "a parabola in pieces": (Heterogeneity(roughness=profile(XI, XI**2 / 200.0)), 100.0, 10, 1e-6),
    # 1e-9 is what a spread of 1e-12 and rounding make of forces in 60 events.
    "vanishing spread": (Heterogeneity(spread=1e-12), 50.0, 60, 1e-9),
    # A pin that is steep where nothing touches it is what it would be without: to the rounding of its heights.
    "a wall in front": (Heterogeneity(roughness=((0.4, 0.0), (0.4 + 1e-9, 0.01))), 50.0, 60, 1e-9),
    "a wall behind": (Heterogeneity(roughness=((-0.4, 0.01), (-0.4 + 1e-9, 0.0))), 50.0, 60, 1e-9),
}


@pytest.mark.parametrize("slip_order", ["worst_first", "simultaneous"])
@pytest.mark.parametrize(("pin", "radius", "events", "off"), EQUAL.values(), ids=EQUAL)
def test_what_is_no_roughness_is_a_smooth_pin(pin, radius, events, off, slip_order):
    case = replace(CASE, slip_rule=SlipRule(slip_order=slip_order), max_events=events)
    smooth = slide(case, COMPLIANCE)
    found = slide(replace(case, radius=radius, heterogeneity=pin), COMPLIANCE)
    assert found.outcome.ok
    np.testing.assert_array_equal(found.node, smooth.node)
    np.testing.assert_allclose(found.force_after, smooth.force_after, atol=off * case.normal_load)


def test_a_node_rests_where_its_shear_is_first_gone():
    """By brute force: |shear| falls through residual_shear·μ_i·pressure nowhere before the distance that the kernel finds."""
    points = random_profile(2e-4, 601)
    height = make_pin(rough(points)).height
    knots, heights = np.ascontiguousarray(np.array(points).T)
    rise = Rise(knots, heights[None], np.zeros(1, np.int64))
    rng, bent, slip = np.random.default_rng(5), 0, for_python(slip_on_rough)
    for _ in range(50):
        xi, shear = rng.uniform(-0.1, 0.1), rng.choice([-1.0, 1.0]) * rng.uniform(0.02, 0.1)
        share = 0.3 * 0.5 * np.sign(shear)  # of the pressure, 0.05
        excess, sideways, downwards = shear - 0.05 * share, 1.3 + 0.2 * share, -0.3 + 1.1 * share
        along, down = slip(excess, sideways, downwards, 0, xi, 1.0 / CASE.radius, rise)
        path = np.linspace(0.0, along, 20_001)[:-1]
        climbed = height(xi + path) - height(np.array(xi))
        left = excess + sideways * path + downwards * climbed
        assert np.all(np.sign(left[:-1]) == np.sign(excess))
        assert abs(left[-1]) < 1e-3 * abs(excess)
        assert down == pytest.approx(float(height(np.array(xi + along)) - height(np.array(xi))))
        bent += abs(along) > 0.002
    assert bent > 25  # more than one piece of the profile


def test_the_slope_is_that_of_the_height_and_the_steepest_of_stretches_the_largest_of_what_lies_in_them():
    """By brute force at 20 001 places of each stretch: none is steeper than what is found, and the steepest is as steep."""
    pin = make_pin(rough(random_profile(1e-4)))
    xi = np.linspace(-0.7, 0.7, 998)  # none of them a knot
    np.testing.assert_allclose(pin.slope(xi), (pin.height(xi + 1e-9) - pin.height(xi - 1e-9)) / 2e-9, atol=1e-6)
    left = np.random.default_rng(7).uniform(-0.7, 0.6, 5)
    right = left + np.array([0.0, 1e-3, 0.01, 0.1, 0.3])
    for one in (slice(1, 2), slice(2, 3), slice(3, 5), slice(0, 5)):
        brute = float(np.abs(pin.slope(np.linspace(left[one], right[one], 20_001))).max())
        # How far the nearest place may be.
        assert brute * (1 - 1e-12) <= pin.steepest(left[one], right[one]) <= brute + 0.3 / 20_000 * pin.curvature
    assert pin.steepest(left[:1], right[:1]) == 0.0  # nothing lies in it
    assert make_pin(CASE).steepest(np.array([0.1]), np.array([0.2])) == pytest.approx(0.2 / CASE.radius)


def wall(at, height=2e-5, **changes):
    """A smooth pin, but for a wall 1e-9 wide that makes its rear lower, and a gentle ramp far in front."""
    return rough(((at, 0.0), (at + 1e-9, height), (0.5, height), (1.0, 0.0)), **changes)


@pytest.mark.parametrize("way", WAYS)
def test_a_wall_between_two_nodes_under_the_contact_is_a_steep_pin(way):
    case = wall(-0.05, initial_contact=way)
    state = initial_contact(case, COMPLIANCE)
    places = COMPLIANCE.x + state.u
    assert state.contact[np.searchsorted(places, -0.05) - 1 :][:2].all()  # both of its neighbours touch
    assert np.abs(make_pin(case).slope(places)[state.contact]).max() < 0.1  # which do not stand on it
    assert state.outcome.ending is Ending.STEEP_PIN
    assert not len(slide(case, COMPLIANCE).displacement)


def test_a_wall_beside_which_nodes_are_free_under_the_contact_is_a_steep_pin():
    """On a fine grid the nodes next to it do not touch: no neighbours in contact have it between them."""
    step = ((-0.1, 0.0), (-0.05, 0.0), (-0.049999999, 2e-5), (0.05, 2e-5), (0.1, 0.0))
    case = rough(step, Case(slab=Slab(n_x=129), intrinsic_friction=0.1))
    state = initial_contact(case, surface_compliance(case.slab))
    assert np.diff(np.flatnonzero(state.contact)).max() > 1
    assert state.outcome.ending is Ending.STEEP_PIN


def test_a_wall_that_the_contact_comes_upon_as_it_slides_is_a_steep_pin():
    """Friction drags the contact back, over a wall that is at first behind it."""
    at = float(COMPLIANCE.x[initial_contact(CASE, COMPLIANCE).contact][0]) - 0.4 * SLAB.spacing
    case = wall(at, 1e-6, max_events=20_000, max_spacings=1.5)
    assert initial_contact(case, COMPLIANCE).outcome.ok
    assert slide(case, COMPLIANCE).outcome.ending is Ending.STEEP_PIN


def test_constant_pressures_feel_roughness_at_first_touch_only():
    case = rough(random_profile(1e-4), effects=Effects(pin_translation=False))
    record, state = slide_to_state(case, COMPLIANCE)
    assert record.outcome.ok
    np.testing.assert_array_equal(state.pressure, initial_contact(case, COMPLIANCE).pressure)


POINTS = ((0.0, 0.0), (0.1, 1e-5))
REFUSED = {
    "pin = 'flat_punch' with roughness: needs a parabola": lambda: rough(POINTS, pin="flat_punch"),
    r"residual_shear = 1\.0 with roughness": lambda: rough(POINTS, slip_rule=SlipRule(residual_shear=1.0)),
    "points with increasing ξ": lambda: rough(((0.1, 0.0), (0.1, 1.0))),
    "no or at least 2 points": lambda: rough(((0.1, 0.0),)),
    r"spread = 0\.3: needs 0 ≤ spread ≤ 0\.25 with normal": lambda: Heterogeneity("normal", 0.3),
    "needs a mean that can be spread": lambda: Case(np.inf, heterogeneity=Heterogeneity(spread=0.1)),
}


@pytest.mark.parametrize("said", REFUSED)
def test_what_means_nothing_is_refused(said):
    with pytest.raises(InvalidInput, match=said):
        REFUSED[said]()


def random_scene(seed):
    """Pins from nearly smooth ones to some that ride on a few tips, on slabs of any shape."""
    rng = np.random.default_rng(seed)
    slab = Slab(int(rng.choice([65, 129, 257])), poisson=rng.uniform(0.0, 0.45), aspect_ratio=rng.uniform(0.3, 3.0))
    xi = np.arange(-1.2, 1.2, rng.uniform(0.3, 6.0) * slab.spacing)
    heights = 10.0 ** rng.uniform(-7.0, -3.5) * rng.standard_normal(len(xi))
    case = Case(
        slab=slab,
        radius=10.0 ** rng.uniform(0.3, 2.0),
        normal_load=10.0 ** rng.uniform(-4.0, -2.5),
        intrinsic_friction=10.0 ** rng.uniform(-1.0, 0.3),
        heterogeneity=Heterogeneity(spread=0.1, roughness=profile(xi, heights)),
        max_events=4000,
    )
    return case, surface_compliance(slab)


@pytest.mark.everyday(3)
@pytest.mark.parametrize("seed", range(12))
def test_no_node_beyond_the_window_ever_lies_inside_a_rough_pin(seed):
    """Looked at after every tenth event, all along the record."""
    case, compliance = random_scene(seed)
    compiled = compile_state(case, compliance, initial_contact(case, compliance), whole=False)
    events, node_slips, held = first_room(case.max_events), np.zeros(case.slab.n_x, np.int64), 0
    status = Stop.FULL
    while held < len(events.displacement) and status in (Stop.FULL, Stop.WINDOW_TOO_NARROW):
        room = allocate_events(events, min(held + 10, len(events.displacement)))
        status, held = follow_path(compiled.state, compiled.constants, room, node_slips, held, np.inf)
        state = contact_value(compiled, COMPLETED)
        assert not has_node_beyond_window(compiled, state)
        if status == Stop.WINDOW_TOO_NARROW:
            compiled = compile_state(case, compliance, state, whole=False)


@pytest.mark.parametrize("seed", [0, 3, 6])
def test_a_rough_pin_slides_within_windows_as_on_the_whole_surface(seed, monkeypatch):
    """The same slips of the same nodes; forces to what rounding grows to in four thousand events."""
    case, compliance = random_scene(seed)
    start = initial_contact(case, compliance)
    found = slide_full_contact(case, start, compliance, Way(case.normal_load)).record
    monkeypatch.setattr(full_contact, "nodes_in_reach", lambda *_: np.ones(case.slab.n_x, np.bool_))
    whole = slide_full_contact(case, start, compliance, Way(case.normal_load)).record
    np.testing.assert_array_equal(found.node, whole.node)
    np.testing.assert_array_equal(found.slips, whole.slips)
    np.testing.assert_allclose(found.force_after, whole.force_after, atol=1e-7 * case.normal_load)


def test_windows_that_do_not_last_give_way_to_the_whole_surface(monkeypatch):
    """Seven nodes whose every tenth event lifts the surface: 1400 windows in 4000 events took twelve times as long as none."""
    (case, compliance), windows = random_scene(79), []

    def seen(*given):
        windows.append((compiled := compile_state(*given)).window)
        return compiled

    monkeypatch.setattr(full_contact, "compile_state", seen)
    record = slide_full_contact(case, initial_contact(case, compliance), compliance, Way(case.normal_load)).record
    assert len(record.displacement) == case.max_events
    assert len(windows[0]) < 65 == len(windows[-1])
    assert len(windows) < 2 * full_contact.AT_FIRST


def test_a_slightly_rough_pin_is_not_followed_by_all_of_a_fine_slab():
    """But by less than twice what follows a smooth one: slips cost what the window is wide."""
    smooth, widths = Case(slab=Slab(n_x=513), radius=10.0), []
    compliance = surface_compliance(smooth.slab)
    for case in (rough(random_profile(1e-7, 401, seed=1), smooth), smooth):
        window = compile_state(case, compliance, initial_contact(case, compliance), whole=False).window
        widths.append(len(window))
    assert widths[0] < 2 * widths[1] < 513 / 3


def test_a_pin_that_touches_in_spots_is_followed_everywhere():
    """The surface between its tips and beyond may tilt anyhow when one of them gives way."""
    case = rough(((-1.0, 0.0), (1.0, 1e-9)), Case(slab=Slab(n_x=65)))
    level, spots = np.zeros(65), np.isin(np.arange(65), [20, 30, 31, 44])
    assert nodes_in_reach(case, spots, level, level).all()
    assert not nodes_in_reach(case, np.abs(np.arange(65) - 32) < 4, level, level).all()


@pytest.mark.parametrize("distance", [1e-4, 0.02, 0.3])
def test_a_profile_within_a_distance_is_nowhere_below_its_bounds(distance):
    """By brute force at 2001 places around each of 50; far from the bounds it is not either."""
    pin = make_pin(random_scene(1)[0])
    xi = np.random.default_rng(2).uniform(-1.4, 1.4, 50)
    around = xi[:, None] + distance * np.linspace(-1.0, 1.0, 2001)
    lowest, smooth = pin.lower_bound(xi, distance), 0.5 * pin.curvature * around**2
    roughness, rounding = pin.height(around) - smooth, 1e-15 * pin.height(around).max()
    assert (lowest <= pin.height(around).min(axis=1) + rounding).all()
    assert (np.ptp(roughness, axis=1) <= 2.0 * pin.largest_fall(distance) + rounding).all()
    assert (lowest >= smooth.min(axis=1) - np.ptp(roughness) + roughness.min() - rounding).all()


MANY = Case(intrinsic_friction=0.4, slab=Slab(n_x=16385))


@pytest.mark.parametrize("distribution", get_args(Distribution))
def test_mean_and_spread_of_drawn_friction_are_those_asked_for(distribution):
    """Of 16385 draws: four standard errors of a mean are 0.6 % at spread 0.2, of a standard deviation about 3 %."""
    drawn = node_friction(replace(MANY, heterogeneity=Heterogeneity(distribution, 0.2)))
    assert drawn.min() >= 0.0
    assert drawn.mean() == pytest.approx(0.4, rel=0.0063)
    assert drawn.std() == pytest.approx(0.08, rel=0.03)


def test_drawn_friction_is_the_same_everywhere_and_for_ever():
    drawn = node_friction(Case(slab=Slab(n_x=5), heterogeneity=Heterogeneity("uniform", 0.5, seed=7)))
    once = [0.6083358519779096, 0.8439972423734283, 0.7387508112121854, 0.2620224457545418, 0.3269389262004996]
    np.testing.assert_allclose(drawn, once, rtol=1e-14)


def test_seeds_differ_other_parameters_do_not_matter_and_no_spread_draws_nothing(monkeypatch):
    one, other = (replace(MANY, heterogeneity=Heterogeneity(spread=0.3, seed=seed)) for seed in (1, 2))
    drawn = node_friction(one)
    assert not np.any(drawn == node_friction(other))
    np.testing.assert_array_equal(drawn, node_friction(replace(one, normal_load=1.0, radius=1.0)))
    np.testing.assert_allclose(2.0 * drawn, node_friction(replace(one, intrinsic_friction=0.8)), rtol=1e-15)
    monkeypatch.setattr(np.random, "PCG64", None)
    assert np.all(node_friction(replace(MANY, heterogeneity=Heterogeneity("uniform", 0.0, seed=5))) == 0.4)


@pytest.mark.parametrize("residual_shear", [0.0, 1.0])
def test_every_node_obeys_its_own_limit(residual_shear):
    """The laws of contact hold at the end, with each node's own μ_i in place of the mean; some exceed the mean's limit."""
    own, rule = Heterogeneity(spread=0.3), SlipRule(residual_shear=residual_shear)
    case = replace(CASE, max_events=40, slip_rule=rule, heterogeneity=own)
    record, state = slide_to_state(case, COMPLIANCE)
    assert record.outcome.ok
    assert_contact_laws(state, replace(CASE, intrinsic_friction=np.inf), COMPLIANCE)
    normal, shear = -state.nodal_force[1], np.abs(state.nodal_force[0])
    assert np.all(shear <= node_friction(case) * normal + 1e-11 * case.normal_load)
    assert np.any(shear > 0.5 * normal)


def test_slopes_that_nodes_miss_are_those_of_what_is_left_between_them():
    """Of waves of length λ straight lines a spacing apart leave k·spacing/√12 of the slope, if short; of knots all."""
    xi = np.linspace(-0.5, 0.5, 20_001)
    waves = make_image(profile(xi, 1e-5 * np.sin(2.0 * np.pi * xi / 0.1)))
    slope, missed = roughness_slopes(waves, 1e-3)
    assert slope == pytest.approx(1e-5 * 2.0 * np.pi / 0.1 / np.sqrt(2.0), rel=1e-3)
    assert missed / slope == pytest.approx(2.0 * np.pi / 0.1 * 1e-3 / np.sqrt(12.0), rel=1e-2)
    assert roughness_slopes(waves, 1.0)[1] == pytest.approx(slope, rel=1e-2)
    knots = make_image(random_profile(1e-5, 4801))
    assert roughness_slopes(knots, 1.0 / 64.0)[1] == pytest.approx(roughness_slopes(knots, 1.0 / 64.0)[0], rel=0.02)
    assert roughness_slopes(knots, 1.2 / 4800.0)[1] < 1e-6 * roughness_slopes(knots, 1.0)[0]
    assert roughness_slopes(make_image(()), 0.1) == (0.0, 0.0)
    wide = make_image(((-1e6, 0.0), (0.0, 1.0), (1e6, 0.0)))  # of 10^13 nodes three cells have a knot
    assert roughness_slopes(wide, 2e-7)[1] < 1e-6 * roughness_slopes(wide, 2e-7)[0]


@pytest.mark.parametrize("n_x", [65, 129])
def test_a_profile_that_nodes_miss_is_flagged_before_and_after(n_x):
    """A knot every 0.002 L_x, whose slope is 7 % of the contact's: nodes four times and eight times as far apart."""
    coarse = rough(
        random_profile(2e-7, 601), replace(CASE, slab=Slab(n_x, scheme="strip")), max_events=None, max_presliding=3.0
    )
    assert Flag.unresolved_roughness in predict_flags(coarse)
    start = initial_contact(coarse, surface_compliance(coarse.slab))
    assert Flag.unresolved_roughness in contact_flags(coarse, start)
    assert Flag.unresolved_roughness not in predict_flags(replace(coarse, slab=Slab(2049, scheme="strip")))
    assert Flag.unresolved_roughness not in predict_flags(
        replace(coarse, radius=1e-3 * coarse.radius)
    )  # its slope is not felt


@pytest.mark.slow  # 513 nodes
def test_a_profile_that_nodes_miss_rubs_less():
    """Random knots every 0.002 L_x, with 7 % of the contact's slope: 13 % less at 65 nodes than at 513, of four starts."""
    points = random_profile(2e-7, 601, seed=1)
    case = rough(points, Case(slab=Slab(65, scheme="strip")), max_events=None, max_presliding=3.0)
    found = {}
    for n_x in (65, 513):
        cases = [Ensemble(4).case(replace(case, slab=Slab(n_x, scheme="strip")), member) for member in range(4)]
        records = [slide(each, surface_compliance(each.slab)) for each in cases]
        found[n_x] = np.mean([plateau_of(record).mean for record in records])
    assert found[65] < 0.96 * found[513]


def test_a_profile_shorter_than_the_contact_is_flagged():
    case = rough(profile(np.linspace(-0.05, 0.05, 11), np.zeros(11)), replace(CASE, slab=Slab(65, scheme="strip")))
    assert Flag.short_profile in predict_flags(case)
    wide = profile(np.linspace(-0.5, 0.5, 11), np.zeros(11))
    assert Flag.short_profile not in predict_flags(replace(case, heterogeneity=Heterogeneity(roughness=wide)))
