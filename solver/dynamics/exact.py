"""The event-driven method: Eq. 12 in closed form between crossings (model of Eq. 13-14 as a ratchet on straight teeth).

No step size and no tolerance: a segment ends where closed forms say that the friction law, the tooth or the direction
changes. Segments are short enough for velocity and position to be monotone, so the first crossing is the only one.
"""

from typing import Final

from solver.dynamics._kernels import Motion, Run, Teeth, integrate_exactly
from solver.dynamics.result import BINS
from solver.outcome import COMPLETED, Ending, Outcome

STEP_LIMIT: Final = 100_000_000
"""Segments after which a run is given up (some seconds to a minute)."""


def integrate_exact(teeth: Teeth, motion: Motion, samples: int, step_limit: int) -> tuple[Run, Outcome]:
    """Integrate to the drive's end, or to `step_limit` segments with the outcome `STEP_LIMIT`."""
    run = integrate_exactly(teeth, motion, samples, BINS, step_limit, True)
    if run.reached >= motion.duration:
        return run, COMPLETED
    message = (
        f"{step_limit} segments reached t = {run.reached:.6g} of {motion.duration:.6g}: "
        "raise step_limit, shorten the drive, or look for chatter in the friction profile"
    )
    return run, Outcome(Ending.STEP_LIMIT, message)
