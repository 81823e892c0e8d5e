"""Drive the pin by a spring over its friction limit (§2.2, Eq. 12-14). One file per integrator, this one door.

The pin starts at rest at x = 0 with a relaxed contact: x_R = 0, so F = 0 (Eq. 13 leaves x = x_R open), whatever small
force initial contact may have left in the record.
"""

import math

import numpy as np

from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.friction_limit import FrictionLimit
from nanoslip.solver.dynamics.integrators import RK4, Exact, Method, nothing, resolved
from nanoslip.solver.dynamics.kernels.state import Motion, Run, Teeth
from nanoslip.solver.dynamics.result import BINS, DynamicsResult
from nanoslip.solver.outcome import InvalidInput, Outcome
from nanoslip.solver.parameter import MOST_WHOLE

__all__ = ["RK4", "DynamicsResult", "Exact", "integrate"]


def integrate(friction_limit: FrictionLimit, drive: Drive, surface_stiffness: float) -> DynamicsResult:
    """Integrate Eq. 12 with the friction of Eq. 13-14 by the drive's integrator.

    surface_stiffness: K of Eq. 15, in G·L_y; without surface compliance it only tells slip from stick (`stick_velocity`,
    `presliding_length`).
    Raises InvalidInput unless K > 0. An unstable step, too many segments, a reversal that the drive excludes or forces
    below rounding are outcomes of the result.
    """
    if not 0.0 < surface_stiffness < math.inf:
        raise InvalidInput(f"surface_stiffness = {surface_stiffness!r}: needs surface_stiffness > 0")
    k, stage = drive.spring_stiffness, drive.stage_velocity
    damping = 2.0 * drive.damping_ratio * math.sqrt(k)
    compliant = drive.surface_compliance
    stiffest = surface_stiffness if compliant else float(np.abs(friction_limit.slope).max())
    motion = Motion(
        spring=k,
        damping=damping,
        stage=stage,
        surface_stiffness=surface_stiffness if compliant else math.inf,
        stick_velocity=k * stage / (k + surface_stiffness),
        presliding=friction_limit.steady_force / surface_stiffness,
        duration=drive.duration,
        instant=1e-8 / (math.sqrt(k + stiffest) + damping),
        most_slips=drive.max_slips or MOST_WHOLE,
        recorded=drive.duration,
    )
    run, outcome = _run(friction_limit, motion, drive)
    if outcome.ok and run.reached < motion.duration:  # by its slips: the same once more, spread over the time it took
        motion = motion._replace(recorded=run.reached)
        run, outcome = _run(friction_limit, motion, drive)
    time = motion.recorded * (np.arange(drive.samples + 1) / drive.samples)
    position, velocity, friction_force = run.samples.T.copy()
    slip_time, slip_position, slip_force, restick_time, restick_position = run.slips.T.copy()
    spring_range = run.largest_spring_force - run.least_spring_force
    return DynamicsResult(
        time=time,
        position=position,
        velocity=velocity,
        spring_force=k * (stage * time - position),
        friction_force=friction_force,
        slip_time=slip_time,
        slip_position=slip_position,
        slip_force=slip_force,
        restick_time=restick_time,
        restick_position=restick_position,
        micro_slips=run.micro_slips,
        micro_travel=run.micro_travel,
        binned_force=np.diff(run.impulse) * (BINS / motion.recorded),
        friction_work=run.friction_work,
        stick_velocity=motion.stick_velocity,
        presliding_length=motion.presliding,
        settling_time=max(2.0 * math.pi / math.sqrt(k), damping / k),
        steps=run.steps,
        end_time=float(time[-1]),
        spring_force_range=spring_range if math.isfinite(spring_range) else math.nan,
        outcome=outcome,
    )


def _run(friction_limit: FrictionLimit, motion: Motion, drive: Drive) -> tuple[Run, Outcome]:
    """The motion by the drive's method, and how it ended; nothing where rounding would drown it."""
    outcome = resolved(friction_limit, motion)
    if not outcome.ok:
        return nothing(drive.samples), outcome
    teeth = Teeth(friction_limit.edges, friction_limit.force, friction_limit.slope, friction_limit.periodic_from)
    method = drive.integrator
    assert isinstance(method, Method)  # all that are registered are
    return method.run(teeth, motion, drive)
