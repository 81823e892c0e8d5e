"""Results -> one labelled dataset. The same results give the same bytes, on any machine, in any order.

Scalars lie over the axes of several values if the design is a full product, else over `case`; those of drives over `drive` and
drive axes too. Records, trajectories, contacts and insides of slabs are groups of contiguous ragged arrays
(nanoslip.study.dataset.access cuts them apart). Provenance is in the group `software`.
"""

import hashlib
import json
import os
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr

from nanoslip.solver.drive import Scales
from nanoslip.solver.outcome import Outcome
from nanoslip.solver.parameter import attributes
from nanoslip.study.canonical import content_hash
from nanoslip.study.dataset.file import CHOSEN, FORMAT, MIXED, VERSION, carrying, seal_of
from nanoslip.study.dataset.table import Results, Table, coordinates, layout_of
from nanoslip.study.dataset.variables import DISCRETIZATION_ERROR, SOFTWARE, Group, Runs, all_groups, factors, texts
from nanoslip.study.manifest.cases import Heard
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.origin import Origin, Origins, all_sources_hash, census, mixture
from nanoslip.study.plan.grids import Front, chosen, load_front
from nanoslip.study.plan.kinds import needed_kinds
from nanoslip.study.plan.plan import Plan, case_outcome, drive_outcome
from nanoslip.study.results.entry import written_whole
from nanoslip.study.results.store import Store

# Which software computed the results of a dataset.


def software(counts: Mapping[Origin, int]) -> xr.Dataset:
    """The software that computed the results, one origin each."""
    origins = sorted(counts)
    names, results = (
        texts(origin.name for origin in origins),
        np.array([counts[origin] for origin in origins], np.int64),
    )
    facts = [texts(getattr(origin, item.name) for origin in origins) for item in fields(Origin)]
    columns = zip(SOFTWARE, (names, results, *facts), strict=True)
    return xr.Dataset({each.name: (SOFTWARE[0].name, values, attributes(each)) for each, values in columns})


def software_attributes(counts: Mapping[Origin, int]) -> dict[str, str]:
    """Software that computed the results, all of it if there are several, the most frequent first."""
    found = {}
    for item in fields(Origin):
        values: Counter[str] = Counter()
        for origin, count in counts.items():
            values[getattr(origin, item.name)] += count
        several = [f"{value} ({count} results)" for value, count in sorted(values.items(), key=lambda v: (-v[1], v[0]))]
        found[item.name] = ", ".join(several if len(several) > 1 else values) or "nothing is computed yet"
    mixed = mixture(counts)
    return {**found, MIXED: mixed} if mixed else found


# The results of a campaign's cases, and how their tasks ended.

Keys = Mapping[tuple[str, str], str]
"""Kind of task and label of its drive ("" without one) -> key."""


class Finished:
    """The results of a plan that are there, a case at a time, and how its tasks ended."""

    def __init__(self, plan: Plan, store: Store) -> None:
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


def collect(plan: Plan, store: Store, heard: Heard = lambda _: None) -> xr.Dataset:
    """The dataset of a campaign with its groups, finished or not: missing numbers are NaN, with the outcome `pending`.

    Raises StoreError. heard: callback, called with the number of collected cases.
    """
    manifest, layout, runs = plan.manifest, layout_of(plan.manifest), _runs(plan.manifest, store.folder)
    front = load_front(manifest.front, manifest.files.get("front"))
    table = Table(manifest, layout, [each.group for each in runs])
    finished, origins = Finished(plan, store), dict[str, Origins]()
    drives = {drive.label: drive.drive for drive in manifest.drives}
    for number, (place, case) in enumerate(zip(layout.places.tolist(), plan.cases, strict=True), 1):
        keys = plan.case_tasks[case.case_id].keys
        results = finished.results(keys)
        origins.update((result.key, result.origins) for result in results.values())
        outcomes = finished.outcomes(keys, results)
        table.enter_outcome(place, case_outcome(plan, case, outcomes))
        for drive in manifest.drives:
            table.enter_outcome(place, drive_outcome(plan, case, drive, outcomes), drive.label)
        table.enter_software(place, results)
        if case.case is not None:
            table.put(DISCRETIZATION_ERROR.name, place, "", front.expected_error(case.case))
            by = {name: factors(case.case, manifest.scales, drives.get(name)) for _, name in results}
            for (_, name), result in results.items():
                table.enter(place, case.case, name, result, by[name])
            for each in runs:
                for name in drives if each.group.driven else ("",):
                    if parts := [found for kind in each.group.kinds if (found := results.get((kind, name)))]:
                        table.put(each.group.id.name, place, name, each.add(parts, by[name], case.case_id, name))
        heard(number)
    counts = census(origins.values())  # a result counts once, however many cases share it
    root = xr.Dataset(
        table.variables(), coordinates(manifest, plan.cases, layout), _attributes(manifest, front, counts)
    )
    return carrying(root, {each.group.name: each.dataset() for each in runs} | {SOFTWARE[0].name: software(counts)})


