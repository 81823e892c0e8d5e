"""Change and cost of each effect: a few cases computed with all effects, then without one at a time.

Both have the same members: the same starts, and for effects of a drive the same records, so that scatter cancels.
"""

import math
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final, NamedTuple, TypeVar

import numpy as np

from nanoslip.solver.case import Case
from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.regime import CriticalVelocity
from nanoslip.solver.dynamics.stick_slip import StickSlipFit
from nanoslip.solver.effects import OF_CASES, OF_DRIVES, Effect
from nanoslip.solver.ensemble import Ensemble, mean_of
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.parameter import quantities
from nanoslip.study.manifest.cases import CampaignCase, refuse_with_stages
from nanoslip.study.manifest.checker import find_refusal
from nanoslip.study.manifest.manifest import OF_CONTACTS, USUAL_MEMBERS, Manifest, TargetTable
from nanoslip.study.manifest.problems import ManifestError
from nanoslip.study.plan.plan import evenly, key_of_duration
from nanoslip.study.tasks.compliance import compliance_task
from nanoslip.study.tasks.compute import run_task
from nanoslip.study.tasks.contact import contact_task
from nanoslip.study.tasks.contacts import all_batches
from nanoslip.study.tasks.drive import drive_task, goes_one_way
from nanoslip.study.tasks.estimates import estimate
from nanoslip.study.tasks.kind import KINDS, result_quantities, uncertain_names
from nanoslip.study.tasks.path import path_task
from nanoslip.study.tasks.record import record_task
from nanoslip.study.tasks.task import Task, TaskResult

Drives = Mapping[str, Drive]
"""Label -> how the pin is pulled."""
Place = tuple[str, str]
"""Variable name, and drive label (empty for a number of the case)."""
Done = dict[str, tuple[TaskResult, float]]
"""Key of a task -> its result and core seconds."""


class Scenes(NamedTuple):
    """Selected cases and drives of a campaign."""

    manifest: Manifest
    cases: tuple[CampaignCase, ...]
    drives: Drives
    """Drives of every case."""
    ensemble: Ensemble
    variables: tuple[str, ...]
    of_cases: tuple[Effect[Case], ...] = OF_CASES
    of_drives: tuple[Effect[Drive], ...] = OF_DRIVES
    """Effects that are left out, one at a time."""


@dataclass(frozen=True, slots=True)
class Change:
    """Change of a number without an effect: mean over members of the difference, over the mean with everything, and its ±."""

    where: str
    """Number of the case, followed by the drive if it is a drive's number."""
    change: float = math.nan
    uncertainty: float = math.nan
    problem: str = ""
    """Reason of a computation's failure."""


@dataclass(frozen=True, slots=True)
class Influence:
    """An effect, and one number whose computation depends on it."""

    effect: str
    setting: str
    variable: str
    changes: tuple[Change, ...]
    """Known changes of the cases, the smallest first; or an unknown one."""
    seconds: float
    """Core seconds of contact, record and drives without the effect, over the core seconds with all effects."""
    problems: tuple[str, ...]

    @property
    def change(self) -> float:
        """Mean of the changes: the largest one is chosen by its noise."""
        total = math.fsum(change.change for change in self.changes)
        return total / len(self.changes)

    @property
    def uncertainty(self) -> float:
        """The ± of `mean`."""
        # Changes of different cases are independent: the error of their sum is the root of the sum of squares.
        total = math.hypot(*(change.uncertainty for change in self.changes))
        return total / len(self.changes)


