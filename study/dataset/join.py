"""Join several datasets into one: scalars over the union of their axes, groups one behind the other."""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields
from typing import Any, Final

import numpy as np
import xarray as xr

from nanoslip.solver.drive import Scales
from nanoslip.solver.outcome import NanoslipError
from nanoslip.study.dataset.file import FORMAT, carrying, groups_of, with_texts
from nanoslip.study.dataset.table import CASE, nearest
from nanoslip.study.dataset.variables import (
    DRIVE_MEMBERS,
    MEMBERS,
    OUTCOMES,
    SOFTWARE,
    Group,
    all_groups,
    parameters,
    run_names,
    windows,
)
from nanoslip.study.plan.task import PENDING


class NotJoinableError(NanoslipError, ValueError):
    """Datasets that cannot be joined; the message names the difference."""


def added_axes(dims: Sequence[str], roots: Sequence[xr.Dataset], sources: Sequence[str]) -> list[str]:
    """Parameters with one value in each dataset, as few as distinguish the cases of all datasets beside their dimensions."""
    single = [name for name in parameters() if all(name in root.coords and not root[name].dims for root in roots)]
    candidates = [name for name in single if name not in dims and len(_values(name, roots)) > 1]
    for count in range(len(candidates)):
        with suppress(NotJoinableError):  # two cases in one place
            _merged(["case_id"], candidates[:count], dims, roots, sources)
            return candidates[:count]
    return candidates


def _merged(
    names: Iterable[str], added: Sequence[str], dims: Sequence[str], roots: Sequence[xr.Dataset], sources: Sequence[str]
) -> xr.Dataset:
    """Variables of all datasets; NaN where no dataset has a place. Raises NotJoinableError if two differ at one place."""
    along = {name: _along(name, added, roots) for name in names}
    found = xr.Dataset()
    for root, source in zip(roots, sources, strict=True):
        there = [dim for dim in (*added, *dims) if dim in root.variables]
        labels = {dim: xr.Variable(dim, np.atleast_1d(root[dim].values), root[dim].attrs) for dim in there}
        variables = {
            name: root[name].variable.set_dims({dim: labels[dim].size for dim in own})  # type: ignore[no-untyped-call]
            for name, own in along.items()
            if name in root.variables
        }
        one = xr.Dataset(variables, labels)
        try:
            found = xr.merge([found, one], compat="no_conflicts", join="outer", combine_attrs="override")
        except xr.MergeError:
            odd = next(name for name in variables if _conflicts(found, one, name))
            same = "the same [ensemble] in all campaigns" if odd in _MEMBERS else "these cases in one of them alone"
            said = f"{source}: {odd} differs from that of {sources[0]} in the same cases: needs {same}"
            raise NotJoinableError(said) from None
    return found.sel({dim: _union(dim, roots) for dim in (*added, *dims)})


def _conflicts(one: xr.Dataset, other: xr.Dataset, name: str) -> bool:
    """True if two datasets have different values of a variable in the same cases."""
    if name not in one:
        return False
    here, there = xr.align(one[name], other[name], join="inner", copy=False)
    return not bool((here.isnull() | there.isnull() | (here == there)).all())


def _along(name: str, added: Sequence[str], roots: Sequence[xr.Dataset]) -> tuple[str, ...]:
    """Dimensions of a variable: all that it has in any dataset, and the axes that are added.

    One value in each dataset stays one if it is the same in all; else it lies along the cases.
    """
    each = [tuple(map(str, root[name].dims)) for root in roots if name in root.variables]
    own = tuple(dict.fromkeys(dim for dims in sorted(each, key=len, reverse=True) for dim in dims))
    if not own and name != "case_id":
        return _along("case_id", added, roots) if len(_values(name, roots)) > 1 else ()
    return (*(each for each in added if each not in own), *own)


