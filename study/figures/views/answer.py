"""The answer of a campaign: its numbers over its axes, drawn as the design asks for."""

from collections.abc import Iterator
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.study.dataset.ragged import commonest
from nanoslip.study.figures.points import (
    MOST_HUES,
    Points,
    Roles,
    counts_of,
    held_at,
    points_of,
    roles_of,
    scattered,
    symbol,
    together,
    words,
)
from nanoslip.study.figures.sweep import SHORTEST, draw_lines, draw_scattered, draw_tiles, far_below, is_crowded
from nanoslip.study.figures.views.alike import differs, in_words, sentence
from nanoslip.study.figures.views.view import Sort, View, register

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


register(Sort("answer", "Answer", answers, notes))
