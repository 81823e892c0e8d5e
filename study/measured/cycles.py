"""Cycles of stick-slip in a measured force: Eq. 16-19 fitted to each slip, from rise to rise, and the cell that reads it.

A force cell is an oscillator itself: it reads z of z'' + 2ζωz' + ω²z = ω²F, and rings after each slip. Where that shows in all
slips, its ω and ζ are fitted with them.
"""

import math
from collections.abc import Sequence
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
CHANCE: Final = 1e-3
"""Probability at which noise alone seems to repeat in all slips."""
FIRST_DAMPING: Final = 0.1
"""Damping ratio with which a fit begins."""
MOST_DAMPED: Final = 0.9
"""Largest damping ratio that is fitted: from 1 on nothing oscillates."""
STEP: Final = 1e-6
"""Step of finite differences, in units of a slip's fall and length: a misfit below it is that of the search."""


class Cell(NamedTuple):
    """A force cell as an oscillator: its angular frequency ω, and its damping ratio ζ, which is 1/(2Q)."""

    frequency: float
    damping: float


class Unknowns(NamedTuple):
    """Knowledge of a fit to a slip: ζ of the machine, and a cell; None to fit ζ, and of a force as it is.

    fits_cell: to fit the cell, too, from the given one on.
    """

    damping: float | None
    cell: Cell | None = None
    fits_cell: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Cycle:
    """Eq. 16-19 fitted to a slip: it starts at `start` with the force `static`, and slides against `kinetic`.

    driving: static friction, with the damper's force. trough: the force where the pin sticks again. at, fit: the closed form at
    the times of its stretch, as the cell reads it. misfit: measured less fitted force. changes: of static and kinetic force, ln ω
    and ζ, the most that a misfit of a sum of squares of 1 can change each; as many as were fitted.
    """

    start: float
    static: float
    driving: float
    kinetic: float
    trough: float
    period: float
    damping: float
    at: Floats
    fit: Floats
    misfit: Floats
    changes: Floats
    cell: Cell | None = None

    @property
    def residual(self) -> float:
        """Root mean square of the misfit."""
        squares = np.mean(self.misfit**2)
        return float(np.sqrt(squares))


class SharedErrors(NamedTuple):
    """Errors that all slips share: of static and kinetic force, relative of the natural period, and of ζ."""

    static: float = 0.0
    kinetic: float = 0.0
    period: float = 0.0
    damping: float = 0.0


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
    cell: Cell | None = None
    """Cell that rings after each slip, if that is seen."""
    cut: Sequence[int] = ()
    """Numbers of slips between the others that have a gap in their samples."""

    def together(self) -> NDArray[np.bool_]:
        """True for each pair of neighbouring cycles without a gap or one between them that does not fit."""
        fit = []
        for low, high in pairwise(self.chosen):
            between = [number for number in (*self.unlike, *self.cut) if low < number < high]
            fit.append(not between)
        return np.array(fit, bool)

    def estimate_shared_errors(self) -> SharedErrors:
        """Errors by the part of the misfit that repeats in all slips, which their scatter does not show.

        A fit leaves what its numbers cannot follow; what they did follow is not seen, and is taken for as large, in the
        direction that changes each number most.
        """
        norm = find_common_misfit(self.cycles)
        if not norm:
            return SharedErrors()
        cycles = self.free or self.cycles
        changes = np.median([cycle.changes for cycle in cycles], axis=0)
        return SharedErrors(*(changes * norm).tolist())


def find_common_misfit(cycles: Sequence[Cycle]) -> float:
    """Root of the sum of squares of the misfit that repeats in all slips, over a natural period; 0 if it may be noise.

    Of m samples and n slips, noise of variance σ² gives squares of σ² between slips as within. The ratio is that of Fisher's F
    with m/2 and m(n - 1)/2 degrees of freedom: at a common time since the slip each sample is one between two, so that at least
    half of them are independent.
    """
    count = len(cycles)
    if count < 2:
        return 0.0
    first = cycles[0]
    # Samples are as far apart in all slips, so those of the first one serve for all.
    apart = (first.at[-1] - first.at[0]) / (len(first.at) - 1)
    lengths = [float(cycle.at[-1]) - cycle.start for cycle in cycles]
    lasts = min(first.period, *lengths)
    since = np.arange(0.0, lasts, apart)
    samples = len(since)
    if samples < RESOLVED:
        return 0.0
    rows = [np.interp(cycle.start + since, cycle.at, cycle.misfit) for cycle in cycles]
    misfits = np.array(rows)
    mean = misfits.mean(axis=0)
    deviations = misfits - mean
    within = float(np.sum(deviations**2)) / (count - 1)
    between = count * float(np.sum(mean**2))
    freedom = samples / 2.0, samples * (count - 1) / 2.0
    by_chance = float(scipy.stats.f.isf(CHANCE, *freedom))
    # The square of the mean misfit has a part of the noise, too: as much as the scatter of means of this many slips.
    norm = math.sqrt(max(between - within, 0.0) / count)
    of_search = STEP * (first.static - first.trough) * math.sqrt(samples)
    return norm if between > by_chance * within and norm > of_search else 0.0


