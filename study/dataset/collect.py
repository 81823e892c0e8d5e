"""Results -> one labelled dataset. The same results give the same bytes, on any machine, in any order.

Scalars lie over the axes with several values if the design is a full product, else over `case`; scalars of drives
also over `drive` and the axes of drives. Records, trajectories, contacts and insides of slabs are groups of
contiguous ragged arrays (nanoslip.study.dataset.access cuts them apart). Provenance is in the group `software`.
"""

import math
import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache, reduce
from operator import or_
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.case import Case, parameters_of_a_case
from nanoslip.solver.drive import Scales
from nanoslip.solver.ensemble import fewest_members
from nanoslip.solver.outcome import Ending, Outcome
from nanoslip.solver.parameter import Quantity, attributes
from nanoslip.solver.sliding.validity import KNOWN, decode_flags, encode_flags, flag_advice, predict_flags
from nanoslip.study.dataset import variables
from nanoslip.study.dataset.file import (
    FORMAT,
    MIXED,
    VERSION,
    DatasetFormatError,
    carrying,
    reading,
)
from nanoslip.study.dataset.runs import Runs
from nanoslip.study.dataset.texts import text_array
from nanoslip.study.dataset.variables import DRIVE, Group, Series, parameters, scalars, si_coordinates
from nanoslip.study.manifest.cases import CampaignCase, Heard, common_labels
from nanoslip.study.manifest.manifest import CampaignDrive, Manifest
from nanoslip.study.manifest.parameters import STANDARD, FileName, Value, file_parameters
from nanoslip.study.origin import NOBODY, Origin, Origins, census, mixture, stemming
from nanoslip.study.plan.plan import NOTHING_KNOWN, CaseTasks, Plan, case_outcome, drive_outcome
from nanoslip.study.results.store import Store, StoreError
from nanoslip.study.tasks.kind import KINDS, names_to_drop, own_quantities, task_kinds
from nanoslip.study.tasks.task import (
    OF_ALL,
    OF_CONTACT,
    OF_PATH,
    PENDING,
    Exclusion,
    TaskResult,
    ineffective_parameters,
)

# Position of each case and drive in a dataset: the dimensions, and the settings of drives along theirs.


@dataclass(frozen=True, slots=True)
class Layout:
    """Layout of cases and drives in a dataset: the axes that are dimensions, and a position along them."""

    axes: dict[str, tuple[Value, ...]]
    """Axes of the cases."""
    order: tuple[str, ...]
    """Names of the axes in the campaign's order: the last one varies fastest from case to case."""
    drive_axes: dict[str, tuple[Value, ...]]
    """Axes of the drives, which follow the axes of the cases."""
    drive_position: Mapping[str, tuple[int, ...]]
    """Label of a drive -> position."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of a variable over the cases."""
        return tuple(len(values) for values in self.axes.values())

    @property
    def places(self) -> NDArray[np.intp]:
        """(cases,) Where each case of the campaign lies, counted through all of them, the last dimension fastest."""
        count = math.prod(self.shape)
        numbers = np.arange(count).reshape(self.shape)
        names = list(self.axes)
        permutation = [names.index(name) for name in self.order]
        in_order = numbers.transpose(permutation)
        return in_order.ravel()


def case_layout(manifest: Manifest) -> Layout:
    """The axes where the design is a full product, else the list of cases.

    Drives lie along `drive`, where there are several tables of them, and along the drive axes of several values.
    """
    drive_axes = _drive_axes(manifest)
    position = {drive.label: _drive_position(drive, drive_axes) for drive in manifest.drives}
    # Cases that are no full product would leave most of an array over all axes empty.
    if manifest.design != "product":
        numbers = tuple(range(manifest.case_count))
        return Layout({"case": numbers}, ("case",), drive_axes, position)
    standard = common_labels(manifest).standard
    common = {name: (value,) for name, value in standard.items()}
    values = {**common, **manifest.axes}
    further = (name for name in manifest.axes if name not in STANDARD)
    axes = {name: tuple(values[name]) for name in (*STANDARD, *further)}
    varying = [name for name in manifest.axes if name in axes]
    order = tuple(dict.fromkeys([*varying, *axes]))
    return Layout(axes, order, drive_axes, position)


