"""Selection of cases, and of their records and trajectories, by values of coordinates: `radius=200`."""

import difflib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.study.dataset.collection.ragged import windows
from nanoslip.study.dataset.groups import groups_of
from nanoslip.study.dataset.variables import all_groups

Selection = Mapping[str, Any]
"""Name of a coordinate -> its value, or a list of values."""


@dataclass(frozen=True, slots=True)
class Places:
    """Cases of a dataset that a selection names, and what singles them out."""

    root: xr.Dataset
    dims: tuple[str, ...]
    positions: NDArray[np.int64]
    """(cases, dims)"""

    def __iter__(self) -> Iterator[xr.Dataset]:
        """The scalars of each case with its parameters."""
        along = set(self.dims)
        names = [name for name, each in self.root.variables.items() if set(each.dims) <= along]
        scalars = self.root[names].drop_vars([name for name in self.root.coords if name not in names], errors="ignore")
        for position in self.positions.tolist():
            yield scalars.isel(dict(zip(self.dims, position, strict=True)))

    def values(self, name: str) -> NDArray[Any]:
        """A variable or coordinate over the cases that the selection names."""
        each = self.root[name]
        indices = [self.positions[:, self.dims.index(str(dim))] for dim in each.dims]
        return np.asarray(each.values[tuple(indices)]) if indices else np.full(len(self.positions), each.values)


def places(root: xr.Dataset, name: str, selection: Selection) -> Places:
    """Where a variable has the coordinates that are selected. Raises KeyError where no case is like that."""
    along = root[name]
    chosen = xr.DataArray(np.ones(along.shape, np.bool_), dims=along.dims)
    for key, wanted in selection.items():
        if key not in along.coords:
            near = difflib.get_close_matches(key, map(str, along.coords), 1)
            known = f"did you mean {near[0]}?" if near else f"there are {', '.join(map(str, along.coords))}"
            raise KeyError(f"{key}: no coordinate of these cases; {known}")
        coordinate = along.coords[key]
        hits = (
            coordinate.isin(np.atleast_1d(np.asarray(wanted))) if not _text(coordinate) else _words(coordinate, wanted)
        )
        if not hits.any():
            raise KeyError(f"{key} = {wanted!r}: no such case; there are {_some(coordinate)}")
        chosen = chosen & hits.drop_vars(list(hits.coords))
    positions = np.argwhere(chosen.transpose(*along.dims).values)
    if not len(positions):
        raise KeyError(f"{_said(selection)}: no case is all of that")
    return Places(root, tuple(map(str, along.dims)), positions)


def run_of(root: xr.Dataset, name: str, selection: Selection) -> tuple[xr.Dataset, xr.Dataset]:
    """The run of one case in a group, as it stands there, and the case's scalars.

    Raises KeyError where no case is like that, ValueError where several are or the one has no run.
    """
    found = places(root, id_of(root, name), selection)
    if len(found.positions) != 1:
        several = [
            f"{dim} has {len(set(column))} values"
            for dim, column in zip(found.dims, found.positions.T.tolist(), strict=True)
            if len(set(column)) > 1
        ]
        raise ValueError(f"{_said(selection)}: needs to single out one case, but {', '.join(several)}")
    case = next(iter(found))
    slices = cut(root, name, [case[id_of(root, name)].values.item()])
    if slices is None:
        raise ValueError(f"{_said(selection)}: this case has no {name}")
    group = groups_of(root)[name]
    group = group.drop_vars([each for each in group.variables if name in group[each].dims])
    return group.isel({dim: windows_[0] for dim, windows_ in slices.items()}), case


def id_of(root: xr.Dataset, name: str) -> str:
    """The variable that names the run of each case. Raises ValueError where a dataset has no such group."""
    known = all_groups()[name].id.name
    if name not in groups_of(root):
        raise ValueError(f"this dataset has no group {name}: its campaign leaves that out (see [outputs] and stages)")
    if known not in root:
        raise ValueError(f"this dataset has lost {known}: keep it when choosing variables")
    return known


def cut(root: xr.Dataset, name: str, ids: list[Any]) -> dict[str, list[slice]] | None:
    """Sample dimension -> where the runs of these names are; None where there is none of a name."""
    group = groups_of(root)[name]
    numbers = {label: number for number, label in enumerate(group[name].values.tolist())}
    if not all(isinstance(each, str) and each for each in ids):
        return None
    if strangers := [each for each in ids if each not in numbers]:
        raise ValueError(
            f"{name} {strangers[0]}: not in the group of this dataset: join datasets with nanoslip.concat, "
            f"not xarray's functions"
        )
    return {
        sample: [slice(int(first[numbers[each]]), int(first[numbers[each] + 1])) for each in ids]
        for sample, (_, first) in windows(group, all_groups()[name]).items()
    }


def _text(coordinate: xr.DataArray) -> bool:
    return coordinate.dtype.kind in "OUT"


def _words(coordinate: xr.DataArray, wanted: Any) -> xr.DataArray:
    words = [wanted] if isinstance(wanted, str) else list(wanted)
    return coordinate.copy(data=np.isin(coordinate.values.astype(str), words))


def _some(coordinate: xr.DataArray) -> str:
    values = list(dict.fromkeys(coordinate.values.ravel().tolist()))
    return ", ".join(map(str, values[:8])) + (", …" if len(values) > 8 else "")


def _said(selection: Selection) -> str:
    return ", ".join(f"{name} = {value}" for name, value in selection.items()) or "no selection"
