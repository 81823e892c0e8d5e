"""Plan tasks of cases: each distinct computation once, needed ones before their dependents, longest chain first.

And what to expect of them before a run: validity flags, lengths of records, memory.
"""

import functools
import heapq
import math
import operator
import os
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Final, NamedTuple, TypeVar

import numpy as np

from nanoslip.solver.case import Case
from nanoslip.solver.drive import DURATIONS, FEWER_STEPS, TRAVEL, Drive
from nanoslip.solver.outcome import UNDONE, Ending, Outcome
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.validity import FLAGS, expected_flags, mask_of
from nanoslip.study.manifest.cases import CampaignCase, Heard, expand
from nanoslip.study.manifest.manifest import CampaignDrive, Manifest, NamedDrive
from nanoslip.study.manifest.parameters import in_words
from nanoslip.study.origin import Origins, foreign_among
from nanoslip.study.plan.cost import (
    drive_duration,
    drive_steps,
    estimate,
    expected_displacement,
    least_plateau,
    path_length,
    record_bytes,
)
from nanoslip.study.plan.kinds import KINDS, Wanted, compliance_needs, in_stages, needed_kinds
from nanoslip.study.plan.task import PENDING, Label, Task, TaskResult, short

Some = TypeVar("Some")

# The tasks of each case.


CaseTasks = Mapping[tuple[str, str], str]
"""Kind of task and label of its drive ("" without one) -> key, in the order of stages; nothing of a case that is refused."""


# The order of tasks: needed ones before those that need them, longest chain of work first.


def longest_chain_first(tasks: Iterable[Task]) -> tuple[Task, ...]:
    """Order by the cost of a task plus the longest chain that depends on it, so inputs precede their dependents."""
    ordered = list(in_stages(tasks))
    after: dict[str, float] = {}  # work of the longest chain that hangs on a task, of those that are needed
    # One pass from the last stage back sees every chain whole.
    for task in reversed(ordered):
        for need in task.needs:
            after[need] = max(after.get(need, 0.0), task.cost + after.get(task.key, 0.0))
    ordered.sort(key=lambda task: -task.cost - after.get(task.key, 0.0))
    return tuple(ordered)


def evenly(found: Sequence[Some], count: int) -> list[Some]:
    """Select `count` items of a sequence, or all, evenly spread from the first to the last."""
    places = np.linspace(0, len(found) - 1, min(count, len(found))).round().astype(int)
    return [found[place] for place in places]


DOUBT: Final = 100.0
"""Factor over the estimated time at which a task counts as hanging; the worst known estimates are 30 times off."""
LEAST_LIMIT: Final = 600.0
"""Seconds that every task may take."""


