"""Of how many members the numbers of a dataset are, as not all members of an ensemble have each; and what ± was before."""

from functools import cache
from typing import Final

import xarray as xr

from nanoslip.study.dataset.file import FORMAT, is_older
from nanoslip.study.dataset.variables import DRIVE, DRIVE_MEMBERS, MEMBERS, companions, scalars

EXPLAINED: Final = "behind a mean: as many members have this number, the others have none"

MODEL: Final = "a model of what one start does not know"
"""What ± is in a dataset of format 3."""


def members_of(dataset: xr.Dataset, name: str) -> tuple[xr.DataArray, xr.DataArray] | None:
    """How many members have a number, and how many were computed; None of what is no mean with an uncertainty."""
    counters = _counters(dataset, name)
    if not counters:
        return None
    having, used = xr.broadcast(*(dataset[each] for each in counters))
    return having, used


def _counters(dataset: xr.Dataset, name: str) -> tuple[str, ...]:
    """The variables that count the members having a number and the members computed; none of what is no such mean."""
    names = (f"{name}_members", (DRIVE_MEMBERS if name in _of_drives() else MEMBERS).name)
    return names if set(names) <= dataset.variables.keys() else ()


@cache
def _of_drives() -> set[str]:
    return {each.name for kind in (scalars, companions) for each in kind(DRIVE).values()}


def fewer(case: xr.Dataset, name: str) -> str:
    """Behind a number of one case, where fewer members have it than were computed: ` (5 of 8)`."""
    counts = [case.variables[each].values.item() for each in _counters(case, name)]
    return f" ({counts[0]:.0f} of {counts[1]:.0f})" if counts and 0 < counts[0] < counts[1] else ""


def ends_of(counts: xr.DataArray) -> str:
    """The least and the most of some counts of members: `3 to 12`, or `8`."""
    known = counts.values[counts.notnull().values]
    return " to ".join(dict.fromkeys(str(int(end)) for end in (known.min(), known.max()))) if known.size else "0"


def means_of(dataset: xr.Dataset) -> str:
    """That numbers are means, and over how many members; empty where each is of one."""
    if MEMBERS.name not in dataset or not bool((dataset[MEMBERS.name] > 1.0).any()):
        return ""
    return f"numbers are means over {ends_of(dataset[MEMBERS.name])} members; (k of n) {EXPLAINED}"


def modelled(dataset: xr.Dataset) -> str:
    """That ± of an older dataset is no interval over members; empty of one of today."""
    return f"± is {MODEL} (format {dataset.attrs[FORMAT]})" if is_older(dataset) else ""
