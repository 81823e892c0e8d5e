"""The window of nodes that the kernels follow: none beyond it can touch the pin, so the record is that of the whole surface."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from nanoslip.solver.case import Case, Heterogeneity
from nanoslip.solver.contact.compiled_contact import CompiledContact, beyond_window, contact_state, within_reach
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.kernels.state import Stop
from nanoslip.solver.contact.pin import pin_of
from nanoslip.solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from nanoslip.solver.outcome import COMPLETED
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding import slide as full_contact
from nanoslip.solver.sliding.kernels.slide import slide_events
from nanoslip.solver.sliding.slide import compiled_at, first_of, first_room, slide_full_contact


def random_scene(seed: int) -> tuple[Case, SurfaceCompliance]:
    """Pins from nearly smooth ones to some that ride on a few tips, on slabs of any shape."""
    rng = np.random.default_rng(seed)
    slab = Slab(
        n_x=int(rng.choice([65, 129, 257])),
        poisson=float(rng.uniform(0.0, 0.45)),
        aspect_ratio=float(rng.uniform(0.3, 3.0)),
    )
    xi = np.arange(-1.2, 1.2, rng.uniform(0.3, 6.0) * slab.spacing)
    heights = 10.0 ** rng.uniform(-7.0, -3.5) * rng.standard_normal(len(xi))
    case = Case(
        slab=slab,
        radius=10.0 ** rng.uniform(0.3, 2.0),
        normal_load=10.0 ** rng.uniform(-4.0, -2.5),
        intrinsic_friction=10.0 ** rng.uniform(-1.0, 0.3),
        heterogeneity=Heterogeneity(spread=0.1, roughness=tuple(zip(xi.tolist(), heights.tolist(), strict=True))),
        max_events=4000,
    )
    return case, surface_compliance(slab)


SCENES = range(12)


@pytest.mark.parametrize("seed", SCENES)
def test_no_node_beyond_the_window_ever_lies_inside_a_rough_pin(seed: int) -> None:
    """Looked at after every tenth event, all along the record."""
    case, compliance = random_scene(seed)
    compiled = compiled_at(case, compliance, initial_contact(case, compliance), whole=False)
    assert case.max_events is not None
    events, node_slips, held = first_room(case.max_events), np.zeros(case.slab.n_x, np.int64), 0
    status = Stop.FULL
    while held < len(events.displacement) and status in (Stop.FULL, Stop.WINDOW_TOO_NARROW):
        room = first_of(events, min(held + 10, len(events.displacement)))
        status, held = slide_events(compiled.state, compiled.constants, room, node_slips, held, np.inf)
        state = contact_state(compiled, COMPLETED)
        assert not beyond_window(compiled, state)
        if status == Stop.WINDOW_TOO_NARROW:
            compiled = compiled_at(case, compliance, state, whole=False)


@pytest.mark.parametrize("seed", [0, 3, 6])
def test_a_rough_pin_slides_within_windows_as_on_the_whole_surface(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same slips of the same nodes; forces to what rounding grows to in four thousand events."""
    case, compliance = random_scene(seed)
    start = initial_contact(case, compliance)
    found, _ = slide_full_contact(case, start, compliance)
    monkeypatch.setattr("nanoslip.solver.sliding.slide.within_reach", lambda *_: np.ones(case.slab.n_x, np.bool_))
    whole, _ = slide_full_contact(case, start, compliance)
    np.testing.assert_array_equal(found.node, whole.node)
    np.testing.assert_array_equal(found.slips, whole.slips)
    np.testing.assert_allclose(found.force_after, whole.force_after, atol=1e-7 * case.normal_load)


def test_windows_that_do_not_last_give_way_to_the_whole_surface(monkeypatch: pytest.MonkeyPatch) -> None:
    """Seven nodes whose every tenth event lifts the surface: 1400 windows in 4000 events took twelve times as long as none."""
    case, compliance = random_scene(79)
    windows: list[slice] = []

    def seen(*given: Any) -> CompiledContact:
        windows.append((compiled := compiled_at(*given)).window)
        return compiled

    monkeypatch.setattr(full_contact, "compiled_at", seen)
    record, _ = slide_full_contact(case, initial_contact(case, compliance), compliance)
    assert len(record.displacement) == case.max_events
    assert windows[0] != slice(0, 65)
    assert windows[-1] == slice(0, 65)
    assert len(windows) < 2 * full_contact.AT_FIRST


def test_a_slightly_rough_pin_is_not_followed_by_all_of_a_fine_slab() -> None:
    """But by less than twice what follows a smooth one: slips cost what the window is wide."""
    slab = Slab(n_x=513)
    heights = 1e-7 * np.random.default_rng(1).standard_normal(801)
    points = tuple(zip(np.linspace(-1.2, 1.2, 801).tolist(), heights.tolist(), strict=True))
    case = Case(slab=slab, radius=10.0, normal_load=1e-3, heterogeneity=Heterogeneity(roughness=points))
    compliance = surface_compliance(slab)
    state = initial_contact(case, compliance)
    window = compiled_at(case, compliance, state, whole=False).window
    smooth = replace(case, heterogeneity=Heterogeneity())
    around_smooth = compiled_at(smooth, compliance, initial_contact(smooth, compliance), whole=False).window
    assert window.stop - window.start < 2 * (around_smooth.stop - around_smooth.start) < 513 / 3


def test_a_pin_that_touches_in_spots_is_followed_everywhere() -> None:
    """The surface between its tips and beyond may tilt anyhow when one of them gives way."""
    case = Case(slab=Slab(n_x=65), heterogeneity=Heterogeneity(roughness=((-1.0, 0.0), (1.0, 1e-9))))
    level, spots = np.zeros(65), np.isin(np.arange(65), [20, 30, 31, 44])
    assert within_reach(case, spots, level, level).all()
    assert not within_reach(case, np.abs(np.arange(65) - 32) < 4, level, level).all()


@pytest.mark.parametrize("distance", [1e-4, 0.02, 0.3])
def test_a_profile_within_a_distance_is_nowhere_below_its_bounds(distance: float) -> None:
    """By brute force at 2001 places around each of 50; far from the bounds it is not either."""
    pin = pin_of(random_scene(1)[0])
    xi = np.random.default_rng(2).uniform(-1.4, 1.4, 50)
    around = xi[:, None] + distance * np.linspace(-1.0, 1.0, 2001)
    lowest, fall = pin.lowest_within(xi, distance), pin.fall_within(distance)
    roughness = pin.height(around) - 0.5 * pin.curvature * around**2
    rounding = 1e-15 * pin.height(around).max()
    assert (lowest <= pin.height(around).min(axis=1) + rounding).all()
    assert (np.ptp(roughness, axis=1) <= 2.0 * fall + rounding).all()
    assert (
        lowest >= 0.5 * pin.curvature * (around**2).min(axis=1) - np.ptp(roughness) + roughness.min() - rounding
    ).all()
