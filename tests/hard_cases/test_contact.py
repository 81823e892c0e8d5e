"""Hard contacts: from one node to all, loads and radii over many decades, corners, punch edges between nodes, far from centre."""

import math
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from numpy.typing import NDArray

from nanoslip.solver.case import Case, Effects, Heterogeneity, InitialContact, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.soundness import COARSEST_HEIGHTS, rounding_share
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.elasticity.compliance import EndlessCompliance, SurfaceCompliance
from nanoslip.solver.outcome import Ending
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.slide import slide
from tests.hard_cases.following import Followed, compliance_of, follow
from tests.physics import ROWS, assert_contact_laws
from tests.rounding import blurred_compliance, blurred_convolution

WAYS: tuple[InitialContact, ...] = get_args(InitialContact)
N = 33
H = 1.0 / (N - 1)
LOADS = [10.0**exponent for exponent in (-12, -9, -6, -4, -2, -1)]
RADII = [10.0**exponent for exponent in (-1, 1, 4, 6)]


def _case(scheme: str, **changes: object) -> Case:
    return Case(**{"slab": Slab(n_x=N, scheme=scheme), "max_events": 1, **changes})  # type: ignore[arg-type]


def _loads_and_radii(scheme: str, way: InitialContact, rule: SlipRule) -> dict[str, Case]:
    pairs = [(normal_load, 200.0) for normal_load in LOADS] + [(1e-3, radius) for radius in (*RADII, 500.0, 2000.0)]
    pairs += [(1e-12, 0.1), (1e-12, 1e6), (1e-1, 0.1), (1e-1, 1e6)]
    return {
        f"W {normal_load:.0e} R {radius:g}": _case(
            scheme, normal_load=normal_load, radius=radius, initial_contact=way, slip_rule=rule
        )
        for normal_load, radius in pairs
    }


PUNCHES = {
    "half a node": H / 2,
    "just below a node": 0.25 - 1e-12,
    "at a node": 0.25,
    "just beyond a node": 0.25 + 1e-12,
    "just below the middle of two nodes": 0.25 + H / 2 - 1e-12,
    "middle of two nodes": 0.25 + H / 2,
    "just beyond the middle of two nodes": 0.25 + H / 2 + 1e-12,
    "to the corners": 0.5,
    "much less than a node": 1e-9,
}

SLIDERS = {
    "one node": {"radius": 0.1, "normal_load": 1e-6, "max_displacement": 0.2},
    "stuck over less than the event floor": {"radius": 0.1, "normal_load": 1e-9, "max_displacement": 1e-3},
    "one and two nodes in turn": {"radius": 2.0, "normal_load": 1e-5, "max_displacement": 0.2},
    "far off the centre": {"radius": 5.0, "normal_load": 1e-3, "intrinsic_friction": 0.1, "max_displacement": 0.4},
    "to the corner": {"radius": 1.0, "normal_load": 1e-3, "intrinsic_friction": 0.1, "max_displacement": 0.6},
}


def _follow(case: Case, events: int = 12, whole: int | None = 100) -> Followed:
    return follow(case, compliance_of(case.slab), events, whole)


def _dragged(scheme: str, name: str) -> Followed:
    """In pieces of 5 events, the state after each checked, on the way to the far end; then in one piece."""
    return _follow(_case(scheme, **{**SLIDERS[name], "max_events": 5}), 80, None)


@pytest.mark.everyday(5)
@pytest.mark.parametrize("scheme", ROWS)
@pytest.mark.parametrize("way", WAYS)
def test_the_laws_hold_for_every_load_and_radius(way: InitialContact, scheme: str) -> None:
    for name, case in _loads_and_radii(scheme, way, SlipRule()).items():
        seen = _follow(case)
        assert seen.states > 0, (name, seen.messages)
        assert not seen.broken, name


@pytest.mark.everyday(1)
@pytest.mark.parametrize("scheme", ROWS)
def test_the_laws_hold_for_every_load_and_radius_with_coulomb_friction(scheme: str) -> None:
    """Residual 1 has a solver of its own."""
    for name, case in _loads_and_radii(scheme, "stick", SlipRule(residual_shear=1.0)).items():
        seen = _follow(replace(case, max_displacement=0.05), events=4, whole=8)
        assert seen.states > 0, (name, seen.messages)
        assert not seen.broken, name


