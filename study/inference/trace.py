"""A force that a laboratory measured while a stage pulled a pin: friction, period and stiffness, by Eq. 16-19.

While the pin sticks, the force y rises by r = k·V a second; while it slides, y'' + 2ζω y' + ω² y = ω² F, with rate r at both
ends. So k, V and the mass need not be known. Each cycle is fitted alone; the ± is their scatter (`nanoslip.solver.ensemble`).
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.dynamics.coefficients import LARGEST_CHANGE, SIGNIFICANT, steady_blocks, truncation
from nanoslip.solver.dynamics.result import BINS
from nanoslip.solver.dynamics.stick_slip import Oscillator
from nanoslip.solver.ensemble import FEWEST, jackknife, mean_of
from nanoslip.study.inference.batch_means import BATCHES, correlated, independent
from nanoslip.study.inference.recording import (
    FEWEST_POINTS,
    LEAST_DROP,
    NOISE,
    Floats,
    Limits,
    Trace,
    limits,
    noise_of,
    two_way,
)

RESOLVED: Final = 8
"""Samples of half an oscillation, above which the shape of a slip determines the damping."""
MOST_CYCLES: Final = 64
"""Most cycles that are fitted, evenly chosen: more add little."""
FASTER: Final = 1e3
"""Factor by which a slip's own frequency may differ from the estimate by its duration."""


class Measured(NamedTuple):
    """Number of a trace: its mean over this number of cycles, and its ± (NaN if unknown)."""

    value: float
    uncertainty: float
    of: int
    unit: str = "1"


class Flag(NamedTuple):
    """Fact that a reader of the numbers should know, by name, and the numbers that it concerns."""

    name: str
    facts: dict[str, float | str]


@dataclass(frozen=True, slots=True, eq=False)
class Cycle:
    """Eq. 16-19 fitted to a slip: it starts at `start` with the force `static`, and slides against `kinetic`.

    driving: static friction, with the damper's force. trough: the force where the pin sticks again. at, fit: the closed form at
    the times of its stretch. residual: root mean square of what is left.
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


@dataclass(frozen=True, slots=True, eq=False)
class TraceNumbers:
    """Numbers of a trace by the name that they have in a dataset, the fitted cycles, and facts on the answer by name."""

    numbers: dict[str, Measured]
    cycles: tuple[Cycle, ...]
    flags: tuple[Flag, ...]

    @property
    def flagged(self) -> tuple[str, ...]:
        """Names of the flags."""
        return tuple(flag.name for flag in self.flags)


OF_PLACES: Final = ("pull_ends", "slides", "no_stick_slip", "offset")
"""Flags of one pull that mean nothing for several strokes."""


class _Pull(NamedTuple):
    """Facts of a measurement beside its trace: unit of its forces, newtons of one of these, load, velocity and damping."""

    unit: str
    newtons: float
    load: float
    velocity: float
    damping: float | None


class _Slip(NamedTuple):
    """Samples of the force's peak before a slip and of its least value after it; and if it rises again."""

    peak: int
    trough: int
    ended: bool


class _Look(NamedTuple):
    """Averages of neighbouring samples, their noise, the fall of force that counts as a slip, and the slips."""

    width: int
    trace: Trace
    noise: float
    drop: float
    slips: list[_Slip]


def _look(trace: Trace, width: int) -> _Look:
    trace = trace.averaged(width)
    force = trace.force
    noise = noise_of(force)
    drop = LEAST_DROP * float((np.maximum.accumulate(force) - force).max())
    return _Look(width, trace, noise, drop, [slip for slip in _slips(force, max(NOISE * noise, drop)) if slip.peak > 0])


