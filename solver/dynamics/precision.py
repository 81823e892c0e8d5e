"""Whether double precision can tell what a drive asks for: far out, the spring's stretch is lost in the position.

A pin that slides is F/k behind the stage, at x close to V·t. Both are known to the 16th digit of V·t, and the spring
force k(Vt - x) to k times that. Beside the friction force this is noise: on settled drives up to three times the share
that `resolved` computes (tests.hard_cases.test_dynamics). Teeth narrower than that digit of x cannot be met one by one.
"""

import math
from typing import Final

import numpy as np

from solver.dynamics.friction_limit import FrictionLimit
from solver.dynamics.kernels.state import Motion, Run
from solver.dynamics.result import BINS
from solver.outcome import COMPLETED, Ending, Outcome

LARGEST: Final = 1e-4
"""Rounding allowed, over the steady friction force and over the mean width of a tooth: what a plateau knows of itself."""
_DIGIT: Final = float(np.finfo(float).eps)


def resolved(friction_limit: FrictionLimit, motion: Motion) -> Outcome:
    """`COMPLETED`, or `ROUNDING` where spring force or teeth will drown in the rounding of the pin's position."""
    friction_force, way = friction_limit.steady_force, motion.stage * motion.duration
    force_noise = _DIGIT * motion.spring * way
    if friction_force == 0.0 or motion.spring * way <= friction_force:  # nothing to be lost in, or it never gets away
        return COMPLETED
    if force_noise > LARGEST * friction_force:
        return _refused(
            f"spring_stiffness × stage_velocity × duration rounds the spring force by {force_noise / friction_force:.1e} of the "
            "friction force: soften the spring, slow the stage or shorten the drive",
            force_noise / friction_force,
        )
    uneven = np.ptp(friction_limit.force) > 0.0 or bool(friction_limit.slope.any())
    teeth = len(friction_limit.force) - friction_limit.periodic_from
    position_noise = _DIGIT * way * teeth / friction_limit.period
    if uneven and position_noise > LARGEST:
        return _refused(
            f"stage_velocity × duration rounds the position by {position_noise:.1e} of the friction profile's mean tooth: "
            'slow the stage, shorten the drive or take profile = "mean"',
            position_noise,
        )
    return COMPLETED


def nothing(samples: int) -> Run:
    """What a drive that is refused delivers: NaN at all times."""
    nan = math.nan
    return Run(0.0, 0, np.full((samples + 1, 3), nan), np.full(BINS + 1, nan), np.empty((0, 5)), 0, nan, nan, nan, nan)


def _refused(message: str, noise: float) -> Outcome:
    return Outcome(Ending.ROUNDING, f"{message} (by a factor of {noise / LARGEST:.2g} or more)")
