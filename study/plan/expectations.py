"""Expectations before a run: disk space, validity flags, drives that are too short, lengths of records, memory."""

import heapq
import math
import os
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.case import Case, limits_shear
from nanoslip.solver.contact.soundness import DOWNHILL
from nanoslip.solver.drive import FEWER_RESTS, FEWER_STEPS, TRAVEL, Drive
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.plateau import FEWEST_EVENTS
from nanoslip.solver.sliding.record import RUN_IN
from nanoslip.solver.sliding.validity import (
    FLAGS,
    Flag,
    encode_flags,
    guess_half_width,
    least_plateau,
    may_create_energy,
    predict_flags,
)
from nanoslip.study.manifest.manifest import CampaignDrive, NamedDrive
from nanoslip.study.manifest.parameters import parameters_text, si_text, span
from nanoslip.study.plan.plan import Plan
from nanoslip.study.tasks.compliance import compliance_needs
from nanoslip.study.tasks.estimates import (
    MOST_SEGMENTS,
    drive_duration,
    drive_periods,
    drive_steps,
    estimate_displacement,
    path_length,
    record_bytes,
)
from nanoslip.study.tasks.kind import task_kinds
from nanoslip.study.tasks.task import Task, label_value

# Disk space of a campaign: files of results, and the dataset made of those that it keeps.

DATASET: Final = 1.5e5
"""Bytes of a dataset without arrays, its variables and their descriptions: 94 kB of a contact, 280 kB with record and drive."""
PACKED: Final = 0.6
"""Share of an array's bytes that is left in the dataset, which is compressed: 0.47 to 0.6 in four campaigns."""


def disk_of_plan(plan: Plan) -> tuple[float, float]:
    """Bytes of all results, including intermediate results, and of the dataset: to a factor of two or three."""
    # All results are on disk together at worst: an intermediate one goes only once no unfinished task needs it.
    every = sum(task.disk for task in plan.tasks)
    kept = sum(_dataset_bytes(task) for task in plan.tasks if not task.intermediate)
    return every, DATASET + PACKED * kept


def _dataset_bytes(task: Task) -> float:
    """Bytes of a result that a dataset keeps, before it is compressed."""
    # Of a record a result holds the arrays of all members, and a dataset those of the first one.
    return task.disk / task.ensemble.likely if task.kind == "record" else task.disk


class Outlook(NamedTuple):
    """Expected flags of the cases, and lengths of their records."""

    masks: Sequence[int]
    """Flags of every case, as bits; 0 for a refused case."""
    shortest: float
    """Record in node spacings; infinite if nothing slides."""
    longest: float


def plan_outlook(plan: Plan) -> Outlook:
    """The outlook of a plan."""
    kinds = task_kinds(plan.manifest)
    masks, spans = list[int](), list[float]()
    for case in (campaign_case.case for campaign_case in plan.cases):
        if not case:
            masks.append(0)
            continue
        displacement = 0.0
        if "record" in kinds and limits_shear(case):
            displacement = estimate_displacement(case)
            spans.append(displacement / case.slab.spacing)
        mask = encode_flags(predict_flags(case, displacement))
        # A path has legs, and no record that could be short.
        if case.path:
            *_, farthest = path_length(case)
            of_path = encode_flags(predict_flags(case, farthest))
            mask |= of_path & ~Flag.short_record.mask
        masks.append(mask)
    shortest = min(spans, default=math.inf)
    return Outlook(masks, shortest, max(spans, default=0.0))


# Validity flags of a campaign's cases in words: one line for each flag, on the terminal and in the report.


def flag_lines(masks: Sequence[int], words: Callable[[int], str]) -> dict[str, str]:
    """Lines about the flags that any case has, by flag: number of cases, the first one, meaning and advice.

    masks: the flags of every case, as bits. words: a case's number -> the parameters in which it differs from other
        cases; empty for a single case.
    """
    lines = {}
    for flag in FLAGS:
        flagged = [number for number, mask in enumerate(masks) if mask & flag.mask]
        if not flagged:
            continue
        where = f"{len(flagged)} of {len(masks)} cases"
        first = words(flagged[0])
        if first:
            where = f"{where}, first {first}"
        lines[flag.name] = f"{flag.name}: {where}: {flag.meaning}; {flag.advice}"
    return lines


