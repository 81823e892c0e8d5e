"""What a view is: a figure that a dataset calls for, with its numbers; and the registry of sorts of views."""

import csv
import io
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import xarray as xr
from matplotlib.figure import Figure

from nanoslip.study.figures.points import Columns, words


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


def no_notes(_: xr.Dataset) -> Iterator[str]:
    """Of a sort that has nothing to say besides its figures."""
    return iter(())


@dataclass(frozen=True, slots=True)
class Sort:
    """Views of one sort."""

    name: str
    title: str
    views: Callable[[xr.Dataset], Iterator[View]]
    """Those that a dataset calls for; none where it has nothing of the sort."""
    notes: Callable[[xr.Dataset], Iterator[str]] = no_notes
    """Sentences on what is not drawn, and why."""


SORTS: Final[dict[str, Sort]] = {}
"""Every sort by name, in the order of a page (see nanoslip.study.figures.views.catalogue)."""


def register(sort: Sort) -> Sort:
    """Add a sort: from then on the page shows its views."""
    SORTS[sort.name] = sort
    return sort


def csv_of(columns: Columns) -> str:
    """Columns as CSV with a line of names; numbers have nine digits, missing ones are empty."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(columns)
    for row in zip(*(each.tolist() for each in columns.values()), strict=True):
        writer.writerow(_cell(value) for value in row)
    return buffer.getvalue()


def _cell(value: Any) -> Any:
    if not isinstance(value, float):
        return value
    return "" if math.isnan(value) else f"{value:.9g}"
