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
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from study.dataset import file
from study.dataset.collect import collect
from study.dataset.comparison import (
    ROUNDING,
    STANDARD_ERRORS,
    Difference,
    Verdict,
    compared,
    identical,
    magnitude,
    relative,
    within_uncertainty,
    worst,
)
from study.dataset.ragged import ABSENT
from study.dataset.store import Store, StoreError
from study.dataset.variables import COMPANIONS, COMPUTED_BY, DISCRETIZATION_ERROR, OUTCOMES, SCALARS, SERIES, Series
from study.manifest.cases import CampaignCase
from study.manifest.manifest import Manifest
from study.manifest.reader import parse_manifest
from study.origin import Origin, here
from study.plan.plan import Plan, make_plan
from study.plan.tasks import Task
from study.provenance import UNKNOWN

LITTLE: Final = 1e-2
"""Share of its scale by which a number may differ that took another path and does not know its uncertainty."""
_NOT_COMPARED: Final = "not compared"
_BESIDE: Final = ("table", "roughness", "front")
"""Keys of a manifest that name a file, whose text is the attribute manifest_<key>."""
_BOM: Final = b"\xef\xbb\xbf"
_SOFTWARE: Final = {quantity.name for quantity in COMPUTED_BY.values()}
_ADVICE: Final = {message.name for _, message in OUTCOMES.values()}


class NotVerifiableError(StoreError):
    """The file is nothing that can be computed again; the message says which and why."""


@dataclass(frozen=True, slots=True)
class Finding:
    """What came of one case, or of what all cases share."""

    label: str
    verdict: Verdict
    remark: str


@contextmanager
def opened(path: Path) -> Iterator[xr.Dataset]:
    """A dataset to be verified. Raises StoreError where it cannot be opened, NotVerifiableError where not read."""
    with file.read(path) as found:
        try:
            yield found
        except (OSError, RuntimeError) as error:  # what netCDF raises when bytes are missing or wrong
            raise NotVerifiableError(f"{path}: cannot be read: {error}") from error


def rebuilt(found: xr.Dataset, path: Path) -> Plan:
    """The plan that a dataset carries with it. Raises NotVerifiableError, ManifestError."""
    facts = found.attrs
    if "manifest" not in facts or not {"case_id", OUTCOMES[""][0].name} <= set(found.variables):
        raise NotVerifiableError(f"{path}: no dataset of nanoslip: needs a manifest and cases")
    if facts.get(file.FORMAT) != file.VERSION:
        has = f"format {facts[file.FORMAT]}" if file.FORMAT in facts else "no format, being older"
        raise NotVerifiableError(
            f"{path}: has {has}: this nanoslip verifies format {file.VERSION}; collect the campaign again with this one"
        )
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
    """The plan, on the grid that was chosen then: this package's own front may choose another now."""
    if manifest.accuracy is None:
        return make_plan(manifest)
    try:
        chosen = dict(json.loads(facts[file.CHOSEN]))
    except (KeyError, ValueError, TypeError):
        raise NotVerifiableError(f"{path}: {file.CHOSEN}: missing or damaged: needs the grid of its accuracy") from None
    plan = make_plan(replace(manifest, accuracy=None, numerics={**manifest.numerics, **chosen}))
    return replace(plan, manifest=replace(plan.manifest, accuracy=manifest.accuracy))


def other_software(found: xr.Dataset) -> str:
    """Who computed the dataset, and who recomputes it, where that is not the same software; else empty."""
    origin = Origin(**{item.name: str(found.attrs.get(item.name, UNKNOWN)) for item in fields(Origin)})
    return "" if origin.alike(here()) else f"computed by {origin}; recomputed by {here()}"


def computed(plan: Plan, found: xr.Dataset) -> tuple[CampaignCase, ...]:
    """The cases that the dataset has results of."""
    endings = dict(zip(found["case_id"].values.ravel(), found["outcome"].values.ravel(), strict=True))
    return tuple(case for case in plan.cases if endings.get(case.case_id) != file.PENDING)


def sample(cases: Sequence[CampaignCase], count: int | None) -> tuple[CampaignCase, ...]:
    """So many of the cases, evenly spread from the first to the last: the same ones every time; None: all."""
    if count is None or count >= len(cases):
        return tuple(cases)
    places = np.linspace(0, len(cases) - 1, count) if count > 1 else np.zeros(count)
    return tuple(cases[round(place)] for place in places)


