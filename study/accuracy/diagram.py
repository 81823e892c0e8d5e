"""Work-precision diagram: error against processor time of every setting, its Pareto front, as a table and a picture."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.view import with_error
from nanoslip.study.figures.shared import column, image, series_styles
from nanoslip.study.manifest.parameters import Value, table_words
from nanoslip.study.measured.columns import rows_as_csv
from nanoslip.study.report.console import Table

Row = Mapping[str, Value]


@dataclass(frozen=True, slots=True)
class Diagram:
    """Table of results over one setting or several; every row has the same columns."""

    title: str
    reference: str
    """Reference of the errors."""
    series: str
    """Column whose values distinguish curves of a diagram."""
    shown: tuple[str, ...]
    """Columns of its table; an uncertainty is shown with its value."""
    error: str
    """Column of the error in the diagram."""
    rivals: bool
    """True if rows of different series compete; series that answer different questions have a front each."""
    rows: tuple[Row, ...]

    @property
    def file(self) -> str:
        """Name of its table."""
        return f"{self.title.lower().replace(' ', '_')}.csv"

    @property
    def on_front(self) -> NDArray[np.bool_]:
        """Mask of the rows that no rival beats in time and error."""
        time, error = self.column("seconds"), self.column(self.error)
        series = self.column(self.series)
        if self.rivals:
            return pareto_front(time, error)
        marked = np.zeros(len(self.rows), dtype=np.bool_)
        for name in dict.fromkeys(series.tolist()):
            mine = series == name
            marked[mine] = pareto_front(time[mine], error[mine])
        return marked

    def column(self, name: str) -> NDArray[np.generic]:
        """One column, shape (rows,)."""
        return np.array([row[name] for row in self.rows])


def pareto_front(time: ArrayLike, error: ArrayLike) -> NDArray[np.bool_]:
    """Mask of the Pareto-optimal points: no other point is at least as fast and at least as accurate, and better in one.

    time, error: shape (points,). Of equal points only the first is marked. A point without time or error (NaN) is not.
    """
    times = np.asarray(time, float)
    errors = np.asarray(error, float)
    is_unknown = np.isnan(times + errors)
    sure_errors = np.where(is_unknown, np.inf, errors)
    # In rising time a point is on the front if its error is below all errors before it.
    order = np.lexsort((sure_errors, times))
    in_order = np.append(np.inf, sure_errors[order])
    best = np.minimum.accumulate(in_order)
    on_front = np.zeros(times.shape, dtype=np.bool_)
    on_front[order] = best[1:] < best[:-1]
    return on_front


FRONT_MARK = "*"


def as_table(diagram: Diagram) -> Table:
    """All rows of a diagram, a value and its uncertainty in one cell; the rows on the front are marked."""
    # Their values stay as they are written.
    keys = table_words("numerics")
    header = [name if name in keys else name.replace("_", " ") for name in diagram.shown]
    rows = []
    for row, is_on_front in zip(diagram.rows, diagram.on_front, strict=True):
        cells = [_cell(row[name], row.get(f"{name}_uncertainty")) for name in diagram.shown]
        rows.append((*cells, FRONT_MARK if is_on_front else ""))
    return Table((*header, "front"), tuple(rows))


def diagram_csv(diagram: Diagram) -> str:
    """The table of a diagram."""
    table = as_table(diagram)
    return rows_as_csv((table.header, *table.rows))


def _cell(value: Value, uncertainty: Value | None) -> str:
    if not isinstance(value, float):
        return str(value)
    if math.isnan(value):
        return "–"
    if isinstance(uncertainty, float) and math.isfinite(uncertainty):
        return with_error(value, uncertainty)
    return f"{value:.3g}"


SERIES: Final = {
    ("Elastic operator", "galerkin"): "elastic grid, n_x and rows",
    ("Elastic operator", "strip"): "elastic grid, n_x",
    ("Elastic operator", "half_plane"): "elastic grid, n_x",
    ("Elastic operator", "half_space"): "elastic grid, n_x",
    ("Records", "members"): "members, of 8 presliding lengths",
    ("Records", "presliding"): "presliding lengths, of 8 members",
    ("Records", "dimension"): "plane strain for a ball",
    ("Dynamics", "rk4"): "time steps of RK4",
    ("Dynamics", "exact"): "exact integrator",
}
"""Diagram and series that have an error, not another scene, -> label in the picture."""


def _front_lines(diagram: Diagram) -> dict[str, tuple[Floats, Floats]]:
    """Label of each series with an error -> times and errors of its front, in rising time."""
    time = diagram.column("seconds").astype(float)
    error = diagram.column(diagram.error).astype(float)
    series = diagram.column(diagram.series)
    lines = {}
    for name in dict.fromkeys(series.tolist()):
        label = SERIES.get((diagram.title, str(name)))
        if label:
            mine = np.flatnonzero(series == name)
            best = mine[pareto_front(time[mine], error[mine])]
            best = best[np.argsort(time[best])]
            lines[label] = time[best], error[best]
    return lines


def draw_fronts(diagrams: Sequence[Diagram]) -> bytes:
    """The front of each series of all diagrams on the same axes, as PNG; points without an error are at the lower
    edge."""
    with column(3.9) as figure:
        axes = figure.add_subplot()
        lines: dict[str, tuple[Floats, Floats]] = {}
        for diagram in diagrams:
            lines |= _front_lines(diagram)
        errors = np.concatenate([error for _, error in lines.values()])
        # An error of zero has no place on a logarithmic axis: it is drawn a third of the least one below all others.
        floor = 0.3 * errors[errors > 0.0].min(initial=np.inf)
        for label, look in zip(lines, series_styles(), strict=False):
            time, error = lines[label]
            axes.loglog(time, np.maximum(error, floor), label=label, markersize=4, **look)
        axes.axhline(floor, color="grey", linewidth=0.6, linestyle=":", label="reference")
        axes.set(xlabel="processor time (s)", ylabel="relative error")
        figure.legend(loc="outside lower left")
        return image(figure, "png")
