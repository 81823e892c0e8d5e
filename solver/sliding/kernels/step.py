"""The smallest step of the pin, and by how much it may push shear beyond its limits."""

from nanoslip.solver.compiled import compiled
from nanoslip.solver.contact.kernels.state import SlipConstants

STRETCHES = 24.0
"""The event floor counts in node spacings, or in this many stretches of the contact where those are shorter.

A stretch is the displacement that would raise the friction force of a sticking contact from 0 to μ_i·W."""

OVERSHOOT = 1e-4
"""What shear may exceed its limit by before an event, all nodes together, as a share of μ_i·W."""


@compiled()
def smallest_step(constants: SlipConstants, stiffness: float, displacement: float) -> float:
    """The event floor as a length, at δ_p = displacement.

    A step is to outlive rounding, so the floor counts in stretches of the contact where those are shorter than a node spacing
    (in the paper's case a node spacing is shorter). It is never so small that all forces stay within the tolerance, or δ_p
    stays the same number. stiffness: by how much shear and its limits change per displacement.
    """
    least = 4.5e-16 * displacement
    if not stiffness > 0.0:
        return float(max(constants.event_floor * constants.spacing, least))
    unit = min(constants.spacing, STRETCHES * constants.friction_bound / stiffness)
    return float(max(constants.event_floor * unit, 0.1 * constants.tolerance / stiffness, least))


@compiled()
def overshot(constants: SlipConstants, overshoot: float, nodes: int) -> bool:
    """Whether shear exceeds its limits by too much, all nodes together; so does what is not a number."""
    return not overshoot <= OVERSHOOT * constants.friction_bound + nodes * constants.tolerance
