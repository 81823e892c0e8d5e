"""Results -> one labelled dataset. The same results give the same bytes, whatever computed them, when, in what order.

The root has scalars over the cases: over `intrinsic_friction`, `radius`, `aspect_ratio`, `n_x` and every further axis of
several values where the design is a full product, over `case` otherwise. Those of drives lie over `drive` too where there are
several tables of them, and over every drive axis of several values. Records, trajectories, contacts and the inside of slabs
differ in length: each sort is a group of contiguous ragged arrays, which `study.dataset.access` cuts apart. Who computed them
is in the group `software`.
"""

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np
import xarray as xr

from solver.drive import Scales
from solver.outcome import Outcome
from solver.quantity import Quantity, attributes
from solver.sliding.validity import advice_on, flags_in
from study.dataset.ensemble import ensemble_variables
from study.dataset.file import CHOSEN, FORMAT, MIXED, VERSION
from study.dataset.groups import carrying
from study.dataset.layout import Layout, coordinates, layout_of
from study.dataset.ragged import Runs, texts
from study.dataset.variables import (
    ADVICE,
    COMPUTED_BY,
    DISCRETIZATION_ERROR,
    OUTCOMES,
    SOFTWARE,
    VALIDITY,
    Group,
    all_groups,
    companions,
    factors,
    scalars,
)
from study.discretization.front import Front, load_front
from study.discretization.targets import chosen
from study.manifest.cases import CampaignCase
from study.manifest.manifest import Manifest
from study.origin import NOBODY, Origin, Origins, census, mixture, stemming
from study.plan.endings import PENDING, case_outcome, drive_outcome
from study.plan.flags import flags_of
from study.plan.kinds.kind import left_out
from study.plan.plan import CaseTasks, Plan
from study.plan.task import TaskResult
from study.plan.tasks import KINDS, needed_kinds
from study.results.store import Store


def collect(plan: Plan, store: Store) -> xr.Dataset:
    """The dataset of a campaign with its groups, finished or not: what is not computed is NaN, with the outcome `pending`."""
    manifest = plan.manifest
    layout = layout_of(plan)
    runs = _runs(manifest)
    table = _Table(manifest, layout, runs)
    drives = {drive.label: drive for drive in manifest.drives}
    front = load_front(manifest.front, manifest.front_text)
    makers: dict[str, Origins] = {}
    failed = {key: attempt.outcome for key, attempt in store.failures().items()}
    finished = store.outcomes() if failed else {}
    failed = plan.outcomes(finished, failed) if failed else {}
    for case in plan.cases:
        if case.case is not None:
            table.put(DISCRETIZATION_ERROR.name, case, "", front.expected_error(case.case))
        results = _results(plan.case_tasks[case.case_id], store)
        outcomes = failed | {result.key: result.outcome for result in results.values() if result}
        table.say_outcome(case, case_outcome(plan, case, outcomes))
        for name, drive in drives.items():
            table.say_outcome(case, drive_outcome(plan, case, drive, outcomes), name)
        table.say_makers(case, results)
        for (kind, name), result in results.items():
            if result is None or case.case is None:
                continue
            if kind != "compliance":  # what is made of it says whose it was
                makers[result.key] = result.origins
            by = factors(case.case, manifest.scales, drives[name].drive if name else None)
            table.enter(case, name, result, by)
        for each in runs:
            for name in drives if each.group.driven else ("",):
                parts = [found for kind in each.group.kinds if (found := results.get((kind, name)))]
                if parts and case.case is not None:
                    by = factors(case.case, manifest.scales, drives[name].drive if name else None)
                    table.put(each.group.id.name, case, name, each.add(parts, by, case.case_id, name))
    counts = census(makers.values())
    variables = table.variables | ensemble_variables(table.variables)
    root = xr.Dataset(variables, coordinates(plan, layout), _attributes(manifest, front, counts))
    return carrying(root, {each.group.name: each.dataset() for each in runs} | {SOFTWARE[0].name: _software(counts)})


Results = dict[tuple[str, str], TaskResult | None]
"""Kind of task and label of its drive ("" without one) -> its result, None where it is not finished."""


def _results(keys: CaseTasks, store: Store) -> Results:
    results = {task: store.find(key) for task, key in keys.keys.items()}
    # A compliance is intermediate: once used it may go without being missed.
    return {task: result for task, result in results.items() if result is not None or task[0] != "compliance"}


