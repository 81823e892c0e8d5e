"""Before anything is computed: starters are written, campaigns listed, mistakes found, and what there is to compute is shown."""

import json
import re
from dataclasses import replace

import pytest

from nanoslip.study import origin
from nanoslip.study.commands import plans
from nanoslip.study.results import attempts
from nanoslip.study.shipped import campaign_files, starters
from tests.conftest import PARTLY_REFUSED, SMALL


def test_starters_and_campaigns_are_listed_by_name_and_title(main):
    for command, names in (("new", starters()), ("campaigns", campaign_files())):
        code, said, _ = main(command)
        lines = said.splitlines()[:-1]
        assert (code, [line.split()[0] for line in lines]) == (0, list(names))
    assert ["smoke", "Smoke: the paper's case through every stage"] in [line.split(maxsplit=1) for line in lines]


@pytest.mark.parametrize("name", starters())
def test_a_starter_is_written_as_it_is_commented_and_fine(main, tmp_path, monkeypatch, name):
    """tests/study/test_shipped.py computes each."""
    monkeypatch.chdir(tmp_path)
    assert main("new", name, "mine/first.toml")[0] == 0
    assert main("check", "mine/first.toml")[0] == 0
    text = (tmp_path / "mine" / "first.toml").read_text("utf-8")
    assert text.startswith("# ")
    assert text.count("#") > len(text.splitlines()) / 5
    assert max(map(len, text.splitlines())) <= 130
    assert text == starters()[name].read_text("utf-8")


def test_without_a_file_a_starter_is_written_here_under_its_name(main, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, said, _ = main("new", "roughness")
    assert (code, sorted(path.name for path in tmp_path.iterdir())) == (0, ["roughness.csv", "roughness.toml"])
    assert "nanoslip run roughness.toml" in said


def test_in_a_folder_a_starter_is_written_under_its_name(main, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, said, _ = main("new", "roughness", ".")
    assert (code, sorted(path.name for path in tmp_path.iterdir())) == (0, ["roughness.csv", "roughness.toml"])
    assert "nanoslip run roughness.toml" in said


@pytest.mark.parametrize("there", ["mine.toml", "roughness.csv"])
def test_nothing_is_overwritten(main, tmp_path, there):
    (tmp_path / there).write_text("mine")
    code, _, said = main("new", "roughness", tmp_path / "mine.toml")
    assert (code, {path.name: path.read_text() for path in tmp_path.iterdir()}) == (2, {there: "mine"})
    assert said == f"Error: {tmp_path / there}: there already, and is not overwritten: needs another name\n"


def test_a_starter_that_cannot_be_written_is_one_clear_message(main, campaign):
    for words, wanted in ((("swep",), "no starter; there are afm, "), (("sweep", campaign / "x.toml"), "written")):
        code, _, said = main("new", *words)
        assert (code, said.count("\n"), wanted in said) == (2, 1, True)


def test_what_planning_very_many_cases_takes_is_said_before_it_begins(main, tmp_path, monkeypatch):
    path = tmp_path / "many.toml"
    path.write_text(f'title = "Many"\nstages = ["contact"]\naxes.radius = {[*range(60, 1060)]}\n')
    monkeypatch.setattr(plans, "MANY", 1000)
    code, _, errors = main("plan", path)
    first, *_ = errors.splitlines()
    assert (code, "1000 cases" in first, "GB" in first) == (0, True, True)
    monkeypatch.setattr(plans, "MANY", 1001)
    assert "GB" not in main("plan", path)[2]


def test_the_cost_of_planning_goes_with_tasks_of_which_each_drive_has_one(main, tmp_path, monkeypatch):
    path = tmp_path / "many.toml"
    monkeypatch.setattr(plans, "MANY", 100)
    for drives in (1, 3):
        tables = "".join(
            f'[[drives]]\nname = "{number}"\nstage_velocity = 1e-{number + 3}\n' for number in range(drives)
        )
        path.write_text(f'title = "Many"\naxes.radius = {[*range(60, 90)]}\n{tables}')
        code, said, errors = main("plan", path)
        assert code == 0
        tasks = 30 * (1 + drives)  # its record, and its drives
        assert (f"{tasks} tasks" in errors) == (tasks >= 100)
        rows = {cells[0]: cells for line in said.splitlines() if (cells := line.split())}
        assert int(rows["record"][-1]) + int(rows["drive"][-1]) == tasks


def test_a_campaign_is_planned_by_name_and_a_file_comes_before_it(main, campaign, monkeypatch):
    monkeypatch.chdir(campaign.parent)
    assert "2 cases" in main("plan", "smoke")[1]
    campaign.rename("smoke")
    assert "A small campaign" in main("plan", "smoke")[1]


# Checks.


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ('stages = ["contact"]\naxes.half_width = [0.2, 0.3]\n', "half_width changes nothing here: only a flat_punch"),
        ('constants.pin = "flat_punch"\naxes.radius = [50, 100]\n', "radius changes nothing here: only a parabola"),
        ("heterogeneity.seed = 7\nlimits.events = 9\n", "seed changes nothing here: without a spread"),
    ],
)
def test_an_axis_or_a_constant_that_changes_nothing_is_said_with_the_reason(main, ask, campaign, given, reason):
    """Else equal numbers over it pass for an answer, as those of a parabola where `pin` was forgotten."""
    campaign.write_text(f'title = "x"\n{given}[numerics]\nn_x = 17\n')
    for command in ("check", "plan"):
        code, said, errors = main(command, campaign)
        assert (code, reason in said + errors) == (0, True)
    if "contact" in given:
        assert reason in ask("run", "--serial")[2]


