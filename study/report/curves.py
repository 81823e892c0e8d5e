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
    """The lines that a case has: F/W over δ_p; of a single drive the spring force over time; p over x without either.

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
        yield _curve(see.trajectory(), "time", "sample_spring_force")


def inertial_range(case: xr.Dataset) -> tuple[float, float, float] | None:
    """The least and largest spring force over load of a drive, and what its contact holds, where inertia goes beyond it."""
    holds = float(case.get("peak_friction", np.nan))
    if not _has(case, "trajectory", "sample"):
        return None
    force = Accessor(case).trajectory()["sample_spring_force"]
    least, most = float(force.min()), float(force.max())
    return (least, most, holds) if max(most - holds, -least) > INERTIAL * holds else None


def _has(case: xr.Dataset, group: str, sample: str) -> bool:
    """True if a case has a run in a group, with values along a sample dimension."""
    name = f"{group}_id"
    own = name in case and not case[name].dims and bool(case[name].item())
    return own and group in read_groups(case) and sample in read_groups(case)[group].dims


def _curve(run: xr.Dataset, x: str, y: str) -> DrawnLine:
    return DrawnLine(run[x].values, run[y].values, _label(run[x].attrs), _label(run[y].attrs))


def _label(attributes: dict[Any, Any]) -> str:
    """Meaning of a variable, with its symbol and a unit that is not 1."""
    unit = attributes.get("units", "1")
    parts = [attributes["long_name"], attributes.get("symbol", ""), "" if unit == "1" else f"in {unit}"]
    return ", ".join(part for part in parts if part)


# A line drawn in text: dots of braille letters, two across and four down in each, with the ends of both axes.

WIDTH, HEIGHT = 60, 12
"""Letters across and down that the line may take."""
MARGIN: Final = 13
"""Letters that the ends of the upward axis take at most."""
_BLANK: Final = 0x2800
_DOTS: Final = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
"""Bit of each dot of a braille letter: rows from the top, columns from the left."""


def text_plot(x: ArrayLike, y: ArrayLike, labels: tuple[str, str], width: int = WIDTH, height: int = HEIGHT) -> str:
    """A line through points as lines of text; empty if fewer than two points are finite.

    x: (points,), which may turn, as in loops. y: (points,). labels: of x and y, with units. width, height: in
    letters, without axes.
    """
    points = np.stack((np.asarray(x, float), np.asarray(y, float)))
    across, up = points[:, np.isfinite(points).all(axis=0)]
    if len(across) < 2 or np.ptp(across) == 0.0:
        return ""
    none = float(np.ptp(up)) / (8 * height)  # half a dot: what is drawn at 0 is written as 0
    ends = [f"{value if abs(value) > none else 0.0:.4g}" for value in (up.max(), up.min())]
    margin = max(map(len, ends))
    rows = _letters(_dots(across, up, 2 * width, 4 * height))
    left = [ends[0], *[""] * (height - 2), ends[1]]
    framed = [f"{end:>{margin}} ┤{row}" for end, row in zip(left, rows, strict=True)]
    first, last = f"{across.min():.4g}", f"{across.max():.4g}"
    between = labels[0].center(max(width - len(first) - len(last), 0))
    return "\n".join([f"{'':{margin}}  {labels[1]}", *framed, f"{'':{margin}}  {first}{between}{last}"])


def _dots(x: NDArray[np.float64], y: NDArray[np.float64], across: int, down: int) -> NDArray[np.bool_]:
    """Mask of the dots that the line passes, (down, across) from the top left: it is followed in steps of half a dot."""
    height = np.ptp(y)
    column = (x - x.min()) / np.ptp(x) * (across - 1)
    row = (y.max() - y) / height * (down - 1) if height > 0.0 else np.full(len(y), 0.5 * (down - 1))
    way = np.concatenate(([0.0], np.cumsum(np.maximum(abs(np.diff(column)), abs(np.diff(row))))))
    steps = np.append(np.arange(0.0, way[-1], 0.5), way)
    dots = np.zeros((down, across), np.bool_)
    dots[tuple(np.interp(steps, way, each).round().astype(int) for each in (row, column))] = True
    return dots


def _letters(dots: NDArray[np.bool_]) -> list[str]:
    """Lines of braille letters that show dots, (4 · lines, 2 · letters)."""
    down, across = dots.shape
    cells = dots.reshape(down // 4, 4, across // 2, 2)
    codes = _BLANK + np.einsum("iajb,ab->ij", cells, _DOTS)
    return ["".join(map(chr, line)) for line in codes.tolist()]


def print_lines(lines: Iterable[DrawnLine]) -> None:
    """Plot lines in text, as wide as there is room."""
    width = min(WIDTH, console().width - MARGIN)
    for line in lines:
        click.echo(text_plot(line.x, line.y, (line.x_label, line.y_label), width))
