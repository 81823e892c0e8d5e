"""The closed form of stick-slip (Eq. 16-19), and its fit to a drive: mass 1, spring k, damper c = 2ζ√k, stage velocity V.

The printed velocity of Eq. 17 is not the derivative of the printed position: its sine lacks V ζ ω_n/ω_d. Here both follow
from one solution.
"""

import math
from dataclasses import dataclass, field
from functools import cache
from typing import Any, Final

import numpy as np
import scipy

from nanoslip.solver.arrays import Floats
from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.result import DynamicsResult
from nanoslip.solver.parameter import quantity

# Phases, and velocities over V, that rounding may make of 0.
_ROUNDING = 1e-12
_ULP = 2.0 * float(np.finfo(float).eps)
_MOST_STEPS: Final = 100


@dataclass(frozen=True, slots=True)
class Oscillator:
    """Eq. 12 with a constant friction force, from a given state on: x'' = k(Vt - x) + c(V - x') - friction_force.

    Units of nanoslip.solver.case.Drive. Any damping ratio ζ ≥ 0; Eq. 17 is the case of ζ < 1 and velocity = 0.
    """

    spring_stiffness: float
    damping_ratio: float
    stage_velocity: float
    friction_force: float
    time: float = 0.0
    position: float = 0.0
    velocity: float = 0.0

    def motion(self, time: Floats) -> tuple[Floats, Floats]:
        """Position and velocity at each time (n,)."""
        return self._motion(time, np)

    def compute_position(self, time: float) -> float:
        """Position at one time."""
        return float(self._motion(time, math)[0])

    def _motion(self, time: Any, functions: Any) -> tuple[Any, Any]:
        """functions: of numpy for many times, of `math` for one, which is thirty times as fast."""
        steady = self.stage_velocity * time - self.friction_force / self.spring_stiffness
        distance, speed = self._start()
        h, rate = self._impulse_response(time - self.time, functions)
        damping = 2.0 * self.damping_ratio * math.sqrt(self.spring_stiffness)
        # Relative to steady sliding, y = x - (Vt - F/k) is free: y'' + c y' + k y = 0. With the impulse response h,
        # y = y_0 (h' + c h) + y'_0 h, and y' = y'_0 h' - k y_0 h, as h'' = -c h' - k h.
        position = steady + distance * (rate + damping * h) + speed * h
        velocity = self.stage_velocity + speed * rate - self.spring_stiffness * distance * h
        return position, velocity

    def first_stop(self, before: float) -> float:
        """First time after the start, and before the given one, at which the pin stops moving forward; NaN if none."""
        if self.damping_ratio >= 1.0:
            return math.nan  # from rest, the velocity passes V once and returns to it from above
        natural = math.sqrt(self.spring_stiffness)
        decay, beat = self.damping_ratio * natural, natural * math.sqrt(1.0 - self.damping_ratio**2)
        distance, speed = self._start()
        # Relative to steady sliding the motion is a free oscillation: its rates follow from distance and velocity.
        acceleration = -2.0 * decay * speed - self.spring_stiffness * distance
        jerk = -2.0 * decay * acceleration - self.spring_stiffness * speed
        # The velocity has extrema half a turn apart, where the acceleration is 0, and bends where the jerk is 0.
        phase = _phase_of_zero(acceleration, jerk, decay, beat)
        bend = _phase_of_zero(jerk, -2.0 * decay * jerk - self.spring_stiffness * acceleration, decay, beat)
        turn = self.time + (phase if phase > _ROUNDING else math.pi) / beat
        for _ in range(3):  # a minimum is among these; later ones are less deep
            if turn - math.pi / beat >= before:
                break
            if self._rates(turn)[0] < -_ROUNDING * self.stage_velocity:
                since_bend = (phase - bend) % math.pi / beat
                stop = self._find_stop(max(turn - since_bend, self.time))
                return stop if stop < before else math.nan
            turn += math.pi / beat
        return math.nan

    def _find_stop(self, time: float) -> float:
        """Find the time when the falling velocity is 0, by Newton's method from its inflection point or a later start.

        Newton's method converges monotonically from there, and quadratically unless the velocity only just reaches zero.
        """
        last = 0.0
        for _ in range(_MOST_STEPS):
            velocity, acceleration = self._rates(time)
            step = -velocity / acceleration
            if abs(step) <= _ULP * time or step * last < 0.0:
                break  # what turns it back is rounding
            time, last = time + step, step
        return time

    def _rates(self, time: float) -> tuple[float, float]:
        """Velocity and acceleration."""
        position, velocity = self._motion(time, math)
        steady = self.stage_velocity * time - self.friction_force / self.spring_stiffness
        # About steady sliding the motion is free: x'' = -c (x' - V) - k (x - steady), with c/2 = ζ ω_n.
        decay = self.damping_ratio * math.sqrt(self.spring_stiffness)
        return velocity, -2.0 * decay * (velocity - self.stage_velocity) - self.spring_stiffness * (position - steady)

    def _start(self) -> tuple[float, float]:
        """Distance and velocity relative to steady sliding, at the start."""
        steady = self.stage_velocity * self.time - self.friction_force / self.spring_stiffness
        return self.position - steady, self.velocity - self.stage_velocity

    def _impulse_response(self, tau: Any, functions: Any) -> tuple[Any, Any]:
        """Free motion that starts with velocity 1 at position 0: position and velocity."""
        natural, exp = math.sqrt(self.spring_stiffness), functions.exp
        decay = self.damping_ratio * natural
        if self.damping_ratio == 1.0:
            return tau * exp(-decay * tau), (1.0 - natural * tau) * exp(-decay * tau)
        beat = natural * math.sqrt(abs(1.0 - self.damping_ratio**2))
        if self.damping_ratio < 1.0:
            envelope = exp(-decay * tau)
            sine, cosine = envelope * functions.sin(beat * tau), envelope * functions.cos(beat * tau)
        else:
            # Two decaying exponentials: hyperbolic functions would overflow before the damping takes hold.
            fast_rate = decay + beat
            slow_rate = natural**2 / fast_rate  # the product of both is the square of the natural frequency
            fast, slow = exp(-fast_rate * tau), exp(-slow_rate * tau)
            sine, cosine = (slow - fast) / 2.0, (slow + fast) / 2.0
        # e^(-ζω_n τ) sin(ω_d τ)/ω_d and its derivative, ω_d = ω_n √(1 - ζ²); of ζ > 1 sinh and cosh with √(ζ² - 1).
        return sine / beat, cosine - decay / beat * sine


