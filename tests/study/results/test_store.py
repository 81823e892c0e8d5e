"""A result on disk is whole or not there, says the same as the value it was, and always in the same bytes."""

import os
import signal
import socket
import stat
import subprocess
import sys
import threading
import zipfile
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from subprocess import PIPE

import numpy as np
import pytest

from solver.outcome import COMPLETED, Ending, Outcome
from solver.slab import Slab
from study.plan.tasks import TaskResult, compliance_task, run_task
from study.results.sealed import CorruptResultError
from study.results.store import Store, StoreError
from study.results.whole_file import written_whole

RECORD = TaskResult(
    "0123456789abcdef0123",
    "record",
    Outcome(Ending.CASCADE_LIMIT, "one event needed more slips than slip.cascade_limit (μ_i = 0.5)"),
    {"plateau_mean": 0.1 + 0.2, "plateau_std": float("nan"), "events": np.int64(3)},
    {"displacement": np.array([0.1, 0.2, 0.3]), "kind": np.array([0, 1, 2], dtype=np.int8), "none": np.empty(0)},
)
COMPLIANCE = TaskResult("fedcba98765432100123", "compliance", COMPLETED, {}, {"matrix": np.arange(16.0).reshape(4, 4)})
OTHER_RECORD = replace(RECORD, key="aaaaaaaaaaaaaaaaaaaa", scalars={"plateau_mean": 0.5})
OTHER_COMPLIANCE = replace(COMPLIANCE, key="bbbbbbbbbbbbbbbbbbbb", arrays={"matrix": np.ones((4, 4))})
REFUSED = TaskResult("00000000000000000000", "compliance", Outcome(Ending.SINGULAR_OPERATOR, "no support"))


@pytest.fixture
def store(tmp_path: Path) -> Store:
    store = Store(tmp_path / "deep" / "down")
    store.prepare()
    return store


def same(one: TaskResult, other: TaskResult) -> bool:
    return (
        (one.key, one.kind, one.outcome) == (other.key, other.kind, other.outcome)
        and one.scalars.keys() == other.scalars.keys()
        and all(np.array_equal(one.scalars[name], other.scalars[name], equal_nan=True) for name in one.scalars)
        and one.arrays.keys() == other.arrays.keys()
        and all(np.array_equal(one.arrays[name], other.arrays[name]) for name in one.arrays)
        and all(one.arrays[name].dtype == other.arrays[name].dtype for name in one.arrays)
    )


@pytest.mark.parametrize("result", [RECORD, COMPLIANCE, REFUSED], ids=["record", "compliance", "refused"])
def test_what_is_written_is_read_and_counts_as_finished(store, result):
    assert store.finished() == set()
    assert store.find(result.key) is None
    store.write(result)
    assert store.finished() == {result.key}
    assert same(store.read(result.key), result)


def test_arrays_that_were_read_cannot_be_changed(store):
    for result in (RECORD, COMPLIANCE):
        store.write(result)
        for array in store.read(result.key).arrays.values():
            assert not array.flags.writeable


def test_a_compliance_is_mapped_into_memory_and_looks_like_any_array(store):
    store.write(COMPLIANCE)
    matrix = store.read(COMPLIANCE.key).arrays["matrix"]
    assert type(matrix) is np.ndarray  # kernels compile for plain arrays
    assert isinstance(matrix.base, np.memmap)


@pytest.mark.parametrize("result", [RECORD, COMPLIANCE], ids=["record", "compliance"])
def test_the_same_result_is_the_same_bytes(store, tmp_path, result, monkeypatch):
    store.write(result)
    again = Store(tmp_path / "again")
    again.prepare()
    monkeypatch.setattr("time.time", lambda: 2e9)
    again.write(result)
    for path in store.folder.iterdir():
        assert path.read_bytes() == (again.folder / path.name).read_bytes()


