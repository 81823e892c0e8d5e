"""Figure 9 (§3.3): the spring force of the driven pin, beside the closed form of Eq. 16-19."""

from collections.abc import Iterator

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from nanoslip.study.dataset.access import Accessor
from nanoslip.study.figures import shared as paper
from nanoslip.study.figures.reproduction.records import every_start
from nanoslip.study.figures.shared import (
    COEFFICIENTS,
    COLORS,
    CampaignFigure,
    Claim,
    ClosedForm,
    column,
    compared,
    over_starts,
    register,
    scales_in,
)
from nanoslip.study.figures.shared import closed_form as closed_form_of

Floats = NDArray[np.float64]


def run_of(dataset: xr.Dataset, intrinsic_friction: float = 0.5, begin: float = 0.0) -> xr.Dataset:
    """The trajectory and the macroscopic slips of one start."""
    return Accessor(dataset).trajectory(intrinsic_friction=intrinsic_friction, start=begin)


def closed_form(
    dataset: xr.Dataset, kinetic: float, static: float, later_static: float, samples: int = 4000
) -> ClosedForm:
    """The motion that Eq. 16-19 give for the dataset's drive with these coefficients."""
    time = np.linspace(0.0, float(dataset["duration"]), samples + 1)
    return closed_form_of(dataset, scales_in(dataset), time, kinetic, static, later_static)


def fitted(dataset: xr.Dataset, intrinsic_friction: float = 0.5, begin: float = 0.0) -> ClosedForm:
    """Eq. 16-19 with the coefficients that fit the spring force of one start best."""
    here = dataset.sel(intrinsic_friction=intrinsic_friction, start=begin)
    kinetic, static, later = (float(here[name].squeeze()) for name in COEFFICIENTS)
    return closed_form(dataset, kinetic, static, static if np.isnan(later) else later)


def draw(dataset: xr.Dataset) -> Figure:
    """The spring force of one start for both intrinsic frictions, with the fitted closed form on it."""
    with column() as figure:
        axes = figure.add_subplot()
        for color, friction in zip(COLORS, (0.5, 0.25), strict=False):
            run, model = run_of(dataset, friction), fitted(dataset, friction)
            label = f"$\\mu_i$ = {friction:g}"
            axes.plot(1e3 * run["time"], run["sample_spring_force"], color=color, label=label)
            label = "Eq. 16-19, fitted" if friction == 0.5 else ""
            axes.plot(1e3 * model.time, model.spring_force, "--", color="black", linewidth=0.6, label=label or None)
        stated = closed_form(dataset, paper.KINETIC.value, paper.STATIC.value, paper.LATER_STATIC.value)
        axes.plot(1e3 * stated.time, stated.spring_force, ":", color="0.5", label="Eq. 16-19, the paper's coefficients")
        axes.set(xlabel="time (ms)", ylabel="spring force over $W$", ylim=(0.0, None))
        axes.legend(loc="lower right")
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """The coefficients of §3.3, measured and fitted, over starts."""
    for stated, name, meaning, why in (
        (paper.STATIC, "static_friction", "μ_s, measured", _STATIC),
        (paper.STATIC, "fitted_static_friction", "μ_s of the first slip, fitted", _STATIC),
        (paper.LATER_STATIC, "fitted_later_static_friction", "μ_s of later slips, fitted", _LATER),
        (paper.KINETIC, "kinetic_friction", "μ_k, measured", _KINETIC),
        (paper.KINETIC, "fitted_kinetic_friction", "μ_k, fitted", _KINETIC),
    ):
        yield compared(stated, every_start(dataset, name), why, meaning)
    missed = over_starts(every_start(dataset, "fit_residual"), 2)
    yield Claim("misfit of Eq. 16-19, rms, over W", "agrees remarkably well (§3.3)", missed)
    first, second = slip_times(dataset)
    yield compared(paper.FIRST_SLIP, first, digits=3, scale=1e3)
    yield compared(paper.LATER_SLIP, second, _SECOND, digits=3, scale=1e3)
    for stated, friction in ((paper.STICK_PHASES, 0.5), (paper.STICK_PHASES_QUARTER, 0.25)):
        yield compared(stated, every_start(dataset, "macroscopic_slips", friction), "each ends in a macroscopic slip")
    yield compared(paper.DAMPER, np.array([damper_force(dataset) * load_of(dataset)]), "c·V_o", digits=3)


_STATIC = "one peak of one record: the paper's is one draw of this distribution"
_LATER = "the peak that the pin meets after it has stuck again; lower than the first, as in the paper"
_KINETIC = "the mean of the plateau"
_SECOND = "follows from μ_s of both slips"


def damper_force(dataset: xr.Dataset) -> float:
    """c·V_o over W: what the damper exerts on a pin at rest."""
    mass, stiffness = float(dataset["pin_mass"]), float(dataset["spring_stiffness"])
    damping = 2.0 * float(dataset["damping_ratio"]) * float(np.sqrt(mass * stiffness))
    return damping * float(dataset["stage_velocity"]) / load_of(dataset)


def load_of(dataset: xr.Dataset) -> float:
    """W in N."""
    return float(dataset["normal_load"]) * scales_in(dataset).force


def slip_times(dataset: xr.Dataset, intrinsic_friction: float = 0.5) -> tuple[Floats, Floats]:
    """Start of the first and of the second macroscopic slip of every start, in s, (m,) each; NaN where there is none."""
    times = np.full((2, dataset.sizes["start"]), np.nan)
    for place, begin in enumerate(dataset["start"].values):
        starts = run_of(dataset, intrinsic_friction, float(begin))["slip_phase_start"].values[:2]
        times[: len(starts), place] = starts
    return times[0], times[1]


register(
    CampaignFigure(
        "fig9",
        "figures/drive",
        "Figure 9: spring force against time",
        "Spring force of the driven pin, both intrinsic frictions; dashed: Eq. 16-19 with the coefficients that fit it best; "
        "dotted: with those of the paper.",
        draw,
        claims,
    )
)
