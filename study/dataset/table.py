"""One long table of a dataset, whatever the design of its campaign: a row for each case, or for each case and drive."""

import difflib
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.study.dataset.texts import are_texts
from nanoslip.study.dataset.units import TABLE, is_given_in_si, read_scales, table_columns
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
        names = list(filter(self.has, map(str, self.root.variables)))
        others = [name for name in self.root.coords if name not in names]
        scalars = self.root[names].drop_vars(others, errors="ignore")
        for place in zip(*self.positions.values(), strict=True) if self.sizes else [()]:
            position = dict(zip(self.sizes, place, strict=True))
            yield scalars.isel(position)

    @property
    def positions(self) -> dict[str, list[int]]:
        """Dimension -> position of each row along it."""
        # A single case has no dimension, which `unravel_index` does not take.
        if not self.sizes:
            return {}
        shape = tuple(self.sizes.values())
        places = np.unravel_index(self.numbers, shape)
        columns = zip(self.sizes, places, strict=True)
        return {dim: place.tolist() for dim, place in columns}

    def at(self, chosen: Any) -> "CaseRows":
        """Some of the rows: a mask, a slice, or their places in another order."""
        return replace(self, numbers=self.numbers[chosen])

    def has(self, name: str) -> bool:
        """True if each row has one value of a variable or coordinate of this name."""
        if name not in self.root.variables:
            return False
        dims = self.root.variables[name].dims
        return set(dims) <= self.sizes.keys()

    def values(self, of: str | xr.Variable) -> NDArray[Any]:
        """(rows,) A variable or coordinate of the dataset, by name, or another one along some dimensions of the rows."""
        variable = self.root[of].variable if isinstance(of, str) else of
        # Laid out in the order of the rows' dimensions, through which their numbers count.
        laid = variable.set_dims(self.sizes)  # type: ignore[no-untyped-call]
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
            by_count = sorted(tally.items(), key=lambda pair: -pair[1])
            tallies.append(dict(by_count))
        return tallies

    def differing(self) -> dict[str, NDArray[Any]]:
        """The coordinates in which rows differ: axes of a product; of a list of cases, the listed parameters."""
        names = list(self.sizes)
        if CASE in self.sizes:
            further = [dim for dim in self.sizes if dim != CASE]
            names = [*author_coordinates(self.root), *further]
        differing = {}
        for name in names:
            values = self.values(name)
            if len(set(values.tolist())) > 1:
                differing[name] = values
        return differing


def case_rows(root: xr.Dataset, name: str = "") -> CaseRows:
    """All rows of a variable. Default: a row for each drive, or for each case if there are no drives."""
    along = root[name or ending_name(root)].sizes
    sizes = {str(dim): size for dim, size in along.items()}
    count = math.prod(sizes.values())
    return CaseRows(root, sizes, np.arange(count))


def ending_name(root: xr.Dataset) -> str:
    """Outcome of drives, or of cases without drives; for cases without results their name."""
    endings = [OUTCOMES[kind].ending.name for kind in ("drive", "")]
    return next((name for name in endings if name in root), "case_id")


def select_rows(root: xr.Dataset, name: str, selection: Selection) -> CaseRows:
    """Rows of a variable that have the selected coordinates. Raises KeyError if there are none."""
    along = root[name]
    everything = np.ones(along.shape, np.bool_)
    chosen = xr.DataArray(everything, dims=along.dims)
    for key, wanted in selection.items():
        chosen = chosen & match_mask(root, along.coords, key, wanted)
    # Each mask may have brought its dimensions in another order than the variable has them.
    mask = chosen.transpose(*along.dims).values.ravel()
    rows = case_rows(root, name).at(mask)
    if not len(rows):
        raise KeyError(f"{selection_text(selection)}: no case is all of that")
    return rows


def match_mask(root: xr.Dataset, coordinates: Mapping[Any, xr.DataArray], key: str, wanted: Any) -> xr.Variable:
    """Mask of a coordinate's wanted values, perhaps texts with units. Raises KeyError if there are none."""
    if key not in coordinates:
        near = difflib.get_close_matches(key, map(str, coordinates), 1)
        hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(map(str, coordinates))}"
        raise KeyError(f"{key}: no coordinate of these cases; {hint}")
    coordinate = coordinates[key].variable
    values = np.atleast_1d(np.asarray(wanted))
    # Texts for a coordinate of numbers: these may have units.
    if values.dtype.kind == "U" and not are_texts(coordinate):
        scales = read_scales(root.attrs)
        numbers = [parse_value(key, text, scales) for text in values.tolist()]
        values = np.array(numbers)
    is_wanted = np.isin(coordinate.values, nearest(coordinate.values, values))
    hits = coordinate.to_base_variable().copy(data=is_wanted)
    if not hits.any():
        asked = ",".join(map(str, np.ravel(wanted)))
        present = some(_values_with_sizes(root, key, coordinate))
        raise KeyError(f"{key} = {asked}: no such case; there are {present}")
    return hits


def _values_with_sizes(root: xr.Dataset, key: str, coordinate: xr.Variable) -> list[str]:
    """The values of a coordinate as they are typed, each with its size in SI where the dataset has that."""
    labels = coordinate.values.ravel().tolist()
    values = list(map(as_typed, labels))
    twin = si_coordinates().get(key)
    if twin is None or twin.name not in root.coords or root[twin.name].dims != coordinate.dims:
        return values
    in_si = root[twin.name].values.ravel().tolist()
    sizes = map(as_typed, in_si)
    return [f"{value} ({size} {twin.units})" for value, size in zip(values, sizes, strict=True)]


