"""Several datasets as one: scalars side by side, groups one behind the other."""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.outcome import NanoslipError
from nanoslip.study.dataset.file import FORMAT, carrying, groups_of
from nanoslip.study.dataset.variables import OUTCOMES, SOFTWARE, VALIDITY, Group, all_groups, parameters, windows
from nanoslip.study.plan.plan import PENDING

# Positions of the cases of several datasets in their union: its axes, and each variable over them.


class NotJoinableError(NanoslipError, ValueError):
    """Datasets that are not parts of one; the message says what differs."""


@dataclass(frozen=True, slots=True)
class Axes:
    """The dimensions of several datasets together: name -> its labels."""

    labels: dict[str, list[Any]]
    added: tuple[str, ...]
    """Parameters that each dataset has one value of, and that become an axis."""

    def dims(self, name: str, roots: Sequence[xr.Dataset]) -> tuple[str, ...]:
        """What a variable lies along: the most that it does anywhere, and the axes that are added."""
        own = max((tuple(map(str, root[name].dims)) for root in roots if name in root.variables), key=len)
        if (
            not own and name not in self.added and len(_values(name, roots)) > 1
        ):  # of all cases of a dataset, but not of all
            return self.dims("case_id", roots)
        return (*(each for each in self.added if each not in own), *own)

    def place(self, root: xr.Dataset, dims: Iterable[str]) -> Any:
        """Index of the cases of one of the datasets in an array over these dimensions."""
        each = [[self.labels[dim].index(label) for label in _labels(root, dim)] for dim in dims]
        return np.ix_(*each) if each else ...

    def shape(self, dims: Iterable[str]) -> tuple[int, ...]:
        """Sizes of these dimensions."""
        return tuple(len(self.labels[dim]) for dim in dims)


def axes_of(roots: Sequence[xr.Dataset], sources: Sequence[str]) -> Axes:
    """The axes by which the cases of all datasets are distinct: their dimensions, and as few further parameters as possible."""
    dims = list(dict.fromkeys(str(dim) for root in roots for dim in root.dims))
    candidates = [name for name in parameters() if name not in dims and _differs(name, roots)]
    for count in range(len(candidates) + 1):
        added = tuple(candidates[:count])
        axes = Axes({name: _union(name, roots) for name in (*added, *dims)}, added)
        with suppress(NotJoinableError):  # two cases in one place
            placed("case_id", axes, roots, sources)
            break
    return axes


def placed(
    name: str, axes: Axes, roots: Sequence[xr.Dataset], sources: Sequence[str], holes: bool = True
) -> xr.Variable:
    """One variable of all datasets. Raises NotJoinableError where two say different things of one place, or none does.

    holes: whether numbers of places that no dataset has may be missing, as parameters may.
    """
    dims = axes.dims(name, roots)
    having = [(root, source) for root, source in zip(roots, sources, strict=True) if name in root.variables]
    kind = np.result_type(*(root[name].dtype for root, _ in having))
    values: NDArray[Any] = np.empty(axes.shape(dims), kind)
    held = np.zeros(values.shape, np.bool_)
    for root, source in having:
        place = axes.place(root, dims)
        block = _block(root[name], dims)
        before = held[place]
        mine = np.broadcast_to(block, before.shape)[before]
        if not np.array_equal(values[place][before], mine, equal_nan=kind.kind == "f"):
            raise NotJoinableError(f"{source}: says something else of {name} than {sources[0]} does of the same cases")
        values[place] = block
        held[place] = True
    if not held.all():
        if not holes and name not in roots[0].coords:
            along = " x ".join(f"{dim} ({len(axes.labels[dim])})" for dim in dims)
            raise NotJoinableError(
                f"{', '.join(sources)}: {name} is known at {int(held.sum())} of {held.size} places of {along}: "
                'needs cases that make up a full product, lists of cases (design = "zip" or a table), or join="outer"'
            )
        values = np.where(held, values, _missing(name, kind))
    return xr.Variable(dims, values, having[0][0][name].attrs)


def _missing(name: str, kind: np.dtype[Any]) -> Any:
    """What stands for a value that is not there, as in the dataset of a campaign of which something is not computed."""
    if kind.kind == "O":
        return PENDING if name in {ending.name for ending, _ in OUTCOMES.values()} else ""
    return kind.type(0) if name == VALIDITY.name else np.nan


def _labels(root: xr.Dataset, dim: str) -> list[Any]:
    found: list[Any] = np.atleast_1d(root[dim].values).tolist()
    return found


def _union(name: str, roots: Sequence[xr.Dataset]) -> list[Any]:
    """All labels of a dimension, in their order where each dataset has them in order."""
    each = [_labels(root, name) for root in roots]
    found = list(dict.fromkeys(label for labels in each for label in labels))
    return sorted(found) if all(labels == sorted(labels) for labels in each) else found


def _differs(name: str, roots: Sequence[xr.Dataset]) -> bool:
    """Whether each dataset has one value of a parameter, not all the same."""
    return all(name in root.coords and not root[name].dims for root in roots) and len(_values(name, roots)) > 1


