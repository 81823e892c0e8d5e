"""Effects of a campaign: changes are those of two campaigns, what is not there is not listed, failures are told."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nanoslip.solver.drive import Drive
from nanoslip.solver.effects import OF_CASES, OF_DRIVES
from nanoslip.solver.ensemble import mean_of
from nanoslip.study.accuracy.effects import Change, Influence, find_verdict, influences, scene_tasks, select_scenes
from nanoslip.study.api import run
from nanoslip.study.manifest.cases import expand
from nanoslip.study.manifest.reader import load_manifest
from tests.conftest import Main

SLIP = """\
title = "Two cases"
stages = ["contact", "slip"]
ensemble.members = 3
[axes]
intrinsic_friction = [0.25, 0.5]
[constants]
radius = 50.0
[numerics]
n_x = 17
[limits]
presliding = 4
"""
PULLED = (
    SLIP.replace(', "slip"', ', "slip", "dynamics"').replace("[0.25, 0.5]", "[0.5]")
    + '[[drives]]\nname = "own"\nsamples = 1\n'
)
UNCOUPLED = "[effects]\ncoupling = false\n"
SPREAD = "[heterogeneity]\nspread = 0.3\n"


def found_in(folder: Path, text: str) -> list[Influence]:
    (folder / "mine.toml").write_text(text)
    manifest = load_manifest(folder / "mine.toml")
    return influences(select_scenes(manifest, list(expand(manifest)), 3, 3))[0]


def of_members(folder: Path, text: str, name: str, variable: str, group: str) -> np.ndarray:
    """Values of the members of the last case of a campaign, as its dataset has them."""
    (folder / f"{name}.toml").write_text(text)
    dataset = run(folder / f"{name}.toml", out=folder / name)
    return np.asarray(dataset.nanoslip.tree[group][variable].values)[-3:]


@pytest.mark.slow
@pytest.mark.everyday(1)
@pytest.mark.parametrize(
    ("text", "changes", "variable", "group"),
    [
        (SLIP + SPREAD, {"coupling": (UNCOUPLED, ""), "spread": ("", SPREAD)}, "plateau_mean", "ensemble"),
        (PULLED, {"teeth": ('profile = "mean"\n', "")}, "kinetic_friction", "drive_ensemble"),
    ],
    ids=["of a case", "of a drive"],
)
def test_a_change_is_that_of_two_campaigns(tmp_path, text, changes, variable, group):
    """Of the same members, bit for bit, of one case."""
    last = text.replace("[0.25, 0.5]", "[0.5]")
    found = {each.effect: each for each in found_in(tmp_path, last) if each.variable == variable}
    one = of_members(tmp_path, last, "all", variable, group)
    mean = abs(mean_of(one).mean)
    for effect, (more, less) in changes.items():
        other = of_members(tmp_path, last.replace(less, "") + more, effect, variable, group)
        change, own = mean_of(other - one), found[effect]
        assert (own.change, own.uncertainty) == (change.mean / mean, change.uncertainty / mean)
        assert [each.change for each in own.changes] == [own.change] != [0.0]
        assert found[effect].seconds > 0.0


def test_what_is_not_there_is_not_listed(tmp_path):
    """A smooth pin, one μ_i, no drive; coupling is off."""
    assert {each.effect for each in found_in(tmp_path, SLIP + UNCOUPLED)} == {"pin_translation", "finite_slab"}


@pytest.mark.parametrize(("number", "fitted"), [("static_friction", False), ("fit_residual", True)])
def test_a_drive_is_fitted_where_a_number_of_its_fit_is_asked_for(tmp_path, number, fitted):
    """A fit takes longer than its drive."""
    (tmp_path / "mine.toml").write_text(PULLED)
    manifest = load_manifest(tmp_path / "mine.toml")
    scenes = select_scenes(manifest, list(expand(manifest)), 1)
    tasks = scene_tasks(manifest, scenes.cases[0].case, scenes.drives, scenes.ensemble, (number,))
    assert [task.fitted for _, task in tasks if task.kind == "drive"] == [fitted]


def test_without_inertia_a_drive_has_a_light_pin_and_the_same_spring_damper_and_stage():
    """c = 2ζ√(mk): a mass of 10⁻⁴ with the same c has 100 times the ζ."""
    (inertia,) = [effect for effect in OF_DRIVES if effect.name == "inertia"]
    given = {"spring_stiffness": 150.0, "stage_velocity": 5e-4, "stage_stroke": 2e-3}
    heavy = Drive.from_si(pin_mass=0.08, damping_ratio=0.3, **given)
    light = Drive.from_si(pin_mass=0.08e-4, damping_ratio=30.0, **given)
    found = inertia.without(heavy)
    assert found.flat == {
        key: pytest.approx(value, rel=1e-12) if isinstance(value, float) else value for key, value in light.flat.items()
    }
    assert inertia.there(heavy)
    assert not inertia.there(replace(heavy, stage_stroke=None))


def test_of_a_stroke_inertia_is_an_effect_with_its_time(tmp_path):
    """A fast stage with a weak damper overshoots at each slip; of a light pin with that damper nothing does."""
    text = PULLED + 'stage_stroke = "10 μm"\nstage_cycles = 2\nstage_velocity = "2 mm/s"\n'
    (found,) = [each for each in found_in(tmp_path, text) if (each.effect, each.variable) == ("inertia", "loop_energy")]
    assert abs(found.change) > 2.0 * found.uncertainty > 0.0
    assert found.seconds > 0.0


@pytest.mark.slow
def test_what_is_there_changes_a_number_that_depends_on_it(tmp_path):
    """Effects of a drive do not touch numbers of its record; a contact is the same however it slides."""
    found = found_in(
        tmp_path,
        PULLED.replace("ensemble.members = 3\n", "")
        + SPREAD
        + '[target]\nwithin = 0.1\nof = ["plateau_mean", "static_friction"]\n',
    )
    of_record = {each.effect for each in found if each.variable == "plateau_mean"}
    assert of_record == {effect.name for effect in OF_CASES} - {"roughness", "strength", "third_dimension"}
    assert {each.effect for each in found} - of_record == {effect.name for effect in OF_DRIVES} - {"memory", "inertia"}


def test_a_change_of_several_cases_is_their_mean_and_its_range_names_them(tmp_path):
    """The largest of them is chosen by its noise: +0.031 ± 0.006 was printed where forty other starts have +0.010 ± 0.005."""
    alone = [found_in(tmp_path, SLIP.replace("[0.25, 0.5]", f"[{value}]")) for value in (0.25, 0.5)]
    for both, *each in zip(found_in(tmp_path, SLIP), *alone, strict=True):
        changes = [one.change for one in each]
        assert both.change == pytest.approx(np.mean(changes), rel=1e-12)
        assert both.uncertainty == pytest.approx(np.hypot(*(one.uncertainty for one in each)) / 2.0, rel=1e-12)
        assert [each.change for each in both.changes] == sorted(changes)
        assert both.changes[-1].where == f"{1 + int(np.argmax(changes))}"


def test_a_change_with_a_member_that_lacks_the_number_has_no_uncertainty(main: Main, tmp_path: Path):
    """Records of light pins are short: some of eight starts have a plateau."""
    path = tmp_path / "short.toml"
    light = SLIP.replace("members = 3", "members = 8").replace("radius = 50.0", "radius = 200.0\nnormal_load = 1e-6")
    path.write_text(light.replace("n_x = 17", 'n_x = 65\nscheme = "strip"').replace("presliding = 4\n", ""))
    code, said, errors = main("effects", path)
    assert (code, "± ?" in said, "nan" in said) == (0, True, False), errors


def test_a_failure_without_an_effect_is_told_in_its_row(main: Main, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Without reverse motion an undamped pin that is pulled fast ends where it would slip back."""
    monkeypatch.setenv("COLUMNS", "80")
    path = tmp_path / "back.toml"
    path.write_text(PULLED.replace("n_x = 17", "n_x = 33") + "damping_ratio = 0\nduration = 0.15\n")
    code, said, errors = main("effects", path, "--members", "4")
    assert code == 0, errors
    rows = said[said.index("reverse_motion  ") :]
    assert "reversed: " in " ".join(rows.split())
    assert max(map(len, said.splitlines())) <= 80
    assert sorted(each.name for each in tmp_path.iterdir()) == ["back.toml"]


