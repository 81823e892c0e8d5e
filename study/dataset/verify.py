"""Two datasets beside each other, what both have and whether it agrees; and a dataset computed again from itself alone."""

import hashlib
import itertools
import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr

from nanoslip.solver.drive import Scales
from nanoslip.solver.parameter import GRID_ERROR
from nanoslip.study.canonical import content_hash
from nanoslip.study.dataset import file
from nanoslip.study.dataset.access import values_over
from nanoslip.study.dataset.collect import collect
from nanoslip.study.dataset.compare import (
    ROUNDING,
    Finding,
    Shared,
    Verdict,
    finding_of,
    identical,
    magnitude,
    place_of,
)
from nanoslip.study.dataset.compare import Pair as Twice
from nanoslip.study.dataset.file import FORMAT, is_older, loaded
from nanoslip.study.dataset.table import Layout, layout_of
from nanoslip.study.dataset.variables import (
    COMPUTED_BY,
    DRIVE,
    DRIVE_NAME,
    MEMBERS,
    MODEL,
    OUTCOMES,
    all_groups,
    companions,
    counted,
    parameters,
    scalars,
)
from nanoslip.study.manifest.cases import CampaignCase, expand
from nanoslip.study.manifest.checker import shown
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.parameters import HASHED, NAMED, TABLES, Value, words_of
from nanoslip.study.manifest.reader import parse_manifest
from nanoslip.study.origin import Origin, computing
from nanoslip.study.plan.plan import NOTHING_KNOWN, PENDING, Plan, make_plan, plan_of
from nanoslip.study.plan.task import Task
from nanoslip.study.provenance import UNKNOWN
from nanoslip.study.results.store import Store, StoreError
from nanoslip.study.toml_text import from_toml

# The cases that two datasets share: those with the same values of every parameter that varies in either.

KINDS: Final = ("", "drive")
"""What rows are of: cases, or cases with a drive."""
_MEMBER: Final = "member"
"""The dimension of the members of an ensemble in format 3."""
Pair = tuple[xr.Dataset, xr.Dataset]
"""Two datasets."""


class NotComparableError(ValueError):
    """Two datasets that have nothing to compare; the message says why."""


@dataclass(frozen=True, slots=True)
class Matched:
    """Rows of two datasets side by side."""

    axes: tuple[str, ...]
    """Parameters that tell the rows of either apart."""
    labels: tuple[dict[str, Value], ...]
    """Of each shared row: its values on the axes."""
    rows: tuple[tuple[int, int], ...]
    """Of each shared row: its place in the first and in the second dataset."""
    only: tuple[tuple[dict[str, Value], ...], tuple[dict[str, Value], ...]]
    """Labels of the rows that the first, and the second, has alone."""
    pending: int
    """Shared rows that are left out, as either is not computed yet, or failed without a result."""


def over_members(root: xr.Dataset) -> xr.Dataset:
    """A dataset with each ensemble as one case: in format 3 members are cases. Means have their ±, texts are counted.

    A number that has no mean over members is left out; a parameter of several values, as `start`, is the first member's.
    """
    if _MEMBER not in root.dims:
        return root
    of_members = {str(name): each for name, each in root.data_vars.items() if _MEMBER in each.dims}
    texts = {name: each for name, each in of_members.items() if each.dtype.kind in "OU"}
    names = {"members_used": MEMBERS.name}
    for name in of_members:
        names |= {f"{name}_ensemble_mean": name, f"{name}_ensemble_uncertainty": f"{name}_uncertainty"}
    found = root.drop_vars(of_members.keys() - texts.keys()).rename(
        {theirs: ours for theirs, ours in names.items() if theirs in root}
    )
    return found.assign({name: _counted(each) for name, each in texts.items()}).isel({_MEMBER: 0}, drop=True)


def _counted(texts: xr.DataArray) -> xr.DataArray:
    found: xr.DataArray = xr.apply_ufunc(
        counted, texts, input_core_dims=[[_MEMBER]], vectorize=True, output_dtypes=[object]
    )
    return found


def matched(pair: Pair, kind: str) -> Matched:
    """The rows of cases ("") or drives that both datasets have. Raises NotComparableError where rows cannot be told apart."""
    names = axes(pair, kind)
    places = [_places(root, kind, names) for root in pair]
    endings = [values_over(ending_of(root, kind), ending_of(root, kind)) for root in pair]
    shared = [(key, (place, places[1][key])) for key, place in places[0].items() if key in places[1]]
    done = [(key, at) for key, at in shared if not {endings[0][at[0]], endings[1][at[1]]} & set(NOTHING_KNOWN)]
    only = [
        tuple(_label(names, key) for key in mine if key not in theirs) for mine, theirs in (places, reversed(places))
    ]
    labels = tuple(_label(names, key) for key, _ in done)
    return Matched(names, labels, tuple(at for _, at in done), (only[0], only[1]), len(shared) - len(done))


