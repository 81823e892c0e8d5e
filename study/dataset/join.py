"""Join several datasets into one: scalars over the union of their axes, groups one behind the other."""

from collections.abc import Hashable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields
from itertools import chain
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.drive import Scales
from nanoslip.solver.outcome import NanoslipError
from nanoslip.study.dataset.file import FORMAT, carrying, read_groups, with_texts
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
from nanoslip.study.tasks.task import PENDING


class NotJoinableError(NanoslipError, ValueError):
    """Datasets that cannot be joined; the message names the difference."""


def distinguishing_axes(dims: Sequence[str], roots: Sequence[xr.Dataset], sources: Sequence[str]) -> list[str]:
    """Parameters with one value in each dataset, as few as distinguish the cases of all datasets beside their dimensions."""
    common = [name for name in parameters() if name not in dims and _has_one_value(name, roots)]
    candidates = [name for name in common if len(_values(name, roots)) > 1]
    # From none on: each axis multiplies the places of the joined dataset, of which most would be empty.
    for count in range(len(candidates)):
        # Two cases in one place cannot be joined: the parameter that tells them apart has to become an axis.
        with suppress(NotJoinableError):
            _merge_datasets(["case_id"], candidates[:count], dims, roots, sources)
            return candidates[:count]
    return candidates


def _has_one_value(name: str, roots: Sequence[xr.Dataset]) -> bool:
    """True if each dataset has one value of a parameter for all its cases."""
    return all(name in root.coords and not root[name].dims for root in roots)


def _merge_datasets(
    names: Iterable[str], added: Sequence[str], dims: Sequence[str], roots: Sequence[xr.Dataset], sources: Sequence[str]
) -> xr.Dataset:
    """Variables of all datasets; NaN where no dataset has a place. Raises NotJoinableError if two differ at one place."""
    axes = (*added, *dims)
    dims_by_name = {name: _joint_dims(name, added, roots) for name in names}
    merged = xr.Dataset()
    for root, source in zip(roots, sources, strict=True):
        part = _with_axes(root, axes, dims_by_name)
        # One after the other, so that a conflict can be said of the dataset that brings it.
        try:
            merged = xr.merge([merged, part], compat="no_conflicts", join="outer", combine_attrs="override")
        except xr.MergeError:
            raise _conflict_error(merged, part, source, sources[0]) from None
    # An outer join sorts its labels: those of a campaign that is not in ascending order get their own order back.
    return merged.sel({dim: _union(dim, roots) for dim in axes})


def _with_axes(root: xr.Dataset, axes: Sequence[str], dims_by_name: Mapping[str, Sequence[str]]) -> xr.Dataset:
    """Variables of a dataset along their joint dimensions; each added axis has a single label."""
    labels = {}
    for dim in axes:
        if dim in root.variables:
            values = np.atleast_1d(root[dim].values)
            labels[dim] = xr.Variable(dim, values, root[dim].attrs)
    variables = {}
    for name, dims in dims_by_name.items():
        if name in root.variables:
            shape = {dim: labels[dim].size for dim in dims}
            variables[name] = root[name].variable.set_dims(shape)  # type: ignore[no-untyped-call]
    return xr.Dataset(variables, labels)


def _conflict_error(merged: xr.Dataset, part: xr.Dataset, source: str, first: str) -> NotJoinableError:
    """Error that names the variable in which a dataset differs from those merged before it."""
    names = map(str, part.data_vars)
    name = next(name for name in names if _has_conflict(merged, part, name))
    cure = "these cases in one of them alone"
    if name in _MEMBERS:
        cure = "the same [ensemble] in all campaigns"
    return NotJoinableError(f"{source}: {name} differs from that of {first} in the same cases: needs {cure}")


def _has_conflict(one: xr.Dataset, other: xr.Dataset, name: str) -> bool:
    """True if two datasets have different values of a variable in the same cases."""
    if name not in one:
        return False
    mine, its = xr.align(one[name], other[name], join="inner", copy=False)
    # A number that one of them lacks is filled from the other.
    agrees = mine.isnull() | its.isnull() | (mine == its)
    return not bool(agrees.all())