def test_a_drive_too_short_is_to_have_more_of_what_its_file_gives(main: Main, tmp_path: Path):
    path = tmp_path / "short.toml"
    path.write_text(PULLED + 'stage_travel = "10 nm"\n')
    said = " ".join(main("effects", path)[1].split())
    assert "; raise stage_travel" in said
    assert "duration" not in said


def test_a_campaign_without_a_possible_case_is_one_message(main: Main, tmp_path: Path):
    path = tmp_path / "none.toml"
    path.write_text(
        'title = "None"\nslip.residual_shear = 1.0\n[effects]\npin_translation = false\n[axes]\nradius = [50.0, 60.0]\n'
    )
    code, _, errors = main("effects", path)
    assert (code, len(errors.splitlines())) == (2, 1)
    assert "are possible" in errors


def test_effects_are_sorted_by_what_their_changes_tell_at_a_tolerance():
    """Twice the ± on either side: a change is needed, or not, only where its interval lies beyond the tolerance, or within it."""

    def influence(effect: str, change: float, uncertainty: float) -> Influence:
        return Influence(effect, "-", "mu_k", (Change("1", change, uncertainty),), 1.0, ())

    found = [influence("large", -0.1, 0.01), influence("small", 0.001, 0.001), influence("vague", 0.01, 0.01)]
    found += [influence("failed", math.nan, math.nan), influence("small", -0.2, 0.01)]
    assert find_verdict(found[:4], 0.02) == (("large",), ("small",), ("vague", "failed"))
    assert find_verdict(found[:4], 0.0) == (("large",), ("small", "vague"), ("failed",))
    assert find_verdict(found, 0.02).needed == ("large", "small")  # of two numbers, one needs it
