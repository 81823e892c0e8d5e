"""The limit of shear of a node, τ_0·area + μ_i·N: the only place where it is defined.

A strength τ_0 needs no pressure (Bowden and Tabor): where the pressure falls to 0 a node still bears τ_0·area, and is
released with the shear that it has then.
"""

import math

import numpy as np

from nanoslip.solver.arrays import Floats, Nodes, Vector
from nanoslip.solver.case import Case
from nanoslip.solver.contact.pin import node_factors, node_friction


def node_strength(case: Case, areas: float | Vector, first_node: int = 0) -> Floats:
    """Shear that each node bears without pressure, τ_0·area, (n,); of spread limits its share of the mean.

    areas: of the surface that belongs to each node (`Compliance.widths`).
    """
    return np.asarray(case.slip_rule.strength * areas * node_factors(case, first_node))


def node_limit(case: Case, areas: float | Vector, normal_force: Vector, first_node: int = 0) -> Floats:
    """Largest shear force of each node under its normal force, (n,); with areas of 1 and pressures the largest traction."""
    friction = node_friction(case, first_node)
    # Not everywhere: nodes that never slip have an infinite μ_i, also without a force.
    pressed = np.multiply(friction, normal_force, out=np.zeros_like(friction), where=normal_force != 0.0)
    return node_strength(case, areas, first_node) + pressed


def limit_over_pressure(case: Case, pressure: Vector, first_node: int = 0) -> Floats:
    """The limit of each node over its pressure, (n,): at least μ_i; infinite without pressure where there is a strength."""
    strength = node_strength(case, 1.0, first_node)
    unpressed = np.where(strength > 0.0, math.inf, 0.0)
    above = np.divide(strength, pressure, out=unpressed, where=pressure > 0.0)
    return np.asarray(node_friction(case, first_node) + above)


def contact_limit(case: Case, area: float) -> float:
    """Friction force at which all nodes of a contact of this area slide, μ_i·W + τ_0·area, in G·L_x·L_y."""
    return case.intrinsic_friction * case.normal_load + case.slip_rule.strength * area


def contact_area(contact: Nodes, areas: Vector) -> float:
    """True contact area, of the nodes (n,) in contact: in L_x of a row, in L_x² of a plane."""
    return float(areas[contact].sum())


def half_width_area(case: Case, half_width: float) -> float:
    """Area of a contact of this half-width."""
    return math.pi * half_width**2 if case.slab.scheme.planar else 2.0 * half_width