def axes(pair: Pair, kind: str) -> tuple[str, ...]:
    """The parameters of cases or drives that have several values in either dataset."""
    return tuple(
        name
        for name in (*parameters(), DRIVE_NAME.name)
        if any(len(values(root, name)) > 1 and _along(root, name, kind) for root in pair)
    )


def values(root: xr.Dataset, name: str) -> list[Value]:
    """The different values of a parameter in a dataset; none where it has no such parameter."""
    found = root[name].values.ravel().tolist() if name in root.coords else []
    return list(dict.fromkeys(value for value in found if not _missing(value)))


def ending_of(root: xr.Dataset, kind: str) -> xr.DataArray:
    """How the rows ended: what lies along all their dimensions."""
    return root[OUTCOMES[kind][0].name]


def _along(root: xr.Dataset, name: str, kind: str) -> bool:
    return name in root.coords and set(root[name].dims) <= set(ending_of(root, kind).dims)


def _places(root: xr.Dataset, kind: str, names: Sequence[str]) -> dict[tuple[Any, ...], int]:
    """Values on the axes -> where the row is."""
    keys = list(_keys(root, kind, names))
    found = {key: place for place, key in enumerate(keys)}
    if len(found) < len(keys):
        raise NotComparableError(f"cases are not told apart by {', '.join(names) or 'any parameter'}")
    return found


def _keys(root: xr.Dataset, kind: str, names: Sequence[str]) -> Iterator[tuple[Any, ...]]:
    over = ending_of(root, kind)
    columns = [values_over(root[name], over) if _along(root, name, kind) else [None] * over.size for name in names]
    for place in range(over.size):
        yield tuple(None if _missing(column[place]) else column[place] for column in columns)


def _label(names: Sequence[str], key: Sequence[Any]) -> dict[str, Value]:
    return {name: value for name, value in zip(names, key, strict=True) if value is not None}


def _missing(value: object) -> bool:
    return value is None or value == "" or value != value  # noqa: PLR0124  only NaN is not itself


# Whether the numbers of shared cases agree: the same bits, within their uncertainties, or beyond them.

STANDARD_DEVIATIONS: Final = 2.0
"""Combined ones by which two numbers may differ and still agree."""
TELLING: Final = 4
"""Members of each ensemble from which on it tells that all of one say another word than all of the other.

Were both words as likely in both, four and four members would be apart like that 2 times in 70: less often than two numbers
are by `STANDARD_DEVIATIONS`.
"""
_COUNTED: Final = re.compile(r"\d+ ")
"""How words begin on which members do not agree."""


Judged = tuple[Verdict | None, float]
"""A verdict, and how far apart both are, as `Observed` has them."""
_APART: Final[Judged] = (Verdict.DIFFERENT, math.inf)
"""Of what cannot be subtracted."""
_NOT_KNOWN: Final[Judged] = (None, math.nan)


@dataclass(frozen=True, slots=True)
class Observed:
    """One number or word of one shared case, in both datasets."""

    label: dict[str, Value]
    name: str
    values: tuple[Any, Any]
    verdict: Verdict | None
    """None where they differ, and how uncertain one of them is, is not known; of an ensemble a missing number and most words."""
    apart: float
    """Difference in combined standard deviations; infinite where one is missing or a word, NaN where these are not known."""


def observed(pair: Pair, kind: str, found: Matched) -> Iterator[Observed]:
    """Every number that states an uncertainty, and every word, of the shared cases ("") or drives."""
    for name in _names(pair, kind):
        if _judged(pair, name):
            columns = [_values(root, kind, name) for root in pair]
            errors = [_errors(root, kind, name) for root in pair]
            members = [_members(root, kind) for root in pair]
            scale = magnitude(np.array(columns[0] + columns[1])) if _number(pair, name) else 0.0
            for label, at in zip(found.labels, found.rows, strict=True):
                both = columns[0][at[0]], columns[1][at[1]]
                of_both = members[0][at[0]], members[1][at[1]]
                verdict = _verdict(both, (errors[0][at[0]], errors[1][at[1]]), scale)
                yield Observed(label, name, both, *(_NOT_KNOWN if _by_chance(both, verdict, of_both) else verdict))


