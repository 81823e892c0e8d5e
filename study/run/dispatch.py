"""Dynamic load balancing: ready tasks go in parcels to the rank with the least estimated work. Ranks are numbers here: no MPI."""

import heapq
import itertools
import math
import time as dispatch_time
import traceback
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from time import perf_counter, process_time, time
from typing import Any, Final, NamedTuple, Protocol

import numpy as np

from nanoslip.solver.outcome import UNDONE, Ending, Outcome, printable, quote_value
from nanoslip.solver.progress import watch_progress
from nanoslip.study.memory import is_shortage
from nanoslip.study.notices import print_notice


class Work(Protocol):
    """The attributes of a task that scheduling uses; `nanoslip.study.tasks.task.Task` has them."""

    @property
    def key(self) -> str:
        """Name of the task, different for each."""

    @property
    def kind(self) -> str:
        """One of nanoslip.study.tasks.kind.KINDS."""

    @property
    def needs(self) -> tuple[str, ...]:
        """Keys of the tasks that have to be finished before it."""

    @property
    def cost(self) -> float:
        """Estimated seconds on one core."""

    @property
    def limit(self) -> float:
        """Seconds after which it is taken to hang."""

    @property
    def label(self) -> str:
        """Text that messages and progress name the task by."""


class TaskQueue:
    """Tasks not yet handed out. Of the ready ones the first in the given order is next (a plan's: longest chain of work first).

    A need that is not among the tasks counts as finished.
    """

    def __init__(self, tasks: Sequence[Work]) -> None:
        self.tasks = {task.key: task for task in tasks}
        """Tasks by key: waiting tasks, and tasks that were taken and are not finished."""
        self.aside = 0
        """Number of tasks that were taken and set aside, now and for good."""
        self._places = {key: place for place, key in enumerate(self.tasks)}
        self._behind = itertools.count(len(tasks))
        # Task that has to wait -> its needs that are not finished.
        self._missing: dict[str, set[str]] = {}
        self._dependents: defaultdict[str, list[str]] = defaultdict(list)
        # A heap; a sorted list is one from the beginning.
        self._ready: list[tuple[int, str]] = []
        for task in tasks:
            needs = {need for need in task.needs if need in self.tasks}
            for need in needs:
                self._dependents[need].append(task.key)
            if needs:
                self._missing[task.key] = needs
            else:
                place = self._places[task.key]
                self._ready.append((place, task.key))

    def __len__(self) -> int:
        """Number of tasks in the queue, ready or not."""
        return len(self._ready) + len(self._missing) + self.aside

    @property
    def ready(self) -> int:
        """Number of tasks that could be handed out at once."""
        return len(self._ready)

    def take(self) -> Work:
        """Remove and return the next of the ready tasks, of which there is one."""
        return self.tasks[heapq.heappop(self._ready)[1]]

    def put_back(self, key: str) -> None:
        """Undo the taking of a task."""
        heapq.heappush(self._ready, (self._places[key], key))

    def put_last(self, key: str) -> None:
        """Put a taken task back, after all others."""
        self._places[key] = next(self._behind)
        self.put_back(key)

    def finish(self, key: str) -> Work:
        """Mark a taken task as finished, and return it: tasks that needed only this one become ready."""
        finished = self.tasks.pop(key)
        for dependent in self._dependents.pop(key, ()):
            missing = self._missing.get(dependent)
            # None of a dependent that was abandoned, as another of its needs failed.
            if missing is None:
                continue
            missing.remove(key)
            if not missing:
                del self._missing[dependent]
                self.put_back(dependent)
        return finished

    def abandon(self, key: str) -> list[Work]:
        """Remove a taken task, which will never finish; return all that need it, directly or through others, and go with it."""
        del self.tasks[key]
        lost: list[Work] = []
        for dependent in self._dependents.pop(key, ()):
            if self._missing.pop(dependent, None) is not None:
                lost.append(self.tasks[dependent])
                lost += self.abandon(dependent)
        return lost


# Times of tasks, from the estimate of each and the measured times of others of its kind.