def _drive_axes(manifest: Manifest) -> dict[str, tuple[Value, ...]]:
    names = tuple(dict.fromkeys(drive.name for drive in manifest.drives))
    settings = {"drive": names, **manifest.drive_axes}
    return {name: values for name, values in settings.items() if len(values) > 1}


def _drive_position(drive: CampaignDrive, axes: Mapping[str, tuple[Value, ...]]) -> tuple[int, ...]:
    point = {"drive": drive.name, **drive.point}
    places = (values.index(point[name]) for name, values in axes.items())
    return tuple(places)


def drive_coordinates(manifest: Manifest, layout: Layout) -> dict[str, Any]:
    """The drives' names and settings: an axis of drives along itself, other settings along the axes with which they vary."""
    coordinates: dict[str, Any] = {}
    points: dict[tuple[int, ...], dict[str, Any]] = {}
    for drive in manifest.drives:
        position = layout.drive_position[drive.label]
        points[position] = {"drive": drive.name, **drive.settings}
    labelled = {"drive": variables.DRIVE_NAME, **parameters()}
    for name, label in labelled.items() if points else ():
        if name in layout.drive_axes:
            labels = label_array(layout.drive_axes[name])
            coordinates[name] = (name, labels, attributes(label))
            continue
        values = {position: points[position].get(name) for position in points}
        # A setting that no drive uses is no coordinate.
        if any(value is not None for value in values.values()):
            dims, spread = _spread(values, layout.drive_axes)
            coordinates[name] = (dims, spread, attributes(label))
    return coordinates


def _spread(entries: Mapping[tuple[int, ...], Any], axes: Mapping[str, Sequence[Value]]) -> tuple[tuple[str, ...], Any]:
    """Dimensions and values of a setting of the drives, without the axes along which it is the same; `drive` stays."""
    shape = tuple(len(labels) for labels in axes.values())
    values = np.full(shape, None, dtype=object)
    for position, value in entries.items():
        values[position] = value
    dims = tuple(axes)
    for axis in axes:
        place = dims.index(axis)
        first = values.take([0], place)
        if axis != "drive" and np.all(values == first):
            values = first.squeeze(place)
            dims = tuple(dim for dim in dims if dim != axis)
    labels = label_array(values.ravel().tolist())
    # An array without a dimension becomes its one value.
    return dims, labels.reshape(values.shape)[()]


def label_array(values: Sequence[Any]) -> NDArray[Any]:
    """Values of a label, texts at their length; None is a missing value."""
    words = any(isinstance(value, str) for value in values)
    missing: Any = "" if words else np.nan
    labels = [missing if value is None else value for value in values]
    return text_array(labels) if words else np.array(labels)


# The coordinates of a dataset: every parameter that matters, and the cases' names.


def coordinates(manifest: Manifest, cases: Sequence[CampaignCase], layout: Layout) -> dict[str, Any]:
    """Parameters along their dimension, over the cases where they vary, else once; none that changes no result."""
    dims = tuple(layout.axes)
    along: dict[str, Any] = {}
    for name, labels in layout.axes.items():
        along[name] = (name, label_array(labels), attributes(_parameter(name)))
    ids = _arrange(layout.places, [case.case_id for case in cases])
    along["case_id"] = (dims, ids.reshape(layout.shape), attributes(variables.CASE_ID))
    along |= _parameters_of_cases(manifest, cases, layout)
    return along | _si_twins(manifest, along) | drive_coordinates(manifest, layout)


def _parameters_of_cases(manifest: Manifest, cases: Sequence[CampaignCase], layout: Layout) -> dict[str, Any]:
    """Coordinates of the parameters that are no dimension: over the cases, or a single value."""
    # A file that all cases share is no coordinate: the manifest names it.
    files = [name for name in file_parameters() if name in manifest.axes]
    parameter_names = (*parameters(), *files)
    names = [name for name in parameter_names if name not in layout.axes]
    # In a list of cases an axis and a standard parameter label each, also where it has one value.
    labelling = {*manifest.axes, *STANDARD} if "case" in layout.axes else ()
    exclusions = _exclusions(task_kinds(manifest))
    rows = [_values(case, names, exclusions) for case in cases]
    possible = sum(case.case is not None for case in cases)
    coordinates_by_name: dict[str, Any] = {}
    for name, values in zip(names, zip(*rows, strict=True), strict=True):
        present = [value for value in values if value is not None]
        if not present:
            continue
        about = attributes(_parameter(name))
        # Refused cases may lack a value that all others share; one that changes no result in some cases varies.
        is_common = len(set(present)) == 1 and len(present) >= possible
        if is_common and name not in labelling:
            coordinates_by_name[name] = ((), present[0], about)
        else:
            arranged = _arrange(layout.places, values)
            coordinates_by_name[name] = (tuple(layout.axes), arranged.reshape(layout.shape), about)
    return coordinates_by_name