@pytest.mark.parametrize("scheme", ROWS)
@pytest.mark.parametrize("half_width", PUNCHES.values(), ids=PUNCHES.keys())
def test_a_punch_stands_on_the_nodes_whose_greater_part_it_covers(half_width: float, scheme: str) -> None:
    case = _case(scheme, pin="flat_punch", half_width=half_width, intrinsic_friction=0.5)
    seen = _follow(case)
    assert not seen.broken
    if seen.states == 0:
        # Pressing may already pull the next node under the sharp edge.
        assert set(seen.endings) == {Ending.EDGE_REACHED}
        return
    # An edge exactly between two nodes goes to the narrower contact; one node always carries.
    covered = np.abs(np.linspace(-0.5, 0.5, N)) <= half_width + 0.499 * H
    np.testing.assert_array_equal(initial_contact(case, compliance_of(case.slab)).contact, covered)


@pytest.mark.everyday(5)
@pytest.mark.parametrize("scheme", ROWS)
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name.startswith("stuck") else name for name in SLIDERS]
)
def test_the_laws_hold_far_from_the_centre(name: str, scheme: str) -> None:
    seen = _dragged(scheme, name)
    assert not seen.broken
    if (scheme, name) == ("chain", "to the corner"):
        # On springs the pin sinks in until its flanks are half as steep as μ_i.
        assert Ending.STEEP_PIN in seen.endings
        return
    assert seen.record is not None
    assert seen.end is not None
    assert seen.record.outcome.ok, seen.messages
    expected = {"one node": {1}, "one and two nodes in turn": {1, 2}, "to the corner": {1}}
    assert set(seen.record.contact_size) >= expected.get(name, set())
    if name == "to the corner":
        reached = seen.end.first_node + np.flatnonzero(seen.end.contact)
        assert (
            reached.min() > N - 1 if seen.end.first_node else list(reached) == [N - 1]
        )  # without ends there is no corner


@pytest.mark.parametrize("scheme", ROWS)
def test_one_node_sinks_by_its_own_compliance(scheme: str) -> None:
    """Reference: approach = W·C_zz of the middle node, pressure = W/h, until a neighbour touches."""
    case = _case(scheme, normal_load=1e-9, radius=1.0, intrinsic_friction=math.inf, initial_contact="frictionless")
    compliance = compliance_of(case.slab)
    state = initial_contact(case, compliance)
    middle = N // 2
    assert list(np.flatnonzero(state.contact)) == [middle]
    assert state.approach == pytest.approx(case.normal_load * compliance.matrix[N + middle, N + middle], rel=1e-13)
    assert state.pressure[middle] == pytest.approx(case.normal_load / H, rel=1e-13)


FRICTIONLESS = {"with friction": Effects(), "without": Effects(friction=False)}


@pytest.mark.parametrize("scheme", ["galerkin", "biquadratic"])
@pytest.mark.parametrize("half_width", [0.25, 0.4])
@pytest.mark.parametrize("effects", FRICTIONLESS.values(), ids=FRICTIONLESS.keys())
def test_a_node_pushed_out_from_under_the_edge_is_named(effects: Effects, half_width: float, scheme: str) -> None:
    """Without friction, at ν = 0.49, a heavy punch pushes its last nodes outwards by more than half a spacing."""
    slab = Slab(n_x=129, scheme=scheme, poisson=0.49)
    punch = Case(slab=slab, pin="flat_punch", half_width=half_width, normal_load=0.15, initial_contact="frictionless")
    state = initial_contact(replace(punch, effects=effects), compliance_of(slab))
    assert state.outcome.ending is Ending.EDGE_REACHED
    assert 'initial_contact = "stick"' in state.outcome.message
    assert initial_contact(replace(punch, initial_contact="stick"), compliance_of(slab)).outcome.ok


@pytest.mark.parametrize("scheme", ["galerkin", "biquadratic", "half_plane"])
@pytest.mark.parametrize("effects", FRICTIONLESS.values(), ids=FRICTIONLESS.keys())
def test_a_node_pulled_in_under_the_edge_is_named(effects: Effects, scheme: str) -> None:
    """At ν = 0 a heavy punch on one node pulls its neighbours, which stand higher, in under its edge."""
    slab = Slab(n_x=17, scheme=scheme, poisson=0.0)
    punch = Case(slab=slab, pin="flat_punch", half_width=0.025, normal_load=0.06, initial_contact="frictionless")
    state = initial_contact(replace(punch, effects=effects), compliance_of(slab))
    assert state.outcome.ending is Ending.EDGE_REACHED, state.gap[~state.contact].min()
    assert "lower normal_load" in state.outcome.message
    for residual_shear in (0.0, 1.0):  # slips or Coulomb friction decide first, and no other way down helps
        held = replace(punch, initial_contact="stick", slip_rule=SlipRule(residual_shear=residual_shear))
        outcome = initial_contact(held, compliance_of(slab)).outcome
        assert outcome.ending is Ending.EDGE_REACHED
        assert "without friction" not in outcome.message
    light = initial_contact(replace(punch, effects=effects, normal_load=1e-3), compliance_of(slab))
    assert light.outcome.ok
    assert light.gap.min() >= 0.0


