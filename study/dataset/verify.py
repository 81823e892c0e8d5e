"""Compute a dataset again from the file alone and compare: shared tasks first, then case by case."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.parameter import Quantity
from nanoslip.solver.view import ROUNDING
from nanoslip.study.dataset import file, variables
from nanoslip.study.dataset.collect import Layout, collect, layout_of
from nanoslip.study.dataset.compare import Verdict, agreement, identical, magnitude, real, relative, same_bits
from nanoslip.study.dataset.file import flattened, groups_of, loaded
from nanoslip.study.manifest.cases import CampaignCase
from nanoslip.study.manifest.parameters import FILE_KEYS
from nanoslip.study.manifest.reader import parse_manifest, sha256_of
from nanoslip.study.origin import Origin, computing_origin, from_data
from nanoslip.study.plan.plan import NOTHING_KNOWN, Plan, evenly, make_plan
from nanoslip.study.plan.task import PENDING, Task
from nanoslip.study.results.store import Store, StoreError

# A dataset computed again from itself alone: its manifest -> plan -> tasks -> dataset, and both side by side.
#
# Each case is *bit-identical*, *within tolerance* or *different*. Within tolerance is every number within `ROUNDING` of its
# variable's scale, the largest magnitude that was recomputed; texts and whole numbers must be the same, but for numbers in a
# `message`, and the words of messages of other software.
# Two things are chains of decisions, which a last digit may turn: a record, seldom, and a drive over its teeth,
# often.
#
# - A record took another path where half or more of the case's numbers over it differ. What precedes sliding still has to agree
#   as before; what states an uncertainty (plateau, mean step, μ_s, μ_k) agrees within `STANDARD_ERRORS` combined ones, or within
#   `LITTLE` of its scale where its uncertainty is unknown; the rest is not compared.
# - A drive may have taken another path only where last digits moved all over the case: where half or more of its numbers
#   have other bits. Then of the drive only what states an uncertainty has to agree, as above.
#
# One wrong number in a file is never taken for either.


class NotVerifiableError(StoreError):
    """The file cannot be computed again; the message has the reason."""


def rebuilt(found: xr.Dataset, path: Path) -> Plan:
    """The plan that a dataset carries with it. Raises NotVerifiableError, ManifestError."""
    facts = found.attrs
    if "manifest" not in facts or not {"case_id", variables.OUTCOMES[""].ending.name} <= set(found.variables):
        raise NotVerifiableError(f"{path}: no dataset of nanoslip: needs a manifest and cases")
    beside = {key: str(facts[f"manifest_{key}"]) for key in FILE_KEYS if f"manifest_{key}" in facts}
    if sha256_of(str(facts["manifest"]), beside) != facts.get("manifest_sha256"):
        changed = "manifest: not what manifest_sha256 is of, or a file that it names is not"
        raise NotVerifiableError(f"{path}: {changed}: changed after it was written")
    manifest = parse_manifest(path, str(facts["manifest"]), beside)
    if variables.SOFTWARE[0].name not in groups_of(found) or found["case_id"].size != manifest.case_count:
        size = f"{found['case_id'].size} of {manifest.case_count} cases"
        groups = ", ".join(groups_of(found)) or "none"
        raise NotVerifiableError(f"{path}: {size}, groups {groups}: not as nanoslip wrote it")
    ending = variables.OUTCOMES["drive"].ending.name
    if manifest.drives and ending not in found:
        raise NotVerifiableError(f"{path}: {ending}: missing: needs how its drives ended")
    return make_plan(manifest)


def other_software(found: xr.Dataset) -> str:
    """Software that computed the dataset, and that recomputes it, if their bits may differ; else empty."""
    (origin,), home = from_data([found.attrs]), computing_origin()
    if not origin.alike(home):
        return f"computed by {origin}; recomputed by {home}"
    said = f"computed with {origin.arithmetic}; recomputed with {home.arithmetic}: last bits may differ"
    return "" if origin.same_bits(home) else said


def computed(plan: Plan, found: xr.Dataset) -> tuple[CampaignCase, ...]:
    """The cases that the dataset has a result of."""
    endings = dict(zip(found["case_id"].values.ravel(), _endings(found, "").values.ravel(), strict=True))
    return tuple(case for case in plan.cases if endings.get(case.case_id) != PENDING)


def failed(plan: Plan, found: xr.Dataset) -> int:
    """Number of cases whose computation failed: out of time, out of memory, crashed."""
    without = (_endings(found, "") == PENDING) & (found[variables.OUTCOMES[""].ending.name] != PENDING)
    return int((without & found["case_id"].isin([case.case_id for case in plan.cases])).sum())


def sample(cases: Sequence[CampaignCase], count: int | None) -> tuple[CampaignCase, ...]:
    """Select `count` of the cases, evenly spread from the first to the last, always the same ones. None: all."""
    return tuple(cases if count is None else evenly(cases, count))


def tasks_in_dataset(plan: Plan, cases: Sequence[CampaignCase], found: xr.Dataset) -> tuple[Task, ...]:
    """Tasks of these cases in the dataset and their inputs, inputs first."""
    wanted: set[str] = set()
    layout = layout_of(plan.manifest)
    for case in cases:
        keys = plan.case_tasks[case.case_id]
        pending = _pending_drives(layout, found, case) if any(drive for _, drive in keys) else set()
        wanted |= {key for (_, drive), key in keys.items() if drive not in pending}
    wanted = plan.with_needs(wanted)
    return tuple(task for task in plan.tasks if task.key in wanted)


def _pending_drives(layout: Layout, found: xr.Dataset, case: CampaignCase) -> set[str]:
    """Labels of the drives of a case that the dataset has no result of, as they are pending or failed."""
    place = place_of(found, case.case_id)
    endings = _endings(found, "drive").isel(place).values
    if not place or endings.shape != tuple(map(len, layout.drive_axes.values())):
        return set()  # another manifest's dataset, as comparing it will tell
    return {label for label, position in layout.drive_position.items() if endings[position] == PENDING}


def _endings(found: xr.Dataset, kind: str) -> xr.DataArray:
    """Outcomes of cases ("") or drives; `pending` also for outcomes of the machine, not of the physics.

    These are time limits, memory and crashes, and tasks that needed such a task: another attempt may end differently.
    """
    endings = found[variables.OUTCOMES[kind].ending.name]
    return endings.where(~endings.isin(NOTHING_KNOWN), PENDING)


def _as_pending(found: xr.Dataset) -> xr.Dataset:
    """The dataset with these outcomes; `pending` has no message."""
    changed = {}
    for kind, ended in variables.OUTCOMES.items():
        if ended.ending.name in found:
            changed[ended.ending.name] = endings = _endings(found, kind)
            for each in (ended.message, ended.cause):
                changed[each.name] = found[each.name].where(endings != PENDING, "")
    return found.assign(changed)


# A dataset and the same one computed again, side by side.

STANDARD_ERRORS: Final = 5.0
"""Combined standard errors by which two means over records that took different paths may differ."""
LITTLE: Final = 1e-2
"""Relative difference allowed, over its scale, for a number computed by another method without known uncertainty."""
_NOT_COMPARED: Final = "not compared"
_SOFTWARE: Final = {each.computed_by.name for each in variables.OUTCOMES.values()}
_CAUSE_OF: Final = {each.message.name: each.cause.name for each in variables.OUTCOMES.values()}
_Values = Mapping[str, xr.Variable]


@dataclass(frozen=True, slots=True)
class Difference:
    """Difference of one variable between two datasets."""

    name: str
    verdict: Verdict
    size: float
    """Largest difference over the variable's scale; infinite for what cannot be subtracted."""
    words: str = ""
    """Description of the difference, if a number cannot express it."""

    def __str__(self) -> str:
        return f"{self.name}: {self.words}" if self.words else f"{self.name} by {self.size:.2g} of its scale"


