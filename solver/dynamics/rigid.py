"""The event-driven method without surface compliance: Eq. 12 in closed form between crossings, as solver.dynamics.exact.

In the limit K → ∞ Eq. 13-14 lose their relaxation point, x_R = x, and with it their hysteresis: F is F̃(x) against the
motion, and the pin is at rest while |spring + damper| ≤ F̃(x). With a constant F̃ this is the motion of Eq. 16-19.
"""

from solver.dynamics.kernels.rigid import integrate_rigidly
from solver.dynamics.kernels.state import Motion, Run, Teeth
from solver.dynamics.method import outcome_of
from solver.dynamics.result import BINS
from solver.outcome import Outcome


def integrate_rigid(
    teeth: Teeth, motion: Motion, samples: int, step_limit: int, reverse_motion: bool
) -> tuple[Run, Outcome]:
    """Integrate to the drive's end, to `step_limit` segments, or to where the pin would move back unless it may."""
    run = integrate_rigidly(teeth, motion, samples, BINS, step_limit, None if reverse_motion else True)
    return run, outcome_of(run, motion, step_limit)
