"""Results -> one labelled dataset. The same results give the same bytes, whatever computed them, when, in what order.

The root has scalars over the cases: over `intrinsic_friction`, `radius`, `aspect_ratio`, `n_x` and every further axis of
several values where the design is a full product, over `case` otherwise. Those of drives lie over `drive` too where there are
several tables of them, and over every drive axis of several values. Records, trajectories, contacts and the inside of slabs
differ in length: each sort is a group of contiguous ragged arrays, which `study.dataset.access` cuts apart. Who computed them
is in the group `software`.
"""

import json
import os
from collections import Counter
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from solver.drive import Scales
from solver.outcome import Outcome
from solver.quantity import attributes
from study.dataset.collection.ensemble import ensemble_variables
from study.dataset.collection.layout import coordinates, layout_of
from study.dataset.collection.ragged import Runs, texts
from study.dataset.collection.table import Table
from study.dataset.file import CHOSEN, FORMAT, INFLUENCES, MIXED, VERSION
from study.dataset.groups import carrying
from study.dataset.variables import (
    DISCRETIZATION_ERROR,
    SOFTWARE,
    Group,
    all_groups,
    factors,
)
from study.discretization.front import Front, load_front
from study.manifest.cases import CampaignCase
from study.manifest.manifest import Manifest
from study.origin import Origin, Origins, census, mixture
from study.plan.budget import bought
from study.plan.influence.table import load_influences
from study.plan.plan import Plan
from study.plan.standing.endings import case_outcome, drive_outcome
from study.plan.task import TaskResult
from study.plan.tasks import needed_kinds
from study.results.store import Store

Keys = Mapping[tuple[str, str], str]
"""Kind of task and label of its drive ("" without one) -> key."""


def collect(plan: Plan, store: Store) -> xr.Dataset:
    """The dataset of a campaign with its groups, finished or not: what is not computed is NaN, with the outcome `pending`."""
    manifest, layout, runs = plan.manifest, layout_of(plan), _runs(plan.manifest, store.folder)
    table = Table(manifest, layout, [each.group for each in runs])
    front = load_front(manifest.front, manifest.front_text)
    makers = dict[str, Origins]()
    found = _Finished(plan, store)
    for place, (case, tasks) in zip(layout.places.tolist(), plan.case_tasks.in_order(), strict=True):
        results = found.results(tasks.keys)
        makers.update((result.key, result.origins) for result in results.values())
        _say_outcomes(table, place, plan, case, found.outcomes(tasks.keys, results))
        table.say_makers(place, results)
        if case.case is not None:
            if case.case_id in plan.decisions:
                table.say_left_out(place, plan.decisions[case.case_id])
            table.put(DISCRETIZATION_ERROR.name, place, "", front.expected_error(case.case))
            _enter(table, place, runs, manifest, case, results)
    counts, variables = census(makers.values()), table.variables
    facts = _attributes(manifest, front, counts)
    root = xr.Dataset(variables | ensemble_variables(variables), coordinates(plan, layout), facts)
    return carrying(root, {each.group.name: each.dataset() for each in runs} | {SOFTWARE[0].name: _software(counts)})


class _Finished:
    """The results of a plan that are there, a case at a time, and how its tasks ended."""

    def __init__(self, plan: Plan, store: Store) -> None:
        self._store, self._known = store, store.metas()
        self._unsound: set[str] = set()
        failed = {key: attempt.outcome for key, attempt in store.failures().items()}
        self._lost = plan.outcomes(store.outcomes(), failed) if failed else {}
        """How the others failed."""

    def results(self, keys: Keys) -> dict[tuple[str, str], TaskResult]:
        """Those of a case, its compliance apart. keys: of its tasks."""
        sound = {task: key for task, key in keys.items() if key in self._known and key not in self._unsound}
        found = {task: self._store.find(key) for task, key in sound.items() if task[0] != "compliance"}
        self._unsound.update(keys[task] for task, result in found.items() if result is None)  # damaged since
        return {task: result for task, result in found.items() if result is not None}

    def outcomes(self, keys: Keys, results: Mapping[tuple[str, str], TaskResult]) -> dict[str, Outcome]:
        """How the tasks of a case ended."""
        ended = {key: self._lost[key] for key in keys.values() if key in self._lost and key not in self._known}
        compliances = (key for (kind, _), key in keys.items() if kind == "compliance")
        ended |= {key: self._known[key].outcome for key in compliances if key in self._known}
        return ended | {result.key: result.outcome for result in results.values()}


