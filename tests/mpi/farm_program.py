"""A program for several ranks: made-up tasks on the farm. `farm_program WHAT`; prints what came of it."""

import os
import signal
import sys
import time
from typing import Final

from nanoslip.solver.outcome import COMPLETED, Outcome
from nanoslip.study.run.dispatch import Execute, Watch
from nanoslip.study.run.farm import open_farm
from nanoslip.study.run.launch import Program
from tests.study.run.made_up import Work

UNHEARD: Final = 1000
"""Messages on their way to a rank that does not listen yet; MPICH takes 64 before it keeps the others at the sender."""


def tasks(what: str) -> list[Work]:
    """A hundred short tasks; with `chain` each needs the one before it, with `stop` they outlast the signal,
    with `late` the grace too, but end while the process says its last words.

    A task sleeps as long as it costs.
    """
    if what == "pace":
        return [Work(str(number), cost=0.05) for number in range(40)]
    seconds = {"stop": 0.3, "late": 1.25, "stuck": 60.0}.get(what, 0.01)
    needs = [(str(number - 1),) if what == "chain" and number else () for number in range(100)]
    return [Work(str(number), needs[number], seconds, limit=100.0) for number in range(100)]


def executor(what: str) -> Execute:
    """What computes such a task."""

    def execute(task: Work) -> Outcome:
        if what == "crash" and task.key in ("7", "8"):
            raise ZeroDivisionError("a defect")
        if what in ("stop", "late", "stuck") and task.key == "0":
            print("started", flush=True)
        time.sleep(task.cost)
        return COMPLETED

    return execute


def main(what: str) -> None:
    farm = open_farm(Program("tests.mpi.farm_program", "executor", what), grace=20.0 if what == "stop" else 1.0)
    if what == "early" and farm.root:
        os.kill(os.getpid(), signal.SIGINT)
    with farm:
        finished: list[str] = []

        def report(task: Work, outcome: Outcome, seconds: float) -> None:
            assert set(task.needs) <= set(finished)
            finished.append(task.key)

        if not farm.root:
            if what == "broken":
                raise RuntimeError("this rank is broken")
            if what == "fatal":
                os.kill(os.getpid(), signal.SIGKILL)
            if what == "crowd":
                time.sleep(1.0)
            farm.leave(farm.serve())
        if what == "pace":  # the children have started by then
            farm.run([Work(f"start {number}") for number in range(farm.size)], Watch())
        if what == "crowd":
            for _ in range(UNHEARD):
                farm.take_back(1)
            farm.leave(0)
        begun = time.perf_counter()
        tally = farm.run(tasks(what), Watch(report))
        if what == "pace":
            print(time.perf_counter() - begun)
        print(f"{tally.done} done, {tally.crashed} crashed, {len(set(finished))} reported", flush=True)
        farm.leave(99 if tally.interrupted else int(tally.crashed > 0))


if __name__ == "__main__":
    from tests.mpi import farm_program

    farm_program.main(sys.argv[1])  # whose classes children know by that name
