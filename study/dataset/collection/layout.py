"""Where each case and drive of a campaign lies in its dataset: the dimensions, and every parameter along them."""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from solver.case import PARTS, Case
from solver.parameter import declared
from solver.quantity import Quantity, attributes
from study.dataset.collection.ragged import texts
from study.dataset.variables import CASE_ID, DRIVE_NAME, parameters
from study.manifest.cases import MEMBER, CampaignCase
from study.manifest.manifest import VARIED, Manifest
from study.manifest.parameters import STANDARD, Value
from study.plan.keys import OF_ALL, OF_CONTACT, Exclusion, without_effect
from study.plan.plan import Plan
from study.plan.tasks import needed_kinds

PIECE: Final = 512
"""Cases whose parameters are entered together: what they make in between fits the processor's caches."""


@dataclass(frozen=True, slots=True)
class Layout:
    """Where each case and each drive lies: the axes that are dimensions, and a position along them."""

    axes: dict[str, tuple[Value, ...]]
    """Of the cases."""
    places: NDArray[np.intp]
    """Where each case of the plan lies, counted through all of them, the last dimension fastest."""
    drive_axes: dict[str, tuple[Value, ...]]
    """Of the drives, which follow those of the cases."""
    drive_position: Mapping[str, tuple[int, ...]]
    """Label of a drive -> position."""


def layout_of(plan: Plan) -> Layout:
    """The axes where the design is a full product, else the list of cases; members of an ensemble come last.

    Drives lie along `drive`, where there are several tables of them, and along the drive axes of several values.
    """
    drive_axes = _drive_axes(plan.manifest)
    return Layout(*_of_cases(plan), drive_axes, _drive_positions(plan.manifest, drive_axes))


def _drive_axes(manifest: Manifest) -> dict[str, tuple[Value, ...]]:
    names = tuple(dict.fromkeys(drive.name for drive in manifest.drives))
    found = {"drive": names, **manifest.drive_axes}
    return {name: values for name, values in found.items() if len(values) > 1}


def _drive_positions(manifest: Manifest, axes: dict[str, tuple[Value, ...]]) -> dict[str, tuple[int, ...]]:
    numbers = {name: {value: number for number, value in enumerate(values)} for name, values in axes.items()}
    points = {drive.label: {"drive": drive.name, **drive.point} for drive in manifest.drives}
    return {label: tuple(numbers[name][point[name]] for name in axes) for label, point in points.items()}