def worst(differences: Iterable[Difference]) -> Verdict:
    """The verdict on all of them together."""
    return max((each.verdict for each in differences), default=Verdict.IDENTICAL)


def compared(name: str, kept: NDArray[Any], again: NDArray[Any], scale: float | None = None) -> Difference:
    """Compare the stored values of a variable with recomputed ones. Whole numbers and texts have no rounding.

    scale: magnitude of the variable; without it the largest of `again`.
    """
    if kept.shape != again.shape:
        return _odd(name, f"{_size(kept)} kept, {_size(again)} recomputed")
    if identical(kept, again):
        return Difference(name, Verdict.IDENTICAL, 0.0)
    if real(kept) and real(again):
        verdict, size = agreement(kept, again, magnitude(again) if scale is None else scale)
        if np.isfinite(size):
            return Difference(name, verdict, size)
    first = int(np.argmin(same_bits(kept, again) | (kept == again)))  # 0.0 and -0.0 are the same in words
    return _odd(name, f"{_short(kept.item(first))} kept, {_short(again.item(first))} recomputed")


def _size(values: NDArray[Any]) -> str:
    return " x ".join(map(str, values.shape)) or "one value"


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."


@dataclass(frozen=True, slots=True)
class Finding:
    """The verdict on one case, or on shared tasks."""

    label: str
    verdict: Verdict
    remark: str