def test_what_matters_to_some_cases_and_limits_of_contacts_are_not_said_to_change_nothing(main, campaign):
    given = 'stages = ["contact"]\nnumerics.n_x = 17\nlimits.events = 9\n'
    campaign.write_text(f'title = "x"\n{given}[axes]\npin = ["parabola", "flat_punch"]\nradius = [50, 100]\n')
    assert "changes nothing" not in main("check", campaign)[1]


def test_all_problems_of_all_files_are_shown_and_the_others_are_valid_and_nothing_is_written(main, campaign):
    wrong, again, missing = (campaign.with_name(f"{name}.toml") for name in ("wrong", "again", "missing"))
    wrong.write_text(SMALL.replace("n_x = 17", "n_y = 17").replace("[50.0, 100.0]", "[-50.0]"))
    again.write_text(SMALL.replace("[50.0, 100.0]", "[50.0, 50]"))
    code, said, errors = main("check", wrong, campaign, again, missing)
    assert (code, said.splitlines()[0]) == (2, f"{campaign}: valid: 4 cases, each with 2 drives, 13 tasks")
    lines = errors.splitlines()
    assert [sum(str(path) in line for line in lines) for path in (wrong, again, missing)] == [2, 1, 1]
    for said in (f"{wrong}: axes.radius[0] = -50.0: needs ", "did you mean n_x?", "axes.radius: repeats 50"):
        assert sum(said in line for line in lines) == 1
    assert set(campaign.parent.iterdir()) == {campaign, wrong, again}


def test_flags_are_expected_before_anything_is_planned(main, campaign):
    campaign.write_text('title = "x"\nconstants.radius = 1.0\n[numerics]\nn_x = 17\n')
    for command in ("check", "plan"):
        assert "expected: few_nodes" in main(command, campaign)[1]


def test_refused_cases_are_results_that_are_counted(main, campaign):
    drives = "[drive_axes]\nintegrator = ['rk4']\nduration = [1e-3, 0.2]\ntime_step = [1e-4, 0.1]\n"
    campaign.write_text(PARTLY_REFUSED.replace("duration = 0.2\n", "") + drives)
    code, said, _ = main("check", campaign)
    assert code == 0
    assert "16 cases (4 of them refused" in said
    assert "8 drives (2 of them refused" in said
    _, said, _ = main("plan", campaign)
    assert said.count("at n_x = 9 (and 3 more)") == 1


# Plans.


def test_a_plan_shows_effects_tasks_and_memory(main, campaign):
    campaign.write_text(SMALL + "records = false\ntractions_at = [5]\n[effects]\ncoupling = false\n")
    code, said, _ = main("plan", campaign)
    assert code == 0
    rows = {cells[0]: cells for line in said.splitlines() if (cells := re.split(r"\s{2,}", line.strip())) != [""]}
    assert "vary: coupling, " in said
    assert "pin_translation" not in said
    assert "outputs." not in said
    assert rows["tasks"][3:5] == ["disk, MB", "memory of one, MB"]
    assert [rows[kind][-1] for kind in ("compliance", "record", "states", "drive")] == ["1", "8", "4", "8"]


def test_effects_that_are_off_are_named_in_one_sentence(main, campaign):
    code, said, _ = main("plan", campaign)
    assert code == 0
    (line,) = (line for line in said.splitlines() if line.startswith("effects that are off or vary: "))
    assert "roughness" in line
    assert ", a first guess\n" in said  # before anything ran
    assert "coupling" not in said


