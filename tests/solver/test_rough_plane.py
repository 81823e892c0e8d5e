"""A rough ball: an image of heights added to the paraboloid, one profile for each row of nodes, under the laws of contact."""

from dataclasses import replace
from itertools import product
from typing import get_args

import numpy as np
import pytest

from nanoslip.solver.case import Case, Heterogeneity, InitialContact, SlipRule
from nanoslip.solver.contact.compiled_contact import contact_value, has_node_beyond_window
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.kernels.path import follow_path
from nanoslip.solver.contact.kernels.state import Stop
from nanoslip.solver.contact.pin import make_pin
from nanoslip.solver.effects import OF_CASES
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.ensemble import Ensemble, elsewhere
from nanoslip.solver.outcome import COMPLETED, Ending, InvalidInput
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding import full_contact
from nanoslip.solver.sliding.full_contact import compile_state, slide_full_contact
from nanoslip.solver.sliding.slide import slide, slide_to_state
from nanoslip.solver.sliding.validity import Flag, lawfulness, predict_flags
from nanoslip.solver.sliding.way import Way, allocate_events, first_room
from tests.hard_cases.following import follow
from tests.physics import assert_contact_laws

A, R = 0.25, 200.0


def ball(n_x=17, scheme="half_space", **more):
    """A ball whose contact has Hertz's radius A: 50 nodes."""
    slab = Slab(n_x, poisson=0.3, scheme=scheme)
    usual = {"radius": R, "max_events": 300, "start": 0.37, "start_y": 0.21, "normal_load": 8 * A**3 / (3 * R * 0.7)}
    return Case(slab=slab, **{**usual, **more})


def points_of(xi, y, heights):
    """Points of heights (len(xi), len(y))."""
    places = product(np.asarray(xi).tolist(), np.asarray(y).tolist())
    return tuple((*place, height) for place, height in zip(places, np.asarray(heights).ravel().tolist(), strict=True))


def image(height, points=41, seed=3, width=1.2):
    places = np.linspace(-width / 2, width / 2, points)
    return points_of(places, places, height * np.random.default_rng(seed).standard_normal((points, points)))


def rough(points, case=None, **changes):
    return replace(case or ball(), heterogeneity=Heterogeneity(roughness=points), **changes)


@pytest.mark.everyday(4)
@pytest.mark.parametrize("scheme", ["half_space", "layer"])
@pytest.mark.parametrize("height", [1e-5, 3e-4])
@pytest.mark.parametrize("way", get_args(InitialContact))
def test_the_laws_of_contact_hold_at_first_touch_and_where_the_record_ends(height, way, scheme):
    case = rough(image(height), ball(scheme=scheme, initial_contact=way))
    compliance = surface_compliance(case.slab)
    assert_contact_laws(initial_contact(case, compliance), case, compliance)
    record, state = slide_to_state(case, compliance)
    assert record.outcome.ok
    assert_contact_laws(state, case, compliance)


@pytest.mark.everyday(1)
@pytest.mark.parametrize("slip_order", ["worst_first", "simultaneous"])
def test_an_image_without_heights_is_a_smooth_ball(slip_order):
    """The same events; forces to the rounding of another formula for the step to a touch."""
    case = ball(slip_rule=SlipRule(slip_order=slip_order))
    compliance = surface_compliance(case.slab)
    smooth, flat = (slide(each, compliance) for each in (case, rough(image(0.0), case)))
    np.testing.assert_array_equal(flat.node, smooth.node)
    np.testing.assert_allclose(flat.force_after, smooth.force_after, atol=1e-9 * case.normal_load)


def test_each_row_of_nodes_has_the_profile_at_its_own_y():
    """Of grooves along y that of plane strain, to the bit; else between lines of the image, and the outermost beyond."""
    xi, y = np.linspace(-0.6, 0.6, 31), np.linspace(-0.3, 0.3, 5)
    grooves = 1e-4 * np.random.default_rng(1).standard_normal(31)
    profile = make_pin(
        Case(heterogeneity=Heterogeneity(roughness=tuple(zip(xi.tolist(), grooves.tolist(), strict=True))))
    )
    alike = make_pin(rough(points_of(xi, y, np.repeat(grooves[:, None], 5, axis=1))))
    np.testing.assert_array_equal(alike.rises, np.repeat(profile.rises, 17, axis=0))
    case = rough(points_of(xi, y, grooves[:, None] * [0.0, 1.0, 3.0, 1.0, 5.0]))
    found = make_pin(case).rises / grooves
    rows = np.linspace(-0.5, 0.5, 17) - 0.21 / 16
    np.testing.assert_allclose(found, np.repeat(np.interp(rows, y, [0.0, 1.0, 3.0, 1.0, 5.0])[:, None], 31, axis=1))


