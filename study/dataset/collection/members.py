"""Of how many members the numbers of an ensemble are, beside those that there are: not all have each number."""

from typing import Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from study.dataset.collection.ensemble import ensemble_name
from study.dataset.variables import MEMBERS_USED
from study.manifest.cases import MEMBER

EXPLAINED: Final = "behind a mean: as many members have this number, the others have none"


def counter_of(name: str) -> str:
    """The variable that says how many members have a number; name: of the number, or of its standard deviation."""
    return ensemble_name(name.removesuffix(ensemble_name("", "std")), "members")


def members_of(reduced: xr.Dataset, name: str) -> tuple[xr.DataArray, xr.DataArray] | None:
    """How many members have a number, and how many were used; None of what is no mean over members.

    reduced: of study.dataset.collection.ensemble.over_members.
    """
    if not {counter_of(name), MEMBERS_USED.name} <= set(reduced.data_vars):
        return None
    having, used = xr.broadcast(reduced[counter_of(name)], reduced[MEMBERS_USED.name])
    return having, used


def fewer(case: xr.Dataset, name: str) -> str:
    """Behind a number of one case, where fewer members have it than were used: ` (2 of 4)`."""
    counts = members_of(case, name)
    if counts is None or not 0 < int(counts[0]) < int(counts[1]):
        return ""
    return f" ({int(counts[0])} of {int(counts[1])})"


def ends_of(counts: NDArray[np.int64]) -> str:
    """The least and the most of some counts of members: `4 to 8`, or `4`."""
    return " to ".join(dict.fromkeys(str(int(end)) for end in (counts.min(), counts.max())))


def means_of(dataset: xr.Dataset) -> str:
    """That numbers are means, and over how many members; empty of a dataset without, or of one member singled out."""
    if MEMBERS_USED.name not in dataset or (MEMBER in dataset.coords and MEMBER not in dataset.dims):
        return ""
    return f"numbers are means of {ends_of(dataset[MEMBERS_USED.name].values)} members; (k of n) {EXPLAINED}"