def tasks_of(plan: Plan, cases: Sequence[CampaignCase], found: xr.Dataset) -> tuple[Task, ...]:
    """The tasks that these cases' part of the dataset is made of, and what they need, needs first."""
    wanted: set[str] = set()
    for case in cases:
        keys = plan.case_tasks[case.case_id]
        wanted |= {key for key in (keys.contact, keys.friction, keys.states) if key is not None}
        wanted |= {key for name, key in keys.drives.items() if not _drive_pending(found, case, name)}
    for task in reversed(plan.tasks):
        if task.key in wanted:
            wanted |= set(task.needs)
    return tuple(task for task in plan.tasks if task.key in wanted)


def _drive_pending(found: xr.Dataset, case: CampaignCase, drive: str) -> bool:
    ending = found[OUTCOMES["drive"][0].name].isel(_place(found, case.case_id) or {})
    if "drive" in ending.dims:
        ending = ending.isel(drive=found["drive"].values.tolist().index(drive))
    return bool(np.any(ending.values == file.PENDING))


def compare(found: xr.Dataset, plan: Plan, cases: Sequence[CampaignCase], store: Store) -> Iterator[Finding]:
    """The dataset beside what `store` says now: first what all cases share, then case by case."""
    path = store.folder / file.FILE
    file.write(collect(plan, store), path)  # what is read has the types that a file gives it
    with file.read(path) as again:
        again.load()
        if len(cases) == len(computed(plan, found)):
            found.load()  # a run at a time would take longer
        shared = _Shared(found, again)
        differences = shared.differences()
        yield _finding("what all cases share", differences)
        if not shared.comparable:
            return
        pair = _Pair(found, again, shared.left_out, _missing(found, plan, cases))
        for case in cases:
            pair.look(case)
        yield from map(pair.finding, cases)


def _missing(found: xr.Dataset, plan: Plan, cases: Sequence[CampaignCase]) -> NDArray[np.bool_]:
    """Mask over the cases of those that the dataset has and that were not recomputed."""
    names = {case.case_id for case in computed(plan, found)} - {case.case_id for case in cases}
    return np.isin(found["case_id"].values.astype(str), sorted(names))


def _finding(label: str, differences: Sequence[Difference], remark: str = "") -> Finding:
    verdict = worst(differences)
    told = sorted((each for each in differences if each.verdict == verdict), key=lambda each: -each.size)
    if verdict is Verdict.IDENTICAL:
        return Finding(label, verdict, remark)
    others = list(dict.fromkeys(each.name for each in told if each.name != told[0].name))
    more = f", and {len(others)} more: " + ", ".join(others[:3]) if others else ""
    dots = ", ..." if len(others) > 3 else ""
    return Finding(label, verdict, "; ".join(part for part in (remark, f"{told[0]}{more}{dots}") if part))


class _Shared:
    """Attributes, coordinates and the variables that there are at all."""

    def __init__(self, found: xr.Dataset, again: xr.Dataset) -> None:
        self._found, self._again = found, again
        same_front = found.attrs.get(_FRONT) == again.attrs.get(_FRONT)
        # A later package may come with a front measured anew: what it says of a grid is then another estimate.
        self.left_out = set() if same_front or "manifest_front" in again.attrs else {DISCRETIZATION_ERROR.name}

    @property
    def comparable(self) -> bool:
        """Whether the cases lie in the same places."""
        both = set(self._found.variables) & set(self._again.variables)
        lying = all(self._found[name].dims == self._again[name].dims for name in both)
        return lying and identical(self._found["case_id"].values, self._again["case_id"].values)

    def differences(self) -> list[Difference]:
        found, again = self._found, self._again
        names = {str(name) for name in (*found.variables, *again.variables)}
        missing = [_odd(name, "is missing") for name in sorted(names) if name not in found.variables]
        strange = [
            _odd(name, "is in no dataset of this manifest") for name in sorted(names) if name not in again.variables
        ]
        common = [name for name in sorted(names) if name in found.variables and name in again.variables]
        words = [
            compared(f"{kind} of {name}", np.array(one), np.array(other))
            for name in common
            for kind, one, other in _properties(found[name], again[name])
        ]
        values = [compared(name, found[name].values, again[name].values) for name in common if self._for_all(name)]
        return [*missing, *strange, *words, *self._attributes(), *values]

    def _for_all(self, name: str) -> bool:
        """Whether a variable belongs to no case, no run and no software alone."""
        dims = {str(dim) for dim in self._again[name].dims}
        apart = {"software"} | {part for series in SERIES for part in (series.instance, series.sample)}
        along = {str(dim) for dim in self._again["case_id"].dims}
        return not dims & apart and (name in self._again.coords or not dims & along)

    def _attributes(self) -> list[Difference]:
        apart = {item.name for item in fields(Origin)} | {file.MIXED} | ({_FRONT} if self.left_out else set())
        kept = self._found.attrs
        return [
            compared(f"attribute {name}", np.array(kept[name]), np.array(value))
            if name in kept
            else _odd(f"attribute {name}", "is missing")
            for name, value in self._again.attrs.items()
            if name not in apart
        ]


