"""Results -> one labelled dataset. The same results give the same bytes, whatever computed them, when, in what order.

Scalars lie over the cases: over `intrinsic_friction`, `radius`, `aspect_ratio`, `n_x` and every further axis of several
values where the design is a full product, over `case` otherwise; over `drive` too where there are several. Records
and trajectories differ in length: they are contiguous ragged arrays, which `record` and `trajectory` cut apart.
"""

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Final

import numpy as np
import xarray as xr

from solver.drive import Scales
from solver.outcome import Outcome
from solver.sliding.validity import advice_on, flags_in
from study.dataset.ensemble import ensemble_variables
from study.dataset.file import CHOSEN, FORMAT, MIXED, PENDING, VERSION
from study.dataset.ragged import ABSENT, Runs, texts
from study.dataset.store import Store
from study.dataset.variables import (
    ADVICE,
    COMPANIONS,
    COMPUTED_BY,
    DISCRETIZATION_ERROR,
    OUTCOMES,
    SCALARS,
    SERIES,
    VALIDITY,
    Quantity,
    factors,
    parameters,
)
from study.discretization.front import Front, load_front
from study.discretization.targets import chosen
from study.manifest.cases import MEMBER, CampaignCase
from study.manifest.effects import task_kinds
from study.manifest.manifest import VARIED, Manifest
from study.manifest.parameters import STANDARD, Value
from study.origin import NOBODY, Origin, Origins, census, mixture, stemming
from study.plan.plan import CaseTasks, Plan
from study.plan.tasks import TaskResult


def collect(plan: Plan, store: Store) -> xr.Dataset:
    """The dataset of a campaign, finished or not: what is not computed is NaN, with the outcome `pending`."""
    manifest = plan.manifest
    layout = _layout(plan)
    runs = _runs(manifest)
    table = _Table(manifest, layout, runs)
    drives = {drive.name: drive for drive in manifest.drives}
    front = load_front(manifest.front, manifest.front_text)
    makers: dict[str, Origins] = {}
    for case in plan.cases:
        if case.case is not None:
            table.put(DISCRETIZATION_ERROR.name, case, "", front.expected_error(case.case))
        results = _results(plan.case_tasks[case.case_id], store)
        table.say_outcome(case, _outcome(case, results))
        for name in drives:
            driven = results.get(("drive", name))
            table.say_outcome(case, driven.outcome if driven else None if case.case else case.outcome, name)
        table.say_makers(case, results)
        for (kind, name), result in results.items():
            if result is None or case.case is None:
                continue
            if kind != "compliance":  # what is made of it says whose it was
                makers[result.key] = result.origins
            by = factors(case.case, manifest.scales, drives.get(name))
            table.enter(case, name, result, by)
            for each in runs:
                if each.series.kind == kind:
                    table.put(f"{each.series.instance}_index", case, name, each.add(result, by, case.case_id, name))
    variables = table.variables
    variables |= ensemble_variables(variables)
    for each in runs:
        variables |= each.variables()
    counts = census(makers.values())
    variables |= _software(counts)
    return xr.Dataset(variables, _coordinates(plan, layout), _attributes(manifest, front, counts))


Results = dict[tuple[str, str], TaskResult | None]
"""Kind of task and name of its drive ("" without one) -> its result, None where it is not finished."""


def _results(keys: CaseTasks, store: Store) -> Results:
    tasks = {("contact", ""): keys.contact, ("friction", ""): keys.friction, ("states", ""): keys.states}
    tasks |= {("drive", name): key for name, key in keys.drives.items()}
    results = {task: store.find(key) for task, key in tasks.items() if key is not None}
    compliance = store.find(keys.compliance) if keys.compliance else None
    # Only a means: once used it may go without being missed.
    return {("compliance", ""): compliance, **results} if compliance else results


def _outcome(case: CampaignCase, results: Results) -> Outcome | None:
    """How a case ended up to its friction record: the first failure, else what is missing; None while unfinished."""
    outcome: Outcome | None = case.outcome
    for (kind, _), result in results.items():
        if kind == "drive" or outcome is None or not outcome.usable:
            continue
        if result is None or outcome.ok or not result.outcome.usable:
            outcome = result.outcome if result else None
    return outcome


