"""Shards compute a campaign between them; merged, they are the same bytes as one run. What one has not finished is left."""

from pathlib import Path

import pytest

import nanoslip
from nanoslip.study.results import attempts as runs
from nanoslip.study.results.shard import Shard
from nanoslip.study.results.store import Lease
from nanoslip.study.run import executor
from nanoslip.study.run.compute import run_task
from tests.conftest import Main
from tests.study.run.defects import crashing, crashing_at


def dataset(out: Path) -> bytes:
    return (out / "results.nc").read_bytes()


def test_merged_shards_are_the_same_bytes_as_one_run(main: Main, campaign: Path, tmp_path: Path) -> None:
    out, alone = tmp_path / "out", tmp_path / "alone"
    for number in (3, 1, 2):
        code, said, errors = main("run", campaign, "--out", out, "--serial", "--shard", f"{number}/3")
        assert (code, f"shard {number} of 3 is done; nanoslip merge {campaign} --out {out} brings" in said) == (0, True)
        assert f", shard {number} of 3: " in errors
    assert not (out / "results.nc").exists()
    assert main("status", campaign, "--out", out, "--json")[1].count('"finished": true') == 1
    unmerged = f"counted with the results of 3 shards not merged yet; nanoslip merge {campaign} --out {out} brings"
    assert unmerged in main("status", campaign, "--out", out)[1]
    code, said, errors = main("merge", campaign, "--out", out)
    assert (code, f"dataset: {out / 'results.nc'}" in said, errors) == (0, True, "")
    assert sorted(path.name for path in out.iterdir()) == ["results", "results.nc", "runs.jsonl"]
    assert len(runs.read(out)) == 3
    assert main("run", campaign, "--out", alone, "--serial")[0] == 0
    assert dataset(out) == dataset(alone)
    code, _, errors = main("run", campaign, "--out", out, "--serial")
    assert (code, "0 tasks to do" in errors) == (0, True)


def test_a_shard_for_which_no_case_is_left_says_so_and_ends_well(main: Main, campaign: Path, tmp_path: Path) -> None:
    code, said, errors = main("run", campaign, "--out", tmp_path, "--serial", "--shard", "5/5")
    assert (code, said.startswith("shard 5 of 5 has nothing to do: "), errors) == (0, True, "")
    for number in (1, 2, 3, 4):
        assert main("run", campaign, "--out", tmp_path, "--serial", "--shard", f"{number}/5")[0] == 0
    code, said, errors = main("merge", campaign, "--out", tmp_path)
    assert (code, f"dataset: {tmp_path / 'results.nc'}" in said, errors) == (0, True, "")


def test_what_a_shard_has_not_finished_is_left_and_another_run_of_it_or_of_all_computes_that_alone(
    main: Main, campaign: Path, tmp_path: Path
) -> None:
    out, alone = tmp_path / "out", tmp_path / "alone"
    main("run", campaign, "--out", out, "--serial", "--shard", "1/2")
    code, _, errors = main("merge", campaign, "--out", out)
    assert (code, f"tasks left: nanoslip run {campaign} --out {out} computes them" in errors) == (99, True)
    code, _, errors = main("run", campaign, "--out", out, "--serial", "--shard", "1/2")
    assert (code, "0 tasks to do" in errors) == (0, True)  # it is merged
    assert main("run", campaign, "--out", out, "--serial", "--shard", "2/2")[0] == 0
    code, _, errors = main("run", campaign, "--out", out, "--serial")  # takes in what shards have
    assert (code, "0 tasks to do" in errors) == (0, True)
    main("run", campaign, "--out", alone, "--serial")
    assert dataset(out) == dataset(alone)