def _filled(name: str, values: xr.DataArray, kind: np.dtype[Any]) -> xr.DataArray:
    """A merged variable in its type, with fill values for missing ones, as if not computed."""
    if kind.kind == "O":
        return values.fillna(PENDING if name in {ending.name for ending, *_ in OUTCOMES.values()} else "")
    if kind == np.int32:
        values = values.fillna(0)
    return values if bool(values.isnull().any()) else values.astype(kind)


def _union(name: str, roots: Sequence[xr.Dataset]) -> list[Any]:
    """All labels of a dimension, in their order where each dataset has them in order."""
    each: list[list[Any]] = [np.atleast_1d(root[name].values).tolist() for root in roots if name in root.variables]
    found = list(dict.fromkeys(label for labels in each for label in labels))
    return sorted(found) if all(labels == sorted(labels) for labels in each) else found


def _values(name: str, roots: Sequence[xr.Dataset]) -> set[Any]:
    """Distinct values of a variable that each dataset has one value of; None for a missing one."""
    return {root[name].item() if name in root.variables else None for root in roots}


_MEMBERS: Final = (MEMBERS.name, DRIVE_MEMBERS.name)
_TITLE: Final = "title"
SOURCES: Final = "sources"
"""Attribute that lists the campaigns of a joined dataset."""


def joined(
    roots: Sequence[xr.Dataset], sources: Sequence[str], holes: bool = False, scalars: bool = False
) -> xr.Dataset:
    """One dataset, in memory, of all that the datasets have. Raises NotJoinableError, LostGroupsError.

    sources: names in messages. holes: whether cases of no dataset may be missing, as pending. scalars: those alone, with holes
        all of them, else those that all have.
    """
    roots = [with_texts(root) for root in roots]
    _refuse_strangers(roots, sources, scalars)
    roots = _with_equal_labels(_numbered(_scalars(roots, holes) if scalars else roots))
    dims = list(dict.fromkeys(str(dim) for root in roots for dim in root.dims))
    added = added_axes(dims, roots, sources)
    names = list(dict.fromkeys(str(name) for root in roots for name in root.variables if name not in (*added, *dims)))
    found = _merged(names, added, dims, roots, sources)
    if not holes and (missing := int(found["case_id"].isnull().sum())):
        along = " x ".join(f"{dim} ({size})" for dim, size in found["case_id"].sizes.items())
        raise NotJoinableError(
            f"{', '.join(sources)}: {found['case_id'].size - missing} of {found['case_id'].size} cases of {along} are there: "
            'needs cases that make up a full product, lists of cases (design = "zip" or a table), or join="outer"'
        )
    kinds = {name: np.result_type(*(root[name].dtype for root in roots if name in root.variables)) for name in names}
    found = found.assign({name: _filled(name, found[name], kind) for name, kind in kinds.items()})
    root = found.assign_attrs(_attributes(roots)).set_coords({name for root in roots for name in root.coords})
    groups = {name: _group(roots, group) for name, group in all_groups().items() if name in groups_of(roots[0])}
    software = SOFTWARE[0].name
    return carrying(root, groups | {software: _software([groups_of(each)[software] for each in roots])})


def _scalars(roots: Sequence[xr.Dataset], unshared: bool) -> list[xr.Dataset]:
    """The datasets without groups but the software, with the scalars that all of them have, or also with unshared ones."""
    names = [{*map(str, root.data_vars)} - run_names() for root in roots]
    known = set.union(*names) if unshared else set.intersection(*names)
    kept = [[str(name) for name in root.data_vars if name in known] for root in roots]
    software = SOFTWARE[0].name
    return [
        carrying(root[names].copy(), {software: groups_of(root)[software]})
        for root, names in zip(roots, kept, strict=True)
    ]