@pytest.mark.parametrize("result", [RECORD, COMPLIANCE], ids=["record", "compliance"])
def test_a_file_cut_short_anywhere_is_not_finished_and_said(store, result, capsys):
    store.write(result)
    for path in sorted(store.folder.iterdir()):
        whole = path.read_bytes()
        for length in {0, 1, len(whole) // 3, len(whole) // 2, len(whole) - 1}:
            path.write_bytes(whole[:length])
            assert store.finished() == set(), f"{path.name} cut to {length} of {len(whole)} bytes"
            assert "computed again" in capsys.readouterr().err
            assert store.find(result.key) is None
            assert "computed again" in capsys.readouterr().err
        path.write_bytes(whole)
    assert store.finished() == {result.key}


@pytest.mark.parametrize("result", [RECORD, COMPLIANCE], ids=["record", "compliance"])
def test_a_flipped_bit_in_the_numbers_is_found(store, result, capsys):
    store.write(result)
    path = next(path for path in store.folder.iterdir() if path.suffix in (".npz", ".npy"))
    whole = bytearray(path.read_bytes())
    number = np.array(0.2 if result is RECORD else 7.0).tobytes()
    whole[whole.index(number) + 3] ^= 1
    path.write_bytes(whole)
    assert store.finished() == set()
    assert path.name in capsys.readouterr().err


def flipped(content: bytes, bit: int) -> bytes:
    changed = bytearray(content)
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


@pytest.mark.parametrize("result", [RECORD, COMPLIANCE, REFUSED], ids=["record", "compliance", "refused"])
@pytest.mark.parametrize("bits", [200, pytest.param(10_000, marks=pytest.mark.slow)])
def test_no_bit_of_a_file_changes_without_being_found(store, result, bits, capsys):
    store.write(result)
    paths = [path for path in sorted(store.folder.iterdir()) if path.suffix != ".npy"] or sorted(store.folder.iterdir())
    rng = np.random.default_rng(1)
    for path in paths:
        whole = path.read_bytes()
        for bit in rng.permutation(8 * len(whole))[:bits]:
            path.write_bytes(flipped(whole, int(bit)))
            assert store.find(result.key) is None, f"{path.name}: bit {bit} of {8 * len(whole)}"
            assert path.name in capsys.readouterr().err
        path.write_bytes(whole)
    assert same(store.read(result.key), result)


@pytest.mark.parametrize(
    "results", [(RECORD, OTHER_RECORD), (COMPLIANCE, OTHER_COMPLIANCE)], ids=["record", "compliance"]
)
def test_results_that_have_changed_places_are_found(store, results, capsys):
    for result in results:
        store.write(result)
    for suffix in {path.suffix for path in store.folder.iterdir()}:
        one, other = (store.folder / f"{result.key}{suffix}" for result in results)
        here, there = one.read_bytes(), other.read_bytes()
        one.write_bytes(there)
        other.write_bytes(here)
        assert store.finished() == set()
        assert len(capsys.readouterr().err.splitlines()) == 2
        one.write_bytes(here)
        other.write_bytes(there)
    assert store.finished() == {result.key for result in results}


@pytest.mark.parametrize("obstacle", ["folder", "full folder", "link to nothing", "pipe"])
@pytest.mark.parametrize("result", [RECORD, COMPLIANCE], ids=["record", "compliance"])
def test_what_stands_where_a_result_belongs_is_said_and_stops_nothing(store, result, obstacle, capsys):
    store.write(result)
    for path in sorted(store.folder.iterdir()):
        path.unlink()
        if obstacle == "pipe":
            os.mkfifo(path)
        elif obstacle == "link to nothing":
            path.symlink_to(store.folder / "nothing")
        else:
            path.mkdir()
            if obstacle == "full folder":
                (path / "mine").write_text("kept")
        assert store.finished() == set()
        assert "computed again" in capsys.readouterr().err
        store.write(result)
        assert same(store.read(result.key), result)
        assert store.finished() == {result.key}
    if obstacle == "full folder":
        assert {path.read_text() for path in store.folder.glob("*/mine")} == {"kept"}


def test_reading_what_is_no_result_names_the_file(store):
    path = store.folder / "ffff.npz"
    path.write_bytes(b"nonsense")
    with pytest.raises(CorruptResultError, match=r"ffff\.npz"):
        store.read("ffff")
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("other", b"")
    with pytest.raises(CorruptResultError, match=r"ffff\.npz"):
        store.read("ffff")


def test_a_writer_that_dies_leaves_the_old_file_and_no_new_one(tmp_path):
    path = tmp_path / "file"
    path.write_text("old")

    def die_halfway() -> None:
        with written_whole(path) as scratch:
            scratch.write_text("half of the n")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        die_halfway()
    assert [each.name for each in tmp_path.iterdir()] == ["file"]
    assert path.read_text() == "old"


@pytest.mark.parametrize(("umask", "mode"), [(0o022, 0o644), (0o027, 0o640), (0o077, 0o600)])
def test_the_mode_is_what_the_umask_leaves(store, umask, mode):
    before = os.umask(umask)
    try:
        store.write(RECORD)
        store.write(COMPLIANCE)
    finally:
        os.umask(before)
    assert {stat.S_IMODE(path.stat().st_mode) for path in store.folder.iterdir()} == {mode}


def test_leftovers_of_killed_runs_go_and_those_of_live_ones_stay(store):
    dead = subprocess.Popen(["true"])
    dead.wait()
    host = socket.gethostname().replace(".", "-")
    gone = store.folder / f".a.npz.{host}.{dead.pid}.1.scratch"
    alive = store.folder / f".a.npz.{host}.{os.getppid()}.1.scratch"
    elsewhere = store.folder / ".a.npz.otherhost.1.1.scratch"
    long_ago = store.folder / ".b.npz.otherhost.1.1.scratch"
    of_the_dataset = store.folder.parent / f".results.nc.{host}.{dead.pid}.1.scratch"
    not_ours = store.folder.parent / ".notes.scratch"
    for path in (gone, alive, elsewhere, long_ago, of_the_dataset, not_ours):
        path.touch()
    os.utime(long_ago, (0, 0))
    store.prepare()
    assert set(store.folder.iterdir()) == {alive, elsewhere}
    assert set(store.folder.parent.iterdir()) == {store.folder, not_ours}
    assert store.finished() == set()


def test_a_scratch_file_that_its_writer_puts_in_place_meanwhile_is_no_problem(store, monkeypatch):
    """Another host's run ends a result between two looks of this one."""
    leftover = store.folder / ".a.npz.otherhost.1.1.scratch"
    monkeypatch.setattr(Path, "glob", lambda *_: [leftover])
    store.prepare()


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="only /proc tells the dead from the living here")
def test_the_leftover_of_a_killed_run_that_nobody_buried_goes(store):
    killed = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
    leftover = store.folder / f".a.npz.{socket.gethostname().replace('.', '-')}.{killed.pid}.1.scratch"
    leftover.touch()
    store.prepare()
    assert leftover.exists()
    os.kill(killed.pid, signal.SIGKILL)
    os.waitid(os.P_PID, killed.pid, os.WEXITED | os.WNOWAIT)  # dead, and left lying as a container's init would
    store.prepare()
    assert not leftover.exists()
    killed.wait()