def _joint_dims(name: str, added: Sequence[str], roots: Sequence[xr.Dataset]) -> tuple[str, ...]:
    """Dimensions of a variable: all that it has in any dataset, and the axes that are added.

    One value in each dataset stays one if it is the same in all; else it lies along the cases.
    """
    holders = [root for root in roots if name in root.variables]
    variants = [tuple(map(str, root[name].dims)) for root in holders]
    # Longest first, as the order of dimensions is that of their first appearance.
    variants.sort(key=len, reverse=True)
    dims = tuple(dict.fromkeys(chain.from_iterable(variants)))
    if dims or name == "case_id":
        return (*(axis for axis in added if axis not in dims), *dims)
    if len(_values(name, roots)) > 1:
        return _joint_dims("case_id", added, roots)
    return ()


def _fill_missing(name: str, values: xr.DataArray, kind: np.dtype[Any]) -> xr.DataArray:
    """Merged variable in its type; cases that no dataset has are filled as if they were not computed."""
    if kind.kind == "O":
        is_outcome = name in {ending.name for ending, *_ in OUTCOMES.values()}
        return values.fillna(PENDING if is_outcome else "")
    # Counts: of a case that no dataset has, none.
    if kind == np.int32:
        values = values.fillna(0)
    # A merge makes floats of whole numbers, for the sake of NaN: they become what they were where none is missing.
    if bool(values.isnull().any()):
        return values
    return values.astype(kind)


def _union(name: str, roots: Sequence[xr.Dataset]) -> list[Any]:
    """All labels of a dimension, in ascending order if each dataset has them so."""
    holders = [root for root in roots if name in root.variables]
    arrays = [np.atleast_1d(root[name].values) for root in holders]
    columns: list[list[Any]] = [array.tolist() for array in arrays]
    labels = list(dict.fromkeys(chain.from_iterable(columns)))
    if all(column == sorted(column) for column in columns):
        return sorted(labels)
    return labels


def _values(name: str, roots: Sequence[xr.Dataset]) -> set[Any]:
    """Distinct values of a variable that each dataset has one value of; None for a missing value."""
    return {root[name].item() if name in root.variables else None for root in roots}


_MEMBERS: Final = (MEMBERS.name, DRIVE_MEMBERS.name)
_TITLE: Final = "title"
SOURCES: Final = "sources"
"""Attribute that lists the campaigns of a joined dataset."""


def join_datasets(
    roots: Sequence[xr.Dataset], sources: Sequence[str], holes: bool = False, scalars: bool = False
) -> xr.Dataset:
    """Join datasets into one, in memory. Raises NotJoinableError, LostGroupsError.

    sources: names in messages. holes: allow a product with missing cases, which are pending. scalars: join scalars
        alone: with holes the scalars of any dataset, else the scalars in all datasets.
    """
    roots = [with_texts(root) for root in roots]
    _refuse_strangers(roots, sources, scalars)
    if scalars:
        roots = _select_scalars(roots, unshared=holes)
    # Lists are numbered on before labels are compared: number 0 of two lists is not the same case.
    roots = _with_equal_labels(_number_cases(roots))
    dims = _distinct_names(root.dims for root in roots)
    added = distinguishing_axes(dims, roots, sources)
    shared_names = _distinct_names(root.variables for root in roots)
    names = [name for name in shared_names if name not in (*added, *dims)]
    merged = _merge_datasets(names, added, dims, roots, sources)
    if not holes:
        _refuse_holes(merged["case_id"], sources)
    filled = {}
    for name in names:
        kinds = [root[name].dtype for root in roots if name in root.variables]
        kind = np.result_type(*kinds)
        filled[name] = _fill_missing(name, merged[name], kind).variable
    # All in one step: one by one, each would be aligned with all others.
    merged = merged.assign(filled).assign_attrs(_joint_attributes(roots))
    merged = merged.set_coords(_distinct_names(root.coords for root in roots))
    return carrying(merged, _join_groups(roots))


def _distinct_names(names: Iterable[Iterable[Hashable]]) -> list[str]:
    """Names of several datasets, each once, in the order in which they first appear."""
    return list(dict.fromkeys(map(str, chain.from_iterable(names))))


