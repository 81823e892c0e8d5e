"""Whoever computes through a child: hands it one task after the other, and outlives what a task does to it.

A child that dies (segmentation fault, killed, out of memory, `os._exit`) takes the task with it that it computed; one that does
not end in time is killed. Another child goes on with the next task. All that costs a task 0.1 ms, a new child half a second.
"""

import socket
from collections import deque
from collections.abc import Sequence
from multiprocessing.connection import Connection
from typing import Any, Final

from solver.outcome import Ending, Outcome
from study.execution.farms.child import NO_TASK
from study.execution.farms.process import ChildProcess
from study.execution.ledger import Done, tell
from study.execution.program import Program
from study.execution.queue import Work

START: Final = 300.0
"""Seconds that a child has to start in; a crowded file system may need a while."""
FALSE_STARTS: Final = 5
"""Children of one agent that end before they can compute, one after the other, until it gives up."""


class BrokenProgramError(Exception):
    """No process that computes can be started: nothing is known of any task."""


class Agent:
    """One child, started when it is needed or by `start`, and the tasks that wait for it."""

    def __init__(self, program: Program, number: int) -> None:
        """number: how messages call the child, by its rank."""
        self._program, self._number = program, number
        self._child: ChildProcess | None = None
        self._waiting: deque[Work] = deque()
        self._doing: Work | None = None
        self._false_starts = 0

    @property
    def busy(self) -> bool:
        """Whether it computes a task."""
        return self._doing is not None

    @property
    def pipe(self) -> "Connection[Any, Any] | None":
        """What becomes readable when there is news; None without a child."""
        return self._child.pipe if self._child else None

    def start(self) -> ChildProcess:
        """Start the child, which imports what it needs meanwhile, and return it."""
        if self._child is None:
            self._child = ChildProcess(self._program, self._number)
        return self._child

    def give(self, tasks: Sequence[Any]) -> None:
        """Hand it tasks, behind those that it has."""
        self._waiting.extend(tasks)
        self._feed()

    def give_back(self) -> tuple[str, ...]:
        """Drop all tasks that it has not begun, and return their keys."""
        keys = tuple(task.key for task in self._waiting)
        self._waiting.clear()
        return keys

    def arrived(self) -> list[Done]:
        """The tasks that have ended since. Raises BrokenProgramError where no child can be started."""
        found = []
        while self._doing is not None and (done := self._ended(self._doing)) is not None:
            self._doing = None
            found.append(done)
            self._feed()
        return found

    def close(self) -> None:
        """End the child; what it computes is lost."""
        if self._child:
            self._child.kill()
            self._child = None

    def _feed(self) -> None:
        if self._doing is None and self._waiting:
            self._doing = self._waiting.popleft()
            self.start().begin(self._doing)

    def _ended(self, task: Work) -> Done | None:
        """How a task has ended; None while it has not."""
        child = self._child
        assert child is not None
        try:
            done = child.receive()
        except (EOFError, OSError):
            return self._dead(task, child)
        if done is None and not child.ready and child.seconds > START:
            child.stop()
            return self._dead(task, child)
        if done is None and child.ready and child.seconds > task.limit:
            outcome = Outcome(Ending.TIMED_OUT, _TIMED_OUT.format(task.limit))
            return self._lost(task, child, outcome, again=False)
        return done

    def _dead(self, task: Work, child: ChildProcess) -> Done | None:
        """What became of a task whose child has ended; None where that had not begun and another one will."""
        code = child.last_code()
        outcome = _death(child, code)
        self._false_starts = 0 if child.ready else self._false_starts + 1
        if self._false_starts >= FALSE_STARTS or code == NO_TASK:
            raise BrokenProgramError(f"a process that computes does not begin: {outcome.message}") from None
        if child.ready:
            return self._lost(task, child, outcome, again=True)
        self.close()
        self.start().begin(task)
        return None

    def _lost(self, task: Work, child: ChildProcess, outcome: Outcome, again: bool) -> Done:
        where = f"rank {self._number} on {socket.gethostname()}"
        done = Done(task.key, outcome, child.seconds, where, child.last_words(), again)
        child.kill()
        self._child = None
        tell(task, done)
        return done


_TIMED_OUT: Final = (
    "not finished after {:g} s, and ended: give it more by `seconds` of [limits], if it only needs longer"
)


def _death(child: ChildProcess, code: int | None) -> Outcome:
    """What is known of the end of a child that nobody asked for."""
    if code == -9 and child.out_of_memory():
        return Outcome(
            Ending.OUT_OF_MEMORY, "its process was ended as no memory was left: start fewer ranks on a machine"
        )
    how = (
        "cut its connection"
        if code is None
        else f"died of signal {-code}"
        if code < 0
        else f"ended with exit code {code}"
    )
    return Outcome(Ending.CRASHED, f"its process {how}: a defect, or somebody killed it")
