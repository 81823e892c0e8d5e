"""Critical velocity of a driven pin: the stage velocity above which the pin no longer sticks.

It is found by drives of the same record, from rest: the regime that `count_sticks` reports changes there. Below it
there may be windows in which the pin does not stick, so the search comes from above, and not from the drive's own
velocity.

There is no critical stiffness beside it. Slips depend on V√k (Eq. 17), so it would be k·(V_c/V)², with twice the
relative scatter (single starts of the paper's pin: 3 to 72 kN/m), where it is soft; and from k = K on a stick, v ≤
kV/(k + K), is nearly the stage's own motion. V_c over an axis of stiffnesses answers the same question.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final, NamedTuple

from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.duration import FORGETTING, measure_motion
from nanoslip.solver.dynamics.friction_limit import make_friction_limit
from nanoslip.solver.dynamics.regime import CriticalVelocity, Regime, Search, count_sticks
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.sliding.plateau import Plateau
from nanoslip.solver.sliding.record import FrictionRecord

STICKING: Final[tuple[Regime, ...]] = ("sticks", "stick_slip")
"""Regimes of a pin that comes to rest again and again."""
STRIDE: Final = 2.0
"""Factor from one velocity down to the next. Narrower windows in which the pin sticks may be missed."""
STRIDES: Final = 14
"""Strides down: a factor of 16,000."""
RESOLUTION: Final = 1.02
"""Largest ratio of the ends of a bracket whose middle is the critical value."""


def critical_velocity(record: FrictionRecord, plateau: Plateau, drive: Drive) -> CriticalVelocity:
    """The critical velocity of the drive's stage, at its spring, mass and damping ratio. Raises NoPlateauError.

    A pin with the force e beyond a steady friction force oscillates about the stage's motion with the velocity √(V² + e²/k),
    decreasing by exp(-πζ) in half a period, before which it does not stop (Eq. 17): above e = V√(k·(exp(2πζ) - 1)) it may stop
    at all. The search begins where e is all of the record's peak.
    """
    bare = replace(drive, duration=None, max_slips=None, samples=1, memory=False)

    def sticks(velocity: float) -> bool | None:
        try:
            changed = replace(bare, stage_velocity=velocity)
        except InvalidInput:  # beyond the range of a drive
            return None
        # Next to the border a regime that is not certain within these segments counts as the motion's own.
        motion, _ = measure_motion(record, plateau, changed, patience=FORGETTING)
        judged = replace(motion, forgotten_from=0.0)
        regime = count_sticks(judged, changed).regime
        return None if regime is None else regime in STICKING

    # Beyond critical damping there is no half period to decay in; the bound for 1 holds all the more.
    lost = math.expm1(2.0 * math.pi * min(drive.damping_ratio, 1.0))
    peak = float(make_friction_limit(record, plateau, drive.profile).force.max())
    # e = V√(k·(exp(2πζ) - 1)), solved for V.
    fastest = peak / math.sqrt(drive.spring_stiffness * lost) if lost else math.inf
    return CriticalVelocity(*boundary(sticks, fastest))


class Boundary(NamedTuple):
    """Value at which a pin begins to stick, and how the search for it ended."""

    value: float
    """NaN unless found."""
    search: Search


def boundary(sticks: Callable[[float], bool | None], first: float) -> Boundary:
    """Uppermost value below `first` at which `sticks` turns from True below to False above."""
    if not math.isfinite(first):
        return Boundary(math.nan, "unknown")
    above = math.nan
    for value in (first / STRIDE**stride for stride in range(STRIDES + 1)):
        if (is_stuck := sticks(value)) is None:
            return Boundary(math.nan, "unknown")
        if not is_stuck:
            above = value
        elif above > value:
            between = _bisect_critical_value(sticks, value, above)
            return Boundary(between, "found" if math.isfinite(between) else "unknown")
    return Boundary(math.nan, "always_sticks" if math.isnan(above) else "never_sticks")


def _bisect_critical_value(sticks: Callable[[float], bool | None], low: float, high: float) -> float:
    """Bisect between a value at which the pin sticks and a value at which it does not."""
    while high > RESOLUTION * low:
        # Velocities span decades, and the bracket is a ratio: so is its middle.
        middle = math.sqrt(low * high)
        if (is_stuck := sticks(middle)) is None:
            return math.nan
        low, high = (middle, high) if is_stuck else (low, middle)
    return math.sqrt(low * high)
