"""One run of a campaign in a folder, from the command line or Python. The caller shows progress and writes the dataset."""

from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, suppress
from dataclasses import dataclass, replace
from itertools import accumulate
from pathlib import Path
from typing import Final, NamedTuple, TypeVar

from nanoslip.solver.outcome import Ending, NanoslipError, Outcome
from nanoslip.study.exit_codes import FAILURES, INTERRUPTED, WRONG_INPUT
from nanoslip.study.origin import Origins
from nanoslip.study.plan.expectations import shortages
from nanoslip.study.plan.plan import Plan
from nanoslip.study.results.attempts import Attempt
from nanoslip.study.results.files import Shard, looks
from nanoslip.study.results.store import Lease, Store, StoreError, merge_shards
from nanoslip.study.run.child import FarmError
from nanoslip.study.run.dispatch import Done, MeasuredTimes, RunTally, Watch
from nanoslip.study.run.executor import WarmUp, miniatures
from nanoslip.study.run.farm import Farm
from nanoslip.study.run.journal import BEGUN, Journal, long_task_keys, read_task_times
from nanoslip.study.tasks.task import Task

# The cases of a shard, and which of their tasks it skips: blocks of neighbours that cost about the same.
#
# Neighbours mostly share slabs; what several shards need, each computes for itself.

LEAST_CASE_SECONDS: Final = 1e-3
"""Fewest seconds that a case counts, so that refused cases are spread, too."""

Result = TypeVar("Result")


def part(plan: Plan, shard: Shard) -> Plan:
    """The cases of a shard, and all tasks that they need. Every case is in one of the shards."""
    tasks_of_cases = plan.case_tasks.items()
    needed = {key: plan.with_needs(tasks.values()) for key, tasks in tasks_of_cases}
    costs = {task.key: task.cost for task in plan.tasks}
    users = Counter(key for keys in needed.values() for key in keys)
    weights = []
    for case in plan.cases:
        # In the order of keys, as that of a set would give other sums in each process.
        keys = sorted(needed[case.case_id])
        # A task that several cases need counts for each of them by its share.
        shares = [costs[key] / users[key] for key in keys]
        weights.append(LEAST_CASE_SECONDS + sum(shares))
    blocks = task_blocks(weights, shard.of)
    pairs = zip(plan.cases, blocks, strict=True)
    cases = tuple(case for case, block in pairs if block == shard.number - 1)
    keys_of_shard = {key for case in cases for key in needed[case.case_id]}
    case_tasks = {case.case_id: plan.case_tasks[case.case_id] for case in cases}
    distinct = tuple(task for task in plan.distinct if task.key in keys_of_shard)
    return replace(plan, cases=cases, distinct=distinct, case_tasks=case_tasks)


def task_blocks(weights: Sequence[float], count: int) -> list[int]:
    """The block of each weight, from 0: neighbours together, each block about as heavy as any other.

    None is empty while there is another with two, and none is heavier than their mean by more than one weight.
    """
    ends, blocks = list(accumulate(weights)), list[int]()
    count = min(count, len(ends))
    for number, (end, weight) in enumerate(zip(ends, weights, strict=True)):
        # Of as many equal parts of the whole weight, the one that holds the middle of this weight.
        middle = int(count * (end - weight / 2.0) / ends[-1])
        enough_for_the_others = count - (len(ends) - number)
        after_the_last = blocks[-1] + 1 if blocks else 0
        blocks.append(min(max(middle, enough_for_the_others), after_the_last))
    return blocks


def skippable_tasks(
    plan: Plan, own: Mapping[str, Result], merged: Mapping[str, Result], given_up: Collection[str] = ()
) -> dict[str, Result]:
    """Tasks that a shard skips: finished or merged ones, unless a remaining task reads them.

    given_up: keys of tasks that it does not try.
    """
    skipped = {**merged, **own}
    # A result that was merged is in another folder: a task that reads it has it computed here, with all that this needs.
    while True:
        lacking = _read(plan, skipped, given_up) - own.keys()
        if not lacking:
            return skipped
        skipped = {key: result for key, result in skipped.items() if key not in lacking}


