"""Outline of a plan as columns: its tasks, their needs, costs and cases. Enough to count progress, not to compute.

Of very many tasks, finished ones and outcomes of cases are counted from it in a fraction of the time that planning takes.
"""

from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from operator import attrgetter
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from solver.outcome import Ending, Outcome
from study.canonical import content_hash
from study.discretization.front import load_front
from study.garbage import all_kept
from study.manifest.manifest import Manifest
from study.origin import all_sources_hash
from study.plan.plan import Plan
from study.plan.standing.endings import PENDING, after, as_its_case
from study.plan.task import Task
from study.plan.tasks import KINDS

_ENDINGS: Final = tuple(Ending)
_CODE: Final = {ending: number for number, ending in enumerate(_ENDINGS)}
_NONE: Final = -1
"""Where there is no task, and the code of what has not ended."""
_OUTCOMES: Final = (*map(Outcome, _ENDINGS), None)
"""By their codes."""
_AS_ITS_CASE: Final = np.array([as_its_case(found) for found in _OUTCOMES])

Codes = NDArray[np.int8]
Mask = NDArray[np.bool_]


@cache
def _after(kind: str) -> Codes:
    """How a case ended with one task more: rows by how it had before, columns by how the task has."""
    found = [[after(kind, before, task) for task in _OUTCOMES] for before in _OUTCOMES]
    return np.array([[_CODE[each.ending] if each else _NONE for each in row] for row in found], np.int8)


def asked(manifest: Manifest) -> str:
    """A hash of all that decides a plan: the campaign's texts, the front, and this program."""
    front = load_front(manifest.front, manifest.front_text)
    texts = (manifest.text, manifest.table_text, manifest.profile_text, front.sha256)
    return content_hash(all_sources_hash(), manifest.path.name, *texts)


@dataclass(frozen=True, slots=True)
class KindCount:
    """Tasks of one kind: how many, and what they cost."""

    all: int
    finished: int
    left: int
    given_up: int
    core_seconds_left: float
    memory_bytes: float
    """Of the largest one."""
    disk_bytes: float
    """Of all of them."""


def kind_counts(tasks: Iterable[Task], left: Iterable[Task], given_up: Iterable[Task]) -> dict[str, KindCount]:
    """Kind of task -> count and costs, in the order in which they begin, where tasks are at hand themselves."""
    lost, tried = Counter(task.kind for task in given_up), Counter[str]()
    seconds: defaultdict[str, float] = defaultdict(float)
    for task in left:
        tried[task.kind] += 1
        seconds[task.kind] += task.cost
    every: defaultdict[str, list[Task]] = defaultdict(list)
    for task in tasks:
        every[task.kind].append(task)
    found = {}
    for kind, its in every.items():
        rest, memory, disk = tried[kind] + lost[kind], max(task.memory for task in its), sum(task.disk for task in its)
        found[kind] = KindCount(len(its), len(its) - rest, tried[kind], lost[kind], seconds[kind], memory, disk)
    return found


@dataclass(frozen=True, slots=True)
class Look:
    """Progress of a campaign: outcomes, and tasks finished, failed and left."""

    kinds: Mapping[str, KindCount]
    """By name, in the order in which they begin."""
    cases: Counter[str]
    """Ending, or `pending` -> how many cases."""
    drives: Counter[str]

    @property
    def all(self) -> int:
        """How many tasks there are."""
        return sum(each.all for each in self.kinds.values())

    @property
    def left(self) -> int:
        """Tasks that the next run would try."""
        return sum(each.left for each in self.kinds.values())

    @property
    def given_up(self) -> int:
        """Tasks that it would not: failed, or in need of one that has."""
        return sum(each.given_up for each in self.kinds.values())


