"""Whatever a task does to its process, the other tasks are computed, and what it did is on record."""

import math
import os
import time
from contextlib import suppress
from pathlib import Path

import pytest

from nanoslip.solver.outcome import Ending, Outcome
from nanoslip.study.run import agent
from nanoslip.study.run import child as process
from nanoslip.study.run.agent import Agent, BrokenProgramError
from nanoslip.study.run.dispatch import Done, Execute, Tally
from nanoslip.study.run.farm import ProcessFarm
from nanoslip.study.run.launch import Program
from nanoslip.study.run.warm_up import WarmUp
from tests.study.run.farms import faults
from tests.study.run.farms.faults import FAULTS
from tests.study.run.farms.matrix import PLACES
from tests.study.run.made_up import Work


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


EVERYDAY = (
    "exception",
    "half a letter in its text",
    "result None",
    "segmentation fault",
    "standard output and error closed",
    "SIGKILL to its group",
    "fork of which both return",
    "death before what it started",
    "file descriptors used up",
    "no quota for its result",
)


def test_faults_cost_their_own_tasks(tmp_path: Path) -> None:
    tasks = [each for fault in EVERYDAY for each in (faults.work(fault), Work(f"sound {fault}", limit=60.0))]
    tally, reported, failed = run((*tasks, Work("after", ("exception",))), tmp_path, 2)
    failures = [fault for fault in EVERYDAY if FAULTS[fault].ending is not Ending.COMPLETED]
    assert [fault for fault in EVERYDAY if not faults.as_expected(fault, reported[fault])] == []
    assert tally == Tally(done=2 * len(EVERYDAY) - len(failures), crashed=len(failures) + 1)
    assert reported["after"].ending is Ending.NEEDS_FAILED
    assert {done.key for done in failed} == set(failures)
    assert all(done.where.startswith("rank ") for done in failed)


@pytest.mark.slow
@pytest.mark.parametrize(
    "place", [pytest.param(name, marks=pytest.mark.mpi) if "rank" in name else name for name in PLACES]
)
def test_every_fault_costs_its_own_task_wherever_it_is_met(tmp_path: Path, place: str) -> None:
    found = PLACES[place](tmp_path)
    assert {name: each for name, each in found.items() if not FAULTS[name].matches(each.ending, each.message)} == {}
    assert [name for name in FAULTS if not found[name].sound] == []
    if "rank" in place:
        assert {each.where for each in found.values() if each.where} == {place.removesuffix(" of 2")}


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


@pytest.mark.parametrize("fault", ["segmentation fault", "endless loop"])
def test_a_fault_while_kernels_are_compiled_leaves_a_farm_that_computes(tmp_path: Path, fault: str) -> None:
    """The compiling is a task of its own, before all others."""
    reported: list[str] = []
    with ProcessFarm([Agent(faults.program(tmp_path), 0)]) as farm:
        farm.run([faults.work(fault)], lambda *_: None)
        tally = farm.run(SOUND, lambda tasks, outcome, _: reported.extend(task.key for task in tasks))
    assert (tally, len(reported)) == (Tally(done=19), 19)


def test_compiling_that_hangs_is_ended_after_minutes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody hears of it before; a clock that runs a thousand times as fast measures it."""
    clock, begun = time.monotonic, time.monotonic()
    monkeypatch.setattr(process.time, "monotonic", lambda: begun + 1000.0 * (clock() - begun))
    monkeypatch.setattr(process, "LONGEST_LOOK", math.inf)
    monkeypatch.setattr(agent, "START", math.inf)
    hanging = Work("endless loop", limit=WarmUp("any", ()).limit)
    _, reported, failed = run((hanging,), tmp_path, 1)
    assert reported[hanging.key].ending is Ending.TIMED_OUT
    assert failed[0].seconds < 3600.0


def starting(folder: Path) -> Execute[Work]:
    """What starts another process, leaves its number and ends."""

    def execute(task: Work) -> Outcome:
        if started := os.fork():
            (folder / str(started)).touch()
            os._exit(9)
        time.sleep(90.0)
        os._exit(0)

    return execute


@pytest.mark.skipif(not Path("/proc/self/cmdline").exists(), reason="processes cannot be looked at here")
def test_what_a_task_has_started_ends_with_its_process(tmp_path: Path) -> None:
    """It holds all that the process had open: a launcher would wait for it at the end of the run."""
    with ProcessFarm([Agent(Program(__name__, "starting", tmp_path), 0)]) as farm:
        assert farm.run((Work("starts another", limit=60.0),), lambda *_: None) == Tally(crashed=1)
    started = [path.name for path in tmp_path.iterdir()]
    assert len(started) == 2  # it was tried twice
    end = time.monotonic() + 10.0
    while any(runs(number) for number in started):
        assert time.monotonic() < end


def runs(number: str) -> bool:
    """Whether the process of this number has not ended."""
    with suppress(OSError):
        return Path(f"/proc/{number}/cmdline").read_bytes() != b""
    return False


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
