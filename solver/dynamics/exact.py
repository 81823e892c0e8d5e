"""The event-driven method: Eq. 12 in closed form between crossings (model of Eq. 13-14 as a ratchet on straight teeth).

No step size and no tolerance: a segment ends where closed forms say that the friction law, the tooth or the direction
changes. Segments are short enough for velocity and position to be monotone, so the first crossing is the only one.
"""

from solver.dynamics.kernels.event_driven import integrate_exactly
from solver.dynamics.kernels.state import Motion, Run, Teeth
from solver.dynamics.result import BINS
from solver.outcome import COMPLETED, Ending, Outcome


def integrate_exact(
    teeth: Teeth, motion: Motion, samples: int, step_limit: int, reverse_motion: bool
) -> tuple[Run, Outcome]:
    """Integrate to the drive's end, to `step_limit` segments, or to where F would follow -F̃ unless it may."""
    run = integrate_exactly(teeth, motion, samples, BINS, step_limit, None if reverse_motion else True, True)
    return run, outcome_of(run, motion, step_limit)


def outcome_of(run: Run, motion: Motion, step_limit: int) -> Outcome:
    """How a run of segments ended: `COMPLETED`, `STEP_LIMIT` or `REVERSED`."""
    if run.reached >= motion.duration:
        return COMPLETED
    if run.steps < step_limit:
        return reversed_at(run)
    message = (
        f"{step_limit} segments reached t = {run.reached:.6g} of {motion.duration:.6g}: "
        "raise step_limit, shorten the drive, or look for chatter in the friction profile"
    )
    return Outcome(Ending.STEP_LIMIT, message)


def reversed_at(run: Run) -> Outcome:
    """The end of a run whose pin was not to move back."""
    message = f"the pin slips back at t = {run.reached:.6g}: needs reverse_motion = true"
    return Outcome(Ending.REVERSED, message)
