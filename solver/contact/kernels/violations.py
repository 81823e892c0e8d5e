"""Which constraint of contact and friction is violated worst, and where the pin is too steep for them."""

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.compiled import compiled
from nanoslip.solver.contact.kernels.pin_height import pin_height, pin_slope
from nanoslip.solver.contact.kernels.state import Floats, KernelConstants, KernelState

STEEPEST = 1.0
"""Slope of the pin under a node in contact beyond which along and across say nothing of shear and pressure."""

PLACE = 0xFFFF
"""Lowest bits of a shear ratio, 2^-36 of it, that give way to the node's place: nearer ratios are ties."""
TIE = 2.0**-36
"""The same share of a step: of events that are nearer, the one further right comes first."""
HALF_PLACE = PLACE // 2 + 1
"""Added to a ratio before it is cut: ratios that one cut separates though they are ties, the other does not."""


@compiled()
def bits(value: float) -> int:
    """A float's bits read as an integer: positive floats keep their order, negative ones stay negative."""
    return int(np.float64(value).view(np.int64))


@compiled()
def ranked(ratio: int, i: int) -> int:
    """The bits of a shear ratio, the lowest of them replaced by the node's place i."""
    return (ratio & ~PLACE) | i


@compiled()
def highest_ranked(cut: int, shifted: int) -> int:
    """The place in the largest rank of either cut, or -1 where there is none."""
    return max(cut & PLACE, shifted & PLACE) if cut > 0 else -1


@compiled(inline="always")
def limited(shear: float, opposite: float) -> float:
    """What the friction law limits of a shear: its size, or what of it is along the drag (see `SlipConstants.opposite`)."""
    return max(shear, opposite * shear)


@compiled(fastmath={"contract"}, error_model="numpy")
def worst_violation(
    shear: Floats,
    normal: Floats,
    active_friction: Floats,
    contact: NDArray[np.bool_],
    tolerance: float,
    opposite: float,
) -> tuple[int, float]:
    """The offender with the largest limited shear over μ_i·pressure, of ties the one further right, or -1; the largest tension.

    No shear does not offend, whatever a slight tension times μ_i is: no slip could lessen it.

    All as maxima of integers, which compilers turn into vector instructions (`error_model` drops a branch that forbids it):
    a ratio's lowest bits give way to the node's place. Ratios nearer than half of what is cut off fall together in at least
    one of two cuts, half a step apart.
    """
    cut, shifted, tension = 0, 0, 0
    for i in range(len(active_friction)):
        size, allowed = limited(shear[i], opposite), -active_friction[i] * normal[i]
        ratio = bits(size / max(allowed, tolerance))
        offends = (size - allowed > tolerance) & (size > tolerance)
        cut = max(cut, ranked(ratio, i) if offends else 0)
        shifted = max(shifted, ranked(ratio + HALF_PLACE, i) if offends else 0)
        tension = max(tension, bits(normal[i] if contact[i] else 0.0))
    return highest_ranked(cut, shifted), float(np.int64(tension).view(np.float64))


@compiled()
def largest_tension(state: KernelState, constants: KernelConstants) -> int:
    """The node in contact that pulls most, of ties the one further right, or -1."""
    n = len(state.x)
    found, largest = -1, 0.0
    for i in range(n - 1, -1, -1):
        if state.contact[i] and state.response[n + i] > largest + constants.slip.tolerance:
            found, largest = i, state.response[n + i]
    return found


@compiled()
def deepest_penetration(state: KernelState, constants: KernelConstants) -> int:
    """The free node that lies deepest inside the pin, of ties the one further right, or -1."""
    n = len(state.x)
    found, deepest = -1, 0.0
    for i in range(n - 1, -1, -1):
        if not state.contact[i]:
            xi = state.x[i] + state.response[i] - state.scalars.displacement
            gap = pin_height(constants, xi) - state.response[n + i]
            if gap < deepest - constants.tolerance_gap:
                found, deepest = i, gap
    return found


@compiled()
def on_steep_flank(state: KernelState, constants: KernelConstants, against_friction: bool) -> bool:
    """Whether a node in contact is on a flank steeper than STEEPEST, or than half of its μ_i: there the pressure may drive a
    slip downhill harder than the shear, which falls from μ_i·pressure to none, holds it back."""
    for i in range(len(state.x)):
        if state.contact[i]:
            most = min(0.5 * state.node_friction[i], STEEPEST) if against_friction and not state.sticks[i] else STEEPEST
            xi = state.x[i] + state.inputs[i] - state.scalars.displacement
            if not abs(pin_slope(constants.pin, xi)) <= most:
                return True
    return False
