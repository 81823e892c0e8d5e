"""Duration of a drive without a given one: to its first slip, and as many cycles as its numbers need.

The first slip has to lie in the first half of the time (nanoslip.solver.dynamics.regime), and the mean of the driving force needs
some cycles (nanoslip.solver.dynamics.coefficients). The first duration is an estimate. It is doubled until the numbers are
determined, within step_limit.

A damper stronger than all friction (c·V ≥ peak, ζ > π) drags the pin from the start without stick. Its lag relaxes within c/k and
changes no friction. The duration then follows from the length of the record.
"""

import math
from typing import Final

from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.coefficients import LARGEST_CHANGE

CYCLES: Final = 4
"""Cycles of stick-slip, or periods of a pin that slides, after the first slip: twice the periods that μ_k needs at the least."""
DOUBLINGS: Final = 5
"""How often a drive is pulled twice as long before its numbers are given up."""


def expected_duration(drive: Drive, peak: float, mean: float, surface_stiffness: float, way: float) -> float:
    """The time that a drive needs, in its unit. peak, mean: friction forces in G·L_x·L_y. surface_stiffness: K in G·L_y.

    way: of the friction record, after which the friction repeats, in L_x.
    """
    k, stage = drive.spring_stiffness, drive.stage_velocity
    settling = settling_time(drive, peak, mean)
    if stage == 0.0:
        return CYCLES * settling
    if settling < lag_time(drive):
        return CYCLES * (settling + way / stage)
    first = peak * (1.0 / k + 1.0 / surface_stiffness) / stage
    return 2.0 * first + CYCLES * (settling + 2.0 * (peak - mean) / (k * stage))


def lag_time(drive: Drive) -> float:
    """c/k: an overdamped pin that slides lags behind the stage by what it lags at last within this time."""
    return 2.0 * drive.damping_ratio / math.sqrt(drive.spring_stiffness)


def settling_time(drive: Drive, peak: float, mean: float) -> float:
    """The time in which the driving force of a sliding pin becomes the friction force: its period, or c/k where that is longer.

    Of a pin that its damper drags: until inertia, m·z'' of the lag z, is `LARGEST_CHANGE` of friction. With z = 0 and z' = V at
    first, m·z'' + c·z' + k·z = mean makes z'' a sum of two exponentials, each of which is to be below that.
    """
    k, stage, ratio = drive.spring_stiffness, drive.stage_velocity, drive.damping_ratio
    period, lag = 2.0 * math.pi / math.sqrt(k), lag_time(drive)
    if lag <= period or mean == 0.0 or peak > k * lag * stage:
        return max(period, lag)
    fast = math.sqrt(k) * (ratio + math.sqrt(ratio**2 - 1.0))
    slow = k / fast  # the product of the rates
    inertia = {rate: abs(stage - mean / rate) * rate**2 / (fast - slow) for rate in (slow, fast)}
    return min(lag, max(math.log(max(force / (LARGEST_CHANGE * mean), 1.0)) / rate for rate, force in inertia.items()))
