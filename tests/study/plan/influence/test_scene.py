"""The groups of a scene are dimensionless: what they say of it does not depend on units, and Hertz's is Hertz's."""

import math
from dataclasses import replace

import pytest

from solver.case import Case, Heterogeneity
from solver.contact.closed_forms import hertz_half_width
from solver.drive import Scales
from solver.slab import Slab
from study.accuracy.influence.scenes import random_scene
from study.manifest.drives import NamedDrive
from study.plan.influence.omissions import OMISSIONS
from study.plan.influence.scene import (
    ASKED_FOR,
    GROUPS,
    GROUPS_OF_DRIVES,
    NODES,
    OBSERVABLES,
    OF_DRIVES,
    ROUGHNESS,
    SLOPE,
    SPEED,
    STIFFNESS,
    WIDTH,
    Scene,
)


def test_the_same_drive_in_other_units_has_the_same_groups() -> None:
    """Scales that are k times larger, and a drive in SI that is larger with them."""
    first = NamedDrive.of("paper")
    scales, larger = Scales(), Scales(slab_width=2e-3, slab_depth=5e-2, shear_modulus=3e10)
    ratio = {name: larger.units(first.pin_mass)[name] / scales.units(first.pin_mass)[name]
             for name in ("stiffness", "velocity", "time")}  # fmt: skip
    si = first.in_si
    second = NamedDrive.of(
        "paper",
        spring_stiffness=si.spring_stiffness * ratio["stiffness"],
        stage_velocity=si.stage_velocity * ratio["velocity"],
        duration=si.duration * ratio["time"],
    )
    one, other = (Scene(Case(), each.dimensionless(units)) for each, units in ((first, scales), (second, larger)))
    for group in GROUPS_OF_DRIVES:
        assert group.of(other) == pytest.approx(group.of(one), rel=1e-12)


def test_the_half_width_is_hertzs() -> None:
    case = Case(radius=123.0, normal_load=4e-4, slab=Slab(65, poisson=0.2))
    assert WIDTH.of(Scene(case)) == pytest.approx(hertz_half_width(123.0, 4e-4, 0.2), rel=1e-12)


def test_no_contact_is_wider_than_the_slab() -> None:
    assert WIDTH.of(Scene(Case(radius=1e9, normal_load=1.0))) == 0.5


def test_nodes_in_contact_are_counted_across_it() -> None:
    case = Case(radius=50.0, slab=Slab(129))
    assert NODES.of(Scene(case)) == pytest.approx(2.0 * WIDTH.of(Scene(case)) * 128.0 + 1.0, rel=1e-12)


def test_a_smooth_pin_has_no_roughness_and_a_level_shift_is_none() -> None:
    smooth, level = Case(), Case(heterogeneity=Heterogeneity(roughness=((-1.0, 1e-3), (1.0, 1e-3))))
    for group in (ROUGHNESS, SLOPE):
        assert group.of(Scene(smooth)) == 0.0
        assert group.of(Scene(level)) == pytest.approx(0.0, abs=1e-12)
        assert group.place(Scene(smooth)) == -math.inf


def test_a_ramp_has_its_own_slope() -> None:
    """Over a/R, the parabola's at the end of its contact."""
    ramp = Scene(Case(heterogeneity=Heterogeneity(roughness=((-1.0, -1e-4), (1.0, 1e-4)))))
    assert SLOPE.of(ramp) == pytest.approx(1e-4 * ramp.case.radius / WIDTH.of(ramp), rel=1e-9)


def test_roughness_grows_with_its_heights() -> None:
    scene = next(each for each in map(random_scene, range(40)) if each.case.heterogeneity.roughness)
    higher = tuple((x, 3.0 * height) for x, height in scene.case.heterogeneity.roughness)
    other = Scene(replace(scene.case, heterogeneity=replace(scene.case.heterogeneity, roughness=higher)))
    for group in (ROUGHNESS, SLOPE):
        assert group.of(other) == pytest.approx(3.0 * group.of(scene), rel=1e-9)


def test_speed_and_stiffness_grow_as_the_drives() -> None:
    scene = random_scene(3)
    assert scene.drive is not None
    faster = scene._replace(drive=replace(scene.drive, stage_velocity=2.0 * scene.drive.stage_velocity))
    stiffer = scene._replace(drive=replace(scene.drive, spring_stiffness=4.0 * scene.drive.spring_stiffness))
    assert SPEED.of(faster) == pytest.approx(2.0 * SPEED.of(scene), rel=1e-12)
    assert SPEED.of(stiffer) == pytest.approx(2.0 * SPEED.of(scene), rel=1e-12)
    assert STIFFNESS.of(stiffer) == pytest.approx(4.0 * STIFFNESS.of(scene), rel=1e-12)


def test_every_group_that_governs_an_effect_is_listed() -> None:
    governing = {group for omission in OMISSIONS.values() for group in omission.groups}
    assert governing <= {*GROUPS, *GROUPS_OF_DRIVES}
    assert {name for names in ASKED_FOR.values() for name in names} <= set(OBSERVABLES)
    assert set(OF_DRIVES) <= set(OBSERVABLES)
