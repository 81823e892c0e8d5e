"""Normal forces of a given contact at a given load, by conjugate gradients: the surface under each node at its height.

Of all forces N with ΣN = W on these nodes they have the least energy N·CN/2 + h·N (CN: how deep they press the surface, h: the
pin's heights), so that its gradient CN + h is the same at all of them: the approach. A direction with ΣN = 0 keeps the load. It
is made of the gradient by the inverse convolution, cut down to the nodes, less a share of what a unit gradient makes, so that
its sum is 0. That is so near to solving for the forces that a handful of steps is enough, on 10² or 10⁵ nodes alike; where a
contact falls into many spots, some dozens.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.elasticity.schemes.convolution import Convolution

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