@dataclass(frozen=True, slots=True, eq=False)
class Outline:
    """The tasks and cases of a plan. Positions are those of tasks, -1 where there is none."""

    keys: NDArray[np.bytes_]
    kinds: Codes
    """Position in KINDS."""
    intermediate: Mask
    costs: NDArray[np.float64]
    """Seconds, bytes of memory, bytes on disk: shape (3, tasks)."""
    needs: NDArray[np.int32]
    """Shape (tasks, most needs of a task)."""
    cases: NDArray[np.int32]
    """The task of each kind: shape (cases, kinds)."""
    drives: NDArray[np.int32]
    """The task of each drive: shape (cases, drives)."""
    case_endings: Codes
    """How each case ended before anything is computed."""
    drive_endings: Codes
    """Likewise of drives, `_NONE` of those that are possible."""

    @property
    def names(self) -> list[str]:
        """The keys of all tasks."""
        return [key.decode("ascii") for key in self.keys.tolist()]

    def look(self, finished: Mapping[str, Outcome], failed: Mapping[str, Outcome], given_up: Collection[str]) -> Look:
        """Count tasks. finished: those with results. failed: by their last attempt. given_up: failed and not tried again."""
        keys = self.names
        ended = np.array([_CODE[finished[key].ending] if key in finished else _NONE for key in keys], np.int8)
        done = ended != _NONE
        left = self._left(done)
        lost = np.array([key in given_up for key in keys]) & ~done if given_up else np.zeros_like(done)
        for stage in self._stages() if given_up else ():
            lost[stage] |= left[stage] & self._any_need(lost, stage)
        if failed:
            known = np.array([_CODE[failed[key].ending] if key in failed else _NONE for key in keys], np.int8)
            ended = np.where(done, ended, self._with_lost(known, done))
        ended = np.append(ended, np.int8(_NONE))  # which is at position -1, that of no task
        cases = self._case_endings(ended)
        return Look(self._counts(done, left, lost), _counted(cases), _counted(self._drive_endings(ended, cases)))

    def _stages(self) -> list[NDArray[np.intp]]:
        """Positions of tasks, stage by stage: none needs a later one."""
        stages = 2 * self.kinds.astype(int) + ~self.intermediate
        return [np.flatnonzero(stages == stage) for stage in np.unique(stages)]

    def _left(self, done: Mask) -> Mask:
        """Tasks still to do: intermediate ones only where another one that is to be done needs them."""
        needed, left = np.zeros_like(done), np.zeros_like(done)
        for stage in reversed(self._stages()):
            left[stage] = ~done[stage] & (~self.intermediate[stage] | needed[stage])
            needs = self.needs[stage][left[stage]]
            needed[needs[needs != _NONE]] = True
        return left

    def _any_need(self, marked: Mask, stage: NDArray[np.intp]) -> Mask:
        """Which tasks of a stage need one that is marked."""
        needs = self.needs[stage]
        found: Mask = np.any(marked[needs] & (needs != _NONE), axis=1)
        return found

    def _with_lost(self, failed: Codes, done: Mask) -> Codes:
        """How tasks failed, those included that need one which has."""
        for stage in self._stages():
            needs = self.needs[stage]
            found = (needs != _NONE) & (failed[needs] != _NONE) & ~done[needs]
            lost = np.flatnonzero(found.any(axis=1) & ~done[stage] & (failed[stage] == _NONE))
            need = needs[lost, found[lost].argmax(axis=1)]
            own = self.kinds[need] == self.kinds[stage[lost]]  # the scalars of a record
            failed[stage[lost]] = np.where(own, failed[need], _CODE[Ending.NEEDS_FAILED])
        return failed

    def _case_endings(self, ended: Codes) -> Codes:
        """As study.plan.standing.endings.case_outcome says it of each case."""
        found = self.case_endings
        for tasks, kind in zip(self.cases.T, KINDS, strict=True):
            found = np.where(tasks != _NONE, _after(kind)[found, ended[tasks]], found)
        return found

    def _drive_endings(self, ended: Codes, cases: Codes) -> Codes:
        """As study.plan.standing.endings.drive_outcome says it of each case and drive."""
        of_case = np.broadcast_to(cases[:, None], self.drives.shape)
        new = ended[self.drives]
        new = np.where(_AS_ITS_CASE[new], of_case, new)
        new = np.where(self.drive_endings != _NONE, self.drive_endings, new)
        refused = (self.cases == _NONE).all(axis=1)[:, None]
        return np.where(refused, self.case_endings[:, None], new)

    def _counts(self, done: Mask, left: Mask, lost: Mask) -> dict[str, KindCount]:
        found = {}
        names = list(KINDS)
        for number in dict.fromkeys(self.kinds.tolist()):
            mine = self.kinds == number
            seconds, memory, disk = self.costs[:, mine]
            tried, given_up = left[mine] & ~lost[mine], left[mine] & lost[mine]
            several = len(seconds), int(np.sum(~left[mine])), int(tried.sum()), int(given_up.sum())
            found[names[number]] = KindCount(
                *several, float(seconds[tried].sum()), float(memory.max()), float(disk.sum())
            )
        return found


def _counted(codes: NDArray[Any]) -> Counter[str]:
    numbers, counts = np.unique(codes, return_counts=True)
    words = (_ENDINGS[number].value if number != _NONE else PENDING for number in numbers.tolist())
    return Counter(dict(zip(words, counts.tolist(), strict=True)))


def outline_of(plan: Plan) -> Outline:
    """The outline of a plan."""
    with all_kept():
        tasks = plan.tasks
        place = {task.key: number for number, task in enumerate(tasks)}
        number_of = {kind: number for number, kind in enumerate(KINDS)}
        drives = plan.manifest.drives if "dynamics" in plan.manifest.stages else ()
        columns = {(kind, ""): number for number, kind in enumerate(KINDS)}
        columns |= {("drive", drive.label): len(KINDS) + number for number, drive in enumerate(drives)}
        of_cases = _of_cases(plan, place, columns)
        return Outline(
            keys=np.array(list(place), "S20"),
            kinds=np.array([number_of[task.kind] for task in tasks], np.int8),
            intermediate=np.array([task.intermediate for task in tasks], np.bool_),
            costs=np.array([list(map(attrgetter(name), tasks)) for name in ("cost", "memory", "disk")], np.float64),
            needs=_needs(tasks, place),
            cases=of_cases[:, : len(KINDS)],
            drives=of_cases[:, len(KINDS) :],
            case_endings=np.array([_CODE[case.outcome.ending] for case in plan.cases], np.int8),
            drive_endings=np.array([_NONE if each.drive else _CODE[each.outcome.ending] for each in drives], np.int8),
        )


def _of_cases(plan: Plan, place: Mapping[str, int], columns: Mapping[tuple[str, str], int]) -> NDArray[np.int32]:
    """Positions of the tasks of every case, each in its column."""
    found = np.full((len(plan.cases), len(columns)), _NONE, np.int32)
    for names, numbers, keys in plan.case_tasks.alike():
        if names:
            places = np.array([place[key] for key in keys], np.int32).reshape(len(numbers), len(names))
            found[np.ix_(numbers, [columns[name] for name in names])] = places
    return found


def _needs(tasks: Sequence[Task], place: Mapping[str, int]) -> NDArray[np.int32]:
    """Positions of what every task needs."""
    rows: dict[tuple[str, ...], int] = {}
    which = [rows.setdefault(task.needs, len(rows)) for task in tasks]  # many need the same
    found = np.full((len(rows), max(map(len, rows), default=0)), _NONE, np.int32)
    for needs, row in rows.items():
        found[row, : len(needs)] = [place[key] for key in needs]
    return found[which]
