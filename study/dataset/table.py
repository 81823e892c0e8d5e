"""The variables over the cases of a campaign, and over the drives where they vary: the same ones whatever the results."""

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from operator import attrgetter
from typing import Any, Final, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.case import PARTS, Case
from nanoslip.solver.ensemble import mean_of, needed
from nanoslip.solver.outcome import Outcome
from nanoslip.solver.parameter import Quantity, attributes, declared
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
from nanoslip.study.manifest.cases import CampaignCase, cases_of
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.parameters import STANDARD, Value
from nanoslip.study.origin import NOBODY, Origins, stemming
from nanoslip.study.plan.kinds import KINDS, left_out, needed_kinds
from nanoslip.study.plan.outlook import flags_of
from nanoslip.study.plan.plan import PENDING, Plan
from nanoslip.study.plan.task import OF_ALL, OF_CONTACT, TaskResult, without_effect

# Where each case and drive of a campaign lies in its dataset: the dimensions, and the settings of drives along
# theirs.


@dataclass(frozen=True, slots=True)
class Layout:
    """Where each case and each drive lies: the axes that are dimensions, and a position along them."""

    axes: dict[str, tuple[Value, ...]]
    """Of the cases."""
    lengths: dict[str, int]
    """Of what varies from case to case, the last one fastest: as in `axes`, but in the campaign's order."""
    drive_axes: dict[str, tuple[Value, ...]]
    """Of the drives, which follow those of the cases."""
    drive_position: Mapping[str, tuple[int, ...]]
    """Label of a drive -> position."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Of a variable over the cases."""
        return tuple(len(values) for values in self.axes.values())

    def places(self, numbers: range) -> NDArray[np.intp]:
        """Where the cases of these numbers lie, counted through all of them, the last dimension fastest."""
        steps = {name: math.prod(self.shape[number:]) for number, name in enumerate(self.axes, 1)}
        found = np.zeros(len(numbers), np.intp)
        if not self.lengths:  # a single case
            return found
        along = np.unravel_index(np.arange(numbers.start, numbers.stop), tuple(self.lengths.values()))
        for name, at in zip(self.lengths, along, strict=True):
            found += steps.get(name, 0) * at  # an axis of one value may be no dimension
        return found


def layout_of(manifest: Manifest) -> Layout:
    """The axes where the design is a full product, else the list of cases.

    Drives lie along `drive`, where there are several tables of them, and along the drive axes of several values.
    """
    drive_axes = _drive_axes(manifest)
    return Layout(*_of_cases(manifest), drive_axes, _drive_positions(manifest, drive_axes))


def _drive_axes(manifest: Manifest) -> dict[str, tuple[Value, ...]]:
    names = tuple(dict.fromkeys(drive.name for drive in manifest.drives))
    found = {"drive": names, **manifest.drive_axes}
    return {name: values for name, values in found.items() if len(values) > 1}


def _drive_positions(manifest: Manifest, axes: dict[str, tuple[Value, ...]]) -> dict[str, tuple[int, ...]]:
    numbers = {name: {value: number for number, value in enumerate(values)} for name, values in axes.items()}
    points = {drive.label: {"drive": drive.name, **drive.point} for drive in manifest.drives}
    return {label: tuple(numbers[name][point[name]] for name in axes) for label, point in points.items()}


def _of_cases(manifest: Manifest) -> tuple[dict[str, tuple[Value, ...]], dict[str, int]]:
    if manifest.design != "product":
        points = manifest.case_count
        return {"case": tuple(range(points))}, {"case": points}
    given = manifest.axes
    names = (*STANDARD, *(name for name, values in given.items() if name not in STANDARD and len(values) > 1))
    first = next(cases_of(manifest, range(1))).parameters
    axes = {name: tuple(given.get(name, (first[name],))) for name in names}
    return axes, {name: len(values) for name, values in given.items()}


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
    missing: Any = "" if any(isinstance(value, str) for value in given.values()) else np.nan
    flat = [missing if value is None else value for value in values.ravel().tolist()]
    return dims, array_of(flat).reshape(values.shape)[()]


def array_of(values: Any) -> Any:
    """Values of a label, texts at their length."""
    return texts(values) if any(isinstance(value, str) for value in values) else np.array(values)


# A parameter of every case: its distinct values, and which of them each case has.


class Values(NamedTuple):
    """Values of cases one behind the other."""

    distinct: Sequence[Any]
    """None where a case has none."""
    which: NDArray[np.int32]
    """Of each case: the number of its value."""


def values_of(each: Sequence[Any]) -> Values:
    """Those of every case, the distinct ones once."""
    numbers = {value: number for number, value in enumerate(dict.fromkeys(each))}
    if len(numbers) == 1:
        return Values(list(numbers), np.zeros(len(each), np.int32))
    return Values(list(numbers), np.fromiter(map(numbers.__getitem__, each), np.int32, len(each)))


