"""The cases that two datasets share: those with the same values of every parameter that varies in either."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import xarray as xr

from nanoslip.study.dataset.access.tidy import values_over
from nanoslip.study.dataset.collection.counted import counted
from nanoslip.study.dataset.variables import DRIVE_NAME, MEMBERS, OUTCOMES, parameters
from nanoslip.study.manifest.parameters import Value
from nanoslip.study.plan.plan import NOTHING_KNOWN

KINDS: Final = ("", "drive")
"""What rows are of: cases, or cases with a drive."""
_MEMBER: Final = "member"
"""The dimension of the members of an ensemble in format 3."""
Pair = tuple[xr.Dataset, xr.Dataset]
"""Two datasets."""


class NotComparableError(ValueError):
    """Two datasets that have nothing to compare; the message says why."""


@dataclass(frozen=True, slots=True)
class Matched:
    """Rows of two datasets side by side."""

    axes: tuple[str, ...]
    """Parameters that tell the rows of either apart."""
    labels: tuple[dict[str, Value], ...]
    """Of each shared row: its values on the axes."""
    rows: tuple[tuple[int, int], ...]
    """Of each shared row: its place in the first and in the second dataset."""
    only: tuple[tuple[dict[str, Value], ...], tuple[dict[str, Value], ...]]
    """Labels of the rows that the first, and the second, has alone."""
    pending: int
    """Shared rows that are left out, as either is not computed yet, or failed without a result."""


def over_members(root: xr.Dataset) -> xr.Dataset:
    """A dataset with each ensemble as one case: in format 3 members are cases. Means have their ±, texts are counted.

    A number that has no mean over members is left out; a parameter of several values, as `start`, is the first member's.
    """
    if _MEMBER not in root.dims:
        return root
    of_members = {str(name): each for name, each in root.data_vars.items() if _MEMBER in each.dims}
    texts = {name: each for name, each in of_members.items() if each.dtype.kind in "OU"}
    names = {"members_used": MEMBERS.name}
    for name in of_members:
        names |= {f"{name}_ensemble_mean": name, f"{name}_ensemble_uncertainty": f"{name}_uncertainty"}
    found = root.drop_vars(of_members.keys() - texts.keys()).rename(
        {theirs: ours for theirs, ours in names.items() if theirs in root}
    )
    return found.assign({name: _counted(each) for name, each in texts.items()}).isel({_MEMBER: 0}, drop=True)


def _counted(texts: xr.DataArray) -> xr.DataArray:
    found: xr.DataArray = xr.apply_ufunc(
        counted, texts, input_core_dims=[[_MEMBER]], vectorize=True, output_dtypes=[object]
    )
    return found


def matched(pair: Pair, kind: str) -> Matched:
    """The rows of cases ("") or drives that both datasets have. Raises NotComparableError where rows cannot be told apart."""
    names = axes(pair, kind)
    places = [_places(root, kind, names) for root in pair]
    endings = [values_over(ending_of(root, kind), ending_of(root, kind)) for root in pair]
    shared = [(key, (place, places[1][key])) for key, place in places[0].items() if key in places[1]]
    done = [(key, at) for key, at in shared if not {endings[0][at[0]], endings[1][at[1]]} & set(NOTHING_KNOWN)]
    only = [
        tuple(_label(names, key) for key in mine if key not in theirs) for mine, theirs in (places, reversed(places))
    ]
    labels = tuple(_label(names, key) for key, _ in done)
    return Matched(names, labels, tuple(at for _, at in done), (only[0], only[1]), len(shared) - len(done))


def axes(pair: Pair, kind: str) -> tuple[str, ...]:
    """The parameters of cases or drives that have several values in either dataset."""
    return tuple(
        name
        for name in (*parameters(), DRIVE_NAME.name)
        if any(len(values(root, name)) > 1 and _along(root, name, kind) for root in pair)
    )


def values(root: xr.Dataset, name: str) -> list[Value]:
    """The different values of a parameter in a dataset; none where it has no such parameter."""
    found = root[name].values.ravel().tolist() if name in root.coords else []
    return list(dict.fromkeys(value for value in found if not _missing(value)))


def ending_of(root: xr.Dataset, kind: str) -> xr.DataArray:
    """How the rows ended: what lies along all their dimensions."""
    return root[OUTCOMES[kind][0].name]


def _along(root: xr.Dataset, name: str, kind: str) -> bool:
    return name in root.coords and set(root[name].dims) <= set(ending_of(root, kind).dims)


def _places(root: xr.Dataset, kind: str, names: Sequence[str]) -> dict[tuple[Any, ...], int]:
    """Values on the axes -> where the row is."""
    keys = list(_keys(root, kind, names))
    found = {key: place for place, key in enumerate(keys)}
    if len(found) < len(keys):
        raise NotComparableError(f"cases are not told apart by {', '.join(names) or 'any parameter'}")
    return found


def _keys(root: xr.Dataset, kind: str, names: Sequence[str]) -> Iterator[tuple[Any, ...]]:
    over = ending_of(root, kind)
    columns = [values_over(root[name], over) if _along(root, name, kind) else [None] * over.size for name in names]
    for place in range(over.size):
        yield tuple(None if _missing(column[place]) else column[place] for column in columns)


def _label(names: Sequence[str], key: Sequence[Any]) -> dict[str, Value]:
    return {name: value for name, value in zip(names, key, strict=True) if value is not None}


def _missing(value: object) -> bool:
    return value is None or value == "" or value != value  # noqa: PLR0124  only NaN is not itself
