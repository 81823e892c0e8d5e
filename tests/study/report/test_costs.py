"""What runs cost is written down beside the dataset, run by run, and read back; it stands in the way of nothing."""

from pathlib import Path

import pytest

import nanoslip
from study.report import costs
from tests.conftest import Main


def test_runs_are_read_back_as_they_were_written(tmp_path: Path) -> None:
    assert costs.read(tmp_path) == []
    first, second = costs.since(0.0, 2.5, 4, 9.25, 12), costs.since(86_400.0, 86_401.0, 1, 0.5, 1)
    costs.add(tmp_path, first)
    costs.add(tmp_path, second)
    assert costs.read(tmp_path) == [first, second]
    assert (first.started, first.wall_seconds) == ("1970-01-01T00:00:00+00:00", 2.5)


@pytest.mark.parametrize(
    "line",
    [
        "now,many",
        "1970-01-01T00:00:00+00:00,2,5.3",  # cut short
        "now,99999999999999999999,1e999,-5,-1",
        f"{'x' * 200_000},1,nan,1,1",
        "\0\0\0",
    ],
)
def test_lines_that_no_run_wrote_are_passed_over_and_the_next_run_begins_its_own(tmp_path: Path, line: str) -> None:
    path, run = tmp_path / costs.FILE, costs.since(0.0, 1.0, 1, 1.0, 1)
    path.write_text(f"started,processes,wall_seconds,core_seconds,tasks\n{line}")
    assert costs.read(tmp_path) == []
    assert costs.add(tmp_path, run) == ""
    assert costs.read(tmp_path) == [run]


def test_what_cannot_be_written_is_said_and_nothing_else(tmp_path: Path) -> None:
    (tmp_path / costs.FILE).mkdir()
    assert "runs.csv: cannot be written" in costs.add(tmp_path, costs.since(0.0, 1.0, 1, 1.0, 1))
    assert costs.read(tmp_path) == []


def test_a_campaign_has_its_dataset_where_its_cost_cannot_be_written(
    main: Main, campaign: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    (out / costs.FILE).mkdir(parents=True)
    code, _, said = main("run", campaign, "--out", out, "--serial")
    assert code == 0
    assert "runs.csv: cannot be written" in said
    assert (out / "results.nc").is_file()


def test_a_run_that_computes_writes_its_cost_beside_the_dataset_and_one_that_does_not_writes_none(
    tmp_path: Path,
) -> None:
    campaign = {"title": "Pressed", "stages": ["contact"], "numerics": {"n_x": 17}}
    for _ in range(2):
        nanoslip.run(campaign, tmp_path).close()
        (cost,) = costs.read(tmp_path)
    assert (cost.processes, cost.tasks) == (1, 2)  # a compliance and a contact
    assert 0.0 <= cost.core_seconds <= cost.wall_seconds
