"""One long table of a dataset, whatever the design of its campaign: a row for each case, or for each case and drive."""

import difflib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.study.dataset.texts import are_texts
from nanoslip.study.dataset.units import is_given_in_si, read_scales
from nanoslip.study.dataset.variables import (
    OUTCOMES,
    member_counts,
    parameters,
    si_coordinates,
)
from nanoslip.study.manifest.cases import parse_value
from nanoslip.study.manifest.parameters import (
    as_typed,
    compact,
    names_by_word,
)
from nanoslip.study.toml_text import from_toml

Selection = Mapping[str, Any]
"""Name of a coordinate -> its value, perhaps as text with a unit (`radius="20 cm"`), or a list of values."""
CASE: Final = "case"
"""The dimension of a list of cases."""


@dataclass(frozen=True, slots=True)
class CaseRows:
    """Rows of the long table of a dataset: all cases, all drives of all cases, or a selection of these."""

    root: xr.Dataset
    sizes: dict[str, int]
    """Dimensions of the cases, or of the cases and drives, with their sizes in the dataset."""
    numbers: NDArray[np.intp]
    """(rows,) Positions in the dataset, counted through all dimensions, the last one fastest."""

    def __len__(self) -> int:
        return len(self.numbers)

    def __iter__(self) -> Iterator[xr.Dataset]:
        """The scalars of each row with its parameters."""
        dims = self.sizes.keys()
        names = [name for name, variable in self.root.variables.items() if set(variable.dims) <= dims]
        others = [name for name in self.root.coords if name not in names]
        scalars = self.root[names].drop_vars(others, errors="ignore")
        for place in zip(*self.positions.values(), strict=True) if self.sizes else [()]:
            yield scalars.isel(dict(zip(self.sizes, place, strict=True)))

    @property
    def positions(self) -> dict[str, list[int]]:
        """Dimension -> position of each row along it."""
        # A single case has no dimension, which `unravel_index` does not take.
        if not self.sizes:
            return {}
        places = np.unravel_index(self.numbers, tuple(self.sizes.values()))
        return {dim: place.tolist() for dim, place in zip(self.sizes, places, strict=True)}

    def at(self, chosen: Any) -> "CaseRows":
        """Some of the rows: a mask, a slice, or their places in another order."""
        return replace(self, numbers=self.numbers[chosen])

    def has(self, name: str) -> bool:
        """True if each row has one value of a variable or coordinate of this name."""
        if name not in self.root.variables:
            return False
        return set(self.root.variables[name].dims) <= self.sizes.keys()

    def values(self, of: str | xr.Variable) -> NDArray[Any]:
        """(rows,) A variable or coordinate of the dataset, by name, or another one along some dimensions of the rows."""
        each = self.root[of].variable if isinstance(of, str) else of
        laid = each.set_dims(self.sizes)  # type: ignore[no-untyped-call]
        return np.asarray(laid.values.ravel()[self.numbers])

    def tallies(self, name: str) -> list[dict[str, int]]:
        """Members of each row by word, the most frequent first; one word where none are counted."""
        variables = member_counts(self.root, name)
        counts = {word: self.values(count.variable).tolist() for word, count in variables.items()}
        tallies = []
        for row, word in enumerate(self.values(name).tolist()):
            tally = {word: int(column[row]) for word, column in counts.items() if column[row]}
            if not (word and tally):
                tally = {str(word): 1}
            tallies.append(dict(sorted(tally.items(), key=lambda pair: -pair[1])))
        return tallies

    def differing(self) -> dict[str, NDArray[Any]]:
        """The coordinates in which rows differ: axes of a product; of a list of cases, the listed parameters."""
        names = list(self.sizes)
        if CASE in self.sizes:
            further = [dim for dim in self.sizes if dim != CASE]
            names = [*author_coordinates(self.root), *further]
        columns = {name: self.values(name) for name in names}
        return {name: values for name, values in columns.items() if len(set(values.tolist())) > 1}