def test_a_shard_of_which_tasks_failed_has_ended_without_them(
    main: Main, campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(executor, "run_task", crashing(lambda task: task.kind == "record"))
    for _ in ("now", "before"):
        code, said, _ = main("run", campaign, "--out", tmp_path, "--serial", "--shard", "1/1")
        assert (code, "shard 1 of 1 has ended without 12 tasks; nanoslip merge" in said) == (3, True)


def test_python_takes_in_what_shards_have_finished_too(main: Main, campaign: Path, tmp_path: Path) -> None:
    main("run", campaign, "--out", tmp_path, "--serial", "--shard", "1/1")
    nanoslip.run(campaign, tmp_path).close()
    assert len(runs.read(tmp_path)) == 1  # it had nothing to compute
    assert not (tmp_path / "shards").exists()


def test_collecting_says_how_many_shards_it_leaves_out(main: Main, campaign: Path, tmp_path: Path) -> None:
    main("run", campaign, "--out", tmp_path, "--serial", "--shard", "1/2")
    code, said, _ = main("collect", campaign, "--out", tmp_path)
    assert (code, f"without 1 shard; nanoslip merge {campaign} --out {tmp_path} takes them in" in said) == (0, True)


def test_a_shard_at_work_is_named_and_the_others_are_merged(main: Main, campaign: Path, tmp_path: Path) -> None:
    for number in (1, 2):
        main("run", campaign, "--out", tmp_path, "--serial", "--shard", f"{number}/2")
    with Lease(Shard(2, 2).folder(tmp_path)):
        code, _, errors = main("merge", campaign, "--out", tmp_path)
    assert (code, errors.count("a run is at work there")) == (99, 1)
    assert main("merge", campaign, "--out", tmp_path)[0] == 0


def test_a_failure_of_a_shard_is_one_of_the_campaign_and_not_tried_again(
    main: Main, campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(executor, "run_task", crashing_at("record", 100.0))
    codes = [main("run", campaign, "--out", tmp_path, "--serial", "--shard", f"{number}/2")[0] for number in (1, 2)]
    assert 3 in codes
    code, said, errors = main("merge", campaign, "--out", tmp_path)
    assert (code, "crashed: 2 of 4 cases" in said, "--retry tries again" in errors) == (3, True, True)
    monkeypatch.setattr(executor, "run_task", run_task)
    for number in (1, 2):
        code, _, errors = main("run", campaign, "--out", tmp_path, "--serial", "--shard", f"{number}/2")
        assert "0 tasks to do" in errors
        assert code == codes[number - 1]
        main("run", campaign, "--out", tmp_path, "--serial", "--shard", f"{number}/2", "--retry")
    assert main("merge", campaign, "--out", tmp_path)[0] == 0


def test_what_is_no_shard_is_one_line_and_exit_code_2(main: Main, campaign: Path) -> None:
    code, _, errors = main("run", campaign, "--shard", "4/3")
    assert code == 2
    assert "4/3: needs NUMBER/OF, as 1/10 to 10/10" in errors


def test_what_other_shards_have_not_computed_is_left(main: Main, campaign: Path, tmp_path: Path) -> None:
    assert main("run", campaign, "--out", tmp_path, "--serial", "--shard", "1/2")[0] == 0
    assert main("merge", campaign, "--out", tmp_path)[0] == 99
    assert '"finished": false' in main("status", campaign, "--out", tmp_path, "--json")[1]
    code, _, errors = main("run", campaign, "--out", tmp_path, "--serial")
    assert (code, "4 cases, 0 tasks left" in errors) == (0, False)
    assert '"pending"' not in main("status", campaign, "--out", tmp_path, "--json")[1]


def test_where_there_is_no_shard_and_no_result_nothing_is_merged_and_no_folder_made(
    main: Main, campaign: Path, tmp_path: Path
) -> None:
    """As where `--out` was forgotten: an empty dataset would pass for one of the shards."""
    out = tmp_path / "elsewhere"
    code, said, errors = main("merge", campaign, "--out", out)
    assert (code, said, out.exists()) == (2, "", False)
    assert f"{out}: no shards and no results of {campaign} there" in errors
