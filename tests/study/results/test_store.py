"""Results on disk are found again as they were, in logs and in files of their own, whatever happens to a file."""

import os
import subprocess
import sys
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from nanoslip.study.results import attempts, entry as own, files
from nanoslip.study.results.entry import CorruptResultError, Meta, pack_result
from nanoslip.study.results.store import Store, StoreError
from tests.study.results.results import ALL, COMPLIANCE, OTHER, RECORD, flip, forbidden, same

EACH_PLACE = pytest.mark.parametrize("shared", [True, False], ids=["file", "log"])


@pytest.fixture
def store(tmp_path):
    store = Store(tmp_path / "deep" / "down")
    store.prepare()
    return store


def again(store):
    return Store(store.folder.parent)


@EACH_PLACE
def test_what_is_written_is_read_and_counts_as_finished(store, shared):
    """What no task reads shares a file."""
    assert store.finished() == set()
    for result in ALL:
        assert store.find(result.key) is None
        store.write(result, shared)
        found = store.read(result.key)
        assert same(found, result)
        assert not any(array.flags.writeable for array in found.arrays.values())
    assert store.finished() == {result.key for result in ALL}
    assert store.outcomes() == {result.key: result.outcome for result in ALL}
    assert len(list(store.folder.iterdir())) == (len(ALL) if shared else 1)


@EACH_PLACE
def test_results_that_may_not_be_read_are_not_none(shared):
    """Else they are pending, and the dataset is collected without them."""
    with TemporaryDirectory() as out:
        Path(out).chmod(0o755)
        store = Store(Path(out))
        store.prepare()
        store.write(RECORD, shared)
        with forbidden(store.folder), pytest.raises(PermissionError):
            again(store).finished()
        assert again(store).finished() == {RECORD.key}


@EACH_PLACE
@pytest.mark.parametrize("before", [True, False], ids=["file", "log"])
def test_what_is_computed_again_counts(store, before, shared):
    """Also where other tasks did not read it then, or do not now; by the same process, or by another one."""
    store.write(RECORD, before)
    for mean, writer in ((0.7, store), (0.1, again(store))):
        assert store.find(RECORD.key) is not None
        new = replace(OTHER, key=RECORD.key, scalars={**OTHER.scalars, "plateau_mean": [mean]})
        writer.write(new, shared)
        for each in (store, writer, again(store)):
            assert each.finished() == {RECORD.key}
            assert same(each.read(RECORD.key), new)


@EACH_PLACE
def test_an_unsound_result_is_named_and_its_repetition_counts(store, shared, capsys):
    for result in (OTHER, RECORD):
        store.write(result, shared)
    path = own.result_path(store.folder, RECORD.key) if shared else next(store.folder.iterdir())
    flip(path, 8 * path.stat().st_size - 8 * 100)
    later = again(store)
    later.prepare()
    assert later.finished() == {OTHER.key}
    assert f"{path}: " in (said := " ".join(capsys.readouterr().err.split()))
    assert "computes it again" in said
    assert later.find(RECORD.key) is None
    later.write(RECORD, shared)
    assert later.finished() == {OTHER.key, RECORD.key}
    assert same(later.read(RECORD.key), RECORD)
    capsys.readouterr()
    again(store).prepare()
    assert capsys.readouterr().err == ""


def test_a_damaged_file_is_read_from_a_log_where_that_has_it_and_named_where_none_has(store):
    store.write(RECORD, shared=True)
    path = own.result_path(store.folder, RECORD.key)
    content = path.read_bytes()
    path.write_bytes(content[:-1])
    with pytest.raises(CorruptResultError, match=path.name):
        store.read(RECORD.key)
    store.write(RECORD)
    path.write_bytes(content[:-1])
    assert same(store.read(RECORD.key), RECORD)


