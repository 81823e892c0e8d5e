"""One case: KEY=VALUE single it out of a campaign or make it; it is explained, shown from results, or computed at once."""

import re
import tempfile

import pytest
from rich.cells import cell_len

from nanoslip.study import api
from nanoslip.study.accuracy.spending import Sample
from nanoslip.study.commands import look
from nanoslip.study.commands.datasets import assignments, choose_case
from nanoslip.study.commands.words import Refusal
from nanoslip.study.manifest.cases import expand, make_campaign, tables
from nanoslip.study.manifest.reader import parse_manifest
from nanoslip.study.plan.expectations import out_of_reach
from nanoslip.study.plan.plan import make_plan
from nanoslip.study.report.curves import inertial_range
from nanoslip.study.results.store import Store
from tests.conftest import ROOT, SMALL
from tests.study.commands.test_datasets import write_regimes

ONE = ("intrinsic_friction=0.5", "radius=50")


def case(axes, words, design=""):
    manifest = parse_manifest(ROOT / "toy.toml", f'title = "a toy"\n{design}\n[axes]\n{axes}\n', {})
    return choose_case(manifest, expand(manifest), assignments(words.split())).parameters


AXES = 'radius = [50.0, 100.0]\nevents = [5, 10]\nslip_order = ["worst_first", "simultaneous"]'


def test_a_case_is_found_by_the_words_of_its_campaign():
    for words in ("events=5 radius=1e2 slip_order=simultaneous", "events=5 R=0.1m slip_order=simultaneous"):
        found = case(AXES, words)
        assert [found[name] for name in ("radius", "max_events", "slip_order")] == [100.0, 5, "simultaneous"]
    zipped = 'radius = [50.0, 100.0]\nslip_order = ["worst_first", "simultaneous"]'
    assert case(zipped, "radius=100", 'design = "zip"')["slip_order"] == "simultaneous"
    with pytest.raises(Refusal, match="radius = 50, slip_order = simultaneous: "):
        case(zipped, "radius=50 slip_order=simultaneous", 'design = "zip"')
    for word in ("true", "True"):  # of a campaign, and of a table
        assert case("coupling = [false, true]", f"coupling={word}")["coupling"] is True
    in_si = AXES.replace("radius = [50.0, 100.0]", 'radius = ["0.05 m", "0.1 m"]') + "\n[scales]\nslab_width = 1e-3"
    with pytest.raises(Refusal, match=r"give also radius=50 or radius=100$"):
        case(in_si, "events=5 slip_order=simultaneous")
    with pytest.raises(
        Refusal, match=r"give also max_events=5 or max_events=10; slip_order=worst_first or slip_order=simultaneous$"
    ):
        case(AXES, "radius=50")


@pytest.mark.parametrize("word", ["radius", "radius=", "=50", ""])
def test_a_word_that_gives_no_key_a_value_is_refused(word):
    with pytest.raises(Refusal, match=rf"^{word}: needs key=value, as radius=50$"):
        assignments([word])
    with pytest.raises(Refusal, match=r"radius .*twice"):
        assignments(["radius=50", "radius=100"])


def test_a_parameter_may_be_given_by_the_symbol_that_heads_its_column():
    keys = {"mu_i": "intrinsic_friction", "μ_i": "intrinsic_friction", "R": "radius", "R/L_x": "radius"}
    keys |= {"V_o": "stage_velocity"} | {name: name for name in ("events", "max_events", "nonsense")}
    assert {typed: next(iter(assignments([f"{typed}=0.5"]))) for typed in keys} == keys


# Explained: what it costs, and what it leaves open.


def test_the_time_of_a_case_is_estimated(main, campaign):
    code, said, errors = main("explain", campaign, *ONE)
    assert (code, errors, said.startswith("case μ_i = 0.5, R/L_x = 50,")) == (0, "", True)
    assert "estimated time of its computation: " in said


