"""Small hand-made drives that together take every branch of the friction law, and a slow, independent integrator."""

import math
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.friction_limit import FrictionLimit
from nanoslip.solver.dynamics.integrators import integrate
from nanoslip.solver.dynamics.result import DynamicsResult
from tests.synthetic import profile_through

K = 5.0


class Problem(NamedTuple):
    """A profile and how the pin is pulled over it; k = 1, so that times are in natural periods/2π."""

    profile: FrictionLimit
    damping_ratio: float
    stage_velocity: float
    duration: float

    def drive(self, **changed) -> Drive:
        given = {"duration": self.duration, "samples": 100, **changed}
        return Drive(1.0, self.damping_ratio, self.stage_velocity, **given)

    def driven(self, contact=K, **changed) -> DynamicsResult:
        return integrate(self.profile, self.drive(**changed), contact)


# Rises to a static peak of 3 almost as steeply as the contact, then steady teeth about 0.5.
PEAK = profile_through([0.0, 0.62, 0.75, 0.83, 1.0], [0.0, 0.55, 0.45, 0.5], [3.0, 0.6, 0.55, 0.65], periodic_from=1)
STEEP = profile_through([0.0, 0.2, 0.26, 0.3, 0.42], [0.5, 0.3, 0.2, 0.5], [1.0, 0.8, 0.6, 0.7], periodic_from=1)
JOINED = profile_through(
    [0.0, 0.3, 0.4, 0.6, 0.66, 0.8], [0.0, 1.2, 0.4, 0.9, 0.1], [1.2, 0.4, 0.9, 0.1, 1.2], periodic_from=1
)
ONE_TOOTH = profile_through([0.0, 0.1], [0.6], [0.9])
RISING_EVENT = profile_through([0.0, 0.25, 0.35, 0.5], [0.0, 0.7, 0.9], [0.9, 0.8, 1.0], periodic_from=1)

PROBLEMS = {
    "stick-slip with reversal onto the negative branch": Problem(PEAK, 0.1, 0.2, 25.0),
    "no damping": Problem(PEAK, 0.0, 0.2, 25.0),
    "critical damping": Problem(PEAK, 1.0, 0.2, 25.0),
    "more than critical damping": Problem(PEAK, 2.5, 0.2, 25.0),
    "damping critical to the stuck pin": Problem(PEAK, math.sqrt(1.0 + K), 0.2, 25.0),
    "teeth steeper than the contact": Problem(STEEP, 0.05, 0.3, 12.0),
    "falling teeth": Problem(JOINED, 0.05, 0.3, 15.0),
    "one tooth for ever": Problem(ONE_TOOTH, 0.1, 0.3, 12.0),
    "a force that rises at an event": Problem(RISING_EVENT, 0.02, 0.15, 15.0),
}


def _many_small_teeth(count: int = 120, seed: int = 2022) -> FrictionLimit:
    """A rise to 0.6, then teeth of any slope, most steeper than K, about 0.5: phases below 0.03 at v = 0.3."""
    rng = np.random.default_rng(seed)
    widths, slopes = rng.uniform(0.0002, 0.003, count), rng.uniform(-3.0, 2.0 * K, count)
    slopes[rng.random(count) < 0.7] = 1.2 * K
    starts = rng.uniform(0.495, 0.505, count)
    edges = np.cumsum(np.concatenate([[0.0, 0.2], widths]))
    return profile_through(edges, [0.0, *starts], [0.6, *(starts + slopes * widths)], periodic_from=1)


SMALL_TEETH = Problem(_many_small_teeth(), 0.1, 0.3, 8.0)
"""Most of it is crossed the short way."""


def tooth_of(profile: FrictionLimit, index: int) -> tuple[float, float, float, float]:
    """Edges, force at the left and slope of tooth `index`, which may be beyond the period or, negative, mirrored."""
    if index < 0:
        left, right, force, slope = tooth_of(profile, -1 - index)
        return -right, -left, force + slope * (right - left), -slope
    lap = max(0, (index - profile.periodic_from) // (len(profile.force) - profile.periodic_from))
    j = index - lap * (len(profile.force) - profile.periodic_from)
    shift = lap * profile.period
    return profile.edges[j] + shift, profile.edges[j + 1] + shift, profile.force[j], profile.slope[j]


def _event(function, direction):
    function.terminal, function.direction = True, direction
    return function


def reference(problem: Problem, end: float) -> np.ndarray:
    """Position, velocity, friction at `end` by an adaptive method of order 8 with event location (scipy's DOP853)."""
    damping, V = 2.0 * problem.damping_ratio, problem.stage_velocity
    t, index, state = 0.0, 0, np.zeros(3)
    while t < end:
        left, right, base, slope = tooth_of(problem.profile, index)
        x, v, friction = state
        limit = base + slope * (x - left)
        friction = min(max(friction, -limit), limit)
        acceleration = V * t - x + damping * (V - v) - friction
        way = math.copysign(1.0, v if v != 0.0 else acceleration if abs(acceleration) > 1e-13 else 1.0)
        if friction >= limit and (slope - K) * way < 0.0:
            rate, friction = slope, limit
        elif friction <= -limit and (slope + K) * way < 0.0:
            rate, friction = -slope, -limit
        else:
            rate = K

        def motion(t, y, rate=rate):
            return [y[1], V * t - y[0] + damping * (V - y[1]) - y[2], rate * y[1]]

        def at_limit(y, left=left, base=base, slope=slope):
            return base + slope * (y[0] - left)

        events = [_event(lambda t, y, to=right: y[0] - to, 1), _event(lambda t, y, to=left: y[0] - to, -1)]
        if rate == K:
            events += [_event(lambda t, y, at=at_limit, way=way: at(y) - way * y[2], -1) for way in (1.0, -1.0)]
        else:
            events += [_event(lambda t, y: y[1], -way)]
        exactly = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14, "max_step": 0.02}
        piece = solve_ivp(motion, (t, end), [x, v, friction], events=events, **exactly)
        t, state = piece.t[-1], piece.y[:, -1]
        happened = [len(times) > 0 for times in piece.t_events]
        if happened[0]:
            index, state[0] = index + 1, right
        elif happened[1]:
            index, state[0] = index - 1, left
        elif rate != K and happened[2]:
            state[1] = 0.0
        elif any(happened):
            state[2] = at_limit(state) if happened[2] else -at_limit(state)
    return state
