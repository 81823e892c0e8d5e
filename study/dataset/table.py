"""Where cases and drives lie in a dataset, their coordinates, and the variables over them: the same ones whatever the results."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.ensemble import mean_of, needed
from nanoslip.solver.outcome import Outcome
from nanoslip.solver.parameter import Quantity, attributes
from nanoslip.solver.sliding.validity import advice_on, flags_in
from nanoslip.study.dataset.variables import (
    ADVICE,
    CASE_ID,
    COMPUTED_BY,
    DISCRETIZATION_ERROR,
    DRIVE,
    DRIVE_MEMBERS,
    DRIVE_NAME,
    MEMBERS,
    OUTCOMES,
    VALIDITY,
    Group,
    companions,
    counted,
    parameters,
    scalars,
    texts,
)
from nanoslip.study.manifest.cases import CampaignCase, labels_of
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.parameters import STANDARD, FileName, Value, in_files
from nanoslip.study.origin import NOBODY, Origins, stemming
from nanoslip.study.plan.kinds import KINDS, left_out, needed_kinds
from nanoslip.study.plan.outlook import flags_of
from nanoslip.study.plan.plan import PENDING
from nanoslip.study.plan.task import OF_ALL, OF_CONTACT, Exclusion, TaskResult, without_effect

# Where each case and drive of a campaign lies in its dataset: the dimensions, and the settings of drives along theirs.


@dataclass(frozen=True, slots=True)
class Layout:
    """Where each case and each drive lies: the axes that are dimensions, and a position along them."""

    axes: dict[str, tuple[Value, ...]]
    """Of the cases."""
    order: tuple[str, ...]
    """The same in the campaign's order: the last one varies fastest from case to case."""
    drive_axes: dict[str, tuple[Value, ...]]
    """Of the drives, which follow those of the cases."""
    drive_position: Mapping[str, tuple[int, ...]]
    """Label of a drive -> position."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Of a variable over the cases."""
        return tuple(len(values) for values in self.axes.values())

    @property
    def places(self) -> NDArray[np.intp]:
        """(cases,) Where each case of the campaign lies, counted through all of them, the last dimension fastest."""
        numbers = np.arange(math.prod(self.shape)).reshape(self.shape)
        return numbers.transpose([list(self.axes).index(name) for name in self.order]).ravel()


def layout_of(manifest: Manifest) -> Layout:
    """The axes where the design is a full product, else the list of cases.

    Drives lie along `drive`, where there are several tables of them, and along the drive axes of several values.
    """
    names = tuple(dict.fromkeys(drive.name for drive in manifest.drives))
    drive_axes = {name: each for name, each in {"drive": names, **manifest.drive_axes}.items() if len(each) > 1}
    points = {drive.label: {"drive": drive.name, **drive.point} for drive in manifest.drives}
    position = {
        label: tuple(drive_axes[name].index(point[name]) for name in drive_axes) for label, point in points.items()
    }
    if manifest.design != "product":
        return Layout({"case": tuple(range(manifest.case_count))}, ("case",), drive_axes, position)
    values = {**{name: (value,) for name, value in labels_of(manifest).standard.items()}, **manifest.axes}
    further = (name for name, each in manifest.axes.items() if name not in STANDARD and len(each) > 1)
    axes = {name: tuple(values[name]) for name in (*STANDARD, *further)}
    order = tuple(dict.fromkeys([*(name for name in manifest.axes if name in axes), *axes]))
    return Layout(axes, order, drive_axes, position)


def drive_coordinates(manifest: Manifest, layout: Layout) -> dict[str, Any]:
    """The drives' names and settings: along their own dimension, along `drive`, and along those with which they vary."""
    found: dict[str, Any] = {}
    points = {layout.drive_position[each.label]: {"drive": each.name, **each.settings} for each in manifest.drives}
    for name in ("drive", *parameters()) if points else ():
        label = DRIVE_NAME if name == "drive" else parameters()[name]
        if name in layout.drive_axes:
            found[name] = (name, array_of(layout.drive_axes[name]), attributes(label))
            continue
        given = {position: point.get(name) for position, point in points.items()}
        if any(value is not None for value in given.values()):
            found[name] = (*_spread(given, layout.drive_axes), attributes(label))
    return found


