"""A farm computes every task once, after its needs, and tells what became of each; it never runs as N lone processes."""

import os
import signal
import subprocess
import sys
import threading
from dataclasses import dataclass

import pytest

from solver.outcome import COMPLETED, Ending, Outcome
from study.execution.farm import FarmError, SerialFarm, open_farm
from study.execution.launch import launcher_rank
from study.execution.ledger import Ledger, Tally, attempt
from study.execution.queue import TaskQueue


@dataclass(frozen=True)
class Work:
    key: str
    needs: tuple[str, ...] = ()
    cost: float = 1.0
    kind: str = "any"

    @property
    def label(self) -> str:
        return f"task {self.key}"


DIAMOND = (Work("a"), Work("b", ("a",)), Work("c", ("a",)), Work("d", ("b", "c")), Work("e", ("elsewhere",)))


class Diary:
    """Notes what is executed and reported."""

    def __init__(self, crash: str = "") -> None:
        self.executed: list[str] = []
        self.reported: dict[str, Outcome] = {}
        self._crash = crash

    def execute(self, task: Work) -> Outcome:
        self.executed.append(task.key)
        if task.key == self._crash:
            raise ZeroDivisionError("a defect")
        return COMPLETED

    def report(self, task: Work, outcome: Outcome, seconds: float) -> None:
        assert task.key not in self.reported
        self.reported[task.key] = outcome


def test_the_queue_hands_out_needs_first_and_otherwise_in_the_order_given():
    queue = TaskQueue(DIAMOND)
    assert [queue.take().key, queue.take().key] == ["a", "e"]
    assert queue.first() is None
    queue.finish("a")
    assert [queue.take().key, queue.take().key] == ["b", "c"]
    queue.finish("c")
    assert queue.first() is None
    queue.finish("b")
    assert queue.take().key == "d"
    assert len(queue) == 0


def test_the_queue_gives_up_all_that_waits_for_a_task_given_up():
    queue = TaskQueue(DIAMOND)
    queue.take()
    assert {task.key for task in queue.abandon("a")} == {"b", "c", "d"}
    assert queue.take().key == "e"
    assert len(queue) == 0


def test_serial_farm_computes_each_task_once_after_its_needs():
    diary = Diary()
    with SerialFarm() as farm:
        tally = farm.run(DIAMOND, diary.execute, diary.report)
    assert tally == Tally(done=5)
    assert diary.executed == ["a", "b", "c", "d", "e"]
    assert set(diary.reported.values()) == {COMPLETED}


def test_a_crash_is_told_and_costs_only_what_needs_it(capsys):
    diary = Diary(crash="b")
    with SerialFarm() as farm:
        tally = farm.run(DIAMOND, diary.execute, diary.report)
    assert tally == Tally(done=3, crashed=2)
    assert diary.executed == ["a", "b", "c", "e"]
    assert diary.reported["b"].ending is Ending.CRASHED
    assert "ZeroDivisionError: a defect (rank 0 on " in diary.reported["b"].message
    assert diary.reported["d"] == Outcome(Ending.NEEDS_FAILED, "task b crashed")
    said = capsys.readouterr().err
    assert "task b crashed" in said
    assert "Traceback" in said


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_after_a_signal_the_running_task_is_finished_and_no_other_begun(number):
    diary, before = Diary(), signal.getsignal(number)

    def execute(task: Work) -> Outcome:
        os.kill(os.getpid(), number)
        assert arrived.wait(5.0)
        return diary.execute(task)

    with SerialFarm(grace=60.0) as farm:
        arrived = farm.interruption._requested
        tally = farm.run(DIAMOND, execute, diary.report)
    assert tally == Tally(done=1, interrupted=True)
    assert list(diary.reported) == ["a"]
    assert signal.getsignal(number) is before
    assert not any(isinstance(thread, threading.Timer) for thread in threading.enumerate())


def test_a_signal_that_finds_all_work_done_interrupted_nothing():
    with SerialFarm() as farm:
        farm.interruption.request()
        assert farm.run((), Diary().execute, Diary().report) == Tally()


def test_a_task_that_outlasts_the_grace_is_left_with_code_99(environment):
    program = (
        "import os, signal, time\n"
        "from study.execution.interruption import Interruption\n"
        "with Interruption(grace=0.1):\n"
        "    os.kill(os.getpid(), signal.SIGTERM)\n"
        "    time.sleep(30)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True, timeout=20, check=False
    )
    assert done.returncode == 99
    assert "run again to continue" in done.stderr


def test_the_time_a_task_will_take_is_learnt_from_its_kind():
    ledger = Ledger([Work("a", cost=1.0), Work("b", cost=3.0)], lambda *_: None)
    other = Work("c", kind="another")
    assert ledger.expected(other) == float("inf")
    task = ledger.take()
    done = attempt(lambda _: COMPLETED, task, "here")
    ledger.enter(task, type(done)(done.key, done.outcome, seconds=2.0))
    assert ledger.expected(Work("b", cost=3.0)) == 6.0


@pytest.mark.parametrize(
    "started",
    [
        {"OMPI_COMM_WORLD_SIZE": "4", "OMPI_COMM_WORLD_RANK": "0"},
        {"SLURM_STEP_NUM_TASKS": "4", "SLURM_PROCID": "0"},
    ],
)
def test_n_processes_that_see_only_themselves_are_refused_by_one_message(nanoslip, campaign, started):
    first = nanoslip("run", campaign, **started)
    assert first.returncode == 2
    assert first.stderr.startswith("Error: 4 processes were started, but each sees only itself")
    assert "Traceback" not in first.stderr
    other = {name: "1" if name.endswith(("RANK", "PROCID")) else value for name, value in started.items()}
    second = nanoslip("run", campaign, **other)
    assert (second.returncode, second.stderr) == (2, "")
    assert not (campaign.parent / "results").exists()


def test_slurm_tasks_of_a_batch_script_do_not_mean_that_a_launcher_was_used(monkeypatch):
    for name in (
        "PMI_SIZE",
        "OMPI_COMM_WORLD_SIZE",
        "SLURM_STEP_NUM_TASKS",
        "PMI_RANK",
        "OMPI_COMM_WORLD_RANK",
        "PMIX_RANK",
    ):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("SLURM_NTASKS", "8")
    monkeypatch.setenv("SLURM_PROCID", "3")
    assert launcher_rank() == 0
    monkeypatch.setitem(sys.modules, "mpi4py", None)  # importing it fails
    assert isinstance(open_farm(), SerialFarm)


def test_processes_without_mpi4py_are_refused_unless_serial_is_meant(monkeypatch):
    monkeypatch.setitem(sys.modules, "mpi4py", None)
    monkeypatch.setenv("OMPI_COMM_WORLD_SIZE", "2")
    with pytest.raises(FarmError, match="2 processes were started, but none can use MPI"):
        open_farm()
    assert isinstance(open_farm(serial=True), SerialFarm)


def test_without_an_mpi_library_one_process_computes_and_several_refuse(nanoslip, campaign):
    missing = {"MPI4PY_LIBMPI": "/no/such/library"}
    assert nanoslip("run", campaign, "--out", campaign.parent / "out", **missing).returncode == 0
    several = nanoslip("run", campaign, **missing, OMPI_COMM_WORLD_SIZE="2")
    assert several.returncode == 2
    assert several.stderr.startswith("Error: 2 processes were started, but none can use MPI: cannot load MPI library")
