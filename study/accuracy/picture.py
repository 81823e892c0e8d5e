"""Work-precision measurement: error against processor time, one panel a diagram, the Pareto front as a line."""

import io
import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from nanoslip.study.accuracy.diagram import Diagram
from nanoslip.study.accuracy.digit import BY_LENGTH, BY_MEMBERS, DIGIT, OBSERVABLES
from nanoslip.study.figures.shared.canvas import COLORS, PAGE, column, image
from nanoslip.study.manifest.manifest import MEMBERS

MARKERS: Final = "osD^vP"


def draw(diagrams: Sequence[Diagram]) -> bytes:
    """All diagrams side by side, as PNG."""
    figure = Figure(figsize=(5.2 * len(diagrams), 4.4), layout="constrained")
    canvas = FigureCanvasAgg(figure)
    for axes, diagram in zip(np.atleast_1d(figure.subplots(1, len(diagrams))), diagrams, strict=True):
        _draw(axes, diagram)
    buffer = io.BytesIO()
    canvas.print_figure(buffer, dpi=110, format="png", metadata={"Software": None})
    return buffer.getvalue()


def _draw(axes: Any, diagram: Diagram) -> None:
    """A panel. What the errors are held against has none: it stands on the lower edge."""
    time, error = (diagram.column(name).astype(float) for name in ("seconds", diagram.error))
    series = diagram.column(diagram.series)
    floor = 0.3 * np.nanmin(error[error > 0.0], initial=np.inf)
    shown = np.where(error == 0.0, floor, error)
    for marker, name in zip(MARKERS, dict.fromkeys(series.tolist()), strict=False):
        mine = series == name
        axes.loglog(time[mine], shown[mine], marker, label=str(name), markersize=5, alpha=0.8)
    for number, rivals in enumerate(diagram.groups):
        best = np.flatnonzero(diagram.on_front & rivals)
        best = best[np.argsort(time[best])]
        label = "Pareto front" if number == 0 else None
        axes.step(time[best], shown[best], where="post", color="black", linewidth=0.9, label=label)
    if (error == 0.0).any():
        axes.axhline(floor, color="grey", linewidth=0.6, linestyle=":", label="reference (no error by definition)")
    axes.set(
        title=diagram.title, xlabel="processor time (s)", ylabel=f"relative error: {diagram.error.replace('_', ' ')}"
    )
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)


def draw_digit(diagrams: Sequence[Diagram]) -> bytes:
    """A panel for each observable, as PNG: members joined by lines, lengths of records by dashed ones.

    A dotted line is the law of independent members: a hundred times the seconds, a tenth of the error.
    """
    rows = diagrams[-1].rows
    cases = list(dict.fromkeys(row["case"] for row in rows))
    with column(2.9, PAGE) as figure:
        panels = figure.subplots(1, len(OBSERVABLES), sharex=True, sharey=True)
        for axes, (name, title) in zip(panels, OBSERVABLES.items(), strict=True):
            for case, color in zip(cases, COLORS, strict=False):
                for way, style in ((BY_MEMBERS, "o-"), (BY_LENGTH, "s--")):
                    mine = [row for row in rows if (row["case"], row["way"]) == (case, way)]
                    points = np.array([(row["seconds"], row[name]) for row in mine], float).T
                    hollow = {} if way == BY_MEMBERS else {"markerfacecolor": "white"}
                    axes.loglog(*points, style, color=color, markersize=3.5, label=f"{case}: {way}", **hollow)
                    for row in mine if way == BY_MEMBERS else ():
                        time, error = float(row["seconds"]), float(row[name])
                        if row["members"] == MEMBERS and error > 0.0:
                            law = (time, error), (DIGIT * time, error / math.sqrt(DIGIT))
                            axes.axline(*law, color="grey", linestyle=":", zorder=0.5)
            axes.set(title=title, xlabel="core seconds")
        panels[0].set_ylabel("relative error of the mean")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(cases))
        return image(figure, "png")
