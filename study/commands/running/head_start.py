"""A head start: of very many cases the first ones are computed while the others are still being planned.

What is planned stays as it is, whatever follows, so results are the same as without. When the plan is made, the run goes on as
any other: with what is left, in the order of the whole plan.
"""

import itertools
import math
from collections.abc import Collection, Sequence
from contextlib import closing
from pathlib import Path
from typing import Final

from solver.outcome import UNDONE, Ending, Outcome
from study.commands.running.order import Order
from study.execution.compiling.warm_up import WarmUp, warm_ups
from study.execution.failures import Diary
from study.execution.farms.begun import Begun
from study.execution.farms.farm import Farm
from study.execution.journal import Journal
from study.execution.ledger import Tally
from study.manifest.cases import Heard
from study.manifest.manifest import Manifest
from study.plan.memory import machine_memory, need_of
from study.plan.plan import Planning
from study.plan.tasks import Task
from study.results.shard import folders
from study.results.store import Store

LARGE: Final = 50_000
"""Cases from which on their planning takes seconds."""
SHORT: Final = 1.0
"""Estimated seconds of a task that is begun early, at most: ranks wait for those in hand when the plan is made."""

AT_ONCE: Final = 64
"""Cases that are planned between two looks at what the ranks have done, in some 3 ms: they have work at hand for 10."""


def worthwhile(manifest: Manifest) -> bool:
    """Whether a campaign takes long to plan, and no two of its cases are the same, so that it can be planned."""
    axes = list(manifest.axes.values())
    if manifest.design == "product":
        count, distinct = math.prod(map(len, axes)), all(len(set(values)) == len(values) for values in axes)
    else:
        points = list(zip(*axes, strict=True))
        count, distinct = len(points), len(set(points)) == len(points)
    return count >= LARGE and distinct


def possible(order: Order, store: Store) -> bool:
    """Whether tasks can be chosen without the whole plan: nothing is finished yet or has failed, and all are wanted."""
    return not (order.shard or store.finished() or store.failures() or Begun(order.into).read() or folders(order.out))


class HeadStart:
    """Computes short tasks on a farm while further cases are planned."""

    def __init__(self, farm: Farm, planning: Planning, journal: Journal, heard: Heard) -> None:
        """heard: callback, called with the number of cases planned so far."""
        self._farm, self._planning, self._journal, self._heard = farm, planning, journal, heard
        self._seen = 0
        self._ended: set[str] = set()
        """What other tasks may need."""
        self._compiled: set[str] = set()

    def run(self, out: Path) -> Tally:
        """Plan all cases, and compute meanwhile, unless the run is told to stop or cannot go on."""
        tally, begun = Tally(), Begun(out)
        self._farm.interruption.at_request(begun.close)
        diary = Diary(out, self._journal.noting(self._note))
        with closing(begun):
            while not (self._farm.interruption.requested or tally.halt) and self._plan_on():
                tasks = self._next()
                self._farm.run(self._to_compile(tasks), lambda *_: None, meanwhile=self._plan_on)
                tally = tally.then(self._farm.run(tasks, diary.report, diary.fail, begun.begin, self._plan_on))
        return tally

    def _plan_on(self) -> bool:
        self._heard(self._planning.cases)
        return self._planning.go_on(AT_ONCE)

    def _next(self) -> list[Task]:
        """Of what was planned since, the tasks that are short and fit the memory, and need only such ones."""
        fresh = self._planning.tasks(self._seen)
        self._seen += len(fresh)
        there, chosen = machine_memory() / self._farm.here, set[str]()
        found = []
        for task in fresh:
            able = all(need in self._ended or need in chosen for need in task.needs)
            if able and task.cost <= SHORT and need_of(task) <= there:
                chosen.add(task.key)
                found.append(task)
        return found

    def _to_compile(self, tasks: Sequence[Task]) -> list[WarmUp]:
        """The kernels of these tasks, but those of earlier ones."""
        new = [each for each in warm_ups(tasks) if not self._compiled.issuperset(task.key for task in each.tasks)]
        self._compiled.update(task.key for task in itertools.chain.from_iterable(each.tasks for each in new))
        return new

    def _note(self, tasks: Sequence[Task], outcome: Outcome, _seconds: Collection[float]) -> None:
        if outcome.ending not in UNDONE and outcome.ending is not Ending.NEEDS_FAILED:
            self._ended.update(task.key for task in tasks if task.shared)