class MeasuredTimes:
    """Measured over estimated times of finished tasks, kind by kind."""

    def __init__(self, *data: Mapping[str, Sequence[float]]) -> None:
        """data: kind -> number of tasks, seconds estimated, seconds measured; of several runs, which are added up."""
        self._sums: defaultdict[str, list[float]] = defaultdict(lambda: [0, 0.0, 0.0])
        for run in data:
            for kind, sums in run.items():
                pairs = zip(self._sums[kind], sums, strict=True)
                self._sums[kind] = [total + increment for total, increment in pairs]

    def learn(self, task: Work, seconds: float) -> None:
        """Note the seconds that an ended task took."""
        self._sums[task.kind][0] += 1
        self.learn_part(task, 1.0, seconds)

    def learn_part(self, task: Work, share: float, seconds: float) -> None:
        """Note the seconds that a share of a task took."""
        sums = self._sums[task.kind]
        sums[1] += share * task.cost
        sums[2] += seconds

    def as_data(self) -> dict[str, list[float]]:
        """The sums, as a journal holds them."""
        data = {}
        for kind, sums in self._sums.items():
            data[kind] = [round(total, 6) for total in sums]
        return data

    def factor(self, kind: str) -> float:
        """Measured over estimated seconds: of this kind, else of all kinds together; 1 where nothing is measured."""
        _, estimated, measured = self._sums.get(kind, (0, 0.0, 0.0))
        if not estimated:
            estimated = sum(sums[1] for sums in self._sums.values())
            measured = sum(sums[2] for sums in self._sums.values())
        return measured / estimated if estimated > 0.0 else 1.0

    def seconds(self, task: Work) -> float:
        """Expected seconds of a task."""
        return task.cost * self.factor(task.kind)

    def tasks(self, kinds: Collection[str]) -> int:
        """Number of measured tasks of these kinds; 0 unless there are some of each."""
        if not self._sums.keys() >= set(kinds):
            return 0
        return sum(int(self._sums[kind][0]) for kind in kinds)


# The state of a run: queued tasks, outcomes of finished ones, and measured seconds of each kind of task.

Execute = Callable[[Any], Outcome]
"""Function that computes a task and returns its outcome; its result is in the store then."""
Report = Callable[[Any, Outcome, float], None]
"""Callback: called with a task that has ended, how, and the seconds that it took."""

ATTEMPTS: Final = 2
"""Number of attempts at a task whose process dies: the cause may not be the task itself."""


LONGEST_TRACE: Final = 10_000
"""Letters of a traceback that are kept."""


class CannotGoOnError(Exception):
    """No task can finish (a full disk, for example); the message has the reason."""


class Worker(NamedTuple):
    """Process that computes."""

    rank: int
    host: str

    def __str__(self) -> str:
        return f"rank {self.rank} on {self.host}"


@dataclass(frozen=True, slots=True)
class Done:
    """Outcome and duration of a task; its result is in the store."""

    key: str
    outcome: Outcome
    seconds: float
    where: Worker | None = None
    """None for a task that no process has begun."""
    trace: str = ""
    """Traceback where it crashed."""
    again: bool = False
    """True for a failure that may end differently if it is tried again."""
    passing: bool = False
    """True for a failure of the machine, which may end differently in another run. Its process may be harmed (no file
    descriptor left, for example): another process continues."""
    died: bool = False
    """True for a failure that ended its process, perhaps after its result was kept."""
    halt: str = ""
    """Reason why the result could not be kept. After a second one, with no result between, no task can be finished any more."""
    processor: float = 0.0
    """Seconds of processor time; 0 if its process died."""

    def __post_init__(self) -> None:
        if self.trace:
            object.__setattr__(self, "trace", printable(self.trace, LONGEST_TRACE))


@dataclass(frozen=True, slots=True)
class Underway:
    """Progress of a task that is being computed."""

    key: str
    share: float
    """Share of it that is done, 0 to 1."""
    seconds: float
    """Seconds since it began."""
    processor: float
    """Seconds of processor time since then."""


Advance = Callable[[Underway], object]
"""Callback: called with the progress of a task."""


def ignore_progress(underway: Underway) -> None:
    """The callback of a process whose progress nobody watches."""


REPORT: Final = 1.0
"""Shortest time between two reports of a task's progress, and before the first, in s."""


def report_interval(ranks: int) -> float:
    """Shortest time between two reports of a rank, in s: all ranks' together are a tenth of the parcels that rank 0 can send."""
    return max(REPORT, 10.0 * INTERVAL * ranks)