class Column:
    """The values of all cases. Little is kept of a parameter that is constant."""

    def __init__(self, cases: int) -> None:
        self._cases = cases
        self._numbers: dict[Any, int] = {}
        self._seen = 0
        self._of_case: NDArray[np.int32] | None = None

    def add(self, values: Values) -> None:
        """The values of the next cases."""
        numbers = [self._numbers.setdefault(value, len(self._numbers)) for value in values.distinct]
        if any(numbers) and self._of_case is None:  # all before had the first
            self._of_case = np.zeros(self._cases, np.int32)
        count = len(values.which)
        if self._of_case is not None:
            self._of_case[self._seen : self._seen + count] = np.array(numbers, np.int32)[values.which]
        self._seen += count

    @property
    def values(self) -> list[Any]:
        """The distinct ones."""
        return [value for value in self._numbers if value is not None]

    @property
    def count(self) -> int:
        """Cases that have one."""
        return int(np.count_nonzero(self._having()))

    def spread(self, places: NDArray[np.intp], size: int) -> NDArray[Any]:
        """The values at the places of their cases, which are so many at least."""
        sample, having = self.values[0], self._having()
        # Whole numbers stay whole, as floats lose digits beyond 2^53, except where some are missing.
        whole = isinstance(sample, int) and bool(having.all())
        kind: Any = object if isinstance(sample, str) else np.int64 if whole else float
        missing: Any = "" if isinstance(sample, str) else 0 if whole else np.nan
        known = np.array([missing if value is None else value for value in self._numbers], kind)
        found = np.full(size, missing, kind)
        found[places] = known[self._of_each()]
        return found

    def _of_each(self) -> NDArray[np.int32]:
        return np.zeros(self._cases, np.int32) if self._of_case is None else self._of_case

    def _having(self) -> NDArray[np.bool_]:
        return np.not_equal(self._of_each(), self._numbers.get(None, -1))


# The coordinates of a dataset: every parameter that matters, along its dimension or over the cases, and the cases'
# names.


class Coordinates:
    """Those of a campaign's cases, piece by piece, and its drives'."""

    def __init__(self, manifest: Manifest, layout: Layout) -> None:
        self._manifest, self._layout = manifest, layout
        self._cases = math.prod(layout.shape)
        self._ids: NDArray[Any] = np.full(self._cases, "", dtype=object)
        self._columns = {name: Column(self._cases) for name in varied(layout)}
        self._able = 0

    def add(self, places: NDArray[np.intp], ids: Sequence[str], able: int, values: Mapping[str, Values]) -> None:
        """Names and parameters of the next cases. able: how many of them are not refused."""
        self._ids[places] = ids
        self._able += able
        for name, column in self._columns.items():
            column.add(values[name])

    def found(self) -> dict[str, Any]:
        """Along its dimension, over the cases where it varies, else once."""
        layout, dims = self._layout, tuple(self._layout.axes)
        found: dict[str, Any] = {
            name: (name, array_of(values), attributes(_parameter(name))) for name, values in layout.axes.items()
        }
        found["case_id"] = (dims, self._ids.reshape(layout.shape), attributes(CASE_ID))
        for name, column in self._columns.items():
            if column.values:
                found[name] = (*self._lying(name, column), attributes(_parameter(name)))
        return found | drive_coordinates(self._manifest, layout)

    def _lying(self, name: str, column: Column) -> tuple[tuple[str, ...], Any]:
        """Dimensions and values of a parameter."""
        dims, shape = tuple(self._layout.axes), self._layout.shape
        along = set(self._manifest.axes) | set(STANDARD) if "case" in dims else set()
        if len(column.values) == 1 and column.count >= self._able and name not in along:
            return (), column.values[0]
        return dims, column.spread(self._layout.places(range(self._cases)), self._cases).reshape(shape)


def varied(layout: Layout) -> list[str]:
    """The parameters that may vary over the cases; those along a dimension apart."""
    return [name for name in parameters() if name not in layout.axes]


_OWN = tuple(declared(Case))
_own = attrgetter(*_OWN)


