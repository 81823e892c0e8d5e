"""Normal forces of a given contact set at a given load, by preconditioned conjugate gradients.

They minimize the energy N·CN/2 + h·N under ΣN = W. CN is the depth to which they press the surface, h the pin's height. At the
minimum the gradient CN + h is the same at all nodes: the approach. Search directions have ΣN = 0, which keeps the load. The
preconditioner is the inverse convolution, restricted to the nodes of the set, less a multiple of its answer to a unit gradient,
so that the sum is 0. It is so near to the inverse that a handful of steps is enough, on 10² or 10⁵ nodes alike. A contact of
many separate spots takes some dozens.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.elasticity.schemes.half_plane import Convolution

Vector = NDArray[np.float64]

MOST_STEPS = 200
"""Steps after which rounding is all that is left; as many as 83 were seen in one contact."""


class Pressed(NamedTuple):
    """Forces N (n,), 0 beside the contact; w + approach of all nodes (n,); the approach."""

    normal_force: Vector
    v: Vector
    approach: float


def pressed(
    convolution: Convolution, contact: NDArray[np.bool_], heights: Vector, start: Vector, precision: float
) -> Pressed:
    """The nodes of `contact` (n,) brought to these heights (n,) by forces with the sum of `start` (n,), which is 0 beside them.

    precision: of the heights, in L_x.
    """
    free = ~contact
    of_unit = _cut(convolution.forces_about(contact.astype(np.float64)), free)
    share = 1.0 / of_unit.sum()
    force, depth = start, convolution.w(start)  # pushed down as far as pulled up
    gradient, approach = _cut(depth + heights, free), 0.0
    direction, slope = np.zeros_like(start), np.inf
    for _ in range(MOST_STEPS):
        forces = _cut(convolution.forces_about(gradient), free)
        common = float(forces.sum()) * share
        # Without the common part of the gradient the forces that it makes keep their digits.
        approach += common
        gradient = _cut(gradient - common, free)
        if np.abs(gradient).max() <= precision:
            break
        forces -= common * of_unit
        before, slope = slope, float(forces @ gradient)
        direction = slope / before * direction - forces
        moved = convolution.w(direction)
        work = float(direction @ moved)
        if not slope > 0.0 or not work > 0.0:  # rounding
            break
        step = slope / work
        force = force + step * direction
        depth += step * moved
        gradient += step * _cut(moved, free)
    return Pressed(force, approach - depth, approach)


def _cut(values: Vector, free: NDArray[np.bool_]) -> Vector:
    """The values with 0 at free nodes."""
    values[free] = 0.0
    return values