def _phase_of_zero(value: float, rate: float, decay: float, beat: float) -> float:
    """Phase, 0 to π, at which a decaying oscillation is first 0 that begins with this value and this rate of change."""
    # e^(-decay τ) (value cos φ + (rate + decay·value)/beat sin φ), φ = beat·τ, vanishes at this φ.
    return math.atan2(-value * beat, rate + decay * value) % math.pi


@dataclass(frozen=True, slots=True, eq=False)
class StickSlip:
    """A stick-slip motion at given times (n,), and when it slipped and stuck again (per slip; NaN if never)."""

    time: Floats
    position: Floats
    velocity: Floats
    spring_force: Floats
    slip_time: Floats
    restick_time: Floats


def stick_slip(
    time: Floats,
    drive: Drive,
    kinetic: float,
    static: float,
    later_static: float | None = None,
    most_slips: float = math.inf,
) -> StickSlip:
    """Eq. 16-19: stick from x = 0 at t = 0, slip at the static friction force, stick where the velocity vanishes, …

    time: (n,), increasing. kinetic, static: forces in G·L_x·L_y; later_static: of every slip but the first. A
    static friction below the kinetic one counts as equal to it. After `most_slips` the pin stays where it is.
    """
    k, stage = drive.spring_stiffness, drive.stage_velocity
    damper = 2.0 * drive.damping_ratio * math.sqrt(k) * stage

    @cache  # all later slips are one
    def slide(force: float) -> tuple[Oscillator, float, float]:
        """A slip from time 0 and position 0 that begins with this spring force: its motion, duration and length."""
        # The spring's pull at the start counts as friction of the other sign: time and position then begin at 0.
        pin = Oscillator(k, drive.damping_ratio, stage, kinetic - force)
        duration = pin.first_stop(math.inf)
        return pin, duration, pin.compute_position(duration)

    starts, ends, forces = list[float](), list[float](), list[float]()
    places, since, limit = [0.0], 0.0, static
    while len(starts) < most_slips and not math.isnan(since):
        # At rest the damper pulls with c V, so the spring only needs the rest; it has it when V t - x is force/k.
        force = max(limit, kinetic) - damper
        start = (force / k + places[-1]) / stage
        if start < since:  # it has stuck with more force than is needed to slip
            start, force = since, k * (stage * since - places[-1])
        if not start < time[-1]:
            break
        _, duration, length = slide(force)
        since = start + duration if start + duration < time[-1] else math.nan
        starts.append(start)
        ends.append(since)
        forces.append(force)
        places.append(places[-1] + length)
        limit = static if later_static is None else later_static
    last = np.searchsorted(starts, time, side="right")  # slips that have begun
    position, velocity = np.array(places)[last], np.zeros_like(time)
    moving = ~(time >= np.array([-math.inf, *ends])[last])
    for force in set(forces):
        those = moving & (np.array([math.nan, *forces])[last] == force)
        slip = last[those] - 1
        since_start = time[those] - np.array(starts)[slip]
        moved, velocity[those] = slide(force)[0].motion(since_start)
        position[those] = np.array(places)[slip] + moved
    spring_force = k * (stage * time - position)
    return StickSlip(time, position, velocity, spring_force, np.array(starts), np.array(ends))