def ridge(curvature):
    """A ridge along the drag, of this curvature across it over ξ from -1 to 1, that three rows of nodes bear."""
    xi, y = np.linspace(-1.0, 1.0, len(curvature)), np.linspace(-0.5, 0.5, 17)
    case = ball(start=0.0, start_y=0.0, radius=0.7, normal_load=0.12, intrinsic_friction=2.0)
    return rough(points_of(xi, y, np.multiply.outer(curvature, y**2 / 2)), case)


BLUNT, SHARP = ridge(np.full(65, 30.0)), ridge(30.0 + 5.0 * (np.arange(65) % 2))
"""Slope 0.94 under the nodes of neighbouring rows; 1.1 between them."""


def test_a_flank_across_the_drag_between_two_nodes_is_a_steep_pin():
    compliance = surface_compliance(BLUNT.slab)
    one, other = (initial_contact(each, compliance) for each in (BLUNT, SHARP))
    np.testing.assert_array_equal(one.contact, other.contact)
    assert (one.outcome.ending, other.outcome.ending) == (Ending.COMPLETED, Ending.STEEP_PIN)


def test_a_flank_across_the_drag_where_a_record_ends_is_a_steep_pin():
    start = initial_contact(BLUNT, compliance := surface_compliance(BLUNT.slab))
    record, end = slide_to_state(BLUNT, compliance, start)
    assert record.outcome.ok
    assert [lawfulness(each, start, record, end).ending for each in (BLUNT, SHARP)] == [
        Ending.COMPLETED,
        Ending.STEEP_PIN,
    ]


def test_the_order_of_an_images_points_is_of_no_effect():
    case, points = ball(max_events=50), image(1e-5, 12)
    compliance = surface_compliance(case.slab)
    one, other = (slide(rough(each, case), compliance) for each in (points, points[::-1]))
    np.testing.assert_array_equal(one.force_after, other.force_after)


def random_scene(seed):
    """From nearly smooth balls to some that ride on a few tips; every second has bumps one pixel wide."""
    rng = np.random.default_rng(seed)
    n_x, tip = int(rng.choice([9, 17, 25])), 10.0 ** rng.uniform(-6.0, -2.3)
    heights = rng.standard_normal((40, 40)) if seed % 2 else -1.0 * (rng.random((40, 40)) < 0.03)
    width = rng.uniform(0.4, 1.5)
    scheme = str(rng.choice(["half_space", "layer"]))
    case = Case(
        slab=Slab(n_x, poisson=rng.uniform(-0.2, 0.5), scheme=scheme, aspect_ratio=rng.uniform(0.3, 3.0)),
        radius=10.0 ** rng.uniform(0.5, 2.5),
        normal_load=10.0 ** rng.uniform(-6.0, -3.0),
        intrinsic_friction=10.0 ** rng.uniform(-1.0, 0.3),
        start=rng.random(),
        start_y=rng.random(),
        max_events=1500,
    )
    places = np.linspace(-width / 2, width / 2, 40)
    return rough(points_of(places, places, tip * heights), case), surface_compliance(case.slab)


def lawful(seed):
    """How a scene's record ended, after its laws have been held."""
    case, compliance = random_scene(seed)
    seen = follow(replace(case, max_events=50), compliance, events=2, whole=case.max_events)
    assert not seen.broken
    assert all(seen.messages)
    return seen.endings


@pytest.mark.everyday(4)
@pytest.mark.parametrize("seed", range(24))
def test_every_scene_is_lawful_or_ends_with_advice(seed):
    assert lawful(seed)


@pytest.mark.everyday(3)
@pytest.mark.parametrize("seed", range(12))
def test_no_node_beyond_the_window_ever_lies_inside_a_rough_ball(seed):
    """Looked at after every twentieth event, all along the record."""
    case, compliance = random_scene(seed)
    start = initial_contact(case, compliance)
    if not start.outcome.ok:
        return
    compiled, held, status = compile_state(case, compliance, start, whole=False), 0, Stop.FULL
    events = first_room(case.max_events)
    while held < len(events.displacement) and status in (Stop.FULL, Stop.WINDOW_TOO_NARROW):
        room, slips = (
            allocate_events(events, min(held + 20, len(events.displacement))),
            np.zeros(len(compiled.window), np.int64),
        )
        status, held = follow_path(compiled.state, compiled.constants, room, slips, held, np.inf)
        state = contact_value(compiled, COMPLETED)
        assert not has_node_beyond_window(compiled, state)
        if status == Stop.WINDOW_TOO_NARROW:
            compiled = compile_state(case, compliance, state, whole=False)