def select_scenes(manifest: Manifest, cases: Sequence[CampaignCase], count: int, members: int | None = None) -> Scenes:
    """Select `count` of these cases, evenly spread from the first to the last, and as many of their campaign's drives.

    members: None for the campaign's number, at most USUAL_MEMBERS; USUAL_MEMBERS if the campaign has a single member.
        Raises ManifestError.
    """
    possible = [case for case in cases if case.case]
    pulls = [(pull.label, pull.drive) for pull in manifest.drives if pull.drive]
    drives = [(label, drive.dimensionless(manifest.scales)) for label, drive in pulls]
    if not possible or ("dynamics" in manifest.stages and not drives):
        need = "a case and a drive that are possible; nanoslip plan says why none is"
        raise ManifestError.in_file(manifest.path, need)
    asked = manifest.ensemble
    # A change over a single member has no ±.
    usual_members = min(asked.members, USUAL_MEMBERS) if asked.members > 1 else USUAL_MEMBERS
    ensemble = Ensemble(members or usual_members, places=asked.places)
    # Any target has these variables; the error that this one allows is not used.
    target = TargetTable(within=0.5)
    usual = target.variables(manifest.stages[-1], to_and_fro=not goes_one_way(manifest))
    variables = asked.of or (OF_LOOPS if manifest.paths and not drives else usual)
    selected = tuple(evenly(possible, count))
    pulled = dict(evenly(drives, count))
    return Scenes(manifest, selected, pulled, ensemble, variables)


OF_LOOPS: Final = ("loss_per_cycle", "turn_friction")
"""Main numbers of a campaign with paths."""


def comparison_seconds(scenes: Scenes) -> float:
    """Estimated core seconds of these scenes with everything and without each effect; tasks that several need count once."""
    seconds_by_key: dict[str, float] = {}
    for point in scenes.cases:
        assert point.case is not None
        left_out = _scenes_without_effects(scenes, point.case)
        without = [(case, drives) for _, case, drives, problem in left_out if not problem]
        for case, drives in [(point.case, scenes.drives), *without]:
            tasks = scene_tasks(scenes.manifest, case, drives, scenes.ensemble, scenes.variables)
            for _, task in tasks:
                seconds, *_ = estimate(task)
                seconds_by_key.setdefault(task.key, seconds)
    return math.fsum(seconds_by_key.values())


class Verdict(NamedTuple):
    """Classify effects by the change of the numbers without them, at a tolerance."""

    needed: tuple[str, ...]
    """Some number changes by more than the tolerance, less twice its ±."""
    negligible: tuple[str, ...]
    """No number changes by more than the tolerance, plus twice its ±. Without a tolerance: no change is beyond twice its ±."""
    unknown: tuple[str, ...]


def find_verdict(all_influences: Sequence[Influence], tolerance: float) -> Verdict:
    """Sort effects by their changes. tolerance: relative; 0 without one."""
    sorted_by = dict[str, list[str]](needed=[], negligible=[], unknown=[])
    for effect in dict.fromkeys(influence.effect for influence in all_influences):
        of_effect = [influence for influence in all_influences if influence.effect == effect]
        changes = np.array([abs(influence.change) for influence in of_effect])
        reach = np.array([2.0 * influence.uncertainty for influence in of_effect])
        least, most = changes - reach, changes + reach
        # One number that surely changes is enough; that an effect is negligible takes all of them. An unknown change is NaN,
        # of which neither holds.
        if (least > tolerance).any():
            sorted_by["needed"].append(effect)
        elif (most <= tolerance).all() or (not tolerance and np.isfinite(most).all()):
            sorted_by["negligible"].append(effect)
        else:
            sorted_by["unknown"].append(effect)
    return Verdict(**{name: tuple(effects) for name, effects in sorted_by.items()})


