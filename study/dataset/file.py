"""The dataset as a file: its name, the attributes that say what it is, reading and writing it whole."""

import errno
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr

from nanoslip.study.dataset.groups import carrying, opened, tree_of
from nanoslip.study.dataset.netcdf import write_tree
from nanoslip.study.dataset.seal import broken, seal
from nanoslip.study.results.entry import NO_FILE, is_no_file, written_whole
from nanoslip.study.results.store import StoreError

FILE: Final = "results.nc"
FORMAT: Final = "nanoslip_format"
VERSION: Final = 4
"""Attribute of a dataset, and its value: to be raised whenever a variable is added, renamed or given another meaning."""
OLDEST: Final = 3
"""The oldest format that is read: that of 0.2.0, whose ± is a model of what one start does not know."""
CHOSEN: Final = "numerics_chosen"
"""Attribute of a dataset of a campaign that asks for an error: the numerics that it got, as JSON."""
MIXED: Final = "mixed_software"
"""Attribute of a dataset whose results are not all by the same software: names all of it, with counts."""

MOST_CHECKED: Final = 2**30
"""Bytes of a file that are checked when it is opened, in about a second; `nanoslip verify` checks any."""

_RENAMED: Final = {"plateau_uncertainty": "plateau_mean_uncertainty"}
"""Variable of format 3 -> its name today; the others that both have are called the same."""
_REFUSALS: Final = (OSError, RuntimeError)
"""What netCDF raises where bytes are missing or wrong, or the disk is full."""


def write(dataset: xr.Dataset, path: Path) -> None:
    """Write the dataset and its groups as netCDF-4, whole or not at all. Raises StoreError, LostGroupsError."""
    tree = tree_of(dataset)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with written_whole(path) as scratch:
            write_tree(tree, scratch)
            seal(scratch)
    except _REFUSALS as error:
        raise StoreError(f"{path}: cannot be written: {_reason(error)}") from None


def read(path: Path) -> xr.Dataset:
    """Open a dataset with its groups; values are read when they are used, so close it (or use `with`). Raises StoreError.

    A file of up to MOST_CHECKED bytes is refused where any of them has changed since it was collected.
    """
    try:
        if is_no_file(path):  # to read a pipe would never end
            raise OSError(errno.EINVAL, NO_FILE)
        if path.stat().st_size <= MOST_CHECKED:
            check(path)
        root, groups = opened(path)
    except _REFUSALS as error:
        raise StoreError(f"{path}: no dataset ({_reason(error)}); run or collect the campaign first") from None
    if problem := _other_format(root.attrs):
        root.close()
        raise StoreError(f"{path}: {problem}")
    return carrying(_renamed(root) if is_older(root) else root, groups)


def is_older(dataset: xr.Dataset) -> bool:
    """Whether a dataset has an older format than those that are written now."""
    return bool(dataset.attrs.get(FORMAT, VERSION) < VERSION)


def _renamed(root: xr.Dataset) -> xr.Dataset:
    """An older dataset with the names of today."""
    found = root.rename({old: new for old, new in _RENAMED.items() if old in root})
    for each in found.variables.values():
        if each.attrs.get("ancillary_variables") in _RENAMED:
            each.attrs["ancillary_variables"] = _RENAMED[each.attrs["ancillary_variables"]]
    found.set_close(root.close)
    return found


def _other_format(said: Mapping[str, Any]) -> str:
    """Why a file with these attributes cannot be read by this nanoslip, and what can; empty where it can."""
    form = said.get(FORMAT)
    if not isinstance(form, int | np.integer):
        return f"no dataset of nanoslip: it has no attribute {FORMAT}"
    reads = f"this one reads formats {OLDEST} to {VERSION}"
    if form > VERSION:
        maker = f" (its results are by {said['nanoslip_version']})" if "nanoslip_version" in said else ""
        return f"has format {form}, of a newer nanoslip{maker}; {reads}: read it with the newer one"
    if form < OLDEST:
        return f"has format {form}, of an older nanoslip; {reads}: nanoslip run writes it anew"
    return ""


def check(path: Path) -> None:
    """Raises StoreError where a byte of the file has changed since it was collected, OSError."""
    if broken(path):
        raise StoreError(
            f"{path}: its bytes are not those that were collected: damaged? nanoslip collect writes it anew"
        )


@contextmanager
def reading(path: Path) -> Iterator[xr.Dataset]:
    """The same for a `with`, in which values that the file has lost or that were damaged are a StoreError, too."""
    with read(path) as found:
        try:
            yield found
        except _REFUSALS as error:
            raise StoreError(f"{path}: cannot be read: {error}: damaged? nanoslip collect writes it anew") from error


def _reason(error: Exception) -> object:
    return getattr(error, "strerror", None) or error