@pytest.mark.everyday(1)
@pytest.mark.parametrize("height", [1e-6, 3e-5])
def test_a_rough_ball_slides_within_windows_as_on_the_whole_plane(height, monkeypatch):
    """Over one spacing and a half, several windows: the same slips of the same nodes; forces to what rounding grows to."""
    case = rough(image(height, 60), ball(radius=20.0, normal_load=2e-4, max_events=None, max_spacings=1.5))
    compliance, windows = surface_compliance(case.slab), []
    start = initial_contact(case, compliance)

    def seen(*given):
        windows.append((compiled := compile_state(*given)).window)
        return compiled

    monkeypatch.setattr(full_contact, "compile_state", seen)
    found = slide_full_contact(case, start, compliance, Way(case.normal_load)).record
    assert len(windows) > 1
    assert len(windows[0]) < case.slab.nodes
    monkeypatch.setattr(full_contact, "nodes_in_reach", lambda *_: np.ones(case.slab.nodes, np.bool_))
    whole = slide_full_contact(case, start, compliance, Way(case.normal_load)).record
    np.testing.assert_array_equal(found.node, whole.node)
    np.testing.assert_array_equal(found.slips, whole.slips)
    np.testing.assert_allclose(found.force_after, whole.force_after, atol=1e-7 * case.normal_load)


@pytest.mark.parametrize("distance", [1e-4, 0.02, 0.3])
def test_an_image_within_a_distance_is_nowhere_below_its_bounds(distance):
    """By brute force at 501 places around each node."""
    pin, case = make_pin(rough(image(1e-4))), ball()
    xi = np.repeat(np.random.default_rng(2).uniform(-0.8, 0.8, 17), 17)
    around = np.array([pin.unbounded_height(xi + distance * share) for share in np.linspace(-1.0, 1.0, 501)])
    lowest = pin.lower_bound(xi, distance)
    assert (lowest <= around.min(axis=0) + 1e-15).all()
    assert (lowest > around.min(axis=0) - 8e-4).all()
    assert case.slab.nodes == len(lowest)


def test_members_have_places_along_and_across_on_the_image_continued_by_its_mirror():
    """Heights of a bilinear ramp: triangular waves along both axes, at the place in each period."""
    case = rough(points_of(xi := np.linspace(-0.5, 0.5, 5), xi, np.add.outer(xi, 10.0 * xi)))
    moved = np.array(elsewhere(case.heterogeneity.roughness, 0.3, 0.8))
    wave = lambda place: 0.5 - np.abs((place + 0.5) % 2.0 - 1.0)  # noqa: E731  -0.5 at -0.5, 0.5 at 0.5, and back
    np.testing.assert_allclose(moved[:, 2], wave(moved[:, 0] + 0.6) + 10.0 * wave(moved[:, 1] + 1.6), atol=1e-12)
    assert (moved.min(axis=0)[:2], moved.max(axis=0)[:2]) == (pytest.approx([-0.5, -0.5]), pytest.approx([0.5, 0.5]))
    drawn = [Ensemble(4).case(case, number).heterogeneity.roughness for number in range(4)]
    assert len(set(drawn)) == 4
    assert all(len({points[:, axis].tobytes() for points in map(np.array, drawn)}) == 4 for axis in (0, 1))
    given = Ensemble(4, places="given").case(case, 2)
    assert given.heterogeneity.roughness == case.heterogeneity.roughness


def test_an_image_that_rows_miss_or_that_is_smaller_than_the_contact_is_flagged():
    """Waves across the drag, and along it, shorter than two spacings; an image of half of the contact's width."""
    places = np.linspace(-0.6, 0.6, 121)
    waves = np.repeat(1e-4 * np.sin(2.0 * np.pi * places / 0.08)[:, None], 121, axis=1)
    for heights in (waves, waves.T):
        coarse = rough(points_of(places, places, heights))
        assert Flag.unresolved_roughness in predict_flags(coarse)
        assert Flag.unresolved_roughness not in predict_flags(replace(coarse, slab=replace(coarse.slab, n_x=129)))
    assert Flag.short_profile in predict_flags(rough(image(1e-6, width=0.3)))
    assert Flag.short_profile not in predict_flags(coarse)


REFUSED = {
    "scheme": lambda: Case(heterogeneity=Heterogeneity(roughness=image(1e-6, 3))),
    "a hole": lambda: Heterogeneity(roughness=image(1e-6, 3)[:-1]),
    "a place twice": lambda: Heterogeneity(roughness=(*image(1e-6, 3)[:-1], image(1e-6, 3)[0])),
    "one line": lambda: Heterogeneity(roughness=image(1e-6, 3)[::3]),
    "numbers": lambda: Heterogeneity(roughness=((0.0, 0.0), (0.1, 0.0, 0.0))),
    "too near": lambda: Heterogeneity(roughness=points_of([0.0, 1e-13], [0.0, 1.0], np.zeros((2, 2)))),
    "a disc": lambda: rough(image(1e-6, 3), pin="flat_punch"),
    "Coulomb": lambda: rough(image(1e-6, 3), slip_rule=SlipRule(residual_shear=1.0)),
}


@pytest.mark.parametrize("wrong", REFUSED)
def test_what_is_no_image_or_is_not_computed_is_refused(wrong):
    with pytest.raises(InvalidInput):
        REFUSED[wrong]()


def test_a_rough_ball_is_compared_with_no_cylinder():
    there = {effect.name for effect in OF_CASES if effect.there(rough(image(1e-6)))}
    assert "roughness" in there
    assert "third_dimension" not in there