def _refuse_holes(cases: xr.DataArray, sources: Sequence[str]) -> None:
    """Raise NotJoinableError if cases of the product of all axes are missing."""
    missing = int(cases.isnull().sum())
    if not missing:
        return
    product = " x ".join(f"{dim} ({size})" for dim, size in cases.sizes.items())
    raise NotJoinableError(
        f"{', '.join(sources)}: {cases.size - missing} of {cases.size} cases of {product} are there: "
        'needs cases that make up a full product, lists of cases (design = "zip" or a table), or join="outer"'
    )


def _select_scalars(roots: Sequence[xr.Dataset], unshared: bool) -> list[xr.Dataset]:
    """The datasets without groups but the software, with the scalars in all of them, or with all scalars."""
    scalars = [{*map(str, root.data_vars)} - run_names() for root in roots]
    selection = set.union(*scalars) if unshared else set.intersection(*scalars)
    software = SOFTWARE[0].name
    selected = []
    for root in roots:
        names = [str(name) for name in root.data_vars if name in selection]
        groups = {software: read_groups(root)[software]}
        # A copy: a selection shares its variables with the original, in whose encoding groups are
        # noted, too.
        selected.append(carrying(root[names].copy(), groups))
    return selected


def _refuse_strangers(roots: Sequence[xr.Dataset], sources: Sequence[str], scalars: bool) -> None:
    """Raise NotJoinableError unless all have the same scales, and the same variables and groups if these are joined."""
    if not roots:
        raise NotJoinableError("no datasets: needs at least one")
    for root, source in zip(roots, sources, strict=True):
        if "case_id" not in root.coords or FORMAT not in root.attrs:
            raise NotJoinableError(f"{source}: no dataset: needs what nanoslip.open or nanoslip.run returned")
    first = roots[0]
    for root, source in zip(roots, sources, strict=True):
        _refuse_scales(root, first, source, sources[0])
        if not scalars:
            _refuse_names(root.data_vars, first.data_vars, source, sources[0])
            _refuse_names(read_groups(root), read_groups(first), source, sources[0])
        if (CASE in root.dims) != (CASE in first.dims):
            raise NotJoinableError(f"{source}: a list of cases beside a product of axes: needs all of one design")


def _refuse_scales(root: xr.Dataset, first: xr.Dataset, source: str, first_source: str) -> None:
    """Raise NotJoinableError if a dataset has other scales than the first one."""
    for scale in fields(Scales):
        value = root.attrs.get(scale.name)
        needed = first.attrs.get(scale.name)
        if value != needed:
            raise NotJoinableError(
                f"{source}: {scale.name} = {value}: needs that of {first_source}, {needed}: "
                "the same [scales] in all campaigns, given or by default; or join the tables of nanoslip export"
            )


def _refuse_names(names: Mapping[Any, Any], needed: Mapping[Any, Any], source: str, first_source: str) -> None:
    """Raise NotJoinableError if a dataset has other variables, or groups, than the first one."""
    unshared = sorted(map(str, names.keys() ^ needed.keys()))
    if not unshared:
        return
    where = "there alone" if unshared[0] in names else f"only in {first_source}"
    raise NotJoinableError(
        f"{source}: {', '.join(unshared[:4])}: {where}: "
        "needs the same stages, outputs and [ensemble] in all, or scalars=True and join='outer'"
    )


def _number_cases(roots: Sequence[xr.Dataset]) -> list[xr.Dataset]:
    """The datasets; case numbers of each list continue the numbers of the list before."""
    first = 0
    numbered = []
    for root in roots:
        count = root.sizes.get(CASE, 0)
        numbers = {}
        if count:
            continued = np.arange(first, first + count)
            numbers[CASE] = (CASE, continued, root[CASE].attrs)
        numbered.append(root.assign_coords(numbers))
        first += count
    return numbered


