"""Displacements and stresses at every node inside the slab."""

from dataclasses import dataclass
from typing import Any

from nanoslip.solver.arrays import Vector
from nanoslip.solver.parameter import quantity


def inside(meaning: str, name: str, **more: Any) -> Any:
    """A field that is a column, and has one value for each node inside the slab."""
    return quantity(meaning, name, along="interior_node", **more)


@dataclass(frozen=True, slots=True, eq=False)
class InteriorFields:
    """Displacements and stresses at every node of the slab's grid, row by row from the surface down; arrays (nodes,).

    x from the slab's middle, z ≤ 0 from the undeformed surface; u, w in L_x; stresses in G, tension positive.
    """

    x: Vector = inside("x from the slab's middle", "x", coordinate=True, symbol="x/L_x", measure="L_x")
    z: Vector = inside(
        "z above the surface",
        "z",
        coordinate=True,
        symbol="z/L_x",
        comment="from the undeformed surface: 0 or less",
        measure="L_x",
    )
    u: Vector = inside("displacement to the right", "u", symbol="u/L_x", measure="L_x")
    w: Vector = inside("displacement upwards", "w", symbol="w/L_x", measure="L_x")
    stress_xx: Vector = inside(
        "normal stress along x", "stress_xx", symbol="σ_xx", per="contact_load", measure="W/(L_x·L_y)"
    )
    stress_zz: Vector = inside(
        "normal stress along z", "stress_zz", symbol="σ_zz", per="contact_load", measure="W/(L_x·L_y)"
    )
    stress_xz: Vector = inside("shear stress", "stress_xz", symbol="σ_xz", per="contact_load", measure="W/(L_x·L_y)")
