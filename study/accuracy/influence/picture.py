"""Error against time when effects are left out: one point for each way to choose them."""

from collections.abc import Sequence

import numpy as np

from study.accuracy.influence.judgement import EVERYTHING, THUMB, Trial
from study.accuracy.influence.verdict import change, seconds_of, ways
from study.figures.shared.canvas import COLORS, column, image

LEAST = 1e-4
"""A change that stands for all smaller ones."""


def draw(trials: Sequence[Trial]) -> bytes:
    """Median, and 95 %, of the changes over the scenes against the time of all, as PNG."""
    whole = seconds_of(trials, EVERYTHING)
    with column(height=2.8) as figure:
        axes = figure.add_subplot()
        for way in ways():
            changes = np.array([change(trial, way) for trial in trials])
            known = np.maximum(changes[~np.isnan(changes)], LEAST)
            if not len(known):
                continue
            time = seconds_of(trials, way) / whole
            color = COLORS[1] if way == THUMB else COLORS[0] if way.startswith("within") else COLORS[5]
            median, most = (float(np.quantile(known, share)) for share in (0.5, 0.95))
            axes.plot([time, time], [median, most], color=color)
            axes.plot([time], [most], "v", [time], [median], "o", color=color)
            axes.annotate(way, (time, most), xytext=(3, 3), textcoords="offset points", rotation=40, fontsize=6.0)
        axes.set(yscale="log", xlim=(0.0, 1.2), xlabel="time over that with everything on")
        axes.set_ylabel("relative change: median (●), 95 % (▼)")
        axes.margins(0.12)
        return image(figure, "png")
