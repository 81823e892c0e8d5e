"""A finished campaign is not planned anew; whatever else is to be done or said of it is found all the same."""

from pathlib import Path

import pytest

from study.commands.running import planning
from study.commands.shared import glance
from study.commands.shared.plans import planned_from
from study.execution.farms import begun
from study.results import own
from tests.study.commands.computing.test_run import disown


@pytest.fixture(autouse=True)
def large(monkeypatch) -> None:
    """The small campaign is large enough for an outline of its plan."""
    monkeypatch.setattr(glance, "LARGE", 1)


@pytest.fixture
def plans(monkeypatch) -> list[Path]:
    """The campaigns that runs have planned."""
    found: list[Path] = []
    monkeypatch.setattr(
        planning, "planned_from", lambda manifest: found.append(manifest.path) or planned_from(manifest)
    )
    return found


def test_it_is_shown_without_a_plan_and_nothing_is_written(main, campaign, finished, plans):
    before = (finished / "results.nc").read_bytes()
    stamps = {path: path.stat().st_mtime_ns for path in (finished / "results").iterdir()}
    code, said, errors = main("run", campaign, "--out", finished, "--serial")
    assert (code, plans) == (0, [])
    assert f"dataset: {finished / 'results.nc'}" in said
    assert "4 cases, 0 tasks left" in errors
    assert (finished / "results.nc").read_bytes() == before
    assert {path: path.stat().st_mtime_ns for path in (finished / "results").iterdir()} == stamps
    assert not (finished / "running.json").exists()


@pytest.mark.parametrize("lost", ["results.nc", "results/outline.npz", "results/dataset.json", "results/*.log"])
def test_what_is_lost_is_made_again(main, campaign, finished, plans, lost):
    before = (finished / "results.nc").read_bytes()
    for path in finished.glob(lost):
        path.unlink()
    assert main("run", campaign, "--out", finished, "--serial")[0] == 0
    assert plans == [campaign]
    assert (finished / "results.nc").read_bytes() == before
    assert main("run", campaign, "--out", finished, "--serial")[0] == 0
    assert plans == [campaign]  # all is there again


def test_a_campaign_that_asks_for_more_is_planned(main, campaign, finished, plans):
    campaign.write_text(campaign.read_text().replace("[50.0, 100.0]", "[50.0, 100.0, 200.0]"))
    code, _, errors = main("run", campaign, "--out", finished, "--serial")
    assert (code, plans, "6 cases" in errors) == (0, [campaign], True)


def test_a_damaged_dataset_is_collected_again(main, campaign, finished, plans):
    path = finished / "results.nc"
    before = path.read_bytes()
    path.write_bytes(before[:-100] + bytes(100))
    assert main("run", campaign, "--out", finished, "--serial")[0] == 0
    assert (plans, path.read_bytes()) == ([campaign], before)


def test_tasks_that_a_killed_run_was_at_are_looked_after(main, campaign, finished, plans):
    key = next((finished / "results").glob(f"*{own.ENDING}")).stem
    (finished / begun.FILE).write_text(f"{key}\n")
    assert main("run", campaign, "--out", finished, "--serial")[0] == 0
    assert (plans, (finished / begun.FILE).exists()) == ([campaign], False)


def test_results_of_other_software_are_named_and_computed_again_when_asked(main, campaign, finished, plans):
    changed = disown(finished, every=3)
    for _ in range(2):  # the first run collects what has changed
        _, _, errors = main("run", campaign, "--out", finished, "--serial")
        assert f"{len(changed)} finished results are other software's" in errors
    assert plans == [campaign]
    _, _, errors = main("run", campaign, "--out", finished, "--serial", "--recompute-foreign")
    assert f"{len(changed)} results of other software count as not finished" in errors
    assert plans == [campaign, campaign]
