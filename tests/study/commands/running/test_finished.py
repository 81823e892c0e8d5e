"""A finished campaign is left as it is; what is lost or asked for besides is made."""

import pytest

from nanoslip.study.results import entry as own
from nanoslip.study.run import mail as begun
from tests.study.commands.computing.test_run import disown


def test_it_is_shown_and_nothing_is_written(main, campaign, finished):
    before = (finished / "results.nc").read_bytes()
    stamps = {path: path.stat().st_mtime_ns for path in (finished / "results").iterdir()}
    code, said, errors = main("run", campaign, "--out", finished, "--serial")
    assert code == 0
    assert f"dataset: {finished / 'results.nc'}" in said
    assert "4 cases, 0 tasks left" in errors
    assert (finished / "results.nc").read_bytes() == before
    assert {path: path.stat().st_mtime_ns for path in (finished / "results").iterdir()} == stamps
    assert not (finished / "running.json").exists()


@pytest.mark.parametrize("lost", ["results.nc", "results/dataset.json", "results/*.log"])
def test_what_is_lost_is_made_again(main, campaign, finished, lost):
    before = (finished / "results.nc").read_bytes()
    for path in finished.glob(lost):
        path.unlink()
    assert main("run", campaign, "--out", finished, "--serial")[0] == 0
    assert (finished / "results.nc").read_bytes() == before


def test_a_campaign_that_asks_for_more_is_planned(main, campaign, finished):
    campaign.write_text(campaign.read_text().replace("[50.0, 100.0]", "[50.0, 100.0, 200.0]"))
    code, _, errors = main("run", campaign, "--out", finished, "--serial")
    assert (code, "6 cases" in errors) == (0, True)


def test_a_damaged_dataset_is_collected_again(main, campaign, finished):
    path = finished / "results.nc"
    before = path.read_bytes()
    path.write_bytes(before[:-100] + bytes(100))
    assert main("run", campaign, "--out", finished, "--serial")[0] == 0
    assert path.read_bytes() == before


def test_tasks_that_a_killed_run_was_at_are_looked_after(main, campaign, finished):
    key = next((finished / "results").glob(f"*{own.ENDING}")).stem
    (finished / begun.FILE).write_text(f"{key}\n")
    assert main("run", campaign, "--out", finished, "--serial")[0] == 0
    assert not (finished / begun.FILE).exists()


def test_results_of_other_software_are_named_and_computed_again_when_asked(main, campaign, finished):
    changed = disown(finished, every=3)
    for _ in range(2):  # the first run collects what has changed
        _, _, errors = main("run", campaign, "--out", finished, "--serial")
        assert f"{len(changed)} finished results are other software's" in errors
    _, _, errors = main("run", campaign, "--out", finished, "--serial", "--recompute-foreign")
    assert f"{len(changed)} results of other software count as not finished" in errors
