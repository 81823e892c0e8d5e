"""Whatever a task does to its process, the other tasks are computed, and what it did is on record."""

import json
import subprocess
import sys
import time
from pathlib import Path

import pytest

from solver.outcome import Ending, Outcome
from study.execution.farms import process
from study.execution.farms.agent import Agent, BrokenProgramError
from study.execution.farms.processes import ProcessFarm
from study.execution.ledger import Done, Tally
from study.execution.program import Program
from tests.conftest import launcher
from tests.study.execution.farms import faults
from tests.study.execution.farms.faults import FAULTS
from tests.study.execution.made_up import Work


class Unknown(str):
    """Is written as something that nobody can read."""

    def __reduce__(self) -> tuple[object, ...]:
        return (exec, ("raise RuntimeError",))


SOUND = tuple(Work(f"sound {number}") for number in range(19))


def run(tasks: tuple[Work, ...], folder: Path, size: int) -> tuple[Tally, dict[str, Outcome], list[Done]]:
    reported: dict[str, Outcome] = {}
    failed: list[Done] = []
    with ProcessFarm([Agent(faults.program(folder), number) for number in range(size)]) as farm:
        tally = farm.run(
            tasks,
            lambda tasks, outcome, _: reported.update({task.key: outcome for task in tasks}),
            lambda _task, done, _final: failed.append(done),
        )
    return tally, reported, failed


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_costs_its_own_task(tmp_path: Path, fault: str) -> None:
    tally, reported, failed = run((Work(fault), Work("after", (fault,)), *SOUND), tmp_path, 1)
    assert tally == Tally(done=19, crashed=2)
    assert faults.as_expected(fault, reported[fault]), reported[fault]
    assert reported["after"].ending is Ending.NEEDS_FAILED
    assert all(reported[task.key].ok and (tmp_path / task.key).exists() for task in SOUND)
    assert {done.key for done in failed} == {fault}
    assert all(done.where.startswith("rank 0 on ") for done in failed)


@pytest.mark.parametrize(
    "some", [("exception", "os._exit(0)", "segmentation fault"), pytest.param(tuple(FAULTS), marks=pytest.mark.slow)]
)
def test_many_faults_cost_no_sound_task(tmp_path: Path, some: tuple[str, ...]) -> None:
    tasks = (*(Work(fault) for fault in some), *SOUND)
    tally, reported, _ = run(tasks, tmp_path, 2)
    assert tally == Tally(done=19, crashed=len(some))
    assert [fault for fault in some if not faults.as_expected(fault, reported[fault])] == []


def test_what_a_dead_process_computed_is_tried_again_behind_all_others(tmp_path: Path) -> None:
    """What killed it may have been no fault of its own. An exception comes of the program: it is not tried again."""
    _, reported, failed = run((Work("kill -9"), Work("exception"), *SOUND), tmp_path, 1)
    assert [done.key for done in failed] == ["kill -9", "exception", "kill -9"]
    assert list(reported)[-1] == "kill -9"


def test_tasks_behind_one_that_hangs_go_elsewhere(tmp_path: Path) -> None:
    """They are handed out together, as they are short; what waits for long is computed by the other process."""
    hanging = Work("endless loop", cost=0.001, limit=6.0)
    known = Work("first", cost=0.001)
    short = tuple(Work(f"short {number}", (known.key,), cost=0.001) for number in range(60))
    tasks = (known, Work("endless loop", (known.key,), 0.001, limit=hanging.limit), *short)
    tally, reported, _ = run(tasks, tmp_path, 2)
    assert tally == Tally(done=61, crashed=1)
    assert list(reported)[-1] == hanging.key  # all others ended before it was given up


def test_a_fault_while_kernels_are_compiled_leaves_a_farm_that_computes(tmp_path: Path) -> None:
    """The compiling is a task of its own, before all others."""
    reported: list[str] = []
    with ProcessFarm([Agent(faults.program(tmp_path), 0)]) as farm:
        farm.run([Work("segmentation fault")], lambda *_: None)
        tally = farm.run(SOUND, lambda tasks, outcome, _: reported.extend(task.key for task in tasks))
    assert (tally, len(reported)) == (Tally(done=19), 19)


def test_time_in_which_both_processes_are_stopped_is_not_the_task_s(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A suspended job is: its clock jumps between two looks at a child."""
    clock, jump = time.monotonic, 0.0

    def jumping() -> float:
        return clock() + jump

    monkeypatch.setattr(process.time, "monotonic", jumping)
    child = process.ChildProcess(faults.program(tmp_path), 0)
    try:
        while not child.ready:
            child.receive()
        child.begin([Work("endless loop")])
        for _ in range(3):
            jump += 1000.0
            assert child.receive() is None
        assert 3.0 * process.LONGEST_LOOK <= child.seconds < 10.0
    finally:
        child.kill()


def test_a_child_that_is_killed_before_it_computes_is_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    start, killed = process.ChildProcess.__init__, []

    def doomed(child: process.ChildProcess, program: Program, number: int) -> None:
        start(child, program, number)
        if len(killed) < 2:
            killed.append(child)
            child._process.kill()

    monkeypatch.setattr(process.ChildProcess, "__init__", doomed)
    tally, _, failed = run(SOUND, tmp_path, 1)
    assert (tally, failed, len(killed)) == (Tally(done=19), [], 2)


def test_a_program_that_does_not_start_is_no_fault_of_a_task(tmp_path: Path) -> None:
    program = Program("no_such_module", "executor", tmp_path)
    with pytest.raises(BrokenProgramError, match="does not begin"), ProcessFarm([Agent(program, 0)]) as farm:
        farm.run(SOUND, lambda *_: None)


def test_tasks_that_the_program_does_not_know_are_no_fault_of_a_task(tmp_path: Path) -> None:
    strange = Work("strange", kind=Unknown("any"))
    with (
        pytest.raises(BrokenProgramError, match="does not begin"),
        ProcessFarm([Agent(faults.program(tmp_path), 0)]) as farm,
    ):
        farm.run([strange], lambda *_: None)


@pytest.mark.mpi
@pytest.mark.slow
@pytest.mark.parametrize("rank", [0, 1])
@pytest.mark.parametrize("fault", ["SystemExit(0)", "segmentation fault", "loop that holds the interpreter"])
def test_a_fault_on_a_rank_costs_its_own_task(environment, tmp_path: Path, fault: str, rank: int) -> None:
    words = [
        *launcher(2),
        sys.executable,
        "-m",
        "tests.study.execution.farms.fault_program",
        fault,
        str(rank),
        str(tmp_path),
    ]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=60.0, check=False)
    assert done.returncode == 3, done.stderr
    wanted = {"done": 19, "crashed": 1, "ending": FAULTS[fault][1], "as_expected": True, "where": f"rank {rank}"}
    assert json.loads(done.stdout) == wanted
