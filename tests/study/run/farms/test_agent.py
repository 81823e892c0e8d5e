"""A child has several short tasks at hand, and yet only the one that it dies of is lost with it."""

import os
import signal
import time
from pathlib import Path

import pytest

from nanoslip.solver.outcome import COMPLETED, Ending, Outcome
from nanoslip.study.run import agent
from nanoslip.study.run.agent import Agent
from nanoslip.study.run.dispatch import Done, Execute, Tally
from nanoslip.study.run.farm import ProcessFarm
from nanoslip.study.run.launch import Program
from tests.study.run.made_up import Work

KNOWN = Work("known", cost=1e-4)
"""Its duration is known before those of the others matter."""


def executor(folder: Path) -> Execute[Work]:
    """What leaves a file for each task, and dies or hangs at some."""

    def execute(task: Work) -> Outcome:
        with (folder / f"{time.monotonic_ns()} {task.key}").open("x"):
            pass
        if task.key.startswith("dies"):
            os.kill(os.getpid(), signal.SIGKILL)
        if task.key.startswith("hangs"):
            time.sleep(60.0)
        return COMPLETED

    return execute


def begun(folder: Path) -> list[str]:
    """Keys of the tasks that were begun, in that order."""
    return [path.name.split(" ", 1)[1] for path in sorted(folder.iterdir())]


def short(*keys: str) -> list[Work]:
    return [Work(key, (KNOWN.key,), KNOWN.cost, limit=1.0) for key in keys]


@pytest.mark.parametrize(("fault", "ending"), [("dies", Ending.CRASHED), ("hangs", Ending.TIMED_OUT)])
def test_a_fault_costs_no_task_that_its_process_has_at_hand(tmp_path: Path, fault: str, ending: Ending) -> None:
    sound = [str(number) for number in range(100)]
    keys = [*sound[:50], f"{fault} 0", f"{fault} 1", *sound[50:]]
    failed: list[Done] = []
    with ProcessFarm([Agent(Program(__name__, "executor", tmp_path), 0)]) as farm:
        tally = farm.run([KNOWN, *short(*keys)], lambda *_: None, lambda _task, done, _final: failed.append(done))
    assert tally == Tally(done=101, crashed=2)
    assert {(done.key, done.outcome.ending) for done in failed} == {(f"{fault} 0", ending), (f"{fault} 1", ending)}
    order = begun(tmp_path)
    assert [key for key in order if key in sound] == sound  # each once


def test_a_child_gets_tasks_before_it_asks_for_them_only_where_they_are_short(tmp_path: Path) -> None:
    alone = Agent(Program(__name__, "executor", tmp_path), 0)
    try:
        alone.give([KNOWN])
        while not alone.arrived():
            time.sleep(0.001)
        alone.give(short(*map(str, range(100))))
        at_hand = 100 - len(alone.give_back())
        assert 1 < at_hand <= 1 + agent.AHEAD / 1e-3
        while alone.busy:
            alone.arrived()
        alone.give([Work("long", cost=1.0), Work("longer", cost=1.0)])
        assert alone.give_back() == ("longer",)
    finally:
        alone.close()