def fit_cycles(averages: Averaged, whole_slips: list[int], rates: list[float], damping: float | None) -> FittedCycles:
    """Fit Eq. 16-19 to slips, with a cell that rings after each if this explains a misfit that all slips share.

    Fits that leave the measured forces and their noise are none. whole_slips: numbers of slips whose samples have no gap.
    """
    count = min(len(whole_slips), MOST_CYCLES)
    places = np.linspace(0, len(whole_slips) - 1, count)
    chosen = [whole_slips[int(place)] for place in places]
    cut = sorted({*range(min(whole_slips, default=0), max(whole_slips, default=0))} - {*whole_slips})
    fitted = _fit_chosen(averages, chosen, rates, damping, None)._replace(cut=cut)
    knows_damping = bool(fitted.damping.of) or fitted.given
    if not knows_damping or not find_common_misfit(fitted.cycles):
        return fitted
    cell = _guess_cell(averages, fitted, rates, damping)
    with_cell = _fit_chosen(averages, chosen, rates, damping, cell)
    # A cell has two more unknowns: it counts only if nothing in common is left, and no slip is lost for it.
    fits_as_many = len(with_cell.cycles) >= len(fitted.cycles)
    explains = fits_as_many and not find_common_misfit(with_cell.cycles)
    return with_cell._replace(cut=cut) if explains else fitted


def _fit_chosen(
    averages: Averaged, chosen: list[int], rates: list[float], damping: float | None, cell: Cell | None
) -> FittedCycles:
    """Fit the chosen slips, first each alone, then with the mean damping, and cell, of all."""
    at, slips = averages.trace.at, averages.slips
    peaks = [slip.peak for slip in slips]
    samples = math.inf
    if len(peaks) > 1:
        samples = float(np.median(np.diff(peaks)))

    def fit(unknown: Unknowns) -> dict[int, Cycle]:
        good = {}
        for number in chosen:
            cycle = _cycle(averages, number, rates[number], unknown)
            if _is_inside(averages, slips[number], rates[number], cycle):
                good[number] = cycle
        return good

    free: dict[int, Cycle] = {}
    if damping is None or cell:
        free = fit(Unknowns(damping, cell, fits_cell=cell is not None))
    # The fall of a slip takes about half a natural period: its samples show the damping if they are RESOLVED or more.
    resolved = 2.0 * RESOLVED * float(np.median(np.diff(at)))
    resolved_cycles = {number: cycle for number, cycle in free.items() if cycle.period >= resolved}
    # Of few slips alone the damping is that of the few that happen to fit.
    resolved_cycles = resolved_cycles if 2 * len(resolved_cycles) >= len(chosen) else {}
    damping_of_cycles = Measured(math.nan if damping is None else damping, math.nan, 0)
    if resolved_cycles and damping is None:
        damping_of_cycles = mean_with_error([cycle.damping for cycle in resolved_cycles.values()], "1")
        damping_of_cycles = damping_of_cycles._replace(value=max(damping_of_cycles.value, 0.0))
    cells = [cycle.cell for cycle in resolved_cycles.values() if cycle.cell]
    cell = _mean_cell(cells)
    common_damping = damping_of_cycles.value if math.isfinite(damping_of_cycles.value) else 0.0
    fits = fit(Unknowns(common_damping, cell))
    kept = [number for number in fits if number in resolved_cycles or not resolved_cycles]
    if 2 * len(kept) < len(chosen):  # the model is not that of this force
        none = mean_with_error([], "1")
        return FittedCycles([], [], [], none, chosen, damping is not None, samples)
    unlike = [number for number in chosen if number not in kept]
    freely = [resolved_cycles[number] for number in kept if number in resolved_cycles]
    cycles = [fits[number] for number in kept]
    return FittedCycles(cycles, freely, kept, damping_of_cycles, unlike, damping is not None, samples, cell)


def _mean_cell(cells: Sequence[Cell]) -> Cell | None:
    """The cell at the medians of frequency and damping; None of none."""
    if not cells:
        return None
    frequency, damping = np.median(cells, axis=0)
    return Cell(float(frequency), float(damping))