def _profile(height: float, seed: int = 4) -> Heterogeneity:
    rises = height * np.random.default_rng(seed).uniform(0.0, 1.0, 61)
    return Heterogeneity(roughness=tuple(zip(np.linspace(-0.6, 0.6, 61).tolist(), rises.tolist(), strict=True)))


@pytest.mark.parametrize("scheme", ROWS)
@pytest.mark.parametrize("way", WAYS)
def test_heights_whose_rounding_outweighs_the_load_are_named(way: InitialContact, scheme: str) -> None:
    """A height of 1e-3 is known to 2e-19: that is much of what 1e-18 displaces, and little of what 1e-12 does."""
    rough = _case(scheme, radius=200.0, heterogeneity=_profile(1e-3), initial_contact=way)
    compliance = compliance_of(rough.slab)
    for normal_load in (1e-25, 1e-18):
        outcome = initial_contact(replace(rough, normal_load=normal_load), compliance).outcome
        assert outcome.ending is Ending.ROUNDING, normal_load
        assert "raise normal_load" in outcome.message
    assert not _follow(replace(rough, normal_load=1e-12)).broken
    assert initial_contact(replace(rough, normal_load=1e-12), compliance).outcome.ok


@pytest.mark.parametrize("scheme", ROWS)
def test_forces_are_known_as_well_as_heights_are(scheme: str) -> None:
    """Every height wrong by a rounding: forces change by at most 3 times the share of `COARSEST_HEIGHTS` (measured: 1.4)."""
    for seed in range(12):
        rng, normal_load = np.random.default_rng(seed), 10.0 ** -(9.0 + 0.5 * seed)
        rises = 10.0 ** rng.uniform(-6.0, -1.0) + 3.0 * normal_load * rng.standard_normal(61)
        wrong = rises * (1.0 + np.finfo(float).eps * rng.integers(-1, 2, 61))
        first, second = (_pressed_rough(scheme, normal_load, heights) for heights in (rises, wrong))
        state, share = first
        assert state.outcome.ok is (share <= COARSEST_HEIGHTS)
        if state.outcome.ok:
            # Below 1e-10 other roundings are seen.
            noise = float(np.abs(state.nodal_force - second[0].nodal_force).max()) / normal_load
            assert noise <= 3.0 * share + 1e-10


def test_what_is_rounded_of_a_smooth_pin_is_its_height_at_the_outermost_node() -> None:
    """A parabola is a circle's cap, to a share of (ξ/2R)²; the load displaces the softest of the nodes in contact the most."""
    case, outermost = _case("galerkin", radius=300.0, normal_load=1e-3), 0.25
    height = case.radius - math.sqrt(case.radius**2 - outermost**2)
    softness, contact = np.array([9.0, 2.0, 4.0, 9.0]), np.array([False, True, True, False])
    share = rounding_share(case, softness, contact, outermost)
    assert share * 4.0 * case.normal_load / (np.finfo(float).eps * height) == pytest.approx(1.0, rel=1e-6)


def _pressed_rough(scheme: str, normal_load: float, rises: NDArray[np.float64]) -> tuple[ContactState, float]:
    points = tuple(zip(np.linspace(-0.6, 0.6, 61).tolist(), rises.tolist(), strict=True))
    case = _case(
        scheme, normal_load=normal_load, radius=0.1 / normal_load, heterogeneity=Heterogeneity(roughness=points)
    )
    compliance = compliance_of(case.slab)
    state = initial_contact(case, compliance)
    outermost = float(np.abs(compliance.x + state.u)[state.contact].max())
    return state, rounding_share(case, compliance.own_displacement(), state.contact, outermost)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("residual_shear", [0.0, 1.0])
def test_what_is_no_number_is_seen(residual_shear: float, way: InitialContact) -> None:
    """Every comparison with a NaN is false: no constraint seems violated."""
    case = _case("galerkin", initial_contact=way, slip_rule=SlipRule(residual_shear=residual_shear))
    matrix = np.full((2 * N, 2 * N), np.nan)
    record = slide(case, SurfaceCompliance(matrix, case.slab))
    assert record.outcome.ending in (Ending.ROUNDING, Ending.SINGULAR_OPERATOR)


