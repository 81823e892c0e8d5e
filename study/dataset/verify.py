"""Compute a dataset again from the file alone and compare: shared tasks first, then case by case."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path
from typing import Final

import numpy as np
import xarray as xr

from nanoslip.solver.contact.compiled_contact import LOAD_FLOOR
from nanoslip.solver.parameter import SHARED_ERROR, Quantity
from nanoslip.solver.view import ROUNDING
from nanoslip.study.dataset import file, variables
from nanoslip.study.dataset.agreement import (
    UNKNOWN,
    Difference,
    Runs,
    Verdict,
    are_identical,
    compare_values,
    find_verdict,
    is_real,
    magnitude,
    odd,
    worst,
)
from nanoslip.study.dataset.collect import Layout, case_layout, collect
from nanoslip.study.dataset.file import flatten_variables, load_dataset, read_groups
from nanoslip.study.manifest.cases import CampaignCase
from nanoslip.study.manifest.parameters import FILE_KEYS
from nanoslip.study.manifest.reader import manifest_hash, parse_manifest
from nanoslip.study.origin import Origin, computing_origin, from_data
from nanoslip.study.plan.plan import NOTHING_KNOWN, Plan, evenly, make_plan
from nanoslip.study.results.store import Store, StoreError
from nanoslip.study.tasks.task import PENDING, Task

# A dataset computed again from itself alone: its manifest -> plan -> tasks -> dataset, and both side by side.
#
# The same software with the same arithmetic gives the same bits: what differs by more than rounding is different. Provenance
# states whether software or arithmetic are others. Then last digits differ, and what hangs on them: records, paths and drives
# are chains of decisions, which a last digit may turn.
#
# - What precedes sliding has to be the same within rounding. A load that rises is a chain, too, of steps of LOAD_FLOOR.
# - A number of a chain has to be the same within its ±, `STANDARD_ERRORS` of both combined.
# - What states no ± is named, not judged: counts, texts that sum up a drive, and the chain itself. How it ended is judged.


class NotVerifiableError(StoreError):
    """The file cannot be computed again; the message has the reason."""


def rebuilt(dataset: xr.Dataset, path: Path) -> Plan:
    """The plan that a dataset carries with it. Raises NotVerifiableError, ManifestError."""
    facts = dataset.attrs
    if "manifest" not in facts or not {"case_id", variables.OUTCOMES[""].ending.name} <= set(dataset.variables):
        raise NotVerifiableError(f"{path}: no dataset of nanoslip: needs a manifest and cases")
    # The texts of files are in the dataset: it can be verified where those are not.
    file_keys = [key for key in FILE_KEYS if f"manifest_{key}" in facts]
    beside = {key: str(facts[f"manifest_{key}"]) for key in file_keys}
    if manifest_hash(str(facts["manifest"]), beside) != facts.get("manifest_sha256"):
        changed = "manifest: not what manifest_sha256 is of, or a file that it names is not"
        raise NotVerifiableError(f"{path}: {changed}: changed after it was written")
    # Nobody's functions are executed because a dataset was read.
    stated = parse_manifest(path, str(facts["manifest"]), beside)
    manifest = replace(stated, observables=())
    if variables.SOFTWARE[0].name not in read_groups(dataset) or dataset["case_id"].size != manifest.case_count:
        size = f"{dataset['case_id'].size} of {manifest.case_count} cases"
        groups = ", ".join(read_groups(dataset)) or "none"
        raise NotVerifiableError(f"{path}: {size}, groups {groups}: not as nanoslip wrote it")
    ending = variables.OUTCOMES["drive"].ending.name
    if manifest.drives and ending not in dataset:
        raise NotVerifiableError(f"{path}: {ending}: missing: needs how its drives ended")
    return make_plan(manifest)


def other_software(dataset: xr.Dataset) -> str:
    """Software that computed the dataset, and that recomputes it, if their bits may differ; else empty."""
    (origin,), home = from_data([dataset.attrs]), computing_origin()
    if not origin.alike(home):
        return f"computed by {origin}; recomputed by {home}"
    said = f"computed with {origin.arithmetic}; recomputed with {home.arithmetic}: last bits may differ"
    return "" if origin.same_bits(home) else said


def computed(plan: Plan, dataset: xr.Dataset) -> tuple[CampaignCase, ...]:
    """The cases that the dataset has a result of."""
    ids = dataset["case_id"].values.ravel()
    words = _endings(dataset, "").values.ravel()
    endings = dict(zip(ids, words, strict=True))
    return tuple(case for case in plan.cases if endings.get(case.case_id) != PENDING)


def failed(plan: Plan, dataset: xr.Dataset) -> int:
    """Number of cases whose computation failed: out of time, out of memory, crashed."""
    endings = dataset[variables.OUTCOMES[""].ending.name]
    without = (_endings(dataset, "") == PENDING) & (endings != PENDING)
    cases = [case.case_id for case in plan.cases]
    of_plan = dataset["case_id"].isin(cases)
    return int((without & of_plan).sum())


def sample(cases: Sequence[CampaignCase], count: int | None) -> tuple[CampaignCase, ...]:
    """Select `count` of the cases, evenly spread from the first to the last, always the same cases. None: all."""
    return tuple(cases if count is None else evenly(cases, count))


def tasks_in_dataset(plan: Plan, cases: Sequence[CampaignCase], dataset: xr.Dataset) -> tuple[Task, ...]:
    """Tasks of these cases in the dataset and their inputs, inputs first."""
    wanted: set[str] = set()
    layout = case_layout(plan.manifest)
    for case in cases:
        keys = plan.case_tasks[case.case_id]
        # Drives that were not finished have nothing to be compared with, and may take long.
        has_drives = any(drive for _, drive in keys)
        pending = _pending_drives(layout, dataset, case) if has_drives else set()
        wanted |= {key for (_, drive), key in keys.items() if drive not in pending}
    wanted = plan.with_needs(wanted)
    return tuple(task for task in plan.tasks if task.key in wanted)


def _pending_drives(layout: Layout, dataset: xr.Dataset, case: CampaignCase) -> set[str]:
    """Labels of the drives of a case that the dataset has no result of, as they are pending or failed."""
    place = case_position(dataset, case.case_id)
    endings = _endings(dataset, "drive").isel(place).values
    if not place or endings.shape != tuple(map(len, layout.drive_axes.values())):
        # Another manifest's dataset: its comparison will show that.
        return set()
    return {label for label, position in layout.drive_position.items() if endings[position] == PENDING}


def _endings(dataset: xr.Dataset, kind: str) -> xr.DataArray:
    """Outcomes of cases ("") or drives; `pending` also for outcomes of the machine, not of the physics.

    These are time limits, memory and crashes, and tasks that needed such a task: another attempt may end differently.
    """
    endings = dataset[variables.OUTCOMES[kind].ending.name]
    return endings.where(~endings.isin(NOTHING_KNOWN), PENDING)


def _as_pending(dataset: xr.Dataset) -> xr.Dataset:
    """The dataset with these outcomes; `pending` has no message."""
    changed = {}
    for kind, ended in variables.OUTCOMES.items():
        if ended.ending.name in dataset:
            changed[ended.ending.name] = endings = _endings(dataset, kind)
            for variable in (ended.message, ended.cause):
                changed[variable.name] = dataset[variable.name].where(endings != PENDING, "")
    return dataset.assign(changed)


# A dataset and the same one computed again, side by side.

STANDARD_ERRORS: Final = 5.0
"""Combined standard errors by which two means over records that took different paths may differ."""
OF_A_RISING_LOAD: Final = 100.0 * LOAD_FLOOR
"""Rounding of a contact whose load rose event by event, over a variable's scale. An event waits for the smallest step of the load
or not: 11 steps were seen at the most, over other last digits of the compliance."""
_OVER_THE_LOAD: Final = ("initial_force", "closure", "plateau_std")
"""Differences of forces over the load."""
_SOFTWARE: Final = {each.computed_by.name for each in variables.OUTCOMES.values()}
_CAUSE_OF: Final = {each.message.name: each.cause.name for each in variables.OUTCOMES.values()}
_Values = Mapping[str, xr.Variable]


@dataclass(frozen=True, slots=True)
class Finding:
    """The verdict on one case, or on shared tasks."""

    label: str
    verdict: Verdict
    remark: str


def worst_difference(label: str, differences: Sequence[Difference]) -> Finding:
    """The worst difference in a line, and the names of variables that are not judged."""
    judged = [difference for difference in differences if difference.verdict is not Verdict.NOT_JUDGED]
    unjudged = [difference for difference in differences if difference.verdict is Verdict.NOT_JUDGED]
    verdict, beside = worst(judged), _list_names(unjudged)
    decisive = [difference for difference in judged if difference.verdict == verdict]
    decisive.sort(key=lambda difference: -difference.size)
    if verdict is Verdict.IDENTICAL and not beside:
        return Finding(label, verdict, "")
    others = [difference for difference in decisive if difference.name != decisive[0].name]
    count = len({difference.name for difference in others})
    more = f", and {count} more: {_list_names(others)}" if others else ""
    said = f"{decisive[0]}{more}" if verdict > Verdict.IDENTICAL else ""
    remark = "; ".join(filter(None, (said, beside and f"not judged: {beside}")))
    return Finding(label, max(verdict, Verdict.WITHIN) if beside else verdict, remark)


def _list_names(differences: Sequence[Difference]) -> str:
    """The first few names of some differences, each once."""
    names = list(dict.fromkeys(difference.name for difference in differences))
    shown = ", ".join(names[:3])
    return f"{shown}, ..." if len(names) > 3 else shown


class Recomputed:
    """A dataset and its recomputation, side by side."""

    def __init__(self, dataset: xr.Dataset, again: xr.Dataset) -> None:
        self._found, self._again = dataset, again
        (origin,), home = from_data([dataset.attrs]), computing_origin()
        self._same_software = origin.alike(home)
        self._same_bits = origin.same_bits(home)
        kept, now = read_groups(dataset), read_groups(again)
        self._groups: list[Runs] = []
        for name, group in variables.all_groups().items():
            if name in kept and name in now:
                both = (kept[name], now[name])
                self._groups.append(Runs(group, both))
        self._along = set(again["case_id"].dims)
        apart = variables.run_names() | _SOFTWARE
        common = {str(name): variable for name, variable in again.data_vars.items() if name in dataset}
        shared_names = [name for name, variable in common.items() if self._along <= set(variable.dims)]
        self._names = [name for name in shared_names if name not in apart]
        self._sizes: dict[str, float] = {}
        for name in self._names:
            column = again[name].values
            if is_real(column):
                self._sizes[name] = magnitude(column)

    @property
    def comparable(self) -> bool:
        """True if the cases have the same positions."""
        both = set(self._found.variables) & set(self._again.variables)
        if any(self._found[name].dims != self._again[name].dims for name in both):
            return False
        ids = self._found["case_id"].values
        return are_identical(ids, self._again["case_id"].values)

    def shared(self) -> list[Difference]:
        """Compare each attribute, coordinate and variable that belongs to no single case; identical ones are listed,
        too."""
        own_names = variables.own_variables(self._found)
        # One's own numbers are not computed again: nobody's functions are executed.
        kept = flatten_variables(self._found.drop_vars(own_names))
        again = flatten_variables(self._again)
        names = sorted({*kept, *again})
        missing = [odd(name, "is missing") for name in names if name not in kept]
        strange = [odd(name, "is in no dataset of this manifest") for name in names if name not in again]
        common = [name for name in names if name in kept and name in again]
        words = []
        for name in common:
            ours, theirs = _words(kept[name]), _words(again[name])
            for kind, word in ours.items():
                words.append(compare_values(f"{kind} of {name}", np.array(word), np.array(theirs[kind])))
        for_all = [name for name in common if self._is_for_all_cases(name)]
        values = [compare_values(name, kept[name].values, again[name].values) for name in for_all]
        own_numbers = variables.own_numbers(self._found)
        unjudged = [Difference(name, Verdict.NOT_JUDGED, np.inf) for name in own_numbers]
        return [*missing, *strange, *words, *self._attributes(), *values, *unjudged]

    def _is_for_all_cases(self, name: str) -> bool:
        """True if a variable belongs to no case and is not in a group: runs are compared with their case."""
        if "/" in name:
            return False
        if name in self._again.coords:
            return True
        return self._along.isdisjoint(self._again[name].dims)

    def _attributes(self) -> list[Difference]:
        # Which software computed a dataset is no content of it: another may compute the same.
        apart = {item.name for item in fields(Origin)} | {file.MIXED}
        kept = self._found.attrs
        differences = []
        for name, value in self._again.attrs.items():
            if name in apart:
                continue
            label = f"attribute {name}"
            if name in kept:
                both = (np.array(kept[name]), np.array(value))
                differences.append(compare_values(label, *both))
            else:
                differences.append(odd(label, "is missing"))
        return differences

    def finding(self, case: CampaignCase) -> Finding:
        """The verdict on a case, with differences and variables that are not judged."""
        place = case_position(self._again, case.case_id)
        kept = self._case_values(self._found, place)
        now = self._case_values(self._again, place)
        rises = case.case is not None and case.case.initial_contact == "gradual"
        rounding = OF_A_RISING_LOAD if rises and not self._same_bits else ROUNDING
        differences = [self._scalar(name, kept, now, rounding) for name in self._names]
        for runs in self._groups:
            name = runs.group.id.name
            kept_ids = self._found.variables[name].isel(place).values.ravel()
            now_ids = self._again.variables[name].isel(place).values.ravel()
            for one, other in zip(kept_ids, now_ids, strict=True):
                chained = self._soften(runs, runs.compare_columns(one, other, rounding))
                differences += runs.owners(one, other) + chained
        label = ", ".join(f"{name} = {value}" for name, value in case.parameters.items())
        return worst_difference(label, differences)

    def _case_values(self, root: xr.Dataset, place: Mapping[str, int]) -> dict[str, xr.Variable]:
        return {name: root.variables[name].isel(place, missing_dims="ignore") for name in self._names}

    def _soften(self, runs: Runs, differences: list[Difference]) -> list[Difference]:
        """Differences of a run; not judged where last digits may turn it."""
        # Initial contact is no chain: where it differs by more than rounding, it differs.
        if self._same_bits or runs.group.kinds == ("contact",) or worst(differences) is not Verdict.DIFFERENT:
            return differences
        return [Difference(f"the {runs.group.name}", Verdict.NOT_JUDGED, np.inf)]

    def _scalar(self, name: str, kept: _Values, now: _Values, rounding: float) -> Difference:
        scale = self._scale(name)
        both = (kept[name].values, now[name].values)
        difference = compare_values(name, *both, scale, rounding)
        if difference.verdict is not Verdict.DIFFERENT:
            return difference
        cause = _CAUSE_OF.get(name)
        if cause and (not self._same_software or _has_same_values(kept[cause], now[cause])):
            # Messages may differ in words or in values alone.
            return replace(difference, verdict=Verdict.WITHIN)
        if self._same_bits or not _is_of_chains(name):
            return difference
        if not is_real(both[1]):
            return replace(difference, verdict=Verdict.NOT_JUDGED)
        error = f"{name}_uncertainty"
        errors = (kept[error].values, now[error].values) if error in kept else UNKNOWN
        # Both are means over the same members, yet over records that a last digit may have turned.
        verdict, *_ = find_verdict(*both, scale, errors, STANDARD_ERRORS)
        return replace(difference, verdict=verdict, words="")

    def _scale(self, name: str) -> float:
        """Magnitude of what a variable is a difference of: of a ± the number's, of forces that cancel the load."""
        base = name.removesuffix("_uncertainty").removesuffix(SHARED_ERROR)
        of_the_load = 1.0 if base in _OVER_THE_LOAD else 0.0
        sizes = [self._sizes.get(size_name, 0.0) for size_name in (name, base)]
        return max(*sizes, of_the_load)