def _best_look(trace: Trace) -> _Look:
    """The narrowest means that show all slips but one, as one at an end may be seen or not."""
    looks = [_look(trace, 2**power) for power in range((len(trace.at) // FEWEST_POINTS).bit_length() or 1)]
    most = max(len(look.slips) for look in looks)
    return next(look for look in looks if len(look.slips) >= most - 1)


def measure(
    trace: Trace, load: float = math.nan, velocity: float = math.nan, damping: float | None = None
) -> TraceNumbers:
    """Friction, period, amplitude and stiffness of a trace.

    load: in N, which makes coefficients of forces. velocity: of the stage, in m/s. damping: ζ of the machine; None to fit it.
    """
    per = load if trace.unit == "N" and math.isfinite(load) else 1.0
    newtons = load if math.isfinite(load) else 1.0
    pull = _Pull("1" if math.isfinite(load) else trace.unit, newtons, load, velocity, damping)
    trace = replace(trace, force=trace.force / per)
    return _of_strokes(trace, pull) if two_way(trace.force) else _of_pull(trace, pull)


class _Stroke(NamedTuple):
    """Samples of a stroke, from the sign's change to the last one before it turns; and the sign of its force."""

    first: int
    last: int
    sign: float


def _strokes(force: Floats, middle: float, swing: float) -> list[_Stroke]:
    """Strokes of a force of both signs, cut where it passes the middle; `swing` is half its usual range."""
    sides = np.where(force > middle + swing / 2.0, 1, np.where(force < middle - swing / 2.0, -1, 0))
    held = np.flatnonzero(sides)  # so noise at the middle turns nothing
    turns = held[1:][np.diff(sides[held]) != 0]
    passed = [int(np.flatnonzero((force[:turn] - middle) * sides[turn] <= 0.0)[-1]) + 1 for turn in turns]
    found = []
    for first, turn in pairwise([0, *passed, len(force)]):
        sign = float(sides[held[(held >= first) & (held < turn)][0]])
        forces = sign * (force[first:turn] - middle)
        found.append(_Stroke(first, first + int(np.flatnonzero(forces >= np.median(forces))[-1]) + 1, sign))
    return [stroke for stroke in found if stroke.last - stroke.first >= FEWEST_POINTS]


def _of_strokes(trace: Trace, pull: _Pull) -> TraceNumbers:
    """Numbers of strokes of both signs: friction is half their difference, the offset half their sum, ± over strokes."""
    high, low = (float(np.median(trace.force[trace.force * sign > 0.0])) for sign in (1.0, -1.0))
    middle = (high + low) / 2.0
    strokes = _strokes(trace.force, middle, (high - low) / 2.0)
    found = [_of_pull(trace.part(stroke.first, stroke.last, stroke.sign, middle), pull) for stroke in strokes]
    names = {name: each.unit for one in found for name, each in one.numbers.items()}
    numbers = {
        name: _mean([one.numbers[name].value for one in found if name in one.numbers], names[name]) for name in names
    }
    level = "mean_force" if "mean_force" in names else "kinetic_friction"
    ways = [
        [
            one.numbers[level].value
            for one, stroke in zip(found, strokes, strict=True)
            if level in one.numbers and stroke.sign == sign
        ]
        for sign in (1.0, -1.0)
    ]
    halves = [middle + (there - back) / 2.0 for there, back in zip(*ways, strict=False)]
    numbers |= {"force_offset": _mean(halves, pull.unit)} if halves else {}
    flags = {flag.name: flag for one in found for flag in one.flags if flag.name not in OF_PLACES}
    return TraceNumbers(numbers, (), (Flag("strokes", {"strokes": len(found)}), *flags.values()))


def _of_pull(trace: Trace, pull: _Pull) -> TraceNumbers:
    """Numbers of one pull. The part after its end is left out."""
    look = _best_look(trace)
    end = _end_of_pull(look)
    if end * look.width < FEWEST_POINTS:
        return _of_look(trace, look, pull)
    found = _of_pull(trace.part(0, end * look.width), pull)
    level = float(np.median(look.trace.force[look.slips[-1].trough :]))
    ends = Flag("pull_ends", {"at": float(look.trace.at[end]), "level": level, **_units(trace, pull)})
    return replace(found, flags=(ends, *found.flags))


def _end_of_pull(look: _Look) -> int:
    """Sample at which a pull ends: the force comes to a level from which it never rises again. 0 if the pin slides on.

    The level is that of rest, below a tenth of the force; or comes after regular slips; or after steady sliding.
    """
    at, force, slips = look.trace.at, look.trace.force, look.slips
    if not slips or not _slides(look):
        return 0
    last, drops = slips[-1], [force[slip.peak] - force[slip.trough] for slip in slips]
    level = float(np.median(force[last.trough :]))
    regular = len(slips) > 2 and drops[-1 if last.ended else -2] > 0.5 * drops[0]
    if last.ended:
        return last.trough + int(np.argmax(force[last.trough :] >= level)) if regular else 0
    rests = len(at) - last.trough >= FEWEST_POINTS and abs(level) <= LEAST_DROP * force[last.peak]
    above = force >= force[last.peak] - 0.25 * drops[-1]
    end = last.peak + int(np.flatnonzero(above[last.peak : last.trough + 1])[-1]) + 1
    top = force[int(np.argmax(above)) : end]  # its median is an eighth of the fall below the peak if it rises and falls
    steady = len(top) >= FEWEST_POINTS and force[last.peak] - np.median(top) < drops[-1] / 16.0
    return end if rests or regular or steady else 0


def _slides(look: _Look) -> bool:
    """True if no slip follows the last one for longer than between any two, and the force is level in half of that time."""
    at, force, slips = look.trace.at, look.trace.force, look.slips
    if not slips:
        return True
    peaks = at[[slip.peak for slip in slips]]
    level = np.ptp(force[(slips[-1].peak + len(at)) // 2 :]) <= max(look.drop, NOISE * look.noise)
    return bool(level and at[-1] - peaks[-1] > (np.diff(peaks).max() if len(slips) > 1 else peaks[0] - at[0]))


def _of_look(trace: Trace, look: _Look, pull: _Pull) -> TraceNumbers:
    at, force, slips = look.trace.at, look.trace.force, look.slips
    cut, flags = limits(trace.force), list(_of_noise(look, pull))
    if turned := _turned(at, slips):
        flags.append(Flag("turned", {}))
        slips = []
    slides = _slides(look._replace(slips=slips))
    rates = [_rate(at, force, low, slip.peak) for low, slip in zip(_beginnings(slips), slips, strict=True)]
    whole = [number for number, slip in enumerate(slips) if slip.ended] if not slides else []
    fitted = _fitted(look, whole, rates, pull.damping)
    cycles = tuple(fitted.cycles)
    numbers: dict[str, Measured] = {}
    if cycles:
        numbers = _of_cycles(fitted, pull.unit, "s" if trace.over == "time" else "m")
        numbers |= _mean_force(at, force, [cycle.start for cycle in cycles], pull.unit, fitted.together())
    elif whole:
        numbers = _of_samples(at, force, [slips[number] for number in whole], pull.unit, trace.over)
    flags += _of_fit(look, fitted, pull)
    if slides and not turned:
        numbers |= (
            {} if not slips else {"static_friction": Measured(float(force[slips[0].peak]), math.nan, 1, pull.unit)}
        )
        numbers |= _sliding(at, force, slips[-1].peak if slips else 0, pull, trace, flags)
        rates = rates[:1] or _ramp(at, force)
    if rates:
        numbers |= _stiffness(trace, pull.newtons * np.array(rates[1:] or rates), pull.velocity, pull.load)
    if any(cut):
        numbers = _within_limits(numbers, cut, np.array([force[slip.peak] for slip in slips]), pull.unit)
        flags = [Flag("sensor_limit", {"low": cut.low, "high": cut.high})]
    return TraceNumbers(numbers, cycles if not any(cut) else (), tuple(flags))


def _within_limits(numbers: dict[str, Measured], cut: Limits, peaks: Floats, unit: str) -> dict[str, Measured]:
    """The numbers that do not need the forces beyond a sensor's limit; μ_s is then the mean of the largest samples."""
    kept = {name: numbers[name] for name in ("stick_slip_period",) if name in numbers}
    return kept if cut.high or not len(peaks) else {"static_friction": _mean(peaks, unit), **kept}


class _Fitted(NamedTuple):
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
        pairs = pairwise(self.chosen)
        return np.array([not any(low < each < high for each in self.unlike) for low, high in pairs], bool)


def _fitted(look: _Look, whole: Sequence[int], rates: Sequence[float], damping: float | None) -> _Fitted:
    """Fit Eq. 16-19 to slips. Fits that leave the measured forces and their noise are none."""
    at, force, slips = look.trace.at, look.trace.force, look.slips
    chosen = [whole[int(place)] for place in np.linspace(0, len(whole) - 1, min(len(whole), MOST_CYCLES))]
    peaks = [slip.peak for slip in slips]
    samples = float(np.median(np.diff(peaks))) if len(peaks) > 1 else math.inf

    def fit(zeta: float | None) -> dict[int, Cycle]:
        found = {number: _cycle(at, force, slips, number, rates[number], zeta) for number in chosen}
        return {number: cycle for number, cycle in found.items() if _inside(look, slips[number], rates[number], cycle)}

    free = fit(None) if damping is None else {}
    resolved = [
        number for number, cycle in free.items() if cycle.period >= 2.0 * RESOLVED * float(np.median(np.diff(at)))
    ]
    own = {number: free[number] for number in resolved} if 2 * len(resolved) >= len(chosen) else {}
    known = _mean([cycle.damping for cycle in own.values()], "1") if damping is None else Measured(damping, math.nan, 0)
    known = known._replace(value=max(known.value, 0.0)) if known.of else known
    found = fit(known.value if math.isfinite(known.value) else 0.0)
    kept = [number for number in found if number in own or not own]
    if 2 * len(kept) < len(chosen):  # the model is not that of this force
        return _Fitted([], [], [], _mean([], "1"), chosen, damping is not None, samples)
    unlike = [number for number in chosen if number not in kept]
    freely = [own[number] for number in kept] if own else []
    return _Fitted([found[number] for number in kept], freely, kept, known, unlike, damping is not None, samples)


def _inside(look: _Look, slip: _Slip, rate: float, cycle: Cycle) -> bool:
    """True if a fit agrees with the samples of its slip, but for noise, a rise between samples and a tenth of the fall.

    Its forces before and after the slip are near the extremes, friction is between these, and the misfit is as small.
    """
    high, low = float(look.trace.force[slip.peak]), float(look.trace.force[slip.trough])
    share = LEAST_DROP * (high - low)
    room = share + NOISE * look.noise + abs(rate) * float(np.diff(cycle.at).max())
    near = abs(cycle.static - high) <= room and abs(cycle.trough - low) <= room
    between = low - room <= cycle.kinetic <= high + room
    return near and between and cycle.residual**2 <= share**2 + look.noise**2


def _of_samples(at: Floats, force: Floats, slips: Sequence[_Slip], unit: str, over: str) -> dict[str, Measured]:
    """Numbers of slips that Eq. 16-19 do not fit: their largest and least samples, and their periods."""
    peaks = [slip.peak for slip in slips]
    found = {
        "static_friction": _mean(force[peaks], unit),
        "spring_force_amplitude": _mean(force[peaks] - force[[slip.trough for slip in slips]], unit),
        "stick_slip_period": _mean(np.diff(at[peaks])[1:], "s" if over == "time" else "m"),
    }
    found |= _mean_force(at, force, at[peaks].tolist(), unit, np.ones(len(peaks) - 1, bool))
    return {name: number for name, number in found.items() if number.of}


def _sliding(
    at: Floats, force: Floats, first: int, pull: _Pull, trace: Trace, flags: list[Flag]
) -> dict[str, Measured]:
    """Kinetic friction μ_k of steady sliding from a sample on, with its flag, or the reason why there is none."""
    value, start, share = _steady(at[first:], force[first:], pull.unit)
    if math.isfinite(share):
        flags.append(Flag("unsteady", {"share": share}))
        return {}
    period = samples_in_period(force[first:][at[first:] >= start])
    if not first and period < RESOLVED:
        flags.append(Flag("undersampled", {"samples": period}))
        return {"mean_force": value}
    flags.append(Flag("slides" if first else "no_stick_slip", {"from": start, **_units(trace, pull)}))
    return {"kinetic_friction": value}


CHANCE: Final = 1e-3
"""Probability at which white noise has so large a share of its power at one frequency."""


def samples_in_period(force: Floats) -> float:
    """Samples in a period of a force that is not white noise (Fisher, Proc. R. Soc. A 125, 54, 1929); infinite if it is."""
    power = np.abs(np.fft.rfft(force - force.mean())[1:]) ** 2
    if len(power) < 2 or not power.sum() > 0.0:
        return math.inf
    share = power.max() / power.sum()
    by_chance = len(power) * (1.0 - share) ** (len(power) - 1)
    return len(force) / (int(power.argmax()) + 1.0) if by_chance < CHANCE else math.inf


def _units(trace: Trace, pull: _Pull) -> dict[str, float | str]:
    return {"unit": "" if pull.unit == "1" else f" {pull.unit}", "over": "s" if trace.over == "time" else "m"}


def _slips(force: Floats, drop: float) -> list[_Slip]:
    """Peaks after which the force falls by at least `drop`, with the least value before it rises by as much again."""
    found: list[_Slip] = []
    high = low = 0
    falling = False
    for place, value in enumerate(force.tolist()):
        if falling:
            low = place if value < force[low] else low
            if value > force[low] + drop:
                found.append(_Slip(high, low, ended=True))
                falling, high = False, place
        else:
            high = place if value > force[high] else high
            if value < force[high] - drop:
                falling, low = True, place
    return [*found, _Slip(high, low, ended=False)] if falling else found


def _turned(at: Floats, slips: Sequence[_Slip]) -> bool:
    """True if the force falls more slowly than it rises. In stick-slip the slip is the shorter part."""
    falls = sum(at[slip.trough] - at[slip.peak] for slip in slips[:-1])
    rises = sum(at[after.peak] - at[slip.trough] for slip, after in pairwise(slips))
    return bool(falls > 1.5 * rises)


def _beginnings(slips: Sequence[_Slip]) -> list[int]:
    """Positions where the force begins to rise towards each slip."""
    return [0, *(slip.trough for slip in slips[:-1])] if slips else []


def _rate(at: Floats, force: Floats, low: int, high: int) -> float:
    """Rate of the force in the middle of its rise between two samples; at the beginning a stage may be at rest."""
    if low == 0:
        smooth = np.maximum.accumulate(force[:high])
        low = min(int(np.searchsorted(smooth, 0.9 * force[0] + 0.1 * force[high])), high - 1)
    middle = slice(low + (high - low) // 5, high - (high - low) // 5 + 1)
    return float(np.polyfit(at[middle] - at[low], force[middle], 1)[0])


def _ramp(at: Floats, force: Floats) -> list[float]:
    """Rate of the force's rise before steady sliding; empty if the trace begins there."""
    most = float(np.median(force))
    top = int(np.argmax(force >= 0.9 * most))
    return [_rate(at, force, 0, top)] if force[0] < 0.5 * most and top > FEWEST else []


def _cycle(at: Floats, force: Floats, slips: Sequence[_Slip], number: int, rate: float, damping: float | None) -> Cycle:
    """Fit the closed form to a slip, from the middle of the rise before it to the middle of the rise after it.

    rate: at which the force rises. damping: ζ; None to fit it, and noise may find it below 0.
    """
    slip = slips[number]
    before = slips[number - 1].trough if number else 0
    behind = slips[number + 1].peak if number + 1 < len(slips) else len(at) - 1
    around = slice((before + slip.peak) // 2, (slip.trough + behind) // 2 + 1)
    time, values = at[around], force[around]
    drop, falls = float(force[slip.peak] - force[slip.trough]), force[slip.peak : slip.trough + 1]
    high = slip.peak + int(np.flatnonzero(falls >= force[slip.peak] - 0.25 * drop)[-1])
    low = high + int(np.argmax(force[high : slip.trough + 1] <= force[slip.trough] + 0.25 * drop))
    length = 3.0 * float(at[low] - at[high])  # of half a cosine, a third of its time is the middle half of its fall

    def motion(unknown: Floats) -> _Motion:
        omega = math.exp(unknown[3]) / length
        start, static, kinetic = at[high] + unknown[0] * length, unknown[1] * drop, unknown[2] * drop
        zeta = unknown[4] if damping is None else damping
        return _motion(time, float(start), float(static), float(kinetic), rate, omega, zeta)

    count = 5 if damping is None else 4
    top, middle = force[slip.peak] / drop, 0.5 * (force[slip.peak] + force[slip.trough]) / drop
    first = [-1.0 / 3.0, top, middle, math.log(math.pi), 0.1][:count]
    ends = np.array([np.inf, np.inf, np.inf, math.log(FASTER), 0.9][:count])

    def misfit(unknown: Floats) -> Floats:
        return (motion(unknown).force - values) / drop

    best = scipy.optimize.least_squares(
        misfit, first, bounds=(-ends, ends), diff_step=np.full(count, 1e-6), max_nfev=60
    )
    fit = motion(best.x)
    pin = fit.pin
    omega, static = math.sqrt(pin.spring_stiffness), float(best.x[1] * drop)
    return Cycle(
        start=pin.time,
        static=static,
        driving=static + 2.0 * pin.damping_ratio / omega * rate,
        kinetic=pin.friction_force,
        trough=fit.trough,
        period=2.0 * math.pi / omega,
        damping=pin.damping_ratio,
        residual=float(np.sqrt(np.mean((fit.force - values) ** 2))),
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
    stiffness, stage = omega**2, rate / omega**2
    pin = Oscillator(stiffness, zeta, stage, kinetic, start, stage * start - static / stiffness)
    stop = pin.first_stop(start + 4.0 * math.pi / omega)
    stop = time[-1] if math.isnan(stop) else stop
    trough = float(stiffness * (stage * stop - pin.position_at(stop)))
    moving = stiffness * (stage * time - pin.motion(np.clip(time, start, stop))[0])
    slides = (time >= start) & (time < stop)
    stuck = np.where(time < start, static + rate * (time - start), trough + rate * (time - stop))
    return _Motion(np.where(slides, moving, stuck), pin, trough)


def _of_cycles(fitted: _Fitted, unit: str, time: str) -> dict[str, Measured]:
    """Numbers of the chosen cycles. The time to the second slip is none of the others': the first starts from rest.

    free: the same, each with a damping of its own. What is not known of the damping that all have shifts them together, and it is
    what these scatter, so their ± is that of the mean.
    """

    cycles, damping = fitted.cycles, fitted.damping

    def mean(of: Callable[[Cycle], float], unit: str) -> Measured:
        own = _mean([of(cycle) for cycle in fitted.free or cycles], unit)
        return own._replace(value=float(np.mean([of(cycle) for cycle in cycles])))

    sure = math.isfinite(damping.value)
    together = fitted.together()
    periods = (np.diff([cycle.start for cycle in cycles]) / np.diff(fitted.chosen))[together]
    found = {
        "static_friction": mean(lambda cycle: cycle.driving, unit),
        "kinetic_friction": mean(lambda cycle: cycle.kinetic, unit) if sure else _mean([], unit),
        "spring_force_amplitude": mean(lambda cycle: cycle.static - cycle.trough, unit),
        "stick_slip_period": _mean(periods[1:] if len(periods) > 1 and together[0] else periods, time),
        "natural_period": mean(lambda cycle: cycle.period, time) if damping.of else _mean([], time),
        "damping_ratio": damping,
    }
    if fitted.samples < RESOLVED:  # the largest force lies between samples
        found["static_friction"] = found["static_friction"]._replace(uncertainty=math.nan)
    return {name: number for name, number in found.items() if number.of}


def _mean_force(
    at: Floats, force: Floats, starts: Sequence[float], unit: str, together: NDArray[np.bool_]
) -> dict[str, Measured]:
    """The mean of the force from slip to slip; its ± from leaving out one cycle each.

    Over whole periods the stage's work is that of friction and damper, and a stuck pin does none: so it is μ_k, averaged over the
    way of the pin, and 2ζ/(ω r T) ∫y'² dt, which the damper takes.
    """
    kept = together.copy()
    kept[:1] &= len(starts) <= FEWEST  # the first slip is from rest
    if not kept.any():
        return {}
    work, lasts = np.diff(np.interp(starts, at, _impulse(at, force)))[kept], np.diff(starts)[kept]
    if len(lasts) > 1 and correlated(work - work.sum() / lasts.sum() * lasts):
        work, lasts = (np.array([part.sum() for part in np.array_split(each, BATCHES)]) for each in (work, lasts))
    without = [] if len(lasts) < 2 else (work.sum() - work) / (lasts.sum() - lasts)
    return {"mean_force": Measured(float(work.sum() / lasts.sum()), jackknife(without), int(kept.sum()), unit)}


def _impulse(at: Floats, force: Floats) -> Floats:
    """The force added up from the first sample to each."""
    return np.concatenate(([0.0], np.cumsum(np.diff(at) * (force[1:] + force[:-1]) / 2.0)))


def _mean(values: Sequence[float] | Floats, unit: str) -> Measured:
    """The mean of these values and its ±; NaN of none."""
    if not len(values):
        return Measured(math.nan, math.nan, 0, unit)
    mean = float(np.mean(values))
    return Measured(mean, float(mean_of(independent(np.asarray(values, float))).uncertainty), len(values), unit)


def _steady(at: Floats, force: Floats, unit: str) -> tuple[Measured, float, float]:
    """Mean of the force while it is steady, with the ± of eight parts; its start; and its relative change if it is not."""
    edges = np.linspace(at[0], at[-1], BINS + 1)
    bins = np.diff(np.interp(edges, at, _impulse(at, force))) / np.diff(edges)
    blocks, complaint = steady_blocks(bins)
    means = blocks.reshape(8, -1).mean(axis=1)
    change = float(np.polyfit(np.linspace(-0.5, 0.5, 8), means, 1)[0] / means.mean()) if complaint else math.nan
    return _mean(means, unit), float(edges[truncation(bins)]), change


def _stiffness(trace: Trace, rates: Floats, velocity: float, load: float) -> dict[str, Measured]:
    """Slope of the force while the pin sticks: over displacement (given by time and velocity), else over time."""
    far = trace.over == "displacement" or math.isfinite(velocity)
    over, per = ("m", velocity if trace.over == "time" else 1.0) if far else ("s", 1.0)
    force = "N " if trace.unit == "N" or math.isfinite(load) else ""
    return {"rising_stiffness" if far else "rising_rate": _mean(rates / per, f"{force}{over}-1")}


def _of_noise(look: _Look, pull: _Pull) -> Iterator[Flag]:
    """Flags of the samples."""
    force, begins, units = look.trace.force, float(look.trace.force[0]), _units(look.trace, pull)
    if look.width > 1:
        yield Flag("averaged", {"width": look.width})
    if abs(begins) > max(NOISE * look.noise, 0.02 * float(force.max())):
        yield Flag("offset", {"begins": begins, **units})
    if NOISE * look.noise > look.drop:
        yield Flag("noise", {"least": NOISE * look.noise, **units})


def _of_fit(look: _Look, fitted: _Fitted, pull: _Pull) -> Iterator[Flag]:
    """Flags of the cycles."""
    cycles, units = fitted.cycles, _units(look.trace, pull)
    if fitted.unlike:
        yield Flag("unlike_model" if not cycles else "unlike_cycles", {"count": len(fitted.unlike)})
    if not cycles:
        return
    if len(cycles) == 1:
        yield Flag("one_cycle", {})
    if not fitted.damping.of and not fitted.given:
        yield Flag("no_damping", {"samples": RESOLVED})
    if fitted.samples < RESOLVED:
        yield Flag("few_samples", {"samples": fitted.samples})
    static = np.array([cycle.driving for cycle in cycles])
    if correlated(static):
        yield Flag("correlated", {"batches": BATCHES})
    seen = LARGEST_CHANGE * abs(static.mean())
    if len(static) <= FEWEST:
        return
    if static[0] - static[1:].mean() > max(SIGNIFICANT * static[1:].std(ddof=1), seen):
        yield Flag("first_slip", {"force": float(static[0]), **units})
    line = scipy.stats.linregress([cycle.start for cycle in cycles[1:]], static[1:])
    if abs(line.slope) > max(SIGNIFICANT * line.stderr, seen / (cycles[-1].start - cycles[0].start)):
        yield Flag("drift", {"rate": float(line.slope), **units})