def unjudged(pair: Pair, kind: str, found: Matched) -> tuple[list[str], list[str]]:
    """The numbers that state no uncertainty: those that differ in any shared case, and those that do not."""
    differing: list[str] = []
    same: list[str] = []
    for name in _names(pair, kind):
        if not _judged(pair, name):
            columns = [_values(root, kind, name) for root in pair]
            picked = [np.array([column[at[side]] for at in found.rows]) for side, column in enumerate(columns)]
            (same if identical(*picked) else differing).append(name)
    return differing, same


def _names(pair: Pair, kind: str) -> list[str]:
    """The variables of cases or drives that both have; not those that are said of another, or say who computed it."""
    of_drives = {each.name for known in (scalars(DRIVE), companions(DRIVE)) for each in known.values()}
    of_drives |= {each.name for each in OUTCOMES[DRIVE]}
    apart = {each.name for each in COMPUTED_BY.values()} | {message.name for _, message in OUTCOMES.values()}
    apart |= {group.id.name for group in all_groups().values()} | {"advice", GRID_ERROR}
    both = [str(name) for name in pair[0].data_vars if name in pair[1].data_vars and name not in apart]
    told = ("_uncertainty", "members")
    return [name for name in both if (name in of_drives) == bool(kind) and not name.endswith(told)]


def _judged(pair: Pair, name: str) -> bool:
    return not _number(pair, name) or all(_error_of(root, name) for root in pair)


def _number(pair: Pair, name: str) -> bool:
    return pair[0][name].dtype.kind in "fiub"


def _values(root: xr.Dataset, kind: str, name: str) -> list[Any]:
    return values_over(root[name], ending_of(root, kind))


def _error_of(root: xr.Dataset, name: str) -> str:
    """The variable that says how uncertain another is; empty where none does."""
    error = f"{name}_uncertainty"
    return error if error in root else ""


def _errors(root: xr.Dataset, kind: str, name: str) -> list[float]:
    """The ± that a dataset states; NaN where none is known."""
    error = _error_of(root, name)
    if not error:
        return [math.nan] * ending_of(root, kind).size
    return values_over(root[error], ending_of(root, kind))


def _members(root: xr.Dataset, kind: str) -> list[float]:
    """How many members each row is of; NaN where it is one case."""
    if MEMBERS.name in root:
        return values_over(root[MEMBERS.name], ending_of(root, kind))
    return [math.nan] * ending_of(root, kind).size


def _by_chance(both: tuple[Any, Any], verdict: Judged, members: tuple[float, float]) -> bool:
    """Whether what cannot be subtracted may differ for the choice of members alone."""
    if verdict != _APART or all(map(math.isnan, members)):
        return False
    if not all(isinstance(value, str) for value in both):
        return any(value != value for value in both)  # noqa: PLR0124  only NaN is not itself
    return any(map(_COUNTED.match, both)) or not all(count >= TELLING for count in members)


def _verdict(both: tuple[Any, Any], errors: tuple[float, float], scale: float) -> Judged:
    here, there = (np.array(value) for value in both)
    if identical(here, there):
        return Verdict.IDENTICAL, 0.0
    difference = abs(both[0] - both[1]) if here.dtype.kind in "fiu" else math.nan
    if math.isnan(difference):
        return _APART
    known = [error for error in errors if not math.isnan(error)]
    combined = math.hypot(*known)
    apart = difference / combined if combined > 0.0 else math.inf
    if difference <= ROUNDING * scale or apart <= STANDARD_DEVIATIONS:
        return Verdict.WITHIN, apart
    return (Verdict.DIFFERENT, apart) if len(known) == len(errors) else _NOT_KNOWN


# Differences in the origin of two datasets: parameters, keys of their campaigns, scales, software and what ± means.

_NO_FACTS: Final = ("title", "axes", "drives", "drive_axes", "scales", *TABLES)
"""Parts of a campaign whose values are parameters or scales, which are compared as what they came to."""


@dataclass(frozen=True, slots=True)
class Fact:
    """A parameter, key, scale or software that differs between two datasets."""

    name: str
    values: tuple[str, str]
    """As text; `–` where one says nothing of it."""


def differing(pair: Pair) -> list[Fact]:
    """Parameters, other keys of the campaigns, files that they name, scales and software that differ."""
    said = [dict(_said(root)) for root in pair]
    names = dict.fromkeys([*said[0], *said[1]])
    both = {name: (said[0].get(name, "–"), said[1].get(name, "–")) for name in names}
    return [Fact(name, value) for name, value in both.items() if value[0] != value[1]]


def meaning(pair: Pair) -> str:
    """What ± is where it is not in both what it is today; else empty."""
    older, today = (
        " and ".join(
            f"{name} (format {root.attrs[FORMAT]})"
            for name, root in zip("AB", pair, strict=True)
            if is_older(root) is old
        )
        for old in (True, False)
    )
    if not older:
        return ""
    other = f", that of {today} the 68 % interval over independent starts" if today else ""
    return f"± of {older} is {MODEL}{other}: either is taken for one standard deviation"