@dataclass(frozen=True)
class Plan:
    """Whole work of a campaign, finished or not. Tasks are estimated on request."""

    manifest: Manifest
    cases: tuple[CampaignCase, ...]
    distinct: tuple[Task, ...]
    """Each distinct task once, needs first, not estimated."""
    case_tasks: Mapping[str, CaseTasks]
    """case_id -> its tasks."""

    @cached_property
    def tasks(self) -> tuple[Task, ...]:
        """All tasks, estimated: needs first, then the longest chain of work first."""
        return longest_chain_first(map(self._estimated, self.distinct))

    def remaining(self, finished: Collection[str]) -> tuple[Task, ...]:
        """Tasks still to do, estimated and in order, given the keys that are finished.

        Intermediate results are recomputed only if an unfinished task needs them.
        """
        left = self._left(finished)
        return longest_chain_first(map(self._estimated, left)) if len(left) < len(self.distinct) else self.tasks

    @cached_property
    def _estimates(self) -> dict[str, Task]:
        return {}

    def _estimated(self, task: Task) -> Task:
        found = self._estimates.get(task.key)
        if found is None:
            cost, memory, disk = estimate(task)
            limit = self.manifest.task_seconds
            limit = max(LEAST_LIMIT, DOUBT * cost) if limit is None else limit
            found = self._estimates[task.key] = task.planned((task.names, task.values), cost, memory, disk, limit)
        return found

    def _left(self, finished: Collection[str]) -> list[Task]:
        needed: set[str] = set()
        left = []
        for task in reversed(self.distinct):  # from the ends of the chains to their beginnings
            if task.key not in finished and (not task.intermediate or task.key in needed):
                needed.update(task.needs)
                left.append(task)
        return left[::-1]

    def possible(
        self, left: Sequence[Task], given_up: Collection[str], failed: Collection[str] = ()
    ) -> tuple[Task, ...]:
        """Unfinished tasks that can be tried: neither they nor their needs are given up. Those that failed before come last."""
        if not given_up and not failed:
            return tuple(left)
        lost = set(given_up)
        for task in in_stages(left):
            if not lost.isdisjoint(task.needs):
                lost.add(task.key)
        return tuple(sorted((task for task in left if task.key not in lost), key=lambda task: task.key in failed))

    def outcomes(self, finished: Mapping[str, Outcome], failed: Mapping[str, Outcome]) -> dict[str, Outcome]:
        """Outcomes of tasks, including those that cannot start because an input failed.

        finished: of the results that are there, which count more than failures. failed: of attempts.
        """
        found = {key: outcome for key, outcome in failed.items() if key not in finished}
        tasks = {task.key: task for task in self.distinct} if found else {}
        for task in self.distinct if found else ():
            lost = next((need for need in task.needs if need in found), None)
            if lost is None or task.key in finished or task.key in found:
                continue
            outcome, need = found[lost], tasks[lost]
            message = f"its {need.kind} {UNDONE.get(outcome.ending, 'failed')}: {outcome.message}"
            cause = outcome.cause and f"{need.kind} {outcome.ending} {outcome.cause}"
            own = need.kind == task.kind  # the scalars of a record
            found[task.key] = outcome if own else Outcome(Ending.NEEDS_FAILED, message, cause=cause)
        return found | dict(finished)

    def foreign(self, finished: Mapping[str, Origins]) -> dict[str, Origins]:
        """The plan's results that other software than this had a hand in, given all that are finished."""
        return foreign_among({task.key: finished[task.key] for task in self.distinct if task.key in finished})

    @cached_property
    def _needs(self) -> dict[str, tuple[str, ...]]:
        return {task.key: task.needs for task in self.distinct}

    def with_needs(self, keys: Iterable[str]) -> set[str]:
        """Keys of these tasks and of all tasks that they need."""
        found, waiting = set[str](), [*keys]
        while waiting:
            key = waiting.pop()
            if key not in found:
                found.add(key)
                waiting += self._needs[key]
        return found

    def obsolete(self, finished: Collection[str]) -> tuple[str, ...]:
        """Intermediate results that no task needs any more, given the keys that are finished."""
        ended = [task.key for task in self.distinct if task.passing and task.key in finished]
        wanted = {need for task in self._left(finished) for need in task.needs} if ended else set()
        return tuple(key for key in ended if key not in wanted)


def make_plan(manifest: Manifest, heard: Heard = lambda _: None) -> Plan:
    """Plan all computations of a campaign. Raises ManifestError if two cases are the same.

    heard: called with the number of cases.
    """
    return plan_of(manifest, expand(manifest), heard)


def plan_of(manifest: Manifest, cases: Sequence[CampaignCase], heard: Heard = lambda _: None) -> Plan:
    """The plan of some cases of a manifest."""
    kinds = [kind for kind in KINDS.values() if kind.needed(manifest)]
    tasks, case_tasks = dict[str, Task](), dict[str, CaseTasks]()
    for number, case in enumerate(cases, 1):
        wanted = [each for kind in kinds for each in kind.tasks(case.case, manifest)] if case.case else []
        for each in wanted:
            if each.task.key not in tasks:
                tasks[each.task.key] = each.task.planned(_label(each, case))
        case_tasks[case.case_id] = {(each.task.kind, each.drive): each.task.key for each in wanted if not each.part}
        heard(number)
    return Plan(manifest, tuple(cases), tuple(in_stages(tasks.values())), case_tasks)


