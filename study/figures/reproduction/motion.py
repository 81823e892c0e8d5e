"""Figures 10 and 11 (§3.3): motion of the driven pin, and the friction force that it meets, with the bursts during stick."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.study.figures import shared as paper
from nanoslip.study.figures.reproduction.drive import fitted, run_of, slip_times
from nanoslip.study.figures.reproduction.records import every_start
from nanoslip.study.figures.reproduction.stick import LEAST_DROP, Stick, stick_of
from nanoslip.study.figures.shared import COLORS, CampaignFigure, Claim, column, compared, over_starts, register


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
    yield compared(paper.FIRST_SLIP, first, digits=3, scale=1e3)
    yield compared(paper.RESTICKS, every_start(dataset, "resticks"), _RESTICKS)
    last = [
        float(run_of(dataset, 0.5, float(begin))["sample_velocity"].values[-200:].mean())
        for begin in dataset["start"].values
    ]
    yield compared(paper.FINAL_VELOCITY, np.array(last), "that of the stage", scale=1e3)
    micro = over_starts(every_start(dataset, "micro_slips"), 3)
    yield Claim("finding 1: slips while the pin is stuck", "many (§4)", micro, "that end before the presliding length")


_RESTICKS = "counted where the pin comes to rest; it takes a later peak as high as the paper's 0.272 to stop it twice"


def claims_of_friction(dataset: xr.Dataset) -> Iterator[Claim]:
    """Claims of §3.3 on the friction force itself."""
    sticks = [stick_of(dataset, float(begin)) for begin in dataset["start"].values]
    mass, damping = float(dataset["pin_mass"]), float(dataset["damping_ratio"])
    expected = 1e3 * float(np.sqrt(mass / float(dataset["spring_stiffness"]))) / damping
    why = f"time to 1/e; the damper alone gives 2m/c = {expected:.3g}"
    decay = np.array([stick.decay_time for stick in sticks])
    yield compared(paper.RINGING, decay, why, digits=3, scale=1e3)
    bursts = np.array([float(len(stick.bursts)) for stick in sticks])
    remark = f"falls of F/W by {LEAST_DROP:g} or more at once"
    yield Claim("bursts during the first stick phase", "intermittent (§3.3)", over_starts(bursts, 3), remark)
    rough = np.array([_fluctuation(dataset, float(begin)) for begin in dataset["start"].values])
    meaning = "finding 2: standard deviation of F/W while sliding"
    yield Claim(meaning, "high-frequency fluctuations (§4)", over_starts(rough, 2), "over the last tenth of the drive")


def _fluctuation(dataset: xr.Dataset, begin: float) -> float:
    force = run_of(dataset, 0.5, begin)["sample_friction"].values
    return float(np.std(force[-len(force) // 10 :]))


register(
    CampaignFigure(
        "fig10",
        "figures/drive",
        "Figure 10: motion of the pin",
        "Position and velocity at μ_i = 0.5; dashed: Eq. 16-19 as in Figure 9. Below: the velocity until the first "
        "macroscopic slip; ticks: bursts.",
        draw_motion,
        claims_of_motion,
    )
)
register(
    CampaignFigure(
        "fig11",
        "figures/drive",
        "Figure 11: instantaneous friction force",
        "Friction force at μ_i = 0.5. Below: its difference from the spring force until the first "
        "macroscopic slip; ticks: bursts.",
        draw_friction,
        claims_of_friction,
    )
)