def _exclusions(kinds: frozenset[str]) -> tuple[Exclusion, ...]:
    """The exclusions of parameters that change no result of a campaign with these kinds of task."""
    if "record" in kinds:
        return OF_ALL
    return OF_PATH if "path" in kinds else OF_CONTACT


def _si_twins(manifest: Manifest, stored: Mapping[str, Any]) -> dict[str, Any]:
    """Coordinates with lengths and loads in m and N beside the others, if a campaign gives scales."""
    scales = manifest.stated_scales
    if scales is None:
        return {}
    coordinates = {}
    for name, twin in si_coordinates().items():
        if name not in stored:
            continue
        dims, values, _ = stored[name]
        scale = getattr(scales, parameters_of_a_case()[name].scale)
        in_si = np.asarray(values, float) * scale
        coordinates[twin.name] = (dims, in_si, attributes(twin))
    return coordinates


def _values(case: CampaignCase, names: Sequence[str], exclusions: tuple[Exclusion, ...]) -> tuple[Any, ...]:
    """Requested parameters of a case; None for a parameter that changes no result."""
    if case.case is None:
        return tuple(map(case.parameters.get, names))
    parameters_of_case = case.parameters.items()
    files = {name: value for name, value in parameters_of_case if isinstance(value, FileName)}
    ineffective = ineffective_parameters(case.case, exclusions)
    settings = {**case.case.flat, **files}
    effective = {name: settings[name] for name in settings if name not in ineffective}
    return tuple(map(effective.get, names))


def _arrange(places: NDArray[np.intp], values: Sequence[Any]) -> NDArray[Any]:
    """Arrange values at their places; None is a missing value."""
    labels = label_array(values)
    # netCDF has no type for true and false.
    kind = np.int64 if labels.dtype == np.bool_ else labels.dtype
    arranged = np.empty(len(values), kind)
    arranged[places] = labels
    return arranged


def _parameter(name: str) -> Quantity:
    # An axis of files is labelled by their names, a list of cases by their numbers.
    content = "file" if name in file_parameters() else "number"
    return parameters().get(name) or Quantity(name, f"{content} of the {name}")


# The variables of a dataset over its cases, and over the drives of each.

_COUNTED: Final = dict.fromkeys(("contact", "record", "path"), variables.MEMBERS) | {DRIVE: variables.DRIVE_MEMBERS}
"""Kind of task -> the variable that counts its members."""
PIECE: Final = 4096
"""Results whose numbers are entered together."""

Results = Mapping[tuple[str, str], TaskResult]
"""Finished results by kind of task and label of the drive ("" without one)."""


class _Row(NamedTuple):
    """The scalars of a result that wait to be entered."""

    place: int
    scalars: Mapping[str, Sequence[float | int]]
    factors: Mapping[str, float]
    """`Quantity.per` -> what a value is multiplied with."""