def _label(wanted: Wanted, campaign_case: CampaignCase) -> Label:
    names, values = campaign_case.labels.names, campaign_case.values
    if wanted.drive:
        return (*names, "drive"), (*values, wanted.drive)
    if wanted.task.case is not None:
        return names, values
    of_slab = wanted.task.slab.flat
    given = dict(zip(names, values, strict=True))
    found = {"n_x": wanted.task.slab.n_x, **{name: given[name] for name in names if of_slab.get(name) is not None}}
    return tuple(found), tuple(found.values())


# Progress of a plan: its tasks by kind, and outcomes of its cases and drives, from those of their tasks.

NOTHING_KNOWN: Final = (PENDING, *(ending.value for ending in UNDONE), Ending.NEEDS_FAILED.value)
"""Outcomes of the machine, not of the physics: pending, out of time, out of memory, crashed, or waiting for such a task."""


def after(kind: str, outcome: Outcome | None, found: Outcome | None) -> Outcome | None:
    """Combine the outcome of a case with the outcome of one more task, of this kind.

    outcome: how it ended up to there. found: how the task did. None: not yet.
    """
    if outcome is None or not outcome.usable:
        return outcome
    if found is None:
        return outcome if kind == "compliance" else None  # it is intermediate: once used it may go without being missed
    return outcome if found.usable and not outcome.ok else found


def as_its_case(found: Outcome | None) -> bool:
    """True if a drive ended as its case did, given the outcome of its task."""
    return found is not None and found.ending is Ending.NEEDS_FAILED


def case_outcome(plan: Plan, case: CampaignCase, outcomes: Mapping[str, Outcome]) -> Outcome | None:
    """Outcome of a case up to its friction record: the first failure, else the missing numbers; None while unfinished.

    outcomes: key of each finished task -> how it ended.
    """
    outcome: Outcome | None = case.outcome
    for (kind, drive), key in plan.case_tasks[case.case_id].items():
        if not drive:
            outcome = after(kind, outcome, outcomes.get(key))
    return outcome


def drive_outcome(
    plan: Plan, case: CampaignCase, drive: CampaignDrive, outcomes: Mapping[str, Outcome]
) -> Outcome | None:
    """Outcome of a drive: that of its case if there is no record to be driven over, else its own; None while unfinished."""
    if case.case is None or drive.drive is None:
        return case.outcome if case.case is None else drive.outcome
    found = outcomes.get(plan.case_tasks[case.case_id].get(("drive", drive.label), ""))
    return case_outcome(plan, case, outcomes) if as_its_case(found) else found and found.naming(key_of_duration(drive))


def key_of_duration(drive: CampaignDrive) -> str:
    """The key by which a drive's table gives its duration, for advice."""
    given = (name for name in DURATIONS if name in drive.given and drive.settings[name] is not None)
    return next(given, "duration, now auto")


def ended(plan: Plan, outcomes: Mapping[str, Outcome]) -> tuple[Counter[str], Counter[str]]:
    """Count cases, and drives, by outcome: ending or `pending` -> count.

    outcomes: key of each finished task -> how it ended.
    """
    drives = plan.manifest.drives if "dynamics" in plan.manifest.stages else ()
    cases = Counter(_word(case_outcome(plan, case, outcomes)) for case in plan.cases)
    return cases, Counter(_word(drive_outcome(plan, case, each, outcomes)) for case in plan.cases for each in drives)


def _word(outcome: Outcome | None) -> str:
    return outcome.ending.value if outcome else PENDING


@dataclass(frozen=True, slots=True)
class KindCount:
    """Tasks of one kind: their number and costs."""

    all: int
    finished: int
    left: int
    given_up: int
    core_seconds_left: float
    memory_bytes: float
    """Memory of the largest task."""
    disk_bytes: float
    """Disk space of all tasks."""