def influences(scenes: Scenes) -> tuple[list[Influence], list[str]]:
    """Influence of each effect of these cases and drives on each requested number that depends on it.

    Also returns cases that failed with all effects on: their changes are unknown.
    """
    failed: dict[str, None] = {}
    changes = defaultdict[tuple[str, str], list[Change]](list)
    seconds = defaultdict[str, list[tuple[float, float]]](list)
    done: Done = {}
    named = {drive.label: drive for drive in scenes.manifest.drives}
    for number, campaign_case in enumerate(scenes.cases, start=1):
        assert campaign_case.case is not None
        # Results of one case fit into memory; the next case needs none of them but compliances.
        done = {key: entry for key, entry in done.items() if entry[0].kind == "compliance"}
        results_of_whole, seconds_of_whole = _compute_scene(scenes, campaign_case.case, scenes.drives, done)
        for effect, case, drives, problem in _scenes_without_effects(scenes, campaign_case.case):
            fewer, its_seconds = results_of_whole, seconds_of_whole
            if not problem:
                fewer, its_seconds = _compute_scene(scenes, case, drives, done)
            for place, result in fewer.items():
                variable, drive = place
                where = f"{number}, drive {drive}" if drive else f"{number}"
                before = results_of_whole[place]
                ended = before.outcome
                if not ended.ok:
                    if drive:
                        ended = ended.naming(key_of_duration(named[drive]))
                    failed[f"case {where}: {ended.ending}: {ended.message}"] = None
                elif problem:
                    changes[effect, variable].append(Change(where, problem=problem))
                # Tasks of one key are one computation: such a number does not depend on the effect.
                elif result.key != before.key:
                    changes[effect, variable].append(_change(where, variable, result, before))
            seconds[effect].append((its_seconds, seconds_of_whole))
    return list(_means(scenes, changes, seconds)), list(failed)


def _scenes_without_effects(scenes: Scenes, case: Case) -> Iterator[tuple[str, Case, Drives, str]]:
    """Every effect of a scene, with the case and drives without it, or the reason why there is no such case."""
    for case_effect in scenes.of_cases:
        if case_effect.there(case):
            # An effect may be one that others need, as friction is for sliding: then there is no such scene to compare with.
            try:
                without = case_effect.without(case)
                wrong = find_refusal(refuse_with_stages, scenes.manifest, without)
                yield case_effect.name, without, scenes.drives, str(wrong or "")
            except InvalidInput as error:
                yield case_effect.name, case, scenes.drives, str(error)
    for drive_effect in scenes.of_drives:
        without_it = {}
        for label, drive in scenes.drives.items():
            if drive_effect.there(drive):
                without_it[label] = drive_effect.without(drive)
        # Drives that lack the effect anyway stay as they are, and are not computed again.
        if without_it:
            yield drive_effect.name, case, {**scenes.drives, **without_it}, ""


def scene_tasks(
    manifest: Manifest, case: Case, drives: Drives, ensemble: Ensemble, names: Sequence[str]
) -> list[tuple[str, Task]]:
    """The label of a drive or nothing, and a task; needed ones first. names: the requested variables."""
    slides = "slip" in manifest.stages
    tasks: list[tuple[str, Task]] = []
    if not slides or {*names} & {*OF_CONTACTS}:
        tasks.append(("", contact_task(case, ensemble, scalars_only=True)))
    if case.path:
        tasks.append(("", path_task(case, ensemble, scalars_only=True)))
    if slides and (drives or not case.path):
        record = record_task(case, ensemble)
        batches = all_batches(case, record.ensemble)
        tasks += [("", task) for task in (*batches, record)]
    is_asked_for = bool({*names} & quantities(CriticalVelocity).keys())
    critical = manifest.outputs.critical and is_asked_for
    # A fit takes longer than its drive.
    of_fit = {quantity.name for quantity in quantities(StickSlipFit, "fitted_").values()}
    fitted = manifest.outputs.fit and bool({*names} & of_fit)
    asked = {"scalars_only": True, "fitted": fitted, "critical": critical}
    for label, drive in drives.items():
        tasks.append((label, drive_task(case, drive, ensemble, **asked)))
    compliance = compliance_task(case.slab)
    is_needed = any(compliance.key in task.needs for _, task in tasks)
    return [("", compliance), *tasks] if is_needed else tasks


