"""A view is a figure that a dataset calls for, with its numbers: the answer over its axes, and the runs of its cases."""

import csv
import io
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from nanoslip.solver.view import with_error
from nanoslip.study.dataset.access import id_of, places
from nanoslip.study.dataset.file import groups_of
from nanoslip.study.dataset.variables import commonest, means_of
from nanoslip.study.figures.points import (
    MOST_HUES,
    Columns,
    Points,
    Roles,
    counts_of,
    held_at,
    points_of,
    roles_of,
    scattered,
    symbol,
    together,
    typeset,
    varying,
    words,
)
from nanoslip.study.figures.shared import COLORS, column
from nanoslip.study.figures.sweep import SHORTEST, WIDTH, draw_lines, draw_scattered, draw_tiles, far_below, is_crowded


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
        order = {value: rank for rank, value in enumerate(_in_order(values))}
        share = (np.array([order[value] for value in values]) + 0.5) / len(order) * min(len(order), most)
        parts.append(share.astype(np.int64))
        off += np.abs(share % 1.0 - 0.5)
    return np.stack(parts), off


def _in_order(values: Sequence[Any]) -> list[Any]:
    """Each value once: numbers by size, words as they come."""
    found = list(dict.fromkeys(values))
    return found if any(isinstance(value, str) for value in found) else sorted(found)


# Runs of a dataset (records, trajectories, contacts) as views: a few together in one figure, then each alone.

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


# Numbers that need no figure, told in one sentence: the same in all cases, known of one case only, or of none.

ROUNDING: Final = 1e-9
"""Share of a number by which others may differ from it and be the same."""


def differs(points: Points) -> bool:
    """Whether a figure has something to show: two values that are not the same but for rounding."""
    values = points.values[points.there]
    if not points.axes or not len(values):
        return False
    if points.text:
        return len(set(values.tolist())) > 1
    return bool(np.ptp(values) > ROUNDING * np.abs(values).max())


def in_words(found: Sequence[Points]) -> Iterator[str]:
    """A sentence for each of several numbers that do not differ, and one that names all those that no case has."""
    for points in found:
        if points.there.any():
            yield f"{sentence(points.label)}: {_value(points)}{_where(points)}{_care(points)}."
    unknown = [points.label for points in found if not points.there.any()]
    if unknown:
        yield f"Not known of any case: {', '.join(unknown)}."


def sentence(text: str) -> str:
    """A text that begins with a capital letter."""
    return text[0].upper() + text[1:]


def _value(points: Points) -> str:
    first = int(np.flatnonzero(points.there)[0])
    value = points.values[first]
    if points.text:
        return str(value).replace("_", "-")
    return with_error(float(value), float(points.errors[first])) if points.stated else f"{value:.5g}"


def _care(points: Points) -> str:
    """Which of the values are to be taken with care, as hollow points are in a figure."""
    flagged, known = int((points.flagged & points.there).sum()), int(points.there.sum())
    which = "" if flagged == known else f"{flagged} of them "
    return f"; {which}to be taken with care" if flagged else ""


def _where(points: Points) -> str:
    """Of which cases a value is that all of them share that have any."""
    known, count = int(points.there.sum()), len(points.values)
    if count == 1:
        return ""
    if known == count:
        return " in all cases"
    if known > 1:
        return f" in all cases that have it, {known} of {count}"
    place = {name: values[points.there].tolist()[0] for name, values in points.axes.items()}
    return f" at {words(place)}, the only one of {count} that has it" if place else ""


# The answer of a campaign: its numbers over its axes, drawn as the design asks for.

OBSERVED: Final = (
    ("regime", ""),
    ("slips_exponent", ""),
    ("slips_goodness", ""),
    ("plateau_mean", "intrinsic_friction"),
    ("static_friction", "intrinsic_friction"),
    ("kinetic_friction", "intrinsic_friction"),
    ("mean_step", ""),
    ("contact_half_width", ""),
)
"""Variable and what it is divided by: what a record or a drive is asked for, first what a campaign asks for on purpose."""
PRESSED: Final = (("contact_half_width", ""), ("maximum_pressure", ""), ("approach", ""))
"""What a contact at rest is asked for."""


def answers(dataset: xr.Dataset) -> Iterator[View]:
    """A figure for each number that differs between cases; none of a single case."""
    return (view_of(points) for points in _asked(dataset) if differs(points))