def kind_counts(tasks: Iterable[Task], left: Iterable[Task], given_up: Iterable[Task]) -> dict[str, KindCount]:
    """Kind of task -> count and costs, in the order of stages; without bytes where `tasks` are not estimated."""
    lost, tried = Counter(task.kind for task in given_up), Counter[str]()
    seconds: defaultdict[str, float] = defaultdict(float)
    for task in left:
        tried[task.kind] += 1
        seconds[task.kind] += task.cost
    every: defaultdict[str, list[Task]] = defaultdict(list)
    for task in tasks:
        every[task.kind].append(task)
    found = {}
    for kind in filter(every.get, KINDS):
        its = every[kind]
        rest, memory, disk = tried[kind] + lost[kind], max(task.memory for task in its), sum(task.disk for task in its)
        found[kind] = KindCount(len(its), len(its) - rest, tried[kind], lost[kind], seconds[kind], memory, disk)
    return found


# Disk space of a campaign: files of results, and the dataset made of those that it keeps.

DATASET = 1.5e5
"""Bytes of a dataset without arrays: its variables and their descriptions."""
PACKED = 0.6
"""Share of an array's bytes that is left in the dataset, which is compressed."""


def disk_of_plan(plan: Plan) -> tuple[float, float]:
    """Bytes of all results, intermediate ones included, and of the dataset: to a factor of two or three."""
    kept = sum(task.disk for task in plan.tasks if not task.intermediate)
    return sum(task.disk for task in plan.tasks), DATASET + PACKED * kept


# Expectations before a run.


class Outlook(NamedTuple):
    """Expected flags of the cases, and lengths of their records."""

    masks: Sequence[int]
    """Flags of every case, as bits; none of a refused one."""
    shortest: float
    """Record in node spacings; infinite if nothing slides."""
    longest: float


def outlook_of(plan: Plan) -> Outlook:
    """The outlook of a plan."""
    kinds, masks, spans = needed_kinds(plan.manifest), list[int](), list[float]()
    for case in (each.case for each in plan.cases):
        displacement = 0.0
        if case and "record" in kinds and case.intrinsic_friction > 0.0:
            displacement = expected_displacement(case)
            spans.append(displacement / case.slab.spacing)
        if case and case.path:
            displacement = max(displacement, path_length(case)[-1])
        masks.append(mask_of(expected_flags(case, displacement)) if case else 0)
    return Outlook(masks, min(spans, default=math.inf), max(spans, default=0.0))


# Validity flags of a campaign's cases in words: one line for each flag, on the terminal and in the report.

_OF_CONTACTS = ("contact", "record", "path")
"""Kinds of task whose results have flags."""


def flag_lines(masks: Sequence[int], words: Callable[[int], str]) -> dict[str, str]:
    """Lines about the flags that any case has, by flag: number of cases, the first one, meaning and advice.

    masks: the flags of every case, as bits. words: a case's number -> what tells it from the others, empty for a single case.
    """
    lines = {}
    for flag in FLAGS:
        having = [number for number, mask in enumerate(masks) if mask & flag.mask]
        if having:
            first = words(having[0])
            where = f"{len(having)} of {len(masks)} cases" + (f", first {first}" if first else "")
            lines[flag.name] = f"{flag.name}: {where}: {flag.meaning}; {flag.advice}"
    return lines


def flags_of(case: Case, result: TaskResult) -> int | None:
    """The flags that any member's contact or record has, as bits; where no contact was reached, those to be expected of it.

    None for other kinds of results.
    """
    if result.kind not in _OF_CONTACTS:
        return None
    reached = [
        int(flags)
        for flags, width in zip(
            *(result.scalars.get(name, ()) for name in ("validity_flags", "contact_half_width")), strict=True
        )
        if not math.isnan(width)
    ]
    return functools.reduce(operator.or_, reached) if reached else mask_of(expected_flags(case))


def expected_lines(plan: Plan, outlook: Outlook) -> list[str]:
    """Expected flags of a plan's cases before a run, refused cases excluded."""
    return [*flag_lines(outlook.masks, partial(_words, plan)).values(), *out_of_reach(plan).values()]


def _words(plan: Plan, number: int) -> str:
    """Number of a case -> the parameters in which it differs from the others."""
    point = plan.cases[number].parameters
    varying = (name for name, values in plan.manifest.axes.items() if len(values) > 1 and name in point)
    return in_words({name: short(point[name]) for name in varying})


