"""A force that a laboratory measured while a stage pulled a pin: friction, period and stiffness, by Eq. 16-19.

While the pin sticks, the force y rises by r = k·V a second; while it slides, y'' + 2ζω y' + ω² y = ω² F, with rate r at both
ends. So k, V and the mass need not be known. Each cycle is fitted alone; the ± is their scatter (`nanoslip.solver.ensemble`).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.dynamics.coefficients import LARGEST_CHANGE, SIGNIFICANT, steady_blocks
from nanoslip.solver.dynamics.result import BINS
from nanoslip.solver.dynamics.stick_slip import Oscillator
from nanoslip.solver.ensemble import FEWEST, jackknife, mean_of
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.parameter import require
from nanoslip.study.manifest.columns import read_columns
from nanoslip.study.manifest.parameters import factor

Floats = NDArray[np.float64]
FEWEST_POINTS: Final = 16
"""Of a trace."""
NOISE: Final = 10.0
"""Standard deviations of noise by which a force, or its means, falls in a slip: a million values of noise are that far apart."""
LEAST_DROP: Final = 0.1
"""Share of the largest drop of force below which another is none of the same kind: a ringing pin, or noise."""
RESOLVED: Final = 8
"""Samples of half an oscillation, from which on the shape of a slip tells the damping."""
MOST_CYCLES: Final = 64
"""That are fitted, evenly chosen: more tell little."""
SMALLEST, LARGEST = 1e-50, 1e50
"""Differences and sizes of forces and times: squares of their ratios, and products of two of these, are floats."""
FASTER: Final = 1e3
"""Times that a slip's own frequency may be above or below what its length says."""


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """A measured force (n,) over time in s, or over the displacement of the stage in m; and how its file was read."""

    at: Floats
    force: Floats
    over: str
    """`time` or `displacement`."""
    separator: str = ""
    skipped: int = 0
    """Lines before the numbers."""
    unit: str = "N"
    """Of the force; 1 for a friction coefficient."""

    def __post_init__(self) -> None:
        for name, values, least in (
            (self.over, self.at, np.diff(self.at).min()),
            ("force", self.force, np.ptp(self.force)),
        ):
            if not (least >= SMALLEST and np.abs(values).max() <= LARGEST):
                needs = f"needs numbers up to {LARGEST:g} that differ, by {SMALLEST:g} or more"
                raise InvalidInput(f"{name} = {values.min():.4g} to {values.max():.4g}: {needs}")

    def without(self, offset: float, drift: float) -> "Trace":
        """The trace less a constant force, and less one that grows from its start on."""
        return replace(self, force=self.force - offset - drift * (self.at - self.at[0]))

    def averaged(self, width: int) -> "Trace":
        """Means of so many neighbouring samples each."""
        kept = len(self.at) // width * width
        at, force = (values[:kept].reshape(-1, width).mean(axis=1) for values in (self.at, self.force))
        return replace(self, at=at, force=force)

    def at_velocity(self, velocity: float) -> "Trace":
        """Over time instead of displacement, of a stage with this velocity (m/s)."""
        return self if self.over == "time" else replace(self, at=self.at / velocity, over="time")


def read_trace(path: Path, text: str, over: str, unit: str, force: str, columns: tuple[int, int] = (0, 1)) -> Trace:
    """A trace from its file's text. over: `time` or `displacement`, in `unit`. Raises InvalidInput with line and value."""
    scale, up = factor(unit, {"time": "s", "displacement": "m"}[over]), factor(force, "N")
    own = "1" if math.isnan(up) and math.isfinite(factor(force, "")) else "N"
    require(over, unit, scale > 0.0, f"a unit of {'time, as ms' if over == 'time' else 'length, as um'}")
    up = factor(force, "") if own == "1" else up
    require("force", force, up > 0.0, "a unit of force, as mN, or 1 for a friction coefficient")
    found = read_columns(path, text, columns)
    require("number of points", len(found.rows), len(found.rows) >= FEWEST_POINTS, f"at least {FEWEST_POINTS}")
    way = 1.0 if over == "time" or found.rows[-1][1][0] > found.rows[0][1][0] else -1.0
    for (_, (before, _)), (number, (now, _)) in pairwise(found.rows):
        if not (now - before) * way > 0.0:
            needed = f"needs {over} that {'goes on' if over == 'time' else 'goes one way: one stroke'}"
            raise InvalidInput(f"line {number}: {over} = {now:g} after {before:g}: {needed}")
    at, values = np.array([row for _, row in found.rows]).T
    sign = math.copysign(1.0, float(values.mean()))  # of a cell that counts the other way
    return Trace(way * (at - at[0]) * scale, sign * values * up, over, found.separator, found.skipped, own)