def values_in(plan: Plan, names: Sequence[str]) -> dict[str, Values]:
    """Parameters of the cases of a plan, as their campaign asks for them; None where one changes no result."""
    exclusions = OF_ALL if "record" in needed_kinds(plan.manifest) else OF_CONTACT
    kinds: dict[Hashable, int] = {}
    shared: list[Mapping[str, Any]] = []
    """Of each kind of cases, alike in all but their own parameters: what one has."""
    which: list[int] = []
    own: list[tuple[Any, ...]] = []
    for case in plan.cases:
        asked = case.case
        if asked is None:
            kind: Hashable = case.case_id
        else:
            without = without_effect(asked, exclusions)
            kind = id(asked.slab), *[id(getattr(asked, name)) for name in PARTS], without
        which.append(kinds.setdefault(kind, len(kinds)))
        if len(kinds) > len(shared):
            shared.append(_of_one(case, asked, without if asked else frozenset()))
        own.append(_own(asked) if asked else tuple(map(case.parameters.get, _OWN)))
    numbers = np.array(which, np.int32)
    found = {name: Values([each.get(name) for each in shared], numbers) for name in names}
    for name, values in zip(_OWN, zip(*own, strict=True), strict=True):
        if name in found:
            having = [name in each for each in shared]
            found[name] = values_of(
                [value if having[kind] else None for value, kind in zip(values, which, strict=True)]
            )
    return found


def _of_one(case: CampaignCase, asked: Case | None, without: frozenset[str]) -> dict[str, Any]:
    point = case.parameters if asked is None else asked.flat
    return {name: value for name, value in point.items() if name not in without}


def _parameter(name: str) -> Quantity:
    return parameters().get(name) or Quantity(name, f"number of the {name}")


_COUNTED: Final = {"contact": MEMBERS, "record": MEMBERS, DRIVE: DRIVE_MEMBERS}
"""Kind of task -> the variable that counts its members."""
PIECE: Final = 4096
"""Results whose numbers are entered together."""

Results = Mapping[tuple[str, str], TaskResult]
"""Kind of task and label of its drive ("" without one) -> its result, of those that are finished."""


@dataclass(slots=True)
class _Rows:
    """Results of one kind that wait to be entered: where, which numbers, and by what they are multiplied."""

    places: list[int] = field(default_factory=list)
    scalars: list[Mapping[str, Sequence[float | int]]] = field(default_factory=list)
    factors: list[Mapping[str, float]] = field(default_factory=list)


class Declared:
    """The variables of a campaign's dataset over its cases, and over the drives of each."""

    def __init__(self, manifest: Manifest, layout: Layout, groups: Sequence[Group]) -> None:
        """groups: of runs, whose names stand over the cases or drives."""
        self.layout = layout
        self.drives = math.prod(_lengths(layout.drive_axes).values())
        self.drive_place = _places(layout.drive_position, _lengths(layout.drive_axes))
        self.driven: dict[str, bool] = {}
        """Name -> whether it lies over the drives too."""
        self.quantities: dict[str, Quantity] = {}
        self._fills: dict[str, object] = {}
        self._declare_all(manifest, groups)

    def empty(self, cases: int) -> dict[str, NDArray[Any]]:
        """Of so many cases what stands for values that are not there, by name; the drives of a case one behind the other."""
        return {
            name: np.full(
                cases * (self.drives if self.driven[name] else 1), fill, dtype=object if isinstance(fill, str) else None
            )
            for name, fill in self._fills.items()
        }

    def _declare_all(self, manifest: Manifest, groups: Sequence[Group]) -> None:
        kinds = needed_kinds(manifest)
        for kind, (ending, message) in OUTCOMES.items():
            if not kind or kind in kinds:
                self._declare(kind, ending, PENDING)
                self._declare(kind, message, "")
                self._declare(kind, COMPUTED_BY[kind], "")
        self._declare("", DISCRETIZATION_ERROR, np.nan)
        self._declare("", ADVICE, "")
        self._declare("", MEMBERS, np.nan)
        if DRIVE in kinds:
            self._declare(DRIVE, DRIVE_MEMBERS, np.nan)
        for kind in KINDS:
            if kind in kinds:
                apart = left_out(KINDS[kind], manifest)
                for name, quantity in (*scalars(kind).items(), *companions(kind).items()):
                    for own in (quantity, *quantity.beside) if name not in apart else ():
                        self._declare(kind, own, _nothing(own))
        for each in groups:
            self._declare(DRIVE if each.driven else "", each.id, "")

    def _declare(self, kind: str, quantity: Quantity, fill: object) -> None:
        self.driven[quantity.name] = kind == DRIVE
        self.quantities[quantity.name], self._fills[quantity.name] = quantity, fill


class Whole:
    """Values of all cases, and of their drives, each at its place."""

    def __init__(self, declared: Declared) -> None:
        self._declared, self._cases = declared, math.prod(declared.layout.shape)
        self._values = declared.empty(self._cases)

    def take(self, places: NDArray[np.intp], values: Mapping[str, NDArray[Any]]) -> None:
        """Set the values of the cases at these places, as `Table.values` gives them."""
        for name, found in values.items():
            self._values[name].reshape(self._cases, -1)[places] = found.reshape(len(places), -1)

    @property
    def variables(self) -> dict[str, xr.Variable]:
        """All of them, by name."""
        layout, found = self._declared.layout, {}
        for name, values in self._values.items():
            dims = _lengths(layout.axes | layout.drive_axes if self._declared.driven[name] else layout.axes)
            shaped = values.reshape(tuple(dims.values()))
            found[name] = xr.Variable(tuple(dims), shaped, attributes(self._declared.quantities[name]))
        return found


