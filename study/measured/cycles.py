"""Cycles of stick-slip in a measured force: Eq. 16-19 fitted to each slip, from rise to rise."""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.dynamics.stick_slip import Oscillator
from nanoslip.study.measured.means import Measured, mean_with_error
from nanoslip.study.measured.recording import LEAST_DROP, NOISE
from nanoslip.study.measured.slips import Averaged, TraceSlip

RESOLVED: Final = 8
"""Samples of half an oscillation, above which the shape of a slip determines the damping."""
MOST_CYCLES: Final = 64
"""Most cycles that are fitted, evenly chosen: more add little."""
FASTER: Final = 1e3
"""Factor by which a slip's own frequency may differ from the estimate by its duration."""


@dataclass(frozen=True, slots=True, eq=False)
class Cycle:
    """Eq. 16-19 fitted to a slip: it starts at `start` with the force `static`, and slides against `kinetic`.

    driving: static friction, with the damper's force. trough: the force where the pin sticks again. at, fit: the closed form at
    the times of its stretch. residual: root mean square of measured less fitted force.
    """

    start: float
    static: float
    driving: float
    kinetic: float
    trough: float
    period: float
    damping: float
    residual: float
    at: Floats
    fit: Floats


class FittedCycles(NamedTuple):
    """Cycles of the chosen slips with one common damping; the same with a damping each; and the number that do not fit."""

    cycles: list[Cycle]
    free: list[Cycle]
    chosen: list[int]
    damping: Measured
    unlike: list[int]
    given: bool
    samples: float
    """Samples in a cycle, at the median."""

    def together(self) -> NDArray[np.bool_]:
        """True for each pair of neighbouring cycles without one between them that does not fit."""
        fit = []
        for low, high in pairwise(self.chosen):
            between = [number for number in self.unlike if low < number < high]
            fit.append(not between)
        return np.array(fit, bool)


def fit_cycles(averages: Averaged, whole: list[int], rates: list[float], damping: float | None) -> FittedCycles:
    """Fit Eq. 16-19 to slips. Fits that leave the measured forces and their noise are none."""
    at, slips = averages.trace.at, averages.slips
    places = np.linspace(0, len(whole) - 1, min(len(whole), MOST_CYCLES))
    chosen = [whole[int(place)] for place in places]
    peaks = [slip.peak for slip in slips]
    samples = float(np.median(np.diff(peaks))) if len(peaks) > 1 else math.inf

    def fit(zeta: float | None) -> dict[int, Cycle]:
        good = {}
        for number in chosen:
            cycle = _cycle(averages, number, rates[number], zeta)
            if _is_inside(averages, slips[number], rates[number], cycle):
                good[number] = cycle
        return good

    free = fit(None) if damping is None else {}
    # The fall of a slip takes about half a natural period: its samples show the damping if they are RESOLVED or more.
    resolved = 2.0 * RESOLVED * float(np.median(np.diff(at)))
    own = {number: cycle for number, cycle in free.items() if cycle.period >= resolved}
    own = own if 2 * len(own) >= len(chosen) else {}
    known = Measured(math.nan if damping is None else damping, math.nan, 0)
    if own:
        known = mean_with_error([cycle.damping for cycle in own.values()], "1")
        known = known._replace(value=max(known.value, 0.0))
    found = fit(known.value if math.isfinite(known.value) else 0.0)
    kept = [number for number in found if number in own or not own]
    if 2 * len(kept) < len(chosen):  # the model is not that of this force
        return FittedCycles([], [], [], mean_with_error([], "1"), chosen, damping is not None, samples)
    unlike = [number for number in chosen if number not in kept]
    freely = [own[number] for number in kept if number in own]
    cycles = [found[number] for number in kept]
    return FittedCycles(cycles, freely, kept, known, unlike, damping is not None, samples)


def _is_inside(averages: Averaged, slip: TraceSlip, rate: float, cycle: Cycle) -> bool:
    """True if a fit agrees with the samples of its slip, but for noise, a rise between samples and a tenth of the fall.

    Its forces before and after the slip are near the extremes, friction is between these, and the misfit is as small.
    """
    force = averages.trace.force
    high, low = float(force[slip.peak]), float(force[slip.trough])
    share = LEAST_DROP * (high - low)
    between_samples = abs(rate) * float(np.diff(cycle.at).max())
    room = share + NOISE * averages.noise + between_samples
    near = abs(cycle.static - high) <= room and abs(cycle.trough - low) <= room
    between = low - room <= cycle.kinetic <= high + room
    return near and between and cycle.residual**2 <= share**2 + averages.noise**2


