"""Compute in a child process, which receives one task after the other.

If a child dies (segmentation fault, killed, out of memory, `os._exit`), its task fails; a child that exceeds its time is killed.
Another child continues with the next task half a second later, also after an error of the machine.
"""

import socket
from collections import deque
from collections.abc import Sequence
from multiprocessing.connection import Connection
from typing import Any, Final

from nanoslip.solver.outcome import Ending, Outcome
from nanoslip.study.origin import Origin
from nanoslip.study.run.child import NO_TASK, ChildProcess
from nanoslip.study.run.dispatch import Done, print_failure
from nanoslip.study.run.launch import Program
from nanoslip.study.run.queue import Work

START: Final = 300.0
"""Seconds that a child has to start in; a crowded file system may need a while."""
FALSE_STARTS: Final = 5
"""Children of one agent that end before they can compute, one after the other, until it gives up."""


class BrokenProgramError(Exception):
    """No computing process can be started; no task has an outcome."""


class Agent:
    """One child, started when it is needed or by `start`, and the tasks that wait for it."""

    def __init__(self, program: Program, number: int) -> None:
        """number: how messages call the child, by its rank."""
        self._program, self._number = program, number
        self._child: ChildProcess | None = None
        self._origin: Origin | None = None
        self._waiting: deque[Work] = deque()
        self._begun: Work | None = None
        self._false_starts = 0

    @property
    def busy(self) -> bool:
        """Whether it computes a task."""
        return self._begun is not None

    @property
    def waiting(self) -> int:
        """Number of its tasks that it has not begun."""
        return len(self._waiting)

    @property
    def pipe(self) -> "Connection[Any, Any] | None":
        """Descriptor that becomes readable with news; None without a child."""
        return self._child.pipe if self._child else None

    def start(self) -> ChildProcess:
        """Start the child, which imports what it needs meanwhile, and return it."""
        if self._child is None:
            self._child = ChildProcess(self._program, self._number)
            if self._origin:
                self._child.adopt(self._origin)
        return self._child

    def adopt(self, origin: Origin) -> None:
        """Have every child state this software in results."""
        self._origin = origin
        if self._child:
            self._child.adopt(origin)

    def give(self, tasks: Sequence[Any]) -> None:
        """Append tasks to its queue."""
        self._waiting.extend(tasks)
        self._feed()

    def give_back(self) -> tuple[str, ...]:
        """Drop all tasks that the child has not got yet, and return their keys."""
        keys = tuple(task.key for task in self._waiting)
        self._waiting.clear()
        return keys

    def arrived(self) -> list[Done]:
        """The tasks that have ended since. Raises BrokenProgramError where no child can be started."""
        done = self._ended(self._begun) if self._begun else None
        self._feed()
        return [done] if done else []

    def close(self) -> None:
        """End the child; its task is lost."""
        if self._child:
            self._child.kill()
            self._child = None

    def _feed(self) -> None:
        """Keep the child at work."""
        if self._waiting and self._begun is None:
            self._begun = self._waiting.popleft()
            self.start().begin(self._begun)

    def _begin_again(self) -> None:
        """Give the remaining tasks to the next child."""
        self.close()
        if self._begun:
            self._waiting.appendleft(self._begun)
            self._begun = None

    def _ended(self, task: Work) -> Done | None:
        """How a task has ended; None while it has not."""
        child = self._child
        assert child is not None
        try:
            done = child.receive()
        except Exception:  # it has ended, or written what is no message
            return self._dead(task, child)
        if done is None and not child.ready and child.seconds > START:
            child.stop()
            return self._dead(task, child)
        if done is None and child.ready and child.seconds > task.limit:
            outcome = Outcome(Ending.TIMED_OUT, _TIMED_OUT.format(task.limit))
            return self._lost(task, child, outcome, again=False)
        if done is not None:
            self._begun = None
            print_failure(task, done)
            if done.passing:
                self.close()
        return done

    def _dead(self, task: Work, child: ChildProcess) -> Done | None:
        """Outcome of a task whose child has ended; None if it had not started and another child computes it."""
        code = child.last_code()
        outcome = _death(child, code)
        self._false_starts = 0 if child.ready else self._false_starts + 1
        if self._false_starts >= FALSE_STARTS or code == NO_TASK:
            raise BrokenProgramError(f"a process that computes does not begin: {outcome.message}") from None
        if child.ready:
            return self._lost(task, child, outcome, again=True)
        self._begin_again()
        return None

    def _lost(self, task: Work, child: ChildProcess, outcome: Outcome, again: bool) -> Done:
        where = f"rank {self._number} on {socket.gethostname()}"
        done = Done(task.key, outcome, child.seconds, where, child.last_words(), again)
        self._begun = None
        self.close()
        print_failure(task, done)
        return done


_TIMED_OUT: Final = (
    "not finished after {:g} s, and ended: give it more by `seconds` of [limits], if it only needs longer"
)


def _death(child: ChildProcess, code: int | None) -> Outcome:
    """Cause of an unexpected end of a child."""
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