def _compute_scene(scenes: Scenes, case: Case, drives: Drives, done: Done) -> tuple[dict[Place, TaskResult], float]:
    """Results of a case and its drives, and core seconds of contact, record and drives.

    done: results and their core seconds; new ones are added.
    """
    # The first ensemble loads libraries and compiles kernels; the time of the second one counts.
    for ensemble in (Ensemble(), scenes.ensemble):
        tasks = scene_tasks(scenes.manifest, case, drives, ensemble, scenes.variables)
        compute_tasks(tasks, done)
    results = dict[Place, TaskResult]()
    for label, task in tasks:
        result, _ = done[task.key]
        names = uncertain_names(KINDS[task.kind])
        results |= {(variable, label): result for variable in scenes.variables if variable in names}
    keys = [task.key for _, task in tasks if task.kind != "compliance"]
    return results, sum(done[key][1] for key in keys)


def compute_tasks(tasks: Sequence[tuple[str, Task]], done: Done) -> None:
    """Compute tasks, inputs first, and add their results and core seconds to `done`."""
    for _, task in tasks:
        if task.key not in done:
            inputs = {key: done[key][0] for key in task.needs}
            result, seconds = measure_time(partial(run_task, task, inputs))
            done[task.key] = result, seconds
            for array in result.arrays.values():
                # As a store gives arrays: kernels are compiled for these.
                array.setflags(write=False)


def scalar_key(variable: str, result: TaskResult) -> str:
    """Name in a result of the scalar that is a variable of the dataset."""
    numbers = result_quantities(KINDS[result.kind])
    return next(key for key, quantity in numbers.items() if quantity.name == variable)


def _change(where: str, variable: str, without: TaskResult, with_all: TaskResult) -> Change:
    """Change of a number between two results with the same members."""
    key = scalar_key(variable, with_all)
    unknown = [math.nan] * len(with_all.scalars[key])
    values = np.array(with_all.scalars[key], float)
    values_without = np.array(without.scalars.get(key, unknown), float)
    # Members come down at the same places in both: their differences scatter less than the numbers.
    difference = mean_of(values_without - values)
    # No change is a share of a mean of 0.
    mean = abs(float(mean_of(values).mean)) or math.nan
    ended = without.outcome.naming("duration")
    problem = ""
    if ended != with_all.outcome:
        problem = ended.message if ended.ok else f"{ended.ending}: {ended.message}"
    change = float(difference.mean) / mean
    uncertainty = float(difference.uncertainty) / mean
    return Change(where, change, uncertainty, problem)


def _means(
    scenes: Scenes, changes: Mapping[tuple[str, str], list[Change]], seconds: Mapping[str, list[tuple[float, float]]]
) -> Iterator[Influence]:
    """Mean changes, one for each effect and variable, in the order of their declaration."""
    every: tuple[Effect[Case] | Effect[Drive], ...] = (*scenes.of_cases, *scenes.of_drives)
    for effect in every:
        for variable in scenes.variables:
            of_effect = changes.get((effect.name, variable))
            if of_effect:
                finite = [change for change in of_effect if math.isfinite(change.change)]
                ranked_changes = sorted(finite, key=lambda change: change.change)
                pairs = zip(*seconds[effect.name], strict=True)
                without, with_all = map(sum, pairs)
                problems = tuple(f"case {change.where}: {change.problem}" for change in of_effect if change.problem)
                # Where every change is unknown, the first one stands for all.
                ranked = tuple(ranked_changes or of_effect[:1])
                share = without / with_all
                yield Influence(effect.name, effect.setting, variable, ranked, share, problems)


T = TypeVar("T")


def measure_time(run: Callable[[], T], repeats: int = 1) -> tuple[T, float]:
    """Result of `run`, and the shortest of its processor times in s."""
    shortest = float("inf")
    for _ in range(repeats):
        # Processor time: what else runs on the machine does not lengthen it.
        start = time.process_time()
        result = run()
        shortest = min(shortest, time.process_time() - start)
    return result, shortest