@pytest.mark.slow
def test_processes_that_write_one_result_at_once_do_no_harm(store, environment):
    program = (
        "import sys; from pathlib import Path; from nanoslip.study.results.store import Store, StoreError\n"
        "from tests.study.results.results import COMPLIANCE, RECORD\n"
        "store = Store(Path(sys.argv[1])); print('ready', flush=True); sys.stdin.readline()\n"
        "for _ in range(50): store.write(COMPLIANCE, shared=True); store.write(RECORD, shared=True)\n"
    )
    words = [sys.executable, "-c", program, str(store.folder.parent)]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "env": environment}
    with ExitStack() as stack:
        writers = [stack.enter_context(subprocess.Popen(words, **pipes)) for _ in range(2)]
        for writer in writers:
            writer.stdout.readline()
        for writer in writers:
            writer.stdin.write(b"go\n")
            writer.stdin.flush()
        looks = 0
        while any(writer.poll() is None for writer in writers):
            store.finished()
            found = [(store.find(result.key), result) for result in (RECORD, COMPLIANCE)]
            looks += all(each and same(each, result) for each, result in found)
            assert all(each is None or same(each, result) for each, result in found)
    assert [writer.returncode for writer in writers] == [0, 0]
    assert looks > 0
    assert store.finished() == {RECORD.key, COMPLIANCE.key}
    assert len(list(store.folder.iterdir())) == 2


@pytest.mark.parametrize("parent", ["/proc", "file"])
def test_a_folder_that_cannot_be_written_is_one_clear_message(tmp_path, parent):
    (tmp_path / "file").touch()
    store = Store(tmp_path / parent)
    with pytest.raises(StoreError, match=f"{store.folder}: cannot write results there: .+"):
        store.prepare()


def test_all_logs_are_made_to_last(store, monkeypatch):
    """When a run has ended; while it computes, each writer sees to it every second."""
    for result in ALL:
        again(store).write(result)
    synced, sync = [], os.fsync
    monkeypatch.setattr("os.fsync", lambda file: synced.append(os.fstat(file).st_ino) or sync(file))
    store.settle()
    assert sorted(synced) == sorted(path.stat().st_ino for path in store.folder.glob("*.log"))


@EACH_PLACE
def test_a_disk_that_refuses_a_result_is_named(store, shared, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    monkeypatch.setattr("os.write", full)
    with pytest.raises(StoreError, match="No space left"):
        store.write(RECORD, shared)
    assert store.finished() == set()


@pytest.mark.parametrize("text", ["nonsense\n", ""])
def test_what_is_not_known_any_more_of_failures_is_said_when_a_run_begins(tmp_path, text, capsys):
    (tmp_path / attempts.FILE).write_text(text)
    Store(tmp_path).prepare()
    assert (f"{attempts.FILE}: 1 line" in " ".join(capsys.readouterr().err.split())) == bool(text)
    Store(tmp_path).failures()
    assert capsys.readouterr().err == ""


def test_what_results_say_of_themselves_is_found_in_files_and_logs_alike(store):
    """And counted once where a result is in both."""
    store.write(RECORD)
    store.write(COMPLIANCE, shared=True)
    files.write_whole(own.result_path(store.folder, RECORD.key), [pack_result(RECORD)])
    said = store.metas()
    assert dict(said) == {each.key: Meta(each.kind, each.outcome, each.origins) for each in (RECORD, COMPLIANCE)}
    assert [key for key, _ in store.seals()] == sorted(said)


def test_damage_is_named_once_and_as_wide_as_the_terminal(store, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "60")
    (store.folder / f"{'a' * 20}.result").write_bytes(b"nothing whole")
    for _ in range(3):
        assert store.finished() == set()
        assert store.find("a" * 20) is None
    said = capsys.readouterr().err
    assert said.count("a whole result") == 1
    assert all(len(line) <= 60 or " " not in line for line in said.splitlines())


def test_a_folder_whose_name_is_not_utf_8_is_refused_before_anything_is_computed(main, campaign, tmp_path):
    """All was computed, and the dataset could not be written."""
    out = tmp_path / os.fsdecode(b"\xff\xfe")
    code, _, errors = main("run", campaign, "--out", out, "--serial")
    assert (code, errors.count("\n"), errors.rstrip().isprintable(), [*out.rglob("*.log")]) == (2, 1, True, [])