def _cycle(averages: Averaged, number: int, rate: float, damping: float | None) -> Cycle:
    """Fit the closed form to a slip, from the middle of the rise before it to the middle of the rise after it.

    rate: at which the force rises. damping: ζ; None to fit it, and noise may find it below 0.
    """
    at, force, slips = averages.trace.at, averages.trace.force, averages.slips
    slip = slips[number]
    before = slips[number - 1].trough if number else 0
    behind = slips[number + 1].peak if number + 1 < len(slips) else len(at) - 1
    first, last = (before + slip.peak) // 2, (slip.trough + behind) // 2
    time, values = at[first : last + 1], force[first : last + 1]
    drop = float(force[slip.peak] - force[slip.trough])
    falls = force[slip.peak : slip.trough + 1]
    is_high = falls >= force[slip.peak] - 0.25 * drop
    high = slip.peak + int(np.flatnonzero(is_high)[-1])
    fallen = force[high : slip.trough + 1] <= force[slip.trough] + 0.25 * drop
    low = high + int(np.argmax(fallen))
    length = 3.0 * float(at[low] - at[high])  # of half a cosine, a third of its time is the middle half of its fall

    # Unknown are the start, μ_s, μ_k, ω and ζ, in units of the slip's own length and drop; ω by its logarithm, so that it
    # stays above 0.
    def motion(unknown: Floats) -> _Motion:
        omega = math.exp(unknown[3]) / length
        start = at[high] + unknown[0] * length
        static, kinetic = unknown[1] * drop, unknown[2] * drop
        zeta = unknown[4] if damping is None else damping
        return _motion(time, float(start), float(static), float(kinetic), rate, omega, zeta)

    count = 5 if damping is None else 4
    top = force[slip.peak] / drop
    middle = 0.5 * (force[slip.peak] + force[slip.trough]) / drop
    # Half a cosine falls by a quarter in its first third, half a natural period takes the slip's length, ω·length = π.
    guess = [-1.0 / 3.0, top, middle, math.log(math.pi), 0.1][:count]
    ends = np.full(count, np.inf)
    ends[3:] = [math.log(FASTER), 0.9][: count - 3]

    def misfit(unknown: Floats) -> Floats:
        return (motion(unknown).force - values) / drop

    steps = np.full(count, 1e-6)
    best = scipy.optimize.least_squares(misfit, guess, bounds=(-ends, ends), diff_step=steps, max_nfev=60)
    fit = motion(best.x)
    pin = fit.pin
    omega, static = math.sqrt(pin.spring_stiffness), float(best.x[1] * drop)
    squares = np.mean((fit.force - values) ** 2)
    # The damper pulls a pin at rest with c V = 2ζω · rate/ω².
    return Cycle(
        start=pin.time,
        static=static,
        driving=static + 2.0 * pin.damping_ratio / omega * rate,
        kinetic=pin.friction_force,
        trough=fit.trough,
        period=2.0 * math.pi / omega,
        damping=pin.damping_ratio,
        residual=float(np.sqrt(squares)),
        at=time,
        fit=fit.force,
    )


class _Motion(NamedTuple):
    """The force of a pin that sticks, slips and sticks again; the pin while it slips, and the force where that ends."""

    force: Floats
    pin: Oscillator
    trough: float


def _motion(
    time: Floats, start: float, static: float, kinetic: float, rate: float, omega: float, zeta: float
) -> _Motion:
    # In units of force the mass is 1: k = ω², and a stuck pin's force rises with kV, the rate. The pin starts where the
    # spring has the static force.
    stiffness, stage = omega**2, rate / omega**2
    pin = Oscillator(stiffness, zeta, stage, kinetic, start, stage * start - static / stiffness)
    stop = pin.first_stop(start + 4.0 * math.pi / omega)
    stop = time[-1] if math.isnan(stop) else stop
    trough = float(stiffness * (stage * stop - pin.compute_position(stop)))
    position, *_ = pin.motion(np.clip(time, start, stop))
    moving = stiffness * (stage * time - position)
    before, after = static + rate * (time - start), trough + rate * (time - stop)
    stuck = np.where(time < start, before, after)
    slides = (time >= start) & (time < stop)
    return _Motion(np.where(slides, moving, stuck), pin, trough)


class StaticForce(NamedTuple):
    """Force at which a pin breaks away, and its standard error."""

    force: float
    error: float


def ring_down(at: Floats, force: Floats, begin: int, peaks: list[int], level: float) -> StaticForce | None:
    """Fit Eq. 16-19 to a pull from the sample where its force begins to rise: a stick, and one slip that ends in sliding.

    The pin then comes to the stage's velocity V by overshoot, so its force by V√(km) above friction: no part of friction. None
    where the fit leaves more than a tenth of the first fall.
    """
    time, values = at[begin:], force[begin:]
    period = float(np.median(np.diff(at[peaks])))
    first_trough = force[peaks[0] : peaks[1]].min()
    fall = float(force[peaks[0]] - first_trough)
    reached = float(at[begin + int(np.argmax(values >= level))])
    if reached <= float(at[begin]):
        return None
    rate = level / (reached - float(at[begin]))
    # The peaks of a pin that rings are a natural period apart.
    log_omega = math.log(2.0 * math.pi / period)
    scale = np.array([period, fall, fall, 1.0, 1.0, fall / period])
    guess = np.array([reached, level, level, log_omega, 0.05, rate]) / scale

    def misfit(unknown: Floats) -> Floats:
        start, static, kinetic, log_omega, zeta, rate = (unknown * scale).tolist()
        computed = _motion(time, start, static, kinetic, rate, math.exp(log_omega), zeta)
        return (computed.force - values) / fall

    low, high = np.full(6, -np.inf), np.full(6, np.inf)
    low[4], high[4] = 0.0, 0.9  # ζ
    steps = np.full(6, 1e-6)
    best = scipy.optimize.least_squares(misfit, guess, bounds=(low, high), diff_step=steps, max_nfev=100)
    left = float(np.mean(best.fun**2))
    if left > LEAST_DROP**2:
        return None
    slopes = np.asarray(best.jac)
    # Covariance of least squares: (JᵀJ)⁻¹ times the mean squared residual.
    covariance = np.linalg.pinv(slopes.T @ slopes)
    errors = scale * np.sqrt(np.diag(covariance) * left)
    return StaticForce(float(best.x[1] * scale[1]), float(errors[1]))
