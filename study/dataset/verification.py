"""A dataset computed again from itself alone: its manifest -> plan -> tasks -> dataset, and both side by side.

Each case is *bit-identical*, *within tolerance* or *different*. Within tolerance is every number within `ROUNDING` of its
variable's scale, the largest magnitude that was recomputed; texts and whole numbers must be the same, but for the advice of a
`message`. Two things are chains of decisions, which a last digit may turn: a record, seldom, and a drive over its teeth, often.

- A record took another path where half or more of the case's numbers over it differ. What precedes sliding still has to agree
  as before; what states an uncertainty (plateau, mean step, μ_s, μ_k) agrees within `STANDARD_ERRORS` combined ones, or within
  `LITTLE` of its scale where its uncertainty is unknown; the rest is not compared.
- A drive may have taken another path only where last digits moved all over the case: where half or more of its numbers
  have other bits. Then of the drive only what states an uncertainty has to agree, as above.

One wrong number in a file is never taken for either.
"""

import hashlib
import itertools
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr

from nanoslip.study.dataset import file
from nanoslip.study.dataset.collection.collect import collect
from nanoslip.study.dataset.collection.layout import Layout, layout_of
from nanoslip.study.dataset.groups import loaded
from nanoslip.study.dataset.pair import Finding, Pair, Shared, finding_of, place_of
from nanoslip.study.dataset.variables import OUTCOMES
from nanoslip.study.manifest.cases import CampaignCase
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.reader import parse_manifest
from nanoslip.study.origin import Origin, computing
from nanoslip.study.plan.plan import NOTHING_KNOWN, PENDING, Plan, make_plan, plan_of
from nanoslip.study.plan.task import Task
from nanoslip.study.provenance import UNKNOWN
from nanoslip.study.results.store import Store, StoreError

_BESIDE: Final = ("table", "roughness", "front")
"""Keys of a manifest that name a file, whose text is the attribute manifest_<key>."""
_BOM: Final = b"\xef\xbb\xbf"


class NotVerifiableError(StoreError):
    """The file is nothing that can be computed again; the message says which and why."""


def rebuilt(found: xr.Dataset, path: Path) -> Plan:
    """The plan that a dataset carries with it. Raises NotVerifiableError, ManifestError."""
    facts = found.attrs
    if file.is_older(found):
        maker = f"nanoslip {facts.get('nanoslip_version', UNKNOWN)}, commit {facts.get('source_commit', UNKNOWN)}"
        raise NotVerifiableError(
            f"{path}: has format {facts[file.FORMAT]}, whose numbers this nanoslip does not compute again: "
            f"needs the one that did ({maker})"
        )
    if "manifest" not in facts or not {"case_id", OUTCOMES[""][0].name} <= set(found.variables):
        raise NotVerifiableError(f"{path}: no dataset of nanoslip: needs a manifest and cases")
    beside = {key: str(facts[f"manifest_{key}"]) for key in _BESIDE if f"manifest_{key}" in facts}
    _untouched(path, facts, beside)
    # A byte order mark is no part of the text, but it was hashed.
    manifest = replace(parse_manifest(path, str(facts["manifest"]), beside), sha256=str(facts["manifest_sha256"]))
    if manifest.drives and OUTCOMES["drive"][0].name not in found:
        raise NotVerifiableError(f"{path}: {OUTCOMES['drive'][0].name}: missing: needs how its drives ended")
    return _planned(manifest, facts, path)


def _untouched(path: Path, facts: Mapping[str, Any], beside: Mapping[str, str]) -> None:
    """Raise NotVerifiableError unless the texts are those that were hashed; files may have begun with a byte order mark."""
    parts = [str(facts["manifest"]), *(beside[key] for key in ("table", "roughness") if key in beside)]
    for marks in itertools.product((b"", _BOM), repeat=len(parts)):
        content = b"".join(mark + part.encode() for mark, part in zip(marks, parts, strict=True))
        if hashlib.sha256(content).hexdigest() == facts.get("manifest_sha256"):
            return
    names = ", ".join(["manifest", *(f"manifest_{key}" for key in ("table", "roughness") if key in beside)])
    raise NotVerifiableError(f"{path}: {names}: not what manifest_sha256 is of: changed after it was written")


def _planned(manifest: Manifest, facts: Mapping[str, Any], path: Path) -> Plan:
    """The plan, with what was chosen then: this package's own front may choose otherwise now."""
    if manifest.accuracy is None:
        return make_plan(manifest)
    try:
        chosen = dict(json.loads(facts[file.CHOSEN]))
    except (KeyError, ValueError, TypeError):
        raise NotVerifiableError(f"{path}: {file.CHOSEN}: missing or damaged: needs what its accuracy chose") from None
    return plan_of(replace(manifest, numerics={**manifest.numerics, **chosen}))


