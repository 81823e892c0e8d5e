"""One case is computed from the command line by the keys of a manifest; its mistakes have the messages of a manifest."""

import tempfile

import pytest

from nanoslip.study import api
from nanoslip.study.manifest.cases import campaign_of, tables

QUICK = ("n_x=17", "presliding=3", "radius=50")


def test_a_case_is_computed_and_nothing_stays(main, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    code, said, _ = main("try", *QUICK, "intrinsic_friction=0.25")
    assert (code, list(tmp_path.iterdir())) == (0, [])
    assert said.startswith("case μ_i = 0.25, R/L_x = 50, L_z/L_x = 1, n_x = 17\noutcome: completed\n")
    assert "static_friction" not in said
    assert said.count("┤") == 12


def test_a_key_of_a_drive_pulls_the_pin(main):
    code, said, _ = main("try", *QUICK, "stage_velocity=1e-3", "samples=40")
    assert (code, "static_friction" in said) == (0, True)
    assert said.count("┤") == 24
    assert campaign_of({}, drive=True)["drives"] == [{"name": "try"}]


def test_a_contact_alone_is_its_pressure(main):
    code, said, _ = main("try", "n_x=17", "pin=flat_punch", "friction=false", "--contact")
    assert (code, "pressure, in" in said, "plateau_mean" in said) == (0, True, False)


def test_what_the_physics_refuses_is_a_result(main):
    code, said, _ = main("try", "n_x=17", "pin_translation=false", "residual_shear=1")
    assert (code, "outcome: invalid: " in said) == (0, True)


def test_wrong_keys_and_values_are_the_messages_of_a_manifest(main):
    code, _, said = main("try", "raduis=50", "colour=red")
    assert code == 2
    assert said.splitlines()[0] == "Error: raduis = 50: unknown; did you mean radius?"
    assert said.splitlines()[1].startswith('colour = "red": unknown; ')
    code, _, said = main("try", "radius=-5", "n_x=many", "stage_velocity=fast")
    assert code == 2
    lines = said.removeprefix("Error: ").splitlines()
    for wrong in (
        "radius = -5: needs 1e-12 ≤ radius",
        'n_x = "many": needs',
        'stage_velocity = "fast": needs a number',
    ):
        assert any(line.startswith(wrong) for line in lines)  # as they were typed
    assert "Traceback" not in said


def test_a_picture_that_cannot_be_drawn_is_refused_before_anything_is_computed(main, monkeypatch):
    monkeypatch.setattr(api, "run", None)
    for name in ("noext", "case.bmp"):
        assert main("try", *QUICK, "-o", name) == (
            2,
            "",
            f"Error: {name}: needs a name that ends in .pdf, .svg, .png\n",
        )


def test_every_key_has_one_table():
    keys = [key for names in tables().values() for key in names]
    assert len(keys) == len(set(keys))


def test_a_drive_of_a_contact_alone_is_refused(main):
    """It was left out without a word."""
    code, said, errors = main("try", *QUICK, "--contact", "--drive")
    assert (code, said, "--contact and --drive exclude each other" in errors) == (2, "", True)
    code, said, errors = main("try", "n_x=17", "--contact", "V_o=1")
    assert (code, said) == (2, "")
    assert errors == "Error: stage_velocity = 1: needs a drive, which initial contact alone has not\n"


@pytest.mark.parametrize("key", ["title", "accuracy", "axes", "seconds"])
def test_a_key_of_campaigns_is_called_so(main, key):
    said = f"{key} = 1: a key of campaign files, not of one case"
    assert main("try", f"{key}=1")[2] == f"Error: {said}\n"


PUNCH = ("pin=flat_punch", "half_width=0.25", "n_x=17", "--contact")


def test_a_punch_is_named_by_its_half_width_and_no_radius(main):
    _, said, _ = main("try", *PUNCH)
    assert said.startswith("case pin = flat_punch, μ_i = 0.5, a/L_x = 0.25, L_z/L_x = 1, n_x = 17\n")


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ((*PUNCH, "radius=30"), "radius changes nothing here: only a parabola has a radius"),
        ((*QUICK, "half_width=0.1"), "half_width changes nothing here: only a flat_punch has a half_width"),
        (("n_x=17", "--contact", "events=9"), "events changes nothing here: initial contact comes before any limit"),
    ],
)
def test_what_changes_nothing_is_said_with_the_reason(main, given, reason):
    _, said, _ = main("try", *given)
    assert said.splitlines()[0] == reason
    assert "changes nothing" not in main("try", *QUICK)[1]
