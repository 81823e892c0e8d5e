"""Results on disk are found again as they were, in logs and in files of their own, whatever happens to a file."""

import os
import subprocess
import sys
import threading
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from subprocess import PIPE

import numpy as np
import pytest

from nanoslip.solver.slab import Slab
from nanoslip.study.plan.kinds import compliance_task
from nanoslip.study.results import attempts
from nanoslip.study.results import entry as own
from nanoslip.study.results.entry import CorruptResultError, Meta, packed
from nanoslip.study.results.store import Store, StoreError
from nanoslip.study.run.compute import run_task
from tests.study.results.results import ALL, COMPLIANCE, OTHER, RECORD, flip, same

EACH_PLACE = pytest.mark.parametrize("shared", [True, False], ids=["file", "log"])


@pytest.fixture
def store(tmp_path: Path) -> Store:
    store = Store(tmp_path / "deep" / "down")
    store.prepare()
    return store


@EACH_PLACE
def test_what_is_written_is_read_and_counts_as_finished(store, shared):
    assert store.finished() == set()
    for result in ALL:
        assert store.find(result.key) is None
        store.write(result, shared)
        assert same(store.read(result.key), result)
    assert store.finished() == {result.key for result in ALL}
    assert store.outcomes() == {result.key: result.outcome for result in ALL}


@EACH_PLACE
def test_arrays_that_were_read_cannot_be_changed(store, shared):
    store.write(RECORD, shared)
    for array in store.read(RECORD.key).arrays.values():
        assert not array.flags.writeable


def test_results_that_no_task_reads_share_a_file(store):
    for result in ALL:
        store.write(result)
    assert len(list(store.folder.iterdir())) == 1


@EACH_PLACE
@pytest.mark.parametrize("before", [True, False], ids=["file", "log"])
def test_what_is_computed_again_counts(store, before, shared):
    """Also where other tasks did not read it then, or do not now."""
    store.write(RECORD, before)
    again = replace(RECORD, scalars={"plateau_mean": 0.7})
    other = Store(store.folder.parent)
    other.write(again, shared)
    for each in (store, other, Store(store.folder.parent)):
        assert each.finished() == {RECORD.key}
        assert same(each.read(RECORD.key), again)


@EACH_PLACE
def test_what_is_written_twice_is_read_as_it_was_the_second_time(store, shared):
    for mean in (0.1, 0.2):
        again = replace(RECORD, scalars={"plateau_mean": mean})
        store.write(again, shared)
        assert same(store.read(RECORD.key), again)


@EACH_PLACE
def test_an_unsound_result_is_named_and_its_repetition_counts(store, shared, capsys):
    for result in (OTHER, RECORD):
        store.write(result, shared)
    path = own.path_of(store.folder, RECORD.key) if shared else next(store.folder.iterdir())
    flip(path, 8 * path.stat().st_size - 8 * 100)
    again = Store(store.folder.parent)
    again.prepare()
    assert again.finished() == {OTHER.key}
    assert f"{path}: " in (said := capsys.readouterr().err)
    assert "computed again" in said
    assert again.find(RECORD.key) is None
    again.write(RECORD, shared)
    assert again.finished() == {OTHER.key, RECORD.key}
    assert same(again.read(RECORD.key), RECORD)
    capsys.readouterr()
    Store(store.folder.parent).prepare()
    assert capsys.readouterr().err == ""


def test_a_damaged_file_is_read_from_a_log_where_that_has_it(store):
    store.write(RECORD, shared=True)
    path = own.path_of(store.folder, RECORD.key)
    content = path.read_bytes()
    store.write(RECORD)
    path.write_bytes(content[:-1])
    assert same(store.read(RECORD.key), RECORD)


def test_reading_what_is_no_result_names_the_file(store):
    path = own.path_of(store.folder, "ffff")
    path.write_bytes(b"nonsense")
    with pytest.raises(CorruptResultError, match=r"ffff\.result"):
        store.read("ffff")


def test_two_writers_of_one_result_do_no_harm(store):
    def write() -> None:
        for _ in range(20):
            store.write(RECORD, shared=True)
            store.write(COMPLIANCE, shared=True)

    writers = [threading.Thread(target=write) for _ in range(3)]
    for writer in writers:
        writer.start()
    while any(writer.is_alive() for writer in writers):
        for key in store.finished():
            assert store.read(key).key == key
    assert store.finished() == {RECORD.key, COMPLIANCE.key}
    assert len(list(store.folder.iterdir())) == 2


