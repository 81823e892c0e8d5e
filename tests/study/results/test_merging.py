"""What shards have finished is moved, with what is known of failures and runs; one that is at work keeps what it has."""

from dataclasses import replace
from pathlib import Path

import pytest

from nanoslip.solver.outcome import COMPLETED
from nanoslip.study.origin import here
from nanoslip.study.plan.task import TaskResult
from nanoslip.study.results import attempts
from nanoslip.study.results import attempts as runs
from nanoslip.study.results.attempts import Attempt, Run
from nanoslip.study.results.shard import Shard
from nanoslip.study.results.store import Lease, Store, merge_shards

RUN = Run("a", "2026-01-01T00:00:00+00:00", 1)
FAILED = Attempt("d" * 20, "record", "crashed", "why", True, False, here().solver, "rank 0 on here", "2026")


def filled(out: Path, number: int, key: str, shared: bool = False) -> Path:
    """A shard with one result, one failure and one run. shared: the result has a file of its own."""
    folder = Shard(number, 3).folder(out)
    store = Store(folder)
    store.prepare()
    store.write(TaskResult(key, "contact", COMPLETED, {"approach": float(number)}), shared)
    assert not attempts.add(folder, replace(FAILED, task=key[::-1]))
    assert not runs.add_run(folder, replace(RUN, run=key))
    return folder


def prepared(out: Path) -> Store:
    store = Store(out)
    store.prepare()
    return store


def test_results_failures_and_journals_are_moved_and_nothing_stays(tmp_path: Path) -> None:
    store = prepared(tmp_path)
    store.write(TaskResult("f" * 20, "contact", COMPLETED))
    keys = {"a" * 19 + "1", "b" * 19 + "2"}
    for number, key in enumerate(sorted(keys), 1):
        filled(tmp_path, number, key)
    assert merge_shards(tmp_path) == []
    assert store.finished() == keys | {"f" * 20}
    assert store.read("b" * 19 + "2").scalars == {"approach": 2.0}
    assert set(attempts.final(tmp_path, here().solver)) == {key[::-1] for key in keys}
    assert {run.run for run in runs.read(tmp_path)} == keys
    assert not (tmp_path / "shards").exists()
    assert merge_shards(tmp_path) == []


def test_files_that_no_run_has_written_are_moved_and_take_nothings_place(tmp_path: Path) -> None:
    store = prepared(tmp_path)
    for number in (1, 2):
        (filled(tmp_path, number, f"{number}" * 20) / "results" / "notes.log").write_text(f"of shard {number}")
    assert merge_shards(tmp_path) == []
    assert sorted(path.read_text() for path in store.folder.glob("notes.log*")) == ["of shard 1", "of shard 2"]


@pytest.mark.parametrize("shared", [False, True])
def test_a_result_that_is_there_already_is_replaced_by_the_later_one(tmp_path: Path, shared: bool) -> None:
    store = prepared(tmp_path)
    key = "a" * 19 + "1"
    store.write(TaskResult(key, "contact", COMPLETED, {"approach": 7.0}), shared)
    filled(tmp_path, 1, key, shared)
    assert merge_shards(tmp_path) == []
    assert Store(tmp_path).read(key).scalars == {"approach": 1.0}


def test_of_two_logs_the_one_that_was_merged_last_counts(tmp_path: Path) -> None:
    prepared(tmp_path)
    key = "a" * 19 + "1"
    for number in (3, 1, 2):
        filled(tmp_path, number, key)
        assert merge_shards(tmp_path) == []
        assert Store(tmp_path).read(key).scalars == {"approach": float(number)}
    assert [path.name.partition("-")[0] for path in sorted((tmp_path / "results").iterdir())] == [
        "000001", "000002", "000003",
    ]  # fmt: skip


def test_what_a_killed_run_has_not_finished_writing_is_named_and_left_out(tmp_path: Path, capsys) -> None:
    store = prepared(tmp_path)
    shard = filled(tmp_path, 1, "a" * 19 + "1")
    (log,) = (shard / "results").iterdir()
    log.write_bytes(log.read_bytes()[:-8])
    with (shard / runs.RUNS_FILE).open("a") as journal:
        journal.write('{"run": "cut sh')
    filled(tmp_path, 2, "b" * 19 + "2")
    assert merge_shards(tmp_path) == []
    assert "its end was torn" in capsys.readouterr().err
    assert store.finished() == {"b" * 19 + "2"}
    assert len(runs.read(tmp_path)) == 2


def test_a_shard_where_a_run_is_at_work_is_left_to_it_and_named(tmp_path: Path) -> None:
    store = prepared(tmp_path)
    filled(tmp_path, 1, "a" * 19 + "1")
    busy = filled(tmp_path, 2, "b" * 19 + "2")
    with Lease(busy):
        (said,) = merge_shards(tmp_path)
    assert f"{busy}" in said
    assert "a run is at work there" in said
    assert store.finished() == {"a" * 19 + "1"}
    assert Store(busy).finished() == {"b" * 19 + "2"}


def test_what_stands_where_a_result_belongs_stops_one_shard_not_the_others(tmp_path: Path) -> None:
    store = prepared(tmp_path)
    first = filled(tmp_path, 1, "a" * 19 + "1", shared=True)
    filled(tmp_path, 2, "b" * 19 + "2")
    for path in (first / "results").iterdir():
        (tmp_path / "results" / path.name / "deep").mkdir(parents=True)
    (said,) = merge_shards(tmp_path)
    assert f"{first}: cannot be merged" in said
    assert "b" * 19 + "2" in store.finished()