def finding_of(label: str, differences: Sequence[Difference], remark: str = "") -> Finding:
    """The worst of some differences, in a line."""
    verdict = worst(differences)
    told = sorted((each for each in differences if each.verdict == verdict), key=lambda each: -each.size)
    if verdict is Verdict.IDENTICAL:
        return Finding(label, verdict, remark)
    others = list(dict.fromkeys(each.name for each in told if each.name != told[0].name))
    more = f", and {len(others)} more: {', '.join(others[:3])}{', ...' if len(others) > 3 else ''}" if others else ""
    return Finding(label, verdict, "; ".join(filter(None, (remark, f"{told[0]}{more}"))))


class Recomputed:
    """A dataset and the same one computed again, side by side."""

    def __init__(self, found: xr.Dataset, again: xr.Dataset) -> None:
        self._found, self._again = found, again
        self._reworded = bool(other_software(found))
        groups = groups_of(found), groups_of(again)
        declared = [group for name, group in variables.all_groups().items() if all(name in each for each in groups)]
        self._groups = [_Runs(group, [each[group.name] for each in groups]) for group in declared]
        self._along = set(again["case_id"].dims)
        apart = variables.run_names() | _SOFTWARE
        own = (name for name, each in again.data_vars.items() if self._along <= set(each.dims) and name in found)
        self._names = [str(name) for name in own if name not in apart]
        self._scales = {name: magnitude(again[name].values) for name in self._names if real(again[name].values)}

    @property
    def comparable(self) -> bool:
        """True if the cases have the same positions."""
        both = set(self._found.variables) & set(self._again.variables)
        lying = all(self._found[name].dims == self._again[name].dims for name in both)
        return lying and identical(self._found["case_id"].values, self._again["case_id"].values)

    def shared(self) -> list[Difference]:
        """Compare each attribute, coordinate and variable without a case of its own; identical ones are listed, too."""
        found, again = flattened(self._found), flattened(self._again)
        names = sorted({*found, *again})
        missing = [_odd(name, "is missing") for name in names if name not in found]
        strange = [_odd(name, "is in no dataset of this manifest") for name in names if name not in again]
        common = [name for name in names if name in found and name in again]
        words = [
            compared(f"{kind} of {name}", np.array(one), np.array(other))
            for name in common
            for (kind, one), other in zip(_words(found[name]).items(), _words(again[name]).values(), strict=True)
        ]
        values = [compared(name, found[name].values, again[name].values) for name in common if self._for_all(name)]
        return [*missing, *strange, *words, *self._attributes(), *values]

    def _for_all(self, name: str) -> bool:
        """True if a variable belongs to no case and is not in a group: runs are compared with their case."""
        return "/" not in name and (name in self._again.coords or not set(self._again[name].dims) & self._along)

    def _attributes(self) -> list[Difference]:
        apart = {item.name for item in fields(Origin)} | {file.MIXED}
        kept = self._found.attrs
        return [
            compared(f"attribute {name}", np.array(kept[name]), np.array(value))
            if name in kept
            else _odd(f"attribute {name}", "is missing")
            for name, value in self._again.attrs.items()
            if name not in apart
        ]

    def finding(self, case: CampaignCase) -> Finding:
        """The verdict on one case: whether its last digits moved, whether its record took another path, and what differs then."""
        place = place_of(self._again, case.case_id)
        kept, now = (
            {name: each.variables[name].isel(place, missing_dims="ignore") for name in self._names}
            for each in (self._found, self._again)
        )
        both = {name: (one.values, now[name].values) for name, one in kept.items() if one.shape == now[name].shape}
        numbers = {name: pair for name, pair in both.items() if real(pair[1]) and not np.isnan(pair).all()}
        moved = _half(not identical(*pair) for pair in numbers.values())
        of_records = {name: pair for name, pair in numbers.items() if name in _of_records()}
        parted = _half(relative(*pair, self._scales[name]) > ROUNDING for name, pair in of_records.items())
        differences = [self._scalar(name, kept, now, moved, parted) for name in self._names]
        for runs in self._groups:
            if not (parted and runs.group.kinds != ("contact",)):
                name = runs.group.id.name
                ids = (each.variables[name].isel(place).values.ravel() for each in (self._found, self._again))
                for one, other in zip(*ids, strict=True):
                    differences += runs.differences(one, other, moved)
        skipped = any(each.words == _NOT_COMPARED for each in differences)
        turned = "its record" if parted else "a drive" if skipped else ""
        remark = f"{turned} takes another path: compared within uncertainties" if turned else ""
        label = ", ".join(f"{name} = {value}" for name, value in case.parameters.items())
        return finding_of(label, differences, remark)

    def _scalar(self, name: str, kept: _Values, now: _Values, moved: bool, parted: bool) -> Difference:
        scale = self._scales.get(name, 1.0)
        found = compared(name, kept[name].values, now[name].values, scale)
        if found.verdict is not Verdict.DIFFERENT:
            return found
        if name in _CAUSE_OF and (self._reworded or _alike(kept[_CAUSE_OF[name]], now[_CAUSE_OF[name]])):
            return replace(found, verdict=Verdict.WITHIN)
        elsewhere = parted if name in _of_records() else moved or parted
        if not elsewhere or name in _before_sliding() or now[name].dtype == object:
            return found
        error = f"{name}_uncertainty"
        if error not in now:
            return Difference(name, Verdict.WITHIN, 0.0, _NOT_COMPARED)
        # An unknown error counts as `LITTLE`.
        errors = [np.nan_to_num(each[error].values, nan=LITTLE * scale / STANDARD_ERRORS) for each in (kept, now)]
        both = (kept[name].values, now[name].values)
        return replace(found, verdict=agreement(*both, scale, (errors[0], errors[1]), STANDARD_ERRORS)[0])