@pytest.mark.parametrize("constant", ["intrinsic_friction = inf", "intrinsic_friction = 0.0", 'pin = "flat_punch"'])
def test_extreme_cases_are_explained_too(main, campaign, constant):
    campaign.write_text(f'title = "x"\n[constants]\n{constant}\n[numerics]\nn_x = 17\n')
    code, said, _ = main("explain", campaign)
    assert (code, "estimated time of its computation: " in said) == (0, True)


def test_a_case_that_physics_refuses_is_not_explained(main, campaign):
    refused = SMALL.replace("radius = [50.0, 100.0]", "coarsest_row = [5, 17]\nn_x = [9, 17]").replace("n_x = 17\n", "")
    campaign.write_text(refused)
    code, _, errors = main("explain", campaign, "n_x=9", "coarsest_row=17", "intrinsic_friction=0.5")
    assert (code, "coarsest_row = 17" in errors) == (2, True)


@pytest.mark.slow
def test_effects_of_a_case_are_those_of_a_campaign_of_it_alone(main, campaign, tmp_path, monkeypatch):
    """Effect, number and change of each row; seconds are measured and differ."""

    def changes(said):
        return [line.split()[:5] for line in said.splitlines() if " ± " in line]

    alone, text = tmp_path / "alone.toml", SMALL.partition("[[drives]]")[0].replace(', "dynamics"', "")
    campaign.write_text(text)
    alone.write_text(text.replace("[0.25, 0.5]", "[0.5]").replace("[50.0, 100.0]", "[50.0]"))
    code, said, _ = main("explain", campaign, *ONE, "--effects")
    assert code == 0
    assert changes(said) == changes(main("effects", alone)[1]) != []
    monkeypatch.setenv("COLUMNS", "60")
    code, said, errors = main("effects", alone)
    wide = [line for line in (said + errors).splitlines() if cell_len(line) > 60 and str(tmp_path) not in line]
    assert (code, wide) == (0, [])


@pytest.mark.slow
def test_errors_that_are_explained_are_those_of_the_drive_that_is_named(ask, finished):
    """By name or by its own keys; a drive that is not there is refused."""
    said = {
        words: ask("explain", *ONE, *words) for words in (("drive=fast",), ("stage_velocity=2e-3",), ("drive=none",))
    }
    assert [code for code, *_ in said.values()] == [0, 0, 2]
    (named, *_), (keyed, *_), (_, _, wrong) = ((out, errors, errors) for _, out, errors in said.values())
    assert "what decides μ_s " in named
    assert named == keyed
    assert "drive = none" in wrong


# Shown: from a dataset, from a campaign's own, or from results that are not collected.


@pytest.mark.slow
def test_a_case_is_shown_from_a_dataset_its_folder_or_its_campaign(main, ask, finished):
    code, said, errors = ask("show", *ONE, "drive=fast")
    assert (code, errors) == (0, "")
    assert said.startswith(
        "A small campaign\ncase μ_i = 0.5, R/L_x = 50, L_z/L_x = 1, n_x = 17, drive = fast, V_o = 2 mm/s\n"
    )
    assert "outcome: completed" in said
    (line,) = (line for line in said.splitlines() if line.startswith("static_friction "))
    assert ("±" in line, line.rstrip().endswith("static friction coefficient")) == (True, True)
    assert said.count("┤") == 24
    for source in (finished, finished / "results.nc"):
        assert main("show", source, *ONE, "drive=fast") == (0, said, "")


def test_without_a_drive_all_drives_are_rows(main, finished):
    code, said, _ = main("show", finished, *ONE)
    assert (code, "static_friction " in said, said.count("┤")) == (0, False, 12)
    first = [line.split()[0] for line in said.splitlines() if line.strip()]
    assert [word for word in first if word in ("slow", "fast")] == ["slow", "fast"]


