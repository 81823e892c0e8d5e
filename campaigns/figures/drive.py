"""Figure 9 (§3.3): the spring force of the driven pin, beside the closed form of Eq. 16-19."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import paper
import xarray as xr
from matplotlib.figure import Figure
from records import every_start

from nanoslip.solver.arrays import Floats
from nanoslip.study.dataset.access import Accessor
from nanoslip.study.figures.shared import (
    COEFFICIENTS,
    COLORS,
    CampaignFigure,
    Claim,
    ClosedForm,
    analytic_motion as closed_form_of,
    campaign_scales,
    column,
    start_statistics,
)


def run_of(dataset: xr.Dataset, intrinsic_friction: float = 0.5, begin: float = 0.0) -> xr.Dataset:
    """The trajectory and the macroscopic slips of one start."""
    return Accessor(dataset).trajectory(intrinsic_friction=intrinsic_friction, start=begin)


def closed_form(
    dataset: xr.Dataset, kinetic: float, static: float, later_static: float, samples: int = 4000
) -> ClosedForm:
    """The motion that Eq. 16-19 give for the dataset's drive with these coefficients."""
    time = np.linspace(0.0, float(dataset["duration"]), samples + 1)
    return closed_form_of(dataset, campaign_scales(dataset), time, kinetic, static, later_static)


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
        yield paper.compared(stated, every_start(dataset, name), why, meaning)
    missed = start_statistics(every_start(dataset, "fit_residual"), 2)
    yield Claim("misfit of Eq. 16-19, rms, over W", "agrees remarkably well (§3.3)", missed)
    first, second = slip_times(dataset)
    yield paper.compared(paper.FIRST_SLIP, first, digits=3, scale=1e3)
    yield paper.compared(paper.LATER_SLIP, second, _SECOND, digits=3, scale=1e3)
    for stated, friction in ((paper.STICK_PHASES, 0.5), (paper.STICK_PHASES_QUARTER, 0.25)):
        yield paper.compared(
            stated, every_start(dataset, "macroscopic_slips", friction), "each ends in a macroscopic slip"
        )
    yield paper.compared(paper.DAMPER, np.array([damper_force(dataset) * load_of(dataset)]), "c·V_o", digits=3)


_STATIC = "the paper's value is one sample of this distribution"
_LATER = "a later peak, lower than the first, as in the paper"
_KINETIC = "the mean of the plateau"
_SECOND = "follows from μ_s of both slips"


def damper_force(dataset: xr.Dataset) -> float:
    """c·V_o over W: what the damper exerts on a pin at rest."""
    mass, stiffness = float(dataset["pin_mass"]), float(dataset["spring_stiffness"])
    damping = 2.0 * float(dataset["damping_ratio"]) * float(np.sqrt(mass * stiffness))
    return damping * float(dataset["stage_velocity"]) / load_of(dataset)


def load_of(dataset: xr.Dataset) -> float:
    """W in N."""
    return float(dataset["normal_load"]) * campaign_scales(dataset).force


def slip_times(dataset: xr.Dataset, intrinsic_friction: float = 0.5) -> tuple[Floats, Floats]:
    """Start of the first and of the second macroscopic slip of every start, in s, (m,) each; NaN where there is none."""
    times = np.full((2, dataset.sizes["start"]), np.nan)
    for place, begin in enumerate(dataset["start"].values):
        starts = run_of(dataset, intrinsic_friction, float(begin))["slip_phase_start"].values[:2]
        times[: len(starts), place] = starts
    return times[0], times[1]


FIG9: Final = CampaignFigure(
    "fig9",
    "Figure 9: spring force against time",
    "Spring force of the driven pin, both intrinsic frictions; dashed: Eq. 16-19 with the coefficients that fit it best; "
    "dotted: with those of the paper.",
    draw,
    claims,
)


# What a pin does while it is stuck (§3.3): bursts of vibration that small slips set off, and the decay of the first one.
#
# The pin at x meets F = K(x - x_R), and each slip moves the relaxation point x_R forward at once. So x - F/K is a staircase
# between whose steps nothing slips.

