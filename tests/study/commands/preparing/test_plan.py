"""A plan shows what there is to compute, and what is left out."""

import json
import re
from dataclasses import replace

import pytest
import xarray as xr

from nanoslip.study import origin
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.plan import make_plan
from nanoslip.study.results import attempts as runs
from nanoslip.study.results.attempts import Run
from tests.conftest import PARTLY_REFUSED, SMALL


def test_a_plan_shows_effects_tasks_and_memory(main, campaign):
    campaign.write_text(SMALL + "[effects]\ncoupling = false\n[outputs]\nrecords = false\ntractions_at = [5]\n")
    code, said, _ = main("plan", campaign, "--effects")
    assert code == 0
    rows = {
        cells[0]: cells
        for line in said.splitlines()
        if (cells := [cell.strip() for cell in line.split("  ") if cell.strip()])
    }
    assert rows["coupling"][1:] == ["off", rows["coupling"][2]]
    assert rows["coupling"][2].startswith("shear and pressure do not act on each other")
    assert rows["pin_translation"][1:] == ["on"]
    assert rows["outputs.records"][2] == "friction records are not kept once their drives are done"
    assert rows["tasks"][3:5] == ["disk, MB", "memory of one, MB"]
    assert [rows[kind][-1] for kind in ("compliance", "record", "states", "drive")] == ["1", "8", "4", "8"]


def test_effects_that_are_off_are_named_in_one_line_unless_asked_for(main, campaign):
    code, said, _ = main("plan", campaign)
    assert code == 0
    (line,) = (line for line in said.splitlines() if line.startswith("effects that are off or vary: "))
    assert "roughness of the pin" in line
    assert "coupling" not in said
    assert "nothing is drawn" not in said


def test_the_time_is_that_of_the_longest_chain_on_many_ranks(main, campaign):
    found = [json.loads(main("plan", campaign, "--ranks", ranks, "--json")[1]) for ranks in (1, 2, 1000)]
    alone, two, many = (each["seconds_left"][ranks] for each, ranks in zip(found, ("1", "2", "1000"), strict=True))
    total = sum(kind["core_seconds_left"] for kind in found[0]["tasks"].values())
    assert alone == pytest.approx(total, rel=1e-9)
    assert alone / 2 < two < alone
    longest = {kind: max(task.cost for task in make_plan(load_manifest(campaign)).tasks if task.kind == kind)
               for kind in ("compliance", "record", "drive")}  # fmt: skip
    assert many == pytest.approx(sum(longest.values()), rel=1e-9)


def test_disk_space_comes_true(main, campaign):
    out = campaign.parent / "out"
    said = json.loads(main("plan", campaign, "--json")[1])["disk_bytes"]
    assert main("run", campaign, "--out", out, "--serial")[0] == 0
    results = sum(path.stat().st_size for path in (out / "results").iterdir())
    assert results / 2 < said["results"] < 2 * results
    assert (out / "results.nc").stat().st_size / 3 < said["dataset"] < 3 * (out / "results.nc").stat().st_size


def test_the_same_refusal_is_said_once_with_its_count(main, campaign):
    campaign.write_text(PARTLY_REFUSED)
    _, said, _ = main("plan", campaign)
    assert said.count("refused: ") == 1
    assert "rows = 5: needs 3 to 4 rows at n_x = 9 (and 3 more)" in said


def test_drives_that_no_stage_computes_are_named_and_left_out(main, campaign):
    out = campaign.parent / "out"
    campaign.write_text(SMALL.replace(', "dynamics"]', "]"))
    code, said, _ = main("plan", campaign)
    assert code == 0
    assert 'drives left out, as stages leave out "dynamics": slow, fast' in said
    assert main("run", campaign, "--out", out, "--serial")[0] == 0
    with xr.open_dataset(out / "results.nc") as found:
        assert "drive_outcome" not in found
        assert "spring_stiffness" not in found.coords
    assert "4 bit-identical" in main("verify", out / "results.nc")[1]
    campaign.write_text(SMALL)
    assert "left out, as" not in main("plan", campaign)[1]


