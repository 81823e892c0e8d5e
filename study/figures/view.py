"""A view is a figure that a dataset calls for, with its numbers; and which of many alike are shown."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from nanoslip.study.figures.points import Columns, ordered, words


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """One figure of a dataset, drawn when asked for."""

    name: str
    """Stem of a file's name."""
    caption: str
    """What is to be seen, for readers and in place of the picture."""
    draw: Callable[[], Figure]
    columns: Callable[[], Columns]
    """The numbers that are drawn."""
    place: Mapping[str, Any] = field(default_factory=dict)
    """Of one of many alike, which a page shows small: the coordinates in which it differs from the others."""

    @property
    def label(self) -> str:
        """The parameters in which one run differs from the others, in words."""
        return words(self.place)


@dataclass(frozen=True, slots=True)
class Sort:
    """Views of one sort."""

    name: str
    title: str
    views: Callable[[xr.Dataset], Iterator[View]]
    """Those that a dataset calls for; none where it has nothing of the sort."""
    notes: Callable[[xr.Dataset], Iterator[str]]
    """Sentences on what is not drawn, and why."""


def csv_of(columns: Columns) -> str:
    """Columns as CSV with a line of names; numbers have nine digits, missing ones are empty."""
    table = xr.Dataset({name: ("row", values) for name, values in columns.items()}).to_dataframe()
    return str(table.to_csv(index=False, float_format="%.9g", lineterminator="\n"))


# Choice of the few runs that are drawn of many, spread over the values of every axis.


def spread(places: Sequence[Mapping[str, Any]], most: int) -> list[int]:
    """Positions of at most so many places, rising: each axis is divided into parts, and all its parts are shown alike.

    places: the coordinates of each, the same ones for all. They are taken one by one: a place costs 2^m for each one taken
    before that it shares m parts with, so that single axes and pairs of them are balanced; of equals the one nearest to the
    middles of its parts.
    """
    if len(places) <= most:
        return list(range(len(places)))
    parts, off = _parts(places, most)
    cost, taken = np.zeros(len(places)), np.zeros(len(places), np.bool_)
    for _ in range(most):
        best = np.lexsort((off, cost, taken))[0]
        taken[best] = True
        cost += 2.0 ** (parts == parts[:, best, None]).sum(axis=0)
    return [int(position) for position in np.flatnonzero(taken)]


def _parts(places: Sequence[Mapping[str, Any]], most: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """(axes, places) the part of its axis that each place is in, and (places,) how far it is from the middles of its parts.

    An axis has as many parts as values, at most `most`. Places without coordinates lie along one axis, in their order.
    """
    columns = [[place[name] for place in places] for name in places[0]] or [list(range(len(places)))]
    parts, off = [], np.zeros(len(places))
    for values in columns:
        order = {value: rank for rank, value in enumerate(ordered(values))}
        share = (np.array([order[value] for value in values]) + 0.5) / len(order) * min(len(order), most)
        parts.append(share.astype(np.int64))
        off += np.abs(share % 1.0 - 0.5)
    return np.stack(parts), off
