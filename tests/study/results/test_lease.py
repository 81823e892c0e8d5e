"""One run at a time works in a folder; one that was killed keeps nobody out."""

import errno
import json
import os
import shutil
import socket
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import pytest

import nanoslip
from nanoslip.study.results import files, store as lease
from nanoslip.study.results.store import FILE, Lease, StoreError
from nanoslip.study.run import executor
from tests.study.results.results import written

SOON = 1.0
"""Seconds that stand for the minute after which a lease is stale."""


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(lease, "FRESH", SOON)
    monkeypatch.setattr(lease, "BEAT", SOON / 5.0)


def ended():
    """The number of a process that has ended."""
    killed = subprocess.Popen(["true"])
    killed.wait()
    return killed.pid


def left_behind(out, host="elsewhere", process=1, container=""):
    """The lease of a run that did not give it back."""
    machine = lease._machine().replace("pid:[", f"pid:[{container}")
    owner = {"host": host, "process": process, "started": "2026-01-01 00:00:00 UTC", "machine": machine}
    (out / FILE).write_text(json.dumps(owner))
    return out / FILE


@contextmanager
def touched(path):
    """Somebody keeps a file fresh."""
    over = threading.Event()

    def touch():
        while not over.wait(SOON / 10.0):
            os.utime(path)

    thread = threading.Thread(target=touch)
    thread.start()
    yield
    over.set()
    thread.join()


def refused(out, message):
    """Whether no run gets the lease of a folder, and reads why."""
    with pytest.raises(StoreError, match=message), Lease(out):
        pytest.fail("two runs at once")


def taken(out):
    """Take the lease of a folder as any run would; returns the seconds that it took."""
    begun = time.monotonic()
    with Lease(out):
        assert json.loads((out / FILE).read_text())["process"] == os.getpid()
        seconds = time.monotonic() - begun
    assert list(out.iterdir()) == []
    return seconds


def test_a_second_run_is_refused_with_who_is_at_work_until_the_first_has_ended(tmp_path):
    out = tmp_path / "deep" / "out"
    with Lease(out):
        time.sleep(1.5 * SOON)  # it stays fresh
        refused(out, f"process {os.getpid()} on {socket.gethostname()}, since .* another --out")
    taken(out)


def test_the_lease_of_a_process_of_this_machine_that_has_ended_is_taken_over_at_once(tmp_path):
    left_behind(tmp_path, socket.gethostname(), ended())
    assert taken(tmp_path) < SOON / 2.0


@pytest.mark.parametrize(
    "owner",
    [("elsewhere", 1), (socket.gethostname(), 2**22 - 1, "1")],
    ids=["another machine", "another container of this name"],
)
def test_the_lease_of_another_machine_counts_until_it_has_been_silent_for_long(tmp_path, owner, capsys):
    """Whatever process of this one has its number."""
    path = left_behind(tmp_path, *owner)
    with touched(path):
        refused(tmp_path, f"a run is at work there.*process {owner[1]} on {owner[0]}")
    taken(tmp_path)
    assert "it is silent" in " ".join(capsys.readouterr().err.split())
    os.utime(left_behind(tmp_path, *owner), (0, 0))
    assert taken(tmp_path) < SOON / 2.0


FOREIGN = ("", "nonsense", "[]", "{}", '{"process": -1}', '{"process": true}', "[" * 10**5, "\0\x1b[31m")
"""Texts that no run writes into its lease."""


def test_a_file_that_no_run_has_written_keeps_nobody_out_for_long(tmp_path):
    """All at once, as each is waited for."""
    folders = [tmp_path / str(number) for number in range(len(FOREIGN))]
    for folder, text in zip(folders, FOREIGN, strict=True):
        folder.mkdir()
        (folder / FILE).write_text(text)
        os.utime(folder / FILE, (time.time() + 1e6,) * 2)  # whatever times it claims
    with ThreadPoolExecutor(len(folders)) as threads:
        waited = dict(zip(FOREIGN, threads.map(taken, folders), strict=True))
    assert max(waited.values()) < 5.0 * SOON, waited