def case_rows(root: xr.Dataset, name: str = "") -> CaseRows:
    """All rows of a variable. Default: a row for each drive, or for each case if there are no drives."""
    along = root[name or ending_name(root)].sizes
    sizes = {str(dim): size for dim, size in along.items()}
    count = int(np.prod(list(sizes.values()), dtype=np.int64))
    return CaseRows(root, sizes, np.arange(count))


def ending_name(root: xr.Dataset) -> str:
    """Outcome of drives, or of cases without drives; for cases without results their name."""
    endings = [OUTCOMES[kind].ending.name for kind in ("drive", "")]
    return next((name for name in endings if name in root), "case_id")


def select_rows(root: xr.Dataset, name: str, selection: Selection) -> CaseRows:
    """Rows of a variable that have the selected coordinates. Raises KeyError if there are none."""
    along = root[name]
    chosen = xr.DataArray(np.ones(along.shape, np.bool_), dims=along.dims)
    for key, wanted in selection.items():
        chosen = chosen & match_mask(root, along.coords, key, wanted)
    found = case_rows(root, name).at(chosen.transpose(*along.dims).values.ravel())
    if not len(found):
        raise KeyError(f"{selection_text(selection)}: no case is all of that")
    return found


def match_mask(root: xr.Dataset, coordinates: Mapping[Any, xr.DataArray], key: str, wanted: Any) -> xr.Variable:
    """Mask of a coordinate's wanted values, perhaps texts with units. Raises KeyError if there are none."""
    if key not in coordinates:
        near = difflib.get_close_matches(key, map(str, coordinates), 1)
        known = f"did you mean {near[0]}?" if near else f"there are {', '.join(map(str, coordinates))}"
        raise KeyError(f"{key}: no coordinate of these cases; {known}")
    coordinate, values = coordinates[key].variable, np.atleast_1d(np.asarray(wanted))
    if values.dtype.kind == "U" and not are_texts(coordinate):
        scales = read_scales(root.attrs)
        values = np.array([parse_value(key, text, scales) for text in values.tolist()])
    is_wanted = np.isin(coordinate.values, nearest(coordinate.values, values))
    hits = coordinate.to_base_variable().copy(data=is_wanted)
    if not hits.any():
        given = ",".join(map(str, np.ravel(wanted)))
        there = some(_values_with_sizes(root, key, coordinate))
        raise KeyError(f"{key} = {given}: no such case; there are {there}")
    return hits


def _values_with_sizes(root: xr.Dataset, key: str, coordinate: xr.Variable) -> list[str]:
    """The values of a coordinate as they are typed, each with its size in SI where the dataset has that."""
    values = list(map(as_typed, coordinate.values.ravel().tolist()))
    twin = si_coordinates().get(key)
    if twin is None or twin.name not in root.coords or root[twin.name].dims != coordinate.dims:
        return values
    sizes = map(as_typed, root[twin.name].values.ravel().tolist())
    return [f"{value} ({size} {twin.units})" for value, size in zip(values, sizes, strict=True)]


def with_coordinates(root: xr.Dataset, selection: Selection) -> xr.Dataset:
    """The cases with these coordinates: a single value drops its dimension, a list keeps it. Raises KeyError, ValueError."""
    found = root
    for key, wanted in selection.items():
        hits = match_mask(found, found.coords, key, wanted)
        if hits.ndim > 1:
            raise ValueError(f"{key}: varies along {', '.join(map(str, hits.dims))}; select one of these first")
        for dim in hits.dims:
            places = np.flatnonzero(hits.values)
            single = np.ndim(wanted) == 0 and len(places) == 1
            found = found.isel({dim: int(places[0]) if single else places})
    return found


NEAR: Final = 1e-9
"""Relative difference by which a number may differ from a coordinate, as 0.3 from 0.1 + 0.2."""


