"""What a task can do to the process that computes it, each fault by its name, and runs in which it does."""

import ctypes
import dataclasses
import itertools
import os
import re
import resource
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from nanoslip.solver.outcome import COMPLETED, LONGEST_MESSAGE, Ending, Outcome
from nanoslip.study.run import executor as real
from nanoslip.study.run.child import Agent
from nanoslip.study.run.dispatch import Done, Execute, RunTally
from nanoslip.study.run.farm import ProcessFarm
from nanoslip.study.run.launch import Program
from nanoslip.study.tasks.compute import run_task
from nanoslip.study.tasks.task import Inputs, Task, TaskResult
from tests.study.run.made_up import Diary, Work


class Fault(NamedTuple):
    """What a task does, and what is to come of it."""

    act: Callable[[], object]
    ending: Ending = Ending.CRASHED
    message: str = ""
    """Regular expression that the message has."""
    is_result: bool = False
    """Whether what `act` returns is the task's result."""

    @property
    def seconds(self) -> float:
        """Time limit of its task: short where it is to be reached, and long where it is not."""
        return HANGING if self.ending is Ending.TIMED_OUT else 60.0

    def matches(self, outcome: Outcome) -> bool:
        """Whether its task has ended as it should, with a text that can be shown."""
        said = outcome.message
        good = re.search(self.message, said) and said.isprintable() and len(said) <= LONGEST_MESSAGE
        return outcome.ending is self.ending and bool(good)


HANGING: Final = 2.0
"""Seconds after which a fault that hangs is ended."""


class Unspeakable(Exception):
    """Its text cannot be had."""

    def __str__(self) -> str:
        raise ValueError("no text")


class Foreign(BaseException):
    """No Exception."""


def _raise(error: BaseException) -> Callable[[], None]:
    def fault() -> None:
        raise error

    return fault


def _overflow_stack() -> None:
    """Beyond what Python guards: through C, at once."""
    sys.setrecursionlimit(10**9)
    overflow: Any = str
    for _ in range(10**6):
        overflow = (overflow,)
    isinstance(0, overflow)


def _loop() -> None:
    while True:
        pass


def _cut() -> None:
    os.closerange(3, 1000)
    time.sleep(60.0)


def _scribble() -> None:
    """Into its connection, too: bytes that say that hundreds of megabytes follow."""
    for number in range(3, 100):
        with suppress(OSError):
            os.write(number, b"\x10 or so it seems")
    time.sleep(60.0)


def _close_all() -> None:
    os.closerange(0, 1000)
    raise ValueError("nobody can hear")


def _close_output() -> None:
    os.close(1)
    os.close(2)
    raise ValueError("nobody hears")


def _move_clock() -> None:
    backwards = itertools.count(0.0, -1e9).__next__
    for name in ("time", "monotonic", "perf_counter"):
        setattr(time, name, backwards)


