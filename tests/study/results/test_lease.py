"""One run at a time works in a folder; one that was killed keeps nobody out."""

import errno
import json
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest

import nanoslip
from study.execution import executor
from study.plan.task import TaskResult
from study.plan.tasks import Task
from study.results import lease
from study.results.lease import FILE, Lease
from study.results.store import StoreError

SOON = 1.0
"""Seconds that stand for the minute after which a lease is stale."""


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lease, "FRESH", SOON)
    monkeypatch.setattr(lease, "BEAT", SOON / 5.0)


def left_behind(out: Path, host: str, process: int) -> Path:
    """The lease of a run that did not give it back."""
    path = out / FILE
    owner = {"host": host, "process": process, "started": "2026-01-01 00:00:00 UTC", "machine": lease._machine()}
    path.write_text(json.dumps(owner))
    return path


@contextmanager
def touched(path: Path) -> Iterator[None]:
    """Somebody keeps a file fresh."""
    over = threading.Event()

    def touch() -> None:
        while not over.wait(SOON / 10.0):
            os.utime(path)

    thread = threading.Thread(target=touch)
    thread.start()
    yield
    over.set()
    thread.join()


def test_a_second_run_is_refused_with_who_is_at_work_until_the_first_has_ended(tmp_path: Path) -> None:
    out = tmp_path / "deep" / "out"
    with Lease(out):
        time.sleep(1.5 * SOON)  # it stays fresh
        with (
            pytest.raises(StoreError, match=f"process {os.getpid()} on {socket.gethostname()}, since .* another --out"),
            Lease(out),
        ):
            pytest.fail("two runs at once")
    assert list(out.iterdir()) == []
    with Lease(out):
        pass


def test_the_lease_of_a_process_of_this_machine_that_has_ended_is_taken_over_at_once(tmp_path: Path) -> None:
    killed = subprocess.Popen(["true"])
    killed.wait()
    left_behind(tmp_path, socket.gethostname(), killed.pid)
    begun = time.monotonic()
    with Lease(tmp_path):
        assert time.monotonic() - begun < SOON / 2.0
        assert json.loads((tmp_path / FILE).read_text())["process"] == os.getpid()


def test_the_lease_of_another_machine_counts_until_it_has_been_silent_for_long(tmp_path: Path, capsys) -> None:
    path = left_behind(tmp_path, "elsewhere", 1)
    with touched(path), pytest.raises(StoreError, match="process 1 on elsewhere"), Lease(tmp_path):
        pytest.fail("two runs at once")
    with Lease(tmp_path):
        assert "it is silent" in capsys.readouterr().err
    old = left_behind(tmp_path, "elsewhere", 1)
    os.utime(old, (0, 0))
    begun = time.monotonic()
    with Lease(tmp_path):
        assert time.monotonic() - begun < SOON / 2.0


@pytest.mark.parametrize(
    "text", ["", "nonsense", "[]", "{}", '{"process": -1}', '{"process": true}', "[" * 10**5, "\0\x1b[31m"]
)
def test_a_file_that_no_run_has_written_keeps_nobody_out_for_long(tmp_path: Path, text: str) -> None:
    path = tmp_path / FILE
    path.write_text(text)
    os.utime(path, (time.time() + 1e6,) * 2)  # whatever times it claims
    with Lease(tmp_path):
        assert json.loads(path.read_text())["process"] == os.getpid()


def test_what_is_no_file_is_put_aside_or_refused(tmp_path: Path) -> None:
    path = tmp_path / FILE
    os.mkfifo(path)
    with Lease(tmp_path):
        assert path.is_file()
    path.symlink_to(tmp_path / "nothing")
    with Lease(tmp_path):
        assert path.is_file()
    assert not (tmp_path / "nothing").exists()
    path.mkdir()
    with pytest.raises(StoreError, match="a folder"), Lease(tmp_path):
        pytest.fail("no lease")


def test_a_lease_that_another_run_has_taken_is_left_to_it(tmp_path: Path) -> None:
    with Lease(tmp_path):
        path = left_behind(tmp_path, "elsewhere", 1)
    assert json.loads(path.read_text())["host"] == "elsewhere"


def test_a_process_of_another_container_of_this_name_is_not_taken_for_dead(tmp_path: Path) -> None:
    """Numbers of processes mean nothing there."""
    path = left_behind(tmp_path, socket.gethostname(), 2**22 - 1)
    path.write_text(path.read_text().replace("pid:[", "pid:[1"))
    with touched(path), pytest.raises(StoreError, match="a run is at work there"), Lease(tmp_path):
        pytest.fail("two runs at once")


