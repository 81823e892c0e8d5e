"""Checks of a contact that was found: double precision can resolve its numbers, and the pin's slope is small.

Only under a small slope is shear the force along the slab, and pressure the force across it.
"""

import math
import sys

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.contact.kernels.violations import STEEPEST
from nanoslip.solver.contact.outcomes import NOT_FINITE, STEEP_PIN
from nanoslip.solver.contact.pin import pin_of, surface_from_pin
from nanoslip.solver.elasticity.compliance import Compliance
from nanoslip.solver.outcome import COMPLETED, Ending, Outcome

Vector = NDArray[np.float64]

COARSEST = 1e-4
"""Rounding of the pin's heights, as a share of what the load displaces, beyond which it decides: measured,
forces change by 1.4 times that share of the load when every height changes by a rounding."""


def soundness(
    case: Case, compliance: Compliance, contact: NDArray[np.bool_], u: Vector, displacement: float
) -> Outcome:
    """COMPLETED where a contact of these nodes, (n,), with displacements u (n,) means something, else why not."""
    xi = (surface_from_pin(case) + u - displacement)[contact]
    outermost = float(np.abs(xi).max(initial=0.0))
    if not math.isfinite(outermost):
        return NOT_FINITE
    share = rounding_share(case, compliance, contact, outermost)
    if not share <= COARSEST:
        return Outcome(
            Ending.ROUNDING,
            f"heights of the pin are known to {share:.0e} of what the load displaces, {COARSEST:g} is needed: raise normal_load, "
            "or use a larger radius or lower heights in heterogeneity.roughness",
        )
    return COMPLETED if _steepest(case, xi, outermost) <= STEEPEST else STEEP_PIN


def _steepest(case: Case, xi: Vector, outermost: float) -> float:
    """The largest |slope| of the pin under a contact whose nodes are at ξ: at each of them, and of all between the outermost two.
    A wall between two nodes is none that any of them stands on, and the pin drags it over them all the same."""
    pin = pin_of(case)
    if pin.knots is None or not len(xi):  # a smooth pin is steepest at the outermost
        return pin.curvature * outermost
    at_nodes = float(np.abs(pin.slope(xi)).max())
    return max(at_nodes, pin.steepest(xi.min(keepdims=True), xi.max(keepdims=True)))


def rounding_share(case: Case, compliance: Compliance, contact: NDArray[np.bool_], outermost: float) -> float:
    """Rounding of the pin's heights up to |ξ| = outermost, of the nodes of `contact`, over what the load would displace one of
    them; 0 without contact.

    A rough pin's height is a sum of larger ones, parabola and profile, and any point of the profile may be the next to touch.
    """
    if not contact.any():
        return 0.0
    pin = pin_of(case)
    highest = pin.curvature * (outermost * outermost) / 2
    if pin.rises is not None:
        highest += float(np.abs(pin.rises).max())
    displaced = case.normal_load * float(np.abs(compliance.under_itself()[contact]).max())
    return sys.float_info.epsilon * highest / displaced