@pytest.mark.slow
def test_words_of_members_are_short_in_the_table(main, finished):
    write_regimes(finished, sticks=2, stick_slip=1, micro_slip=1)
    said = main("show", finished, *ONE, "drive=slow")[1]
    row = next(line for line in said.splitlines() if line.startswith("regime "))
    assert row.split() == ["regime", "2", "of", "4", "starts", "sticks;", "2", "others", "regime", "of", "the", "pin"]


def test_a_picture_is_written_whole_instead_of_text(main, finished, tmp_path):
    (tmp_path / "new").mkdir()
    code, said, _ = main("show", finished, *ONE, "-o", tmp_path / "new" / "case.png")
    assert (code, "┤" in said) == (0, False)
    assert (tmp_path / "new" / "case.png").read_bytes().startswith(b"\x89PNG")
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["case.png"]
    code, _, errors = main("show", finished, *ONE, "-o", tmp_path / "case.bmp")
    assert (code, errors) == (2, f"Error: {tmp_path / 'case.bmp'}: needs a name that ends in .pdf, .svg, .png\n")


def test_results_that_are_not_collected_or_of_a_campaign_that_changed_are_collected_in_memory(ask, campaign, finished):
    campaign.write_text(SMALL.replace("[50.0, 100.0]", "[50.0, 100.0, 200.0]"))
    code, said, errors = ask("show", *ONE)
    assert (code, "plateau_mean" in said) == (0, True)
    assert errors == f"{finished}: no dataset of {campaign} as it is now: from the results that are finished\n"
    code, said, _ = ask("show", ONE[0], "radius=200")
    assert (code, "outcome: pending" in said, "not known here: " in said) == (0, True, True)
    assert not (finished / "results.new").exists()
    for path in Store(finished).folder.iterdir():
        path.unlink()
    code, _, errors = ask("show", *ONE)
    assert (code, f"nanoslip run {campaign} --out {finished} computes them" in errors) == (2, True)


@pytest.mark.slow
def test_a_wrong_case_is_one_clear_message(main, finished, tmp_path):
    (tmp_path / "bad.nc").write_bytes(b"no netCDF")
    for words, said in (
        ((finished, "radius=50"), "needs to be one case: give also intrinsic_friction=0.25 or intrinsic_friction=0.5"),
        ((finished, "radius=51"), "radius = 51: no such case; there are 50, 100"),
        ((finished, "radius=small"), "radius = small: no such case; there are 50, 100"),
        ((finished, "radius=50 N"), "radius = '50 N': needs a number, or one with a unit as \"50 m\""),
        ((finished, "raduis=50"), "raduis: no coordinate of these cases; did you mean radius?"),
        ((finished, *ONE, "events=61"), "max_events = 61: no such case"),
        ((tmp_path / "bad.nc", *ONE), "bad.nc: no dataset"),
        ((tmp_path, *ONE), "No such file"),
    ):
        code, _, errors = main("show", *words)
        assert (code, errors.count("\n"), said in errors) == (2, 1, True), errors


# Computed at once, by the keys of a manifest; its mistakes have the messages of a manifest.

QUICK = ("n_x=17", "presliding=3", "radius=50")
PUNCH = ("pin=flat_punch", "half_width=0.25", "n_x=17", "--contact")


