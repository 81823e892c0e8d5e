"""Contact without shear on a surface without ends: no matrix, displacements by FFT."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Nodes, Vector
from nanoslip.solver.case import Case
from nanoslip.solver.contact.normal import Exchange, NormalContact, rounding_at_rest, wrong_nodes
from nanoslip.solver.contact.pin import guess_contact, make_pin, surface_from_axis, surface_from_pin
from nanoslip.solver.elasticity.schemes.endless import SurfaceConvolution

# Normal forces of a given contact set at a given load, by preconditioned conjugate gradients.
#
# They minimize the energy N·CN/2 + h·N under ΣN = W. CN is the depth to which they press the surface, h the pin's height. At
# the minimum the gradient CN + h is the same at all nodes: the approach. Search directions have ΣN = 0, which keeps the load.
# The preconditioner is the inverse convolution, restricted to the nodes of the set, less a multiple of its answer to a unit
# gradient, so that the sum is 0. It is so near to the inverse that a handful of steps is enough, on 10² or 10⁵ nodes alike. A
# contact of many separate spots takes some dozens.


MOST_STEPS = 200
"""Largest number of steps; beyond it only rounding is left. Up to 83 steps were seen in one contact."""


class Pressed(NamedTuple):
    """Forces N (n,), 0 beside the contact; w + approach of all nodes (n,); the approach."""

    normal_force: Vector
    v: Vector
    approach: float


def press_by_convolution(
    convolution: SurfaceConvolution, contact: NDArray[np.bool_], heights: Vector, start: Vector, precision: float
) -> Pressed:
    """The nodes of `contact` (n,) brought to these heights (n,) by forces with the sum of `start` (n,), which is 0 beside them.

    precision: of the heights, in L_x.
    """
    free = ~contact
    of_unit = _cut(convolution.forces_about(contact.astype(np.float64)), free)
    share = 1.0 / of_unit.sum()
    force, depth = start, convolution.w(start)  # N pushes down as far as f_z lifts
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
        # Fletcher and Reeves. At first `before` is infinite, which leaves the steepest descent.
        direction = slope / before * direction - forces
        moved = convolution.w(direction)
        work = float(direction @ moved)
        if not slope > 0.0 or not work > 0.0:  # rounding
            break
        step = slope / work
        force = force + step * direction
        # Updated, not convolved again: a step costs one convolution for forces and one for displacements.
        depth += step * moved
        gradient += step * _cut(moved, free)
    return Pressed(force, approach - depth, approach)


def _cut(values: Vector, free: NDArray[np.bool_]) -> Vector:
    """The values with 0 at free nodes."""
    values[free] = 0.0
    return values


# Press the pin down on a surface without ends (§3.1): contact set, pressures and approach at a given load, without a matrix.
#
# It finds the same contact as `normal` does from a matrix, where shear is zero: without coupling, or without friction, where
# pressure moves the surface sideways under the pin. A round costs some convolutions, n log n, in place of a solve for all nodes
# in contact.


FIRST, LAST = 1e-2, 1e-14
"""Precision of heights, over what the load displaces a node that bears it alone: of the first round, times the nodes, each of
which bears the less the more they are; and of the contact found."""
FINER = 0.5
"""Factor by which the precision is refined in every round that finds wrong nodes."""
MOST_ROUNDS = 200
"""Rounds after which no contact set is looked for any more. Some 25 do for pins smooth or rough; nodes that move sideways on
flanks of 45°, the steepest that mean something, 104 at ν = -1 and 43 at 0."""


def convolve_contact(case: Case, convolution: SurfaceConvolution) -> NormalContact:
    """The contact at the case's load of a pin that drags nothing.

    Wrong nodes are exchanged as in `normal`. Pressure moves nodes sideways under the pin; the heights of a round are
    taken at the positions of the round before. This converges: a round moves nodes by at most (1-2ν)/(2-2ν) times the
    pin's slope times the last move.
    """
    x, away, pin = surface_from_pin(case), surface_from_axis(case), make_pin(case)
    heights, u = pin.unbounded_height(x), np.zeros_like(x)
    contact = guess_contact(case)
    force = np.where(contact, case.normal_load / contact.sum(), 0.0)
    scale, precision, exchange = case.normal_load * convolution.own_displacement, FIRST / len(x), Exchange(away)
    for _ in range(MOST_ROUNDS):
        lowest = float(heights[contact].min())  # differences of heights are exact, large ones have fewer digits
        force, v, approach = press_by_convolution(convolution, contact, heights - lowest, force, precision * scale)
        before, u = u, _sideways(case, convolution, force)
        heights = pin.unbounded_height(x + u)
        pressed = NormalContact(contact, force, u, v + lowest, approach + lowest, converged=True)
        wrong = wrong_nodes(case, pressed)
        if not wrong.any():
            if precision == LAST and np.abs(u - before).max() <= rounding_at_rest(case, pressed):
                return pressed
            # The set is right at a coarse precision: once more, as exactly as it will be stated.
            precision = LAST
            continue
        contact, all_at_once, _ = exchange.exchange_wrong_nodes(contact, wrong)
        # One node at a time rests on the sign of single forces: only exact ones can decide it.
        precision = max(precision * FINER, LAST) if all_at_once else LAST
        force = _spread(case, contact, force)
    return pressed._replace(contact=contact, normal_force=force, converged=False)


def _sideways(case: Case, convolution: SurfaceConvolution, force: Vector) -> Vector:
    """u (n,) under normal forces N (n,), limited to the effect of the load: during iteration nodes may pull by any amount."""
    if not case.effects.coupling:
        return np.zeros_like(force)
    most = convolution.most_across * case.normal_load
    return np.asarray(np.clip(convolution.u(-force), -most, most))


def _spread(case: Case, contact: Nodes, force: Vector) -> Vector:
    """First forces on the nodes of a new contact, (n,): their previous ones, scaled to the whole load."""
    kept = np.where(contact, np.maximum(force, 0.0), 0.0)
    total = float(kept.sum())
    if total > 0.0:
        return kept * (case.normal_load / total)
    return np.where(contact, case.normal_load / contact.sum(), 0.0)