def _read(plan: Plan, finished: Collection[str], given_up: Collection[str]) -> set[str]:
    """Results that a remaining task reads."""
    untried = set(given_up) - set(finished)
    tried = plan.possible(plan.remaining(finished), untried)
    read: set[str] = set()
    for task in tried:
        read.update(task.needs)
    return read.intersection(finished)


# Remaining tasks of a campaign: one that has failed for good before is not tried again.


@dataclass(frozen=True, slots=True)
class Rest:
    """Remaining tasks of a campaign, or of a shard of it."""

    tasks: tuple[Task, ...]
    """Tasks that a run tries: failed ones come last."""
    given_up: tuple[Task, ...]
    """Tasks that failed for good, and tasks that need them."""
    foreign: Mapping[str, Origins]
    """Finished results of other software."""


def tasks_to_do(
    plan: Plan,
    failures: Mapping[str, Attempt],
    finished: Mapping[str, Origins],
    recompute_foreign: bool = False,
    retry: bool = False,
) -> Rest:
    """Remaining tasks. recompute_foreign: results of other software count as unfinished. retry: try failed tasks again."""
    foreign = plan.foreign(finished)
    ours = finished.keys() - foreign.keys() if recompute_foreign else finished
    tasks = plan.remaining(ours)
    untried = keys_given_up(failures, retry).difference(ours)
    tried = plan.possible(tasks, untried, failures)
    keys = {task.key for task in tried}
    given_up = tuple(task for task in tasks if task.key not in keys)
    return Rest(tried, given_up, foreign)


def keys_given_up(failures: Mapping[str, Attempt], retry: bool = False) -> set[str]:
    """Keys of the tasks that a run does not try again without `retry`; empty with `retry`."""
    return {key for key, attempt in failures.items() if attempt.given_up and not retry}


def drop_intermediates(plan: Plan, store: Store) -> None:
    """Remove results that only other tasks needed and that no unfinished task still needs. Raises StoreError."""
    if any(task.passing for task in plan.distinct):
        for key in plan.obsolete(store.finished()):
            store.drop(key)


# The run.


class UnfinishedError(StoreError):
    """A run ends before all is computed; the message has the reason. Finished results are kept."""


class ShortageError(NanoslipError, MemoryError):
    """A task needs more memory than this machine has, or all processes together do."""


# Tasks that were running when a whole run was killed: the next run computes them last. After a second time they have failed.

KILLED: Final = (
    "the whole run was killed while this task was computed: a bug or too little memory, in this task or another"
)


def blame(plan: Plan, store: Store, journal: Journal, into: Path) -> None:
    """Record tasks interrupted by the last run as failed, permanently at the second time."""
    keys = long_task_keys(into).difference(store.inventory())
    if keys:
        before = store.failures()
        for task in plan.tasks:
            failure = before.get(task.key)
            if task.key not in keys or (failure and failure.given_up):
                continue
            # Once a run may be killed for a reason that has nothing to do with its tasks: somebody ended it.
            second = failure is not None and failure.message == KILLED
            outcome = Outcome(Ending.CRASHED, KILLED)
            done = Done(task.key, outcome, 0.0, passing=not second)
            journal.failed(task, done, final=True)
    # Forgotten only now: a run that is killed while it notes failures leaves the list to the next one.
    with suppress(OSError):
        (into / BEGUN).unlink(missing_ok=True)


Warn = Callable[[str], object]
"""Called with a problem that stops nothing."""


class Ended(NamedTuple):
    """A run that has ended."""

    store: Store
    failed: int
    """Tasks that failed, or needed a failed task."""
    given_up: int
    """Tasks that were not tried, as they or their inputs had failed before."""


Show = Callable[[Rest, int, MeasuredTimes], AbstractContextManager[Watch]]
"""Called with the remaining tasks, the number of processes, and measured times; its context gives the observer to
which all tasks are shown."""