def flag_prediction_lines(plan: Plan, outlook: Outlook) -> list[str]:
    """Expected flags of a plan's cases before a run, refused cases excluded."""
    by_flag = flag_lines(outlook.masks, partial(_words, plan))
    lines = list(by_flag.values())
    pairs = zip(plan.cases, outlook.masks, strict=True)
    flagged = [point.case for point, mask in pairs if mask and point.case]
    widths = [guess_half_width(case) for case in flagged]
    if lines:
        # Most flags are of a contact that is too wide or too narrow: its width says by how much.
        extremes = (min(widths), max(widths))
        ends = dict.fromkeys(f"{end:.2g}" for end in extremes)
        scales, si = plan.manifest.stated_scales, ""
        if scales:
            lengths = [width * scales.slab_width for width in widths]
            si = f" ({span(lengths, 'm')})"
        lines.append(f"contacts of these cases have half-widths of about {' to '.join(ends)} L_x{si}")
    steep = [number for number, point in enumerate(plan.cases) if point.case and may_create_energy(point.case)]
    if steep and "slip" in plan.manifest.stages:
        count = f"{len(steep)} of {len(plan.cases)} cases"
        parts = (count, _words(plan, steep[0]))
        where = ", first ".join(filter(None, parts))
        lines.append(f"{DOWNHILL.ending.value}: {where}: {DOWNHILL.message}")
    return [*lines, *out_of_reach(plan).values()]


def _words(plan: Plan, number: int) -> str:
    """Number of a case -> the parameters in which it differs from the others."""
    point = plan.cases[number].parameters
    scales = plan.manifest.stated_scales
    labels = {}
    for name, values in plan.manifest.axes.items():
        # An axis of a single value tells no case from another.
        if len(values) < 2 or name not in point:
            continue
        in_si = si_text(scales, name, point[name]) if scales else ""
        labels[name] = in_si or label_value(point[name])
    return parameters_text(labels)


def out_of_reach(plan: Plan) -> dict[str, str]:
    """Lines about drives that never pull as hard as friction holds, and that may need more segments than step_limit, by cause."""
    lines = {"duration": _too_short(plan), "step_limit": _too_many_steps(plan) or _too_many_rests(plan)}
    return {cause: line for cause, line in lines.items() if line}


class _Pulls(NamedTuple):
    """Largest pulls of the drives of a plan on its cases, and the friction that they would have to exceed."""

    numbers: list[int]
    """Cases (n,) that are possible."""
    drives: list[CampaignDrive]
    """Drives (d,) that are possible."""
    weight: Floats
    """Load (n,) in N."""
    share: Floats
    """Smallest F/W (n,) of steady sliding, which holds to spreads of 3."""
    pace: Floats
    """Rate (d,) at which the spring force rises, in N/s."""
    damper: Floats
    """Force of the damper (d,) on a pin at rest, in N."""
    pull: Floats
    """Largest pull (d,) in N. Without a duration a drive lasts while its stage moves."""

    @property
    def weak(self) -> NDArray[np.bool_]:
        """True (n, d) for drives that never pull as hard as friction holds."""
        friction = self.weight * self.share
        # The share is infinite where nothing can slip: such a case is refused or flagged for that alone.
        can_slide = np.isfinite(self.share)
        return can_slide[:, None] & (self.pull < friction[:, None])


def _pulls(plan: Plan) -> _Pulls | None:
    """None for a plan without drives, or without possible cases."""
    manifest = plan.manifest
    drives = [(drive, drive.drive) for drive in manifest.drives if drive.drive is not None]
    cases = [(number, point.case) for number, point in enumerate(plan.cases) if point.case is not None]
    if not (drives and cases):
        return None
    pace, damper, spring = [], [], []
    for _, named in drives:
        rate = named.in_si.spring_stiffness * named.in_si.stage_velocity
        pace.append(rate)
        damper.append(_damper(named))
        # A stage at rest pulls nothing, however long it lasts: 0 times infinity would be NaN.
        spring.append(rate * _longest_way_time(named.in_si) if rate else 0.0)
    loads = [case.total_load * manifest.scales.force for _, case in cases]
    shares = [least_plateau(case) for _, case in cases]
    return _Pulls(
        [number for number, _ in cases],
        [drive for drive, _ in drives],
        np.array(loads),
        np.array(shares),
        np.array(pace),
        np.array(damper),
        np.array(spring) + np.array(damper),
    )


