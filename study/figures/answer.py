"""The answer of a campaign: its numbers over its axes as figures with captions, and in words where they do not differ."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from nanoslip.solver.view import ROUNDING, with_error
from nanoslip.study.dataset.units import hyphenate, label_in_symbols, si_name, symbol
from nanoslip.study.figures.points import (
    Points,
    UnknownNameError,
    axis_named,
    convert_axes_to_si,
    points_named,
    prefix_units,
    read_points,
)
from nanoslip.study.figures.roles import Roles, assign_roles, axis_sizes, is_scattered, merge_zipped, select_points
from nanoslip.study.figures.shared import View, resize_figure
from nanoslip.study.figures.sweep import (
    SHORTEST,
    critical_border,
    draw_over_axes,
    draw_scattered,
    far_below,
    is_crowded,
)

# Numbers that need no figure, told in one sentence: the same in all cases, known of one case only, or of none.


def differs(points: Points) -> bool:
    """True if a figure shows a difference: two values that differ by more than rounding."""
    if not points.axes:
        return False
    values = points.values[points.there]
    if points.text or not len(values):
        return len(set(values.tolist())) > 1
    # Cases that are the same by symmetry differ in the last digits.
    largest = np.abs(values).max()
    return bool(np.ptp(values) > ROUNDING * largest)


def words_of_alike(points_of_names: Sequence[Points]) -> Iterator[str]:
    """Sentences on numbers that do not differ, one each, and one sentence that names all numbers that no case has."""
    for points in map(prefix_units, points_of_names):
        if points.there.any():
            yield f"{capitalize_text(points.label)}: {_value(points)}{_where(points)}{_care(points)}."
    unknown = [points.label for points in points_of_names if not points.there.any()]
    if unknown:
        yield f"Not known of any case: {', '.join(unknown)}."


def capitalize_text(text: str) -> str:
    """A text that begins with a capital letter, or with a symbol as it is."""
    first, rest = text[0], text[1:]
    # Greek letters are symbols here: a capital μ would be a wrong one.
    return first.upper() + rest if first.isascii() else text


def _value(points: Points) -> str:
    first = int(np.flatnonzero(points.there)[0])
    value = points.values[first]
    if points.text:
        return hyphenate(value)
    if not points.stated:
        return f"{value:.5g}"
    return with_error(float(value), float(points.errors[first]))


def _care(points: Points) -> str:
    """List the doubtful values, which are hollow points in a figure."""
    flagged = int((points.flagged & points.there).sum())
    which = "" if flagged == points.there.sum() else f"{flagged} of them "
    return f"; {which}to be taken with care" if flagged else ""


def _where(points: Points) -> str:
    """Describe the cases that share a value, if all cases with a value do."""
    cases_with_value = int(points.there.sum())
    count = len(points.values)
    if count == 1:
        return ""
    if cases_with_value == count:
        return " in all cases"
    if cases_with_value > 1:
        return f" in all cases that have it, {cases_with_value} of {count}"
    place = {name: values[points.there].tolist()[0] for name, values in points.axes.items()}
    return f" at {label_in_symbols(place, points.units)}, the only one of {count} that has it" if place else ""


# The answer of a campaign: its numbers over its axes, drawn as the design asks for.

OBSERVED: Final = (
    ("regime", ""),
    ("slips_exponent", ""),
    ("slips_goodness", ""),
    ("plateau_mean", "intrinsic_friction"),
    ("static_friction", "intrinsic_friction"),
    ("kinetic_friction", "intrinsic_friction"),
    ("loop_energy", ""),
    ("midstroke_friction", "intrinsic_friction"),
    ("mean_step", ""),
    ("contact_half_width", ""),
)
"""Variables of records and drives with their divisors, if these vary; first the ones that a campaign requests on purpose."""
LOOPED: Final = (("loss_per_cycle", ""), ("turn_friction", "intrinsic_friction"), ("secant_stiffness", ""))
"""Variables of loops with their divisors. The closure of loops depends on a single random draw, and is left out."""
AT_REST: Final = (("contact_half_width", ""), ("maximum_pressure", ""), ("approach", ""))
"""Variables drawn for a contact at rest."""


def answers(dataset: xr.Dataset) -> Iterator[View | str]:
    """A figure for each number that differs between cases, and sentences for the other numbers; no figure for a
    single case."""
    numbers = list(_answer_points(dataset))
    yield from (make_view(points) for points in numbers if differs(points))
    yield from words_of_alike([points for points in numbers if not differs(points)])


def _answer_points(dataset: xr.Dataset) -> Iterator[Points]:
    """The numbers that a campaign is computed for, over a divisor that varies."""
    for name, divisor in _answer_names(dataset):
        if name in dataset and (not divisor or divisor in dataset.variables):
            # A divisor that is the same in all cases would only rescale the axis.
            alike = not divisor or np.unique(dataset[divisor]).size == 1
            yield read_points(dataset, si_name(dataset, name), "" if alike else divisor)


def _answer_names(dataset: xr.Dataset) -> Sequence[tuple[str, str]]:
    """Variables with their divisors: of records and drives, of loops, or of a contact at rest."""
    if "plateau_mean" in dataset:
        return OBSERVED
    return LOOPED if "loss_per_cycle" in dataset else AT_REST


def make_view(points: Points, x: str = "", hue: str = "") -> View:
    """The figure of some points. x, hue: coordinates that the caller chooses. Raises UnknownNameError if all are alike."""
    if not points.axes:
        raise UnknownNameError(f"{points.name}: all cases are alike: there is nothing to draw it against")
    drawn, kept = merge_zipped(prefix_units(points), (x, hue))
    if is_scattered(drawn) and not x:
        draw = partial(draw_scattered, drawn)
        against = f"against {' and '.join(map(symbol, axis_sizes(drawn)))}"
        signs = f"{_missing(points)}{_members(points)}{_marks(points)}"
    else:
        roles = assign_roles(drawn, x, hue)
        draw = partial(draw_over_axes, drawn, roles)
        against = _figure_title(roles, drawn.units)
        signs = _signs(select_points(drawn, roles.held), roles)
    together = f" {' and '.join(map(symbol, points.zipped))} vary together." if kept else ""
    caption = f"{capitalize_text(drawn.label)}, {against}.{together}{signs}"
    # The stem of a file, in which a slash would begin a folder.
    name = points.name.replace("/", "_over_")
    return View(name, caption, draw, points.columns)


def _figure_title(roles: Roles, units: Mapping[str, str]) -> str:
    """Title: y against x, and the values of axes that are not shown. units: of coordinates, with prefixes."""
    panels = f", one panel for each {' and '.join(map(symbol, roles.panels))}" if roles.panels else ""
    only = label_in_symbols(roles.held, units)
    selection = f"; drawn for {only} only, counts in this caption are for all cases" if only else ""
    if roles.mapped:
        return f"over {symbol(roles.x)} and {symbol(roles.hue)}{panels}{selection}"
    hue = f", one colour for each {symbol(roles.hue)}" if roles.hue else ""
    return f"against {symbol(roles.x)}{hue}{panels}{selection}"


def _signs(points: Points, roles: Roles) -> str:
    """Meaning of the signs drawn for these points."""
    if not roles.mapped:
        mixed = " Of members that differ: what most do." if points.differing else ""
        return mixed + _missing(points) + _members(points) + _marks(points)
    if is_crowded(points, roles):
        return _missing(points, "White") + _members(points) + _hatching(points)
    paler = " Of members that differ: what most do, the paler the fewer." if points.differing else ""
    border = any(critical_border(points, points, roles))
    above = " Black line: above it the pin no longer sticks." if border else ""
    flagged = " Dots: to be taken with care." if points.flagged[points.there].any() else ""
    return paler + above + _missing(points) + _members(points) + flagged


def _hatching(points: Points) -> str:
    """Report the number of hatched tiles; all are doubtful without hatching."""
    care = int((points.flagged & points.there).sum())
    where = "All" if care == points.there.sum() else f"{care} of {len(points.values)}, hatched,"
    return f" {where} are to be taken with care." if care else ""


def _missing(points: Points, sign: str = "Red crosses") -> str:
    """Meaning of the sign for cases without a value, and their number."""
    missing = int((~points.there).sum())
    return f" {sign}: {missing} without a value." if missing else ""


def _marks(points: Points) -> str:
    """Meaning of bars, question marks and hollow points, if any."""
    bars = " Bars: its uncertainty, where larger than the point." if np.isfinite(points.errors).any() else ""
    if far_below(points, points).any():
        bars += f" Arrows: down to less than {SHORTEST:.0%} of the number."
    unsure = int(points.unsure.sum())
    if unsure:
        bars += f" Question marks: ± not known of {unsure} of {len(points.values)} points."
    hollow = " Hollow: to be taken with care." if points.flagged[points.there].any() else ""
    return bars + hollow


def _members(points: Points) -> str:
    """Report the number of means over fewer members than the ensemble has; empty if none."""
    lacking = points.lacking & points.there
    if not lacking.any():
        return ""
    count = int(lacking.sum())
    least = int(points.members[lacking].min())
    return f" Of {count} of {len(points.values)} points some members have no value; the least have {least}."


def figure(dataset: xr.Dataset, y: str, x: str = "", hue: str = "", **where: Any) -> Axes:
    """Draw a number of a dataset over its axes, with its ±: lines, a map of tiles, or points, as `nanoslip figure` does.

    y: a variable, its symbol, or a ratio of two, as `plateau/mu_i`. x, hue: axes; others become panels. where: selected values.
    Returns the axes of matplotlib, known to pyplot (the first of several panels). Raises UnknownNameError.

    >>> import nanoslip
    >>> data = nanoslip.open("results/mine")  # doctest: +SKIP
    >>> axes = nanoslip.figure(data, "plateau/mu_i", hue="R", normal_load=1e-3)  # doctest: +SKIP
    """
    from matplotlib import pyplot  # noqa: PLC0415  a page is drawn without windows

    if not isinstance(dataset, xr.Dataset):
        raise TypeError(f"dataset = {dataset!r}: needs a dataset, as nanoslip.open returns it")

    view = view_named(dataset, y, x, hue, where)
    drawn = resize_figure(view.draw(make=pyplot.figure))
    first: Axes = drawn.axes[0]
    return first


def view_named(dataset: xr.Dataset, y: str, x: str, hue: str, where: Mapping[str, Any]) -> View:
    """The view of a number over axes, by the words that people have for them. Raises UnknownNameError, ValueError."""
    points = points_named(dataset, y, where, in_units=True)
    points = convert_axes_to_si(points, dataset, (x, hue))
    x_axis = axis_named(points, dataset, x) if x else ""
    hue_axis = axis_named(points, dataset, hue) if hue else ""
    return make_view(points, x_axis, hue_axis)