def test_what_a_target_leaves_open_stands_beside_the_estimate(main, campaign):
    campaign.write_text(SMALL.replace("ensemble.members = 1", "target.within = 0.02"))
    code, said, _ = main("plan", campaign)
    assert code == 0
    assert "4 cases of 3 to 96 members, 0 of them refused" in said
    asked = "plateau_mean, static_friction, kinetic_friction within 0.02"
    assert f"estimated for 3 members of each case; to know {asked} may take up to 96" in said
    few = json.loads(main("plan", campaign, "--json")[1])
    campaign.write_text(SMALL.replace("members = 1", "members = 3"))
    three = json.loads(main("plan", campaign, "--json")[1])
    assert few["seconds_left"]["1"] == pytest.approx(three["seconds_left"]["1"], rel=1e-9)


def test_before_anything_ran_the_time_is_told_to_a_factor_of_three_in_80_columns(main, campaign, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    code, said, _ = main("plan", campaign, "--ranks", 2)
    assert code == 0
    words = " ".join(said.split())
    assert re.search(
        r"time left: about \S+ s on 1 rank, about \S+ s on 2 \(--ranks for another number\), to a factor of three ",
        words,
    )
    assert "measured over predicted" not in said
    assert max(map(len, said.splitlines())) <= 80


def test_the_time_left_is_what_finished_tasks_lead_to_expect(main, campaign):
    """Tasks of every kind that took twice as long as predicted double it, for `plan` and `status`; results and shards stay."""
    out = campaign.parent / "out"
    planned = json.loads(main("plan", campaign, "--out", out, "--json")[1])
    here = origin.here()
    took = Run("a", "b", 1, nanoslip=here.nanoslip_version, solver=here.solver)
    out.mkdir()
    runs.add_run(
        out, replace(took, kinds={"compliance": [1, 1.0, 2.0], "record": [3, 3.0, 6.0], "drive": [2, 0.1, 0.2]})
    )
    learned = json.loads(main("plan", campaign, "--out", out, "--json")[1])
    assert learned["measured"] == pytest.approx({"compliance": 2.0, "record": 2.0, "drive": 2.0})
    for ranks, seconds in planned["seconds_left"].items():
        assert learned["seconds_left"][ranks] == pytest.approx(2.0 * seconds, rel=1e-9)
    looked = json.loads(main("status", campaign, "--out", out, "--json")[1])
    for kind, count in planned["tasks"].items():
        assert looked["tasks"][kind]["core_seconds_left"] == pytest.approx(2.0 * count["core_seconds_left"], rel=1e-9)
    words = " ".join(main("plan", campaign, "--out", out)[1].split())
    assert "measured over predicted seconds: compliance 2 x, record 2 x, drive 2 x" in words
    assert ", by what 6 tasks took" in words


def test_a_few_tasks_are_measured_here_where_that_is_asked_for_and_nothing_is_kept(main, campaign):
    out = campaign.parent / "out"
    code, said, _ = main("plan", campaign, "--out", out, "--measure", "--json")
    assert code == 0
    found = json.loads(said)
    assert set(found["measured"]) == {"compliance", "record", "drive"}
    assert all(factor > 0.0 for factor in found["measured"].values())
    assert not out.exists()
    for kind, count in found["tasks"].items():
        whole = json.loads(main("plan", campaign, "--out", out, "--json")[1])["tasks"][kind]["core_seconds_left"]
        assert count["core_seconds_left"] == pytest.approx(found["measured"][kind] * whole, rel=1e-9)


def test_a_finished_campaign_has_no_time_left_and_says_what_its_tasks_took(main, campaign):
    out = campaign.parent / "out"
    assert main("run", campaign, "--out", out, "--serial")[0] == 0
    _, said, _ = main("plan", campaign, "--out", out)
    assert "time left: none, all tasks are finished" in said
    assert "measured over predicted seconds: compliance" in said