def _too_short(plan: Plan) -> str:
    """Report drives that are too short to slide."""
    pulls = _pulls(plan)
    if pulls is None or not pulls.weak.any():
        return ""
    # The first True, case by case: row and column of its place in the flattened array.
    first = int(pulls.weak.argmax())
    number, which = divmod(first, len(pulls.drives))
    drive = pulls.drives[which]
    weight, share = pulls.weight[number], pulls.share[number]
    assert drive.drive is not None
    missing = max(weight * share - pulls.damper[which], 0.0)
    rate = pulls.pace[which]
    seconds = missing / rate if rate else math.inf
    travel = seconds * drive.drive.in_si.stage_velocity
    # In the key that the author gave; a stroke is twice the way from its middle to a turn.
    key, amount, unit, instead = "duration", seconds, "s", ""
    if drive.drive.in_si.stage_stroke is not None:
        key, amount, unit = "stage_stroke", 2.0 * travel, "m"
        # Over a record a contact that does not slide loses nothing.
        instead = ", or memory = true"
    elif TRAVEL in drive.given:
        key, amount, unit = TRAVEL, travel, "m"
    advice = "the stage is at rest: raise stage_velocity"
    if math.isfinite(seconds):
        advice = f"needs {key} ≥ {_up(amount):.2g} {unit}{instead}"
    reached = f"reaches F/W = {pulls.pull[which] / weight:.2g}, slips near {share:.2g}"
    parts = [_words(plan, pulls.numbers[number]), drive.label]
    where = ", ".join(filter(None, parts))
    return f"too short to slip: {pulls.weak.sum()} of {pulls.weak.size} drives, first {where}: {reached}: {advice}"


_OF_SLIPS: Final = (
    *("static_friction", "kinetic_friction", "stick_slip_period"),
    *("midstroke_friction", "turn_static_friction"),
)
"""Numbers that a drive without a slip has not."""
_OF_PLATEAUS: Final = ("plateau_mean", "plateau_stress", "mean_step", "mean_drop", "kinetic_friction")
"""Numbers that a record without a steady part has not."""


def impossible_numbers(plan: Plan) -> dict[str, str]:
    """Numbers that no case of a plan can have -> why, in a line."""
    reasons, pulls = dict[str, str](), _pulls(plan)
    if pulls and pulls.weak.all():
        reasons |= dict.fromkeys(_OF_SLIPS, _too_short(plan))
    cases = [point.case for point in plan.cases if point.case is not None]
    # Second, as a record without a steady part leaves no drive a kinetic friction, however long it lasts.
    if cases and all(map(_ends_within_run_in, cases)):
        line = f"all records end before they are steady, which takes {RUN_IN:g} presliding lengths and {FEWEST_EVENTS} events"
        reasons |= dict.fromkeys(_OF_PLATEAUS, f"{line}: raise limits.presliding or events")
    return reasons


def _ends_within_run_in(case: Case) -> bool:
    """True if the limits of a case end its record before its steady part begins."""
    # With spacing_events a record goes on beyond max_presliding, as far as that many events.
    is_short = case.max_presliding is not None and case.max_presliding <= RUN_IN and case.spacing_events is None
    is_poor = case.max_events is not None and case.max_events <= FEWEST_EVENTS
    return limits_shear(case) and (is_poor or is_short)


_LOOKED_AT: Final = 1000
"""Drives that are looked at, of a campaign of millions: in 0.03 s."""