def _leave_no_quota() -> None:
    """No result can be written after it."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))


def _use_up_quota() -> None:
    with tempfile.TemporaryFile(buffering=0) as file:
        _leave_no_quota()
        file.write(b"x")


_HELD: list[int] = []


def _use_up_descriptors() -> None:
    """Without giving them back."""
    resource.setrlimit(resource.RLIMIT_NOFILE, (256, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))
    while True:
        _HELD.append(os.open("/dev/null", os.O_RDONLY))


def _fill_disk() -> None:
    with open("/dev/full", "wb", buffering=0) as file:
        file.write(b"x")


def _fork() -> None:
    """Two processes return; the second one when the task of the first one has ended."""
    if os.fork() == 0:
        time.sleep(0.3)


def _orphan() -> None:
    """What it has started lives longer, with all that was open."""
    if os.fork() == 0:
        time.sleep(90.0)
        os._exit(0)
    os._exit(9)


_C, _T, _DONE = Ending.CRASHED, Ending.TIMED_OUT, Ending.COMPLETED
_LATE: Final = "not finished after .* s, and ended"

FAULTS: dict[str, Fault] = {
    "exception": Fault(_raise(ZeroDivisionError("a defect")), _C, "ZeroDivisionError: a defect"),
    "exception without text": Fault(_raise(Unspeakable()), _C, "Unspeakable"),
    "exception group": Fault(_raise(ExceptionGroup("two", [ValueError(), KeyError()])), _C, "two .2 sub-exceptions"),
    "half a letter in its text": Fault(_raise(ValueError("half \ud800 letter")), _C, r"half \\ud800 letter"),
    "text of 2 MB": Fault(_raise(ValueError(2_000_000 * "x")), _C, r"ValueError: x+ \.\.\. x+"),
    "escapes in its text": Fault(_raise(ValueError("\x1b]0;mine\x07\x1b[31mred")), _C, r"\\x1b\]0;mine\\x07\\x1b\[31m"),
    "SystemExit(0)": Fault(_raise(SystemExit(0)), _C, "SystemExit: 0"),
    "SystemExit with text": Fault(_raise(SystemExit("enough")), _C, "SystemExit: enough"),
    "KeyboardInterrupt": Fault(_raise(KeyboardInterrupt()), _C, "KeyboardInterrupt"),
    "GeneratorExit": Fault(_raise(GeneratorExit()), _C, "GeneratorExit"),
    "BaseException": Fault(_raise(Foreign("odd")), _C, "Foreign: odd"),
    "MemoryError": Fault(_raise(MemoryError("a lot")), Ending.OUT_OF_MEMORY, "MemoryError: a lot|no memory left"),
    "result None": Fault(lambda: None, _C, "None", is_result=True),
    "result text": Fault(lambda: "done", _C, "'done'|'str'", is_result=True),
    "result lambda": Fault(lambda: _result(lambda: 0), _C, "objects|TaskResult", is_result=True),
    "result array of objects": Fault(lambda: _result(np.array([object()])), _C, "objects|TaskResult", is_result=True),
    "os._exit(0)": Fault(lambda: os._exit(0), _C, "exit code 0"),
    "os._exit(7)": Fault(lambda: os._exit(7), _C, "exit code 7"),
    "segmentation fault": Fault(lambda: ctypes.string_at(0), _C, "signal 11"),
    "abort": Fault(os.abort, _C, "signal 6"),
    "kill -9": Fault(lambda: os.kill(os.getpid(), signal.SIGKILL), _C, "signal 9"),
    "stack overflow": Fault(_overflow_stack, _C, "its process|RecursionError"),
    "endless loop": Fault(_loop, _T, _LATE),
    "loop that holds the interpreter": Fault(lambda: re.match(r"(a+)+$", 60 * "a" + "b"), _T, _LATE),
    "stopped": Fault(lambda: os.kill(os.getpid(), signal.SIGSTOP), _T, _LATE),
    "connection cut": Fault(_cut, _C, "closed its connection"),
    "writes into every open file": Fault(_scribble, _C, "closed its connection"),
    "all files closed": Fault(_close_all, _C, "its process"),
    "standard output and error closed": Fault(_close_output, _C, "ValueError: nobody hears"),
    "SIGTERM to its group": Fault(lambda: os.killpg(0, signal.SIGTERM), _DONE),
    "SIGSTOP to its group": Fault(lambda: os.killpg(0, signal.SIGSTOP), _T, _LATE),
    "SIGKILL to its group": Fault(lambda: os.killpg(0, signal.SIGKILL), _C, "signal 9"),
    "fork of which both return": Fault(_fork, _DONE),
    "death before what it started": Fault(_orphan, _C, "exit code 9"),
    "other folder": Fault(lambda: os.chdir("/"), _DONE),
    "other umask": Fault(lambda: os.umask(0o077), _DONE),
    "other clock": Fault(_move_clock, _DONE),
    "no space on the disk": Fault(_fill_disk, _C, "No space left"),
    "quota used up": Fault(_use_up_quota, _C, "File too large"),
    "no quota for its result": Fault(_leave_no_quota, _C, "File (too large|exists)"),
    "file descriptors used up": Fault(_use_up_descriptors, _C, "Too many open files"),
}
"""By name."""


def _result(value: Any) -> TaskResult:
    return TaskResult(20 * "0", "contact", COMPLETED, arrays={"gap": value})


def work(fault: str) -> Work:
    """A task that has a fault."""
    return Work(fault, limit=FAULTS[fault].seconds)


BLOCKER: Final = "blocker"
"""Kind of a task that keeps its process busy until so many faults have been begun: another one meets them all."""


def blocker(faults: int) -> Work:
    """A task that ends when so many faults have been begun."""
    return Work(f"{BLOCKER} until {faults}", kind=BLOCKER, limit=300.0)


def executor(folder: Path) -> Execute:
    """What computes a task: it does the fault of its key; any other key is a sound one, which leaves a file of that name."""

    def execute(task: Work) -> Outcome:
        assert all((folder / need).exists() for need in task.needs)
        if task.kind == BLOCKER:
            faults = int(task.key.rpartition(" ")[2])
            while sum(path.suffix == ".begun" for path in folder.iterdir()) < faults:
                time.sleep(0.05)
        if task.key in FAULTS:
            (folder / f"{task.key}.begun").touch()
            fault = FAULTS[task.key]
            returned: Any = fault.act()
            if fault.is_result:
                return returned  # type: ignore[no-any-return]
        with (folder / task.key).open("x") as file:  # never twice
            file.write(str(os.getpid()))
        time.sleep(min(2.0 * task.cost, 0.02))
        return COMPLETED

    return execute


def program(folder: Path) -> Program:
    return Program(__name__, "executor", folder)


def campaign_executor(argument: tuple[Path, dict[float, str]]) -> Execute:
    """What computes the tasks of a campaign into a folder; contacts under some loads have the fault of that name."""
    out, faulty = argument

    def run(task: Task, inputs: Inputs) -> TaskResult:
        name = faulty.get(task.case.normal_load) if task.case else None
        if name is not None:
            returned: Any = FAULTS[name].act()
            if FAULTS[name].is_result:
                own = isinstance(returned, TaskResult)
                return dataclasses.replace(returned, key=task.key) if own else returned  # type: ignore[no-any-return]
        return run_task(task, inputs)

    real.run_task = run  # type: ignore[attr-defined]  # this process is a child that computes
    return real.executor(out)  # type: ignore[return-value]


def computed(
    program: Program, tasks: Sequence[Work], size: int
) -> tuple[RunTally, dict[str, Outcome], list[tuple[str, Done]]]:
    """Compute tasks by so many processes: counts, how each ended, in that order, and what failed, each time."""
    diary = Diary()
    with ProcessFarm([Agent(program, number) for number in range(size)]) as farm:
        tally = farm.run(tasks, diary)
    return tally, diary.reported, [(key, done) for key, done, _ in diary.attempts]