LEAST_DROP = 1e-4
"""Fall of F/W at once that counts as the start of a burst: a twentieth of the first vibration of the paper's drive."""
WINDOW = 2e-3
"""Stretch of time over which a vibration's strength is taken, in s: about three periods of the stuck pin."""
RINGING = 20e-3
"""Time over which the first vibration is followed, in s."""


@dataclass(frozen=True, slots=True, eq=False)
class Stick:
    """The first stick phase of one drive."""

    end: float
    """Start of the first macroscopic slip, in s; the drive's duration where there is none."""
    bursts: Floats
    """Times at which the friction force falls at once by `LEAST_DROP` or more, in s."""
    decay_time: float
    """Time in which the first vibration falls to 1/e, in s."""


def stick_of(dataset: xr.Dataset, begin: float, intrinsic_friction: float = 0.5) -> Stick:
    """Read the first stick phase off a trajectory; its samples need to resolve the vibration of the stuck pin."""
    run = run_of(dataset, intrinsic_friction, begin)
    time, force = run["time"].values, run["sample_friction"].values
    case = dataset.sel(intrinsic_friction=intrinsic_friction, start=begin)
    stretch = force * load_of(dataset) / float(case["surface_stiffness_si"].squeeze())
    drops = np.diff(run["sample_position"].values - stretch) / stretch.max() * force.max()
    starts = run["slip_phase_start"].values
    end = float(starts[0]) if len(starts) else float(time[-1])
    bursts = time[1:][(drops >= LEAST_DROP) & (time[1:] < end)]
    return Stick(end, bursts, decay_time(time, force))


def decay_time(time: Floats, force: Floats) -> float:
    """1/e time of the vibration of a force about its rise at a drive's start: a line through the logarithms of its strength.

    time, force: (n,) from the start on, at least `RINGING` long.
    """
    count = int(np.searchsorted(time, WINDOW))
    windows = [slice(begin, begin + count) for begin in range(0, int(np.searchsorted(time, RINGING)), count)]
    strength = [_strength(time[window], force[window]) for window in windows]
    middles = [float(time[window].mean()) for window in windows]
    return -1.0 / float(np.polyfit(middles, np.log(strength), 1)[0])


def _strength(time: Floats, force: Floats) -> float:
    """Root mean square of a force about its line."""
    return float(np.std(force - np.polyval(np.polyfit(time, force, 1), time)))


# Figures 10 and 11 (§3.3): motion of the driven pin, and the friction force that it meets, with the bursts during stick.


def draw_motion(dataset: xr.Dataset) -> Figure:
    """Position and velocity of the pin at μ_i = 0.5 with the fitted closed form, and the velocity of the stuck pin alone."""
    run, model, stick = run_of(dataset), fitted(dataset), stick_of(dataset, 0)
    time = 1e3 * run["time"].values
    with column(4.4) as figure:
        position, velocity, stuck = figure.subplots(3, 1)
        for axes, name, closed, scale in (
            (position, "sample_position", model.position, 1e6),
            (velocity, "sample_velocity", model.velocity, 1e3),
        ):
            axes.plot(time, scale * run[name], linewidth=0.5, label="simulated")
            axes.plot(1e3 * model.time, scale * closed, "--", color="black", linewidth=0.6, label="Eq. 16-19, fitted")
        before = time < 1e3 * stick.end
        stuck.plot(time[before], 1e6 * run["sample_velocity"].values[before], linewidth=0.3)
        _mark(stuck, stick)
        position.legend(loc="upper left")
        position.set_ylabel("position (μm)")
        velocity.set_ylabel("velocity (mm/s)")
        stuck.set(xlabel="time (ms)", ylabel="of the stuck pin (μm/s)")
    return figure