def _values(name: str, roots: Sequence[xr.Dataset]) -> set[Any]:
    """The different values of a variable that each dataset has one of; None stands for none."""
    return {root[name].item() if name in root.variables else None for root in roots}


def _block(values: xr.DataArray, dims: tuple[str, ...]) -> NDArray[Any]:
    """The values of one dataset with all dimensions in this order; those that it lacks have one place."""
    own = values.transpose(*(dim for dim in dims if dim in values.dims)).values
    return np.asarray(own).reshape([values.sizes.get(dim, 1) for dim in dims])


_TITLE: Final = "title"
_CASE: Final = "case"
"""The dimension of a list of cases."""


def joined(roots: Sequence[xr.Dataset], sources: Sequence[str], holes: bool = False) -> xr.Dataset:
    """One dataset, in memory, of all cases, records, trajectories and whatever else the datasets have.

    sources: what messages call them. holes: whether cases that no dataset has may be missing, as pending.

    Raises NotJoinableError, LostGroupsError.
    """
    _refuse_strangers(roots, sources)
    roots = _numbered(roots)
    axes = axes_of(roots, sources)
    names = list(dict.fromkeys(str(name) for root in roots for name in root.variables if name not in axes.labels))
    found = {name: placed(name, axes, roots, sources, holes) for name in names}
    found |= {name: xr.Variable(name, np.asarray(values), roots[0][name].attrs) for name, values in axes.labels.items()}
    coordinates = dict.fromkeys(str(name) for root in roots for name in root.coords)
    root = xr.Dataset(found, attrs=_attributes(roots)).set_coords([*axes.labels, *coordinates])
    groups = {name: _group(roots, group) for name, group in all_groups().items() if name in groups_of(roots[0])}
    software = SOFTWARE[0].name
    return carrying(root, groups | {software: _software([groups_of(each)[software] for each in roots])})


def _refuse_strangers(roots: Sequence[xr.Dataset], sources: Sequence[str]) -> None:
    """Raise NotJoinableError unless all have the same variables and groups."""
    if not roots:
        raise NotJoinableError("no datasets: needs at least one")
    first = roots[0]
    for root, source in zip(roots, sources, strict=True):
        if "case_id" not in root.coords or FORMAT not in root.attrs:
            raise NotJoinableError(f"{source}: no dataset: needs what nanoslip.open or nanoslip.run returned")
        for mine, theirs in ((root.data_vars, first.data_vars), (groups_of(root), groups_of(first))):
            if odd := sorted(map(str, mine.keys() ^ theirs.keys())):
                said = f"{', '.join(odd[:4])}: {'there alone' if odd[0] in mine else f'only in {sources[0]}'}"
                raise NotJoinableError(f"{source}: {said}: needs the same stages and outputs in all campaigns")
        if (_CASE in root.dims) != (_CASE in first.dims):
            raise NotJoinableError(f"{source}: a list of cases beside a product of axes: needs all of one design")


def _numbered(roots: Sequence[xr.Dataset]) -> list[xr.Dataset]:
    """The datasets with lists of cases numbered on."""
    first, found = 0, []
    for root in roots:
        count = root.sizes.get(_CASE, 0)
        numbers = {_CASE: (_CASE, np.arange(first, first + count), root[_CASE].attrs)} if count else {}
        found.append(root.assign_coords(numbers))
        first += count
    return found


def _attributes(roots: Sequence[xr.Dataset]) -> dict[str, Any]:
    """What all say alike; and all titles."""
    kept = {
        name: value for name, value in roots[0].attrs.items() if all(root.attrs.get(name) == value for root in roots)
    }
    return {**kept, _TITLE: "; ".join(dict.fromkeys(str(root.attrs[_TITLE]) for root in roots))}


def _group(roots: Sequence[xr.Dataset], group: Group) -> xr.Dataset:
    """The runs of one group of all datasets, one behind the other; what several have is there once."""
    known: set[str] = set()
    parts = []
    for root in roots:
        found = groups_of(root)[group.name]
        names = found[group.name].values.tolist()
        kept = [number for number, name in enumerate(names) if name not in known]
        known.update(names)
        within = {
            sample: np.concatenate([np.arange(0), *(np.arange(*first[at : at + 2]) for at in kept)])
            for sample, first in windows(found, group).items()
        }
        parts.append(found.isel({group.name: kept, **within}))
    return _behind(parts)


def _software(parts: Sequence[xr.Dataset]) -> xr.Dataset:
    """All software, each once, with how many results stem from it."""
    name, count = (quantity.name for quantity in SOFTWARE[:2])
    whole = _behind(parts)
    names, first, number = np.unique(whole[name].values.astype(str), return_index=True, return_inverse=True)
    found = whole.isel({name: first})
    found[count] = found[count].copy(data=np.bincount(number, whole[count].values, len(names)).astype(np.int64))
    return found


def _behind(parts: Sequence[xr.Dataset]) -> xr.Dataset:
    """Datasets whose variables lie along one dimension each, one behind the other along all of them."""
    found = {
        name: xr.Variable(each.dims, np.concatenate([part[name].values for part in parts]), each.attrs)
        for name, each in parts[0].variables.items()
    }
    return xr.Dataset(found).set_coords(list(parts[0].coords))
