"""Hard contacts: from one node to all, loads and radii over many decades, corners, punch edges between nodes, far from centre."""

import math
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from solver.case import Case, FirstTouch, Scheme, Slab, SlipRule
from solver.contact import first_touch
from solver.outcome import Ending
from tests.hard_cases.following import Followed, compliance_of, endings_of, follow, shown, worst_of
from tests.hard_cases.table import Row

SCHEMES: tuple[Scheme, ...] = get_args(Scheme)
WAYS: tuple[FirstTouch, ...] = get_args(FirstTouch)
N = 33
H = 1.0 / (N - 1)
LOADS = [10.0**exponent for exponent in range(-12, 0)]
RADII = [10.0**exponent for exponent in range(-1, 7)]


def _case(scheme: Scheme, **changes: object) -> Case:
    return Case(**{"slab": Slab(n_x=N, scheme=scheme), "max_events": 1, **changes})  # type: ignore[arg-type]


def _loads_and_radii(scheme: Scheme, way: FirstTouch, rule: SlipRule) -> dict[str, Case]:
    pairs = [(load, 200.0) for load in LOADS] + [(1e-3, radius) for radius in (*RADII, 500.0, 2000.0)]
    pairs += [(1e-12, 0.1), (1e-12, 1e6), (1e-1, 0.1), (1e-1, 1e6)]
    return {
        f"W {load:.0e} R {radius:g}": _case(scheme, load=load, radius=radius, first_touch=way, slip_rule=rule)
        for load, radius in pairs
    }


def _everything(scheme: Scheme, way: FirstTouch) -> list[Case]:
    return [
        _case(scheme, load=load, radius=radius, first_touch=way, intrinsic_friction=friction)
        for load in LOADS
        for radius in (*RADII, 200.0, 500.0, 2000.0)
        for friction in (0.05, 0.5)
    ]


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
    "one node": {"radius": 0.1, "load": 1e-6, "max_displacement": 0.2},
    "stuck over less than the event floor": {"radius": 0.1, "load": 1e-9, "max_displacement": 1e-3},
    "one and two nodes in turn": {"radius": 2.0, "load": 1e-5, "max_displacement": 0.2},
    "far off the centre": {"radius": 5.0, "load": 1e-3, "intrinsic_friction": 0.1, "max_displacement": 0.4},
    "to the corner": {"radius": 1.0, "load": 1e-3, "intrinsic_friction": 0.1, "max_displacement": 0.6},
}


def _follow(case: Case, events: int = 12, whole: int | None = 100) -> Followed:
    return follow(case, compliance_of(case.slab), events, whole)


def _dragged(scheme: Scheme, name: str) -> Followed:
    """In pieces of 5 events, the state after each checked, on the way to the far end; then in one piece."""
    return _follow(_case(scheme, **{**SLIDERS[name], "max_events": 5}), 80, None)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("way", WAYS)
def test_the_laws_hold_for_every_load_and_radius(way: FirstTouch, scheme: Scheme) -> None:
    for name, case in _loads_and_radii(scheme, way, SlipRule()).items():
        seen = _follow(case)
        assert seen.states > 0, (name, seen.messages)
        assert not seen.broken, name


@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_laws_hold_for_every_load_and_radius_with_coulomb_friction(scheme: Scheme) -> None:
    """Residual 1 has a solver of its own."""
    for name, case in _loads_and_radii(scheme, "stick", SlipRule(residual=1.0)).items():
        seen = _follow(replace(case, max_displacement=0.05), events=4, whole=8)
        assert seen.states > 0, (name, seen.messages)
        assert not seen.broken, name


