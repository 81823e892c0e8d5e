"""One run at a time works in a folder; one that was killed keeps nobody out."""

import json
import os
import shutil
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
from nanoslip.study.plan.task import Task, TaskResult
from nanoslip.study.results import entry as whole_file
from nanoslip.study.results import store as lease
from nanoslip.study.results.store import FILE, Lease, StoreError
from nanoslip.study.run import executor
from tests.study.results.results import written

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
import errno, fcntl, os, sys, time
from pathlib import Path
from nanoslip.study.results.store import Lease
from nanoslip.study.results.store import StoreError
from tests.study.results.results import written

folders, marks, runs, delay = sorted(Path(sys.argv[1]).iterdir()), Path(sys.argv[2]), int(sys.argv[3]), float(sys.argv[5])

def late(act):
    def later(*words, **more):
        time.sleep(delay)
        return act(*words, **more)
    return later

def unknown(*_):
    raise OSError(errno.EBADF, "no locks here")

if delay:
    fcntl.flock = fcntl.lockf = unknown
    for name in ("unlink", "rename", "replace", "link"):
        setattr(os, name, late(getattr(os, name)))

def until(kind):
    (marks / f"{kind}.{sys.argv[4]}").touch()
    while len(list(marks.glob(f"{kind}.*"))) < runs:
        time.sleep(1e-3)

for number, out in enumerate(folders):
    until(f"there {number}")
    try:
        with Lease(out):
            print("mine", number, flush=True)
            until(f"judged {number}")
    except StoreError:
        until(f"judged {number}")
"""


@pytest.mark.parametrize("delay", [0.0, 2e-3], ids=["at once", "without locks, every name changed 2 ms late"])
def test_of_several_runs_that_find_a_stale_lease_one_takes_it(
    tmp_path: Path, environment: dict[str, str], delay: float
) -> None:
    killed = subprocess.Popen(["true"])
    killed.wait()
    marks = tmp_path / "marks"
    marks.mkdir()
    folders = [tmp_path / "outs" / str(number) for number in range(25)]
    for out in folders:
        out.mkdir(parents=True)
        left_behind(out, socket.gethostname(), killed.pid)
    words = [sys.executable, "-c", RACE, str(tmp_path / "outs"), str(marks), "4"]
    runs = [
        subprocess.Popen([*words, str(run), str(delay)], env=environment, stdout=subprocess.PIPE, text=True)
        for run in range(4)
    ]
    won = [line for run in runs for line in run.communicate(timeout=120.0)[0].splitlines()]
    assert sorted(won) == sorted(f"mine {number}" for number in range(len(folders)))
    assert [path for out in folders for path in out.iterdir()] == []


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


def test_an_heir_that_was_killed_before_it_was_in_its_place_keeps_nobody_out(tmp_path: Path) -> None:
    killed = subprocess.Popen(["true"])
    killed.wait()
    stale = left_behind(tmp_path, socket.gethostname(), killed.pid)
    heir = lease._opened(stale).heir  # type: ignore[union-attr]
    heir.write_text(stale.read_text() + " ")
    with Lease(tmp_path):
        assert json.loads((tmp_path / FILE).read_text())["process"] == os.getpid()
    assert list(tmp_path.iterdir()) == []


def test_a_run_is_known_to_live_where_the_times_of_names_are_remembered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Clients of network file systems answer `stat` from memory for a minute; what is opened they ask for anew."""
    path, ask, known = left_behind(tmp_path, "elsewhere", 1), os.stat, dict[object, os.stat_result]()

    def remembered(name: object, *words: object, **more: object) -> os.stat_result:
        return known.setdefault(str(name), ask(name, *words, **more))  # type: ignore[call-overload, no-any-return]

    monkeypatch.setattr("os.stat", remembered)
    monkeypatch.setattr("os.lstat", remembered)
    os.stat(path)
    with touched(path), pytest.raises(StoreError, match="process 1 on elsewhere"), Lease(tmp_path):
        pytest.fail("two runs at once")


def test_nothing_is_written_through_a_link_that_has_the_name_of_a_scratch_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("secrets.token_hex", lambda number: "0" * 2 * number)
    scratch, foreign = whole_file.scratch_beside(tmp_path / FILE), tmp_path / "foreign"
    scratch.unlink()
    foreign.write_text("precious")
    scratch.symlink_to(foreign)
    with pytest.raises(StoreError, match="cannot be written: File exists"), Lease(tmp_path):
        pytest.fail("no lease")
    assert foreign.read_text() == "precious"


def test_a_run_whose_lease_is_gone_when_it_wakes_stops(tmp_path: Path, capsys) -> None:
    """Another run has taken over and ended: what it has finished would be computed again."""
    stopped = threading.Event()
    with Lease(tmp_path, stopped.set) as ours:
        (tmp_path / FILE).unlink()
        assert stopped.wait(5.0 * SOON)
        assert ours.look() == ours.lost
    assert "run again to continue" in ours.lost
    assert capsys.readouterr().err == f"{ours.lost}\n"
    assert list(tmp_path.iterdir()) == []


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


def test_a_command_that_wakes_after_another_has_done_its_work_computes_none_of_it_again(
    main, campaign: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compute, out = executor.run_task, campaign.parent / "out"
    elsewhere = campaign.parent / "elsewhere"
    assert main("run", campaign, "--out", elsewhere, "--serial")[0] == 0

    def asleep(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
        if not (out / "results.nc").exists():
            shutil.copytree(elsewhere, out, dirs_exist_ok=True)
            (out / FILE).unlink()
            time.sleep(SOON)
        return compute(task, inputs)

    monkeypatch.setattr(executor, "run_task", asleep)
    assert main("run", campaign, "--out", out, "--serial")[0] == 99
    monkeypatch.setattr(executor, "run_task", compute)
    assert main("run", campaign, "--out", out, "--serial")[0] == 0
    assert (written(out) - written(elsewhere)).total() <= 1  # what it had in hand
    assert (out / "results.nc").read_bytes() == (elsewhere / "results.nc").read_bytes()


def test_a_run_in_a_folder_where_another_is_at_work_is_exit_code_2(main, campaign: Path) -> None:
    out = campaign.parent / "out"
    with Lease(out):
        code, _, errors = main("run", campaign, "--out", out, "--serial")
        assert (code, errors.count("a run is at work there")) == (2, 1)
        assert main("status", campaign, "--out", out)[0] == 0
