"""Two implementations agree: the compiled sliding with a plain one that solves from scratch, contact with an LCP."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from nanoslip.solver.case import Case, Heterogeneity, SlipRule
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.slide import slide
from tests.hard_cases.following import compliance_of
from tests.hard_cases.reference import Reference

EVENTS = 40
SAMPLE: dict[str, dict[str, object]] = {
    "paper": {},
    "slippery": {"intrinsic_friction": 0.1},
    "rough": {"intrinsic_friction": 1.0},
    "half of the shear stays": {"slip_rule": SlipRule(residual_shear=0.5)},
    "walking": {"radius": 10.0, "max_events": 300},
    "full contact": {"radius": 2000.0},
    "light": {"normal_load": 1e-8},
    "between two nodes": {"start": 0.37},
    "coarse floor": {"slip_rule": SlipRule(event_floor=1e-5)},
}
WALKING = "walking"
STRONG: dict[str, dict[str, object]] = {
    # Mean limits of 5e-4 G by pressure: as much again without pressure, and ten times as much.
    "strength": {"slip_rule": SlipRule(strength=5e-4, residual_shear=0.3), "start": 0.37},
    "strength far beyond pressure": {"slip_rule": SlipRule(strength=5e-3), "radius": 20.0},
    "strength alone": {
        "slip_rule": SlipRule(strength=1e-3),
        "intrinsic_friction": 0.0,
    },
}
"""Cases of 200 events."""


def _case(scheme: str, name: str) -> Case:
    """Pressing a chain moves nothing sideways: near a node or its middle, mirror nodes would tie, and rounding decide."""
    slab = Slab(n_x=33 if name == WALKING else 17, scheme=scheme)
    start = 0.0 if slab.scheme.continuum else 0.29
    of_it = {"max_events": 200, **STRONG[name]} if name in STRONG else SAMPLE[name]
    return Case(**{"slab": slab, "max_events": EVENTS, "start": start, **of_it})  # type: ignore[arg-type]


def _disagreement(case: Case) -> tuple[float, float]:
    """Largest differences in displacement (of the last), and in force (of the load) at one displacement.

    Infinite if events differ.
    """
    compliance = compliance_of(case.slab)
    ours = slide(case, compliance)
    assert case.max_events is not None
    events = Reference(case, compliance).slide(case.max_events)
    kinds = [(e.kind, e.node, e.slips, e.releases, e.touches) for e in events]
    same = list(zip(ours.kind, ours.node, ours.slips, ours.releases, ours.touches, strict=True))
    if kinds != [tuple(int(number) for number in event) for event in same]:
        return np.inf, np.inf
    displacement = np.array([event.displacement for event in events])
    forces = np.array([(event.force_before, event.force_after) for event in events])
    moved = displacement - ours.displacement
    # A displacement that is off by a rounding error is a force that is off by the contact's stiffness times it, of this sign.
    at_one_displacement = np.column_stack((ours.force_before, ours.force_after)) + (ours.stiffness * moved)[:, None]
    off = np.abs(forces - at_one_displacement).max() / case.normal_load
    return float(np.abs(moved).max() / displacement[-1]), float(off)


@pytest.mark.everyday(6)
@pytest.mark.parametrize(
    ("name", "scheme"),
    [*product(SAMPLE, ("biquadratic", "half_plane")), *product(("paper", "light"), ("galerkin", "strip", "chain"))],
)
def test_sliding_agrees_with_solving_from_scratch(name: str, scheme: str) -> None:
    """Kind, node, slips, releases and touches of every event; displacements and forces to 1e-9."""
    displacement, force = _disagreement(_case(scheme, name))
    # Up to a thousand slips, each solved to rounding times the contact's condition (1e2).
    assert displacement < 1e-9
    assert force < 1e-9


@pytest.mark.everyday(3)
@pytest.mark.parametrize("name", STRONG)
@pytest.mark.parametrize("scheme", ["biquadratic", "half_plane"])
def test_sliding_with_a_strength_agrees_with_solving_from_scratch(name: str, scheme: str) -> None:
    """200 events, node by node."""
    displacement, force = _disagreement(_case(scheme, name))
    assert displacement < 1e-9
    assert force < 1e-9


@pytest.mark.everyday(1)
@pytest.mark.parametrize("scheme", ["half_space", "layer"])
@pytest.mark.parametrize("name", ["paper", "slippery", "half of the shear stays", "between two nodes"])
def test_a_ball_slides_as_by_solving_from_scratch(name: str, scheme: str) -> None:
    """A plane of nodes follows the reference, too: 40 events, some hundred nodes."""
    case = replace(_case(scheme, name), start=0.3, start_y=0.21, normal_load=1e-3, radius=60.0)
    displacement, force = _disagreement(case)
    assert displacement < 1e-9
    assert force < 1e-9


@pytest.mark.everyday(1)
@pytest.mark.parametrize("height", [1e-5, 2e-4])
def test_a_rough_ball_slides_as_by_solving_from_scratch(height: float) -> None:
    """An image of seven by seven heights: patches of a contact, and a few tips."""
    places = np.linspace(-0.6, 0.6, 7).tolist()
    heights = (height * np.random.default_rng(4).standard_normal(49)).tolist()
    points = tuple((x, y, z) for (x, y), z in zip(product(places, places), heights, strict=True))
    case = replace(_case("half_space", "paper"), start=0.3, start_y=0.21, normal_load=1e-3, radius=60.0)
    displacement, force = _disagreement(replace(case, heterogeneity=Heterogeneity(roughness=points)))
    assert displacement < 1e-9
    assert force < 1e-9


def test_the_sample_has_touches_and_releases() -> None:
    record = slide(_case("biquadratic", WALKING), compliance_of(Slab(n_x=33, scheme="biquadratic")))
    assert record.touches.sum() >= 3
    assert record.releases.sum() >= 3
