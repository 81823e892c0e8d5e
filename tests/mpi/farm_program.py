"""A program for several ranks: made-up tasks on the farm. `farm_program.py WHAT`; prints what came of it."""

import os
import signal
import sys
import threading
import time
from dataclasses import dataclass

from solver.outcome import COMPLETED, Outcome
from study.execution.farm import open_farm


@dataclass(frozen=True)
class Work:
    key: str
    needs: tuple[str, ...] = ()
    cost: float = 0.01
    kind: str = "any"
    seconds: float = 0.01

    @property
    def label(self) -> str:
        return f"task {self.key}"


def tasks(what: str) -> list[Work]:
    """A hundred short tasks; with `chain` each needs the one before it, with `stop` they outlast the signal."""
    if what == "pace":
        return [Work(str(number), cost=0.05, seconds=0.05) for number in range(40)]
    seconds = {"stop": 0.3, "stuck": 60.0}.get(what, 0.01)
    needs = [(str(number - 1),) if what == "chain" and number else () for number in range(100)]
    return [Work(str(number), needs[number], seconds=seconds) for number in range(100)]


def main(what: str) -> None:
    with open_farm(grace=1.0) as farm:
        rank = getattr(farm, "rank", 0)
        finished: list[str] = []

        def execute(task: Work) -> Outcome:
            if what == "crash" and task.key in ("7", "8"):
                raise ZeroDivisionError("a defect")
            if what == "fatal" and task.key == "7":
                threading.Timer(0.0, os.kill, [os.getpid(), signal.SIGKILL]).start()
                time.sleep(10.0)
            if what in ("stop", "stuck") and task.key == "0":
                print("started", flush=True)
            time.sleep(task.seconds)
            return COMPLETED

        def report(task: Work, outcome: Outcome, seconds: float) -> None:
            assert set(task.needs) <= set(finished)
            finished.append(task.key)

        if not farm.root:
            if what == "broken" and rank == 1:
                raise RuntimeError("this rank is broken")
            farm.leave(farm.serve(execute))
        begun = time.perf_counter()
        tally = farm.run(tasks(what), execute, report)
        if what == "pace":
            print(time.perf_counter() - begun)
        print(f"{tally.done} done, {tally.crashed} crashed, {len(set(finished))} reported", flush=True)
        farm.leave(99 if tally.interrupted else int(tally.crashed > 0))


main(sys.argv[1])