class CaseVariables:
    """The variables of a campaign's dataset over its cases, and over the drives of each."""

    def __init__(self, manifest: Manifest, layout: Layout, groups: Sequence[Group]) -> None:
        """groups: of runs, whose names stand over the cases or drives."""
        self._layout = layout
        shape = tuple(map(len, layout.drive_axes.values()))
        self._drives = math.prod(shape)
        drives = np.arange(self._drives).reshape(shape)
        self._drive_place = {label: int(drives[position]) for label, position in layout.drive_position.items()}
        self._scalars: dict[str, list[tuple[str, Quantity]]] = {}
        """Kind of task -> names and variables of the scalars of its results."""
        self._driven: dict[str, bool] = {}
        """Name -> whether it lies over the drives too."""
        self._quantities: dict[str, Quantity] = {}
        self._values: dict[str, NDArray[Any]] = {}
        """Values by name; the drives of a case follow each other."""
        self._waiting: dict[str, list[_Row]] = {kind: [] for kind in KINDS}
        self._as_one = np.zeros(math.prod(layout.shape), bool)
        """(cases,) Whether the records of all members have the same events: one start, of which no mean has a ±."""
        self._declare_all(manifest, groups)

    def variables(self) -> dict[str, xr.Variable]:
        """All variables by name, with the values set so far."""
        layout, filled = self._layout, {}
        for kind in self._waiting:
            self._enter_waiting(kind)
        # Drives over records that are all the same have no ± either: known only once all records have been entered.
        for quantity in self._quantities.values():
            if quantity.uncertainty in self._values:
                # A view: what is set in it is set in the values.
                errors = self._values[quantity.uncertainty]
                by_case = errors.reshape(len(self._as_one), -1)
                by_case[self._as_one] = np.nan
        for name, values in self._values.items():
            axes = layout.axes | layout.drive_axes if self._driven[name] else layout.axes
            shaped = values.reshape(tuple(map(len, axes.values())))
            about = attributes(self._quantities[name])
            filled[name] = xr.Variable(tuple(axes), shaped, about)
        return filled

    def put(self, name: str, place: int, drive: str, value: object) -> None:
        """Set one value. place: of the case, as in `Layout.places`."""
        number = self._place(self._driven[name], place, drive)
        self._values[name][number] = value

    def enter_outcome(self, place: int, outcome: Outcome | None, drive: str = "") -> None:
        """Set how a case, or its drive, ended; None leaves it pending."""
        if outcome is not None:
            ended = variables.OUTCOMES[DRIVE if drive else ""]
            self.put(ended.ending.name, place, drive, outcome.ending.value)
            self.put(ended.message.name, place, drive, outcome.message)
            self.put(ended.cause.name, place, drive, outcome.cause)

    def enter_own_messages(self, place: int, keys: CaseTasks, outcomes: Mapping[str, Outcome]) -> None:
        """Set why one's own numbers of a case, and of its drives, are missing. outcomes: of its tasks, by key."""
        for (kind, drive), key in keys.items():
            outcome = outcomes.get(key)
            if kind in variables.OWN_MESSAGES and outcome and outcome.ending is not Ending.NEEDS_FAILED:
                message = variables.OWN_MESSAGES[kind]
                self.put(message.name, place, drive, outcome.message)

    def enter_software(self, place: int, results: Results) -> None:
        """Set which software a case, and each of its drives, stems from."""
        origins: dict[str, list[Origins]] = {}
        for (kind, name), result in results.items():
            if kind != "compliance":
                stated = result.origins or (NOBODY,)
                origins.setdefault(name, []).append(stated)
        for name, parts in origins.items():
            outcome = variables.OUTCOMES[DRIVE if name else ""]
            names = _names(tuple(parts))
            self.put(outcome.computed_by.name, place, name, names)

    def enter(self, place: int, case: Case, drive: str, result: TaskResult, by: Mapping[str, float]) -> None:
        """Set all scalars of a result. by: `Quantity.per` -> what a value is multiplied with."""
        waiting = self._waiting[result.kind]
        # A refused case has no scalars.
        if result.scalars:
            row_place = self._place(KINDS[result.kind].driven, place, drive)
            waiting.append(_Row(row_place, result.scalars, by))
            # Any scalar has a value for each member.
            if result.kind in _COUNTED:
                count = len(next(iter(result.scalars.values())))
                self.put(_COUNTED[result.kind].name, place, drive, count)
        # Many results are entered together, by few operations on arrays.
        if len(waiting) >= PIECE:
            self._enter_waiting(result.kind)
        flags = member_flags(case, result)
        if flags is None:
            return
        # Bits of no flag, which a dataset may have no room for.
        flags &= KNOWN
        # A case with a path and a record has the flags of both.
        if result.kind == "path":
            flags |= int(self._values[variables.VALIDITY.name][place])
        self.put(variables.VALIDITY.name, place, drive, flags)
        self.put(variables.ADVICE.name, place, drive, _advice(flags))

    def _declare_all(self, manifest: Manifest, groups: Sequence[Group]) -> None:
        kinds = task_kinds(manifest)
        for kind, ended in variables.OUTCOMES.items():
            if kind and kind not in kinds:
                continue
            for text in ended:
                self._declare(kind, text, PENDING if text == ended.ending else "")
        self._declare("", variables.ADVICE, "")
        self._declare("", variables.MEMBERS, np.nan)
        if DRIVE in kinds:
            self._declare(DRIVE, variables.DRIVE_MEMBERS, np.nan)
        # In the order of KINDS, not of a set: variables have the same order in every dataset.
        for kind in KINDS:
            if kind not in kinds:
                continue
            dropped = names_to_drop(KINDS[kind], manifest)
            if kind in variables.OWN_MESSAGES:
                self._declare(kind, variables.OWN_MESSAGES[kind], "")
            own_numbers_of_kind = own_quantities(kind, manifest)
            stated = [*scalars(kind), *own_numbers_of_kind.items()]
            self._scalars[kind] = [(name, quantity) for name, quantity in stated if name not in dropped]
            for _, quantity in self._scalars[kind]:
                for variable in (quantity, *quantity.beside):
                    self._declare(kind, variable, _empty_value(variable))
        for group in groups:
            self._declare(DRIVE if group.driven else "", group.id, "")

    def _declare(self, kind: str, quantity: Quantity, fill: Any) -> None:
        """A variable, and its fill value."""
        driven = bool(kind) and KINDS[kind].driven
        count = math.prod(self._layout.shape)
        if driven:
            count *= self._drives
        self._driven[quantity.name] = driven
        self._quantities[quantity.name] = quantity
        # Texts as objects: an array of fixed length would cut those that are longer than the first.
        dtype = object if isinstance(fill, str) else None
        self._values[quantity.name] = np.full(count, fill, dtype)

    def _place(self, driven: bool, place: int, drive: str) -> int:
        if not driven:
            return place
        return place * self._drives + self._drive_place[drive]

    def _enter_waiting(self, kind: str) -> None:
        """Set the scalars of the waiting results, results with the same names and number of members together."""
        # Ensembles differ in size, and results of an older version in their numbers: each shape is
        # an array of its own.
        alike: dict[tuple[object, ...], list[_Row]] = {}
        for row in self._waiting[kind]:
            members = len(next(iter(row.scalars.values())))
            shape = (members, *row.scalars)
            alike.setdefault(shape, []).append(row)
        self._waiting[kind].clear()
        for rows in alike.values():
            self._enter_alike(kind, rows)

    def _enter_alike(self, kind: str, rows: Sequence[_Row]) -> None:
        """Set the scalars of these results, a variable after the other: means over the members, (results, members) each."""
        by_result = [list(row.scalars.values()) for row in rows]
        numbers = np.array(by_result, float).swapaxes(0, 1)
        columns = dict(zip(rows[0].scalars, numbers, strict=True))
        places = np.array([row.place for row in rows])
        if kind == "record":
            self._as_one[places] = variables.alike_starts(columns)
        for name, quantity in self._scalars[kind]:
            # Flags have been combined bit by bit: they have no mean.
            if quantity.name == variables.VALIDITY.name or name not in columns:
                continue
            if quantity.words:
                self._enter_words(quantity, places, columns[name])
                continue
            means = variables.mean_in_dataset(columns, name, quantity)
            factors = [row.factors[quantity.per] for row in rows]
            unit = np.array(factors)
            # What overflows is infinite.
            with np.errstate(over="ignore"):
                self._values[quantity.name][places] = means.mean * unit
                if not quantity.ensemble:
                    continue
                # An error has no sign, whatever that of its scale.
                size = np.abs(unit)
                self._values[quantity.uncertainty][places] = means.uncertainty * size
                if quantity.shared:
                    self._values[quantity.shared_error][places] = means.shared * size
            self._values[quantity.members][places] = means.members

    def _enter_words(self, quantity: Quantity, places: NDArray[np.intp], numbers: NDArray[np.float64]) -> None:
        """Set the word of most members, empty if too few have one, and how many have each. numbers: (results, members)."""
        # Results have a word as its place among the declared words.
        codes = range(len(quantity.words))
        tallies = [(numbers == code).sum(axis=1) for code in codes]
        counts = np.stack(tallies)
        for count, variable in zip(counts, quantity.counts().values(), strict=True):
            self._values[variable.name][places] = count
        # Of words that equally many members have, the first that is declared.
        words = np.array(quantity.words, object)
        most = words[counts.argmax(axis=0)]
        enough = counts.sum(axis=0) >= fewest_members(numbers.shape[1])
        chosen = np.where(enough, most, "")
        self._values[quantity.name][places] = chosen


