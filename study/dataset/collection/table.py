"""The variables over the cases of a campaign, and over the drives where they vary: the same ones whatever the results."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.ensemble import mean_of, needed
from nanoslip.solver.outcome import Outcome
from nanoslip.solver.parameter import Quantity, attributes
from nanoslip.solver.sliding.validity import advice_on, flags_in
from nanoslip.study.dataset.collection.counted import counted
from nanoslip.study.dataset.collection.layout import Layout
from nanoslip.study.dataset.variables import (
    ADVICE,
    COMPUTED_BY,
    DISCRETIZATION_ERROR,
    DRIVE,
    DRIVE_MEMBERS,
    MEMBERS,
    OUTCOMES,
    VALIDITY,
    Group,
    companions,
    scalars,
)
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.origin import NOBODY, Origins, stemming
from nanoslip.study.plan.kinds.kind import left_out
from nanoslip.study.plan.outlook import flags_of
from nanoslip.study.plan.plan import PENDING
from nanoslip.study.plan.task import TaskResult
from nanoslip.study.plan.tasks import KINDS, needed_kinds

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