def _alike(kept: xr.Variable, again: xr.Variable) -> bool:
    """True if both have the same causes, whose messages differ in values alone."""
    return identical(kept.values, again.values) and bool(np.all(again.values != ""))


class _Runs:
    """The runs of one group, as kept and as recomputed."""

    def __init__(self, group: variables.Group, both: Sequence[xr.Dataset]) -> None:
        self.group, self._both = group, both
        self._numbers = [{name: number for number, name in enumerate(each[group.name].values)} for each in both]
        self._windows = [variables.windows(each, group) for each in both]

    def differences(self, kept: str, now: str, moved: bool) -> list[Difference]:
        """One run beside the other, by their names (empty if there is none): whose it is, and column by column."""
        if not kept or not now:
            said = "recomputed, but none kept" if now else "kept, but none recomputed"
            return [_odd(self.group.id.name, said)] if kept or now else []
        if kept not in self._numbers[0]:
            return [_odd(self.group.id.name, f"{kept} is not in the group {self.group.name}")]
        places = [numbers[name] for numbers, name in zip(self._numbers, (kept, now), strict=True)]
        whole = [slice(at, at + 1) for at in places]
        owner = self._compared([each.name for each in self.group.owners], self.group.name, whole)
        found = []
        for sample in self._windows[1]:
            names = [name for name, quantity in self.group.columns.items() if quantity.along == sample]
            pairs = zip(self._windows, places, strict=True)
            slices = [slice(*each[sample][at : at + 2].tolist()) if sample in each else slice(0) for each, at in pairs]
            found += self._compared(names, sample, slices)
        if moved and self.group.driven and worst(found) is Verdict.DIFFERENT:
            found = [Difference(each.name, Verdict.WITHIN, 0.0, _NOT_COMPARED) for each in found]
        return owner + found

    def _compared(self, names: Sequence[str], dim: str, slices: Sequence[slice]) -> list[Difference]:
        """Compare the variables of these names that both have, within these slices."""
        (found, again), (here, there) = self._both, ({dim: at} for at in slices)
        return [
            compared(name, found.variables[name].isel(here).values, again.variables[name].isel(there).values)
            for name in names
            if name in found.variables and name in again.variables
        ]