_FRONT: Final = "discretization_front"


class _Pair:
    """A dataset and the same one computed again, case by case."""

    def __init__(self, found: xr.Dataset, again: xr.Dataset, left_out: set[str], missing: NDArray[np.bool_]) -> None:
        """missing: over the cases, those that the dataset has and that were not recomputed."""
        self._found, self._again, self._missing = found, again, missing
        self._along = tuple(map(str, again["case_id"].dims))
        apart = {f"{series.instance}_index" for series in SERIES} | left_out | _SOFTWARE
        self._names = [
            str(name)
            for name, values in again.data_vars.items()
            if set(self._along) & set(values.dims) and str(name) not in apart and name in found.variables
        ]
        self._scales = {name: _scale(again[name]) for name in self._names}
        self._parted, self._moved = (np.zeros(missing.shape, np.bool_) for _ in range(2))
        self._starts = {
            series.count: tuple(_starts(each[series.count].values) for each in (found, again))
            for series in SERIES
            if series.count in found and series.count in again
        }

    def look(self, case: CampaignCase) -> None:
        """See whether a case's last digits moved, and whether its record took another path; for all of them first."""
        place = _place(self._again, case.case_id) or {}
        names = [name for name in self._names if self._again.variables[name].dtype.kind == "f"]
        pairs = {name: (kept.values, now.values) for name, kept, now in self._pairs(place, names)}
        numbers = {name: pair for name, pair in pairs.items() if not np.isnan(pair).all()}
        self._moved[tuple(place.values())] = _half(not identical(*pair) for pair in numbers.values())
        self._parted[tuple(place.values())] = _half(
            relative(*pair, self._scales[name]) > ROUNDING for name, pair in numbers.items() if name in _OF_RECORDS
        )

    def _pairs(self, place: "_Place", names: Sequence[str]) -> "Iterator[tuple[str, xr.Variable, xr.Variable]]":
        """Variables at a place, by name, as kept and as recomputed, where both have one shape."""
        kept, now = self._values(place, names)
        return ((name, kept[name], now[name]) for name in names if kept[name].shape == now[name].shape)

    def finding(self, case: CampaignCase) -> Finding:
        """What came of one case."""
        place = _place(self._again, case.case_id) or {}
        parted = bool(self._parted[tuple(place.values())])
        # What is made of several cases, as the mean over an ensemble, needs all of them.
        names = [name for name in self._names if not self._missing[self._together(name, place)].any()]
        kept, now = self._values(place, names)
        moved = bool(self._moved[tuple(place.values())])
        differences = [
            self._scalar(name, kept, now, moved, bool(self._parted[self._together(name, place)].any()))
            for name in names
        ]
        for series in SERIES:
            if series.count in self._starts and not (parted and series.kind != "contact"):
                differences += self._run(series, place, moved)
        turned = "its record takes" if parted else "a drive takes"
        elsewhere = parted or any(each.words == _NOT_COMPARED for each in differences)
        remark = f"{turned} another path: compared within uncertainties" if elsewhere else ""
        label = ", ".join(f"{name} = {value}" for name, value in case.parameters.items())
        return _finding(label, differences, remark)

    def _together(self, name: str, place: "_Place") -> tuple[Any, ...]:
        """The cases that a variable's value at a place is made of, as an index."""
        dims = self._again.variables[name].dims
        return tuple(place[dim] if dim in dims else slice(None) for dim in self._along)

    def _values(self, place: "_Place", names: Sequence[str]) -> "tuple[_Values, _Values]":
        """The variables at a place, as kept and as recomputed."""
        kept, now = (
            {name: each.variables[name].isel(place, missing_dims="ignore") for name in names}
            for each in (self._found, self._again)
        )
        return kept, now

    def _scalar(self, name: str, kept: "_Values", now: "_Values", moved: bool, parted: bool) -> Difference:
        found = compared(name, kept[name].values, now[name].values, self._scales[name])
        if found.verdict is not Verdict.DIFFERENT:
            return found
        if name in _ADVICE:
            return replace(found, verdict=Verdict.WITHIN)
        elsewhere = parted if name in _OF_RECORDS else moved or parted
        if not elsewhere or name in _BEFORE_SLIDING or now[name].dtype == object:
            return found
        error = str(now[name].attrs.get("ancillary_variables", ""))
        if not error.endswith("_uncertainty") or error not in now:
            return Difference(name, Verdict.WITHIN, 0.0, _NOT_COMPARED)
        # An error that nobody knows is taken for `LITTLE` in all.
        little = LITTLE * self._scales[name] / STANDARD_ERRORS
        errors = (np.nan_to_num(kept[error].values, nan=little), np.nan_to_num(now[error].values, nan=little))
        close = within_uncertainty(kept[name].values, now[name].values, errors)
        return replace(found, verdict=Verdict.WITHIN) if close else found

    def _run(self, series: Series, place: "_Place", moved: bool) -> list[Difference]:
        """The runs of one series that belong to a case, a run for each of its drives."""
        index = f"{series.instance}_index"
        pairs = zip(
            *(each.variables[index].isel(place).values.ravel() for each in (self._found, self._again)), strict=True
        )
        found = []
        for kept, now in pairs:
            if (kept == ABSENT) != (now == ABSENT):
                found.append(_odd(index, "none kept" if kept == ABSENT else "none recomputed"))
            elif kept != ABSENT:
                found += self._columns(series, int(kept), int(now), moved)
        return found

    def _columns(self, series: Series, kept: int, now: int, moved: bool) -> list[Difference]:
        """One run beside the other: whose it is, and column by column."""
        owner = [
            compared(
                name,
                self._found.variables[name][kept : kept + 1].values,
                self._again.variables[name][now : now + 1].values,
            )
            for name in (f"{series.instance}_case_id", f"{series.instance}_drive")
            if name in self._again.variables and name in self._found.variables
        ]
        here, there = (_window(starts, at) for starts, at in zip(self._starts[series.count], (kept, now), strict=True))
        names = [quantity.name for quantity in series.columns.values() if quantity.name in self._again.variables]
        found = [
            compared(name, self._found.variables[name][here].values, self._again.variables[name][there].values)
            for name in names
            if name in self._found.variables
        ]
        elsewhere = moved and series.kind == "drive" and worst(found) is Verdict.DIFFERENT
        return owner + (
            [Difference(name, Verdict.WITHIN, 0.0, _NOT_COMPARED) for name in names] if elsewhere else found
        )