def _spread(given: Mapping[tuple[int, ...], Any], axes: Mapping[str, Sequence[Value]]) -> tuple[tuple[str, ...], Any]:
    """Dimensions and values of a setting of the drives, without the axes along which it is the same; `drive` stays."""
    values = np.full(tuple(len(each) for each in axes.values()), None, dtype=object)
    for position, value in given.items():
        values[position] = value
    dims = tuple(axes)
    for axis in axes:
        first = values.take([0], dims.index(axis))
        if axis != "drive" and np.all(values == first):
            values, dims = first.squeeze(dims.index(axis)), tuple(dim for dim in dims if dim != axis)
    return dims, array_of(values.ravel().tolist()).reshape(values.shape)[()]


def array_of(values: Sequence[Any]) -> NDArray[Any]:
    """Values of a label, texts at their length, where None stands for a missing one."""
    words = any(isinstance(value, str) for value in values)
    missing: Any = "" if words else np.nan
    found = [missing if value is None else value for value in values]
    return texts(found) if words else np.array(found)


# The coordinates of a dataset: every parameter that matters, and the cases' names.


def coordinates(manifest: Manifest, cases: Sequence[CampaignCase], layout: Layout) -> dict[str, Any]:
    """Parameters along their dimension, over the cases where they vary, else once; none that changes no result."""
    dims, places = tuple(layout.axes), layout.places
    found: dict[str, Any] = {
        name: (name, array_of(values), attributes(_parameter(name))) for name, values in layout.axes.items()
    }
    ids = _at(places, [case.case_id for case in cases])
    found["case_id"] = (dims, ids.reshape(layout.shape), attributes(CASE_ID))
    exclusions = OF_ALL if "record" in needed_kinds(manifest) else OF_CONTACT
    files = [name for name in in_files() if name in manifest.axes]
    names = [name for name in (*parameters(), *files) if name not in layout.axes]
    able = sum(case.case is not None for case in cases)
    along = {*manifest.axes, *STANDARD} if "case" in dims else ()
    rows = [_values(case, names, exclusions) for case in cases]
    for name, values in zip(names, zip(*rows, strict=True), strict=True):
        there = [value for value in values if value is not None]
        if there:
            once = len(set(there)) == 1 and len(there) >= able and name not in along
            placed = ((), there[0]) if once else (dims, _at(places, values).reshape(layout.shape))
            found[name] = (*placed, attributes(_parameter(name)))
    return found | drive_coordinates(manifest, layout)


def _values(case: CampaignCase, names: Sequence[str], exclusions: tuple[Exclusion, ...]) -> tuple[Any, ...]:
    """Parameters of a case, as its campaign asks for them; None where one changes no result."""
    if case.case is None:
        return tuple(map(case.parameters.get, names))
    named = {name: value for name, value in case.parameters.items() if isinstance(value, FileName)}
    without, given = without_effect(case.case, exclusions), {**case.case.flat, **named}
    return tuple([None if name in without else given.get(name) for name in names])


def _at(places: NDArray[np.intp], values: Sequence[Any]) -> NDArray[Any]:
    """Values at their places, where None stands for a missing one."""
    given = array_of(values)
    found = np.empty(len(values), np.int64 if given.dtype == np.bool_ else given.dtype)
    found[places] = given
    return found


def _parameter(name: str) -> Quantity:
    return parameters().get(name) or Quantity(name, f"{'file' if name in in_files() else 'number'} of the {name}")


# The variables of a dataset over its cases, and over the drives of each.

_COUNTED: Final = {"contact": MEMBERS, "record": MEMBERS, DRIVE: DRIVE_MEMBERS}
"""Kind of task -> the variable that counts its members."""
PIECE: Final = 4096
"""Results whose numbers are entered together."""