@lru_cache
def _advice(flags: int) -> str:
    return flag_advice(decode_flags(flags))


@lru_cache
def _names(parts: tuple[Origins, ...]) -> str:
    return " ".join(origin.name for origin in stemming(*parts))


# Software that computed the results of a dataset.


def _empty_value(variable: Quantity) -> Any:
    """Value of a variable for a case without a result."""
    if variable.words:
        return ""
    # A count of members, in a type of its own: joined datasets know counts by it.
    return np.int32(0) if variable.whole else np.nan


def software_group(counts: Mapping[Origin, int]) -> xr.Dataset:
    """The software that computed the results, one origin each."""
    origins = sorted(counts)
    numbers = [counts[origin] for origin in origins]
    results = np.array(numbers, np.int64)
    facts = ("name", *(item.name for item in fields(Origin)))
    names, *others = (_origin_texts(origins, fact) for fact in facts)
    arrays = (names, results, *others)
    columns = zip(variables.SOFTWARE, arrays, strict=True)
    dim = variables.SOFTWARE[0].name
    contents = {variable.name: (dim, values, attributes(variable)) for variable, values in columns}
    return xr.Dataset(contents)


def _origin_texts(origins: Sequence[Origin], fact: str) -> NDArray[Any]:
    return text_array(getattr(origin, fact) for origin in origins)