def _half(votes: Iterable[bool]) -> bool:
    """Whether half or more are in favour, of one or more."""
    counted = list(votes)
    return bool(counted) and 2 * sum(counted) >= len(counted)


_Values = Mapping[str, xr.Variable]
_Place = dict[str, int]

_BEFORE_SLIDING: Final = {
    DISCRETIZATION_ERROR.name,
    *(quantity.name for quantity in SCALARS["contact"].values()),
    *(
        quantity.name
        for quantity in SCALARS["friction"].values()
        if quantity.uncertainty == DISCRETIZATION_ERROR.name or quantity.name.startswith("initial_")
    ),
}
"""Variables that no decision of sliding changes."""
_OF_RECORDS: Final = {
    quantity.name for part in (SCALARS, COMPANIONS) for quantity in part["friction"].values()
} - _BEFORE_SLIDING
"""Variables that sum up a record."""


def _odd(name: str, words: str) -> Difference:
    return Difference(name, Verdict.DIFFERENT, np.inf, words)


def _properties(found: xr.DataArray, again: xr.DataArray) -> Iterator[tuple[str, str, str]]:
    """What is said of a variable beside its values: what, as kept, as it comes out again."""
    yield "dimensions", " ".join(map(str, found.dims)), " ".join(map(str, again.dims))
    yield "units", str(found.attrs.get("units", "")), str(again.attrs.get("units", ""))


def _scale(values: xr.DataArray) -> float:
    return magnitude(values.values) if np.issubdtype(values.dtype, np.floating) else 1.0


def _starts(counts: NDArray[Any]) -> NDArray[np.int64]:
    return np.concatenate(([0], np.cumsum(counts, dtype=np.int64)))


def _window(starts: NDArray[np.int64], number: int) -> slice:
    """Where a run lies; empty where there is no such run."""
    return slice(int(starts[number]), int(starts[number + 1])) if 0 <= number < len(starts) - 1 else slice(0, 0)


def _place(found: xr.Dataset, case_id: str) -> "_Place | None":
    """Where a case lies, by dimension; None where it is not."""
    ids = found["case_id"]
    places = np.argwhere(ids.values == case_id)
    return dict(zip(map(str, ids.dims), map(int, places[0]), strict=True)) if len(places) else None
