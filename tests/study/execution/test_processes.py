"""Processes share the tasks without MPI; the death of one, a defect or a signal never leaves the others waiting."""

import hashlib
import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pytest

from solver.outcome import COMPLETED, Ending, Outcome
from study.execution.farm import FarmError, open_farm
from study.execution.ledger import Tally
from study.execution.processes import ProcessFarm
from tests.conftest import SMALL

PATIENCE = 120.0
"""Seconds after which a run is taken to hang; each takes a few."""


@dataclass(frozen=True)
class Work:
    key: str
    needs: tuple[str, ...] = ()
    cost: float = 0.01
    kind: str = "any"

    @property
    def label(self) -> str:
        return f"task {self.key}"


CHAIN_AND_REST = tuple(Work(str(number), (str(number - 1),) if 0 < number < 10 else ()) for number in range(40))


def execute(folder: Path, task: Work) -> Outcome:
    """Leave a file; the task `crash` is a defect, the task `die` kills its process."""
    assert all((folder / need).exists() for need in task.needs)
    if task.key == "crash":
        raise ZeroDivisionError("a defect")
    if task.key == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    with (folder / task.key).open("x") as file:  # never twice
        file.write(str(os.getpid()))
    time.sleep(0.02)
    return COMPLETED


def run(tasks: tuple[Work, ...], folder: Path) -> tuple[Tally, dict[str, Outcome]]:
    reported: dict[str, Outcome] = {}
    with ProcessFarm(2) as farm:
        tally = farm.run(tasks, partial(execute, folder), lambda task, outcome, _: reported.update({task.key: outcome}))
    return tally, reported


def test_every_task_is_computed_once_after_its_needs_by_all_processes(tmp_path: Path) -> None:
    tally, reported = run(CHAIN_AND_REST, tmp_path)
    assert tally == Tally(done=40)
    assert set(reported.values()) == {COMPLETED}
    assert len({path.read_text() for path in tmp_path.iterdir()}) == 2


def test_a_defect_is_told_and_the_rest_is_computed(tmp_path: Path) -> None:
    tally, reported = run((Work("crash"), Work("after", ("crash",)), *CHAIN_AND_REST), tmp_path)
    assert tally == Tally(done=40, crashed=2)
    assert reported["crash"].ending is Ending.CRASHED
    assert "ZeroDivisionError: a defect" in reported["crash"].message
    assert reported["after"].ending is Ending.NEEDS_FAILED


def test_a_killed_process_takes_one_task_with_it_and_another_takes_its_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tasks = (Work("0"), Work("die"), *CHAIN_AND_REST[1:])
    tally, reported = run(tasks, tmp_path)
    assert tally == Tally(done=40, crashed=1)
    assert [key for key, outcome in reported.items() if not outcome.ok] == ["die"]
    assert "task die: its process died (signal 9)" in capsys.readouterr().err
    assert len({path.read_text() for path in tmp_path.iterdir()}) in (2, 3)


@pytest.mark.parametrize(("serial", "ranks"), [(True, "1"), (False, "2")])
def test_processes_beside_serial_or_ranks_are_refused(monkeypatch, serial: bool, ranks: str) -> None:
    monkeypatch.setenv("PMI_SIZE", ranks)
    with pytest.raises(FarmError, match="--jobs 3 with "):
        open_farm(serial=serial, jobs=3)


def sha256(out: Path) -> str:
    return hashlib.sha256((out / "results.nc").read_bytes()).hexdigest()


def test_the_dataset_is_the_same_as_that_of_one_process(nanoslip, campaign, tmp_path: Path) -> None:
    done = nanoslip("run", campaign, "--out", tmp_path / "two", "-j", 2)
    assert done.returncode == 0, done.stderr
    assert "13 tasks left, 2 processes" in done.stderr
    assert nanoslip("run", campaign, "--out", tmp_path / "one", "-j", 1).returncode == 0
    assert sha256(tmp_path / "two") == sha256(tmp_path / "one")


@pytest.mark.slow
@pytest.mark.mpi
def test_the_dataset_is_the_same_as_that_of_ranks(nanoslip, campaign, tmp_path: Path) -> None:
    assert nanoslip("run", campaign, "--out", tmp_path / "two", "--jobs", 3).returncode == 0
    assert nanoslip("run", campaign, "--out", tmp_path / "ranks", ranks=2).returncode == 0
    assert sha256(tmp_path / "two") == sha256(tmp_path / "ranks")
    refused = nanoslip("run", campaign, "--out", tmp_path / "no", "--jobs", 3, ranks=2)
    assert (refused.returncode, refused.stderr.count("--jobs 3 with a launcher")) == (2, 1)


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL], ids=["Ctrl-C", "killed"])
def test_a_signal_ends_all_processes_and_the_next_run_goes_on(environment, tmp_path: Path, number: int) -> None:
    """Ctrl-C reaches every process of the terminal; only the first decides. After its death none stays behind."""
    campaign, out = tmp_path / "long.toml", tmp_path / "out"
    radii = [50.0 + number for number in range(40)]
    campaign.write_text(
        SMALL.replace("[50.0, 100.0]", str(radii)).replace("n_x = 17", "n_x = 65").replace("= 60", "= 6000")
    )
    words = [sys.executable, "-m", "study", "run", str(campaign), "--out", str(out), "-j", "2"]
    running = subprocess.Popen(words, env=environment, stderr=subprocess.PIPE, text=True, start_new_session=True)
    while len(list(out.glob("results/*.npz"))) < 4:
        assert running.poll() is None
        time.sleep(0.01)
    if number == signal.SIGINT:
        os.killpg(running.pid, number)
    else:
        running.kill()
    _, said = running.communicate(timeout=PATIENCE)  # all that held standard error have ended
    assert running.returncode == (99 if number == signal.SIGINT else -signal.SIGKILL)
    assert "Traceback" not in said
    kept = {path.name: path.stat().st_mtime_ns for path in out.glob("results/*.npz")}
    assert 4 <= len(kept) < 3 * 80
    assert not (out / "results.nc").exists()