def nearest(there: NDArray[Any], wanted: NDArray[Any]) -> NDArray[Any]:
    """Wanted values; a number becomes the coordinate's value that is nearly equal to it, if there is exactly one such
    value."""
    if there.dtype.kind not in "iuf" or wanted.dtype.kind not in "iuf" or not there.size:
        return wanted
    known = np.unique(there)
    # Both ends by a product: `wanted ± NEAR·wanted` would be NaN for an infinite one.
    least, most = np.sort([wanted * (1.0 - NEAR), wanted * (1.0 + NEAR)], axis=0)
    first = np.searchsorted(known, least)
    end = np.searchsorted(known, most, side="right")
    # Two that are near are two cases: which one is meant nobody can tell.
    candidate = known[first.clip(max=len(known) - 1)]
    return np.where(end - first == 1, candidate, wanted)


def some(values: Iterable[Any], between: str = ", ") -> str:
    """The first different values as text."""
    different = list(dict.fromkeys(values))
    more = ["…"] if len(different) > 8 else []
    return between.join([*map(str, different[:8]), *more])


def selection_text(selection: Selection) -> str:
    """A selection as text, for messages."""
    return ", ".join(f"{name} = {value}" for name, value in selection.items()) or "no selection"


def one_case(root: xr.Dataset, given: Mapping[str, str]) -> xr.Dataset:
    """Select a case of a dataset, without dimensions of length 1; it may have several drives.

    given: parameter, as manifests or datasets call it -> its value as text, perhaps with a unit.
    Raises KeyError if no case matches, ValueError with the remaining choices if several do.
    """
    words = names_by_word()
    wanted = {words.get(word, word): text for word, text in given.items()}
    rows = select_rows(root, ending_name(root), wanted)
    left = {dim: sorted(set(column)) for dim, column in rows.positions.items()}
    positions: dict[str, Any] = {}
    for dim, places in left.items():
        positions[dim] = places if len(places) > 1 else places[0]
    part = root.isel(positions)
    if several := [str(dim) for dim in root["case_id"].dims if len(left[str(dim)]) > 1]:
        raise ValueError(f"needs to be one case: give also {'; '.join(_choices(part, several))}")
    return part


def _choices(part: xr.Dataset, dims: Iterable[str]) -> list[str]:
    """The parameters in which cases differ along dimensions, each with its values."""
    twins = [twin.name for name, twin in si_coordinates().items() if name in part.coords]
    apart, wanted = {"case_id", *twins}, set(dims)
    coordinates = {str(name): each.dims for name, each in part.coords.items() if name not in apart}
    along = [name for name, own_dims in coordinates.items() if wanted.intersection(own_dims)]
    choices = []
    for name in along:
        if name == CASE and len(along) > 1:
            continue
        twin = si_coordinates().get(name)
        in_si = twin is not None and twin.name in part.coords and is_given_in_si(part)
        values = part[twin.name if twin and in_si else name].to_series().dropna().unique().tolist()
        if twin and in_si:
            values = [compact(value, twin.units, digits=6).replace(" ", "") for value in values]  # without quotes
        if len(values) > 1:
            choices.append(some((f"{name}={as_typed(value)}" for value in values), " or "))
    return choices


def author_coordinates(root: xr.Dataset) -> list[str]:
    """Coordinates along a list of cases that its author lists, in a table or as axes; all parameters if none is listed."""
    along = [str(name) for name, each in root.coords.items() if each.dims == (CASE,)]
    table = str(root.attrs.get("manifest_table", ""))
    if table:
        header = table.splitlines()[0]
        listed = {name.strip() for name in header.split(",")}
    else:
        listed = set(_manifest(root).get("axes", ()))
    return [name for name in along if name in (listed or parameters())]


def axes_in_step(root: xr.Dataset) -> list[str]:
    """The axes of a list of cases whose values vary together (all first values, then all second values); empty for a
    table."""
    manifest = _manifest(root)
    together = manifest.get("design") == "zip" and not root.attrs.get("manifest_table")
    return list(manifest.get("axes", ())) if together else []


def _manifest(root: xr.Dataset) -> dict[str, Any]:
    return from_toml(str(root.attrs.get("manifest", "")))
