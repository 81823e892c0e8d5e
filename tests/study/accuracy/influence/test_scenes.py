"""Random scenes: the same seed is the same scene, all of them are valid, and together they cover what is asked of them."""

import itertools

import numpy as np
import pytest

from solver.drive import Drive
from study.accuracy.influence.scenes import EVENTS, FEWEST_NODES, ROUGH, SIZES, SPREAD_OUT, random_scene
from study.plan.cost.sliding import events_of, hertz_nodes, lateral_stiffness, mean_step
from study.plan.influence.omissions import OF_THE_DRIVE, OMISSIONS
from study.plan.influence.scene import (
    DAMPING,
    DEPTH,
    FRICTION,
    NODES,
    POISSON,
    ROUGHNESS,
    SPEED,
    SPREAD,
    STIFFNESS,
    WIDTH,
    Scene,
    friction,
)

SCENES = [random_scene(seed) for seed in range(400)]
"""Some 150 to be rough, 240 to be spread out: shares to within 0.025 for one standard deviation."""


def drive_of(scene: Scene) -> Drive:
    assert scene.drive is not None
    return scene.drive


def test_a_seed_is_a_scene() -> None:
    assert [random_scene(seed) for seed in range(20)] == SCENES[:20]
    assert len({scene.case for scene in SCENES}) == len(SCENES)


def test_sizes_and_effects_have_their_shares() -> None:
    shares = {n_x: np.mean([scene.case.slab.n_x == n_x for scene in SCENES]) for n_x in SIZES}
    assert shares == pytest.approx(SIZES, abs=0.1)
    assert np.mean([bool(scene.case.heterogeneity.roughness) for scene in SCENES]) == pytest.approx(ROUGH, abs=0.1)
    assert np.mean([scene.case.heterogeneity.spread > 0.0 for scene in SCENES]) == pytest.approx(SPREAD_OUT, abs=0.1)


RANGES = {
    NODES: (14.0, 90.0),
    WIDTH: (0.07, 0.4),
    DEPTH: (0.04, 0.9),
    POISSON: (0.02, 0.47),
    FRICTION: (0.11, 1.4),
    SPREAD: (1.2e-3, 0.25),
    ROUGHNESS: (4e-4, 0.15),
    STIFFNESS: (1.5e-4, 0.09),
    SPEED: (1e-2, 0.7),
    DAMPING: (0.011, 0.9),
}
"""Group -> what the scenes are to reach beyond, at both ends."""


@pytest.mark.parametrize(("group", "ends"), RANGES.items(), ids=[group.name for group in RANGES])
def test_groups_cover_their_ranges(group, ends: tuple[float, float]) -> None:
    found = [value for value in map(group.of, SCENES) if value > 0.0]
    assert min(found) < ends[0]
    assert max(found) > ends[1]


def test_no_two_groups_that_are_drawn_follow_each_other() -> None:
    """Else a law could not tell which of them governs an effect."""
    drawn = (POISSON, FRICTION, DEPTH, STIFFNESS, DAMPING)
    places = np.array([[group.place(scene) for group in drawn] for scene in SCENES])
    off_diagonal = np.corrcoef(places.T)[~np.eye(len(drawn), dtype=bool)]
    assert np.abs(off_diagonal).max() < 0.6  # K, and so k/K, hangs on the slab's height


def test_every_scene_has_a_contact_records_in_bounds_and_a_drive_that_slides() -> None:
    for scene in SCENES:
        case, drive = scene.case, drive_of(scene)
        assert hertz_nodes(case) >= FEWEST_NODES - 1e-9 or WIDTH.of(scene) > 0.4
        assert events_of(case) <= 1.5 * EVENTS
        assert case.max_displacement is not None
        assert case.max_displacement > friction(case) / lateral_stiffness(case)
        assert drive.stage_velocity * drive.duration > friction(case) / drive.spring_stiffness
        assert drive.stage_velocity >= mean_step(case) * np.sqrt(lateral_stiffness(case)) * (1.0 - 1e-12)


def test_every_effect_is_in_scenes_enough() -> None:
    for name, omission in OMISSIONS.items():
        assert sum(omission.there(scene) for scene in SCENES) > 0.3 * len(SCENES), name
    for scene, omission in itertools.product(SCENES, OF_THE_DRIVE):
        assert omission.there(scene)