def _say_outcomes(table: Table, place: int, plan: Plan, case: CampaignCase, outcomes: Mapping[str, Outcome]) -> None:
    table.say_outcome(place, case_outcome(plan, case, outcomes))
    for drive in plan.manifest.drives:
        table.say_outcome(place, drive_outcome(plan, case, drive, outcomes), drive.label)


def _enter(
    table: Table,
    place: int,
    runs: list[Runs],
    manifest: Manifest,
    case: CampaignCase,
    results: dict[tuple[str, str], TaskResult],
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


def _runs(manifest: Manifest, folder: Path) -> list[Runs]:
    meanwhile = folder if os.access(folder, os.W_OK) else None
    kinds = needed_kinds(manifest)
    found = []
    for group in all_groups().values():
        series = tuple(each for each in group.series if each.kind in kinds and each.ragged.wanted(manifest))
        if series:
            found.append(Runs(Group(group.name, series), meanwhile))
    return found


def _software(counts: Mapping[Origin, int]) -> xr.Dataset:
    """The software that computed the results, one origin each."""
    origins = sorted(counts)
    name, count, *facts = SOFTWARE
    found: dict[str, Any] = {
        name.name: (name.name, texts(origin.name for origin in origins), attributes(name)),
        count.name: (name.name, np.array([counts[origin] for origin in origins], np.int64), attributes(count)),
    }
    for item, quantity in zip(fields(Origin), facts, strict=True):
        found[quantity.name] = (name.name, texts(getattr(each, item.name) for each in origins), attributes(quantity))
    return xr.Dataset(found)


def _makers(counts: Mapping[Origin, int]) -> dict[str, str]:
    """What the software is that computed the results; where several did, all of it, the most frequent first."""
    found = {}
    for item in fields(Origin):
        values: Counter[str] = Counter()
        for origin, count in counts.items():
            values[getattr(origin, item.name)] += count
        several = [f"{value} ({count} results)" for value, count in sorted(values.items(), key=lambda v: (-v[1], v[0]))]
        found[item.name] = ", ".join(several if len(several) > 1 else values) or "nothing is computed yet"
    mixed = mixture(counts)
    return {**found, MIXED: mixed} if mixed else found


def _attributes(manifest: Manifest, front: Front, counts: Mapping[Origin, int]) -> dict[str, Any]:
    tolerated = manifest.tolerated
    texts = {
        "manifest_table": manifest.table_text,
        "manifest_roughness": manifest.profile_text,
        "manifest_front": manifest.front_text,
        "manifest_influences": tolerated.influences_text if tolerated else None,
        INFLUENCES: str(load_influences(tolerated.influences, tolerated.influences_text)) if tolerated else None,
        CHOSEN: json.dumps(found) if (found := bought(manifest)) else None,
    }
    return {
        FORMAT: VERSION,
        "title": manifest.title,
        "Conventions": "CF-1.11",
        "history": "computed and collected by nanoslip",  # without a date: the same results give the same bytes
        "manifest": manifest.text,
        **{name: text for name, text in texts.items() if text is not None},
        "manifest_sha256": manifest.sha256,
        "discretization_front": f"{front.name}, sha256 {front.sha256}",
        **_makers(counts),
        **{item.name: getattr(manifest.scales, item.name) for item in fields(Scales)},
        "scales": "slab_width L_x in m, slab_depth L_y in m, shear_modulus G in Pa",
    }
