"""What every integrator does: from a friction limit and an equation of motion to a run and how it ended."""

from abc import abstractmethod

import numpy as np

from solver.drive import Drive, Integrator
from solver.dynamics.kernels.state import Motion, Run, Teeth
from solver.outcome import COMPLETED, Ending, Outcome


class Method(Integrator):
    """An integrator of this package."""

    @abstractmethod
    def run(self, teeth: Teeth, motion: Motion, drive: Drive) -> tuple[Run, Outcome]:
        """Integrate to the drive's end or its last slip, to its `step_limit`, or to where F would follow -F̃ unless it may."""


def outcome_of(run: Run, motion: Motion, step_limit: int) -> Outcome:
    """How a run of segments ended: `COMPLETED`, `STEP_LIMIT` or `REVERSED`."""
    if run.reached >= motion.duration or slipped_enough(run, motion):
        return COMPLETED
    if run.steps < step_limit:
        return reversed_at(run, motion)
    message = (
        f"{step_limit} segments reached {part_reached(run, motion)}: "
        "raise step_limit, shorten the drive, slow the stage or soften the spring"
    )
    return Outcome(Ending.STEP_LIMIT, message)


def part_reached(run: Run, motion: Motion) -> str:
    """How far a run got, in words without a unit: who reads them gave the drive's duration in seconds."""
    return f"{100.0 * run.reached / motion.duration:.4g} % of the duration"


def slipped_enough(run: Run, motion: Motion) -> bool:
    """Whether as many macroscopic slips have ended as the drive was to last."""
    return int(np.count_nonzero(np.isfinite(run.slips[:, 3]))) >= motion.most_slips


def reversed_at(run: Run, motion: Motion) -> Outcome:
    """The end of a run whose pin was not to move back."""
    message = f"the pin slips back after {part_reached(run, motion)}: needs reverse_motion = true"
    return Outcome(Ending.REVERSED, message)
