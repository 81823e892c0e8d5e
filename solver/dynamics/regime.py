"""Whether a driven pin sticks, slides or does both in turn, from the macroscopic slips of its drive.

What the pin does at last counts: many a drive re-sticks once or twice while its first slip rings out, then slides for
good (§3.3). A slip that has not ended is called sliding once it has lasted longer than every cycle before it, from one
slip's start to the next one's. A motion that repeats itself never gets there: its slips are shorter than its cycles.

A stiff spring lets a slip relax before it gets macroscopic. Its pin then follows the stage in micro slips: it is told by the
spring force, which in the second half of the time does not rise by half of what it would if the pin were stuck.

Amplitude and period are those of the second half of the time, when the start has rung out, and are left out where that half
shows no whole cycle.
"""

import math
from dataclasses import dataclass, field
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from solver.drive import Drive
from solver.dynamics.integrate import DynamicsResult
from solver.quantity import quantity

Regime = Literal["sticks", "stick_slip", "slides", "micro_slip"]
"""No macroscopic slip; slips that end in stick; a last slip that goes on, longer than any cycle before it; no macroscopic
slip, but a pin that keeps up with the stage all the same."""
REGIMES: Final[tuple[Regime, ...]] = get_args(Regime)


@dataclass(frozen=True, slots=True)
class StickSlipCount:
    """How often and how long the pin of one drive stuck.

    resticks: macroscopic slips that ended, each where the pin came down to `stick_velocity`, or to rest.
    time_stuck: share of the drive's time outside macroscopic slips; the micro slips of a stuck pin count as stuck.
    spring_force_amplitude: in G·L_x·L_y, largest less least spring force in the second half of the time; NaN unless two
        macroscopic slips begin in it, one lasts all through it, or the pin follows in micro slips.
    stick_slip_period: mean time from one slip's start to the next one's there; NaN of a pin that slides or sticks.
    All but the counts are NaN, and regime None, of a run that ended early.
    """

    macroscopic_slips: int = field(metadata=quantity("slips longer than the presliding length"))
    resticks: int = field(
        metadata=quantity("macroscopic slips that ended", comment="the pin came down to stick_velocity")
    )
    time_stuck: float = field(
        metadata=quantity("share of the time that it stuck", comment="in which the pin was in no macroscopic slip")
    )
    regime: Regime | None = field(
        metadata=quantity(
            "what the pin does",
            comment="sticks: no macroscopic slip; micro_slip: none, but in the second half of the time the pin keeps up with "
            "more than half the stage's velocity, in slips shorter than presliding_length; slides: the last one did not end, and "
            "lasted longer than any cycle before it, from one slip's start to the next one's; stick_slip: all else; empty where "
            "the drive ended early",
            words=REGIMES,
        )
    )
    spring_force_amplitude: float = field(
        metadata=quantity(
            "peak-to-peak spring force over load",
            comment="in the second half of the drive's time; NaN unless two macroscopic slips begin in it, one lasts all "
            "through it, or the regime is micro_slip",
            per="normal_load",
        )
    )
    stick_slip_period: float = field(
        metadata=quantity(
            "period of stick-slip",
            "",
            "s",
            per="time",
            uncertainty="stick_slip_period_uncertainty",
            ensemble="independent",
            comment="mean time from the start of one macroscopic slip to the next, of those that begin in the second half "
            "of the time; NaN unless the regime is stick_slip and two begin there",
        )
    )
    stick_slip_period_uncertainty: float = field(
        metadata=quantity("error of the period of stick-slip", "", "s", per="time")
    )


def count_sticks(result: DynamicsResult, drive: Drive) -> StickSlipCount:
    """Count the re-sticks of a drive, the time it was stuck, name its regime, and measure what repeats itself."""
    slips, resticks = len(result.slip_time), int(np.count_nonzero(~np.isnan(result.restick_time)))
    nan = float("nan")
    if not result.outcome.ok:
        return StickSlipCount(slips, resticks, nan, None, nan, nan, nan)
    duration = float(result.time[-1])
    ends = np.where(np.isnan(result.restick_time), duration, result.restick_time)
    stuck = 1.0 - float(np.sum(ends - result.slip_time)) / duration
    follows = result.spring_force_range < 0.5 * _stuck_rise(result, drive)
    regime = _regime(result, resticks, duration) if slips else "micro_slip" if follows else "sticks"
    late = result.slip_time[result.slip_time >= 0.5 * duration]
    steady = regime == "micro_slip" or (0 < slips != resticks and not len(late))
    amplitude = result.spring_force_range if steady or len(late) > 1 else nan
    period, error = _mean_cycle(np.diff(late)) if regime == "stick_slip" else (nan, nan)
    return StickSlipCount(slips, resticks, stuck, regime, amplitude, period, error)


def _mean_cycle(cycles: NDArray[np.float64]) -> tuple[float, float]:
    """Mean of the cycles and its standard error, NaN for what so few do not tell."""
    if not len(cycles):
        return math.nan, math.nan
    error = float(np.std(cycles, ddof=1)) / math.sqrt(len(cycles)) if len(cycles) > 1 else math.nan
    return float(cycles.mean()), error


def _stuck_rise(result: DynamicsResult, drive: Drive) -> float:
    """By how much the spring force of a stuck pin rises in the second half of the time."""
    return drive.spring_stiffness * (drive.stage_velocity - result.stick_velocity) * 0.5 * result.end_time


def _regime(result: DynamicsResult, resticks: int, duration: float) -> Regime:
    starts = result.slip_time
    if resticks == len(starts):
        return "stick_slip"
    longest_cycle = float(np.diff(starts).max(initial=0.0))
    return "slides" if duration - float(starts[-1]) > longest_cycle else "stick_slip"
