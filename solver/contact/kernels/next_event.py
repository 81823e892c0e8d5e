"""The next event along the rate: the smallest step at which a node slips, is released or touches."""

import numpy as np

from nanoslip.solver.compiled import chosen_by_type, compiled, is_named_tuple
from nanoslip.solver.contact.kernels.enumerations import EventKind
from nanoslip.solver.contact.kernels.pin_height import first_root, knot_ahead, piece_entered, rise_slope, rough_height
from nanoslip.solver.contact.kernels.state import KernelConstants, KernelState, RoughPin
from nanoslip.solver.contact.kernels.violations import TIE

EDGE = 1e-9
"""Relative distance inside a punch's edge at which a node counts as under it."""


@compiled()
def next_event(state: KernelState, constants: KernelConstants, pin_rate: float) -> tuple[float, EventKind, int]:
    """Smallest step along the rate at which a constraint is reached, with its kind and node; infinite if there is none.

    Of ties (TIE) it is the node further right: which of two mirror nodes comes first is not left to rounding.
    pin_rate: pin displacement per unit step (1 in sliding, 0 in loading).
    """
    n = len(state.x)
    nearest, kind, node = np.inf, EventKind.NOTHING, -1
    horizon = _horizon(constants.pin, state, constants.slip.opposite)
    for i in range(n - 1, -1, -1):
        if state.contact[i]:
            step, what = _step_to_limit(state, constants.slip.opposite, i)
        else:
            step, what = _step_to_touch(state, constants, i, pin_rate, min(nearest, horizon)), EventKind.TOUCH
        if step < nearest * (1.0 - TIE):
            kind, node = what, i
        nearest = min(nearest, step)
    return nearest, kind, node


def _horizon(pin: float | RoughPin, state: KernelState, opposite: float) -> float:
    """A step beyond which no touch is looked for: going along a rough pin takes time, a smooth one has no such limit."""
    raise NotImplementedError


def _no_horizon(curvature: float, state: KernelState, opposite: float) -> float:
    return np.inf


def _next_slip_or_release(pin: RoughPin, state: KernelState, opposite: float) -> float:
    nearest = np.inf
    for i in range(len(state.x)):
        if state.contact[i]:
            nearest = min(nearest, _step_to_limit(state, opposite, i)[0])
    return nearest * (1.0 + 1e-9)  # what comes first by rounding alone is still seen


@chosen_by_type(_horizon)
def _choose_horizon(pin, state, opposite):  # type: ignore[no-untyped-def]
    return _next_slip_or_release if is_named_tuple(pin) else _no_horizon


@compiled()
def _step_to_limit(state: KernelState, opposite: float, i: int) -> tuple[float, EventKind]:
    """Step at which contact node i slips (limited shear = μ_i·pressure) or is released (pressure = 0)."""
    n = len(state.x)
    pressure, pressure_rate = -state.response[n + i], -state.rate[n + i]
    release = max(pressure, 0.0) / -pressure_rate if pressure_rate < 0.0 else np.inf
    mu = state.node_friction[i]
    slip = np.inf
    if not state.sticks[i]:
        for sign in (1.0, opposite):
            excess = sign * state.response[i] - mu * pressure
            excess_rate = sign * state.rate[i] - mu * pressure_rate
            if excess_rate > 0.0 and sign != 0.0:
                slip = min(slip, max(-excess, 0.0) / excess_rate)
    if release <= slip * (1.0 + 1e-12):
        return release, EventKind.RELEASE
    return slip, EventKind.SLIP


@compiled()
def _step_to_touch(state: KernelState, constants: KernelConstants, i: int, pin_rate: float, nearest: float) -> float:
    """Step at which free node i meets the pin: the gap is quadratic in the step. Of no interest beyond `nearest`."""
    n = len(state.x)
    xi, xi_rate = state.x[i] + state.response[i] - state.scalars.displacement, state.rate[i] - pin_rate
    height, height_rate = state.response[n + i], state.rate[n + i]
    if abs(xi) > constants.half_width:
        # Outside a flat punch: the edge arrives, and meets a node that stands above the punch's face.
        if xi * xi_rate >= 0.0:
            return np.inf
        step = (abs(xi) - constants.half_width * (1.0 - EDGE)) / abs(xi_rate)
        return step if height + height_rate * step >= 0.0 else np.inf
    return float(_step_to_profile(constants.pin, xi, xi_rate, height, height_rate, nearest))


def _step_to_profile(
    pin: float | RoughPin, xi: float, xi_rate: float, height: float, height_rate: float, nearest: float
) -> float:
    """Step at which a node at ξ and this height meets a pin without edges. Compiled for a smooth pin or a rough one."""
    raise NotImplementedError


def _step_to_smooth(
    curvature: float, xi: float, xi_rate: float, height: float, height_rate: float, nearest: float
) -> float:
    gap = 0.5 * curvature * xi * xi - height
    linear = curvature * xi * xi_rate - height_rate
    quadratic = 0.5 * curvature * xi_rate * xi_rate
    if linear >= 0.0:
        return np.inf
    if gap <= 0.0:
        return 0.0
    discriminant = linear * linear - 4.0 * quadratic * gap
    if discriminant < 0.0:
        return np.inf
    return float(2.0 * gap / (-linear + np.sqrt(discriminant)))


def _step_to_rough(
    pin: RoughPin, xi: float, xi_rate: float, height: float, height_rate: float, nearest: float
) -> float:
    """From knot to knot, to where the gap first closes; a node that lies inside and closes in has met the pin."""
    sense = 1 if xi_rate > 0.0 else -1
    k = piece_entered(pin, xi, sense)
    here, passed, gap = xi, 0.0, rough_height(pin, xi) - height
    quadratic = 0.5 * pin.curvature * xi_rate * xi_rate
    while passed < nearest:
        linear = (pin.curvature * here + rise_slope(pin, k)) * xi_rate - height_rate
        far = knot_ahead(pin, k, sense)
        longest = (far - here) / xi_rate if xi_rate != 0.0 else np.inf
        if linear < 0.0 and gap <= 0.0:
            return passed
        step = first_root(max(gap, 0.0), linear, quadratic) if gap > 0.0 else np.inf
        if step <= longest:
            return passed + step
        if longest == np.inf:
            return np.inf
        gap += longest * (linear + longest * quadratic)
        passed += longest
        here = far
        k += sense
    return np.inf


@chosen_by_type(_step_to_profile)
def _choose_step(pin, xi, xi_rate, height, height_rate, nearest):  # type: ignore[no-untyped-def]
    return _step_to_rough if is_named_tuple(pin) else _step_to_smooth