Results = Mapping[tuple[str, str], TaskResult]
"""Kind of task and label of its drive ("" without one) -> its result, of those that are finished."""


class _Row(NamedTuple):
    """The scalars of a result that wait to be entered."""

    place: int
    scalars: Mapping[str, Sequence[float | int]]
    factors: Mapping[str, float]
    """`Quantity.per` -> what a value is multiplied with."""


class Table:
    """The variables of a campaign's dataset over its cases, and over the drives of each."""

    def __init__(self, manifest: Manifest, layout: Layout, groups: Sequence[Group]) -> None:
        """groups: of runs, whose names stand over the cases or drives."""
        self._layout = layout
        shape = tuple(map(len, layout.drive_axes.values()))
        self._drives = math.prod(shape)
        drives = np.arange(self._drives).reshape(shape)
        self._drive_place = {label: int(drives[position]) for label, position in layout.drive_position.items()}
        self._driven: dict[str, bool] = {}
        """Name -> whether it lies over the drives too."""
        self._quantities: dict[str, Quantity] = {}
        self._values: dict[str, NDArray[Any]] = {}
        """By name, the drives of a case one behind the other."""
        self._waiting: dict[str, list[_Row]] = {kind: [] for kind in KINDS}
        self._as_one = np.zeros(math.prod(layout.shape), bool)
        """(cases,) Whether the records of all members have the same events: one start, of which no mean has a ±."""
        self._declare_all(manifest, groups)

    def variables(self) -> dict[str, xr.Variable]:
        """All of them, by name, with what was set."""
        layout, found = self._layout, {}
        for kind in self._waiting:
            self._enter_waiting(kind)
        for quantity in (each for each in self._quantities.values() if each.uncertainty in self._values):
            self._values[quantity.uncertainty].reshape(len(self._as_one), -1)[self._as_one] = np.nan
        for name, values in self._values.items():
            axes = layout.axes | layout.drive_axes if self._driven[name] else layout.axes
            shaped = values.reshape(tuple(map(len, axes.values())))
            found[name] = xr.Variable(tuple(axes), shaped, attributes(self._quantities[name]))
        return found

    def put(self, name: str, place: int, drive: str, value: object) -> None:
        """Set one value. place: of the case, as in `Layout.places`."""
        self._values[name][self._place(self._driven[name], place, drive)] = value

    def enter_outcome(self, place: int, outcome: Outcome | None, drive: str = "") -> None:
        """Set how a case, or its drive, ended; None leaves it pending."""
        if outcome is not None:
            ending, message = OUTCOMES[DRIVE if drive else ""]
            self.put(ending.name, place, drive, outcome.ending.value)
            self.put(message.name, place, drive, outcome.message)

    def enter_software(self, place: int, results: Results) -> None:
        """Set which software a case, and each of its drives, stems from."""
        found: dict[str, list[Origins]] = {}
        for (kind, name), result in results.items():
            if kind != "compliance":
                found.setdefault(name, []).append(result.origins or (NOBODY,))
        for name, parts in found.items():
            self.put(COMPUTED_BY[DRIVE if name else ""].name, place, name, _names(tuple(parts)))

    def enter(self, place: int, case: Case, drive: str, result: TaskResult, by: Mapping[str, float]) -> None:
        """Set all scalars of a result. by: `Quantity.per` -> what a value is multiplied with."""
        waiting = self._waiting[result.kind]
        if result.scalars:  # of what was refused there are none
            waiting.append(_Row(self._place(result.kind == DRIVE, place, drive), result.scalars, by))
            if result.kind in _COUNTED:
                count = len(next(iter(result.scalars.values())))
                self.put(_COUNTED[result.kind].name, place, drive, count)
        if len(waiting) >= PIECE:
            self._enter_waiting(result.kind)
        if (flags := flags_of(case, result)) is not None:
            self.put(VALIDITY.name, place, drive, flags)
            self.put(ADVICE.name, place, drive, _advice(flags))

    def _declare_all(self, manifest: Manifest, groups: Sequence[Group]) -> None:
        kinds = needed_kinds(manifest)
        for kind, (ending, message) in OUTCOMES.items():
            if not kind or kind in kinds:
                for text in (ending, message, COMPUTED_BY[kind]):
                    self._declare(kind, text, PENDING if text == ending else "")
        for each in (DISCRETIZATION_ERROR, ADVICE, MEMBERS):
            self._declare("", each, "" if each == ADVICE else np.nan)
        if DRIVE in kinds:
            self._declare(DRIVE, DRIVE_MEMBERS, np.nan)
        for kind in (each for each in KINDS if each in kinds):
            apart = left_out(KINDS[kind], manifest)
            for name, quantity in (*scalars(kind).items(), *companions(kind).items()):
                for own in (quantity, *quantity.beside) if name not in apart else ():
                    self._declare(kind, own, "" if own.words else np.int32(0) if own.flags else np.nan)
        for group in groups:
            self._declare(DRIVE if group.driven else "", group.id, "")

    def _declare(self, kind: str, quantity: Quantity, fill: Any) -> None:
        """A variable, and its fill value."""
        count = math.prod(self._layout.shape) * (self._drives if kind == DRIVE else 1)
        self._driven[quantity.name], self._quantities[quantity.name] = kind == DRIVE, quantity
        self._values[quantity.name] = np.full(count, fill, dtype=object if isinstance(fill, str) else None)

    def _place(self, driven: bool, place: int, drive: str) -> int:
        return place * self._drives + self._drive_place[drive] if driven else place

    def _enter_waiting(self, kind: str) -> None:
        """Set the scalars of the results that wait, those with the same names and as many members together."""
        alike: dict[tuple[object, ...], list[_Row]] = {}
        for row in self._waiting[kind]:
            alike.setdefault((len(next(iter(row.scalars.values()))), *row.scalars), []).append(row)
        self._waiting[kind].clear()
        for rows in alike.values():
            self._enter_alike(kind, rows)

    def _enter_alike(self, kind: str, rows: Sequence[_Row]) -> None:
        """Set the scalars of these results, a variable after the other: means over the members, (results, members) each."""
        numbers = np.array([list(row.scalars.values()) for row in rows], float).swapaxes(0, 1)
        found = dict(zip(rows[0].scalars, numbers, strict=True))
        places = np.array([row.place for row in rows])
        if kind == "record":
            counts = np.where(numbers == np.floor(numbers), numbers, np.nan)
            differ = np.fmax.reduce(counts, axis=2) > np.fmin.reduce(counts, axis=2)
            self._as_one[places] = ~differ.any(axis=0)
        for name, quantity in (*scalars(kind).items(), *companions(kind).items()):
            if quantity.name == VALIDITY.name or name not in found or quantity.name not in self._values:
                continue
            if quantity.words:
                self._values[quantity.name][places] = [_word(quantity, row) for row in found[name].tolist()]
                continue
            mean, uncertainty, members = mean_of(found[name])
            if quantity.uncertainty in found:  # of all members together: the result holds its ±
                uncertainty, members = found[quantity.uncertainty][:, 0], found[quantity.members][:, 0].astype(int)
            unit = np.array([row.factors[quantity.per] for row in rows])
            self._values[quantity.name][places] = mean * unit
            if quantity.ensemble:
                self._values[quantity.uncertainty][places] = uncertainty * np.abs(unit)
                self._values[quantity.members][places] = members


def _word(quantity: Quantity, numbers: Sequence[float]) -> str:
    """The word that most members' numbers stand for; how many, where not all do. None of too few members."""
    known = [quantity.words[int(each)] for each in numbers if not math.isnan(each)]
    return counted(known) if len(known) >= needed(len(numbers)) else ""


@lru_cache
def _advice(flags: int) -> str:
    return advice_on(flags_in(flags))


@lru_cache
def _names(parts: tuple[Origins, ...]) -> str:
    return " ".join(origin.name for origin in stemming(*parts))