class Measured(NamedTuple):
    """A number of a trace: its mean over so many cycles, and its ± (NaN of one alone)."""

    value: float
    uncertainty: float
    of: int
    unit: str = "1"


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
    """Numbers of a trace by the name that they have in a dataset, the fitted cycles, and sentences on what is missing."""

    numbers: dict[str, Measured]
    cycles: tuple[Cycle, ...]
    notes: tuple[str, ...]


class _Slip(NamedTuple):
    """Samples of the force's peak before a slip and of its least value after it; and whether it rises again."""

    peak: int
    trough: int
    ended: bool


class _Look(NamedTuple):
    """The means of so many neighbouring samples each, their noise, the fall of force that is a slip, and the slips."""

    width: int
    trace: Trace
    noise: float
    drop: float
    slips: list[_Slip]


def _look(trace: Trace, width: int) -> _Look:
    trace = trace.averaged(width)
    force = trace.force
    noise = 1.4826 * float(np.median(np.abs(np.diff(force, 2)))) / math.sqrt(6.0)
    drop = LEAST_DROP * float((np.maximum.accumulate(force) - force).max())
    return _Look(width, trace, noise, drop, [slip for slip in _slips(force, max(NOISE * noise, drop)) if slip.peak > 0])


def measure(
    trace: Trace, load: float = math.nan, velocity: float = math.nan, damping: float | None = None
) -> TraceNumbers:
    """Friction, period, amplitude and stiffness of a trace.

    load: in N, which makes coefficients of forces. velocity: of the stage, in m/s. damping: ζ of the machine; None to fit it.
    """
    per = load if trace.unit == "N" and math.isfinite(load) else 1.0
    newtons = load if math.isfinite(load) else 1.0
    unit = "1" if math.isfinite(load) else trace.unit
    trace = replace(trace, force=trace.force / per)
    widths = [2**power for power in range((len(trace.at) // FEWEST_POINTS).bit_length() or 1)]
    looks = [_look(trace, width) for width in widths]
    most = max(len(look.slips) for look in looks)
    look = next(look for look in looks if len(look.slips) >= most - 1)  # one at an end may be seen or not
    at, force, slips = look.trace.at, look.trace.force, look.slips
    turned = _turned(at, slips)
    slips = [] if turned else slips
    peaks = at[[slip.peak for slip in slips]]
    slides = not slips or at[-1] - peaks[-1] > (np.diff(peaks).max() if len(slips) > 1 else peaks[0] - at[0])
    rates = [_rate(at, force, low, slip.peak) for low, slip in zip(_beginnings(slips), slips, strict=True)]
    whole = [number for number, slip in enumerate(slips) if slip.ended][: None if not slides else 0]
    chosen = [whole[int(place)] for place in np.linspace(0, len(whole) - 1, min(len(whole), MOST_CYCLES))]
    free: list[Cycle] = []
    if damping is None:
        fits = {number: _cycle(at, force, slips, number, rates[number], None) for number in chosen}
        least = 2.0 * RESOLVED * float(np.median(np.diff(at)))
        resolved = [number for number, cycle in fits.items() if cycle.period >= least]
        if 2 * len(resolved) >= len(chosen):
            chosen, free = resolved, [fits[number] for number in resolved]
    known = _mean([cycle.damping for cycle in free], "1") if damping is None else Measured(damping, math.nan, 0)
    zeta = known.value if known.value > 0.0 else 0.0
    cycles = tuple(_cycle(at, force, slips, number, rates[number], zeta) for number in chosen)
    numbers, notes = {}, _notes(look, unit, cycles)
    if cycles:
        numbers = _of_cycles(cycles, free or cycles, chosen, known, unit, "s" if trace.over == "time" else "m")
        numbers |= _mean_force(at, force, [cycle.start for cycle in cycles], unit)
    if turned:
        notes.append("the force falls more slowly than it rises, which is no stick-slip: has it the other sign?")
    if cycles and not known.of and damping is None:
        lost = "μ_k is below the mean force, and μ_s lacks the damper's force"
        notes.append(f"slips of fewer than {RESOLVED} samples do not tell the damping: {lost}; --damping gives both")
    if slides:
        first = slips[-1].peak if slips else 0
        if slips:
            numbers["static_friction"] = Measured(float(force[slips[0].peak]), math.nan, 1, unit)
        value, why = _steady(at[first:], force[first:], unit)
        numbers |= {} if why else {"kinetic_friction": value}
        lasts = "after the last slip" if slips else "all along: no stick-slip, so no μ_s, period or amplitude"
        notes.append(why or f"steady {lasts}; μ_k is the mean, its ± from eight parts")
        rates = rates[:1] or _ramp(at, force)
    if rates:
        numbers |= _stiffness(trace, newtons * np.array(rates[1:] or rates), velocity, load)
    return TraceNumbers(numbers, cycles, tuple(notes))


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
    """Whether the force falls more slowly than it rises, which no stick-slip does: its slip is the shorter part."""
    falls = sum(at[slip.trough] - at[slip.peak] for slip in slips[:-1])
    rises = sum(at[after.peak] - at[slip.trough] for slip, after in pairwise(slips))
    return bool(falls > 1.5 * rises)


def _beginnings(slips: Sequence[_Slip]) -> list[int]:
    """Where the force begins to rise towards each slip."""
    return [0, *(slip.trough for slip in slips[:-1])] if slips else []


def _rate(at: Floats, force: Floats, low: int, high: int) -> float:
    """By how much the force rises, in the middle of its way up from one sample to another; at first a stage may be at rest."""
    if low == 0:
        smooth = np.maximum.accumulate(force[:high])
        low = min(int(np.searchsorted(smooth, 0.9 * force[0] + 0.1 * force[high])), high - 1)
    middle = slice(low + (high - low) // 5, high - (high - low) // 5 + 1)
    return float(np.polyfit(at[middle] - at[low], force[middle], 1)[0])


def _ramp(at: Floats, force: Floats) -> list[float]:
    """By how much the force rises before steady sliding; none of a trace that begins there."""
    most = float(np.median(force))
    top = int(np.argmax(force >= 0.9 * most))
    return [_rate(at, force, 0, top)] if force[0] < 0.5 * most and top > FEWEST else []


def _cycle(at: Floats, force: Floats, slips: Sequence[_Slip], number: int, rate: float, damping: float | None) -> Cycle:
    """The closed form that fits a slip best, from the middle of the rise before it to that of the one behind it.

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


def _of_cycles(
    cycles: Sequence[Cycle], free: Sequence[Cycle], chosen: Sequence[int], damping: Measured, unit: str, time: str
) -> dict[str, Measured]:
    """Numbers of the chosen cycles. The time to the second slip is none of the others': the first starts from rest.

    free: the same, each with a damping of its own. What is not known of the damping that all have shifts them together, and it is
    what these scatter, so their ± is that of the mean.
    """

    def mean(of: Callable[[Cycle], float], unit: str) -> Measured:
        own = _mean([of(cycle) for cycle in free], unit)
        return own._replace(value=float(np.mean([of(cycle) for cycle in cycles])))

    sure = math.isfinite(damping.value)
    periods = np.diff([cycle.start for cycle in cycles]) / np.diff(chosen)
    found = {
        "static_friction": mean(lambda cycle: cycle.driving, unit),
        "kinetic_friction": mean(lambda cycle: cycle.kinetic, unit) if sure else _mean([], unit),
        "spring_force_amplitude": mean(lambda cycle: cycle.static - cycle.trough, unit),
        "stick_slip_period": _mean(periods[1:] if len(periods) > 1 else periods, time),
        "natural_period": mean(lambda cycle: cycle.period, time) if damping.of else _mean([], time),
        "damping_ratio": damping,
    }
    return {name: number for name, number in found.items() if number.of}


def _mean_force(at: Floats, force: Floats, starts: Sequence[float], unit: str) -> dict[str, Measured]:
    """The mean of the force from slip to slip; its ± from leaving out one cycle each.

    Over whole periods the stage's work is that of friction and damper, and a stuck pin does none: so it is μ_k, averaged over the
    way of the pin, and 2ζ/(ω r T) ∫y'² dt, which the damper takes.
    """
    ends = np.array(starts[1:] if len(starts) > FEWEST else starts)
    if len(ends) < 2:
        return {}
    work, lasts = np.diff(np.interp(ends, at, _impulse(at, force))), np.diff(ends)
    without = [] if len(lasts) < 2 else (work.sum() - work) / (lasts.sum() - lasts)
    return {"mean_force": Measured(float(work.sum() / lasts.sum()), jackknife(without), len(lasts), unit)}


def _impulse(at: Floats, force: Floats) -> Floats:
    """The force added up from the first sample to each."""
    return np.concatenate(([0.0], np.cumsum(np.diff(at) * (force[1:] + force[:-1]) / 2.0)))


def _mean(values: Sequence[float] | Floats, unit: str) -> Measured:
    """The mean of these values and its ±; NaN of none."""
    if not len(values):
        return Measured(math.nan, math.nan, 0, unit)
    found = mean_of(np.asarray(values, float))
    return Measured(float(found.mean), float(found.uncertainty), len(values), unit)


def _steady(at: Floats, force: Floats, unit: str) -> tuple[Measured, str]:
    """The mean of the force where it is steady, with the ± of eight parts of it; and why it has none."""
    edges = np.linspace(at[0], at[-1], BINS + 1)
    blocks, complaint = steady_blocks(np.diff(np.interp(edges, at, _impulse(at, force))) / np.diff(edges))
    why = f"no μ_k: the force {complaint}: needs a longer trace" if complaint else ""
    return _mean(blocks.reshape(8, -1).mean(axis=1), unit), why


def _stiffness(trace: Trace, rates: Floats, velocity: float, load: float) -> dict[str, Measured]:
    """How steeply the force rises while the pin sticks: over displacement, which a time and a velocity give, else over time."""
    far = trace.over == "displacement" or math.isfinite(velocity)
    over, per = ("m", velocity if trace.over == "time" else 1.0) if far else ("s", 1.0)
    force = "N " if trace.unit == "N" or math.isfinite(load) else ""
    return {"rising_stiffness" if far else "rising_rate": _mean(rates / per, f"{force}{over}-1")}


def _notes(look: _Look, unit: str, cycles: Sequence[Cycle]) -> list[str]:
    """What a reader of the numbers has to know."""
    own, notes = "" if unit == "1" else f" {unit}", []
    width, trace, noise, drop, _ = look
    force, begins = trace.force, float(trace.force[0])
    if width > 1:
        notes.append(f"slips are lost in the noise of single samples: numbers are of means over {width} each")
    if abs(begins) > max(NOISE * noise, 0.02 * float(force.max())):
        notes.append(f"the trace begins at {begins:.3g}{own}: if nothing pulls there, take it off by offset")
    if NOISE * noise > drop:
        notes.append(f"where the force falls by less than {NOISE * noise:.2g}{own} it counts as noise, not as a slip")
    if not cycles:
        return notes
    if len(cycles) == 1:
        notes.append("one cycle only: no ±")
    missed = math.sqrt(max(float(np.mean([cycle.residual**2 for cycle in cycles])) - noise**2, 0.0))
    if missed > drop:
        notes.append(
            f"Eq. 16-19 miss the force by {LEAST_DROP * missed / drop:.0%} of its largest fall: μ_k is a rough number"
        )
    static = np.array([cycle.driving for cycle in cycles])
    seen = LARGEST_CHANGE * abs(static.mean())
    if len(static) > FEWEST and static[0] - static[1:].mean() > max(SIGNIFICANT * static[1:].std(ddof=1), seen):
        notes.append(f"the first slip needs {static[0]:.4g}{own}, more than the others: μ_s is the mean of all")
    if len(static) > FEWEST:
        line = scipy.stats.linregress([cycle.start for cycle in cycles[1:]], static[1:])
        if abs(line.slope) > max(SIGNIFICANT * line.stderr, seen / (cycles[-1].start - cycles[0].start)):
            per = "s" if trace.over == "time" else "m"
            notes.append(f"the force before slips drifts by {line.slope:.2g}{own} each {per}: take it off by drift")
    return notes