def software_attributes(counts: Mapping[Origin, int]) -> dict[str, str]:
    """Software that computed the results, all of it if there are several, the most frequent first."""
    facts = {}
    for item in fields(Origin):
        values: Counter[str] = Counter()
        for origin, count in counts.items():
            values[getattr(origin, item.name)] += count
        # By name where two are equally frequent, as sorting is stable: the order of results must not show.
        by_name = sorted(values.items())
        frequent = sorted(by_name, key=lambda pair: -pair[1])
        several = [f"{value} ({count} results)" for value, count in frequent]
        text = ", ".join(several if len(several) > 1 else values)
        facts[item.name] = text or "nothing is computed yet"
    mixed = mixture(counts)
    if mixed:
        facts[MIXED] = mixed
    return facts


# The results of a campaign's cases, and how their tasks ended.


class Finished:
    """The results of a plan that are there, a case at a time, and how its tasks ended."""

    def __init__(self, plan: Plan, store: Store) -> None:
        self._store, self._known = store, store.outcomes()
        failures = store.failures().items()
        failed = {key: attempt.outcome for key, attempt in failures}
        ended = plan.outcomes(self._known, failed) if failed else {}
        self._lost = {key: outcome for key, outcome in ended.items() if key not in self._known}
        """Outcomes of all other tasks that failed."""

    def results(self, keys: CaseTasks) -> Results:
        """Results of a case without its compliance. keys: of its tasks."""
        results: dict[tuple[str, str], TaskResult] = {}
        for (kind, drive), key in keys.items():
            if key not in self._known or kind == "compliance":
                continue
            result = self._store.find(key)
            if result:
                results[kind, drive] = result
            # Damaged since the store was opened: the case is pending again, not half a case.
            else:
                del self._known[key]
        return results

    def outcomes(self, keys: CaseTasks) -> dict[str, Outcome]:
        """Outcomes of the tasks of a case whose results were taken."""
        outcomes = {}
        for key in keys.values():
            for source in (self._lost, self._known):
                if key in source:
                    outcomes[key] = source[key]
        return outcomes


def collect(plan: Plan, store: Store, heard: Heard = lambda _: None) -> xr.Dataset:
    """The dataset of a campaign with its groups, finished or not: missing numbers are NaN, with the outcome `pending`.

    Raises StoreError. heard: callback, called with the number of collected cases.
    """
    collector = _Collector(plan, store.folder)
    finished = Finished(plan, store)
    origins: dict[str, Origins] = {}
    for number, (place, case) in enumerate(collector.placed_cases(), 1):
        keys = plan.case_tasks[case.case_id]
        results = finished.results(keys)
        # After the results: a result that turned out to be damaged has no outcome any more.
        outcomes = finished.outcomes(keys)
        collector.enter_endings(place, case, outcomes)
        collector.enter_results(place, case, results)
        # A result counts once, however many cases share it.
        origins |= {result.key: result.origins for result in results.values()}
        heard(number)
    return collector.dataset(census(origins.values()))