def other_software(found: xr.Dataset) -> str:
    """Who computed the dataset, and who recomputes it, where they may not make the same bits; else empty."""
    origin = Origin(**{item.name: str(found.attrs.get(item.name, UNKNOWN)) for item in fields(Origin)})
    home = computing()
    if origin.alike(home):
        said = f"computed with {origin.arithmetic}; recomputed with {home.arithmetic}: last bits may differ"
        return "" if origin.same_bits(home) else said
    return f"computed by {origin}; recomputed by {home}"


def computed(plan: Plan, found: xr.Dataset) -> tuple[CampaignCase, ...]:
    """The cases that the dataset has a result of."""
    endings = dict(zip(found["case_id"].values.ravel(), _endings(found, "").values.ravel(), strict=True))
    return tuple(case for case in plan.cases if endings.get(case.case_id) != PENDING)


def failed(plan: Plan, found: xr.Dataset) -> int:
    """How many cases have no result as an attempt at one has failed: time, memory, a process that died."""
    names = [case.case_id for case in plan.cases]
    without = (_endings(found, "") == PENDING) & (found[OUTCOMES[""][0].name] != PENDING)
    return int((without & found["case_id"].isin(names)).sum())


def sample(cases: Sequence[CampaignCase], count: int | None) -> tuple[CampaignCase, ...]:
    """So many of the cases, evenly spread from the first to the last: the same ones every time; None: all."""
    if count is None or count >= len(cases):
        return tuple(cases)
    places = np.linspace(0, len(cases) - 1, count) if count > 1 else np.zeros(count)
    return tuple(cases[round(place)] for place in places)


def tasks_of(plan: Plan, cases: Sequence[CampaignCase], found: xr.Dataset) -> tuple[Task, ...]:
    """The tasks that these cases' part of the dataset is made of, and what they need, needs first."""
    wanted: set[str] = set()
    layout = layout_of(plan.manifest)
    for case in cases:
        keys = plan.case_tasks[case.case_id]
        pending = _pending_drives(layout, found, case) if keys.drives else set()
        wanted |= {key for (_, drive), key in keys.keys.items() if drive not in pending}
    for task in reversed(plan.tasks):
        if task.key in wanted:
            wanted |= set(task.needs)
    return tuple(task for task in plan.tasks if task.key in wanted)


def _pending_drives(layout: Layout, found: xr.Dataset, case: CampaignCase) -> set[str]:
    """Labels of the drives of a case that the dataset has no result of, as they are pending or failed."""
    place = place_of(found, case.case_id)
    endings = _endings(found, "drive").isel(place or {}).values
    if place is None or endings.shape != tuple(len(values) for values in layout.drive_axes.values()):
        return set()  # another manifest's dataset, as comparing it will tell
    return {label for label, position in layout.drive_position.items() if endings[position] == PENDING}


def _endings(found: xr.Dataset, kind: str) -> xr.DataArray:
    """How cases ("") or drives ended; pending is, too, what ended for a reason that says nothing of them.

    Time, memory, a process that died: another attempt may end otherwise, and so may what needed that one.
    """
    endings = found[OUTCOMES[kind][0].name]
    return endings.where(~endings.isin(NOTHING_KNOWN), PENDING)


def _as_pending(found: xr.Dataset) -> xr.Dataset:
    """The dataset with these endings; what is pending has no message."""
    changed = {}
    for kind, (outcome, message) in OUTCOMES.items():
        if outcome.name in found:
            changed[outcome.name] = endings = _endings(found, kind)
            changed[message.name] = found[message.name].where(endings != PENDING, "")
    return found.assign(changed)


def compare(found: xr.Dataset, plan: Plan, cases: Sequence[CampaignCase], store: Store) -> Iterator[Finding]:
    """Compare the dataset with the results in `store`: first what all cases share, then case by case."""
    path = store.folder / file.FILE
    file.write(collect(plan, store), path)  # what is read has the types that a file gives it
    with file.read(path) as opened_again:
        again, found = loaded(opened_again), _as_pending(found)
        if len(cases) == len(computed(plan, found)):
            found = loaded(found)  # a run at a time would take longer
        shared = Shared(found, again)
        differences = shared.differences()
        yield finding_of("what all cases share", differences)
        if not shared.comparable:
            return
        pair = Pair(found, again, shared.left_out)
        for case in cases:
            pair.look(case)
        yield from map(pair.finding, cases)