def _guess_cell(averages: Averaged, fitted: FittedCycles, rates: list[float], damping: float | None) -> Cell | None:
    """The cell that fits the middle one of the slips best, looked for from each octave above the pin's frequency on."""
    middle = len(fitted.cycles) // 2
    number, cycle = fitted.chosen[middle], fitted.cycles[middle]
    sampling = float(np.median(np.diff(averages.trace.at)))
    fastest = math.pi / sampling  # Nyquist's angular frequency
    # A start in the wrong octave ends in a minimum that is not the deepest one: each octave is tried.
    frequency, fits = 2.0 * math.pi / cycle.period, []
    while 2.0 * frequency < fastest:
        frequency *= 2.0
        unknown = Unknowns(damping, Cell(frequency, FIRST_DAMPING), fits_cell=True)
        fits.append(_cycle(averages, number, rates[number], unknown))
    return min(fits, key=lambda fit: fit.residual).cell if fits else None


def _is_inside(averages: Averaged, slip: TraceSlip, rate: float, cycle: Cycle) -> bool:
    """True if a fit agrees with the samples of its slip, but for noise, a rise between samples and a tenth of the fall.

    Its forces before and after the slip are near the extremes, friction is between these, and the misfit is as small.
    """
    force = averages.trace.force
    high = float(force[slip.peak])
    low = float(force[slip.trough])
    share = LEAST_DROP * (high - low)
    longest_step = float(np.diff(cycle.at).max())
    between_samples = abs(rate) * longest_step
    room = share + NOISE * averages.noise + between_samples
    top, bottom = cycle.static, cycle.trough
    if cycle.cell:  # which reads less than the peak, and more than the fall
        after = cycle.fit[cycle.at >= cycle.start]
        top = float(cycle.fit.max())
        bottom = float(after.min())
    near = abs(top - high) <= room and abs(bottom - low) <= room
    between = low - room <= cycle.kinetic <= high + room
    return near and between and cycle.residual**2 <= share**2 + averages.noise**2


class _Stretch(NamedTuple):
    """Samples of a slip with half of the rise before and after it, and its size."""

    time: Floats
    force: Floats
    peak: float
    """Force before the fall."""
    trough: float
    drop: float
    """Fall of the force from peak to trough."""
    high: float
    """Time when a quarter of the fall is over."""
    length: float
    """Duration of the fall."""


def _stretch_of_slip(averages: Averaged, number: int) -> _Stretch:
    """The stretch of a slip: half of each rise, as the other half belongs to the neighbours, whose fits need it as much."""
    at, force = averages.trace.at, averages.trace.force
    slips = averages.slips
    slip = slips[number]
    before = slips[number - 1].trough if number else 0
    behind = len(at) - 1
    if number + 1 < len(slips):
        behind = slips[number + 1].peak
    first = (before + slip.peak) // 2
    last = (slip.trough + behind) // 2
    peak, trough = force[slip.peak], force[slip.trough]
    drop = float(peak - trough)
    # Peak and trough are flat and full of noise: where a quarter is fallen, and where one is left, is surer.
    falls = force[slip.peak : slip.trough + 1]
    high = slip.peak + int(np.flatnonzero(falls >= peak - 0.25 * drop)[-1])
    fallen = force[high : slip.trough + 1] <= trough + 0.25 * drop
    low = high + int(np.argmax(fallen))
    length = 3.0 * float(at[low] - at[high])  # of half a cosine, a third of its time is the middle half of its fall
    stretch = slice(first, last + 1)
    return _Stretch(at[stretch], force[stretch], peak, trough, drop, at[high], length)


