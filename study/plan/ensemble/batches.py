"""Members of a later batch wait for those before them: their tasks need the answer to whether they are needed.

What such a task yields is one of two things, so its key says what it waits for: the same member of an ensemble without a target,
or with another one, is another task.
"""

from dataclasses import replace
from typing import Final

from study.manifest.cases import CampaignCase
from study.manifest.manifest import Manifest
from study.plan.keys import task_key
from study.plan.kinds.ensemble import ensemble_task
from study.plan.kinds.kind import Wanted
from study.plan.task import Task

_RECORD: Final = "record"


class Batches:
    """Takes the cases of a campaign in their order, the members of each ensemble one after the other."""

    def __init__(self, manifest: Manifest) -> None:
        self._ensemble = manifest.ensemble
        self._batch = 0
        self._records: list[Task] = []
        self._asked: Task | None = None

    def waiting(self, case: CampaignCase, wanted: list[Wanted]) -> list[Wanted]:
        """The tasks of a case, those of a later member with what they wait for; before the first of a batch its question."""
        target = self._ensemble.uncertainty
        if target is None:
            return wanted
        batch = self._ensemble.batch(_member(case))
        if batch != self._batch:
            self._batch, self._asked = batch, ensemble_task(self._records, target) if batch and self._records else None
            if not batch:
                self._records.clear()
        last = batch == self._ensemble.batch(self._ensemble.members - 1)
        wanted = _after(self._asked, wanted) if self._asked else wanted
        wanted = wanted if last else [_read_by_others(each) for each in wanted]
        self._records += [each.task for each in wanted if each.task.kind == _RECORD][-1:]
        return [Wanted(self._asked), *wanted] if self._asked else wanted


def _member(case: CampaignCase) -> int:
    return int(case.values[-1] or 0)


def _read_by_others(wanted: Wanted) -> Wanted:
    """A record is read by the question whether further members are needed."""
    return wanted._replace(task=replace(wanted.task, shared=True)) if wanted.task.kind == _RECORD else wanted


def _after(asked: Task, wanted: list[Wanted]) -> list[Wanted]:
    """A member's tasks as they wait for an answer: those that need none of its others need that."""
    own = [each.task for each in wanted if each.task.case is not None]  # a compliance is of all members
    keys = {task.key: task_key(task.kind, task.key, asked.key) for task in own}

    def held(each: Wanted) -> Wanted:
        task = each.task
        if task.key not in keys:
            return each
        needs = tuple(keys.get(need, need) for need in task.needs)
        if needs == task.needs:
            needs = (*needs, asked.key)
        return each._replace(task=replace(task, key=keys[task.key], needs=needs, batch=asked.batch + 1))

    return list(map(held, wanted))