def compute_campaign(
    farm: Farm,
    plan: Plan,
    journal: Journal,
    lease: Lease,
    show: Show,
    warn: Warn,
    out: Path | None = None,
    **again: bool,
) -> Ended:
    """Compute all that is left of a plan in the leased folder of a journal, and have its results on disk.

    warn: called with each problem of the folder. out: the campaign's folder, where the journal's is that of a shard.
    again: `recompute_foreign`: results of other software count as unfinished; `retry`: try failed tasks again.
    Raises ShortageError, FarmError, StoreError if no result can be kept any more, UnfinishedError.
    """
    store = Store(journal.out)
    folder = out or journal.out
    rest = _remaining_tasks(plan, store, folder, journal, warn, **again)
    if rest.tasks:
        farm.load(len(rest.tasks))
    try:
        failed = _compute(farm, plan, store, folder, rest, journal, lease, show)
    except (StoreError, ShortageError, FarmError) as error:
        journal.end(INTERRUPTED if isinstance(error, UnfinishedError) else WRONG_INPUT)
        raise
    journal.end(FAILURES if failed or rest.given_up else 0)
    return Ended(store, failed, len(rest.given_up))


def _remaining_tasks(plan: Plan, store: Store, out: Path, journal: Journal, warn: Warn, **again: bool) -> Rest:
    """Remaining tasks of a plan, after merging existing shards. Requires the lease of the folder. Raises StoreError."""
    store.prepare()
    blame(plan, store, journal, journal.out)
    # A shard reads what was merged, too, in another folder than its own.
    if journal.out != out:
        merged = Store(out)
        failures = {**merged.failures(), **store.failures()}
        untried = keys_given_up(failures, again.get("retry", False))
        finished = skippable_tasks(plan, store.inventory(), merged.inventory(), untried)
    else:
        for problem in merge_shards(out):
            warn(problem)
        finished, failures = store.inventory(), dict(store.failures())
    return tasks_to_do(plan, failures, finished, **again)


def _compute(
    farm: Farm, plan: Plan, store: Store, out: Path, rest: Rest, journal: Journal, lease: Lease, show: Show
) -> int:
    """Compute the remaining tasks; returns how many tasks failed, or needed a failed task."""
    tasks = rest.tasks
    if short := shortages(plan, tasks, farm.here):
        raise ShortageError("\n".join(short))
    shown = show(rest, farm.size, read_task_times(journal.out, out))
    if tasks:
        # Kernels first, in one process: all others would compile the same ones at the same time.
        farm.run([WarmUp(miniatures(tasks))], Watch())
        journal.begin(farm.size, farm.unit)
    # Whatever ends the run from then on is no task: none may be blamed for it by the next run.
    farm.interruption.at_request = journal.forget
    with ExitStack() as stack:
        stack.callback(journal.forget)
        journal.show(stack.enter_context(shown))
        tally = farm.run(tasks, journal)
    journal.computed(tally)
    _check_whole(tally, lease)
    farm.settle()
    # Every process has its results on disk before any of them is looked for.
    store.settle()
    if missing := unseen(tasks, journal.undone, store):
        raise UnfinishedError(missing)
    if tasks:
        drop_intermediates(plan, store)
    return tally.crashed


def _check_whole(tally: RunTally, lease: Lease) -> None:
    """Raise UnfinishedError if a run was interrupted, StoreError if running again would fail in the same way."""
    lost = lease.look()
    if tally.halt:
        raise StoreError(f"{tally.halt}; what is finished is kept: run again to continue")
    if lost:
        raise UnfinishedError(lost)
    if tally.interrupted:
        tasks = f"{tally.outlasting} task{'' if tally.outlasting == 1 else 's'}"
        late = f"{tasks} left would outlast this job; " if tally.outlasting else ""
        raise UnfinishedError(f"interrupted: {late}what is finished is kept; run again to continue")


def unseen(tasks: Sequence[Task], undone: Collection[str], store: Store) -> str:
    """Report tasks, in a line, that were reported as done but whose results are not in the store; empty if all are.

    Waits for them as long as a network file system may show a folder as it was. undone: keys of tasks without a result.
    """
    missing: list[Task] = []
    for _ in looks():
        metas = store.metas()
        awaited = [task for task in tasks if task.key not in undone]
        missing = [task for task in awaited if task.key not in metas]
        if not missing:
            return ""
    first = f"{len(missing)} of {len(tasks)} results, first that of {missing[0].label} ({missing[0].key})"
    return f"{store.folder}: not there though they were computed: {first}; run again to continue"
