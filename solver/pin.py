"""The rigid pin: its height above its lowest point, and the undeformed gap (Figure 1)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solver.case import Case


@dataclass(frozen=True, slots=True)
class Pin:
    """A pin whose height at pin coordinate ξ is curvature·ξ²/2 for |ξ| ≤ half_width, and out of reach beyond.

    curvature: L_x/R of a parabola, 0 for a flat punch. half_width: of a flat punch, rounded to whole nodes; infinite for a
    parabola.
    """

    curvature: float
    half_width: float

    def height(self, xi: NDArray[np.float64]) -> NDArray[np.float64]:
        """Height of the pin's surface above its lowest point at ξ (any shape), in L_x; infinite beyond the pin."""
        return np.where(np.abs(xi) <= self.half_width, self.curvature * xi**2 / 2, np.inf)


def pin_of(case: Case) -> Pin:
    """The pin of `case`."""
    if case.pin == "parabola":
        return Pin(curvature=1.0 / case.radius, half_width=math.inf)
    # A node stands for its width of surface: it is under the punch while the greater part of that is.
    return Pin(curvature=0.0, half_width=case.half_width + 0.499 * case.slab.spacing)
