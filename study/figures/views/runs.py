"""Runs of a dataset (records, trajectories, contacts) as views: a few together in one figure, then each alone."""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from nanoslip.study.dataset.access import id_of, places
from nanoslip.study.dataset.file import groups_of
from nanoslip.study.dataset.variables import means_of
from nanoslip.study.figures.points import Columns, typeset, varying, words
from nanoslip.study.figures.shared import COLORS, column
from nanoslip.study.figures.sweep import WIDTH
from nanoslip.study.figures.views.choice import spread
from nanoslip.study.figures.views.view import View

HEIGHT: Final = 2.3
"""Of a figure without its legend, in inches."""
LINE: Final = 0.15
"""Height of a line of a legend, in inches."""
LONG: Final = 30
"""Characters of a name from which it has a line of its own."""
MOST_TOGETHER: Final = len(COLORS)
"""Runs that are drawn together; of more, so many that are spread over all axes."""


@dataclass(frozen=True, slots=True)
class Need:
    """What a case needs for its run to be drawn: at least so much of one of its numbers."""

    variable: str
    least: float
    otherwise: str
    """What is said of runs without: `they have no events`."""


@dataclass(frozen=True, slots=True)
class Run:
    """One run of a group."""

    number: int
    label: dict[str, Any]
    """The coordinates in which its case differs from the others."""
    selection: dict[str, Any]
    """What singles it out for the accessor."""


@dataclass(frozen=True, slots=True)
class Family:
    """Runs that are drawn alike."""

    name: str
    group: str
    """Of the dataset."""
    caption: str
    columns: Callable[[xr.Dataset, Run], Columns]
    """The numbers of one run that are drawn."""
    draw: Callable[[Any, Columns, dict[str, Any]], None]
    """Draws one run on axes of matplotlib, with the settings of its main line."""
    axes: dict[str, Any]
    """Labels and scales."""
    need: Need | None = None
    """Without which a figure would be empty."""
    of_all: bool = False
    """Whether a run is of all members of an ensemble, not of the first."""


def runs_of(dataset: xr.Dataset, group: str, need: Need | None = None) -> list[Run]:
    """The runs of a group, each once, though several cases share it; none where the dataset has no such group.

    need: runs of cases that lack it are left out.
    """
    if f"{group}_id" not in dataset or group not in groups_of(dataset):
        return []
    found = places(dataset, id_of(dataset, group), {})
    ids = found.values(f"{group}_id").tolist()
    labels = varying(found)
    firsts = dict.fromkeys(each for each in ids if isinstance(each, str) and each)
    numbers = [ids.index(each) for each in firsts]
    enough = np.ones(len(ids), np.bool_)
    if need and need.variable in dataset:
        enough = found.values(need.variable) >= need.least
    return [
        Run(
            number,
            {name: values[place : place + 1].tolist()[0] for name, values in labels.items()},
            {dim: dataset[dim].values[found.positions[place, axis]] for axis, dim in enumerate(found.dims)},
        )
        for number, place in enumerate(numbers, 1)
        if enough[place]
    ]


def views_of(dataset: xr.Dataset, family: Family) -> Iterator[View]:
    """One figure of several runs together, then one of each."""
    if means_of(dataset) and not family.of_all:
        family = replace(family, caption=f"{family.caption}, of the first member")
    runs = {run.number: run for run in runs_of(dataset, family.group, family.need)}
    columns = cache(
        lambda number: family.columns(dataset, runs[number])
    )  # two figures show a run, and two files hold it
    if len(runs) > 1:
        every = list(runs.values())
        shown = [every[position] for position in spread([run.label for run in every], MOST_TOGETHER)]
        yield _together(family, columns, shown, len(runs))
    for run in runs.values():
        yield _alone(family, columns, run, several=len(runs) > 1)


def notes_of(dataset: xr.Dataset, family: Family) -> Iterator[str]:
    """How many runs are not drawn as there is nothing in them, and why."""
    every, drawn = runs_of(dataset, family.group), runs_of(dataset, family.group, family.need)
    if family.need and len(drawn) < len(every):
        count = "None" if not drawn else f"{len(every) - len(drawn)}"
        yield f"{count} of {len(every)} {'is' if not drawn else 'are not'} drawn: {family.need.otherwise}."


def thinned(x: NDArray[Any], y: NDArray[Any], bins: int = 300) -> NDArray[np.int64]:
    """Which points of a line to draw, so that it looks the same: the lowest and the highest in each bin of x, and the ends.

    x: (n,), rising. Returns rising indices; all where there are few.
    """
    if len(x) <= 2 * bins:
        return np.arange(len(x))
    order = np.lexsort((y, edges := np.digitize(x, np.linspace(x[0], x[-1], bins + 1)[1:-1])))
    firsts = np.flatnonzero(np.diff(edges[order], prepend=-1))
    lasts = np.append(firsts[1:], len(x)) - 1
    return np.unique(np.concatenate((order[firsts], order[lasts], [0, len(x) - 1])))


def _together(family: Family, numbers: Callable[[int], Columns], runs: list[Run], count: int) -> View:
    def drawn() -> Figure:
        return _drawn(family, ((numbers(run.number), {"label": typeset(words(run.label))}) for run in runs))

    def columns() -> Columns:
        tables = [(words(run.label), numbers(run.number)) for run in runs]
        names = [np.full(len(next(iter(table.values()))), name, dtype=object) for name, table in tables]
        return {
            "case": np.concatenate(names),
            **{name: np.concatenate([table[name] for _, table in tables]) for name in tables[0][1]},
        }

    which = "all cases" if count == len(runs) else f"{len(runs)} of {count} cases, spread over all axes"
    return View(f"{family.name}_together", f"{family.caption}: {which}.", drawn, columns)


def _alone(family: Family, numbers: Callable[[int], Columns], run: Run, several: bool) -> View:
    """several: whether it is one of them, which its place tells apart."""
    which = f": {words(run.label)}" if run.label else ""
    return View(
        f"{family.name}_{run.number}",
        f"{family.caption}{which}.",
        lambda: _drawn(family, [(numbers(run.number), {})]),
        lambda: numbers(run.number),
        run.label if several else {},
    )


def _drawn(family: Family, runs: Iterable[tuple[Columns, dict[str, Any]]]) -> Figure:
    """Runs on one pair of axes. runs: of each its numbers, and the settings of its main line beside the colour."""
    with column(HEIGHT, WIDTH) as figure:
        axes = figure.add_subplot()
        for color, (table, style) in zip(COLORS, runs, strict=False):
            family.draw(axes, table, {"color": color, **style})
        axes.set(**family.axes)
        _legend(figure, axes)
    return figure


def _legend(figure: Figure, axes: Any) -> None:
    """Names above the axes, which the figure grows by."""
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        columns = 1 if max(map(len, labels)) > LONG else 2
        figure.set_size_inches(WIDTH, HEIGHT + LINE * math.ceil(len(labels) / columns))
        figure.legend(handles, labels, loc="outside upper center", ncols=columns, markerscale=2.0)
