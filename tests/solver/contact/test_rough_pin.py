"""A rough pin: straight pieces added to the parabola. Its kernels are compiled for it alone; the laws of contact are the same."""

from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects, Heterogeneity, InitialContact, SlipOrder, SlipRule
from nanoslip.solver.contact.compiled_contact import compiled_contact
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.kernels.state import RoughPin, slip_on_rough
from nanoslip.solver.contact.pin import pin_of
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.outcome import Ending, InvalidInput
from nanoslip.solver.parameter import Roughness
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.slide import slide, slide_to_state
from tests.physics import assert_contact_laws, half_plane

SLAB = Slab(n_x=33)
CASE = Case(slab=SLAB, radius=50.0, max_events=60)
COMPLIANCE = surface_compliance(SLAB)


def rough(points: Roughness, case: Case = CASE) -> Case:
    return replace(case, heterogeneity=Heterogeneity(roughness=points))


def random_profile(height: float, points: int = 301) -> Roughness:
    heights = height * np.random.default_rng(3).standard_normal(points)
    return tuple(zip(np.linspace(-0.6, 0.6, points).tolist(), heights.tolist(), strict=True))


@pytest.mark.parametrize("height", [1e-5, 3e-4])
@pytest.mark.parametrize("way", ["stick", "frictionless", "gradual"])
def test_the_laws_of_contact_hold_at_first_touch_and_where_the_record_ends(height: float, way: InitialContact) -> None:
    case = rough(random_profile(height), replace(CASE, initial_contact=way))
    assert_contact_laws(initial_contact(case, COMPLIANCE), case, COMPLIANCE)
    record, state = slide_to_state(case, COMPLIANCE)
    assert record.outcome.ok
    assert record.touches.any()
    assert_contact_laws(state, case, COMPLIANCE)


@pytest.mark.parametrize("slip_order", ["worst_first", "simultaneous"])
def test_a_level_profile_is_a_smooth_pin(slip_order: SlipOrder) -> None:
    """Any height, as only differences matter; 1e-10 of the load: other sums lead to the same events."""
    case = replace(CASE, slip_rule=SlipRule(slip_order=slip_order))
    level = tuple((xi, 1e-3) for xi in np.linspace(-0.5, 0.5, 41).tolist())
    smooth, found = slide(case, COMPLIANCE), slide(rough(level, case), COMPLIANCE)
    np.testing.assert_array_equal(found.node, smooth.node)
    np.testing.assert_allclose(found.force_after, smooth.force_after, atol=1e-10 * case.normal_load)


def test_a_parabola_in_pieces_is_a_parabola() -> None:
    """Half of the curvature given as 40 000 straight pieces: heights off by 1e-12, so are the first ten events' forces."""
    xi = np.linspace(-0.6, 0.6, 40_001)
    half = replace(CASE, radius=100.0, max_events=10)
    pieces = tuple(zip(xi.tolist(), (xi**2 / 200.0).tolist(), strict=True))
    smooth, found = slide(replace(CASE, max_events=10), COMPLIANCE), slide(rough(pieces, half), COMPLIANCE)
    np.testing.assert_array_equal(found.node, smooth.node)
    np.testing.assert_allclose(found.force_after, smooth.force_after, atol=1e-6 * CASE.normal_load)


def test_a_node_rests_where_its_shear_is_first_gone() -> None:
    """By brute force: |shear| falls through residual_shear·μ_i·pressure nowhere before the distance that the kernel finds."""
    points = random_profile(2e-4, 601)
    case = rough(points, replace(CASE, slip_rule=SlipRule(residual_shear=0.3)))
    pin = RoughPin(pin_of(case).curvature, *(np.ascontiguousarray(part) for part in np.array(points).T))
    rng = np.random.default_rng(5)
    tableau = np.array([[1.3, 0.2], [-0.3, 1.1]])
    bent = 0
    for _ in range(50):
        xi, shear = rng.uniform(-0.1, 0.1), rng.choice([-1.0, 1.0]) * rng.uniform(0.02, 0.1)
        y = np.array([shear, -0.05, 0.0])
        along, down = slip_on_rough(y, tableau, np.array([0.5]), 0, xi, pin, 0.3)
        share = 0.3 * 0.5 * np.sign(shear)
        path = np.linspace(0.0, along, 20_001)[:-1]
        climbed = pin_of(case).height(xi + path) - pin_of(case).height(np.array(xi))
        excess = y[0] + share * y[1] + (1.3 + share * 0.2) * path + (-0.3 + share * 1.1) * climbed
        assert np.all(np.sign(excess[:-1]) == np.sign(excess[0]))
        assert abs(excess[-1]) < 1e-3 * abs(excess[0])
        assert down == pytest.approx(
            float(pin_of(case).height(np.array(xi + along)) - pin_of(case).height(np.array(xi)))
        )
        bent += abs(along) > 0.002
    assert bent > 25  # more than one piece of the profile


def test_energy_is_lost_in_every_event_on_a_reciprocal_operator() -> None:
    compliance = half_plane(SLAB)
    record = slide(rough(random_profile(1e-5)), compliance)
    assert record.outcome.ok
    slips = record.dissipated[(record.releases == 0) & (record.touches == 0)]
    assert len(slips) > 20
    assert slips.min() > 0.0


def test_the_slope_is_that_of_the_height() -> None:
    pin = pin_of(rough(random_profile(1e-4)))
    xi = np.linspace(-0.7, 0.7, 998)  # none of them a knot
    numeric = (pin.height(xi + 1e-9) - pin.height(xi - 1e-9)) / 2e-9
    np.testing.assert_allclose(pin.slope(xi), numeric, atol=1e-6)


