"""Results -> one labelled dataset. The same results give the same bytes, whatever computed them, when, in what order.

The root has scalars over the cases: over `intrinsic_friction`, `radius`, `aspect_ratio`, `n_x` and every further axis of
several values where the design is a full product, over `case` otherwise. Those of drives lie over `drive` too where there are
several tables of them, and over every drive axis of several values. Records, trajectories, contacts and the inside of slabs
differ in length: each sort is a group of contiguous ragged arrays, which `nanoslip.study.dataset.access` cuts apart. Who computed
them is in the group `software`.
"""

import json
import os
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import xarray as xr

from nanoslip.solver.drive import Scales
from nanoslip.study.dataset.collection.coordinates import Coordinates
from nanoslip.study.dataset.collection.entering import Entering, Finished, one_by_one, side_by_side
from nanoslip.study.dataset.collection.layout import layout_of
from nanoslip.study.dataset.collection.makers import Makers, software, software_attributes
from nanoslip.study.dataset.collection.pieces import Planned, pieces
from nanoslip.study.dataset.collection.ragged import Runs
from nanoslip.study.dataset.collection.table import Declared, Whole
from nanoslip.study.dataset.file import CHOSEN, FORMAT, VERSION
from nanoslip.study.dataset.groups import carrying
from nanoslip.study.dataset.variables import SOFTWARE, Group, all_groups
from nanoslip.study.manifest.cases import Heard, same
from nanoslip.study.manifest.checker import ManifestError
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.origin import Origin
from nanoslip.study.plan.grids import Front, chosen, load_front
from nanoslip.study.plan.tasks import needed_kinds
from nanoslip.study.results.store import Store


def collect(plan: Planned, store: Store, heard: Heard = lambda _: None, processes: int = 1) -> xr.Dataset:
    """The dataset of a campaign with its groups, finished or not: what is not computed is NaN, with the outcome `pending`.

    Raises ManifestError where two cases are the same, StoreError. heard: callback, called with the number of cases so far.
    processes: that read results, forked from this one; where runs are collected, this one reads all of them.
    """
    manifest, layout, runs = plan.manifest, layout_of(plan.manifest), _runs(plan.manifest, store.folder)
    front = load_front(manifest.front, manifest.front_text)
    declared = Declared(manifest, layout, [each.group for each in runs])
    entering = Entering(manifest, declared, front, Finished(plan, store))
    whole, labels, makers = Whole(declared), Coordinates(manifest, layout), Makers()
    entered = (
        side_by_side(entering, plan, processes) if processes > 1 and not runs else one_by_one(entering, plan, runs)
    )
    for numbers, piece in zip(pieces(plan), entered, strict=True):
        places = layout.places(numbers)
        whole.take(places, piece.numbers)
        labels.add(places, piece.ids, piece.able, piece.parameters)
        makers.add(piece.made)
        heard(numbers.stop)
    if labels.twins:
        raise ManifestError(same(manifest))
    counts, variables = makers.census(), whole.variables
    facts = _attributes(manifest, front, counts)
    root = xr.Dataset(variables, labels.found(), facts)
    return carrying(root, {each.group.name: each.dataset() for each in runs} | {SOFTWARE[0].name: software(counts)})


def _runs(manifest: Manifest, folder: Path) -> list[Runs]:
    meanwhile = folder if os.access(folder, os.W_OK) else None
    kinds = needed_kinds(manifest)
    found = []
    for group in all_groups().values():
        series = tuple(each for each in group.series if each.kind in kinds and each.ragged.wanted(manifest))
        if series:
            found.append(Runs(Group(group.name, series), meanwhile))
    return found


def _attributes(manifest: Manifest, front: Front, counts: Mapping[Origin, int]) -> dict[str, Any]:
    texts = {
        "manifest_table": manifest.table_text,
        "manifest_roughness": manifest.profile_text,
        "manifest_front": manifest.front_text,
        CHOSEN: json.dumps(grid) if manifest.accuracy is not None and (grid := chosen(manifest)) else None,
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
        **software_attributes(counts),
        **{item.name: getattr(manifest.scales, item.name) for item in fields(Scales)},
        "scales": "slab_width L_x in m, slab_depth L_y in m, shear_modulus G in Pa",
    }