def _with_equal_labels(roots: Sequence[xr.Dataset]) -> list[xr.Dataset]:
    """The datasets with equal labels: coordinates that differ only by rounding get the value from the first dataset
    that has it."""
    labels: dict[str, NDArray[Any]] = {}
    relabelled = []
    for root in roots:
        equal = {}
        for name, coordinate in root.coords.items():
            if coordinate.dtype.kind == "f":
                earlier = labels.get(str(name), coordinate.values)
                replaced = _replace_within_rounding(coordinate.values, earlier)
                # A coordinate that stays as it is need not be aligned anew.
                if not np.array_equal(replaced, coordinate.values, equal_nan=True):
                    equal[name] = coordinate.copy(data=replaced)
                labels[str(name)] = np.union1d(earlier, replaced)
        relabelled.append(root.assign_coords(equal))
    return relabelled


def _replace_within_rounding(later: NDArray[Any], earlier: NDArray[Any]) -> NDArray[Any]:
    """A dataset's numbers, each with one known number within rounding replaced by it; different numbers stay different."""
    near = nearest(earlier, later)
    # Two of its own numbers may be near one known number: they keep their difference.
    is_only_one = nearest(later, near) == later
    return np.where(is_only_one, near, later)


def _joint_attributes(roots: Sequence[xr.Dataset]) -> dict[str, Any]:
    """Attributes that all share, all titles, and the sources: title and checksum of each campaign."""
    first, *others = roots
    shared = {}
    for name, value in first.attrs.items():
        if all(root.attrs.get(name) == value for root in others):
            shared[name] = value
    titles = dict.fromkeys(str(root.attrs[_TITLE]) for root in roots)
    sources: list[str] = []
    for root in roots:
        # A joined dataset has several sources already.
        own_sources = root.attrs.get(SOURCES, _source_text(root.attrs))
        sources += np.atleast_1d(own_sources).tolist()
    distinct = list(dict.fromkeys(sources))
    return {**shared, _TITLE: "; ".join(titles), SOURCES: distinct}


def _source_text(attributes: Mapping[Any, Any]) -> str:
    return f"{attributes[_TITLE]}, manifest sha256 {attributes.get('manifest_sha256', 'lost')}"


def _join_groups(roots: Sequence[xr.Dataset]) -> dict[str, xr.Dataset]:
    """Join the groups that the first dataset has, as all others have them too."""
    shared = read_groups(roots[0])
    groups = {}
    for name, group in all_groups().items():
        if name in shared:
            groups[name] = _join_group(roots, group)
    software = SOFTWARE[0].name
    parts = [read_groups(root)[software] for root in roots]
    return {**groups, software: _join_software(parts)}


def _join_group(roots: Sequence[xr.Dataset], group: Group) -> xr.Dataset:
    """A group's runs of all datasets in sequence; shared runs once."""
    seen: set[str] = set()
    parts = []
    for root in roots:
        runs = read_groups(root)[group.name]
        names = runs[group.name].values.tolist()
        # A name is a hash of a run's inputs: two datasets with the same name have the same run.
        new = [number for number, name in enumerate(names) if name not in seen]
        seen.update(names)
        places: dict[str, Any] = {group.name: new}
        for sample, starts in windows(runs, group).items():
            samples = [np.arange(starts[run], starts[run + 1]) for run in new]
            # An empty array first: numpy does not concatenate none.
            places[sample] = np.concatenate([np.arange(0), *samples])
        parts.append(runs.isel(places))
    return _concatenate(parts)


def _join_software(parts: Sequence[xr.Dataset]) -> xr.Dataset:
    """All software, each once, with how many results stem from it."""
    name, count = (quantity.name for quantity in SOFTWARE[:2])
    joined = _concatenate(parts)
    names, first, number = np.unique(joined[name].values.astype(str), return_index=True, return_inverse=True)
    # Counts of one software are added up over the datasets.
    sums = np.bincount(number, joined[count].values, len(names))
    results = sums.astype(np.int64)
    distinct = joined.isel({name: first})
    distinct[count] = distinct[count].copy(data=results)
    return distinct


def _concatenate(parts: Sequence[xr.Dataset]) -> xr.Dataset:
    """Concatenate datasets whose variables lie along one dimension each, along all of these dimensions."""
    joint = {}
    for name, variable in parts[0].variables.items():
        values = np.concatenate([part[name].values for part in parts])
        joint[name] = xr.Variable(variable.dims, values, variable.attrs)
    return xr.Dataset(joint).set_coords(list(parts[0].coords))
