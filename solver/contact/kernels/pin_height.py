"""Height and slope of the pin: a smooth parabola or flat punch, or a rough parabola from knot to knot."""

import numpy as np

from nanoslip.solver.compiled import chosen_by_type, compiled, inlined, is_named_tuple
from nanoslip.solver.contact.kernels.state import KernelConstants, RoughPin

BLUR = 1e-15
"""Rounding of the pin's height, as a share of it."""


@compiled()
def pin_height(constants: KernelConstants, xi: float) -> float:
    """Height of the pin above its lowest point; infinite beyond its edges."""
    if abs(xi) > constants.half_width:
        return np.inf
    return float(face_height(constants.pin, xi))


def face_height(pin: float | RoughPin, xi: float) -> float:
    """Height of a pin without edges above its lowest point (of a rough one: of its parabola). Compiled for either kind."""
    raise NotImplementedError


def _smooth_height(curvature: float, xi: float) -> float:
    return 0.5 * curvature * xi * xi


@inlined
def rough_height(pin: RoughPin, xi: float) -> float:
    """The same of a rough pin, above the lowest point of its parabola."""
    last = len(pin.knots) - 1
    k = min(max(int(np.searchsorted(pin.knots, xi, side="right")), 1), last)
    along = min(max(xi, pin.knots[0]), pin.knots[last]) - pin.knots[k - 1]
    rise = pin.rises[k - 1] + along * rise_slope(pin, k)
    return float(0.5 * pin.curvature * xi * xi + rise)


@compiled()
def rise_slope(pin: RoughPin, k: int) -> float:
    """Slope of the rise between knots k - 1 and k; level before the first and behind the last."""
    if not 0 < k < len(pin.knots):
        return 0.0
    return float((pin.rises[k] - pin.rises[k - 1]) / (pin.knots[k] - pin.knots[k - 1]))


def pin_slope(pin: float | RoughPin, xi: float) -> float:
    """Slope of a pin without edges at ξ; at a knot, of what lies to its right. Compiled for either kind."""
    raise NotImplementedError


def _smooth_slope(curvature: float, xi: float) -> float:
    return curvature * xi


def _rough_slope(pin: RoughPin, xi: float) -> float:
    return pin.curvature * xi + rise_slope(pin, int(np.searchsorted(pin.knots, xi, side="right")))


@chosen_by_type(pin_slope)
def _choose_slope(pin, xi):  # type: ignore[no-untyped-def]
    return _rough_slope if is_named_tuple(pin) else _smooth_slope


@chosen_by_type(face_height)
def _choose_height(pin, xi):  # type: ignore[no-untyped-def]
    return rough_height if is_named_tuple(pin) else _smooth_height


@compiled()
def piece_entered(pin: RoughPin, xi: float, sense: int) -> int:
    """Number k of the piece between knots k - 1 and k that a node at ξ enters."""
    if sense > 0:
        return int(np.searchsorted(pin.knots, xi, side="right"))
    return int(np.searchsorted(pin.knots, xi, side="left"))


@compiled()
def knot_ahead(pin: RoughPin, k: int, sense: int) -> float:
    """End of the piece between knots k - 1 and k in the direction of `sense`."""
    if sense > 0:
        return float(pin.knots[k]) if k < len(pin.knots) else np.inf
    return float(pin.knots[k - 1]) if k > 0 else -np.inf


@compiled()
def first_root(constant: float, linear: float, quadratic: float) -> float:
    """Smallest t ≥ 0 at which constant + linear·t + quadratic·t², with constant ≥ 0, falls through 0; infinite if none."""
    discriminant = linear * linear - 4.0 * quadratic * constant
    if discriminant < 0.0:
        return np.inf
    bottom = -linear + np.sqrt(discriminant)
    return float(2.0 * constant / bottom) if bottom > 0.0 else np.inf
