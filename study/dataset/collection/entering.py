"""A piece of a campaign's cases, one behind the other: their labels, their numbers and how they ended."""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from typing import Any, NamedTuple

from numpy.typing import NDArray

from nanoslip.solver.outcome import Outcome
from nanoslip.study.dataset.collection.column import Values
from nanoslip.study.dataset.collection.coordinates import values_in, varied
from nanoslip.study.dataset.collection.pieces import Planned, pieces
from nanoslip.study.dataset.collection.ragged import Runs
from nanoslip.study.dataset.collection.table import Declared, Results, Table
from nanoslip.study.dataset.variables import DISCRETIZATION_ERROR, factors
from nanoslip.study.manifest.cases import CampaignCase
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.origin import Origins
from nanoslip.study.plan.grids import Front
from nanoslip.study.plan.plan import Plan, case_outcome, drive_outcome
from nanoslip.study.results.store import Store, StoreError

Keys = Mapping[tuple[str, str], str]
"""Kind of task and label of its drive ("" without one) -> key."""


class Finished:
    """The results of a plan that are there, a case at a time, and how its tasks ended."""

    def __init__(self, plan: Planned, store: Store) -> None:
        self._store, self._known = store, store.metas()
        self._unsound: set[str] = set()
        failed = {key: attempt.outcome for key, attempt in store.failures().items()}
        self._lost = plan.outcomes(store.outcomes(), failed) if failed else {}
        """How the others failed."""

    def results(self, keys: Keys) -> Results:
        """Those of a case, its compliance apart. keys: of its tasks."""
        sound = {task: key for task, key in keys.items() if key in self._known and key not in self._unsound}
        found = {task: self._store.find(key) for task, key in sound.items() if task[0] != "compliance"}
        self._unsound.update(keys[task] for task, result in found.items() if result is None)  # damaged since
        return {task: result for task, result in found.items() if result is not None}

    def outcomes(self, keys: Keys, results: Results) -> dict[str, Outcome]:
        """How the tasks of a case ended."""
        ended = {key: self._lost[key] for key in keys.values() if key in self._lost and key not in self._known}
        compliances = (key for (kind, _), key in keys.items() if kind == "compliance")
        ended |= {key: self._known[key].outcome for key in compliances if key in self._known}
        return ended | {result.key: result.outcome for result in results.values()}


class Entered(NamedTuple):
    """What is known of a piece."""

    ids: list[str]
    """Names of its cases."""
    able: int
    """How many of them are not refused."""
    parameters: dict[str, Values]
    numbers: dict[str, NDArray[Any]]
    """As `Table.values` gives them."""
    made: dict[str, Origins]
    """Key of each of its results -> the software that it stems from."""


class Entering:
    """Enters pieces of a campaign's cases."""

    def __init__(self, manifest: Manifest, declared: Declared, front: Front, finished: Finished) -> None:
        self._manifest, self._declared, self._front, self._finished = manifest, declared, front, finished

    def piece(self, plan: Plan, runs: Sequence[Runs]) -> Entered:
        """The cases of a plan. runs: are added to."""
        table, made = Table(self._declared, plan.count), dict[str, Origins]()
        for place, (case, tasks) in enumerate(plan.case_tasks.in_order()):
            results = self._finished.results(tasks.keys)
            made.update((result.key, result.origins) for result in results.values())
            _say_outcomes(table, place, plan, case, self._finished.outcomes(tasks.keys, results))
            table.say_makers(place, results)
            if case.case is not None:
                table.put(DISCRETIZATION_ERROR.name, place, "", self._front.expected_error(case.case))
                _enter(table, place, runs, self._manifest, case, results)
        ids, able = [case.case_id for case in plan.cases], sum(case.case is not None for case in plan.cases)
        return Entered(ids, able, values_in(plan, varied(self._declared.layout)), table.values(), made)


def one_by_one(entering: Entering, plan: Planned, runs: Sequence[Runs]) -> Iterator[Entered]:
    """All pieces of a campaign in their order. runs: are added to."""
    return (entering.piece(plan.piece(numbers), runs) for numbers in pieces(plan))


def side_by_side(entering: Entering, plan: Planned, processes: int) -> Iterator[Entered]:
    """The same without runs, entered in so many processes. Raises StoreError where one of them dies.

    They are forked: each has what is known of the results by now, which would have to be found again in a fresh one.
    """
    try:
        with ProcessPoolExecutor(processes, get_context("fork"), _begin, (entering, plan)) as pool:
            yield from pool.map(_piece, pieces(plan))
    except BrokenProcessPool:
        raise StoreError(
            "a process that read results died, perhaps for want of memory: collect with fewer jobs"
        ) from None


_begun: list[tuple[Entering, Planned]] = []
"""What a forked process has in hand."""


def _begin(entering: Entering, plan: Planned) -> None:
    _begun.append((entering, plan))


def _piece(numbers: range) -> Entered:
    entering, plan = _begun[-1]
    return entering.piece(plan.piece(numbers), ())


def _say_outcomes(table: Table, place: int, plan: Plan, case: CampaignCase, outcomes: Mapping[str, Outcome]) -> None:
    table.say_outcome(place, case_outcome(plan, case, outcomes))
    for drive in plan.manifest.drives:
        table.say_outcome(place, drive_outcome(plan, case, drive, outcomes), drive.label)


def _enter(
    table: Table,
    place: int,
    runs: Sequence[Runs],
    manifest: Manifest,
    case: CampaignCase,
    results: Results,
) -> None:
    """Enter the numbers of a case."""
    assert case.case is not None
    drives = {drive.label: drive.drive for drive in manifest.drives}
    by = {name: factors(case.case, manifest.scales, drives.get(name)) for _, name in results}
    for (_, name), result in results.items():
        table.enter(place, case.case, name, result, by[name])
    for each in runs:
        for name in drives if each.group.driven else ("",):
            parts = [found for kind in each.group.kinds if (found := results.get((kind, name)))]
            if parts:
                table.put(each.group.id.name, place, name, each.add(parts, by[name], case.case_id, name))