def _has_same_values(kept: xr.Variable, again: xr.Variable) -> bool:
    """True if both have the same causes, whose messages differ in values alone."""
    are_stated = bool(np.all(again.values != ""))
    return are_stated and are_identical(kept.values, again.values)


_STIFFNESSES: Final = ("surface_stiffness", "path_stiffness")
"""Stiffness K of a contact, before a record and before a path."""


@cache
def _chain_variables() -> set[str]:
    """Variables that sum up a record, a path or a drive, and texts about how drives ended; not how they ended."""
    kinds = ("record", "path", "statistics", variables.DRIVE)
    quantities = [quantity for kind in kinds for _, quantity in variables.scalars(kind)]
    # Initial contact and its stiffness are known before anything slides.
    after_contact = [quantity for quantity in quantities if not quantity.name.startswith("initial_")]
    sliding = [quantity for quantity in after_contact if quantity.name not in _STIFFNESSES]
    ended = variables.OUTCOMES[variables.DRIVE]
    texts = {ended.cause.name, ended.message.name}
    return _names(sliding) | texts | {variables.MEMBERS.name}


def _is_of_chains(name: str) -> bool:
    """True for these variables, and for the numbers of members that have one, or one of its words."""
    chained = _chain_variables()
    if name in chained:
        return True
    return name.endswith("_members") and any(name.startswith(f"{chain}_") for chain in chained)


