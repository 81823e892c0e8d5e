"""What a task can do to the process that computes it, each fault by its name, and the program that does it."""

import ctypes
import os
import re
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from solver.outcome import COMPLETED, Ending, Outcome
from study.execution.ledger import Execute
from study.execution.program import Program
from tests.study.execution.made_up import Work


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


FAULTS: dict[str, tuple[Callable[[], object], Ending, str]] = {
    "exception": (_raise(ZeroDivisionError("a defect")), Ending.CRASHED, "ZeroDivisionError: a defect"),
    "exception without text": (_raise(Unspeakable()), Ending.CRASHED, "Unspeakable"),
    "SystemExit(0)": (_raise(SystemExit(0)), Ending.CRASHED, "SystemExit: 0"),
    "SystemExit with text": (_raise(SystemExit("enough")), Ending.CRASHED, "SystemExit: enough"),
    "KeyboardInterrupt": (_raise(KeyboardInterrupt()), Ending.CRASHED, "KeyboardInterrupt"),
    "GeneratorExit": (_raise(GeneratorExit()), Ending.CRASHED, "GeneratorExit"),
    "BaseException": (_raise(Foreign("odd")), Ending.CRASHED, "Foreign: odd"),
    "MemoryError": (_raise(MemoryError("a lot")), Ending.OUT_OF_MEMORY, "MemoryError: a lot"),
    "os._exit(0)": (lambda: os._exit(0), Ending.CRASHED, "exit code 0"),
    "os._exit(7)": (lambda: os._exit(7), Ending.CRASHED, "exit code 7"),
    "segmentation fault": (lambda: ctypes.string_at(0), Ending.CRASHED, "signal 11"),
    "abort": (os.abort, Ending.CRASHED, "signal 6"),
    "kill -9": (lambda: os.kill(os.getpid(), signal.SIGKILL), Ending.CRASHED, "signal 9"),
    "stack overflow": (_overflow_stack, Ending.CRASHED, "its process|RecursionError"),
    "endless loop": (_loop, Ending.TIMED_OUT, "not finished after 4 s"),
    "loop that holds the interpreter": (
        lambda: re.match(r"(a+)+$", 60 * "a" + "b"),
        Ending.TIMED_OUT,
        "not finished after 4 s",
    ),
    "stopped": (lambda: os.kill(os.getpid(), signal.SIGSTOP), Ending.TIMED_OUT, "not finished after 4 s"),
    "connection cut": (_cut, Ending.CRASHED, "cut its connection"),
}
"""Name of a fault -> what does it, how the task ends, and what its message has."""


def executor(folder: Path) -> Execute[Work]:
    """What computes a task: it does the fault of its key; any other key is a sound one, which leaves a file of that name."""

    def execute(task: Work) -> Outcome:
        assert all((folder / need).exists() for need in task.needs)
        if task.key in FAULTS:
            FAULTS[task.key][0]()
        with (folder / task.key).open("x") as file:  # never twice
            file.write(str(os.getpid()))
        time.sleep(0.02)
        return COMPLETED

    return execute


def program(folder: Path) -> Program:
    return Program(__name__, "executor", folder)


def as_expected(fault: str, outcome: Outcome) -> bool:
    _, ending, message = FAULTS[fault]
    return outcome.ending is ending and re.search(message, outcome.message) is not None
