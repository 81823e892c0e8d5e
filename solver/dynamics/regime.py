"""Whether a driven pin sticks, slides or does both in turn, from the macroscopic slips of its drive.

What the pin does at last counts: many a drive re-sticks once or twice while its first slip rings out, then slides for
good (§3.3). A slip that has not ended is called sliding once it has lasted longer than every cycle before it, from one
slip's start to the next one's. A motion that repeats itself never gets there: its slips are shorter than its cycles.
"""

from dataclasses import dataclass, field
from typing import Final, Literal, get_args

import numpy as np

from solver.dynamics.integrate import DynamicsResult
from solver.quantity import quantity

Regime = Literal["sticks", "stick_slip", "slides"]
"""No macroscopic slip; slips that end in stick; a last slip that goes on, longer than any cycle before it."""
REGIMES: Final[tuple[Regime, ...]] = get_args(Regime)


@dataclass(frozen=True, slots=True)
class StickSlipCount:
    """How often and how long the pin of one drive stuck.

    resticks: macroscopic slips that ended, each where the pin came down to `stick_velocity`, or to rest.
    time_stuck: share of the drive's duration outside macroscopic slips; the micro slips of a stuck pin count as stuck.
    NaN, and regime None, of a run that ended early.
    """

    macroscopic_slips: int = field(metadata=quantity("slips longer than the presliding length"))
    resticks: int = field(
        metadata=quantity("macroscopic slips that ended", comment="the pin came down to stick_velocity")
    )
    time_stuck: float = field(
        metadata=quantity("share of the duration that it stuck", comment="in which the pin was in no macroscopic slip")
    )
    regime: Regime | None = field(
        metadata=quantity(
            "what the pin does",
            comment="sticks: no macroscopic slip; slides: the last one did not end, and lasted longer than any cycle "
            "before it, from one slip's start to the next one's; stick_slip: all else; empty where the drive ended early",
            words=REGIMES,
        )
    )


def count_sticks(result: DynamicsResult) -> StickSlipCount:
    """Count the re-sticks of a drive, the time it was stuck, and name its regime."""
    slips, resticks = len(result.slip_time), int(np.count_nonzero(~np.isnan(result.restick_time)))
    if not result.outcome.ok:
        return StickSlipCount(slips, resticks, float("nan"), None)
    duration = float(result.time[-1])
    ends = np.where(np.isnan(result.restick_time), duration, result.restick_time)
    slipping = float(np.sum(ends - result.slip_time))
    return StickSlipCount(slips, resticks, 1.0 - slipping / duration, _regime(result, resticks, duration))


def _regime(result: DynamicsResult, resticks: int, duration: float) -> Regime:
    starts = result.slip_time
    if not len(starts):
        return "sticks"
    if resticks == len(starts):
        return "stick_slip"
    longest_cycle = float(np.diff(starts).max(initial=0.0))
    return "slides" if duration - float(starts[-1]) > longest_cycle else "stick_slip"
