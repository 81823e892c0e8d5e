"""How long a drive lasts that names no duration: to its first slip, and as many cycles as its numbers need.

The first slip has to lie in the first half of the time (nanoslip.solver.dynamics.regime), and the mean of the driving force needs
cycles to settle (nanoslip.solver.dynamics.coefficients). What that takes is not known before the pin has moved: the first time is
an estimate, and a drive whose numbers are not known after it is pulled twice as long, again and again.
"""

import math
from typing import Final

from nanoslip.solver.drive import Drive

CYCLES: Final = 4
"""Cycles of stick-slip, or periods of a pin that slides, after the first slip: twice the periods that μ_k needs at the least."""
DOUBLINGS: Final = 5
"""How often a drive is pulled twice as long before its numbers are given up."""


def expected_duration(drive: Drive, peak: float, mean: float, surface_stiffness: float) -> float:
    """The time that a drive needs, in its unit. peak, mean: friction forces in G·L_x·L_y. surface_stiffness: K in G·L_y."""
    k, stage = drive.spring_stiffness, drive.stage_velocity
    cycle = max(2.0 * math.pi, 2.0 * drive.damping_ratio) / math.sqrt(k)
    if stage == 0.0:
        return CYCLES * cycle
    first = peak * (1.0 / k + 1.0 / surface_stiffness) / stage
    return 2.0 * first + CYCLES * (cycle + 2.0 * (peak - mean) / (k * stage))
