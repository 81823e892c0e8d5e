"""Several datasets as one: scalars side by side, groups one behind the other."""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.study.dataset.access.placement import NotJoinableError, axes_of, placed
from nanoslip.study.dataset.collection.ragged import windows
from nanoslip.study.dataset.file import FORMAT
from nanoslip.study.dataset.groups import carrying, groups_of
from nanoslip.study.dataset.variables import SOFTWARE, Group, all_groups

_TITLE: Final = "title"
_CASE: Final = "case"
"""The dimension of a list of cases."""


def joined(roots: Sequence[xr.Dataset], sources: Sequence[str]) -> xr.Dataset:
    """One dataset, in memory, of all cases, records, trajectories and whatever else the datasets have.

    sources: what messages call them. Raises NotJoinableError, LostGroupsError.
    """
    _refuse_strangers(roots, sources)
    roots = _numbered(roots)
    axes = axes_of(roots)
    names = list(dict.fromkeys(str(name) for root in roots for name in root.variables if name not in axes.labels))
    found = {name: placed(name, axes, roots, sources) for name in names}
    coordinates = {str(name) for root in roots for name in root.coords}
    labels = {name: xr.Variable(name, np.asarray(values), roots[0][name].attrs) for name, values in axes.labels.items()}
    root = xr.Dataset(
        {name: each for name, each in found.items() if name not in coordinates},
        labels | {name: each for name, each in found.items() if name in coordinates},
        _attributes(roots),
    )
    groups = {name: _group(roots, group) for name, group in all_groups().items() if name in groups_of(roots[0])}
    software = SOFTWARE[0].name
    return carrying(root, groups | {software: _software([groups_of(each)[software] for each in roots])})


def _refuse_strangers(roots: Sequence[xr.Dataset], sources: Sequence[str]) -> None:
    """Raise NotJoinableError unless all are of one format, and have the same variables and groups."""
    if not roots:
        raise NotJoinableError("no datasets: needs at least one")
    for root, source in zip(roots, sources, strict=True):
        if "case_id" not in root.coords or FORMAT not in root.attrs:
            raise NotJoinableError(f"{source}: no dataset: needs what nanoslip.open or nanoslip.run returned")
        if root.attrs[FORMAT] != roots[0].attrs[FORMAT]:
            form, first = root.attrs[FORMAT], roots[0].attrs[FORMAT]
            raise NotJoinableError(
                f"{source}: has format {form}, {sources[0]} format {first}: needs one, as ± means something else"
            )
        for mine, theirs in (
            (set(root.data_vars), set(roots[0].data_vars)),
            (set(groups_of(root)), set(groups_of(roots[0]))),
        ):
            if odd := sorted(map(str, mine ^ theirs)):
                where = "there alone" if odd[0] in mine else f"only in {sources[0]}"
                raise NotJoinableError(
                    f"{source}: {', '.join(odd[:4])}: {where}: needs the same stages and outputs in all campaigns"
                )
        if (_CASE in root.dims) != (_CASE in roots[0].dims):
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
            sample: _joined([np.arange(first[number], first[number + 1]) for number in kept])
            for sample, (_, first) in windows(found, group).items()
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
    return xr.Dataset(
        {name: found[name] for name in parts[0].data_vars}, {name: found[name] for name in parts[0].coords}
    )


def _joined(parts: list[NDArray[np.int64]]) -> NDArray[np.int64]:
    return np.concatenate(parts) if parts else np.empty(0, np.int64)