class Watch:
    """Observer of computed tasks."""

    def __init__(self, report: Report = lambda *_: None) -> None:
        """report: called with each task that has ended."""
        self._report_end = report

    def begun(self, tasks: Sequence[tuple[Work, float]]) -> None:
        """Tasks are handed out. With each the seconds that it is expected to take; infinite while unknown."""

    def advanced(self, task: Any, underway: Underway) -> None:
        """A task that is being computed has advanced."""

    def ended(self, task: Any, outcome: Outcome, seconds: float) -> None:
        """A task has ended."""
        self._report_end(task, outcome, seconds)

    def failed(self, task: Any, done: Done, final: bool) -> None:
        """An attempt has failed. final: it is not tried again."""

    def kept(self, _key: str) -> Outcome | None:
        """Outcome of a task whose process has died, if its result is kept nevertheless."""
        return None


@dataclass(frozen=True, slots=True)
class RunTally:
    """Numbers of tasks done and failed, and whether tasks remain. halt: why no task could be finished any more.

    interrupted: by a signal, or because all remaining tasks would outlast the job (outlasting: their number).
    seconds, processor: elapsed and processor time of all tasks together. hosts: host -> processes that finished a task. None of
    them counts in comparisons.
    """

    done: int = 0
    crashed: int = 0
    interrupted: bool = False
    halt: str = ""
    outlasting: int = 0
    seconds: float = field(default=0.0, compare=False)
    hosts: Mapping[str, int] = field(default_factory=dict, compare=False)
    processor: float = field(default=0.0, compare=False)


def attempt(
    execute: Execute,
    task: Work,
    where: Worker,
    survive: type[BaseException] | tuple[type[BaseException], ...] = Exception,
    advance: Advance = ignore_progress,
) -> Done:
    """Compute one task. An exception (a defect, never physics) becomes the outcome `crashed`, with its place and traceback.

    survive: exceptions that become outcomes; others are raised. advance: called with its progress, at most once in REPORT.
    """
    start = perf_counter()
    start_of_processor = process_time()
    due = REPORT

    def report(share: float) -> None:
        nonlocal due
        seconds = perf_counter() - start
        if seconds >= due:
            due = seconds + REPORT
            advance(Underway(task.key, share, seconds, process_time() - start_of_processor))

    def finish(outcome: Outcome, **more: Any) -> Done:
        processor = process_time() - start_of_processor
        seconds = perf_counter() - start
        return Done(task.key, outcome, seconds, where, processor=processor, **more)

    try:
        with watch_progress(report):
            outcome = execute(task)
        if not isinstance(outcome, Outcome):
            raise TypeError(f"it returned {quote_value(outcome)}, no outcome")
    except CannotGoOnError as error:
        refused = Outcome(Ending.CRASHED, str(error))
        return finish(refused, passing=True, halt=refused.message)
    except survive as error:
        # An error of the machine may be over next time, one of the program is not.
        shortage = is_shortage(error)
        machine = shortage or isinstance(error, OSError)
        ending = Ending.OUT_OF_MEMORY if shortage else Ending.CRASHED
        # Of any exception, also of one whose `str` raises.
        message = "".join(traceback.format_exception_only(error))
        failed = Outcome(ending, message, cause=type(error).__name__)
        trace = traceback.format_exc()
        return finish(failed, trace=trace, again=machine, passing=machine)
    machine = outcome.ending is Ending.OUT_OF_MEMORY
    return finish(outcome, again=machine, passing=machine)


def print_failure(task: Work, done: Done) -> None:
    """Print on standard error that an attempt has failed, at once."""
    ending, message = done.outcome.ending, done.outcome.message
    if ending in UNDONE and not done.halt:
        # The trace of an exception ends with its message.
        why = "" if done.trace and not done.died else f": {message}"
        print_notice(f"{done.where}: {task.label} {UNDONE[ending]}{why}\n{done.trace}")


LEAST_TASK_SECONDS: Final = 1e-3
"""Lower bound of a task's expected seconds: its files and messages, however little it computes."""