def out_of_reach(plan: Plan) -> dict[str, str]:
    """Lines about drives that never pull as hard as friction holds, and that need more segments than step_limit, by cause."""
    found = {"duration": _too_short(plan), "step_limit": _too_many_steps(plan)}
    return {cause: line for cause, line in found.items() if line}


def _too_short(plan: Plan) -> str:
    """Report drives that are too short to slide. The smallest plateau counts, which holds to spreads of 3. Without a duration
    a drive lasts while its stage moves."""
    manifest = plan.manifest
    drives = [(drive, drive.drive) for drive in manifest.drives if drive.drive is not None]
    cases = [(number, each.case) for number, each in enumerate(plan.cases) if each.case is not None]
    if not (drives and cases):
        return ""
    weight = np.array([case.total_load * manifest.scales.force for _, case in cases])
    share = np.array([least_plateau(case) for _, case in cases])
    pace = np.array([named.in_si.spring_stiffness * named.in_si.stage_velocity for _, named in drives])
    damper = np.array([_damper(named) for _, named in drives])
    lasts = [named.in_si.duration or math.inf for _, named in drives]
    pull = np.array([rate * time if rate else 0.0 for rate, time in zip(pace, lasts, strict=True)]) + damper
    low = np.isfinite(share)[:, None] & (pull < (weight * share)[:, None])
    if not low.any():
        return ""
    number, which = divmod(int(low.argmax()), len(drives))
    drive, named = drives[which]
    needed = max(weight[number] * share[number] - damper[which], 0.0) / pace[which] if pace[which] else math.inf
    key, amount, unit = ("duration", needed, "s")
    if TRAVEL in drive.given:
        key, amount, unit = (TRAVEL, needed * named.in_si.stage_velocity, "m")
    advice = (
        f"needs {key} ≥ {_up(amount):.2g} {unit}"
        if math.isfinite(needed)
        else "the stage is at rest: raise stage_velocity"
    )
    reached = f"reaches F/W = {pull[which] / weight[number]:.2g}, slips near {share[number]:.2g}"
    where = ", ".join(filter(None, [_words(plan, cases[number][0]), drive.label]))
    return f"too short to slip: {low.sum()} of {low.size} drives, first {where}: {reached}: {advice}"


_LOOKED_AT: Final = 1000
"""Drives that are looked at, of a campaign of millions."""


