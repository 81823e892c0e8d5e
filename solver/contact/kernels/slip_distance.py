"""How far one node slips along the pin until its shear has fallen to what a slip leaves."""

import numpy as np

from nanoslip.solver.compiled import chosen_by_type, is_named_tuple
from nanoslip.solver.contact.kernels.pin_height import first_root, knot_ahead, piece_entered, rise_slope, rough_height
from nanoslip.solver.contact.kernels.state import Floats, RoughPin


def slip_move(
    y: Floats, tableau: Floats, node_friction: Floats, i: int, xi: float, pin: float | RoughPin, residual_shear: float
) -> tuple[float, float]:
    """How far node i slips along and down the pin, the others held; infinite where no distance lowers its shear enough.

    Compiled for a smooth pin or a rough one.
    """
    raise NotImplementedError


def _slip_on_smooth(
    y: Floats, tableau: Floats, node_friction: Floats, i: int, xi: float, curvature: float, residual_shear: float
) -> tuple[float, float]:
    """The shear that exceeds residual_shear·μ_i·pressure is quadratic in the distance, as the pin's height under the node is."""
    n = len(node_friction)
    share = residual_shear * node_friction[i] * (1.0 if y[i] > 0.0 else -1.0)
    excess = y[i] + share * y[n + i]
    down = curvature * (tableau[n + i, i] + share * tableau[n + i, n + i])
    linear = tableau[i, i] + share * tableau[i, n + i] + down * xi
    discriminant = linear * linear - 2.0 * down * excess
    if not (linear > 0.0 and discriminant >= 0.0):
        return np.inf, 0.0
    distance = -2.0 * excess / (linear + np.sqrt(discriminant))
    return distance, curvature * distance * (xi + 0.5 * distance)


def slip_on_rough(
    y: Floats, tableau: Floats, node_friction: Floats, i: int, xi: float, pin: RoughPin, residual_shear: float
) -> tuple[float, float]:
    """The same from knot to knot, the way the shear pushes: the node rests where the excess is first gone."""
    n = len(node_friction)
    share = residual_shear * node_friction[i] * (1.0 if y[i] > 0.0 else -1.0)
    excess = y[i] + share * y[n + i]
    along = tableau[i, i] + share * tableau[i, n + i]
    down = tableau[n + i, i] + share * tableau[n + i, n + i]
    sense = -1 if excess > 0.0 else 1
    k = piece_entered(pin, xi, sense)
    here = xi
    while True:
        linear = along + down * (pin.curvature * here + rise_slope(pin, k))
        quadratic = -sense * 0.5 * down * pin.curvature
        far = knot_ahead(pin, k, sense)
        step = first_root(abs(excess), -linear, quadratic)
        if step <= abs(far - here):
            distance = here - xi + sense * step
            return distance, rough_height(pin, xi + distance) - rough_height(pin, xi)
        if abs(far) == np.inf:
            return np.inf, 0.0
        # Rounding must not turn a knot's little rest into an excess of the other sign.
        excess = -sense * max(abs(excess) - linear * abs(far - here) + quadratic * (far - here) ** 2, 0.0)
        here = far
        k += sense


@chosen_by_type(slip_move)
def _choose_slip(y, tableau, node_friction, i, xi, pin, residual_shear):  # type: ignore[no-untyped-def]
    return slip_on_rough if is_named_tuple(pin) else _slip_on_smooth
