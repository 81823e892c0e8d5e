"""Duration of a drive without a given one: an estimate, doubled until its numbers are determined, within step_limit.

The first slip must lie in the first half of the time, and the mean friction force needs some cycles. A damper stronger than
all friction (c·V ≥ peak, ζ > π) drags the pin without stick: the duration then follows from the length of the record.
"""

import math
from typing import Final

from nanoslip.solver.drive import Drive

CYCLES: Final = 4
"""Cycles of stick-slip, or periods of a pin that slides, after the first slip: twice the periods that μ_k needs at the least."""
DOUBLINGS: Final = 5
"""Number of times that a drive's duration is doubled before its numbers are given up."""
FORGETTING: Final = 500_000
"""Segments of a drive that goes on for its amplitude alone: 20 ms, about what the fit of Eq. 16-19 takes."""


def expected_duration(drive: Drive, peak: float, mean: float, surface_stiffness: float, way: float) -> float:
    """The time that a drive needs, in its unit. peak, mean: friction forces in G·L_x·L_y. surface_stiffness: K in G·L_y.

    way: of the friction record, after which the friction repeats, in L_x.
    """
    k, stage = drive.spring_stiffness, drive.stage_velocity
    settling = settling_time(drive, peak)
    if stage == 0.0:
        return CYCLES * settling
    if settling < lag_time(drive):
        return CYCLES * (settling + way / stage)
    first = peak * (1.0 / k + 1.0 / surface_stiffness) / stage
    return 2.0 * first + CYCLES * (settling + 2.0 * (peak - mean) / (k * stage))


def lag_time(drive: Drive) -> float:
    """Relaxation time c/k: within it an overdamped sliding pin reaches its final lag behind the stage."""
    return 2.0 * drive.damping_ratio / math.sqrt(drive.spring_stiffness)


def settling_time(drive: Drive, peak: float) -> float:
    """The pin's period, or c/k where that is longer: in it the driving force of a sliding pin becomes the friction force.

    A pin that its damper drags moves with the stage at once, however long its spring still stretches.
    """
    period, lag = 2.0 * math.pi / math.sqrt(drive.spring_stiffness), lag_time(drive)
    dragged = lag > period and peak <= drive.spring_stiffness * lag * drive.stage_velocity
    return period if dragged else max(period, lag)