def _runs(manifest: Manifest, folder: Path) -> list[Runs]:
    meanwhile = folder if os.access(folder, os.W_OK) else None
    kinds = needed_kinds(manifest)
    wanted = {
        group.name: tuple(each for each in group.series if each.kind in kinds and each.wanted(manifest))
        for group in all_groups().values()
    }
    return [Runs(Group(name, series), meanwhile) for name, series in wanted.items() if series]


def _attributes(manifest: Manifest, front: Front, counts: Mapping[Origin, int]) -> dict[str, Any]:
    grid = chosen(manifest) if manifest.accuracy is not None else None
    return {
        FORMAT: VERSION,
        "title": manifest.title,
        "Conventions": "CF-1.11, ACDD-1.3" if manifest.about.attributes else "CF-1.11",
        **manifest.about.attributes,
        "history": "computed and collected by nanoslip",  # without a date: the same results give the same bytes
        "manifest": manifest.text,
        **{f"manifest_{key}": text for key, text in manifest.files.items() if text is not None},
        **({CHOSEN: json.dumps(grid)} if grid else {}),
        "manifest_sha256": manifest.sha256,
        "discretization_front": f"{front.name}, sha256 {front.sha256}",
        **software_attributes(counts),
        **{item.name: getattr(manifest.scales, item.name) for item in fields(Scales)},
        "scales": "slab_width L_x in m, slab_depth L_y in m, shear_modulus G in Pa",
    }


# Whether a dataset's file is up to date with the results on disk. If so, they need not be collected again.

NOTE: Final = "dataset.json"
"""File among the results that says what the dataset beside them was made of."""


def made_of(manifest: Manifest, store: Store) -> str:
    """A hash of all that decides a dataset: the campaign, its results and failures, and the code that collects them."""
    front = load_front(manifest.front, manifest.files.get("front"))
    texts = (manifest.text, *manifest.files.items(), front.sha256)
    found = hashlib.sha256(content_hash(all_sources_hash(), manifest.path.name, *texts).encode())
    for key, seal in store.seals():
        found.update(f"{key} {seal}\n".encode())
    for key, attempt in sorted(store.failures().items()):
        found.update(f"{key} {attempt.outcome}\n".encode())
    return found.hexdigest()


def is_made_of(path: Path, store: Store, expected: str) -> bool:
    """Whether the file is the one that was last written, of just these results. Its bytes are checked when it is opened."""
    try:
        if not (store.folder / NOTE).is_file():  # to read a pipe would never end
            return False
        said = json.loads((store.folder / NOTE).read_text("utf-8"))
        return bool(said == _said(path, expected))
    except (OSError, ValueError, RecursionError):
        return False


def note(path: Path, store: Store, made: str) -> None:
    """Record the results that the file was made of; without the record it is collected again next time."""
    with suppress(OSError), written_whole(store.folder / NOTE) as scratch:
        scratch.write_text(json.dumps(_said(path, made)), "utf-8")


def _said(path: Path, made: str) -> dict[str, object]:
    return {"made_of": made, "seal": seal_of(path), "bytes": path.stat().st_size}
