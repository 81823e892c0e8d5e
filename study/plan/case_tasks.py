"""The tasks of each case."""

import itertools
from array import array
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from nanoslip.study.manifest.cases import CampaignCase

TaskNames = tuple[tuple[str, str], ...]
"""Kinds of tasks, each with the label of its drive ("" without one)."""


@dataclass(frozen=True, slots=True)
class CaseTasks:
    """Keys of the tasks of one case; none of a case that the physics refuses."""

    keys: Mapping[tuple[str, str], str] = field(default_factory=dict)
    """Kind of task and label of its drive ("" without one) -> key, in the order of stages."""

    def key(self, kind: str, drive: str = "") -> str | None:
        """Key of the case's task of this kind; None where there is none."""
        return self.keys.get((kind, drive))

    @property
    def compliance(self) -> str | None:
        """Key of the slab's compliance."""
        return self.key("compliance")

    @property
    def record(self) -> str | None:
        """Key of the friction record, or of its scalars where it is not kept."""
        return self.key("record")

    @property
    def drives(self) -> dict[str, str]:
        """Label of the drive -> key."""
        return {drive: key for (_, drive), key in self.keys.items() if drive}


class TasksOfCases(Mapping[str, CaseTasks]):
    """case_id -> its tasks. Of millions of cases little is kept: the kinds of tasks that they share, and keys in one list."""

    def __init__(self) -> None:
        self.cases: list[CampaignCase] = []
        self._names: list[TaskNames] = []
        self._known: dict[TaskNames, TaskNames] = {}
        self._keys: list[str] = []
        self._begins = array("Q")
        self._last = "", CaseTasks()

    def add(self, case: CampaignCase, keys: Mapping[tuple[str, str], str]) -> None:
        """keys: of its tasks, by kind and label of the drive, in the order of stages."""
        names = tuple(keys)
        self.cases.append(case)
        self._names.append(self._known.setdefault(names, names))
        self._begins.append(len(self._keys))
        self._keys += keys.values()

    def part(self, numbers: range) -> "TasksOfCases":
        """Those of the cases of these numbers."""
        found = TasksOfCases()
        for number in numbers:
            found.add(self.cases[number], self._tasks(number).keys)
        return found

    def alike(self) -> Iterator[tuple[TaskNames, list[int], list[str]]]:
        """Of cases with the same kinds of tasks: these, the positions of the cases, and their keys, one case behind the other."""
        for names in self._known:
            if len(self._known) == 1:
                yield names, list(range(len(self))), self._keys
                return
            numbers = [number for number, its in enumerate(self._names) if its is names]
            keys = (self._keys[begin : begin + len(names)] for begin in map(self._begins.__getitem__, numbers))
            yield names, numbers, list(itertools.chain.from_iterable(keys))

    def in_order(self) -> Iterator[tuple[CampaignCase, CaseTasks]]:
        """All cases with their tasks. While it is a case's turn, asking for its tasks by its name takes no search."""
        for number, case in enumerate(self.cases):
            self._last = case.case_id, self._tasks(number)
            yield case, self._last[1]

    def __getitem__(self, case_id: str) -> CaseTasks:
        if self._last[0] != case_id:  # a case is asked for again by each of its drives
            self._last = case_id, self._tasks(self._places[case_id])
        return self._last[1]

    def _tasks(self, number: int) -> CaseTasks:
        names, begin = self._names[number], self._begins[number]
        return CaseTasks(dict(zip(names, self._keys[begin : begin + len(names)], strict=True)))

    def __iter__(self) -> Iterator[str]:
        return (case.case_id for case in self.cases)

    def __len__(self) -> int:
        return len(self.cases)

    @cached_property
    def _places(self) -> dict[str, int]:
        return {case.case_id: place for place, case in enumerate(self.cases)}
