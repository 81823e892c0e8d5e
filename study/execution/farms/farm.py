"""What all farms have in common, and the farm of this process alone."""

import socket
import sys
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Any, NoReturn, Protocol, Self, TypeVar

from nanoslip.study.execution.interruption import GRACE, Interruption
from nanoslip.study.execution.ledger import Begin, Execute, Fail, Ledger, Report, Tally, attempt, tell
from nanoslip.study.execution.queue import Work

W = TypeVar("W", bound=Work)


class FarmError(Exception):
    """The processes were not started as a farm can use them; the message says what to do."""


class Farm(Protocol):
    """Processes that compute tasks. The root calls `run`, the others `serve`; all of them end with `leave`."""

    root: bool
    size: int
    here: int
    """How many of them are on this machine."""
    unit: str
    """What they are called."""
    interruption: Interruption

    def run(
        self,
        tasks: Sequence[W],
        report: Report[W],
        fail: Fail[W] = ...,
        begin: Begin[W] = ...,
    ) -> Tally:
        """Compute all tasks, each after its needs.

        report, fail, begin: callbacks, called with each task's outcome, with each failed attempt, and with tasks to be computed.
        """

    def settle(self) -> None:
        """Have results of all processes on disk, where other machines see them."""

    def serve(self) -> int:
        """Compute what the root sends until it leaves; returns its exit code."""

    def leave(self, code: int) -> NoReturn:
        """Raises SystemExit with this exit code on every process."""

    def __enter__(self) -> Self: ...
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


class LocalFarm:
    """What farms without other ranks share: this process is the root, and a signal is its own affair."""

    root = True

    def __init__(self, size: int, grace: float) -> None:
        self.size = self.here = size
        self.interruption = Interruption(grace)

    def __enter__(self) -> Self:
        self.interruption.__enter__()
        return self

    def __exit__(self, *error: object) -> None:
        self.interruption.__exit__(*error)

    def serve(self) -> int:
        """Raises FarmError: the only rank is the root, which does not serve."""
        raise FarmError("a farm without ranks has nobody to serve")

    def leave(self, code: int) -> NoReturn:
        """End the process."""
        sys.exit(code)


class SerialFarm(LocalFarm):
    """This process alone. What a task does to its process it does to the whole run; KeyboardInterrupt stays Python's."""

    unit = "process"

    def __init__(self, load: Callable[[], Execute[Any]], grace: float = GRACE) -> None:
        """load: called once, for the function that computes a task."""
        super().__init__(1, grace)
        self._load = load

    def run(
        self,
        tasks: Sequence[W],
        report: Report[W],
        fail: Fail[W] = lambda *_: None,
        begin: Begin[W] = lambda *_: None,
    ) -> Tally:
        """Compute one task after the other, in the order of the queue."""
        ledger, execute = Ledger(tasks, report, fail), self._load()
        where = f"rank 0 on {socket.gethostname()}"
        while ledger.unfinished and not (self.interruption.requested or ledger.halt):
            task = ledger.take()
            begin([(task, ledger.expected(task))])
            done = attempt(execute, task, where, survive=(Exception, SystemExit, GeneratorExit))
            tell(task, done)
            ledger.enter(done)
        return ledger.tally(self.interruption.requested)

    def settle(self) -> None:
        """Nothing: this process sees what it has written."""