@pytest.mark.slow
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("way", WAYS)
def test_the_laws_hold_for_all_combinations(way: FirstTouch, scheme: Scheme) -> None:
    for case in _everything(scheme, way):
        seen = _follow(case, events=5, whole=20)
        assert seen.states > 0, (case, seen.messages)
        assert not seen.broken, case


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("half_width", PUNCHES.values(), ids=PUNCHES.keys())
def test_a_punch_stands_on_the_nodes_whose_greater_part_it_covers(half_width: float, scheme: Scheme) -> None:
    case = _case(scheme, pin="flat_punch", half_width=half_width, intrinsic_friction=0.5)
    seen = _follow(case)
    assert not seen.broken
    if seen.states == 0:
        # Pressing may already pull the next node under the sharp edge.
        assert set(seen.endings) == {Ending.EDGE_REACHED}
        return
    # An edge exactly between two nodes goes to the narrower contact; one node always carries.
    covered = np.abs(np.linspace(-0.5, 0.5, N)) <= half_width + 0.499 * H
    np.testing.assert_array_equal(first_touch(case, compliance_of(case.slab)).contact, covered)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("name", SLIDERS)
def test_the_laws_hold_far_from_the_centre(name: str, scheme: Scheme) -> None:
    seen = _dragged(scheme, name)
    assert not seen.broken
    assert seen.record is not None
    assert seen.end is not None
    assert seen.record.outcome.ok, seen.messages
    expected = {"one node": {1}, "one and two nodes in turn": {1, 2}, "to the corner": {1}}
    assert set(seen.record.contact_size) >= expected.get(name, set())
    if name == "to the corner":
        assert list(np.flatnonzero(seen.end.contact)) == [N - 1]


@pytest.mark.parametrize("scheme", SCHEMES)
def test_one_node_sinks_by_its_own_compliance(scheme: Scheme) -> None:
    """Reference: approach = W·C_zz of the middle node, pressure = W/h, until a neighbour touches."""
    case = _case(scheme, load=1e-9, radius=1.0, intrinsic_friction=math.inf, first_touch="frictionless")
    compliance = compliance_of(case.slab)
    state = first_touch(case, compliance)
    middle = N // 2
    assert list(np.flatnonzero(state.contact)) == [middle]
    assert state.approach == pytest.approx(case.load * compliance.matrix[N + middle, N + middle], rel=1e-13)
    assert state.pressure[middle] == pytest.approx(case.load / H, rel=1e-13)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("factor", [1e-9, 1e-3, 1e2])
def test_first_touch_scales_with_load_and_curvature(way: FirstTouch, factor: float, scheme: Scheme) -> None:
    """Load and curvature times c: the same contact, every force and displacement times c (linear elasticity)."""
    case = _case(scheme, load=1e-5, radius=2e4, first_touch=way, intrinsic_friction=math.inf)
    scaled = replace(case, load=case.load * factor, radius=case.radius / factor)
    first, second = (first_touch(one, compliance_of(case.slab)) for one in (case, scaled))
    np.testing.assert_array_equal(first.contact, second.contact)
    # Where the pin's height is taken at a node that moves, x + u is not quite x: u/h is at most 1e-2 here.
    tolerance = 1e-11 if way == "stick" else 1e-3
    np.testing.assert_allclose(second.pressure / factor, first.pressure, atol=tolerance * first.pressure.max())
    assert second.approach / factor == pytest.approx(first.approach, rel=tolerance)


def rows() -> list[Row]:
    """Every load with every radius, in three ways of touching; punch edges about a node; pins dragged to the corner."""
    pressed = [_follow(case, 5, 20) for scheme in SCHEMES for way in WAYS for case in _everything(scheme, way)]
    punches = [_case(scheme, pin="flat_punch", half_width=width) for scheme in SCHEMES for width in PUNCHES.values()]
    dragged = [_dragged(scheme, name) for scheme in SCHEMES for name in SLIDERS]
    tried = {
        "W 1e-12 to 0.1, R/L_x 0.1 to 1e6, all ways to touch": pressed,
        "punch edges within 1e-12 of a node or of a middle": [_follow(case) for case in punches],
        "one node, two, off the centre, to the corner": dragged,
    }
    return [
        Row("contact", what, "contact laws", shown(worst_of(runs)), endings_of(runs)) for what, runs in tried.items()
    ]