class Ledger:
    """Counts tasks taken from the queue and tasks finished, and reports each end."""

    def __init__(self, tasks: Sequence[Work], watch: Watch, until: float = math.inf) -> None:
        """until: when all tasks have to have ended, in seconds since the epoch."""
        self.queue = TaskQueue(tasks)
        self.halt = ""
        self._watch, self._until = watch, until
        self._away = 0
        self._done = 0
        self._crashed = 0
        self._failed: Counter[str] = Counter()
        self._refused: set[str] = set()
        # True if a result was kept since the last one that could not be.
        self._kept = True
        self._measured = MeasuredTimes()
        self._seconds = 0.0
        self._processor = 0.0
        self._hosts: set[Worker] = set()

    @property
    def unfinished(self) -> bool:
        """True if a task is being computed or can be."""
        return self._away + self.queue.ready > 0

    def take(self, most: int, room: float, at_least_one: bool) -> list[tuple[Work, float]]:
        """Take the next tasks, at most `most`, expected to take `room` seconds together; with the seconds of each.

        at_least_one: take the first task however long it is. Tasks expected to exceed the deadline are skipped in
        this run. A task of unknown duration is tried; otherwise a task longer than any job would never run.
        """
        seconds_left = math.inf
        if self._until < math.inf:
            seconds_left = self._until - time()
        chosen: list[tuple[Work, float]] = []
        while self.queue.ready and len(chosen) < most:
            task = self.queue.take()
            seconds = self.estimate_seconds(task)
            if seconds_left < seconds < math.inf:
                self.queue.aside += 1
            elif seconds <= room or (at_least_one and not chosen):
                chosen.append((task, seconds))
                room -= seconds
            else:
                self.queue.put_back(task.key)
                break
        self._away += len(chosen)
        if chosen:
            self._watch.begun(chosen)
        return chosen

    def estimate_seconds(self, task: Work) -> float:
        """Estimated seconds of this task, scaled by the measured times of its kind; infinite before one has ended."""
        if not self._measured.tasks((task.kind,)):
            return math.inf
        return max(self._measured.seconds(task), LEAST_TASK_SECONDS)

    def advance(self, underway: Underway) -> None:
        """Pass on the progress of a task; a report that arrives after the task's end is dropped."""
        task = self.queue.tasks.get(underway.key)
        if task is not None:
            self._watch.advanced(task, underway)

    def give_back(self, keys: Iterable[str]) -> None:
        """Put taken tasks that have not begun back into the queue."""
        for key in keys:
            self._away -= 1
            self.queue.put_back(key)

    def enter(self, done: Done) -> None:
        """Record the end of a taken task; tasks that need a failed task are abandoned."""
        if done.halt and not self._refuses(done):
            return
        if done.died:
            # A process may die between keeping a result and reporting it: the result counts.
            outcome = self._watch.kept(done.key)
            if outcome:
                done = replace(done, outcome=outcome)
        self._away -= 1
        self._seconds += done.seconds
        self._processor += done.processor
        if done.where:
            self._hosts.add(done.where)
        if done.halt or done.outcome.ending in UNDONE:
            self._fail(done)
        else:
            self._kept = True
            self._done += 1
            task = self.queue.finish(done.key)
            self._measured.learn(task, done.seconds)
            self._watch.ended(task, done.outcome, done.seconds)

    def _refuses(self, done: Done) -> bool:
        """Decide if the task is at fault for a result that could not be kept: others are kept; else no more can be."""
        again, kept = done.key in self._refused, self._kept
        self._refused.add(done.key)
        self._kept = False
        # Others were kept since, and this one is refused once more: it is at fault, not the disk.
        if kept and again:
            return True
        self._away -= 1
        if kept:
            self.queue.put_last(done.key)
        else:
            self.halt = done.halt
            self.queue.put_back(done.key)
        return False

    def _fail(self, done: Done) -> None:
        task = self.queue.tasks[done.key]
        self._failed[done.key] += 1
        last = not done.again or self._failed[done.key] >= ATTEMPTS
        self._watch.failed(task, done, last)
        if not last:
            self.queue.put_last(done.key)
            return
        waiting = self.queue.abandon(done.key)
        self._crashed += 1 + len(waiting)
        self._watch.ended(task, done.outcome, done.seconds)
        lost = Outcome(Ending.NEEDS_FAILED, f"{task.label} {UNDONE[done.outcome.ending]}")
        for dependent in waiting:
            self._watch.ended(dependent, lost, 0.0)

    def tally(self, interrupted: bool) -> RunTally:
        """The counts so far. A signal that came after the last task interrupted nothing."""
        is_unfinished = len(self.queue) + self._away > 0
        stopped = is_unfinished and not self.halt and (interrupted or self.queue.aside > 0)
        hosts = Counter(place.host for place in self._hosts)
        return RunTally(
            self._done, self._crashed, stopped, self.halt, self.queue.aside, self._seconds, hosts, self._processor
        )


