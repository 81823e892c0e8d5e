"""Processes share the tasks without MPI; a signal or the death of the first one leaves none behind."""

import hashlib
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from nanoslip.solver.outcome import COMPLETED, Outcome
from nanoslip.study.run.agent import Agent
from nanoslip.study.run.dispatch import Tally
from nanoslip.study.run.farm import FarmError, ProcessFarm
from nanoslip.study.run.launch import Program
from nanoslip.study.run.mpi import open_farm
from tests.conftest import longer
from tests.study.results.results import until_written, written
from tests.study.run.farms.faults import program
from tests.study.run.made_up import Work

NOTHING = Program("builtins", "callable")

PATIENCE = 120.0
"""Seconds after which a run is taken to hang; each takes a few."""


CHAIN_AND_REST = tuple(Work(str(number), (str(number - 1),) if 0 < number < 10 else ()) for number in range(40))


def test_every_task_is_computed_once_after_its_needs_by_all_processes(tmp_path: Path) -> None:
    reported: dict[str, Outcome] = {}
    with ProcessFarm([Agent(program(tmp_path), number) for number in range(2)]) as farm:
        tally = farm.run(
            CHAIN_AND_REST, lambda tasks, outcome, _: reported.update({task.key: outcome for task in tasks})
        )
    assert tally == Tally(done=40)
    assert set(reported.values()) == {COMPLETED}
    assert len({path.read_text() for path in tmp_path.iterdir()}) == 2


@pytest.mark.parametrize(("serial", "ranks"), [(True, "1"), (False, "2")])
def test_processes_beside_serial_or_ranks_are_refused(monkeypatch, serial: bool, ranks: str) -> None:
    monkeypatch.setenv("PMI_SIZE", ranks)
    with pytest.raises(FarmError, match="--jobs 3 with "):
        open_farm(NOTHING, serial=serial, jobs=3)


def sha256(out: Path) -> str:
    return hashlib.sha256((out / "results.nc").read_bytes()).hexdigest()


def test_the_dataset_is_the_same_as_that_of_one_process(nanoslip, campaign, tmp_path: Path) -> None:
    done = nanoslip("run", campaign, "--out", tmp_path / "two", "-j", 2)
    assert done.returncode == 0, done.stderr
    assert "13 tasks left, 2 processes" in done.stderr
    assert nanoslip("run", campaign, "--out", tmp_path / "one", "-j", 1).returncode == 0
    assert sha256(tmp_path / "two") == sha256(tmp_path / "one")


def test_a_run_whose_job_ends_before_its_tasks_would_ends_as_if_interrupted(nanoslip, campaign, tmp_path: Path) -> None:
    done = nanoslip("run", campaign, "--out", tmp_path / "out", SLURM_JOB_END_TIME="1")
    assert done.returncode == 99
    # The first record, and the first of its two drives, say how long the three others and the second would take.
    assert (
        "interrupted: 4 tasks left would outlast this job; what is finished is kept; run again to continue"
        in done.stderr
    )
    assert not (tmp_path / "out" / "results.nc").exists()


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
    campaign.write_text(longer(radii=40, events=6000))
    words = [sys.executable, "-m", "nanoslip", "run", str(campaign), "--out", str(out), "-j", "2"]
    running = subprocess.Popen(words, env=environment, stderr=subprocess.PIPE, text=True, start_new_session=True)
    until_written(out, 4, running)
    if number == signal.SIGINT:
        os.killpg(running.pid, number)
    else:
        running.kill()
    _, said = running.communicate(timeout=PATIENCE)  # all that held standard error have ended
    assert running.returncode == (99 if number == signal.SIGINT else -signal.SIGKILL)
    assert "Traceback" not in said
    assert (out / "begun.txt").exists() == (number == signal.SIGKILL)
    kept = written(out)
    assert 4 <= len(kept) < 3 * 80
    assert not (out / "results.nc").exists()
