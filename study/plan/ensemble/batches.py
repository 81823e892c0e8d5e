"""Members of a later batch wait for those before them: their tasks need the answer to whether they are needed.

What such a task yields is one of two things, so its key says what it waits for: the same member of an ensemble without a target,
or with another one, is another task.
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
    """Takes the cases of a campaign in their order, the members of each ensemble one after the other."""

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