def test_the_steepest_slope_of_stretches_is_the_largest_of_what_lies_in_them() -> None:
    """By brute force at 20 001 places of each stretch: none is steeper than what is found, and the steepest is as steep."""
    pin = pin_of(rough(random_profile(1e-4)))
    left = np.random.default_rng(7).uniform(-0.7, 0.6, 5)
    right = left + np.array([0.0, 1e-3, 0.01, 0.1, 0.3])
    for one in (slice(1, 2), slice(2, 3), slice(3, 5), slice(0, 5)):
        places = np.linspace(left[one], right[one], 20_001)
        brute = float(np.abs(pin.slope(places)).max())
        found = pin.steepest(left[one], right[one])
        assert brute * (1 - 1e-12) <= found <= brute + 0.3 / 20_000 * pin.curvature  # how far the nearest place may be
    assert pin.steepest(left[:1], right[:1]) == 0.0  # nothing lies in it
    assert pin_of(CASE).steepest(np.array([0.1]), np.array([0.2])) == pytest.approx(0.2 / CASE.radius)


def wall(at: float, height: float = 2e-5) -> Case:
    """A smooth pin, but for a wall 1e-9 wide that makes its rear lower, and a gentle ramp far in front."""
    return rough(((at, 0.0), (at + 1e-9, height), (0.5, height), (1.0, 0.0)))


@pytest.mark.parametrize("way", ["stick", "frictionless", "gradual"])
def test_a_wall_between_two_nodes_under_the_contact_is_a_steep_pin(way: InitialContact) -> None:
    case = replace(wall(-0.05), initial_contact=way)
    state = initial_contact(case, COMPLIANCE)
    places = COMPLIANCE.x + state.u
    assert state.contact[np.searchsorted(places, -0.05) - 1 :][:2].all()  # both of its neighbours touch
    assert np.abs(pin_of(case).slope(places)[state.contact]).max() < 0.1  # which do not stand on it
    assert state.outcome.ending is Ending.STEEP_PIN
    assert not len(slide(case, COMPLIANCE).displacement)


def test_a_wall_beside_which_nodes_are_free_under_the_contact_is_a_steep_pin() -> None:
    """On a fine grid the nodes next to it do not touch: no neighbours in contact have it between them."""
    slab = Slab(n_x=129)
    step = ((-0.1, 0.0), (-0.05, 0.0), (-0.049999999, 2e-5), (0.05, 2e-5), (0.1, 0.0))
    case = rough(step, Case(slab=slab, intrinsic_friction=0.1))
    state = initial_contact(case, surface_compliance(slab))
    touching = np.flatnonzero(state.contact)
    assert np.diff(touching).max() > 1
    assert state.outcome.ending is Ending.STEEP_PIN


def test_a_wall_that_the_contact_comes_upon_as_it_slides_is_a_steep_pin() -> None:
    """Friction drags the contact back, over a wall that is at first behind it."""
    at = float(COMPLIANCE.x[initial_contact(CASE, COMPLIANCE).contact][0]) - 0.4 * SLAB.spacing
    case = replace(wall(at, 1e-6), max_events=20_000, max_spacings=1.5)
    assert initial_contact(case, COMPLIANCE).outcome.ok
    assert slide(case, COMPLIANCE).outcome.ending is Ending.STEEP_PIN


@pytest.mark.parametrize("at", [-0.4, 0.4])
def test_a_wall_beside_the_contact_is_allowed(at: float) -> None:
    """A pin that is steep where nothing touches it is what it would be without: to the rounding of its heights."""
    away = rough(((at, 0.01 * (at < 0.0)), (at + 1e-9, 0.01 * (at > 0.0))))
    record, smooth = slide(away, COMPLIANCE), slide(CASE, COMPLIANCE)
    assert record.outcome.ok
    np.testing.assert_allclose(record.force_after, smooth.force_after, atol=1e-9 * CASE.normal_load)


def test_constant_pressures_feel_roughness_at_first_touch_only() -> None:
    case = replace(rough(random_profile(1e-4)), effects=Effects(pin_translation=False))
    record, state = slide_to_state(case, COMPLIANCE)
    assert record.outcome.ok
    np.testing.assert_array_equal(state.pressure, initial_contact(case, COMPLIANCE).pressure)


def test_a_smooth_pin_has_no_profile() -> None:
    contact, level = np.abs(COMPLIANCE.x) < 0.1, np.zeros(33)
    compiled = compiled_contact(CASE, COMPLIANCE, contact, level, level, contact)
    assert isinstance(compiled.constants.pin, float)
    assert pin_of(CASE).knots is None


def test_what_means_nothing_is_refused() -> None:
    points = ((0.0, 0.0), (0.1, 1e-5))
    with pytest.raises(InvalidInput, match="roughness with pin = flat_punch: needs a parabola"):
        rough(points, replace(CASE, pin="flat_punch"))
    with pytest.raises(InvalidInput, match=r"roughness with residual_shear = 1\.0"):
        rough(points, replace(CASE, slip_rule=SlipRule(residual_shear=1.0)))
    with pytest.raises(InvalidInput, match="points with increasing ξ"):
        Heterogeneity(roughness=((0.1, 0.0), (0.1, 1.0)))
    with pytest.raises(InvalidInput, match="no or at least 2 points"):
        Heterogeneity(roughness=((0.1, 0.0),))
    with pytest.raises(InvalidInput, match="finite numbers"):
        Heterogeneity(roughness=((0.1, 0.0), (0.2, float("inf"))))