LOOKAHEAD: Final = 0.2
"""Seconds of work that may wait at a rank beyond the task it computes, of few ranks: hides the latency of messages."""

INTERVAL: Final = 5e-4
"""Seconds between two parcels, of all ranks together: messages then cost rank 0 less than the tasks in them."""

STRANDED: Final = 1.0
"""Seconds (or twice the lookahead) without news from a rank after which the tasks that wait there are handed out again."""

PARCELS: Final = 2
"""Fewest parcels of each rank's share of the ready tasks: towards the end they become smaller."""

REFILL: Final = 0.75
"""Share of the lookahead from which on a rank is not given more: one task at a time would be a message each."""


def lookahead(ranks: int) -> float:
    """Seconds of work that may wait at each of this number of ranks."""
    return max(LOOKAHEAD, INTERVAL * ranks)


class Dispatcher:
    """Tasks given to each rank and not reported yet."""

    def __init__(self, ranks: int, ledger: Ledger, give: Callable[[int, list[Any]], object]) -> None:
        """give: sends a list of tasks to a rank."""
        self._ledger, self._give = ledger, give
        self._lookahead = lookahead(ranks)
        # Rank by rank: key -> expected seconds.
        self._doing: list[dict[str, float]] = [{} for _ in range(ranks)]
        self._load = np.zeros(ranks)
        # Time of the last news of each rank that computes.
        self._heard = np.zeros(ranks)
        self._next_look = 0.0

    @property
    def busy(self) -> bool:
        """True if any rank has a task that it has not reported."""
        return any(self._doing)

    def hand_out(self) -> None:
        """Send ready tasks to the least loaded rank while it is idle or will be within the lookahead."""
        parcels: dict[int, list[Any]] = defaultdict(list)
        enough = REFILL * self._lookahead
        while True:
            rank = int(self._load.argmin())
            # If the least loaded rank has enough, all have.
            if not self._load[rank] < enough:
                break
            tasks = self._parcel(rank)
            if not tasks:
                break
            parcels[rank] += tasks
        # One message a rank, whatever number of parcels it has got.
        for rank, tasks in parcels.items():
            self._give(rank, tasks)

    def take_back(self, rank: int, keys: Collection[str]) -> None:
        """Note that a rank has reported or given back the tasks of these keys."""
        if keys:
            doing = self._doing[rank]
            seconds = sum(map(doing.pop, keys))
            self._heard[rank] = dispatch_time.monotonic()
            # Exactly nothing where nothing is left, whatever was rounded, and infinite while unknown.
            self._load[rank] = self._load[rank] - seconds if doing else 0.0

    def find_stranded(self) -> list[int]:
        """Ranks whose task takes much longer than expected, so that waiting tasks should move to other ranks; none twice."""
        now = dispatch_time.monotonic()
        if now < self._next_look:
            return []
        # A look at all ranks takes time, which messages wait for.
        self._next_look = now + 0.1 * STRANDED
        patience = max(STRANDED, 2.0 * self._lookahead)
        late = np.flatnonzero(self._heard < now - patience).tolist()
        stranded = [rank for rank in late if len(self._doing[rank]) > 1]
        # Nothing more for these ranks until they are idle.
        self._load[stranded] = self._heard[stranded] = math.inf
        return stranded

    def _parcel(self, rank: int) -> list[Any]:
        """Take the next tasks for a rank: one if it is idle, and more while they are short and enough are left for others.

        Nothing where no task is ready, or the rank has enough to do.
        """
        doing, ledger = self._doing[rank], self._ledger
        if not doing:
            self._heard[rank] = dispatch_time.monotonic()
        share = ledger.queue.ready // (PARCELS * len(self._load))
        room = self._lookahead - self._load[rank]
        chosen = ledger.take(max(share, 1), room, at_least_one=not doing)
        doing |= ((task.key, seconds) for task, seconds in chosen)
        self._load[rank] += sum(seconds for _, seconds in chosen)
        return [task for task, _ in chosen]
