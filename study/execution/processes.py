"""Spread tasks over processes of one machine without MPI: `ProcessFarm`, behind the same interface as the others.

This process hands out, a number of others compute, each at the other end of a pipe. One that dies (killed, or out of memory)
takes the task with it that it computed, which counts as crashed; the tasks that waited there are handed out again.
"""

import multiprocessing
import os
import queue
import signal
import sys
import threading
from collections.abc import Sequence
from functools import partial
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any, NoReturn, Self, TypeVar

from solver.outcome import Ending, Outcome
from study.execution.dispatch import Dispatcher
from study.execution.interruption import GRACE, SIGNALS, Interruption
from study.execution.ledger import Done, Execute, Ledger, Report, Tally, attempt_aloud, say
from study.execution.queue import Work

PATIENCE = 0.1
"""Seconds between looks whether a signal has come, while no task ends."""

W = TypeVar("W", bound=Work)


class LocalFarm:
    """What farms without MPI share: this process is the root, and all others end with it."""

    root = True

    def __init__(self, size: int, grace: float = GRACE) -> None:
        self.size = self.here = size
        self.interruption = Interruption(grace)

    def __enter__(self) -> Self:
        self.interruption.__enter__()
        return self

    def __exit__(self, *error: object) -> None:
        self.interruption.__exit__(*error)

    def serve(self, execute: Execute[Any]) -> int:
        """Raises RuntimeError: only ranks serve, and this process is the root."""
        raise RuntimeError("a farm without ranks has nobody to serve")

    def leave(self, code: int) -> NoReturn:
        """End the process."""
        sys.exit(code)


class ProcessFarm(LocalFarm):
    """So many processes that compute tasks, started by this one."""

    unit = "processes"

    def run(self, tasks: Sequence[W], execute: Execute[W], report: Report[W]) -> Tally:
        """Hand out tasks, idle processes first; several at once where they are short. execute: it is pickled."""
        ledger = Ledger(tasks, report)
        workers = [_Worker(number, execute) for number in range(min(self.size, len(tasks)))]  # more would only wait
        dispatcher = Dispatcher([worker.send for worker in workers])
        while ledger.unfinished and not self.interruption.requested:
            dispatcher.hand_out(ledger)
            _arrivals(workers, dispatcher, ledger)
        for worker in workers:
            worker.stop()
        while any(worker.alive for worker in workers):
            _arrivals(workers, dispatcher, ledger)
        return ledger.tally(self.interruption.requested)


def _arrivals(workers: Sequence["_Worker"], dispatcher: Dispatcher, ledger: Ledger[Any]) -> None:
    """Enter the tasks that have ended, and those that are lost with a process that has died."""
    living: dict[Any, _Worker] = {worker.pipe: worker for worker in workers if worker.alive}
    for pipe in wait(list(living), PATIENCE):
        worker = living[pipe]
        try:
            done = worker.receive()
        except (EOFError, OSError):
            _bury(worker, dispatcher, ledger)
        else:
            ledger.enter(dispatcher.take_back(worker.number, done.key), done)


def _bury(worker: "_Worker", dispatcher: Dispatcher, ledger: Ledger[Any]) -> None:
    """Forget a process that has ended; unless it was asked to, the task that it computed counts as crashed."""
    left, code = dispatcher.forget(worker.number), worker.bury()
    if not left or worker.stopped:
        return
    ledger.enter(left[0], _lost(left[0], code))
    for task in left[1:]:
        ledger.give_back(task)


def _lost(task: Work, code: int | None) -> Done:
    how = f"signal {-code}" if code is not None and code < 0 else f"exit code {code}"
    say(f"{task.label}: its process died ({how}): killed, or no memory left\n")
    return Done(task.key, Outcome(Ending.CRASHED, f"its process died ({how})"), 0.0)


class _Worker:
    """One process and this end of its pipe; started when there is something to send."""

    def __init__(self, number: int, execute: Execute[Any]) -> None:
        self.number = number
        self.pipe: Connection[Any, Any] | None = None
        self.stopped = False
        self._execute = execute
        self._process: SpawnProcess | None = None

    @property
    def alive(self) -> bool:
        """Whether it was started and has not been buried."""
        return self.pipe is not None

    def send(self, tasks: list[Any]) -> None:
        """Give it tasks, behind those that it has."""
        if self.pipe is None:
            self._start()
        self._tell(tasks)

    def stop(self) -> None:
        """Let it finish the task that it computes, and end."""
        self.stopped = True
        self._tell(None)

    def receive(self) -> Done:
        """A task that has ended there. Raises EOFError where the process has."""
        assert self.pipe is not None
        return self.pipe.recv()  # type: ignore[no-any-return]

    def bury(self) -> int | None:
        """Forget the process, which has ended; returns its exit code."""
        assert self.pipe is not None
        assert self._process is not None
        self.pipe.close()
        self._process.join()
        self.pipe = None
        return self._process.exitcode

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")  # a fork would copy threads and locks of numba and BLAS
        self.pipe, other = context.Pipe()
        self._process = context.Process(target=_serve, args=(other, self._execute, self.number), daemon=True)
        signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)  # the process starts with them blocked, and then ignores them
        try:
            self._process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
        other.close()

    def _tell(self, message: object) -> None:
        if self.pipe is not None:
            try:
                self.pipe.send(message)
            except OSError:  # it has died, as the other direction will say
                return


def _serve(pipe: "Connection[Any, Any]", execute: Execute[Any], number: int) -> None:
    """What such a process does: compute what comes until it is told to stop. It ends with the one that started it."""
    for each in SIGNALS:  # a terminal sends them to all; what they mean is decided by the process that hands out
        signal.signal(each, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
    waiting: queue.SimpleQueue[Any] = queue.SimpleQueue()
    threading.Thread(target=partial(_read, pipe, waiting), daemon=True).start()
    while (task := waiting.get()) is not None:
        pipe.send(attempt_aloud(execute, task, number))


def _read(pipe: "Connection[Any, Any]", waiting: "queue.SimpleQueue[Any]") -> None:
    """Put what comes into the queue, so that the pipe never fills up."""
    while True:
        try:
            tasks = pipe.recv()
        except (EOFError, OSError):
            os._exit(1)  # nobody is there any more
        if tasks is None:
            while not waiting.empty():
                waiting.get()
        for task in tasks or (None,):
            waiting.put(task)
        if tasks is None:
            return
