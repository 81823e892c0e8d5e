"""The event-driven method: Eq. 12 in closed form between crossings (model of Eq. 13-14 as a ratchet on straight teeth).

No step size and no tolerance: a segment ends where closed forms say that the friction law, the tooth or the direction
changes. Segments are short enough for velocity and position to be monotone, so the first crossing is the only one.
"""

from dataclasses import dataclass

from solver.drive import INTEGRATORS, Drive
from solver.dynamics.kernels.event_driven import integrate_exactly
from solver.dynamics.kernels.state import Motion, Run, Teeth
from solver.dynamics.method import Method, outcome_of
from solver.dynamics.result import BINS
from solver.dynamics.rigid import integrate_rigid
from solver.outcome import Outcome


@INTEGRATORS.register()
@dataclass(frozen=True, slots=True)
class Exact(Method):
    """From crossing to crossing in closed form; nothing to set."""

    name = "exact"

    def fit(self, drive: Drive) -> None:
        """Every drive fits."""

    def run(self, teeth: Teeth, motion: Motion, drive: Drive) -> tuple[Run, Outcome]:
        method = integrate_exact if drive.surface_compliance else integrate_rigid
        return method(teeth, motion, drive.samples, drive.step_limit, drive.reverse_motion)


def integrate_exact(
    teeth: Teeth, motion: Motion, samples: int, step_limit: int, reverse_motion: bool
) -> tuple[Run, Outcome]:
    """Integrate to the drive's end, to `step_limit` segments, or to where F would follow -F̃ unless it may."""
    run = integrate_exactly(teeth, motion, samples, BINS, step_limit, None if reverse_motion else True, True)
    return run, outcome_of(run, motion, step_limit)
