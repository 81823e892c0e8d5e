"""The paper's method (§2.2.3): classical fourth-order Runge-Kutta steps of a given length.

The relaxation point of Eq. 14 is updated after each step, as the paper words it. Where a step meets a kink or a jump of
the friction force the order falls to one; velocities during stick suffer first.
"""

import math
from dataclasses import dataclass

import numpy as np

from solver.drive import INTEGRATORS, Drive
from solver.dynamics.kernels.runge_kutta import integrate_by_steps
from solver.dynamics.kernels.state import Motion, Run, Teeth
from solver.dynamics.method import Method, part_reached, reversed_at, slipped_enough
from solver.dynamics.precision import nothing
from solver.dynamics.result import BINS
from solver.outcome import COMPLETED, Ending, Outcome
from solver.parameter import check, parameter, require


@INTEGRATORS.register()
@dataclass(frozen=True, slots=True)
class RK4(Method):
    """Runge-Kutta steps of a given length."""

    name = "rk4"
    rests = False
    time_step: float | None = parameter(None, meaning="step of the integrator", unit="s", scale="time")

    def __post_init__(self) -> None:
        check(self)

    def fit(self, drive: Drive) -> None:
        step = self.time_step
        allowed = step is not None and 0.0 < step <= drive.duration
        require("time_step", step, allowed, "0 < time_step ≤ duration with rk4")

    def run(self, teeth: Teeth, motion: Motion, drive: Drive) -> tuple[Run, Outcome]:
        assert self.time_step is not None  # a drive with rk4 has one
        return integrate_rk4(teeth, motion, drive.samples, self.time_step, drive.step_limit, drive.reverse_motion)


def integrate_rk4(
    teeth: Teeth, motion: Motion, samples: int, time_step: float, step_limit: int, reverse_motion: bool
) -> tuple[Run, Outcome]:
    """Integrate in steps of at most `time_step`, as many as fill the duration evenly; refused if more than `step_limit`.

    A step that makes free vibrations of the stuck pin grow is refused with the outcome `UNSTABLE_STEP`. Unless the pin
    may move back, the run ends where F would be -F̃.
    """
    if not is_stable(time_step, motion):
        shorter = time_step / longest(motion)
        message = (
            f"the stuck pin's vibrations would grow: needs a time_step shorter by a factor of {shorter:.4g} or more"
        )
        return nothing(samples), Outcome(Ending.UNSTABLE_STEP, message)
    steps_needed = motion.duration / time_step * (1.0 - 1e-12)
    if steps_needed > step_limit:
        message = f"{steps_needed:.6g} steps of time_step, step_limit = {step_limit}: raise one of the two"
        return nothing(samples), Outcome(Ending.STEP_LIMIT, message)
    steps = max(1, math.ceil(steps_needed))
    run = integrate_by_steps(teeth, motion, steps, samples, BINS, None if reverse_motion else True)
    if math.isnan(run.friction_work):
        message = f"the motion ran away after {part_reached(run, motion)}: needs a shorter time_step"
        return run, Outcome(Ending.UNSTABLE_STEP, message)
    return run, COMPLETED if run.steps == steps or slipped_enough(run, motion) else reversed_at(run, motion)


def is_stable(time_step: float, motion: Motion) -> bool:
    """True if a step damps, or at least does not amplify, free motion with the stuck contact's stiffness k + K."""
    rates = np.roots([1.0, motion.damping, motion.spring + motion.surface_stiffness]).astype(complex)
    z = rates * time_step
    growth = np.abs(1.0 + z * (1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0))))
    return bool(np.all(growth <= 1.0 + 1e-14))  # rounding of tiny steps without damping


def longest(motion: Motion) -> float:
    """The longest stable step, a little below."""
    low, high = 0.0, 4.0 / math.sqrt(motion.spring + motion.surface_stiffness)
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if is_stable(middle, motion) else (low, middle)
    return low