def test_what_is_no_file_is_put_aside_or_refused(tmp_path):
    path = tmp_path / FILE
    for put in (os.mkfifo, lambda path: path.symlink_to("nothing")):
        put(path)
        taken(tmp_path)
    path.mkdir()
    refused(tmp_path, "a folder")


RACE = """
import errno, fcntl, os, sys, time
from pathlib import Path
from nanoslip.study.results.store import Lease, StoreError
from tests.study.results.results import written

folders, marks, runs, delay = sorted(Path(sys.argv[1]).iterdir()), Path(sys.argv[2]), int(sys.argv[3]), float(sys.argv[5])

def late(act):
    def later(*words, **more):
        time.sleep(delay)
        return act(*words, **more)
    return later

def unknown(*_):
    raise OSError(errno.EBADF, "no locks here")

def unable(*_):
    raise PermissionError(errno.EPERM, "Operation not permitted")

if sys.argv[6] == "without links":
    os.link = unable
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


@pytest.mark.slow
@pytest.mark.everyday(1)
@pytest.mark.parametrize("links", ["links", "without links"])
@pytest.mark.parametrize("delay", [0.0, 2e-3], ids=["at once", "without locks, every name changed 2 ms late"])
def test_of_several_runs_that_find_a_stale_lease_one_takes_it(tmp_path, environment, delay, links):
    killed, folders = ended(), [tmp_path / "outs" / str(number) for number in range(12)]
    for folder in (*folders, tmp_path / "marks"):
        folder.mkdir(parents=True)
    for out in folders:
        left_behind(out, socket.gethostname(), killed)
    words = [sys.executable, "-c", RACE, str(tmp_path / "outs"), str(tmp_path / "marks"), "4"]
    runs = [
        subprocess.Popen([*words, str(run), str(delay), links], env=environment, stdout=subprocess.PIPE, text=True)
        for run in range(4)
    ]
    won = [line for run in runs for line in run.communicate(timeout=120.0)[0].splitlines()]
    assert sorted(won) == sorted(f"mine {number}" for number in range(len(folders)))
    assert [path for out in folders for path in out.iterdir()] == []


@pytest.mark.parametrize("code", [errno.EPERM, errno.ENOTSUP])
def test_where_no_hard_links_are_a_run_says_so_and_keeps_others_out_as_anywhere(tmp_path, monkeypatch, capsys, code):
    def unable(*_):
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr("os.link", unable)
    left_behind(tmp_path, socket.gethostname(), ended())
    with Lease(tmp_path):
        refused(tmp_path, f"process {os.getpid()} on")
    assert "no hard links" in " ".join(capsys.readouterr().err.split())
    (tmp_path / FILE).touch()  # of a run that was killed before it had written who it is
    refused_at = time.monotonic()
    taken(tmp_path)
    assert time.monotonic() - refused_at < 3.0 * SOON


def test_a_stale_lease_that_another_run_takes_while_it_is_judged_is_left_to_it(tmp_path, monkeypatch):
    left_behind(tmp_path, socket.gethostname(), ended())

    def taken_meanwhile(_):
        (tmp_path / FILE).unlink()
        left_behind(tmp_path, socket.gethostname(), os.getpid())
        monkeypatch.setattr(files, "lives", lambda _: True)
        return False

    monkeypatch.setattr(files, "lives", taken_meanwhile)
    refused(tmp_path, f"process {os.getpid()} on")


def test_an_heir_that_was_killed_before_it_was_in_its_place_keeps_nobody_out(tmp_path):
    stale = left_behind(tmp_path, socket.gethostname(), ended())
    lease._read_lease(stale).heir.write_text(stale.read_text() + " ")
    taken(tmp_path)


def test_a_run_is_known_to_live_where_the_times_of_names_are_remembered(tmp_path, monkeypatch):
    """Clients of network file systems answer `stat` from memory for a minute; what is opened they ask for anew."""
    path, ask, known = left_behind(tmp_path), os.stat, {}

    def remembered(name, *words, **more):
        return known.setdefault(str(name), ask(name, *words, **more))

    monkeypatch.setattr("os.stat", remembered)
    monkeypatch.setattr("os.lstat", remembered)
    os.stat(path)
    with touched(path):
        refused(tmp_path, "process 1 on elsewhere")


def test_nothing_is_written_through_a_link_that_has_the_name_of_a_scratch_file(tmp_path, monkeypatch):
    monkeypatch.setattr("secrets.token_hex", lambda number: "0" * 2 * number)
    scratch, foreign = files.make_scratch(tmp_path / FILE), tmp_path / "foreign"
    scratch.unlink()
    foreign.write_text("precious")
    scratch.symlink_to(foreign)
    refused(tmp_path, "cannot be written: File exists")
    assert (foreign.read_text(), scratch.is_symlink()) == ("precious", True)


def test_a_run_whose_lease_is_gone_when_it_wakes_stops(tmp_path, capsys):
    """Another run has taken over and ended: what it has finished would be computed again."""
    stopped = threading.Event()
    with Lease(tmp_path, stopped.set) as ours:
        (tmp_path / FILE).unlink()
        assert stopped.wait(5.0 * SOON)
        assert ours.look() == ours.lost
    assert "run again" in ours.lost
    assert capsys.readouterr().err.split() == ours.lost.split()
    assert list(tmp_path.iterdir()) == []


def test_a_run_that_was_silent_until_another_took_over_stops_names_it_and_leaves_it_its_lease(tmp_path, capsys):
    stopped = threading.Event()
    with Lease(tmp_path, stopped.set) as ours:
        assert not ours.lost
        path = left_behind(tmp_path)
        os.utime(path, (0, 0))
        assert stopped.wait(5.0 * SOON)
        time.sleep(SOON)
    assert path.stat().st_mtime == 0.0
    assert json.loads(path.read_text())["host"] == "elsewhere"
    assert "process 1 on elsewhere" in ours.lost
    assert capsys.readouterr().err.split() == ours.lost.split()


def test_the_command_whose_lease_is_lost_ends_with_exit_code_99_and_in_python_it_is_an_error(
    main, campaign, tmp_path, monkeypatch
):
    compute, out = executor.run_task, tmp_path / "out"

    def overtaken(task, inputs):
        if task.kind == "compliance":  # the first one
            left_behind(out)
            time.sleep(SOON)
        return compute(task, inputs)

    monkeypatch.setattr(executor, "run_task", overtaken)
    code, _, errors = main("run", campaign, "--out", out, "--serial")
    assert (code, errors.count("another run")) == (99, 1)
    assert json.loads((out / FILE).read_text())["host"] == "elsewhere"
    assert not (out / "results.nc").exists()
    (out / FILE).unlink()
    with pytest.raises(StoreError, match="another run"):
        nanoslip.run(campaign, out)


def test_a_command_that_wakes_after_another_has_done_its_work_computes_none_of_it_again(
    main, campaign, finished, tmp_path, monkeypatch
):
    compute, out = executor.run_task, tmp_path / "out"

    def asleep(task, inputs):
        if not (out / "results.nc").exists():
            shutil.copytree(finished, out, dirs_exist_ok=True)
            (out / FILE).unlink()
            time.sleep(SOON)
        return compute(task, inputs)

    monkeypatch.setattr(executor, "run_task", asleep)
    assert main("run", campaign, "--out", out, "--serial")[0] == 99
    monkeypatch.setattr(executor, "run_task", compute)
    assert main("run", campaign, "--out", out, "--serial")[0] == 0
    assert (written(out) - written(finished)).total() <= 1  # what it had in hand
    assert (out / "results.nc").read_bytes() == (finished / "results.nc").read_bytes()


def test_a_run_in_a_folder_where_another_is_at_work_is_exit_code_2(main, campaign, tmp_path):
    with Lease(tmp_path):
        code, _, errors = main("run", campaign, "--out", tmp_path, "--serial")
        assert (code, errors.count("is at work")) == (2, 1)
        assert main("status", campaign, "--out", tmp_path)[0] == 0
