"""Which slab the paper computed: its numbers over the load W/(G·L_x·L_y), which is also the slab's width at a load of 100 N."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, Final, NamedTuple

import numpy as np
import paper
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.arrays import Floats
from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import (
    DASHES,
    CampaignFigure,
    Claim,
    Number,
    campaign_scales,
    column,
    series_style,
    start_mean,
    start_statistics,
)

PRINTED_LOAD: Final = 100.0
"""W in N (§3.3)."""
PRINTED_VELOCITY: Final = 2e-3
"""V_o in m/s (§3.3)."""
READINGS: Final[Mapping[str, float]] = {"A": 1e-3, "B": 1e-4}
"""Reading -> its load: L_x = 1 mm as printed, and L_x = 1 cm, with which the printed R = 200 cm is the printed R/L_x = 200."""


class Row(NamedTuple):
    """A number of the paper, and where the dataset has it."""

    stated: paper.Stated
    variable: str
    friction: float
    scale: float = 1.0
    """Factor of the variable."""


ROWS: Final = (
    Row(paper.PLATEAU_SHARE, "plateau_mean", 0.5, 2.0),
    Row(paper.PLATEAU_SHARE, "plateau_mean", 0.25, 4.0),
    Row(paper.SLIPS, "slips", 0.5),
    Row(paper.RELEASES, "releases", 0.5),
    Row(paper.TOUCHES, "touches", 0.5),
    Row(paper.DISPLACEMENT_HALF, "final_displacement", 0.5),
    Row(paper.DISPLACEMENT_QUARTER, "final_displacement", 0.25),
    Row(paper.STATIC, "fitted_static_friction", 0.5),
    Row(paper.LATER_STATIC, "fitted_later_static_friction", 0.5),
    Row(paper.KINETIC, "fitted_kinetic_friction", 0.5),
    Row(paper.STICK_PHASES, "macroscopic_slips", 0.5),
    Row(paper.STICK_PHASES_QUARTER, "macroscopic_slips", 0.25),
    Row(paper.RESTICKS, "resticks", 0.5),
)


def width_of(dataset: xr.Dataset, load: float) -> float:
    """L_x in m of a slab on which `PRINTED_LOAD` is this load in G·L_x·L_y."""
    scales = campaign_scales(dataset)
    return PRINTED_LOAD / (scales.shear_modulus * scales.slab_depth * load)


def velocity_of(dataset: xr.Dataset, load: float) -> float:
    """V_o in m/s that is, in units of the dataset's slab, `PRINTED_VELOCITY` on the slab of this load."""
    return PRINTED_VELOCITY * campaign_scales(dataset).slab_width / width_of(dataset, load)


def of_load(dataset: xr.Dataset, load: float) -> xr.Dataset:
    """The cases of a load, each with its own drive: the printed one in units of that slab."""
    own = velocity_of(dataset, load)
    return dataset.sel(normal_load=load).sel(stage_velocity=own, method="nearest").squeeze()


def of_starts(dataset: xr.Dataset, row: Row, load: float, support: str = "bonded") -> Floats:
    """One of the paper's numbers, of every start, (m,)."""
    case = of_load(dataset, load).sel(intrinsic_friction=row.friction, support=support)
    return np.asarray(row.scale * case[row.variable].values, float).ravel()


def step_in_nanometres(dataset: xr.Dataset, load: float, support: str = "bonded") -> Floats:
    """Mean step per event of every start, (m,), on the slab of this reading."""
    return 1e9 * width_of(dataset, load) * of_starts(dataset, Row(paper.STEP, "mean_step", 0.5), load, support)


def draw(dataset: xr.Dataset) -> Figure:
    """Plateau above, coefficients of Eq. 16-19 below, over the load, with the paper's values."""
    loads = dataset["normal_load"].values
    shown = (ROWS[:1], ROWS[7:10:2])
    with column(4.0) as figure:
        for axes, rows in zip(figure.subplots(2, 1, sharex=True), shown, strict=True):
            for number, row in enumerate(rows):
                axes.axhline(row.stated.value, color=series_style(number)["color"], linestyle=":")
                for dashes, support in zip(DASHES, dataset["support"].values.tolist(), strict=False):
                    values = [of_starts(dataset, row, load, support) for load in loads]
                    means, deviations = (
                        [np.nanmean(each) for each in values],
                        [np.nanstd(each, ddof=1) for each in values],
                    )
                    label = f"{row.stated.meaning}, {support}"
                    axes.errorbar(
                        loads, means, deviations, label=typeset(label), **series_style(number, linestyle=dashes)
                    )
            axes.set(xscale="log")
            axes.legend(fontsize=6)
        figure.axes[0].set_ylabel(typeset("plateau/μ_i"))
        figure.axes[1].set(xlabel=typeset("load W/(G·L_x·L_y)"), ylabel=typeset("coefficient of Eq. 16-19"))
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """What the paper prints beside both readings, as the slab is held by default and at its right side."""
    for support in dataset["support"].values.tolist():
        for row in ROWS:
            found = (start_statistics(of_starts(dataset, row, load, support)) for load in READINGS.values())
            label = (
                row.stated.meaning if "μ_i =" in row.stated.meaning else f"{row.stated.meaning}, μ_i = {row.friction:g}"
            )
            yield Claim(f"{support}: {label}", str(row.stated), *found)
        steps = (start_statistics(step_in_nanometres(dataset, load, support), 3) for load in READINGS.values())
        yield Claim(f"{support}: {paper.STEP.meaning}", str(paper.STEP), *steps)


def number(dataset: xr.Dataset, reading: str, row: Row) -> Number:
    """Mean of one of the paper's numbers over the starts of a reading, with its ±."""
    return start_mean(of_starts(dataset, row, READINGS[reading]))


def nearest_miss(dataset: xr.Dataset) -> Number:
    """Smallest over the loads of the larger relative miss of plateau and static friction, the slab held at its bottom."""
    rows = (ROWS[0], ROWS[7])
    misses = [
        max(abs(float(np.nanmean(of_starts(dataset, row, load))) / row.stated.value - 1.0) for row in rows)
        for load in dataset["normal_load"].values
    ]
    return Number(min(misses), 0.0)


NUMBERS: Final[Mapping[str, Any]] = {
    **{f"{reading}: plateau": partial(number, reading=reading, row=ROWS[0]) for reading in READINGS},
    **{f"{reading}: static friction": partial(number, reading=reading, row=ROWS[7]) for reading in READINGS},
    **{f"{reading}: kinetic friction": partial(number, reading=reading, row=ROWS[9]) for reading in READINGS},
    **{f"{reading}: re-sticks": partial(number, reading=reading, row=ROWS[12]) for reading in READINGS},
    **{f"{reading}: displacement": partial(number, reading=reading, row=ROWS[5]) for reading in READINGS},
    "nearest miss of any load": nearest_miss,
}
SCENE: Final = CampaignFigure(
    "scene",
    "Two readings of the paper's scene",
    "Plateau, and coefficients of Eq. 16-19, over the load: means over 16 starts, bars: standard deviation of single starts. "
    "Dotted: the paper. A is 1e-3, B is 1e-4.",
    draw,
    claims,
    ("", "the paper prints", "reading A: L_x = 1 mm, W = 1e-3 G·L_x·L_y", "reading B: L_x = 1 cm, W = 1e-4 G·L_x·L_y"),
)
