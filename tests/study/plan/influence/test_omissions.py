"""Leaving an effect out takes just that effect from a scene; what governs it is known of every scene that has it."""

import math
from dataclasses import replace

import pytest

from solver.case import Case, Effects, Heterogeneity, SlipRule
from solver.dynamics.rk4 import RK4
from solver.elasticity.schemes.half_plane import HalfPlane
from solver.slab import SCHEMES, Slab
from study.accuracy.influence.scenes import random_scene
from study.plan.influence.omissions import OF_THE_CASE, OF_THE_DRIVE, OMISSIONS, Omission, measured_like
from study.plan.influence.scene import OBSERVABLES, OF_DRIVES, Scene
from study.shipped import folder

SCENES = [random_scene(seed) for seed in range(60)]
ALL = pytest.mark.parametrize("omission", OMISSIONS.values(), ids=OMISSIONS)


def having(omission: Omission) -> list[Scene]:
    """The scenes that have an effect."""
    found = [scene for scene in SCENES if omission.there(scene)]
    assert len(found) > 10
    return found


@ALL
def test_what_is_left_out_is_no_longer_there_and_leaving_it_out_again_changes_nothing(omission: Omission) -> None:
    for scene in having(omission):
        without = omission.left_out(scene)
        assert not omission.there(without)
        assert omission.left_out(without) == without != scene


@ALL
def test_every_other_effect_stays(omission: Omission) -> None:
    for scene in having(omission):
        without = omission.left_out(scene)
        for other in OMISSIONS.values():
            gone = other is omission or other.part_of == omission.name
            assert other.there(without) == (other.there(scene) and not gone)


CHANGED = {
    "finite_slab": {"aspect_ratio", "support", "scheme"},
    "coupling": {"coupling"},
    "pin_translation": {"pin_translation"},
    "spread": {"spread"},
    "roughness": {"roughness"},
    "surface_compliance": {"surface_compliance"},
    "reverse_motion": {"reverse_motion"},
    "damping": {"damping_ratio"},
    "fine_teeth": {"profile"},
    "teeth": {"profile"},
}


@ALL
def test_nothing_else_of_the_case_or_drive_changes(omission: Omission) -> None:
    for scene in having(omission):
        without = omission.left_out(scene)
        before, after = flat(scene), flat(without)
        different = {name for name in before.keys() | after.keys() if before.get(name) != after.get(name)}
        of_scheme = set(SCHEMES.settings()) if omission.name == "finite_slab" else set()
        assert different <= CHANGED[omission.name] | of_scheme


def flat(scene: Scene) -> dict[str, object]:
    """All parameters of a scene."""
    assert scene.drive is not None
    return {**scene.case.flat, **scene.drive.flat}


@ALL
def test_what_governs_an_effect_is_known_of_all_scenes_that_have_it(omission: Omission) -> None:
    for scene in having(omission):
        assert all(math.isfinite(group.place(scene)) for group in omission.groups)


@ALL
def test_an_effect_changes_what_it_can_change(omission: Omission) -> None:
    assert omission.observables == (OF_DRIVES if omission in OF_THE_DRIVE else OBSERVABLES)
    assert omission.of_drive == (omission not in OF_THE_CASE)


@pytest.mark.parametrize("poisson", [-0.99, -0.5, 0.0, 0.2, 0.4999])
@pytest.mark.parametrize("aspect_ratio", [0.01, 0.25, 1.0, 4.0])
def test_every_slab_has_a_half_plane_in_its_place(poisson: float, aspect_ratio: float) -> None:
    """Its datum lies deep enough for a positive compliance."""
    scene = Scene(Case(slab=Slab(17, aspect_ratio, poisson)))
    without = OMISSIONS["finite_slab"].left_out(scene).case.slab
    assert isinstance(without.scheme, HalfPlane)
    assert without.scheme.matrix(without).diagonal().min() > 0.0


@pytest.mark.parametrize("name", [each.name for each in OF_THE_DRIVE])
def test_a_case_alone_has_no_effect_of_a_drive(name: str) -> None:
    assert not OMISSIONS[name].there(Scene(Case()))


@pytest.mark.parametrize("name", [each.name for each in OF_THE_DRIVE])
def test_an_integrator_that_knows_no_rest_keeps_all_of_its_drive(name: str) -> None:
    drive = SCENES[0].drive
    assert drive is not None
    assert not OMISSIONS[name].there(Scene(Case(), replace(drive, integrator=RK4(time_step=1e-3 * drive.duration))))


UNLIKE = {
    "pin": Case(pin="flat_punch"),
    "initial_contact = gradual": Case(initial_contact="gradual"),
    "slip rule": Case(slip_rule=SlipRule(residual_shear=0.2)),
    "another slip rule": Case(slip_rule=SlipRule(event_floor=0.1)),
    "distribution = uniform": Case(heterogeneity=Heterogeneity(spread=0.1, distribution="uniform")),
    "scheme = chain": Case(slab=Slab(17, scheme="chain")),
    "scheme = biquadratic": Case(slab=Slab(17, scheme="biquadratic")),
    "friction": Case(effects=Effects(friction=False)),
}


@pytest.mark.parametrize(("reason", "case"), UNLIKE.items(), ids=UNLIKE)
def test_a_case_unlike_the_measured_ones_is_named_by_what_it_has(reason: str, case: Case) -> None:
    assert reason in measured_like(case)


def test_all_measured_scenes_are_like_the_measured_ones() -> None:
    for scene in SCENES:
        assert measured_like(scene.case) == ""
        for omission in OF_THE_CASE:
            assert measured_like(omission.left_out(scene).case) == ""


def test_the_reference_names_every_effect_and_what_governs_it() -> None:
    lines = (folder("campaigns") / "targets.md").read_text("utf-8").splitlines()
    rows = [line.strip("| ").split(" | ") for line in lines if line.startswith("| `") and line.count("|") == 4]
    found = {row[0].strip("`"): row[2] for row in rows}
    governed = {name: ", ".join(group.symbol for group in each.groups) for name, each in OMISSIONS.items()}
    assert {name: found.get(name) for name in OMISSIONS} == governed


def test_a_case_beyond_the_measured_ranges_is_named_by_what_it_has() -> None:
    """Whatever groups govern an effect: what was not seen at all is not extrapolated to."""
    for case, reason in (
        (Case(slab=Slab(65, poisson=-0.2)), "poisson = -0.2"),
        (Case(intrinsic_friction=5.0), "intrinsic_friction = 5"),
        (Case(radius=1.0), "few nodes"),
    ):
        assert reason in measured_like(case)
