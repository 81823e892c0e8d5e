"""Displacements and stresses at every node inside the slab."""

from dataclasses import dataclass
from typing import Final

from nanoslip.solver.arrays import Vector
from nanoslip.solver.parameter import STRESS, quantity

EACH: Final = {"along": "interior_node"}
"""A column has one value for each node inside the slab."""


@dataclass(frozen=True, slots=True, eq=False)
class InteriorFields:
    """Displacements and stresses at every node of the slab's grid, row by row from the surface down; arrays (nodes,).

    x from the slab's middle, z ≤ 0 from the undeformed surface; u, w in L_x; stresses in G, tension positive.
    """

    x: Vector = quantity("x from the slab's middle", "x", **EACH, coordinate=True, symbol="x/L_x", measure="L_x")
    z: Vector = quantity(
        "z above the surface",
        "z",
        **EACH,
        coordinate=True,
        symbol="z/L_x",
        comment="from the undeformed surface: 0 or less",
        measure="L_x",
    )
    u: Vector = quantity("displacement to the right", "u", **EACH, symbol="u/L_x", measure="L_x")
    w: Vector = quantity("displacement upwards", "w", **EACH, symbol="w/L_x", measure="L_x")
    stress_xx: Vector = quantity("normal stress along x", "stress_xx", **EACH, symbol="σ_xx", **STRESS)
    stress_zz: Vector = quantity("normal stress along z", "stress_zz", **EACH, symbol="σ_zz", **STRESS)
    stress_xz: Vector = quantity("shear stress", "stress_xz", **EACH, symbol="σ_xz", **STRESS)
