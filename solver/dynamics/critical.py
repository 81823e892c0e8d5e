"""Critical point of a driven pin: velocity of the stage and stiffness of its spring beyond which it does not stick any more.

Both are found by bisection over drives of one record, from rest: the regime that `count_sticks` reports is what changes.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.duration import measured
from nanoslip.solver.dynamics.regime import CriticalPoint, Regime, count_sticks
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.sliding.plateau import Plateau
from nanoslip.solver.sliding.record import FrictionRecord

STICKING: Final[tuple[Regime, ...]] = ("sticks", "stick_slip")
"""Regimes of a pin that comes to rest again and again."""
STRIDE: Final = 4.0
"""Factor from one drive to the next while a bracket is looked for."""
STRIDES: Final = 7
"""Strides in either direction: a factor of 16,000."""
RESOLUTION: Final = 1.02
"""Largest ratio of the ends of a bracket whose middle is the critical value."""


def critical_point(record: FrictionRecord, plateau: Plateau, drive: Drive) -> CriticalPoint:
    """The critical velocity at the drive's stiffness, and the critical stiffness at its velocity. Raises NoPlateauError."""
    bare = replace(drive, duration=None, max_slips=None, samples=1, memory=False)

    def sticks(**changes: Any) -> bool | None:
        try:
            changed = replace(bare, **changes)
        except InvalidInput:  # beyond the range of a drive
            return None
        motion = replace(measured(record, plateau, changed)[0], forgotten=True)  # its own regime, next to the border
        regime = count_sticks(motion, changed).regime
        return None if regime is None else regime in STICKING

    return CriticalPoint(
        critical_velocity=boundary(lambda value: sticks(stage_velocity=value), drive.stage_velocity),
        critical_stiffness=boundary(lambda value: sticks(spring_stiffness=value), drive.spring_stiffness),
    )


def boundary(sticks: Callable[[float], bool | None], first: float) -> float:
    """Value at which `sticks` turns from True to False, next to `first`; NaN if it does not within STRIDES, or is unknown."""
    there = sticks(first) if first > 0.0 else None
    if there is None:
        return math.nan
    stride, near = STRIDE if there else 1.0 / STRIDE, first
    for _ in range(STRIDES):
        far = near * stride
        if (found := sticks(far)) is None:
            return math.nan
        if found != there:
            return _bisected(sticks, *sorted((near, far)))
        near = far
    return math.nan


def _bisected(sticks: Callable[[float], bool | None], low: float, high: float) -> float:
    """The critical value between a pin that sticks and one that does not."""
    while high > RESOLUTION * low:
        middle = math.sqrt(low * high)
        if (found := sticks(middle)) is None:
            return math.nan
        low, high = (middle, high) if found else (low, middle)
    return math.sqrt(low * high)