def _of_cases(plan: Plan) -> tuple[dict[str, tuple[Value, ...]], NDArray[np.intp]]:
    members = plan.manifest.ensemble.members
    ensemble: dict[str, tuple[Value, ...]] = {MEMBER: tuple(range(members))} if members > 1 else {}
    if plan.manifest.design != "product":
        return {"case": tuple(range(len(plan.cases) // members)), **ensemble}, np.arange(len(plan.cases))
    given = plan.manifest.axes
    names = (*STANDARD, *(name for name, values in given.items() if name not in STANDARD and len(values) > 1))
    axes = {name: tuple(given.get(name, (plan.cases[0].parameters[name],))) for name in names} | ensemble
    return axes, _places(plan.cases, axes)


def _places(cases: Sequence[CampaignCase], axes: Mapping[str, Sequence[Value]]) -> NDArray[np.intp]:
    lengths = list(map(len, axes.values()))
    steps = {name: math.prod(lengths[number:]) for number, name in enumerate(axes, 1)}
    # What is no label of the cases is the same for all of them.
    ways: list[tuple[int, dict[Any, int]]] = []
    for column, name in enumerate(cases[0].labels.names):
        if name in axes:
            ways.append((column, {value: number * steps[name] for number, value in enumerate(axes[name])}))
    found = (sum([way[case.values[column]] for column, way in ways]) for case in cases)
    return np.fromiter(found, np.intp, len(cases))


def coordinates(plan: Plan, layout: Layout) -> dict[str, Any]:
    """Every parameter that matters: along its dimension, over the cases where it varies, else once; and the drives'."""
    shape = tuple(len(values) for values in layout.axes.values())
    along = set(plan.manifest.axes) | set(STANDARD) if "case" in layout.axes else set()
    ids = np.full(math.prod(shape), "", dtype=object)
    ids[layout.places] = [case.case_id for case in plan.cases]
    found: dict[str, Any] = {
        name: (name, _array(values), attributes(_parameter(name))) for name, values in layout.axes.items()
    }
    found["case_id"] = (tuple(layout.axes), ids.reshape(shape), attributes(CASE_ID))
    # Of what varies between members, an axis says where the first of them is: the case itself knows better.
    exclusions = OF_ALL if "record" in needed_kinds(plan.manifest) else OF_CONTACT
    columns = _columns(plan, exclusions, [name for name in parameters() if name not in layout.axes])
    able = sum(case.case is not None for case in plan.cases)
    for name, column in columns.items():
        values = column.values
        if not values:
            continue
        if len(values) == 1 and column.count >= able and name not in along:
            found[name] = ((), values[0], attributes(_parameter(name)))
            continue
        spread, dims = column.spread(layout.places, math.prod(shape)).reshape(shape), tuple(layout.axes)
        if dims[-1] == MEMBER and name not in VARIED:
            spread, dims = spread[..., 0], dims[:-1]
        found[name] = (dims, spread, attributes(_parameter(name)))
    return found | _drive_coordinates(plan.manifest, layout)


class _Column:
    """A parameter of every case: its distinct values, and which of them each case has. Little is kept of one that is constant."""

    def __init__(self, cases: int) -> None:
        self._cases = cases
        self._numbers: dict[Any, int] = {}
        self._seen = 0
        self._of_case: NDArray[np.int32] | None = None

    def add(self, values: Sequence[Any]) -> None:
        """The values of the next cases; None where one has none."""
        numbers = [self._numbers.setdefault(value, len(self._numbers)) for value in dict.fromkeys(values)]
        if any(numbers) and self._of_case is None:  # all before had the first
            self._of_case = np.zeros(self._cases, np.int32)
        if self._of_case is not None:
            its = map(self._numbers.__getitem__, values)
            self._of_case[self._seen : self._seen + len(values)] = np.fromiter(its, np.int32, len(values))
        self._seen += len(values)

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


def _columns(plan: Plan, exclusions: tuple[Exclusion, ...], names: Sequence[str]) -> dict[str, _Column]:
    columns = {name: _Column(len(plan.cases)) for name in names}
    cases, points = iter(plan.cases), _Points(exclusions)
    while together := list(itertools.islice(cases, PIECE)):
        found = [points.of(case, plan.asked(case)) for case in together]
        for name, column in columns.items():
            column.add([point.get(name) for point in found])
    return columns


class _Points:
    """Every parameter of cases that changes a result, as their campaign asks for it."""

    def __init__(self, exclusions: tuple[Exclusion, ...]) -> None:
        self._exclusions = exclusions
        self._own = attrgetter(*declared(Case))
        self._parts: dict[tuple[int, ...], tuple[dict[str, Any], object]] = {}

    def of(self, case: CampaignCase, asked: Case | None) -> dict[str, Any]:
        """The parameters of one. asked: with all that its campaign asks for; None where it is refused."""
        if asked is None:
            return dict(case.parameters)
        found = {**case.parameters, **self._of_parts(asked), **dict(zip(declared(Case), self._own(asked), strict=True))}
        for name in without_effect(asked, self._exclusions):
            found.pop(name, None)
        return found

    def _of_parts(self, asked: Case) -> dict[str, Any]:
        """The parameters of its slab and its other parts, which many cases share."""
        parts = asked.slab, *(getattr(asked, name) for name in PARTS)
        names = tuple(map(id, parts))
        if names not in self._parts:
            if len(self._parts) >= PIECE:  # each case has its own
                self._parts.clear()
            self._parts[names] = asked.flat, parts  # which are held: no other part may lie where they do
        return self._parts[names][0]


def _drive_coordinates(manifest: Manifest, layout: Layout) -> dict[str, Any]:
    """The drives' names and settings: along their own dimension, along `drive`, and along those with which they vary."""
    found: dict[str, Any] = {}
    points = {layout.drive_position[each.label]: {"drive": each.name, **each.settings} for each in manifest.drives}
    for name in ("drive", *parameters()) if points else ():
        label = DRIVE_NAME if name == "drive" else parameters()[name]
        if name in layout.drive_axes:
            found[name] = (name, _array(layout.drive_axes[name]), attributes(label))
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
    return dims, _array(flat).reshape(values.shape)[()]


def _array(values: Any) -> Any:
    return texts(values) if any(isinstance(value, str) for value in values) else np.array(values)


def _parameter(name: str) -> Quantity:
    return parameters().get(name) or Quantity(name, f"number of the {name}")