def _refuse_strangers(roots: Sequence[xr.Dataset], sources: Sequence[str], scalars: bool) -> None:
    """Raise NotJoinableError unless all have the same scales, and the same variables and groups if these are joined."""
    if not roots:
        raise NotJoinableError("no datasets: needs at least one")
    first = roots[0]
    for root, source in zip(roots, sources, strict=True):
        if "case_id" not in root.coords or FORMAT not in root.attrs:
            raise NotJoinableError(f"{source}: no dataset: needs what nanoslip.open or nanoslip.run returned")
        for name in (each.name for each in fields(Scales)):
            if root.attrs.get(name) != first.attrs.get(name):
                said = f"{source}: {name} = {root.attrs.get(name)}: needs that of {sources[0]}, {first.attrs.get(name)}"
                raise NotJoinableError(
                    f"{said}: the same [scales] in all campaigns, given or by default; or join the tables of nanoslip export"
                )
        held = () if scalars else ((root.data_vars, first.data_vars), (groups_of(root), groups_of(first)))
        for mine, theirs in held:
            if odd := sorted(map(str, mine.keys() ^ theirs.keys())):
                said = f"{', '.join(odd[:4])}: {'there alone' if odd[0] in mine else f'only in {sources[0]}'}"
                raise NotJoinableError(
                    f"{source}: {said}: needs the same stages, outputs and [ensemble] in all, or scalars=True and join='outer'"
                )
        if (CASE in root.dims) != (CASE in first.dims):
            raise NotJoinableError(f"{source}: a list of cases beside a product of axes: needs all of one design")


def _numbered(roots: Sequence[xr.Dataset]) -> list[xr.Dataset]:
    """The datasets with lists of cases numbered on."""
    first, found = 0, []
    for root in roots:
        count = root.sizes.get(CASE, 0)
        numbers = {CASE: (CASE, np.arange(first, first + count), root[CASE].attrs)} if count else {}
        found.append(root.assign_coords(numbers))
        first += count
    return found


def _with_equal_labels(roots: Sequence[xr.Dataset]) -> list[xr.Dataset]:
    """The datasets with numbers of coordinates that differ in rounding alone made those of the first that has them."""
    known: dict[str, np.ndarray[Any, Any]] = {}
    found = []
    for root in roots:
        numbers = {str(name): each for name, each in root.coords.items() if each.dtype.kind == "f"}
        equal = {
            name: each.copy(data=_equal(known.get(name, each.values), each.values)) for name, each in numbers.items()
        }
        for name, each in equal.items():
            known[name] = np.union1d(known.get(name, each.values), each.values)
        found.append(root.assign_coords(equal))
    return found


def _equal(known: np.ndarray[Any, Any], own: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """A dataset's own numbers, known ones in place of those that are nearly these and no others; different ones stay so."""
    near = nearest(known, own)
    return np.where(nearest(own, near) == own, near, own)


def _attributes(roots: Sequence[xr.Dataset]) -> dict[str, Any]:
    """Attributes that all share, all titles, and the sources: title and checksum of each campaign."""
    first, *others = roots
    kept = {name: value for name, value in first.attrs.items() if all(root.attrs.get(name) == value for root in others)}
    sources = (root.attrs.get(SOURCES, _source(root.attrs)) for root in roots)
    named = list(dict.fromkeys(each for source in sources for each in np.atleast_1d(source).tolist()))
    return {**kept, _TITLE: "; ".join(dict.fromkeys(str(root.attrs[_TITLE]) for root in roots)), SOURCES: named}


def _source(attributes: Mapping[Any, Any]) -> str:
    return f"{attributes[_TITLE]}, manifest sha256 {attributes.get('manifest_sha256', 'lost')}"


def _group(roots: Sequence[xr.Dataset], group: Group) -> xr.Dataset:
    """The runs of one group of all datasets in sequence, shared ones once."""
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
    """Concatenate datasets whose variables lie along one dimension each, along all of these dimensions."""
    found = {
        name: xr.Variable(each.dims, np.concatenate([part[name].values for part in parts]), each.attrs)
        for name, each in parts[0].variables.items()
    }
    return xr.Dataset(found).set_coords(list(parts[0].coords))