def test_disk_space_comes_true_and_what_is_finished_has_no_time_left(ask, run, out):
    said = json.loads(ask("plan", "--json")[1])["disk_bytes"]
    assert run()[0] == 0
    results = sum(path.stat().st_size for path in (out / "results").iterdir())
    assert results / 2 < said["results"] < 2 * results
    assert (out / "results.nc").stat().st_size / 3 < said["dataset"] < 3 * (out / "results.nc").stat().st_size
    said = ask("plan")[1]
    assert "time left: none" in said
    assert "predicted seconds: compliance" in said


def test_drives_that_no_stage_computes_are_named(main, campaign):
    assert "left out, as" not in main("plan", campaign)[1]
    campaign.write_text(SMALL.replace(', "dynamics"]', "]"))
    assert '"dynamics": slow, fast' in main("plan", campaign)[1]


def test_what_a_target_leaves_open_stands_beside_the_estimate(main, campaign):
    campaign.write_text(SMALL.replace("ensemble.members = 1", "target.within = 0.02"))
    code, said, _ = main("plan", campaign)
    assert (code, "4 cases of 3 to 96 members" in said) == (0, True)
    asked = "plateau_mean, static_friction, kinetic_friction within 0.02"
    assert f"to know {asked} may take" in said
    few = json.loads(main("plan", campaign, "--json")[1])
    campaign.write_text(SMALL.replace("members = 1", "members = 3"))
    three = json.loads(main("plan", campaign, "--json")[1])
    assert few["seconds_left"]["1"] == pytest.approx(three["seconds_left"]["1"], rel=1e-9)


def test_the_time_left_is_what_finished_tasks_lead_to_expect(ask, out):
    """Tasks of every kind that took twice as long as predicted double it, for `plan` and `status`; results and shards stay."""
    planned = json.loads(ask("plan", "--json")[1])
    here = origin.here()
    took = attempts.RunRecord("a", "b", 1, nanoslip=here.nanoslip_version, solver=here.solver)
    kinds = {"compliance": [1, 1.0, 2.0], "record": [3, 3.0, 6.0], "drive": [2, 0.1, 0.2]}
    out.mkdir()
    attempts.add_run(out, replace(took, kinds=kinds))
    learned = json.loads(ask("plan", "--json")[1])
    assert learned["measured"] == pytest.approx(dict.fromkeys(kinds, 2.0))
    for ranks, seconds in planned["seconds_left"].items():
        assert learned["seconds_left"][ranks] == pytest.approx(2.0 * seconds, rel=1e-9)
    looked = json.loads(ask("status", "--json")[1])
    for kind, count in planned["tasks"].items():
        assert looked["tasks"][kind]["core_seconds_left"] == pytest.approx(2.0 * count["core_seconds_left"], rel=1e-9)
    words = " ".join(ask("plan")[1].split())
    assert "compliance 2 x, record 2 x, drive 2 x" in words
    assert "6 tasks took" in words


def test_a_few_tasks_are_measured_here_where_that_is_asked_for_and_nothing_is_kept(ask, out):
    code, said, _ = ask("plan", "--measure", "--json")
    found, whole = json.loads(said), json.loads(ask("plan", "--json")[1])["tasks"]
    assert (code, set(found["measured"]), out.exists()) == (0, {"compliance", "record", "drive"}, False)
    for kind, factor in found["measured"].items():
        assert factor > 0.0
        expected = factor * whole[kind]["core_seconds_left"]
        assert found["tasks"][kind]["core_seconds_left"] == pytest.approx(expected, rel=1e-9)


def test_a_plan_for_scripts_names_what_is_refused_and_why(main, tmp_path):
    path, axes = tmp_path / "partly.toml", "[drive_axes]\ntime_step = [1e-6, 1e-3]\nduration = [1e-4, 1e-2]\n"
    path.write_text(PARTLY_REFUSED.partition("[[drives]]")[0] + '[[drives]]\nname = "a"\nintegrator = "rk4"\n' + axes)
    found = json.loads(main("plan", path, "--json")[1])
    assert (len(found["refused"]), {bool(each["message"]) for each in found["refused"]}) == (4, {True})
    assert ["time_step" in each["refused"] for each in found["drives"]] == [False, False, True, False]


def test_a_critical_velocity_is_not_promised_of_a_stage_that_goes_to_and_fro(main, tmp_path):
    path = tmp_path / "strokes.toml"
    drives = '[[drives]]\nname = "one way"\n[[drives]]\nname = "rubs"\nstage_stroke = 1e-4\n'
    for critical in ("false", "true"):
        path.write_text(f'title = "Strokes"\noutputs.critical = {critical}\n{drives}')
        code, said, _ = main("check", path)
        assert code == 0
        assert ("to and fro: rubs" in " ".join(said.split())) == (critical == "true")