class Table:
    """Values of some cases, and of their drives, a case behind the other."""

    def __init__(self, declared: Declared, cases: int) -> None:
        """cases: how many."""
        self._declared, self._values = declared, declared.empty(cases)
        self._waiting = {kind: _Rows() for kind in KINDS}

    def values(self) -> dict[str, NDArray[Any]]:
        """All that was set, by the variables' names: over the cases, and the drives of each one behind the other."""
        for kind in self._waiting:
            self._enter_waiting(kind)
        return self._values

    def put(self, name: str, place: int, drive: str, value: object) -> None:
        """Set one value. place: of the case among them."""
        self._values[name][self._place(self._declared.driven[name], place, drive)] = value

    def say_outcome(self, place: int, outcome: Outcome | None, drive: str = "") -> None:
        """Set how a case, or its drive, ended; None leaves it pending."""
        if outcome is not None:
            ending, message = OUTCOMES[DRIVE if drive else ""]
            self.put(ending.name, place, drive, outcome.ending.value)
            self.put(message.name, place, drive, outcome.message)

    def say_makers(self, place: int, results: Results) -> None:
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
        waiting.places.append(self._place(result.kind == DRIVE, place, drive))
        waiting.scalars.append(result.scalars)
        waiting.factors.append(by)
        if len(waiting.places) >= PIECE:
            self._enter_waiting(result.kind)
        if result.scalars and result.kind in _COUNTED:
            count = len(next(iter(result.scalars.values())))
            self.put(_COUNTED[result.kind].name, place, drive, count)
        if (flags := flags_of(case, result)) is not None:
            self.put(VALIDITY.name, place, drive, flags)
            self.put(ADVICE.name, place, drive, _advice(flags))

    def _place(self, driven: bool, place: int, drive: str) -> int:
        return place * self._declared.drives + self._declared.drive_place[drive] if driven else place

    def _enter_waiting(self, kind: str) -> None:
        """Set the scalars of the results that wait, those with the same names and as many members together."""
        waiting, self._waiting[kind] = self._waiting[kind], _Rows()
        alike: dict[tuple[object, ...], list[int]] = {}
        for number, row in enumerate(waiting.scalars):
            if row:  # of what was refused there are none
                alike.setdefault((len(next(iter(row.values()))), *row), []).append(number)
        for (_, *names), held in alike.items():
            numbers = np.array([list(waiting.scalars[number].values()) for number in held], float)
            found = dict(zip(map(str, names), numbers.reshape(len(held), len(names), -1).swapaxes(0, 1), strict=True))
            factors = [waiting.factors[number] for number in held]
            self._enter_alike(kind, found, np.array(waiting.places)[held], factors)

    def _enter_alike(
        self,
        kind: str,
        found: Mapping[str, NDArray[np.float64]],
        places: NDArray[np.intp],
        factors: Sequence[Mapping[str, float]],
    ) -> None:
        """Set these scalars of results, a variable after the other: means over the members, (results, members) each."""
        units: dict[str, NDArray[Any]] = {}
        for known in (scalars(kind), companions(kind)):
            for name, quantity in known.items():
                if quantity.name == VALIDITY.name or name not in found:
                    continue
                if quantity.per not in units:
                    units[quantity.per] = np.array([by[quantity.per] for by in factors])
                if quantity.words:
                    self._values[quantity.name][places] = [_word(quantity, row) for row in found[name].tolist()]
                    continue
                mean, uncertainty, members = mean_of(found[name])
                if quantity.uncertainty in found:  # of all members together: the result holds its ±
                    uncertainty, members = found[quantity.uncertainty][:, 0], found[quantity.members][:, 0].astype(int)
                self._values[quantity.name][places] = mean * units[quantity.per]
                if quantity.ensemble:
                    self._values[quantity.uncertainty][places] = uncertainty * np.abs(units[quantity.per])
                    self._values[quantity.members][places] = members


def _lengths(axes: Mapping[str, tuple[Any, ...]]) -> dict[str, int]:
    return {name: len(values) for name, values in axes.items()}


def _places(positions: Mapping[str, tuple[int, ...]], dims: Mapping[str, int]) -> dict[str, int]:
    """Where each position lies, counted through all of them."""
    steps = [math.prod(list(dims.values())[number + 1 :]) for number in range(len(dims))]
    return {name: sum(map(int.__mul__, at, steps)) for name, at in positions.items()}


def _nothing(quantity: Quantity) -> object:
    """What stands for a number that is not there."""
    if quantity.words:
        return ""
    return np.int32(0) if quantity.flags else np.nan


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
