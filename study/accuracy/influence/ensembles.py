"""Results of an ensemble of starts of one scene, and by how much they change when an effect is left out."""

import math
import time
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.sliding.sampling import EVENLY
from study.dataset.variables import scalars
from study.plan.influence.omissions import OF_THE_CASE, OF_THE_DRIVE, OMISSIONS
from study.plan.influence.scene import OBSERVABLES, OF_DRIVES, Scene
from study.plan.influence.table import LARGEST
from study.plan.task import Task, TaskResult
from study.plan.tasks import compliance_task, contact_task, drive_task, record_task, run_task

STARTS: Final = 8
"""Of an ensemble, spread evenly over a node spacing."""
SEEDS: Final = 1_000_003
"""Difference between the seeds of two members."""
FEWEST: Final = 4
"""Starts that have to yield an observable: fewer say nothing of it."""

Vector = NDArray[np.float64]


class Ensemble(NamedTuple):
    """Results of the starts of one scene, and the processor time that they took."""

    values: Vector
    """(starts, OBSERVABLES): NaN where a start yields none."""
    records: tuple[TaskResult, ...]
    """The friction record of each start."""
    seconds: float
    """Processor time of contacts and records."""
    drive_seconds: float


def compliance_of(scene: Scene) -> TaskResult:
    """The surface compliance of a scene's slab."""
    return run_task(compliance_task(scene.case.slab), {})


def ensemble_of(scene: Scene, compliance: TaskResult, starts: int = STARTS) -> Ensemble:
    """Every start of a scene, records and drives."""
    begun = time.process_time()
    members = [_member(scene, number, starts) for number in range(starts)]
    contacts = [_run(contact_task(member.case, scalars_only=True), compliance) for member in members]
    records = tuple(_run(record_task(member.case), compliance) for member in members)
    seconds = time.process_time() - begun
    values = np.array([_values(contact, record) for contact, record in zip(contacts, records, strict=True)])
    return driven(scene, Ensemble(values, records, seconds, 0.0))


def driven(scene: Scene, ensemble: Ensemble) -> Ensemble:
    """The same records pulled over by the scene's drive."""
    if scene.drive is None:
        return ensemble
    begun = time.process_time()
    found = []
    for number, record in enumerate(ensemble.records):
        member = _member(scene, number, len(ensemble.records))
        task = drive_task(member.case, scene.drive, scalars_only=True, fitted=False)
        found.append(_values(run_task(task, {task.needs[0]: record})))
    columns = [OBSERVABLES.index(name) for name in OF_DRIVES]
    values = ensemble.values.copy()
    values[:, columns] = np.array(found)[:, columns]
    return ensemble._replace(values=values, drive_seconds=time.process_time() - begun)


def _run(task: Task, compliance: TaskResult) -> TaskResult:
    return run_task(task, dict.fromkeys(task.needs, compliance))  # a contact without a matrix needs none


def _member(scene: Scene, number: int, starts: int) -> Scene:
    case = scene.case
    drawn = replace(case.heterogeneity, seed=case.heterogeneity.seed + number * SEEDS)
    return scene._replace(case=replace(case, start=(case.start + number / starts) % 1.0, heterogeneity=drawn))


def _values(*results: TaskResult) -> list[float]:
    """The observables that these results have; NaN for the others."""
    found = dict(_named(results))
    return [found.get(name, math.nan) for name in OBSERVABLES]


def _named(results: tuple[TaskResult, ...]) -> Iterator[tuple[str, float]]:
    for result in results:
        for key, quantity in scalars(result.kind).items():
            if key in result.scalars:
                yield quantity.name, float(result.scalars[key])


def influence(whole: Vector, reduced: Vector) -> Vector:
    """Influence of what a reduced ensemble leaves out on each observable, (observables,): see study.plan.influence.table.

    whole, reduced: (starts, observables). NaN where the whole ensemble does not yield the observable, LARGEST where the
    reduced one does so less than half as often. The starts that lack it in either are left out of both. One standard error is
    taken off, of the change and of what certainty is lost: so much two ensembles of the same scene differ that start elsewhere.
    """
    return np.array([_of_one(on, off) for on, off in zip(whole.T, reduced.T, strict=True)])


def _of_one(on: Vector, off: Vector) -> float:
    known = ~np.isnan(on)
    if known.sum() < FEWEST or not np.mean(on[known]):
        return math.nan
    both = known & ~np.isnan(off)
    count = int(both.sum())
    if count < FEWEST // 2:  # too few of both: of a scene that yields it by chance, at some starts, nothing is learnt
        return LARGEST if 2 * np.sum(~np.isnan(off)) < known.sum() else math.nan
    mean, scatter_on, scatter_off = abs(float(np.mean(on[both]))), _scatter(on[both]), _scatter(off[both])
    even = EVENLY if count == len(on) else 1.0
    error = even * math.hypot(scatter_on, scatter_off) / math.sqrt(count)
    change = abs(float(np.mean(off[both]) - np.mean(on[both])))
    lost = scatter_off * (1.0 - 1.0 / math.sqrt(2.0 * (count - 1))) - scatter_on
    return (max(change - error, 0.0) + max(lost, 0.0)) / mean


def _scatter(values: Vector) -> float:
    return float(np.std(values, ddof=1))


def reduced_in(scene: Scene, effects: Collection[str] = tuple(OMISSIONS)) -> Iterator[tuple[str, Vector]]:
    """What a scene yields, (starts, observables): with all its effects (named WHOLE), then without each of the named ones."""
    compliance = compliance_of(scene)
    whole = ensemble_of(scene, compliance)
    yield WHOLE, whole.values
    for omission in (each for each in OF_THE_CASE if each.name in effects and each.there(scene)):
        without = omission.left_out(scene)
        on = compliance if without.case.slab == scene.case.slab else compliance_of(without)
        yield omission.name, ensemble_of(without, on).values
    for omission in (each for each in OF_THE_DRIVE if each.name in effects and each.there(scene)):
        yield omission.name, driven(omission.left_out(scene), whole).values


def influences_among(values: Mapping[str, Vector]) -> dict[str, Vector]:
    """Influence of every effect on what the effect can change, from what `reduced_in` found."""
    return {name: _of_effect(name, values[WHOLE], reduced) for name, reduced in values.items() if name != WHOLE}


def _of_effect(name: str, whole: Vector, reduced: Vector) -> Vector:
    columns = [OBSERVABLES.index(each) for each in OMISSIONS[name].observables]
    found = influence(whole[:, columns], reduced[:, columns])
    if OMISSIONS[name].of_drive:
        return found
    # Whether a pin slides is the drive's matter: a stiff spring stands between the two, which no group of the contact tells.
    slides = np.array([each not in OF_DRIVES for each in OBSERVABLES]) | (found < LARGEST)
    return np.where(slides, found, math.nan)


WHOLE: Final = "whole"