class _Table:
    """The variables over the cases, and over the drives where they vary: the same ones whatever the results."""

    def __init__(self, manifest: Manifest, layout: Layout, runs: list[Runs]) -> None:
        self._layout = layout
        self.variables: dict[str, Any] = {}
        kinds = needed_kinds(manifest)
        for kind in ("", "drive"):
            if not kind or kind in kinds:
                ending, message = OUTCOMES[kind]
                self._declare(kind, ending, PENDING)
                self._declare(kind, message, "")
                self._declare(kind, COMPUTED_BY[kind], "")
        self._declare("", DISCRETIZATION_ERROR, np.nan)
        self._declare("", ADVICE, "")
        for kind in KINDS:
            if kind in kinds:
                apart = left_out(KINDS[kind], manifest)
                for name, quantity in (*scalars(kind).items(), *companions(kind).items()):
                    if name not in apart:
                        self._declare(kind, quantity, _nothing(quantity))
        for each in runs:
            self._declare("drive" if each.group.driven else "", each.group.id, "")

    def _declare(self, kind: str, quantity: Quantity, fill: object) -> None:
        axes = self._layout.axes | (self._layout.drive_axes if kind == "drive" else {})
        dims = {name: len(values) for name, values in axes.items()}
        values = np.full(tuple(dims.values()), fill, dtype=object if isinstance(fill, str) else None)
        self.variables[quantity.name] = xr.Variable(tuple(dims), values, attributes(quantity))

    def put(self, name: str, case: CampaignCase, drive: str, value: object) -> None:
        """Set one value."""
        variable = self.variables[name]
        position = self._layout.position[case.case_id]
        if len(variable.dims) > len(position):
            position += self._layout.drive_position[drive]
        variable.values[position] = value

    def say_outcome(self, case: CampaignCase, outcome: Outcome | None, drive: str = "") -> None:
        """Set how a case, or its drive, ended; None leaves it pending."""
        if outcome is not None:
            ending, message = OUTCOMES["drive" if drive else ""]
            self.put(ending.name, case, drive, outcome.ending.value)
            self.put(message.name, case, drive, outcome.message)

    def say_makers(self, case: CampaignCase, results: Results) -> None:
        """Set which software a case, and each of its drives, stems from."""
        found: dict[str, list[Origins]] = {}
        for (kind, name), result in results.items():
            if result is not None and kind != "compliance":
                found.setdefault(name, []).append(result.origins or (NOBODY,))
        for name, parts in found.items():
            names = " ".join(origin.name for origin in stemming(*parts))
            self.put(COMPUTED_BY["drive" if name else ""].name, case, name, names)

    def enter(self, case: CampaignCase, drive: str, result: TaskResult, by: dict[str, float]) -> None:
        """Set all scalars of a result."""
        for known in (scalars(result.kind), companions(result.kind)):
            for name, quantity in known.items():
                if name in result.scalars:
                    self.put(quantity.name, case, drive, _value(quantity, result.scalars[name], by))
        if case.case is not None and (flags := flags_of(case.case, result)) is not None:
            self.put(VALIDITY.name, case, drive, flags)
            self.put(ADVICE.name, case, drive, advice_on(flags_in(flags)))


def _nothing(quantity: Quantity) -> object:
    """What stands for a number that is not there."""
    if quantity.words:
        return ""
    return np.int32(0) if quantity.flags else np.nan


def _value(quantity: Quantity, number: float | int, by: dict[str, float]) -> float | str:
    """A result's number in the dataset's unit, or the word that it stands for."""
    if quantity.words:
        return "" if np.isnan(number) else quantity.words[int(number)]
    return number * by[quantity.per]


def _runs(manifest: Manifest) -> list[Runs]:
    kinds = needed_kinds(manifest)
    found = []
    for group in all_groups().values():
        series = tuple(each for each in group.series if each.kind in kinds and each.ragged.wanted(manifest))
        if series:
            found.append(Runs(Group(group.name, series)))
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
    texts = {
        "manifest_table": manifest.table_text,
        "manifest_roughness": manifest.profile_text,
        "manifest_front": manifest.front_text,
        CHOSEN: None if manifest.accuracy is None else json.dumps(chosen(manifest)),
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