def notes(dataset: xr.Dataset) -> Iterator[str]:
    """The numbers that do not differ, in words."""
    return in_words([points for points in _asked(dataset) if not differs(points)])


def _asked(dataset: xr.Dataset) -> Iterator[Points]:
    for name, over in OBSERVED if "plateau_mean" in dataset else PRESSED:
        if name in dataset and (not over or over in dataset.variables):
            yield points_of(dataset, name, over)


def view_of(points: Points, x: str = "", hue: str = "") -> View:
    """The figure of some points that differ in at least one coordinate. x, hue: coordinates that the caller chooses."""
    stem = points.name.replace("/", "_over_")
    drawn, kept = together(points, (x, hue))
    with_it = f" {' and '.join(map(symbol, points.zipped))} vary together." if kept else ""
    if scattered(drawn) and not x:
        names = " and ".join(map(symbol, counts_of(drawn)))
        caption = (
            f"{sentence(points.label)}, against {names}.{with_it}{_without(points)}{_members(points)}{_marks(points)}"
        )
        return View(stem, caption, lambda: draw_scattered(drawn), points.columns)
    roles = roles_of(drawn, x, hue)
    signs = _seen(held_at(drawn, roles.held), roles, _mapped(drawn, roles))
    caption = f"{sentence(points.label)}, {_against(drawn, roles)}.{with_it}{signs}"
    return View(stem, caption, lambda: figure_of(drawn, roles), points.columns)


def figure_of(points: Points, roles: Roles) -> Figure:
    """Lines, or a map where words or many values of a second coordinate would make too many lines."""
    return draw_tiles(points, roles) if _mapped(points, roles) else draw_lines(points, roles)


def _mapped(points: Points, roles: Roles) -> bool:
    return bool(roles.hue) and (points.text or counts_of(points)[roles.hue] > MOST_HUES)


def _against(points: Points, roles: Roles) -> str:
    """What is drawn against what, and at which value of what is not shown."""
    panels = f", one panel for each {' and '.join(map(symbol, roles.panels))}" if roles.panels else ""
    held = f"; drawn for {words(dict(roles.held))} only, counts in this caption are for all cases" if roles.held else ""
    if _mapped(points, roles):
        return f"over {symbol(roles.x)} and {symbol(roles.hue)}{panels}{held}"
    hue = f", one colour for each {symbol(roles.hue)}" if roles.hue else ""
    return f"against {symbol(roles.x)}{hue}{panels}{held}"


def _seen(points: Points, roles: Roles, mapped: bool) -> str:
    """What the signs mean that are drawn of these points."""
    if mapped and is_crowded(points, roles):
        return _without(points, "White") + _members(points) + _outlined(points)
    differing = points.text and any(commonest(value)[1] < 1.0 for value in points.values.tolist())
    mixed = " Of members that differ: what most do" + (", the paler the fewer." if mapped else ".") if differing else ""
    flagged = " Dots: to be taken with care." if points.flagged[points.there].any() else ""
    return mixed + _without(points) + _members(points) + (flagged if mapped else _marks(points))


def _without(points: Points, sign: str = "Red crosses") -> str:
    missing = int((~points.there).sum())
    return f" {sign}: {missing} without a value." if missing else ""


def _outlined(points: Points) -> str:
    """What of many points is to be taken with care."""
    care = int((points.flagged & points.there).sum())
    where = "All" if care == points.there.sum() else f"{care} of {len(points.values)}, hatched,"
    return f" {where} are to be taken with care." if care else ""


def _marks(points: Points) -> str:
    """What bars, question marks and hollow points mean, where there are any."""
    bars = " Bars: its uncertainty, where larger than the point." if np.isfinite(points.errors).any() else ""
    if far_below(points, points).any():
        bars += f" Arrows: down to less than {SHORTEST:.0%} of the number."
    if unsure := int(points.unsure.sum()):
        bars += f" Question marks: ± not known of {unsure} of {len(points.values)} points."
    hollow = " Hollow: to be taken with care." if points.flagged[points.there].any() else ""
    return bars + hollow


def _members(points: Points) -> str:
    """How many means are of fewer members than there are, where there are any."""
    lacking = points.lacking & points.there
    if not lacking.any():
        return ""
    least = int(points.members[lacking].min())
    return (
        f" Of {int(lacking.sum())} of {len(points.values)} points some members have no value; the least have {least}."
    )