def with_coordinates(root: xr.Dataset, selection: Selection) -> xr.Dataset:
    """The cases with these coordinates: a single value drops its dimension, a list keeps it. Raises KeyError, ValueError."""
    selected = root
    for key, wanted in selection.items():
        hits = match_mask(selected, selected.coords, key, wanted)
        if hits.ndim > 1:
            raise ValueError(f"{key}: varies along {', '.join(map(str, hits.dims))}; select one of these first")
        for dim in hits.dims:
            places = np.flatnonzero(hits.values)
            single = np.ndim(wanted) == 0 and len(places) == 1
            place: Any = int(places[0]) if single else places
            selected = selected.isel({dim: place})
    return selected


NEAR: Final = 1e-9
"""Relative difference by which a number may differ from a coordinate, as 0.3 from 0.1 + 0.2."""


def nearest(coordinate: NDArray[Any], wanted: NDArray[Any]) -> NDArray[Any]:
    """Wanted values; a number becomes the coordinate's value that is nearly equal to it, if there is exactly one such
    value."""
    if coordinate.dtype.kind not in "iuf" or wanted.dtype.kind not in "iuf" or not coordinate.size:
        return wanted
    distinct = np.unique(coordinate)
    # Both ends by a product: `wanted ± NEAR·wanted` would be NaN for an infinite one.
    bounds = [wanted * (1.0 - NEAR), wanted * (1.0 + NEAR)]
    # Sorted, as the product with the larger factor is the lower end of a negative number.
    least, most = np.sort(bounds, axis=0)
    first = np.searchsorted(distinct, least)
    end = np.searchsorted(distinct, most, side="right")
    # Two that are near are two cases: which one is meant nobody can tell.
    candidate = distinct[first.clip(max=len(distinct) - 1)]
    return np.where(end - first == 1, candidate, wanted)


def some(values: Iterable[Any], between: str = ", ") -> str:
    """The first different values as text."""
    different = list(dict.fromkeys(values))
    more = ["…"] if len(different) > 8 else []
    shown = map(str, different[:8])
    return between.join([*shown, *more])


def selection_text(selection: Selection) -> str:
    """A selection as text, for messages."""
    return ", ".join(f"{name} = {value}" for name, value in selection.items()) or "no selection"


def one_case(root: xr.Dataset, texts: Mapping[str, str]) -> xr.Dataset:
    """Select a case of a dataset, without dimensions of length 1; it may have several drives.

    texts: parameter, as manifests or datasets call it -> its value as text, perhaps with a unit.
    Raises KeyError if no case matches, ValueError with the remaining choices if several do.
    """
    words = names_by_word()
    wanted = {words.get(word, word): text for word, text in texts.items()}
    rows = select_rows(root, ending_name(root), wanted)
    columns = rows.positions.items()
    remaining = {dim: sorted(set(column)) for dim, column in columns}
    positions: dict[str, Any] = {}
    for dim, places in remaining.items():
        positions[dim] = places if len(places) > 1 else places[0]
    part = root.isel(positions)
    if several := [str(dim) for dim in root["case_id"].dims if len(remaining[str(dim)]) > 1]:
        raise ValueError(f"needs to be one case: give also {'; '.join(_choices(part, several))}")
    return part


def _choices(part: xr.Dataset, dims: Iterable[str]) -> list[str]:
    """The parameters in which cases differ along dimensions, each with its values."""
    twins = [twin.name for name, twin in si_coordinates().items() if name in part.coords]
    apart, wanted = {"case_id", *twins}, set(dims)
    # The size in SI of a parameter is no choice of its own: a case is given by either.
    along = []
    for name, coordinate in part.coords.items():
        if name not in apart and wanted.intersection(coordinate.dims):
            along.append(str(name))
    choices = []
    for name in along:
        # The number of a case in a list is a choice only where no parameter is.
        if name == CASE and len(along) > 1:
            continue
        values = _typed_values(part, name)
        if len(values) > 1:
            choices.append(some((f"{name}={as_typed(value)}" for value in values), " or "))
    return choices


def _typed_values(part: xr.Dataset, name: str) -> list[Any]:
    """The different values of a parameter as one types them, in SI for a campaign that is given in SI."""
    twin = si_coordinates().get(name)
    if twin is None or twin.name not in part.coords or not is_given_in_si(part):
        values: list[Any] = part[name].to_series().dropna().unique().tolist()
        return values
    sizes = part[twin.name].to_series().dropna().unique().tolist()
    texts = [compact(size, twin.units, digits=6) for size in sizes]
    # A space between number and unit would need quotes in a shell.
    return [text.replace(" ", "") for text in texts]


def author_coordinates(root: xr.Dataset) -> list[str]:
    """Coordinates along a list of cases that its author lists, in a table or as axes; all parameters if none is listed."""
    along = [str(name) for name, coordinate in root.coords.items() if coordinate.dims == (CASE,)]
    table = table_columns(str(root.attrs.get(TABLE, "")))
    words = list(table or _manifest(root).get("axes", ()))
    listed = _coordinate_names(words)
    return [name for name in along if name in (listed or parameters())]


def axes_in_step(root: xr.Dataset) -> list[str]:
    """The axes of a list of cases whose values vary together (all first values, then all second values); empty for a
    table."""
    manifest = _manifest(root)
    together = manifest.get("design") == "zip" and not root.attrs.get(TABLE)
    return _coordinate_names(manifest.get("axes", ())) if together else []


def _coordinate_names(words: Iterable[str]) -> list[str]:
    """Names in a dataset of parameters that a campaign calls so, as max_presliding for presliding."""
    names = names_by_word()
    return [names.get(word, word) for word in words]


def _manifest(root: xr.Dataset) -> dict[str, Any]:
    return from_toml(str(root.attrs.get("manifest", "")))