def _driven(plan: Plan) -> Iterator[tuple[int, Case, CampaignDrive, Drive]]:
    """Number of a case, the case, and a drive in SI and dimensionless: some drives of some cases, spread over all."""
    scales, drives = plan.manifest.scales, plan.manifest.drives
    # Every so many, as neighbours differ in the last axis alone.
    drive_step = max(1, len(drives) // _LOOKED_AT)
    some = [pull for pull in drives[::drive_step] if pull.drive]
    in_both_units = [(pull, pull.drive.dimensionless(scales)) for pull in some if pull.drive]
    case_step = max(1, len(plan.cases) * len(in_both_units) // _LOOKED_AT)
    for number in range(0, len(plan.cases), case_step):
        case = plan.cases[number].case
        # Without friction nothing slips.
        if case is not None and limits_shear(case):
            for pull, drive in in_both_units:
                yield number, case, pull, drive


ROUGH_STEPS: Final = 5.0
"""Factor to which the segments of a drive are known before it is computed."""


def beyond_step_limit(plan: Plan) -> str:
    """Report drives that end at step_limit, however roughly their segments are known; empty if there are none."""
    return _too_many_steps(plan, ROUGH_STEPS)


def _too_many_rests(plan: Plan) -> str:
    """Report drives whose pins may come to rest on teeth more often than their step_limit; empty without any."""
    driven = [(case, drive) for _, case, _, drive in _driven(plan) if drive.max_slips is None]
    periods = np.array([drive_periods(drive, case) for case, drive in driven])
    limits = np.array([drive.step_limit for _, drive in driven], float)
    many = MOST_SEGMENTS * periods > limits
    if not many.any():
        return ""
    ends = f"may end at step_limit, after {limits[many].max():.2g} segments of each start"
    needs = f"up to {MOST_SEGMENTS:g} in each of about {periods[many].max():.1g} periods"
    return f"{ends}: {many.sum()} of {many.size} drives looked at, {needs}: {FEWER_RESTS}"


def _too_many_steps(plan: Plan, times: float = 1.0) -> str:
    """Report drives that need more segments than so many times their step_limit."""
    # A drive that ends after some slips ends long before.
    driven = [entry for entry in _driven(plan) if entry[-1].max_slips is None]
    steps = np.array([drive_steps(drive, case) for _, case, _, drive in driven])
    limits = np.array([drive.step_limit for *_, drive in driven], float)
    many = steps > times * limits
    if not many.any():
        return ""
    worst = int(np.where(many, steps, 0.0).argmax())
    number, _, pull, _ = driven[worst]
    parts = [_words(plan, number), pull.label]
    where = ", ".join(filter(None, parts))
    needs = f"needs about {steps[many].max():.1g} segments (to a factor of {ROUGH_STEPS:g}): {FEWER_STEPS}"
    ends = "may end" if times < ROUGH_STEPS else "ends"
    return f"{ends} at step_limit: {many.sum()} of {many.size} drives looked at, worst {where}: {needs}"


def duration_lines(plan: Plan) -> list[str]:
    """Expected duration of drives without one, over all cases, as a line; none if all have one."""
    drives, time = plan.manifest.drives, plan.manifest.scales.time
    times = []
    for _, case, pull, drive in _driven(plan):
        if pull.drive and _lasts_as_needed(drive):
            times.append(drive_duration(drive, case) * time(pull.drive.pin_mass))
    if not times:
        return []
    count = sum(pull.drive is not None and _lasts_as_needed(pull.drive.in_si) for pull in drives)
    low, high = f"{min(times):.2g}", f"{max(times):.2g}"
    span = low if low == high else f"{low} to {high}"
    return [
        f"duration: auto (drives: {count} of {len(drives)}), to the first slip and as many cycles as the "
        f"numbers need: about {span} s (in the dataset: end_time)"
    ]


def _lasts_as_needed(drive: Drive) -> bool:
    """True if a drive lasts until its numbers are known."""
    return drive.duration is None and drive.stage_stroke is None


def _longest_way_time(drive: Drive) -> float:
    """Time for which a stage moves on in one direction, in s: at most from the middle to a turn, if it has a stroke."""
    if drive.stage_stroke is None:
        return drive.duration or math.inf
    # A contact that remembers slips in part at any amplitude: no stroke is too short for it.
    if drive.memory:
        return math.inf
    return 0.5 * drive.stage_stroke / drive.stage_velocity


def _up(value: float) -> float:
    """The next number of two digits."""
    # Upwards, so that the value that a message advises is enough once it is rounded.
    digit = 1.0
    if value > 0.0:
        digit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.ceil(value / digit) * digit


def _damper(drive: NamedDrive) -> float:
    """Force of the damper on a pin at rest, in N."""
    # c·v with c = 2ζ√(mk).
    values = drive.in_si
    critical = 2.0 * math.sqrt(drive.pin_mass * values.spring_stiffness)
    return values.damping_ratio * critical * values.stage_velocity


# Lengths of a plan's records in node spacings, after which the surface repeats.


def span_line(outlook: Outlook) -> str:
    """The number of node spacings that the records will span; empty if nothing slides."""
    if math.isinf(outlook.shortest):
        return ""
    low, high = f"{outlook.shortest:.2g}", f"{outlook.longest:.2g}"
    span = low if low == high else f"{low} to {high}"
    return f"each record slides the pin over about {span} node spacings (to a factor of 3); the surface repeats every spacing"


# Memory of tasks beside that of the machine that is to compute them: it depends on the machine, so it is no case's outcome.

PROGRAM: Final = 2.5e8
"""Bytes of a process with the solver and its kernels: 240 to 255 MB of campaigns of small tasks, 140 MB before the first one."""
NAMED_TASKS: Final = 5
"""Tasks that are named where many do not fit."""


def machine_memory() -> float:
    """Bytes of physical memory of this machine; infinite if the system does not report it."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * float(os.sysconf("SC_PHYS_PAGES"))
    except (ValueError, OSError, AttributeError):
        return math.inf


def shortages(planned: Plan, tasks: Sequence[Task], ranks: int = 1) -> tuple[str, ...]:
    """Report each of these tasks that exceeds this machine's memory, the worst first. If there is none, report if the
    largest tasks together do, one for each rank. Empty if all fit."""
    physical, path = machine_memory(), planned.manifest.path
    worst = heapq.nlargest(max(NAMED_TASKS, ranks), tasks, key=memory_need)
    # The largest tasks may be at work on all ranks at once.
    if not worst or memory_need(*worst[:ranks]) <= physical:
        return ()
    if memory_need(worst[0]) <= physical:
        fitting = max(count for count in range(1, ranks) if memory_need(*worst[:count]) <= physical)
        need, advice = memory_need(*worst[:ranks]), f"start at most {fitting}, or use more machines"
        return (f"{path}: {ranks} ranks on one machine: {_gigabytes_text(need, physical)}: {advice}",)
    large = sum(memory_need(task) > physical for task in tasks)
    lines = []
    for task in worst[: min(large, NAMED_TASKS)]:
        size = _gigabytes_text(memory_need(task), physical)
        lines.append(f"{path}: {_name_with_size(task)}: {size}: {_advice(task)}")
    if large > NAMED_TASKS:
        lines.append(f"{path}: {large - NAMED_TASKS} more tasks need more memory than this machine has")
    return tuple(lines)


def memory_need(*tasks: Task) -> float:
    """Bytes for processes with one task of a plan each; tasks that read the same compliance share one copy."""
    slabs = {task.slab for task in tasks if task.needs[:1] == compliance_needs(task.slab)}
    shared = sum(map(_map_bytes, slabs))
    return shared + sum(PROGRAM + task.memory for task in tasks)


def _map_bytes(slab: Slab) -> float:
    # A slab without ends is a convolution. Else 8 bytes for each pair of the 2n components of force and displacement.
    stored: int = slab.scheme.count_stored_numbers(slab)
    return 8.0 * stored


def _name_with_size(task: Task) -> str:
    """The task by its label, and the size that decides."""
    size = f"n_x={task.slab.n_x}"
    return task.label if size in task.label.split() else f"{task.label} {size}"


def _gigabytes_text(need: float, available: float) -> str:
    return f"needs about {need / 1e9:.3g} GB of memory, this machine has {available / 1e9:.3g} GB"


def _advice(task: Task) -> str:
    events = 0.0
    if task.kind == "record" and task.case is not None:
        events = task.ensemble.likely * record_bytes(task.case)
    # Whichever takes the larger half: events, or matrices of nodes.
    if events > task.memory / 2.0:
        return "use fewer limits.events, a shorter limits.displacement, or a machine with more memory"
    return "use a smaller n_x, or a machine with more memory"