def _extremes() -> list[Case]:
    """The lightest loads, the sharpest and flattest pins, the largest floors, knots and heights at the ends of their ranges."""
    tried = [
        _case(
            scheme,
            normal_load=normal_load,
            radius=radius,
            initial_contact=way,
            slip_rule=SlipRule(event_floor=floor, cascade_limit=20_000),
            max_displacement=0.3,
        )
        for scheme in ROWS
        for way in WAYS
        for normal_load in (1e-30, 1e-24, 1e-12, 1.0)
        for radius in (1e-12, 1.0, 1e24)
        for floor in (1e-14, 1.0)
    ]
    heights = [(0.0, 1e-300, 1e-12), (0.0, 1e6, -1e6), (1e-30, 0.0, 1e-15)]
    profiles = [tuple(zip((-1e-12, 0.0, 1e-12), each, strict=True)) for each in heights]
    return tried + [
        replace(case, heterogeneity=Heterogeneity(roughness=profile))
        for case in tried[:: len(ROWS)]
        for profile in profiles
        if case.slip_rule.event_floor == 1.0
    ]


@pytest.mark.parametrize("heights", [(0.0, 1e6, -1e6), (0.0, -1e6, 1e6)])
def test_a_contact_over_a_spike_is_known_or_named(heights: tuple[float, float, float]) -> None:
    """On its flank the last digit of a node's place is a height of 450 slab widths; other last digits find other states."""
    profile = tuple(zip((-1e-12, 0.0, 1e-12), heights, strict=True))
    case = _case("biquadratic", normal_load=1.0, initial_contact="frictionless")
    case = replace(case, heterogeneity=Heterogeneity(roughness=profile))
    given = compliance_of(case.slab)
    assert isinstance(given, SurfaceCompliance)
    for seed in range(5):
        found = initial_contact(case, blurred_compliance(given, seed))
        if found.outcome.ok:
            assert_contact_laws(found, case, given)


@pytest.mark.parametrize(("scheme", "normal_load"), [("half_plane", 1e-12), ("strip", 1e-30)])
def test_the_pin_and_not_the_operator_is_named_where_a_flank_makes_a_step_of_newton_singular(
    scheme: str, normal_load: float
) -> None:
    """It is 1e18 steep: the compliance is rounding beside its product with the slope, and may be lost with some last digits."""
    profile = ((-1e-12, 0.0), (0.0, 1e6), (1e-12, -1e6))
    case = _case(scheme, normal_load=normal_load, radius=1.0, initial_contact="frictionless")
    case = replace(case, heterogeneity=Heterogeneity(roughness=profile))
    given = compliance_of(case.slab)
    assert isinstance(given, EndlessCompliance)
    for seed in range(6):
        rounded = EndlessCompliance(blurred_convolution(given.convolution, seed), case.slab)
        assert initial_contact(case, rounded).outcome.ending is Ending.ROUNDING


def test_the_ends_of_every_range_are_computed_or_named() -> None:
    """All of them every day: where heights are not checked against rounding, 4 of 468 show it."""
    for case in _extremes():
        seen = _follow(case, 3, 20)
        assert not seen.broken, case
        assert set(seen.endings) <= EXTREME_ENDINGS, (case, seen.endings)


EXTREME_ENDINGS = {
    Ending.COMPLETED, Ending.ROUNDING, Ending.STEEP_PIN, Ending.OVERSHOT, Ending.ENERGY_CREATED,
}  # fmt: skip
"""Endings of these cases, under compliances of sixteen roundings: loads and pins that they name, no search that gives up."""


@pytest.mark.parametrize("friction", [0.0, 0.5])
@pytest.mark.parametrize("initial", get_args(InitialContact))
def test_a_disc_between_two_rows_of_nodes_touches_nothing_and_one_over_a_row_touches_a_node(initial, friction):
    slab = Slab(n_x=17, scheme="half_space")
    over_row = Case(
        slab=slab,
        pin="flat_punch",
        half_width=0.3 * slab.spacing,
        normal_load=1e-4,
        intrinsic_friction=friction,
        initial_contact=initial,
    )
    found = initial_contact(over_row, compliance_of(slab))
    assert (found.outcome.ok, found.contact.sum()) == (True, 1)
    between = replace(over_row, start_y=0.5)
    found = initial_contact(between, compliance_of(slab))
    assert (found.outcome.ending, found.contact.sum()) == (Ending.CONTACT_LOST, 0)