def draw_friction(dataset: xr.Dataset) -> Figure:
    """Friction force on the pin at μ_i = 0.5, and what it has beyond the spring force while the pin is stuck."""
    run, stick = run_of(dataset), stick_of(dataset, 0)
    time, force = 1e3 * run["time"].values, run["sample_friction"].values
    beyond = force - run["sample_spring_force"].values
    before = time < 1e3 * stick.end
    with column(3.4) as figure:
        whole, stuck = figure.subplots(2, 1)
        whole.plot(time, force, linewidth=0.3)
        stuck.plot(time[before], 1e3 * beyond[before], linewidth=0.3)
        _mark(stuck, stick)
        whole.set_ylabel("friction force $F/W$")
        stuck.set(xlabel="time (ms)", ylabel="less spring force ($10^{-3} W$)")
    return figure


def _mark(axes: Any, stick: Stick) -> None:
    """Ticks at the bottom of the axes where a burst begins."""
    axes.plot(
        1e3 * stick.bursts,
        np.zeros_like(stick.bursts),
        "|",
        color=COLORS[1],
        markersize=6,
        clip_on=False,
        transform=axes.get_xaxis_transform(),
    )


def claims_of_motion(dataset: xr.Dataset) -> Iterator[Claim]:
    """Claims of §3.3 on position and velocity."""
    first, _ = slip_times(dataset)
    yield paper.compared(paper.FIRST_SLIP, first, digits=3, scale=1e3)
    yield paper.compared(paper.RESTICKS, every_start(dataset, "resticks"), _RESTICKS)
    last = [
        float(run_of(dataset, 0.5, float(begin))["sample_velocity"].values[-200:].mean())
        for begin in dataset["start"].values
    ]
    yield paper.compared(paper.FINAL_VELOCITY, np.array(last), "that of the stage", scale=1e3)
    micro = start_statistics(every_start(dataset, "micro_slips"), 3)
    yield Claim("finding 1: slips while the pin is stuck", "many (§4)", micro, "that end before the presliding length")


_RESTICKS = "counted where the pin comes to rest; it takes a later peak as high as the paper's 0.272 to stop it twice"


def claims_of_friction(dataset: xr.Dataset) -> Iterator[Claim]:
    """Claims of §3.3 on the friction force itself."""
    sticks = [stick_of(dataset, float(begin)) for begin in dataset["start"].values]
    mass, damping = float(dataset["pin_mass"]), float(dataset["damping_ratio"])
    expected = 1e3 * float(np.sqrt(mass / float(dataset["spring_stiffness"]))) / damping
    why = f"time to 1/e; the damper alone gives 2m/c = {expected:.3g}"
    decay = np.array([stick.decay_time for stick in sticks])
    yield paper.compared(paper.RINGING, decay, why, digits=3, scale=1e3)
    bursts = np.array([float(len(stick.bursts)) for stick in sticks])
    remark = f"falls of F/W by {LEAST_DROP:g} or more at once"
    yield Claim("bursts during the first stick phase", "intermittent (§3.3)", start_statistics(bursts, 3), remark)
    rough = np.array([_fluctuation(dataset, float(begin)) for begin in dataset["start"].values])
    meaning = "finding 2: standard deviation of F/W while sliding"
    yield Claim(
        meaning, "high-frequency fluctuations (§4)", start_statistics(rough, 2), "over the last tenth of the drive"
    )


def _fluctuation(dataset: xr.Dataset, begin: float) -> float:
    force = run_of(dataset, 0.5, begin)["sample_friction"].values
    return float(np.std(force[-len(force) // 10 :]))


FIG10: Final = CampaignFigure(
    "fig10",
    "Figure 10: motion of the pin",
    "Position and velocity at μ_i = 0.5; dashed: Eq. 16-19 as in Figure 9. Below: the velocity until the first "
    "macroscopic slip; ticks: bursts.",
    draw_motion,
    claims_of_motion,
)
FIG11: Final = CampaignFigure(
    "fig11",
    "Figure 11: instantaneous friction force",
    "Friction force at μ_i = 0.5. Below: its difference from the spring force until the first "
    "macroscopic slip; ticks: bursts.",
    draw_friction,
    claims_of_friction,
)