MOST_SLIPS: Final = 128
"""Slips of Eq. 16-19 up to which they are fitted: more take long, and their phases fit nothing."""
MOST_FITTED_SAMPLES: Final = 10_000
"""Times at which the fit looks, evenly chosen from a motion's."""
_MOST_TRIALS: Final = 60
"""Steps of the least squares from one start; some fifteen are enough."""
_UNKNOWNS: Final = 3
_STARTS: Final = (0.0, 0.5, 1.0)
"""Start values of the static friction of later slips: kinetic friction plus this share of the last slip's excess over it."""
_FITTED: Final = "best fit of Eq. 16-19 to the spring force"
_FOUND: Final = 1e-6
"""Relative change of misfit and coefficients at which a search ends."""


@dataclass(frozen=True, slots=True)
class StickSlipFit:
    """Friction coefficients with which Eq. 16-19 fit a spring force best; NaN for a later slip that never came.

    residual: root mean square of measured less fitted force, as a fraction of W. motion: of the closed form, at the
        times of the fit.
    """

    motion: StickSlip = field(repr=False)
    static_friction: float = quantity("fitted static friction coefficient", symbol="μ_s", comment=_FITTED)
    later_static_friction: float = quantity(
        "fitted static friction of later slips", symbol="μ_s", comment=f"{_FITTED}, of every slip except the first"
    )
    kinetic_friction: float = quantity("fitted kinetic friction coefficient", symbol="μ_k", comment=_FITTED)
    residual: float = quantity(
        "residual of the fit, over load",
        "fit_residual",
        comment="root mean square difference between Eq. 16-19 and the spring force, "
        f"at up to {MOST_FITTED_SAMPLES} of the samples; NaN, like the fitted coefficients, without a macroscopic slip, "
        f"with fewer samples than unknowns, and where the drive or Eq. 16-19 slip {MOST_SLIPS} times or more",
    )


def fit_stick_slip(result: DynamicsResult, drive: Drive, normal_load: float) -> StickSlipFit:
    """Fit Eq. 16-19 to the computed spring force by least squares, as the paper does for Figure 9 (§3.3).

    normal_load: W in G·L_x·L_y. Unknowns: one kinetic friction, and static friction of the first slip and of all
    later slips; NaN without a macroscopic slip, after a bad end, or beyond `MOST_SLIPS`. Longer motions are thinned
    to `MOST_FITTED_SAMPLES`.
    """
    if not result.outcome.ok or not 0 < len(result.slip_force) < MOST_SLIPS or len(result.time) < _UNKNOWNS:
        return _NO_FIT
    kept = slice(None, None, math.ceil((len(result.time) - 1) / MOST_FITTED_SAMPLES))
    time, force = result.time[kept], result.spring_force[kept]

    def model(coefficients: Floats) -> StickSlip:
        """coefficients: (3,), of kinetic friction, of static friction, and of static friction in later slips."""
        kinetic, static, later = (float(share) * normal_load for share in coefficients)
        return stick_slip(time, drive, kinetic, static, later, MOST_SLIPS)

    def misfit(coefficients: Floats) -> Floats:
        return (model(coefficients).spring_force - force) / normal_load

    late = force[-len(time) // 4 :]
    first, last = result.slip_force[0], result.slip_force[-1]
    middle = 0.5 * (late.max() + late.min())  # about kinetic friction the force swings evenly
    starts = [np.array([middle, first, middle + share * (last - middle)]) / normal_load for share in _STARTS]
    settings: Any = {"method": "lm", "diff_step": np.full(_UNKNOWNS, 1e-5), "x_scale": 1e-2, "max_nfev": _MOST_TRIALS}
    fits = [  # trust regions would stop where μ_s ≤ μ_k and the misfit is flat
        scipy.optimize.least_squares(misfit, start, ftol=_FOUND, xtol=_FOUND, **settings)
        for start in starts
        if len(model(start).slip_time) < MOST_SLIPS
    ]
    solution = min(fits, key=lambda fit: float(fit.cost)).x
    kinetic, static, later = (
        float(max(share, solution[0])) for share in solution
    )  # static friction is no less than kinetic
    best = model(np.array([kinetic, static, later]))
    if len(best.slip_time) >= MOST_SLIPS:
        return _NO_FIT
    mean_square = np.mean((best.spring_force - force) ** 2)
    residual = float(np.sqrt(mean_square)) / normal_load
    return StickSlipFit(best, static, later if len(best.slip_time) > 1 else math.nan, kinetic, residual)


_NONE = np.empty(0)
_NO_FIT = StickSlipFit(StickSlip(_NONE, _NONE, _NONE, _NONE, _NONE, _NONE), math.nan, math.nan, math.nan, math.nan)
