"""One case is computed from the command line by the keys of a manifest; its mistakes have the messages of a manifest."""

import tempfile

from study import api
from study.manifest.one_case import campaign_of, tables

QUICK = ("n_x=17", "events=60", "radius=50")


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