@dataclass(frozen=True, slots=True)
class _Layout:
    """Where each case lies: the axes that are dimensions, and case_id -> position."""

    axes: dict[str, tuple[Value, ...]]
    position: Mapping[str, tuple[int, ...]]


def _layout(plan: Plan) -> _Layout:
    members = plan.manifest.ensemble.members
    ensemble: dict[str, tuple[Value, ...]] = {MEMBER: tuple(range(members))} if members > 1 else {}
    if plan.manifest.design != "product":
        axes: dict[str, tuple[Value, ...]] = {"case": tuple(range(len(plan.cases) // members)), **ensemble}
        places = (divmod(number, members) if ensemble else (number,) for number in range(len(plan.cases)))
        return _Layout(axes, {case.case_id: place for case, place in zip(plan.cases, places, strict=True)})
    given = plan.manifest.axes
    names = (*STANDARD, *(name for name, values in given.items() if name not in STANDARD and len(values) > 1))
    axes = {name: tuple(given.get(name, (plan.cases[0].parameters[name],))) for name in names} | ensemble
    return _Layout(
        axes,
        {case.case_id: tuple(axes[name].index(case.parameters[name]) for name in axes) for case in plan.cases},
    )


class _Table:
    """The variables over the cases, and over the drives where there are several: the same ones whatever the results."""

    def __init__(self, manifest: Manifest, layout: _Layout, runs: list[Runs]) -> None:
        self._layout = layout
        self._drives = [drive.name for drive in manifest.drives]
        self.variables: dict[str, Any] = {}
        kinds = task_kinds(manifest)
        for kind in ("", "drive"):
            if not kind or kind in kinds:
                ending, message = OUTCOMES[kind]
                self._declare(kind, ending, PENDING)
                self._declare(kind, message, "")
                self._declare(kind, COMPUTED_BY[kind], "")
        self._declare("", DISCRETIZATION_ERROR, np.nan)
        self._declare("", ADVICE, "")
        for kind, scalars in SCALARS.items():
            if kind in kinds:
                for quantity in (*scalars.values(), *COMPANIONS.get(kind, {}).values()):
                    self._declare(kind, quantity, _nothing(quantity))
        for each in runs:
            instance = each.series.instance
            index = Quantity(f"{instance}_index", f"number of the case's {instance}, {ABSENT} where it has none")
            self._declare(each.series.kind, index, ABSENT)

    def _declare(self, kind: str, quantity: Quantity, fill: object) -> None:
        dims = {name: len(values) for name, values in self._layout.axes.items()}
        if kind == "drive" and len(self._drives) > 1:
            dims["drive"] = len(self._drives)
        values = np.full(tuple(dims.values()), fill, dtype=object if isinstance(fill, str) else None)
        self.variables[quantity.name] = xr.Variable(tuple(dims), values, quantity.attributes)

    def put(self, name: str, case: CampaignCase, drive: str, value: object) -> None:
        """Set one value."""
        variable = self.variables[name]
        position = self._layout.position[case.case_id]
        variable.values[(*position, self._drives.index(drive)) if "drive" in variable.dims else position] = value

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
        for scalars in (SCALARS, COMPANIONS):
            for name, quantity in scalars.get(result.kind, {}).items():
                if name in result.scalars:
                    self.put(quantity.name, case, drive, _value(quantity, result.scalars[name], by))
        if VALIDITY.name in result.scalars:
            self.put(ADVICE.name, case, drive, advice_on(flags_in(int(result.scalars[VALIDITY.name]))))


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
    outputs = manifest.outputs
    wanted = {
        "event": outputs.records,
        "sample": outputs.trajectory,
        "slip_phase": outputs.phases,
        "surface_node": outputs.tractions,
        "state_node": bool(outputs.tractions_at),
        "interior_node": outputs.subsurface,
    }
    return [Runs(series) for series in SERIES if wanted[series.sample] and series.kind in task_kinds(manifest)]


def _coordinates(plan: Plan, layout: _Layout) -> dict[str, Any]:
    """Every parameter: along its dimension, over the cases where it varies, else once; and the drives'."""
    shape = tuple(len(values) for values in layout.axes.values())
    along = set(plan.manifest.axes) | set(STANDARD) if "case" in layout.axes else set()
    ids = np.full(shape, "", dtype=object)
    for case in plan.cases:
        ids[layout.position[case.case_id]] = case.case_id
    found: dict[str, Any] = {
        name: (name, _array(values), _parameter(name).attributes) for name, values in layout.axes.items()
    }
    found["case_id"] = (tuple(layout.axes), ids, _CASE_ID.attributes)
    # Of what varies between members, an axis says where the first of them is: the case itself knows better.
    points = {case.case_id: {**case.parameters, **(case.case.flat if case.case else {})} for case in plan.cases}
    for name in parameters():
        values = {case_id: point[name] for case_id, point in points.items() if point.get(name) is not None}
        if name in layout.axes or not values:
            continue
        if len(set(values.values())) == 1 and name not in along:
            found[name] = ((), next(iter(values.values())), _parameter(name).attributes)
            continue
        sample = next(iter(values.values()))
        # Whole numbers stay whole, as floats lose digits beyond 2^53, except where some are missing.
        whole = isinstance(sample, int) and len(values) == len(plan.cases)
        kind: Any = object if isinstance(sample, str) else np.int64 if whole else float
        spread = np.full(shape, "" if isinstance(sample, str) else 0 if whole else np.nan, kind)
        for case_id, value in values.items():
            spread[layout.position[case_id]] = value
        dims = tuple(layout.axes)
        if dims[-1] == MEMBER and name not in VARIED:
            spread, dims = spread[..., 0], dims[:-1]
        found[name] = (dims, spread, _parameter(name).attributes)
    return found | _drive_coordinates(plan.manifest)


def _drive_coordinates(manifest: Manifest) -> dict[str, Any]:
    """The drives' names and settings, along `drive` where there are several, else once."""
    drives = manifest.drives
    found: dict[str, Any] = {}
    for name in ("name", *parameters()) if drives else ():
        values = [{"name": drive.name, **drive.flat}.get(name) for drive in drives]
        if any(value is not None for value in values):
            label = _DRIVE if name == "name" else parameters()[name]
            array = _array([np.nan if value is None else value for value in values])
            dims = "drive" if len(drives) > 1 else ()
            found[label.name] = (dims, array if dims else array[0], label.attributes)
    return found


def _software(counts: Mapping[Origin, int]) -> dict[str, Any]:
    """The software that computed the results, one origin each."""
    origins = sorted(counts)
    label = Quantity("software", "name of the software: a hash of what is known of it")
    count = Quantity("software_results", "results that stem from the software, those of a case and of its drives")
    found: dict[str, Any] = {
        label.name: (label.name, texts(origin.name for origin in origins), label.attributes),
        count.name: (label.name, np.array([counts[origin] for origin in origins], np.int64), count.attributes),
    }
    for item in fields(Origin):
        quantity = Quantity(f"software_{item.name}", f"{item.name} of the software")
        found[quantity.name] = (label.name, texts(getattr(each, item.name) for each in origins), quantity.attributes)
    return found


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
        "manifest": manifest.text,
        **{name: text for name, text in texts.items() if text is not None},
        "manifest_sha256": manifest.sha256,
        "discretization_front": f"{front.name}, sha256 {front.sha256}",
        **_makers(counts),
        **{item.name: getattr(manifest.scales, item.name) for item in fields(Scales)},
        "scales": "slab_width L_x in m, slab_depth L_y in m, shear_modulus G in Pa",
    }


def _array(values: Any) -> Any:
    return texts(values) if any(isinstance(value, str) for value in values) else np.array(values)


def _parameter(name: str) -> Quantity:
    return parameters().get(name) or Quantity(name, f"number of the {name}")


_CASE_ID: Final = Quantity("case_id", "content hash of the case's parameters")
_DRIVE: Final = Quantity("drive", "name of the drive")
