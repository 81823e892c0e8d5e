"""The friction law of Eq. 13-14 on one tooth: direction of motion, stick or slip, how far stick lasts."""

import math

from nanoslip.solver.compiled import compiled
from nanoslip.solver.dynamics.kernels.slips import acceleration_rounding, driving_force
from nanoslip.solver.dynamics.kernels.state import Motion, Pin


@compiled(error_model="numpy")
def limited_friction(x: float, relaxed: float, surface_stiffness: float, limit: float) -> float:
    """Eq. 13, for a relaxation point that is known."""
    return max(-limit, min(surface_stiffness * (x - relaxed), limit))


@compiled(error_model="numpy")
def moves_forward(motion: Motion, pin: Pin, slope: float) -> bool:
    """Direction of the motion; from rest the acceleration decides, or its rate where that is 0 to rounding. slope: of F̃."""
    if pin.velocity != 0.0:
        return pin.velocity > 0.0
    q = driving_force(motion, pin) - pin.friction_force
    jerk = motion.spring * motion.stage - motion.damping * q
    return (
        q > 0.0 if abs(q) > max(abs(jerk) * motion.instant, acceleration_rounding(motion, pin, slope)) else jerk >= 0.0
    )


@compiled(error_model="numpy")
def limit_followed(friction_force: float, limit: float, slope: float, surface_stiffness: float, forward: bool) -> int:
    """1 or -1 where F follows F̃ or -F̃, because elastic contact would exceed it; 0 where the contact sticks."""
    if friction_force >= limit and slope != surface_stiffness and (slope < surface_stiffness) == forward:
        return 1
    if friction_force <= -limit and slope != -surface_stiffness and (slope < -surface_stiffness) == forward:
        return -1
    return 0


@compiled(error_model="numpy")
def stuck_reach(friction_force: float, limit: float, slope: float, surface_stiffness: float, forward: bool) -> float:
    """How far F = K(x - x_R) stays between -F̃ and F̃ in the direction of motion: a signed distance."""
    reach = math.inf if forward else -math.inf
    if slope != surface_stiffness and (slope < surface_stiffness) == forward:
        reach = (limit - friction_force) / (surface_stiffness - slope)
    if slope != -surface_stiffness and (slope < -surface_stiffness) == forward:
        down = -(limit + friction_force) / (slope + surface_stiffness)
        reach = min(reach, down) if forward else max(reach, down)
    return reach