def test_two_writers_of_one_result_do_no_harm(store):
    def write() -> None:
        for _ in range(20):
            store.write(RECORD)
            store.write(COMPLIANCE)

    writers = [threading.Thread(target=write) for _ in range(3)]
    for writer in writers:
        writer.start()
    while any(writer.is_alive() for writer in writers):
        for key in store.finished():
            assert store.read(key).key == key
    assert store.finished() == {RECORD.key, COMPLIANCE.key}
    assert len(list(store.folder.iterdir())) == 3


def test_two_processes_that_compute_one_compliance_at_once_do_no_harm(store, environment):
    program = (
        "import sys; from study.execution.launch import pin_threads; pin_threads()\n"
        "from pathlib import Path; from solver.case import Slab\n"
        "from study.results.store import Store; from study.plan.tasks import compliance_task, run_task\n"
        "task, store = compliance_task(Slab(n_x=33)), Store(Path(sys.argv[1]))\n"
        "print('ready', flush=True); sys.stdin.readline()\n"
        "for _ in range(10): store.write(run_task(task, {}))\n"
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
    assert len(list(store.folder.iterdir())) == 2


@pytest.mark.parametrize("parent", ["/proc", "file"])
def test_a_folder_that_cannot_be_written_is_one_clear_message(tmp_path, parent):
    (tmp_path / "file").touch()
    store = Store(Path(parent) if parent.startswith("/") else tmp_path / parent)
    with pytest.raises(StoreError, match=f"{store.folder}: cannot write results there: .+"):
        store.prepare()


def test_a_disk_that_refuses_a_result_is_named(store, monkeypatch):
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(StoreError, match="No space left on device"):
        store.write(RECORD)
    assert list(store.folder.iterdir()) == []
