"""Lines to draw for a case (friction record, spring force, contact pressure), and text plots."""

from collections.abc import Iterable, Iterator
from typing import Any, Final, NamedTuple

import click
import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from nanoslip.solver.dynamics.coefficients import INERTIAL
from nanoslip.study.dataset.access import Accessor
from nanoslip.study.dataset.file import read_groups
from nanoslip.study.report.console import console


class DrawnLine(NamedTuple):
    """A line: values over places, with labels of both."""

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    x_label: str
    y_label: str


def curves(case: xr.Dataset) -> Iterator[DrawnLine]:
    """The lines that a case has: F/W over δ_p; p over x without sliding; of a single drive the spring force over time.

    If the stage goes to and fro, the spring force is over its place.

    case: of nanoslip.study.dataset.access, one member of an ensemble.
    """
    see = Accessor(case)
    if _has(case, "record", "event"):
        yield _curve(see.teeth(), "displacement", "friction_force")
    elif _has(case, "path", "path_point"):
        yield _curve(see.path(), "path_displacement", "path_friction")
    elif _has(case, "contact", "contact_node"):
        last = see.row().isel(event=-1, missing_dims="ignore")
        yield _curve(last, "x", "pressure")
    if _has(case, "trajectory", "sample"):
        pulled = see.trajectory()
        against = "sample_stage" if _goes_to_and_fro(pulled) else "time"
        yield _curve(pulled, against, "sample_spring_force")


def _goes_to_and_fro(pulled: xr.Dataset) -> bool:
    """True if a run of the group trajectory has legs."""
    return bool(pulled.sizes.get("stage_leg"))


def inertial_range(case: xr.Dataset) -> tuple[float, float, float] | None:
    """The least and largest spring force over load of a drive, and what its contact holds, where inertia goes beyond it."""
    holds = float(case.get("peak_friction", np.nan))
    if not _has(case, "trajectory", "sample"):
        return None
    pulled = Accessor(case).trajectory()
    force = pulled["sample_spring_force"]
    least = float(force.min())
    most = float(force.max())
    # Friction on a stage that goes to and fro has either sign.
    lowest = -holds if _goes_to_and_fro(pulled) else 0.0
    excess = max(most - holds, lowest - least)
    return (least, most, holds) if excess > INERTIAL * holds else None


def _has(case: xr.Dataset, group: str, sample: str) -> bool:
    """True if a case has a run in a group, with values along a sample dimension."""
    name = f"{group}_id"
    if name not in case or case[name].dims or not case[name].item():
        return False
    groups = read_groups(case)
    return group in groups and sample in groups[group].dims


def _curve(run: xr.Dataset, x: str, y: str) -> DrawnLine:
    across, up = run[x], run[y]
    return DrawnLine(across.values, up.values, _label(across.attrs), _label(up.attrs))


def _label(attributes: dict[Any, Any]) -> str:
    """Meaning of a variable, with its symbol and a unit that is not 1."""
    unit = attributes.get("units", "1")
    unit_part = "" if unit == "1" else f"in {unit}"
    parts = [attributes["long_name"], attributes.get("symbol", ""), unit_part]
    return ", ".join(filter(None, parts))


# A line drawn in text: dots of braille letters, two across and four down in each, with the ends of both axes.

WIDTH, HEIGHT = 60, 12
"""Letters across and down that the line may take."""
MARGIN: Final = 13
"""Letters that the ends of the upward axis take at most."""
_BLANK: Final = 0x2800
# Dots 1 to 6 came first and run down the columns; Unicode has the fourth row, dots 7 and 8, in the two highest bits.
_DOTS: Final = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
"""Bit of each dot of a braille letter: rows from the top, columns from the left."""


def text_plot(x: ArrayLike, y: ArrayLike, labels: tuple[str, str], width: int = WIDTH, height: int = HEIGHT) -> str:
    """A line through points as lines of text; empty if fewer than two points are finite.

    x: (points,), which may turn, as in loops. y: (points,). labels: of x and y, with units. width, height: in
    letters, without axes.
    """
    pair = (np.asarray(x, float), np.asarray(y, float))
    points = np.stack(pair)
    finite = np.isfinite(points).all(axis=0)
    across, up = points[:, finite]
    # A point or an upright line has no extent that could be scaled to the width.
    if len(across) < 2 or np.ptp(across) == 0.0:
        return ""
    # What is drawn at 0 is written as 0.
    half_dot = float(np.ptp(up)) / (8 * height)
    top = _end_text(up.max(), half_dot)
    bottom = _end_text(up.min(), half_dot)
    margin = max(len(top), len(bottom))
    rows = _letters(_dots(across, up, 2 * width, 4 * height))
    ends = [top, *[""] * (height - 2), bottom]
    framed = [f"{end:>{margin}} ┤{row}" for end, row in zip(ends, rows, strict=True)]
    lowest, right = f"{across.min():.4g}", f"{across.max():.4g}"
    room = max(width - len(lowest) - len(right), 0)
    between = labels[0].center(room)
    indent = " " * (margin + 2)
    return "\n".join([f"{indent}{labels[1]}", *framed, f"{indent}{lowest}{between}{right}"])


def _end_text(value: float, negligible: float) -> str:
    """The end of an axis as it is written: 0 if nobody sees the difference."""
    return f"{value if abs(value) > negligible else 0.0:.4g}"


def _dots(x: NDArray[np.float64], y: NDArray[np.float64], across: int, down: int) -> NDArray[np.bool_]:
    """Mask of the dots that the line passes, (down, across) from the top left: it is followed in steps of half a dot."""
    height = np.ptp(y)
    share = (x - x.min()) / np.ptp(x)
    column = share * (across - 1)
    # A level line lies in the middle.
    row = np.full(len(y), 0.5 * (down - 1))
    if height > 0.0:
        row = (y.max() - y) / height * (down - 1)
    # Where both coordinates change, the larger one decides: a step of half a dot then leaves no gap in either.
    changes = np.abs(np.diff((column, row)))
    lengths = changes.max(axis=0)
    way = np.concatenate(([0.0], np.cumsum(lengths)))
    # The points themselves are among the steps, so that no tip of a tooth falls between two of them.
    halves = np.arange(0.0, way[-1], 0.5)
    steps = np.append(halves, way)
    rows = np.interp(steps, way, row).round().astype(int)
    columns = np.interp(steps, way, column).round().astype(int)
    dots = np.zeros((down, across), np.bool_)
    dots[rows, columns] = True
    return dots


def _letters(dots: NDArray[np.bool_]) -> list[str]:
    """Lines of braille letters that show dots, (4 · lines, 2 · letters)."""
    down, across = dots.shape
    cells = dots.reshape(down // 4, 4, across // 2, 2)
    # The bits of its dots are the place of a letter in Unicode's block of braille patterns.
    codes = _BLANK + np.einsum("iajb,ab->ij", cells, _DOTS)
    lines = codes.tolist()
    return ["".join(map(chr, line)) for line in lines]


def print_lines(lines: Iterable[DrawnLine]) -> None:
    """Plot lines in text, as wide as there is room."""
    width = min(WIDTH, console().width - MARGIN)
    for line in lines:
        labels = (line.x_label, line.y_label)
        plot = text_plot(line.x, line.y, labels, width)
        click.echo(plot)