def _half(votes: Iterable[bool]) -> bool:
    """True if there are votes and at least half are in favour."""
    counted = list(votes)
    return bool(counted) and 2 * sum(counted) >= len(counted)


_STIFFNESSES: Final = ("surface_stiffness", "path_stiffness")
"""Stiffness K of a contact, before a record and before a path."""


@cache
def _before_sliding() -> set[str]:
    """Variables that no decision of sliding changes."""
    sliding = [each for kind in ("record", "path") for _, each in variables.scalars(kind)]
    before = [each for each in sliding if each.name.startswith("initial_") or each.name in _STIFFNESSES]
    return _names(each for _, each in variables.scalars("contact")) | _names(before)


@cache
def _of_records() -> set[str]:
    """Variables that sum up a record or a path."""
    return _names(each for kind in ("record", "path") for _, each in variables.scalars(kind)) - _before_sliding()


def _names(quantities: Iterable[Quantity]) -> set[str]:
    """The variables of these quantities, and of their ±."""
    return {name for each in quantities for name in (each.name, each.uncertainty, each.shared_error) if name}


def _odd(name: str, words: str) -> Difference:
    return Difference(name, Verdict.DIFFERENT, np.inf, words)


def _words(found: xr.DataArray) -> dict[str, str]:
    """Attributes of a variable."""
    return {"dimensions": " ".join(map(str, found.dims)), "units": str(found.attrs.get("units", ""))}


def place_of(found: xr.Dataset, case_id: str) -> dict[str, int]:
    """Position of a case by dimension; empty if it is not there."""
    ids = found["case_id"]
    places = np.argwhere(ids.values == case_id)
    return dict(zip(map(str, ids.dims), map(int, places[0]), strict=True)) if len(places) else {}


def verify_cases(found: xr.Dataset, plan: Plan, cases: Sequence[CampaignCase], store: Store) -> Iterator[Finding]:
    """Compare the dataset with the results in `store`: first shared tasks, then case by case."""
    path = store.folder / file.FILE
    file.write_netcdf(collect(plan, store), path)  # what is read has the types that a file gives it
    with file.open_dataset(path) as opened_again:
        again, found = loaded(opened_again), _as_pending(found)
        if len(cases) == len(computed(plan, found)):
            found = loaded(found)  # a run at a time would take longer
        both = Recomputed(found, again)
        yield finding_of("what all cases share", both.shared())
        if both.comparable:
            yield from map(both.finding, cases)