def _said(root: xr.Dataset) -> Iterator[tuple[str, str]]:
    """Name and text of every fact of a dataset."""
    for name in (*parameters(), DRIVE_NAME.name):
        if found := values(root, name):
            yield name, ", ".join(map(_word, found[:6])) + (f", … ({len(found)} values)" if len(found) > 6 else "")
    for key, value in _keys_of_facts(from_toml(str(root.attrs.get("manifest", "")))):
        yield key, shown(value)
    for name in (f"manifest_{key}" for key in HASHED):
        if name in root.attrs:
            yield name, f"a file of hash {content_hash(root.attrs[name], length=12)}"
    for name in ("discretization_front", *(item.name for kind in (Scales, Origin) for item in fields(kind))):
        if name in root.attrs:
            yield name, str(root.attrs[name])


def _word(value: Value) -> str:
    """A value of a parameter; switches as manifests have them."""
    return shown(value) if isinstance(value, bool) else str(value)


def _keys_of_facts(document: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """The keys of a campaign file that are no parameters: `stages`, `ensemble.members`, `outputs.records`, `limits.seconds`."""
    for key, value in document.items():
        if isinstance(value, Mapping) and (key in TABLES or key not in _NO_FACTS):
            known = words_of(key) if key in TABLES else ()
            yield from ((f"{key}.{inner}", each) for inner, each in value.items() if inner not in known)
        elif key not in _NO_FACTS:
            yield key, value


# A dataset computed again from itself alone: its manifest -> plan -> tasks -> dataset, and both side by side.
#
# Each case is *bit-identical*, *within tolerance* or *different*. Within tolerance is every number within `ROUNDING` of its
# variable's scale, the largest magnitude that was recomputed; texts and whole numbers must be the same, but for the advice of a
# `message`. Two things are chains of decisions, which a last digit may turn: a record, seldom, and a drive over its teeth,
# often.
#
# - A record took another path where half or more of the case's numbers over it differ. What precedes sliding still
# has to agree
#   as before; what states an uncertainty (plateau, mean step, μ_s, μ_k) agrees within `STANDARD_ERRORS` combined
# ones, or within
#   `LITTLE` of its scale where its uncertainty is unknown; the rest is not compared.
# - A drive may have taken another path only where last digits moved all over the case: where half or more of its
# numbers
#   have other bits. Then of the drive only what states an uncertainty has to agree, as above.
#
# One wrong number in a file is never taken for either.

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
    beside = {key: str(facts[f"manifest_{key}"]) for key in NAMED if f"manifest_{key}" in facts}
    _untouched(path, facts, beside)
    # A byte order mark is no part of the text, but it was hashed.
    manifest = replace(parse_manifest(path, str(facts["manifest"]), beside), sha256=str(facts["manifest_sha256"]))
    if manifest.drives and OUTCOMES["drive"][0].name not in found:
        raise NotVerifiableError(f"{path}: {OUTCOMES['drive'][0].name}: missing: needs how its drives ended")
    return _planned(manifest, facts, path)


def _untouched(path: Path, facts: Mapping[str, Any], beside: Mapping[str, str]) -> None:
    """Raise NotVerifiableError unless the texts are those that were hashed; files may have begun with a byte order mark."""
    parts = {"manifest": str(facts["manifest"])}
    parts |= {f"manifest_{key}": beside[key] for key in HASHED if key in beside}
    for marks in itertools.product((b"", _BOM), repeat=len(parts)):
        content = b"".join(mark + part.encode() for mark, part in zip(marks, parts.values(), strict=True))
        if hashlib.sha256(content).hexdigest() == facts.get("manifest_sha256"):
            return
    raise NotVerifiableError(
        f"{path}: {', '.join(parts)}: not what manifest_sha256 is of: changed after it was written"
    )


def _planned(manifest: Manifest, facts: Mapping[str, Any], path: Path) -> Plan:
    """The plan, with what was chosen then: this package's own front may choose otherwise now."""
    if manifest.accuracy is None:
        return make_plan(manifest)
    try:
        chosen = dict(json.loads(facts[file.CHOSEN]))
    except (KeyError, ValueError, TypeError):
        raise NotVerifiableError(f"{path}: {file.CHOSEN}: missing or damaged: needs what its accuracy chose") from None
    manifest = manifest.discretized(chosen)
    return plan_of(manifest, expand(manifest))


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
        pair = Twice(found, again, shared.left_out)
        for case in cases:
            pair.look(case)
        yield from map(pair.finding, cases)