def test_two_processes_that_compute_one_compliance_at_once_do_no_harm(store, environment):
    program = (
        "import sys; from nanoslip.study.run.launch import pin_threads; pin_threads()\n"
        "from pathlib import Path; from nanoslip.solver.case import Slab\n"
        "from nanoslip.study.results.store import Store; "
        "from nanoslip.study.plan.kinds import compliance_task; from nanoslip.study.run.compute import run_task\n"
        "task, store = compliance_task(Slab(n_x=33)), Store(Path(sys.argv[1]))\n"
        "print('ready', flush=True); sys.stdin.readline()\n"
        "for _ in range(10): store.write(run_task(task, {}), shared=True)\n"
    )
    words = [sys.executable, "-c", program, str(store.folder.parent)]
    task = compliance_task(Slab(n_x=33))
    right = run_task(task, {}).arrays["matrix"]
    with ExitStack() as stack:
        writers = [
            stack.enter_context(subprocess.Popen(words, env=environment, stdin=PIPE, stdout=PIPE)) for _ in range(2)
        ]
        for writer in writers:
            assert writer.stdout is not None
            writer.stdout.readline()
        for writer in writers:
            assert writer.stdin is not None
            writer.stdin.write(b"go\n")
            writer.stdin.flush()
        looks = 0
        while any(writer.poll() is None for writer in writers):
            found = store.find(task.key)
            if found is not None:
                looks += 1
                # Here BLAS may use several threads: sums agree to rounding, half a matrix would not.
                assert np.abs(found.arrays["matrix"] - right).max() < 1e-9 * np.abs(right).max()
    assert [writer.returncode for writer in writers] == [0, 0]
    assert looks > 0
    assert store.finished() == {task.key}
    assert len(list(store.folder.iterdir())) == 1


@pytest.mark.parametrize("parent", ["/proc", "file"])
def test_a_folder_that_cannot_be_written_is_one_clear_message(tmp_path, parent):
    (tmp_path / "file").touch()
    store = Store(Path(parent) if parent.startswith("/") else tmp_path / parent)
    with pytest.raises(StoreError, match=f"{store.folder}: cannot write results there: .+"):
        store.prepare()


def test_all_logs_are_made_to_last(store, monkeypatch):
    """When a run has ended; while it computes, each writer sees to it every second."""
    for result in ALL:
        Store(store.folder.parent).write(result)
    synced, sync = [], os.fsync
    monkeypatch.setattr("os.fsync", lambda file: synced.append(os.fstat(file).st_ino) or sync(file))
    store.settle()
    assert sorted(synced) == sorted(path.stat().st_ino for path in store.folder.glob("*.log"))


@EACH_PLACE
def test_a_disk_that_refuses_a_result_is_named(store, shared, monkeypatch):
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    monkeypatch.setattr("os.write", full)
    with pytest.raises(StoreError, match="No space left on device"):
        store.write(RECORD, shared)
    assert store.finished() == set()


def test_files_of_an_older_nanoslip_are_told_from_results(tmp_path: Path) -> None:
    store = Store(tmp_path)
    assert store.outdated() == []
    store.prepare()
    store.write(RECORD)
    store.write(OTHER, shared=True)
    assert store.outdated() == []
    for name in (f"{1:020x}.npz", f"{2:020x}.npy", "dataset.json", "mine.npz"):
        (store.folder / name).touch()
    assert [path.suffix for path in store.outdated()] == [".npz", ".npy"]


@pytest.mark.parametrize("text", ["nonsense\n", ""])
def test_what_is_not_known_any_more_of_failures_is_said_when_a_run_begins(tmp_path, text, capsys):
    (tmp_path / attempts.FILE).write_text(text)
    store = Store(tmp_path)
    store.prepare()
    assert (f"{attempts.FILE}: 1 line" in capsys.readouterr().err) == bool(text)
    store.failures()
    assert capsys.readouterr().err == ""


def test_what_results_say_of_themselves_is_found_in_files_and_logs_alike(store):
    """And counted once where a result is in both."""
    store.write(RECORD)
    store.write(COMPLIANCE, shared=True)
    own.write(own.path_of(store.folder, RECORD.key), packed(RECORD))
    said = store.metas()
    assert len(said) == 2
    assert dict(said) == {each.key: Meta(each.kind, each.outcome, each.origins) for each in (RECORD, COMPLIANCE)}
    assert OTHER.key not in said
    assert [key for key, _ in store.seals()] == sorted(said)