class _Collector:
    """The parts of a campaign's dataset: variables over its cases and drives, and the runs of each group."""

    def __init__(self, plan: Plan, folder: Path) -> None:
        """folder: of the results, for long columns meanwhile."""
        self._plan = plan
        self._layout = case_layout(plan.manifest)
        self._runs = _runs(plan.manifest, folder)
        groups = [runs.group for runs in self._runs]
        self._table = CaseVariables(plan.manifest, self._layout, groups)
        self._drives = {drive.label: drive.drive for drive in plan.manifest.drives}

    def placed_cases(self) -> Iterator[tuple[int, CampaignCase]]:
        """Each case of the campaign, after its place (see `Layout.places`)."""
        places = self._layout.places.tolist()
        return zip(places, self._plan.cases, strict=True)

    def enter_endings(self, place: int, case: CampaignCase, outcomes: Mapping[str, Outcome]) -> None:
        """Set how a case, its drives and one's own numbers of it ended. outcomes: of its tasks, by key."""
        ending_of_case = case_outcome(self._plan, case, outcomes)
        self._table.enter_outcome(place, ending_of_case)
        for drive in self._plan.manifest.drives:
            ending_of_drive = drive_outcome(self._plan, case, drive, outcomes)
            self._table.enter_outcome(place, ending_of_drive, drive.label)
        keys = self._plan.case_tasks[case.case_id]
        self._table.enter_own_messages(place, keys, outcomes)

    def enter_results(self, place: int, case: CampaignCase, results: Results) -> None:
        """Set the software and the numbers of a case's results, and append their columns to the runs of each group."""
        self._table.enter_software(place, results)
        if case.case is None:
            return
        scales = self._plan.manifest.scales
        labels = {drive for _, drive in results}
        factors = {label: variables.factors(case.case, scales, self._drives.get(label)) for label in labels}
        for (_, drive), result in results.items():
            self._table.enter(place, case.case, drive, result, factors[drive])
        for runs in self._runs:
            for drive in self._drives if runs.group.driven else ("",):
                tasks = [(kind, drive) for kind in runs.group.kinds]
                parts = [results[task] for task in tasks if task in results]
                if parts:
                    run = runs.add(parts, factors[drive], case.case_id, drive)
                    self._table.put(runs.group.id.name, place, drive, run)

    def dataset(self, origins: Mapping[Origin, int]) -> xr.Dataset:
        """The dataset with its groups. origins: of its results, with their counts."""
        manifest = self._plan.manifest
        along = coordinates(manifest, self._plan.cases, self._layout)
        root = xr.Dataset(self._table.variables(), along, _attributes(manifest, origins))
        groups = {runs.group.name: runs.dataset() for runs in self._runs}
        groups[variables.SOFTWARE[0].name] = software_group(origins)
        return carrying(root, groups)


def _runs(manifest: Manifest, folder: Path) -> list[Runs]:
    # Long columns lie beside the results, as that disk has room for them; where nothing may be
    # written, in the system's folder for temporary files.
    meanwhile = folder if os.access(folder, os.W_OK) else None
    runs = []
    for group in variables.all_groups().values():
        series = _requested_series(group, manifest)
        if series:
            runs.append(Runs(Group(group.name, series), meanwhile))
    return runs


def _requested_series(group: Group, manifest: Manifest) -> tuple[Series, ...]:
    """The series of a group that a campaign computes and requests, with the columns that it requests."""
    kinds = task_kinds(manifest)
    requested = [series for series in group.series if series.kind in kinds and series.wanted(manifest)]
    return tuple(_drop_unrequested(series, manifest) for series in requested)


def _drop_unrequested(series: Series, manifest: Manifest) -> Series:
    """A series without the columns that a campaign does not request."""
    dropped = names_to_drop(KINDS[series.kind], manifest)
    columns = {name: quantity for name, quantity in series.columns.items() if name not in dropped}
    return replace(series, columns=columns)