def _names(quantities: Iterable[Quantity]) -> set[str]:
    """The variables of these quantities, and of their ±."""
    names = set()
    for quantity in quantities:
        names |= {quantity.name, quantity.uncertainty, quantity.shared_error}
    return names - {""}


def _words(variable: xr.DataArray) -> dict[str, str]:
    """Attributes of a variable."""
    dims = " ".join(map(str, variable.dims))
    units = str(variable.attrs.get("units", ""))
    return {"dimensions": dims, "units": units}


def case_position(dataset: xr.Dataset, case_id: str) -> dict[str, int]:
    """Position of a case by dimension; empty if it is not there."""
    ids = dataset["case_id"]
    places = np.argwhere(ids.values == case_id)
    if not len(places):
        return {}
    # A case_id is there once.
    dims = map(str, ids.dims)
    numbers = map(int, places[0])
    return dict(zip(dims, numbers, strict=True))


def verify_cases(dataset: xr.Dataset, plan: Plan, cases: Sequence[CampaignCase], store: Store) -> Iterator[Finding]:
    """Compare the dataset with the results in `store`: first shared tasks, then case by case."""
    path = store.folder / file.FILE
    # Written first, as a dataset that is read has the types of a file.
    file.write_netcdf(collect(plan, store), path)
    with file.open_dataset(path) as opened_again:
        again, dataset = load_dataset(opened_again), _as_pending(dataset)
        if len(cases) == len(computed(plan, dataset)):
            # Read whole: a run at a time would take longer.
            dataset = load_dataset(dataset)
        both = Recomputed(dataset, again)
        yield worst_difference("what all cases share", both.shared())
        if both.comparable:
            yield from map(both.finding, cases)
