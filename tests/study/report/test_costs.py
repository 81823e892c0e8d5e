"""What runs cost is written down beside the dataset, run by run, and read back; a broken file is named."""

from pathlib import Path

import pytest

import nanoslip
from study.dataset.store import StoreError
from study.report import costs


def test_runs_are_read_back_as_they_were_written(tmp_path: Path) -> None:
    assert costs.read(tmp_path) == []
    first, second = costs.since(0.0, 2.5, 4, 9.25, 12), costs.since(86_400.0, 86_401.0, 1, 0.5, 1)
    costs.add(tmp_path, first)
    costs.add(tmp_path, second)
    assert costs.read(tmp_path) == [first, second]
    assert (first.started, first.wall_seconds) == ("1970-01-01T00:00:00+00:00", 2.5)


def test_a_file_of_something_else_is_named(tmp_path: Path) -> None:
    (tmp_path / costs.FILE).write_text("started,processes\nnow,many\n")
    with pytest.raises(StoreError, match=r"runs\.csv: not what a run wrote there"):
        costs.read(tmp_path)


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match=r"runs\.csv: cannot be written"):
        costs.add(tmp_path / "none", costs.since(0.0, 1.0, 1, 1.0, 1))


def test_a_run_that_computes_writes_its_cost_beside_the_dataset_and_one_that_does_not_writes_none(
    tmp_path: Path,
) -> None:
    campaign = {"title": "Pressed", "stages": ["contact"], "numerics": {"n_x": 17}}
    for _ in range(2):
        nanoslip.run(campaign, tmp_path).close()
        (cost,) = costs.read(tmp_path)
    assert (cost.processes, cost.tasks) == (1, 2)  # a compliance and a contact
    assert 0.0 <= cost.core_seconds <= cost.wall_seconds
