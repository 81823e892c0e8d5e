"""Members of a later batch: their tasks wait for the decision, made from the members before them, whether they are needed.

Such a task may end without a result, so its key includes the decision that it waits for. The same member of an ensemble without a
target, or with another one, is another task.
"""

from dataclasses import replace

from study.manifest.cases import CampaignCase
from study.manifest.manifest import Manifest
from study.plan.keys import task_key
from study.plan.kinds.ensemble import ensemble_task, kind_of
from study.plan.kinds.kind import Wanted
from study.plan.kinds.record import RECORD
from study.plan.task import Task


class Batches:
    """Assigns members to batches. It is given the cases of a campaign in their order, an ensemble's members in succession."""

    def __init__(self, manifest: Manifest) -> None:
        self._ensemble = manifest.ensemble
        self._kinds = {RECORD.name, kind_of(manifest.ensemble.observable).name}
        self._batch = 0
        self._members: list[list[Task]] = []
        self._asked: Task | None = None

    def waiting(self, case: CampaignCase, wanted: list[Wanted]) -> list[Wanted]:
        """The tasks of a case, those of a later member with what they wait for; before the first of a batch its question."""
        if self._ensemble.uncertainty is None:
            return wanted
        member = _member(case)
        batch = self._ensemble.batch(member)
        if not member:
            self._members.clear()
        if batch != self._batch:
            asking = batch and self._members
            self._batch, self._asked = batch, ensemble_task(self._members, self._ensemble) if asking else None
        last = batch == self._ensemble.batch(self._ensemble.members - 1)
        wanted = _after(self._asked, wanted) if self._asked else wanted
        wanted = wanted if last else list(map(self._read_by_others, wanted))
        if wanted:
            self._members.append(self._read(wanted))
        return [Wanted(self._asked), *wanted] if self._asked else wanted

    def _read_by_others(self, wanted: Wanted) -> Wanted:
        """What the question whether further members are needed reads is a file of its own."""
        return wanted._replace(task=replace(wanted.task, shared=True)) if wanted.task.kind in self._kinds else wanted

    def _read(self, wanted: list[Wanted]) -> list[Task]:
        """What the question reads of a member: its record, or the scalars of that, and its drives."""
        tasks = [each.task for each in wanted if each.task.kind in self._kinds]
        records = [task for task in tasks if task.kind == RECORD.name]
        return [*records[-1:], *(task for task in tasks if task.kind != RECORD.name)]


def _member(case: CampaignCase) -> int:
    return int(case.values[-1] or 0)


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
