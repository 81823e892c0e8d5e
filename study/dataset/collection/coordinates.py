"""The coordinates of a dataset: every parameter that matters, along its dimension or over the cases, and the cases' names."""

import math
from collections.abc import Hashable, Mapping, Sequence
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import PARTS, Case
from nanoslip.solver.parameter import Quantity, attributes, declared
from nanoslip.study.dataset.collection.column import Column, Values, values_of
from nanoslip.study.dataset.collection.layout import Layout, array_of, drive_coordinates
from nanoslip.study.dataset.variables import CASE_ID, parameters
from nanoslip.study.manifest.cases import CampaignCase
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.parameters import STANDARD
from nanoslip.study.plan.plan import Plan
from nanoslip.study.plan.task import OF_ALL, OF_CONTACT, without_effect
from nanoslip.study.plan.tasks import needed_kinds


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

    @property
    def twins(self) -> bool:
        """Whether two cases have one name."""
        names = np.fromiter((int(each, 16) for each in self._ids), np.uint64, self._cases)
        return len(np.unique(names)) < self._cases

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