def test_a_case_is_computed_and_nothing_stays(main, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    code, said, _ = main("try", *QUICK, "intrinsic_friction=0.25")
    assert (code, list(tmp_path.iterdir())) == (0, [])
    assert "\ncase μ_i = 0.25, R/L_x = 50, L_z/L_x = 1, n_x = 17\nin SI: L_x = 1 mm, R = 50 mm, " in said
    assert ("static_friction" in said, "changes nothing" in said, said.count("┤")) == (False, False, 12)
    (found,) = re.findall(
        r"^contact_half_width +([0-9.]+) .*L_x +half-width of the contact \(([0-9.]+) μm\)", said, re.M
    )
    assert float(found[1]) == pytest.approx(1000.0 * float(found[0]), rel=4e-3)  # L_x is 1 mm; three digits
    assert ("N/m)" in said, "_si " in said) == (True, False)  # the size in SI is in the row of its number


def test_friction_over_the_contact_area_is_answered_where_a_strength_acts(main):
    """F/W alone says nothing of another load there. The area is that of nodes, each a spacing wide."""
    code, said, _ = main("try", *QUICK, "members=2", "strength=10 MPa")
    first = said.partition("\n")[0]
    (over_load,) = re.findall(r"^plateau F/W ([0-9.]+)", first)
    (stress,) = re.findall(r"contact area on the plateau ([0-9.]+) .*MPa", first)
    (width,) = re.findall(r"^contact_half_width +([0-9.]+) ", said, re.M)
    area = float(over_load) * 100.0 / (float(stress) * 1e6)  # of 100 N, on 10 mm of L_y
    assert code == 0
    assert 0.0 < area / 1e-5 - 2.0 * float(width) < 2.0 / 16.0
    assert "contact area on" not in main("try", *QUICK, "members=2")[1].partition("\n")[0]


@pytest.mark.slow
def test_a_key_of_a_drive_pulls_the_pin(main):
    code, said, _ = main("try", *QUICK, "members=2", "stage_velocity=1e-3", "samples=40")
    assert "\ndrive: m = 500 g, k = 200 kN/m, ζ = 0.1, V_o = 1 mm/s\n" in said
    assert (code, "static_friction" in said, said.count("┤")) == (0, True, 12)
    assert make_campaign({}, drive=True)["drives"] == [{}]


def test_an_answer_stands_at_the_beginning_and_at_the_end_alone(main):
    """All numbers stand between; why the drive ended is in the answer, and nowhere else."""
    _, said, _ = main("try", *QUICK, "members=1", "step_limit=3000", "--all")
    answer = said.partition("\n")[0]
    friction = answer.partition(",")[0]
    starts = [line for line in said.splitlines() if line.startswith(friction)]
    assert starts == [answer, answer]
    assert said.count("3000 segments reached") == 2


def test_a_tip_hears_its_default_mass_and_its_drive_that_ends_at_its_step_limit_is_not_computed(main, monkeypatch):
    """500 g on 40 N/m move on for 0.1 s, in which the stage passes 30 thousand million drops of a contact of 10 nm."""
    tip = (
        "radius=20 nm",
        "scheme=half_space",
        "n_x=17",
        "slab_width=10 nm",
        "normal_load=5 nN",
        "young_modulus=70 GPa",
    )

    def compute(*_: object, **__: object) -> None:
        raise AssertionError("nothing is computed here")

    monkeypatch.setattr(api, "run", compute)
    code, said, errors = main("try", *tip, "spring_stiffness=40 N/m")
    assert (code, said) == (2, "")
    assert "pin_mass = 0.5 kg" in errors
    assert "at step_limit" in errors.partition("Error: ")[2]
    assert errors.count("at step_limit") == 1


@pytest.mark.parametrize(("velocity", "beyond"), [("1e-3", False), ("1e-6", False), ("5e-8", True), ("1e-9", True)])
def test_a_pin_that_may_rest_more_often_than_its_step_limit_is_expected_to_end_there(velocity, beyond):
    """At 1 nm/s the default pin rests on each of its swings: 2e7 segments are 0.5 % of what it needs. At 50 nm/s there are fewer
    swings than that, of which each may take up to nine segments."""
    content = make_campaign({"n_x": "33", "stage_velocity": velocity}, drive=True)
    line = out_of_reach(make_plan(api.read_campaign(content))).get("step_limit", "")
    assert bool(line) == beyond
    assert ("stage_velocity" in line) == beyond


@pytest.mark.parametrize(("velocity", "beyond"), [(1e-4, False), (0.1, True)])
def test_a_spring_force_that_is_inertia_is_told_from_friction(velocity, beyond):
    drive = {"stage_velocity": velocity, "samples": 400}
    stated = {
        "constants": {"radius": 50},
        "numerics": {"n_x": 17},
        "limits": {"presliding": 3},
        "ensemble": {"members": 1},
    }
    found = inertial_range(api.run({"title": "x", **stated, "drives": [drive]}, progress=False).squeeze())
    assert (found is not None) == beyond
    assert not found or found[1] > 1.1 * found[2] > 0.0


@pytest.mark.slow
def test_a_pin_in_micro_slips_is_not_advised_to_be_pulled_faster_and_slower(main):
    said = main("try", "n_x=17", "presliding=3", "radius=50", "members=1", "spring_stiffness=2e9")[1]
    assert ("raise stage_velocity" in said, "lower stage_velocity" in said, "is not friction alone" in said) == (
        True,
        False,
        True,
    )


def test_a_contact_alone_is_its_pressure_and_a_punch_named_by_its_half_width_and_no_radius(main):
    code, said, _ = main("try", *PUNCH, "friction=false")
    assert (code, "pressure, in" in said, "plateau_mean" in said) == (0, True, False)
    assert "\ncase pin = flat_punch, " in said
    assert ", a/L_x = 0.25, L_z/L_x = 1, n_x = 17\n" in said


def test_keys_may_have_their_table_and_in_a_wrong_one_they_lead_to_it(main):
    assert main("try", "numerics.n_x=9", "limits.events=5", "--contact")[0] == 0
    code, _, errors = main("try", "limits.n_x=9")
    assert (code, "n_x belongs in numerics" in errors) == (2, True)


@pytest.mark.slow
def test_what_the_physics_refuses_is_a_result_and_what_means_nothing_bad_input(main):
    for given, key, ending in (
        (["radius=1e-3"], "radius", "steep_pin"),
        (["events=20", "radius=50"], "limits.events", "no_plateau"),
    ):
        code, said, _ = main("try", "n_x=17", *given)
        assert (code, said.startswith(f"{ending}: ")) == (0, True)
        first, *_, last = re.sub("\n    ", " ", said).splitlines()
        assert (first == last, key in first) == (True, True)  # the answer is what to do
    code, said, errors = main("try", "n_x=17", "pin_translation=false", "residual_shear=1")
    assert (code, said, "Error: residual_shear = 1.0 with pin_translation = false: " in errors) == (2, "", True)


SHORT = "scheme=half_plane radius=1e12 normal_load=1e-9 slip_order=simultaneous"


@pytest.mark.slow
def test_starts_that_end_alike_in_a_short_record_share_an_error(main):
    """Plateaus of 8, 9 and 40 presliding lengths differ by much more than starts do: the window has no whole number of cycles."""
    found = {}
    for lengths in (8, 9, 40):
        rough = f"roughness={ROOT / 'campaigns/starters/roughness.csv'}"
        _, said, _ = main("try", "n_x=65", *SHORT.split(), rough, f"presliding={lengths}")
        found[lengths] = [float(each) for each in re.findall(r"^plateau_mean +(\S+) ± (\S+)", said, re.M)[0]]
    for lengths in (8, 9):
        assert abs(found[lengths][0] - found[40][0]) < 2.0 * found[lengths][1]


def test_the_ones_that_have_a_plateau_are_no_sample_of_all(main):
    _, said, _ = main("try", "n_x=65", "radius=200", "normal_load=1e-6", "scheme=strip")
    assert re.search(r"^plateau_mean +0\.361 ± \? \(4 of 8 starts\)", said, re.M)


@pytest.mark.parametrize(
    ("given", "lines"),
    [
        ("raduis=50 colour=red", ["raduis = 50: unknown; did you mean radius?", 'colour = "red": unknown; ']),
        (
            "radius=-5 n_x=many stage_velocity=fast",
            ["radius = -5: needs 1e-12 ≤ radius", 'n_x = "many": needs', 'stage_velocity = "fast": needs a number'],
        ),
        *(([f"{key}=1", [f"{key} = 1: a key of campaign files, not of one case"]])
          for key in ("title", "axes", "seconds")),
        ("profile=rough.csv", ['profile = "rough.csv": needs one of sawtooth, coarse, linear, mean; a measured surface']),
        ("n_x=17 --contact V_o=1", ["stage_velocity = 1: needs a drive, which initial contact alone has not"]),
    ],
)  # fmt: skip
def test_wrong_keys_and_values_are_the_messages_of_a_manifest(main, given, lines):
    """As they were typed."""
    code, out, said = main("try", *given.split())
    found = said.removeprefix("Error: ").splitlines()
    assert (code, out, len(found)) == (2, "", len(lines))
    assert all(any(line.startswith(each) for line in found) for each in lines), found


def test_a_picture_that_cannot_be_drawn_is_refused_before_anything_is_computed(main, monkeypatch):
    monkeypatch.setattr(api, "run", None)
    for name in ("noext", "case.bmp"):
        said = f"Error: {name}: needs a name that ends in .pdf, .svg, .png\n"
        assert main("try", *QUICK, "-o", name) == (2, "", said)


SAMPLES = [(Sample(33, 4.0, 0.44, 0.001, 0.0, 0.05), Sample(17, 4.0, 0.48, 0.001, 0.0, 0.05))]
"""A probe of a ball: 9 % by twice the spacing, members that scatter by 0.1 %."""


@pytest.mark.parametrize(
    ("given", "samples", "chosen"),
    [
        ("", SAMPLES, (None, None, None)),
        ("--critical", SAMPLES, (None, None, None)),
        ("scheme=half_space", [], (33, None, None)),
        ("scheme=half_space", SAMPLES, (33, 3, 4.0)),
        ("scheme=half_space radius=100", SAMPLES, (65, 3, 4.0)),
        ("scheme=half_space n_x=65", SAMPLES, (65, 3, 4.0)),
        ("scheme=half_space members=5", SAMPLES, (33, 5, None)),
        ("scheme=half_space n_x=33", SAMPLES, (33, None, None)),
    ],
)
def test_time_is_spent_on_what_decides(main, monkeypatch, given, samples, chosen):
    """None is the default. What is not given is chosen: members and length by a probe if the usual ones are slow, and the finest
    grid that answers in seconds; the cost of finer ones is reported."""
    tried = []

    def run(content, **_):
        keys = (("numerics", "n_x"), ("ensemble", "members"), ("limits", "presliding"))
        tried.append(tuple(content.get(table, {}).get(key) for table, key in keys))
        raise Refusal("enough")

    monkeypatch.setattr(api, "run", run)
    monkeypatch.setattr(look, "probe_lengths", lambda *_: samples)
    _, _, said = main("try", *given.split())
    assert tried == [chosen]
    assert ("n_x = 129" in said) == (bool(given) and given not in ("--critical", "scheme=half_space n_x=33"))


def test_a_task_that_failed_is_no_answer(main, monkeypatch):
    """Exit code 3, as of a run: it says nothing of the case."""

    def crashing(*_):
        raise RuntimeError("a defect")

    monkeypatch.setattr("nanoslip.study.run.executor.run_task", crashing)
    with pytest.warns(RuntimeWarning, match="failed"):
        code, said, _ = main("try", *QUICK)
    assert (code, "crashed" in said) == (3, True)


def test_every_key_has_one_table():
    keys = [key for names in tables().values() for key in names]
    assert len(keys) == len(set(keys))


def test_a_drive_of_a_contact_alone_is_refused(main):
    """It was left out without a word."""
    code, said, errors = main("try", *QUICK, "--contact", "--drive")
    assert (code, said, "--contact and --drive" in errors) == (2, "", True)
