"""The groups of a dataset beside its root: records, event sizes, trajectories, contacts, the inside of the slab, the software.

In a file they are groups of netCDF-4. In Python the root is an `xr.Dataset` of scalars over the cases that carries the groups
with it, in its encoding and in that of `case_id`: selections keep the one, `where` the other.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import xarray as xr

from nanoslip.study.dataset.texts import are_texts, read_texts

_KEY: Final = "nanoslip_groups"
_LABEL: Final = "case_id"
"""The coordinate that every dataset of nanoslip has."""
ROOT: Final = "/"


class LostGroupsError(ValueError):
    """A dataset that no longer knows where its records and trajectories are."""


class Groups(Mapping[str, xr.Dataset]):
    """Name -> group. Never changed once it is carried by a dataset: copies of the dataset share it."""

    def __init__(self, groups: Mapping[str, xr.Dataset]) -> None:
        self._groups = dict(groups)

    def __getitem__(self, name: str) -> xr.Dataset:
        return self._groups[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._groups)

    def __len__(self) -> int:
        return len(self._groups)

    def __copy__(self) -> "Groups":
        return self

    def __deepcopy__(self, _memo: Any) -> "Groups":
        return self


def carrying(root: xr.Dataset, groups: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Let a root carry its groups, which `groups_of` finds again; returns the root."""
    held = Groups(groups)
    root.encoding = {**root.encoding, _KEY: held}
    if _LABEL in root.variables:
        root[_LABEL].encoding[_KEY] = held
    return root


def groups_of(root: xr.Dataset) -> Groups:
    """The groups of a dataset, of its selections, or of a file that xarray itself opened. Raises LostGroupsError."""
    places = [root.encoding, root[_LABEL].encoding if _LABEL in root.variables else {}]
    for encoding in places:
        if _KEY in encoding:
            held: Groups = encoding[_KEY]
            return held
    for encoding in places:
        if Path(str(encoding.get("source", ""))).is_file():
            return Groups(opened(Path(encoding["source"]))[1])
    raise LostGroupsError(
        "this dataset has lost its records and trajectories: ask the dataset that nanoslip.open, nanoslip.run or "
        "nanoslip.concat returned, or a selection of it, before computing with it"
    )


def opened(path: Path) -> tuple[xr.Dataset, dict[str, xr.Dataset]]:
    """Root and groups of a file; numbers are read when they are used, texts at once. Raises OSError."""
    found = xr.open_groups(path, engine="netcdf4")
    for each in found.values():
        for variable in each.variables.values():
            if are_texts(variable) and not isinstance(variable, xr.IndexVariable):  # which is read already
                variable.data = read_texts(variable)  # xarray cannot transpose characters that it has not read
    root = found.pop(ROOT)
    groups = {name.strip("/"): group for name, group in found.items()}

    def close() -> None:
        for each in groups.values():
            each.close()

    own = root._close

    def close_all() -> None:
        close()
        if own is not None:
            own()

    root.set_close(close_all)
    return root, groups


def tree_of(root: xr.Dataset) -> xr.DataTree:
    """Root and groups as one tree."""
    return xr.DataTree.from_dict({ROOT: root, **groups_of(root)})


def loaded(root: xr.Dataset) -> xr.Dataset:
    """The dataset with all values in memory, its groups' too."""
    return carrying(root.load(), {name: group.load() for name, group in groups_of(root).items()})


def flattened(root: xr.Dataset) -> dict[str, xr.DataArray]:
    """Every variable by its path: `plateau_mean`, `record/event_slips`."""
    found = {str(name): root[name] for name in root.variables}
    for group, values in groups_of(root).items():
        found |= {f"{group}/{name}": values[name] for name in values.variables}
    return found