def _attributes(manifest: Manifest, counts: Mapping[Origin, int]) -> dict[str, Any]:
    return {
        FORMAT: VERSION,
        "title": manifest.title,
        "Conventions": "CF-1.11, ACDD-1.3" if manifest.about.attributes else "CF-1.11",
        **manifest.about.attributes,
        # Without a date, as the same results give the same bytes.
        "history": "computed and collected by nanoslip",
        "manifest": manifest.text,
        **{f"manifest_{key}": text for key, text in manifest.files.items() if text is not None},
        "manifest_sha256": manifest.sha256,
        **software_attributes(counts),
        **{item.name: getattr(manifest.scales, item.name) for item in fields(Scales)},
        "scales": "slab_width L_x in m, slab_depth L_y in m, shear_modulus G in Pa",
    }


def member_flags(case: Case, result: TaskResult) -> int | None:
    """The flags that any member's contact or record has, as bits; where no contact was reached, the flags that are
    expected.

    None for other kinds of results.
    """
    if result.kind not in ("contact", "record", "path"):
        return None
    flags = result.scalars.get("validity_flags", ())
    widths = result.scalars.get("contact_half_width", ())
    reached = []
    for bits, width in zip(flags, widths, strict=True):
        # A member without a contact has no width, and flags of nothing.
        if not math.isnan(bits) and not math.isnan(width):
            reached.append(int(bits))
    if reached:
        return reduce(or_, reached)
    return encode_flags(predict_flags(case))


# A dataset is not replaced by one with fewer finished cases: results may be lost, damaged, or another campaign's.


def losses(path: Path, collected: xr.Dataset) -> list[str]:
    """List the content of an existing dataset that its replacement would lack; empty if it lacks nothing.

    One that cannot be read is no loss, unless another user reads it, or another nanoslip whose results may not all be
    here.
    """
    if path.exists() and not os.access(path, os.R_OK):
        return ["contents that this user may not read"]
    try:
        with reading(path) as kept:
            lost = (_fewer_finished(kept, collected, kind) for kind in variables.OUTCOMES)
            # Listed here: values are read from the file, which is closed below.
            return list(filter(None, lost))
    except DatasetFormatError:
        # Another version may have finished all of its cases: only a complete dataset replaces its
        # file.
        return ["another format"] if count_pending(collected) else []
    except StoreError:
        return []


def count_pending(dataset: xr.Dataset) -> int:
    """Number of cases and drives without an outcome."""
    names = [ended.ending.name for ended in variables.OUTCOMES.values()]
    endings = [dataset[name] for name in names if name in dataset]
    return sum(int((ending == PENDING).sum()) for ending in endings)


def _fewer_finished(kept: xr.Dataset, collected: xr.Dataset, kind: str) -> str:
    """Sentence on the loss of finished cases or drives: by number among all, or by name among cases in both
    datasets."""
    ending = variables.OUTCOMES[kind].ending.name
    if ending not in kept or ending not in collected:
        return ""
    common = np.intersect1d(kept["case_id"].values, collected["case_id"].values)
    # A case out of time has an ending but no result: where both datasets have the case, such an
    # ending must not replace a result.
    for unfinished, cases in (((PENDING,), None), (NOTHING_KNOWN, common)):
        had, _ = _count_finished(kept, ending, unfinished, cases)
        has, size = _count_finished(collected, ending, unfinished, cases)
        # A campaign that has become smaller loses none.
        if has < min(had, size):
            return f"{had} finished {kind or 'case'}{'' if had == 1 else 's'}, collected now {has} of {size}"
    return ""


def _count_finished(
    dataset: xr.Dataset, ending: str, unfinished: Sequence[str], cases: NDArray[Any] | None
) -> tuple[int, int]:
    """Number of finished cases or drives, and of all, among these cases; None: among all cases."""
    # Variables, not arrays: to compare the coordinates takes far longer.
    labels, endings = dataset.variables["case_id"], dataset.variables[ending]
    is_among = np.ones(labels.shape, bool) if cases is None else np.isin(labels.values, cases)
    among = xr.Variable(labels.dims, is_among)
    finished = xr.Variable(endings.dims, ~np.isin(endings.values, unfinished))
    everything = among & xr.ones_like(finished)
    return int((finished & among).sum()), int(everything.sum())