def _cycle(averages: Averaged, number: int, rate: float, unknown: Unknowns) -> Cycle:
    """Fit the closed form to a slip, from the middle of the rise before it to the middle of the rise after it.

    rate: at which the force rises. If ζ is fitted, noise may find it below 0.
    """
    stretch = _stretch_of_slip(averages, number)
    time, values, drop, length = stretch.time, stretch.force, stretch.drop, stretch.length
    fits_damping = unknown.damping is None
    count = 5 if fits_damping else 4

    # Unknown are the start, μ_s, μ_k, ω and ζ, in units of the slip's own length and drop; ω by its logarithm, so that it
    # stays above 0. Of a cell ln ω, ζ, and what still rings from the slip before.
    def motion(values: Floats) -> _Motion:
        omega = math.exp(values[3]) / length
        start = stretch.high + values[0] * length
        static, kinetic = values[1] * drop, values[2] * drop
        zeta = values[4] if unknown.damping is None else unknown.damping
        forces = float(static), float(kinetic)
        return _motion(time, float(start), *forces, rate, omega, float(zeta))

    def as_cell(values: Floats) -> Cell | None:
        if not unknown.fits_cell:
            return unknown.cell
        frequency = math.exp(values[-4]) / length
        return Cell(frequency, float(values[-3]))

    def reading(values: Floats) -> Floats:
        pulled, cell = motion(values), as_cell(values)
        if cell is None:
            return pulled.force
        rings = drop * complex(values[-2], values[-1])
        return _read_by_cell(time, pulled, rate, cell, rings)

    top = stretch.peak / drop
    middle = 0.5 * (stretch.peak + stretch.trough) / drop
    # Half a cosine falls by a quarter in its first third, half a natural period takes the slip's length, ω·length = π.
    guess = [-1.0 / 3.0, top, middle, math.log(math.pi), FIRST_DAMPING][:count]
    # Bounds, as ω could leave its estimate for a ripple of noise, and from ζ = 1 on nothing oscillates.
    ends = [np.inf, np.inf, np.inf, math.log(FASTER), MOST_DAMPED][:count]
    least, most = [-end for end in ends], list(ends)
    if unknown.cell and unknown.fits_cell:
        log_frequency = math.log(unknown.cell.frequency * length)
        guess += [log_frequency, unknown.cell.damping]
        least += [log_frequency - math.log(FASTER), 0.0]
        most += [log_frequency + math.log(FASTER), MOST_DAMPED]
    if unknown.cell:
        guess += [0.0, 0.0]
        least += [-np.inf, -np.inf]
        most += [np.inf, np.inf]

    def misfit(unknowns: Floats) -> Floats:
        return (reading(unknowns) - values) / drop

    steps = np.full(len(guess), STEP)
    # Whatever has not converged after 60 steps is no slip of this model, and `_is_inside` refuses it.
    best = scipy.optimize.least_squares(misfit, guess, bounds=(least, most), diff_step=steps, max_nfev=60)
    fit, cell = motion(best.x), as_cell(best.x)
    pin = fit.pin
    omega = math.sqrt(pin.spring_stiffness)
    static = float(best.x[1] * drop)
    slopes = np.asarray(best.jac)
    # Rows of the pseudoinverse lead from a misfit to unknowns: their norms are the most that one of norm 1 changes each.
    inverse = np.linalg.pinv(slopes)
    most_changed = np.linalg.norm(inverse, axis=1)[1:count]
    # Misfit and forces were over the fall, which cancels in changes of forces; ln ω and ζ are pure numbers.
    units = np.array([1.0, 1.0, 1.0 / drop, 1.0 / drop])
    changes = most_changed * units[: count - 1]
    read = reading(best.x)
    # The damper pulls a pin at rest with c V = 2ζω · rate/ω².
    damper = 2.0 * pin.damping_ratio / omega * rate
    return Cycle(
        start=pin.time,
        static=static,
        driving=static + damper,
        kinetic=pin.friction_force,
        trough=fit.trough,
        period=2.0 * math.pi / omega,
        damping=pin.damping_ratio,
        at=time,
        fit=read,
        misfit=values - read,
        changes=changes,
        cell=cell,
    )


class _Motion(NamedTuple):
    """The force of a pin that sticks, slips and sticks again; the pin while it slips; when, and at which force, that ends."""

    force: Floats
    pin: Oscillator
    static: float
    stop: float
    trough: float


def _motion(
    time: Floats, start: float, static: float, kinetic: float, rate: float, omega: float, zeta: float
) -> _Motion:
    # In units of force the mass is 1: k = ω², and a stuck pin's force rises with kV, the rate. The pin starts where the
    # spring has the static force.
    stiffness, stage = omega**2, rate / omega**2
    position_at_start = stage * start - static / stiffness
    pin = Oscillator(stiffness, zeta, stage, kinetic, start, position_at_start)
    # A slip ends within a natural period; two of them leave room for any damping.
    stop = pin.first_stop(start + 4.0 * math.pi / omega)
    stop = time[-1] if math.isnan(stop) else stop
    trough = float(stiffness * (stage * stop - pin.compute_position(stop)))
    position, *_ = pin.motion(np.clip(time, start, stop))
    moving = stiffness * (stage * time - position)
    before = static + rate * (time - start)
    after = trough + rate * (time - stop)
    stuck = np.where(time < start, before, after)
    slides = (time >= start) & (time < stop)
    force = np.where(slides, moving, stuck)
    return _Motion(force, pin, static, float(stop), trough)