def _driven(plan: Plan) -> Iterator[tuple[int, Case, CampaignDrive, Drive]]:
    """Number of a case, the case, and a drive in SI and dimensionless: some drives of some cases, spread over all."""
    scales, drives = plan.manifest.scales, plan.manifest.drives
    some = drives[:: max(1, len(drives) // _LOOKED_AT)]
    known = [(one, one.drive.dimensionless(scales)) for one in some if one.drive]
    for number in range(0, len(plan.cases), max(1, len(plan.cases) * len(known) // _LOOKED_AT)):
        if (
            case := plan.cases[number].case
        ) is not None and case.intrinsic_friction > 0.0:  # without friction nothing slips
            yield from ((number, case, *each) for each in known)


def _too_many_steps(plan: Plan) -> str:
    driven = [each for each in _driven(plan) if each[-1].max_slips is None]
    steps = np.array([drive_steps(drive, case) for _, case, _, drive in driven])
    many = steps > [drive.step_limit for *_, drive in driven]
    if not many.any():
        return ""
    number, _, named, _ = driven[int(np.where(many, steps, 0.0).argmax())]
    where = ", ".join(filter(None, [_words(plan, number), named.label]))
    needs = f"needs about {steps[many].max():.1g} segments (to a factor of 5): {FEWER_STEPS}"
    return f"may end at step_limit: {many.sum()} of {many.size} drives looked at, worst {where}: {needs}"


def duration_lines(plan: Plan) -> list[str]:
    """Expected duration of drives without one, over all cases, as a line; none if all have one."""
    drives, time = plan.manifest.drives, plan.manifest.scales.time
    times = [
        drive_duration(drive, case) * time(named.drive.pin_mass)
        for _, case, named, drive in _driven(plan)
        if named.drive and drive.duration is None
    ]
    if not times:
        return []
    count = sum(each.drive is not None and each.drive.in_si.duration is None for each in drives)
    low, high = f"{min(times):.2g}", f"{max(times):.2g}"
    span = low if low == high else f"{low} to {high}"
    return [
        f"duration: auto (drives: {count} of {len(drives)}), to the first slip and as many cycles as the "
        f"numbers need: about {span} s (in the dataset: end_time)"
    ]


def _up(value: float) -> float:
    """The next number of two digits."""
    digit = 10.0 ** (math.floor(math.log10(value)) - 1) if value > 0.0 else 1.0
    return math.ceil(value / digit) * digit


def _damper(drive: NamedDrive) -> float:
    """Force of the damper on a pin at rest, in N."""
    values = drive.in_si
    return 2.0 * values.damping_ratio * math.sqrt(drive.pin_mass * values.spring_stiffness) * values.stage_velocity


# Lengths of a plan's records in node spacings, after which the surface repeats.


def span_line(outlook: Outlook) -> str:
    """The number of node spacings that the records will span; empty if nothing slides."""
    if math.isinf(outlook.shortest):
        return ""
    low, high = f"{outlook.shortest:.2g}", f"{outlook.longest:.2g}"
    span = low if low == high else f"{low} to {high}"
    return f"each record slides the pin over about {span} node spacings (to a factor of 3); the surface repeats every spacing"


# Memory of tasks beside that of the machine that is to compute them: it depends on the machine, so it is no case's outcome.

PROGRAM = 2e8
"""Bytes of a process that has computed nothing yet."""
NAMED = 5
"""Tasks that are named where many do not fit."""


def machine_memory() -> float:
    """Bytes of physical memory of this machine; infinite if the system does not report it."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * float(os.sysconf("SC_PHYS_PAGES"))
    except (ValueError, OSError, AttributeError):
        return math.inf


def shortages(planned: Plan, tasks: Sequence[Task], ranks: int = 1) -> tuple[str, ...]:
    """Report each of these tasks that exceeds this machine's memory, the worst first. If there is none, report if the
    largest ones together do, one for each rank. Empty if all fit."""
    there, path = machine_memory(), planned.manifest.path
    worst = heapq.nlargest(max(NAMED, ranks), tasks, key=need_of)
    if not worst or need_of(*worst[:ranks]) <= there:
        return ()
    if need_of(worst[0]) <= there:
        fitting = max(count for count in range(1, ranks) if need_of(*worst[:count]) <= there)
        need, advice = need_of(*worst[:ranks]), f"start at most {fitting}, or use more machines"
        return (f"{path}: {ranks} ranks on one machine: {_in_gigabytes(need, there)}: {advice}",)
    large = sum(need_of(task) > there for task in tasks)
    named = worst[: min(large, NAMED)]
    lines = [f"{path}: {_named(task)}: {_in_gigabytes(need_of(task), there)}: {_advice(task)}" for task in named]
    if large > NAMED:
        lines.append(f"{path}: {large - NAMED} more tasks need more memory than this machine has")
    return tuple(lines)


def need_of(*tasks: Task) -> float:
    """Bytes for processes with one task of a plan each; tasks that read the same compliance share one copy."""
    read = {task.slab for task in tasks if task.needs[:1] == compliance_needs(task.slab)}
    return sum(map(_map_bytes, read)) + sum(PROGRAM + task.memory for task in tasks)


def _map_bytes(slab: Slab) -> float:
    return 0.0 if slab.scheme.endless else 8.0 * (2.0 * slab.n_x) ** 2


def _named(task: Task) -> str:
    """The task by its label, and the size that decides."""
    size = f"n_x={task.slab.n_x}"
    return task.label if size in task.label.split() else f"{task.label} {size}"


def _in_gigabytes(need: float, there: float) -> str:
    return f"needs about {need / 1e9:.3g} GB of memory, this machine has {there / 1e9:.3g} GB"


def _advice(task: Task) -> str:
    if (
        task.kind == "record"
        and task.case is not None
        and task.ensemble.likely * record_bytes(task.case) > task.memory / 2.0
    ):
        return "use fewer limits.events, a shorter limits.displacement, or a machine with more memory"
    return "use a smaller n_x, or a machine with more memory"
