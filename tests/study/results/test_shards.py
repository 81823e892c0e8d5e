"""A shard is a number of so many; what shards have finished is moved, with failures and journals, and nothing is lost."""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from nanoslip.study.origin import here
from nanoslip.study.results import attempts
from nanoslip.study.results.attempts import RUNS_FILE, Attempt, RunRecord
from nanoslip.study.results.files import Shard, shard_folders
from nanoslip.study.results.store import Lease, Store, merge_shards
from nanoslip.study.tasks.task import TaskResult
from tests.study.results.results import REFUSED, forbidden

ONE, TWO, THREE = (letter * 19 + number for letter, number in ("a1", "b2", "f3"))
RUN = RunRecord("a", "2026-01-01T00:00:00+00:00", 1)
FAILED = Attempt("d" * 20, "record", "crashed", "why", True, False, here().solver, "rank 0 on here", "2026")


def test_a_shard_is_read_and_has_a_folder_of_its_own(tmp_path):
    assert Shard.parse("3/10") == Shard(3, 10)
    assert str(Shard(3, 10)) == "shard 3 of 10"
    assert Shard(3, 10).folder(tmp_path) == tmp_path / "shards" / "03-of-10"
    assert Shard(7, 1000).folder(tmp_path).name == "0007-of-1000"


@pytest.mark.parametrize("text", ["", "3", "0/10", "11/10", "1/0", "-1/3", "1.5/3", "1/3/5", "٣/٥", "9999999/9999999"])
def test_what_is_no_shard_is_refused(text):
    with pytest.raises(ValueError, match="at most 999999"):
        Shard.parse(text)


def test_shards_of_a_folder_are_found_in_order(tmp_path):
    assert shard_folders(tmp_path) == []
    wanted = [Shard(number, 12).folder(tmp_path) for number in (2, 11)]
    for path in (*reversed(wanted), tmp_path / "shards" / "else"):
        path.mkdir(parents=True)
    (tmp_path / "shards" / "1-of-1").write_text("")
    assert shard_folders(tmp_path) == wanted


def test_shards_that_may_not_be_read_are_not_none():
    with TemporaryDirectory() as out:
        Path(out).chmod(0o755)
        Shard(1, 2).folder(Path(out)).mkdir(parents=True)
        with forbidden(Path(out) / "shards"), pytest.raises(PermissionError):
            shard_folders(Path(out))


@pytest.fixture
def store(tmp_path):
    store = Store(tmp_path)
    store.prepare()
    return store


def result(key, number):
    return TaskResult(key, "contact", REFUSED.outcome, {"approach": [float(number)]})


def filled(out, number, key, shared=False):
    """A shard with one result, one failure and one run. shared: the result has a file of its own."""
    folder = Shard(number, 3).folder(out)
    store = Store(folder)
    store.prepare()
    store.write(result(key, number), shared)
    assert not attempts.add_attempt(folder, replace(FAILED, task=key[::-1]))
    assert not attempts.add_run(folder, replace(RUN, run=key))
    return folder


def test_results_failures_and_journals_are_moved_and_nothing_stays(tmp_path, store):
    """Files of others too, which take nothing's place."""
    store.write(result(THREE, 0))
    for number, key in enumerate((ONE, TWO), 1):
        (filled(tmp_path, number, key) / "results" / "notes.log").write_text(f"of shard {number}")
    assert merge_shards(tmp_path) == []
    assert store.finished() == {ONE, TWO, THREE}
    assert store.read(TWO).scalars["approach"] == [2.0]
    assert set(attempts.final(tmp_path, here().solver)) == {ONE[::-1], TWO[::-1]}
    assert {run.run for run in attempts.read_runs(tmp_path)} == {ONE, TWO}
    assert sorted(path.read_text() for path in store.folder.glob("notes.log*")) == ["of shard 1", "of shard 2"]
    assert not (tmp_path / "shards").exists()
    assert merge_shards(tmp_path) == []


@pytest.mark.parametrize("shared", [False, True])
def test_of_several_results_of_a_task_the_one_that_was_merged_last_counts(tmp_path, store, shared):
    store.write(result(ONE, 7), shared)
    for number in (3, 1, 2):
        filled(tmp_path, number, ONE, shared)
        assert merge_shards(tmp_path) == []
        assert Store(tmp_path).read(ONE).scalars["approach"] == [float(number)]
    if not shared:
        assert [int(path.name.partition("-")[0]) for path in sorted(store.folder.iterdir())] == [1, 2, 3, 4]


def test_what_a_killed_run_has_not_finished_writing_is_named_and_left_out(tmp_path, store, capsys):
    shard = filled(tmp_path, 1, ONE)
    (log,) = (shard / "results").iterdir()
    log.write_bytes(log.read_bytes()[:-8])
    with (shard / RUNS_FILE).open("a") as journal:
        journal.write('{"run": "cut sh')
    filled(tmp_path, 2, TWO)
    assert merge_shards(tmp_path) == []
    assert "was torn" in " ".join(capsys.readouterr().err.split())
    assert store.finished() == {TWO}
    assert len(attempts.read_runs(tmp_path)) == 2


def test_a_shard_where_a_run_is_at_work_is_left_to_it_and_named(tmp_path, store):
    filled(tmp_path, 1, ONE)
    busy = filled(tmp_path, 2, TWO)
    with Lease(busy):
        (said,) = merge_shards(tmp_path)
    assert f"{busy}" in said
    assert "is at work" in said
    assert (store.finished(), Store(busy).finished()) == ({ONE}, {TWO})


def test_what_stands_where_a_result_belongs_stops_one_shard_not_the_others(tmp_path, store):
    first = filled(tmp_path, 1, ONE, shared=True)
    filled(tmp_path, 2, TWO)
    for path in (first / "results").iterdir():
        (store.folder / path.name / "deep").mkdir(parents=True)
    (said,) = merge_shards(tmp_path)
    assert f"{first}: cannot be merged" in said
    assert TWO in store.finished()
