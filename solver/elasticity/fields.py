"""Displacements and stresses at every node inside the slab."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.parameter import quantity

Vector = NDArray[np.float64]


def inside(meaning: str, name: str, **more: Any) -> dict[str, Any]:
    """Declaration of a result's column that has one value for each node inside the slab."""
    return quantity(meaning, name, along="interior_node", **more)


@dataclass(frozen=True, slots=True, eq=False)
class InteriorFields:
    """Displacements and stresses at every node of the slab's grid, row by row from the surface down; arrays (nodes,).

    x from the slab's middle, z ≤ 0 from the undeformed surface; u, w in L_x; stresses in G, tension positive.
    """

    x: Vector = field(metadata=inside("x from the slab's middle, in L_x", "x", coordinate=True, symbol="x/L_x"))
    z: Vector = field(
        metadata=inside(
            "z above the surface, in L_x",
            "z",
            coordinate=True,
            symbol="z/L_x",
            comment="from the undeformed surface: 0 or less",
        )
    )
    u: Vector = field(metadata=inside("displacement to the right, in L_x", "u", symbol="u/L_x"))
    w: Vector = field(metadata=inside("displacement upwards, in L_x", "w", symbol="w/L_x"))
    stress_xx: Vector = field(
        metadata=inside("normal stress along x, in W/(L_x·L_y)", "stress_xx", symbol="σ_xx", per="contact_load")
    )
    stress_zz: Vector = field(
        metadata=inside("normal stress along z, in W/(L_x·L_y)", "stress_zz", symbol="σ_zz", per="contact_load")
    )
    stress_xz: Vector = field(
        metadata=inside("shear stress, in W/(L_x·L_y)", "stress_xz", symbol="σ_xz", per="contact_load")
    )