def test_a_run_that_has_lost_its_lease_does_not_keep_another_ones_fresh(tmp_path: Path) -> None:
    with Lease(tmp_path):
        path = left_behind(tmp_path, "elsewhere", 1)
        os.utime(path, (0, 0))
        time.sleep(SOON)
        assert path.stat().st_mtime == 0.0


RACE = """
import sys, time
from pathlib import Path
from study.results.lease import Lease
from study.results.store import StoreError

out, marks, runs = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])

def until(kind):
    (marks / f"{kind}.{sys.argv[4]}").touch()
    while len(list(marks.glob(f"{kind}.*"))) < runs:
        time.sleep(1e-3)

until("there")
try:
    with Lease(out):
        print("mine", flush=True)
        until("judged")
except StoreError:
    print("refused", flush=True)
    until("judged")
"""


def test_of_several_runs_that_find_a_stale_lease_one_takes_it(tmp_path: Path, environment: dict[str, str]) -> None:
    killed = subprocess.Popen(["true"])
    killed.wait()
    out, marks = tmp_path / "out", tmp_path / "marks"
    out.mkdir()
    marks.mkdir()
    left_behind(out, socket.gethostname(), killed.pid)
    words = [sys.executable, "-c", RACE, str(out), str(marks), "4"]
    runs = [
        subprocess.Popen([*words, str(run)], env=environment, stdout=subprocess.PIPE, text=True) for run in range(4)
    ]
    said = sorted(run.communicate(timeout=60.0)[0] for run in runs)
    assert said == ["mine\n", *["refused\n"] * 3]
    assert list(out.iterdir()) == []


def test_a_stale_lease_that_another_run_takes_while_it_is_judged_is_left_to_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    killed = subprocess.Popen(["true"])
    killed.wait()
    left_behind(tmp_path, socket.gethostname(), killed.pid)

    def taken_meanwhile(process: int) -> bool:
        (tmp_path / FILE).unlink()
        left_behind(tmp_path, socket.gethostname(), os.getpid())
        monkeypatch.setattr(lease, "lives", lambda _: True)
        return False

    monkeypatch.setattr(lease, "lives", taken_meanwhile)
    with pytest.raises(StoreError, match=f"process {os.getpid()} on"), Lease(tmp_path):
        pytest.fail("two runs at once")


def test_where_the_file_system_knows_no_locks_a_stale_lease_is_taken_over_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unknown(*_: object) -> None:
        raise OSError(errno.EBADF, "no locks here")

    monkeypatch.setattr("fcntl.flock", unknown)
    os.utime(left_behind(tmp_path, "elsewhere", 1), (0, 0))
    with Lease(tmp_path), pytest.raises(StoreError, match="a run is at work there"), Lease(tmp_path):
        pytest.fail("two runs at once")


def test_a_run_that_was_silent_until_another_took_over_stops_and_names_it(tmp_path: Path, capsys) -> None:
    stopped = threading.Event()
    with Lease(tmp_path, stopped.set) as ours:
        assert not ours.lost
        left_behind(tmp_path, "elsewhere", 1)
        assert stopped.wait(5.0 * SOON)
    assert "another run has taken over, process 1 on elsewhere" in ours.lost
    assert capsys.readouterr().err == f"{ours.lost}\n"


def test_the_command_whose_lease_is_lost_ends_with_exit_code_99_and_in_python_it_is_an_error(
    main, campaign: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compute, out = executor.run_task, campaign.parent / "out"

    def overtaken(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
        left_behind(out, "elsewhere", 1)
        time.sleep(SOON)
        return compute(task, inputs)

    monkeypatch.setattr(executor, "run_task", overtaken)
    code, _, errors = main("run", campaign, "--out", out, "--serial")
    assert (code, errors.count("another run has taken over")) == (99, 1)
    assert json.loads((out / FILE).read_text())["host"] == "elsewhere"
    assert not (out / "results.nc").exists()
    (out / FILE).unlink()
    with pytest.raises(StoreError, match="another run has taken over"):
        nanoslip.run(campaign, out)


def test_a_run_in_a_folder_where_another_is_at_work_is_exit_code_2(main, campaign: Path) -> None:
    out = campaign.parent / "out"
    with Lease(out):
        code, _, errors = main("run", campaign, "--out", out, "--serial")
        assert (code, errors.count("a run is at work there")) == (2, 1)
        assert main("status", campaign, "--out", out)[0] == 0