def _read_by_cell(time: Floats, motion: _Motion, rate: float, cell: Cell, amplitude: complex) -> Floats:
    """Reading z of a cell, z'' + 2ζωz' + ω²z = ω²F, of the force F of a pin that sticks, slips and sticks again.

    Along a line of F the reading is the same line, later by 2ζ/ω. While the pin slides F is F_k and a part A·exp(λτ),
    which the cell reads times ω²/(λ² + 2ζωλ + ω²). Where one follows the other the cell begins to ring so that z and z'
    go on.
    amplitude: what rings from earlier slips, at the first time.
    """
    pin = motion.pin
    start = pin.time
    stop = max(motion.stop, start)
    rings = _Ringing.from_oscillator(cell.frequency, cell.damping)
    slides = _Ringing.from_oscillator(math.sqrt(pin.spring_stiffness), pin.damping_ratio)
    late = 2.0 * cell.damping / cell.frequency * rate
    swing = slides.amplitude(motion.static - pin.friction_force, rate)
    pole = slides.pole
    damper = 2.0 * cell.damping * cell.frequency
    swing *= cell.frequency**2 / (pole**2 + damper * pole + cell.frequency**2)
    # At the start of the slip: the reading before it, and its slope, less those of the part that follows the pin.
    value = motion.static - late - pin.friction_force - swing.real
    first = rings.amplitude(value, rate - (pole * swing).real)
    lasts = stop - start
    moved = swing * np.exp(pole * lasts)
    rung = first * np.exp(rings.pole * lasts)
    # At its end: the same, for the line of a pin that sticks again.
    value = pin.friction_force + (moved + rung).real - (motion.trough - late)
    slope = (pole * moved + rings.pole * rung).real - rate
    second = rings.amplitude(value, slope)
    # Clipped, as an exponential of times outside its part would overflow.
    since = np.clip(time - start, 0.0, lasts)
    after = np.clip(time - stop, 0.0, None)
    oscillations = swing * np.exp(pole * since) + first * np.exp(rings.pole * since)
    sliding = pin.friction_force + oscillations.real
    before = motion.static - late + rate * (time - start)
    ringing = second * np.exp(rings.pole * after)
    behind = motion.trough - late + rate * (time - stop) + ringing.real
    from_start = np.where(time < stop, sliding, behind)
    read = np.where(time < start, before, from_start)
    still: Floats = (amplitude * np.exp(rings.pole * (time - time[0]))).real
    return read + still


class _Ringing(NamedTuple):
    """A free oscillation, the real part of A·exp(λt)."""

    pole: complex

    @classmethod
    def from_oscillator(cls, frequency: float, damping: float) -> "_Ringing":
        # λ of λ² + 2ζωλ + ω² = 0, below critical damping.
        unit_pole = complex(-damping, math.sqrt(1.0 - damping**2))
        return cls(frequency * unit_pole)

    def amplitude(self, value: float, slope: float) -> complex:
        """A of the oscillation that begins with this value and this slope."""
        imaginary = (self.pole.real * value - slope) / self.pole.imag
        return complex(value, imaginary)


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
    rises = at[begin:]
    reached = float(rises[int(np.argmax(values >= level))])
    if reached <= float(at[begin]):
        return None
    rate = level / (reached - float(at[begin]))
    # The peaks of a pin that rings are a natural period apart.
    log_omega = math.log(2.0 * math.pi / period)
    # Unknowns of size 1: start, μ_s, μ_k, ln ω, ζ and rate.
    scale = np.array([period, fall, fall, 1.0, 1.0, fall / period])
    first_guess = np.array([reached, level, level, log_omega, 0.05, rate])
    guess = first_guess / scale

    def misfit(unknown: Floats) -> Floats:
        start, static, kinetic, log_omega, zeta, rate = (unknown * scale).tolist()
        omega = math.exp(log_omega)
        computed = _motion(time, start, static, kinetic, rate, omega, zeta)
        return (computed.force - values) / fall

    low = np.full(6, -np.inf)
    high = np.full(6, np.inf)
    low[4], high[4] = 0.0, 0.9  # ζ
    steps = np.full(6, 1e-6)
    best = scipy.optimize.least_squares(misfit, guess, bounds=(low, high), diff_step=steps, max_nfev=100)
    remainder = float(np.mean(best.fun**2))
    if remainder > LEAST_DROP**2:
        return None
    slopes = np.asarray(best.jac)
    # Covariance of least squares: (JᵀJ)⁻¹ times the mean squared residual.
    covariance = np.linalg.pinv(slopes.T @ slopes)
    errors = scale * np.sqrt(np.diag(covariance) * remainder)
    static_force = float(best.x[1] * scale[1])
    return StaticForce(static_force, float(errors[1]))
