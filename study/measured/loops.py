"""Loops of a measured friction force over the position of a stage that goes to and fro: energy, friction, stiffness, slip.

Each number is taken of each stroke. Friction has the sign of the way, an offset of the force cell has not: numbers of strokes
there and back differ by it with alternating sign, and by a drift with a growing one. Both are fitted, and taken off. A rig, of
stiffness k between the stage and the contact, moves the loop's points by F/k and takes no energy.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import compress, pairwise
from typing import Final, Literal, NamedTuple

import numpy as np
import scipy

from nanoslip.solver.arrays import Floats
from nanoslip.solver.ensemble import student
from nanoslip.solver.outcome import InvalidInput
from nanoslip.study.measured.means import Measured, mean_with_error
from nanoslip.study.measured.recording import FEWEST_POINTS, NOISE, find_gaps, noise_deviation, turning_points

MIDDLE: Final = (0.4, 0.6)
"""Shares of a stroke's way between which friction is that at mid-stroke."""
NEAR_TURN: Final = 0.95
"""Share of a stroke's way from which on force and place are those before the turn: there a sine is a parabola but for 1e-4."""
UNLOADED: Final = (0.05, 0.35)
"""Shares of the swing of force after a turn between which the contact's stiffness is taken: sticks, and is past the turn."""
SURE: Final = 2.0
"""Errors of a number by which it differs from another."""
FEW_TIMES: Final = 2.2
"""Number of ± for 95 % from which on 2 ± is no longer near that: a tenth more, of six degrees of freedom or fewer."""
SLIDES_FROM: Final = 0.2
"""Energy of a cycle over 4 F δ, both at the turns, above which a contact slides (Fouvry, Kapsa, Vincent, Wear 200, 186, 1996)."""


class LoopStroke(NamedTuple):
    """A stroke from turn to turn: its samples, and +1 if it goes towards larger positions, else -1."""

    first: int
    last: int
    way: int


LoopState = Literal["slides", "partial_slip", "sticks"]


@dataclass(frozen=True, slots=True, eq=False)
class Loops:
    """Numbers of loops by name, and the state of the contact: None if noise leaves it open.

    force, position: in N, or as shares of the load, and m (n,), less offset and drift. strokes: the whole ones, turn to turn.
    """

    numbers: dict[str, Measured]
    state: LoopState | None
    rigid: bool
    """True if the loop is as stiff as the rig: that of the contact is then not known."""
    begins_at_rest: bool
    """True if the only cycle begins without force: its loop is wider than later loops."""
    stretching: float
    """Share of a stroke after a turn that only stretches rig and contact; NaN if nothing slides."""
    position: Floats
    force: Floats
    strokes: tuple[LoopStroke, ...]
    freedom: int
    """Degrees of freedom of the ± of energies: strokes less the unknowns fitted to them; 0 without ±."""


def coverage_factor(freedom: int) -> float:
    """Number of ± within which 95 % lie: by Student's t 2 for many degrees of freedom, and 7 for one; NaN for none."""
    if not freedom:
        return math.nan
    return float(scipy.stats.t.ppf(0.975, freedom) / student(freedom + 1))


def whole_strokes(position: Floats, at: Floats | None = None) -> list[LoopStroke]:
    """Strokes of a stage from turn to turn; a part that is shorter than half of the longest is none.

    A trace begins and ends anywhere: its first and last stroke count if they go as far as their neighbour, within the noise of
    positions and a step at each end. at: time or way of each sample, in which a stroke has no gap.
    """
    turns = turning_points(position)
    strokes = []
    for first, last in pairwise(turns):
        way = 1 if position[last] > position[first] else -1
        strokes.append(LoopStroke(first, last, way))
    ways = [position[stroke.last] - position[stroke.first] for stroke in strokes]
    lengths = [abs(float(way)) for way in ways]
    longest_step = float(np.abs(np.diff(position)).max())
    open_ends = NOISE * noise_deviation(position) + 2.0 * longest_step
    least = [max(lengths) / 2.0] * len(strokes)
    if len(strokes) > 1:
        least[0] = max(least[0], lengths[1] - open_ends)
        least[-1] = max(least[-1], lengths[-2] - open_ends)
    far = [stroke for stroke, length, most in zip(strokes, lengths, least, strict=True) if length > most]
    # Of few samples a leg is a jump in the readings: beside it, too, it is not known where the stage turned.
    jumps = [leg for leg in strokes[1:-1] if leg.last - leg.first < FEWEST_POINTS]
    edges = {leg.first for leg in jumps} | {leg.last for leg in jumps}
    is_sure = [edges.isdisjoint((stroke.first, stroke.last)) for stroke in far]
    sure = list(compress(far, is_sure))
    strokes_with_points = [stroke for stroke in sure if stroke.last - stroke.first >= FEWEST_POINTS]
    if at is None:
        return strokes_with_points
    usual = float(np.median(np.diff(at[turns])))
    gaps = find_gaps(at, usual)
    # Beside a gap it is not known where the stage turned.
    return [stroke for stroke in strokes_with_points if not gaps[max(stroke.first - 1, 0) : stroke.last + 1].any()]


def measure_loops(
    position: Floats,
    force: Floats,
    unit: str,
    newtons: float,
    rig: float = math.inf,
    at: Floats | None = None,
) -> Loops | None:
    """Numbers of all whole strokes; None without one there and one back.

    newtons: newtons per unit of the force, NaN for a coefficient without load. rig: stiffness in N/m between the stage and the
    contact. at: time or way of each sample; None without gaps. Raises InvalidInput for a rig that is softer than the loop.
    """
    strokes = whole_strokes(position, at)
    if len({stroke.way for stroke in strokes}) < 2:
        return None
    per_load = math.isnan(newtons)
    if per_load and math.isfinite(rig):
        raise InvalidInput("rig", f"{rig:.4g} N/m", "--load with it: the force of a coefficient is not known without")
    newtons = 1.0 if per_load else newtons
    energy_unit, stiffness_unit = ("J N-1", "m-1") if per_load else ("J", "N m-1")
    force = _forces_along_strokes(position, force, strokes)
    first, last = strokes[0].first, strokes[0].last
    begin = float(force[first : first + 3].mean())
    end = float(force[last - 3 : last].mean())
    begins_at_rest = abs(begin) < abs(end) / 2.0
    # The first loading of a contact is another curve than its later ones; with few strokes it is all there is.
    if begins_at_rest and len(strokes) > 2:
        strokes, begins_at_rest = strokes[1:], False
    slopes = [_slope_after_turn(position, force, stroke) for stroke in strokes[1:]]
    slopes = [newtons * slope for slope in slopes if math.isfinite(slope)]
    stiffness = mean_with_error(slopes, stiffness_unit)
    contact = _less_rig(stiffness, rig)
    ways = np.array([stroke.way for stroke in strokes], float)

    def measure_strokes(measure: StrokeNumber) -> StrokeNumbers:
        values = [measure(position, force, stroke) for stroke in strokes]
        return StrokeNumbers.from_strokes(np.array(values), ways)

    works = measure_strokes(_work)
    swings = measure_strokes(lambda _, force, stroke: stroke.way * _value_at_turn(position, force, stroke))
    middles = measure_strokes(
        lambda position, force, stroke: stroke.way * _mean_within_shares(position, force, stroke, *MIDDLE)
    )
    widths = measure_strokes(lambda position, force, stroke: -stroke.way * _place_of_zero(position, force, stroke))
    ends = measure_strokes(lambda position, _, stroke: stroke.way * _value_at_turn(position, position, stroke))
    # A stroke is half a cycle.
    energies = works.times(2.0 * newtons)
    # The rig between stage and contact takes up a part of the stage's amplitude.
    in_rig = swings.values * (newtons / rig)
    amplitudes = StrokeNumbers(ends.values - in_rig, ends.fitted)
    ratio = Measured(math.nan, math.nan, 0, "1")
    if len(amplitudes.values) and min(amplitudes.values.min(), swings.values.min()) > 0.0:
        # The rectangle around the loop, 2 swings high and 2 amplitudes wide.
        rectangles = 4.0 * newtons * swings.values * amplitudes.values
        ratio = StrokeNumbers(energies.values / rectangles, energies.fitted).mean("1")
    energy = energies.mean(energy_unit)
    secant = Measured(math.nan, math.nan, 0, stiffness_unit)
    if ratio.of:
        secants = newtons * swings.values / amplitudes.values
        secant = StrokeNumbers(secants, energies.fitted).mean(stiffness_unit)
    state = None
    if ratio.of and float(np.ptp(force)) > NOISE * noise_deviation(force):
        state = _state(ratio, energy)
    # The force is zero half-way through the stretching, and the loop is as wide there as the contact slides.
    stretching = math.nan
    if state == "slides" and len(widths.values):
        mean_width, mean_end = float(widths.values.mean()), float(ends.values.mean())
        stretching = 1.0 - mean_width / mean_end
    all_numbers = {
        "cycle_energy": energy,
        "mid_stroke_friction": middles.mean(unit) if stretching <= MIDDLE[0] else None,
        "turn_friction": swings.mean(unit),
        "contact_stiffness": contact,
        "secant_stiffness": secant,
        "contact_amplitude": amplitudes.mean("m") if ratio.of else None,
        # A contact that only yields has no slip.
        "slip_amplitude": widths.mean("m") if state == "slides" else None,
        "energy_ratio": ratio,
    }
    present = {name: number for name, number in all_numbers.items() if number is not None}
    numbers = {name: number for name, number in present.items() if number.of}
    rigid = stiffness.of > 0 and not contact.of
    return Loops(numbers, state, rigid, begins_at_rest, stretching, position, force, tuple(strokes), works.freedom)


def _state(ratio: Measured, energy: Measured) -> LoopState | None:
    """State of the contact by the energy that its cycles lose."""
    if ratio.value > SLIDES_FROM:
        return "slides"
    if math.isnan(energy.uncertainty):
        return None
    return "partial_slip" if energy.value > SURE * energy.uncertainty else "sticks"


StrokeNumber = Callable[[Floats, Floats, LoopStroke], float]
"""A number of a stroke, by positions and forces."""


class StrokeNumbers(NamedTuple):
    """A number of each stroke (n,) without offset and drift, and how many unknowns were fitted for that."""

    values: Floats
    fitted: int

    @classmethod
    def from_strokes(cls, values: Floats, ways: Floats) -> "StrokeNumbers":
        """Take off what has the sign of the way: constant, and from three strokes on growing from stroke to stroke.

        Where a stroke is without samples there, it is left out.
        """
        is_finite = np.isfinite(values)
        kept, signs = values[is_finite], ways[is_finite]
        order = np.flatnonzero(is_finite).astype(float)
        if len(kept) < 2 or np.ptp(signs) == 0.0:
            return cls(np.empty(0), 1)
        columns = [np.ones(len(kept)), signs]
        if len(kept) > 2:
            columns.append(signs * (order - order.mean()))
        terms = np.column_stack(columns)
        solved, *_ = np.linalg.lstsq(terms, kept)
        without_offset = kept - terms[:, 1:] @ solved[1:]
        return cls(without_offset, len(columns))

    @property
    def freedom(self) -> int:
        """Degrees of freedom of the mean's ±."""
        return max(len(self.values) - self.fitted, 0)

    def times(self, factor: float) -> "StrokeNumbers":
        """The numbers times a factor."""
        return self._replace(values=factor * self.values)

    def mean(self, unit: str) -> Measured:
        """The mean with its ±: none of as many strokes as were fitted."""
        mean = mean_with_error(self.values, unit)
        count = len(self.values)
        if count <= self.fitted:
            return mean._replace(uncertainty=math.nan)
        # Fitted unknowns leave less scatter, and fewer degrees of freedom for Student's t.
        free = count - self.fitted + 1
        scatter_ratio = math.sqrt((count - 1.0) / (free - 1.0))
        wider = scatter_ratio * float(student(free) / student(count))
        return mean._replace(uncertainty=wider * mean.uncertainty)


def _forces_along_strokes(position: Floats, force: Floats, strokes: Sequence[LoopStroke]) -> Floats:
    """Forces that act along the stroke towards larger positions: the sign of a cell is not known."""
    # Friction has the sign of the way; the force of a contact that only yields rises with the position.
    means = [float(force[stroke.first : stroke.last].mean()) for stroke in strokes]
    along = sum(stroke.way * mean for stroke, mean in zip(strokes, means, strict=True))
    slope, _ = np.polyfit(position - position.mean(), force, 1)
    rises = float(slope)
    size = len(strokes) * float(np.abs(force).mean())
    is_sliding = abs(along) > 0.1 * size
    return force * math.copysign(1.0, along if is_sliding else rises)


def _work(position: Floats, force: Floats, stroke: LoopStroke) -> float:
    """Integral of the force over the way of a stroke."""
    samples = slice(stroke.first, stroke.last + 1)
    steps, forces = np.diff(position[samples]), force[samples]
    trapezia = steps * (forces[1:] + forces[:-1]) / 2.0
    return float(np.sum(trapezia))


def _shares(position: Floats, stroke: LoopStroke) -> Floats:
    """Shares of a stroke's way at its samples."""
    places = position[stroke.first : stroke.last + 1]
    length = places[-1] - places[0]
    shares: Floats = (places - places[0]) / length
    return shares


def _mean_within_shares(position: Floats, force: Floats, stroke: LoopStroke, low: float, high: float) -> float:
    """Mean force between two shares of a stroke's way; NaN of no sample."""
    shares = _shares(position, stroke)
    is_within = (shares >= low) & (shares <= high)
    chosen = force[stroke.first : stroke.last + 1][is_within]
    return float(chosen.mean()) if len(chosen) else math.nan


def _value_at_turn(position: Floats, values: Floats, stroke: LoopStroke) -> float:
    """Force or position at the end of a stroke: by a parabola over time through the samples before it."""
    last = _shares(position, stroke) >= NEAR_TURN
    stroke_values = values[stroke.first : stroke.last + 1][last]
    if len(stroke_values) <= 3:
        return float(stroke_values[-1])
    before = np.flatnonzero(last) - float(stroke.last - stroke.first)
    parabola = np.polynomial.Polynomial.fit(before, stroke_values, 2)
    return float(parabola(0.0))


def _place_of_zero(position: Floats, force: Floats, stroke: LoopStroke) -> float:
    """The position where the force of a stroke passes zero for the first time; of noise the middle of all such places."""
    samples = slice(stroke.first, stroke.last + 1)
    forces, positions = force[samples], position[samples]
    signs = stroke.way * forces >= 0.0
    passed = np.flatnonzero(~signs[:-1] & signs[1:])
    if not len(passed):
        return float(positions[0])
    near = passed[passed < passed[0] + FEWEST_POINTS]
    way, rise = np.diff(positions), np.diff(forces)
    # Each by a line to the next sample.
    to_zero = forces[near] * way[near] / rise[near]
    places = positions[near] - to_zero
    return float(np.median(places))


def _slope_after_turn(position: Floats, force: Floats, stroke: LoopStroke) -> float:
    """Slope of the force after the turn with which a stroke begins, while its contact sticks; NaN of too few samples."""
    forces = stroke.way * force[stroke.first : stroke.last + 1]
    places = position[stroke.first : stroke.last + 1]
    level = float(np.median(forces[len(forces) // 2 :]))
    # While the contact sticks the force only rises: the nearest such line is without most of the noise.
    rising = scipy.optimize.isotonic_regression(forces).x
    begin = float(rising[:3].mean())
    if not level > begin:
        return math.nan
    gone = (rising - begin) / (level - begin)
    is_within = (gone >= UNLOADED[0]) & (gone <= UNLOADED[1])
    within = np.flatnonzero(is_within)
    if len(within) < 2:
        return math.nan
    # Both over time: a fit over positions would take their noise for way, and find a slope that is too small.
    order = within - within.mean()
    rise = float(order @ forces[within])
    way = float(order @ places[within])
    return stroke.way * rise / way if way else math.nan


def _less_rig(stiffness: Measured, rig: float) -> Measured:
    """Stiffness of the contact from that of contact and rig in a row; none where the rig is all of it within 2 ±.

    Raises InvalidInput if the rig is softer than both together, which no contact makes.
    """
    if math.isinf(rig) or not stiffness.of:
        return stiffness
    error = stiffness.uncertainty
    if stiffness.value - SURE * error > rig:
        shown = f"{stiffness.value:.4g} ± {error:.2g} N/m"
        need = f"more than {shown}, by which the force rises after a turn: contact and rig in a row are softer than the rig"
        raise InvalidInput("rig", f"{rig:.4g} N/m", need)
    known_error = error if math.isfinite(error) else 0.0
    if stiffness.value + SURE * known_error >= rig:
        return Measured(math.nan, math.nan, 0, stiffness.unit)
    # Springs in series: 1/k = 1/k_contact + 1/k_rig, so errors grow by (k_contact/k)².
    contact = 1.0 / (1.0 / stiffness.value - 1.0 / rig)
    uncertainty = stiffness.uncertainty * (contact / stiffness.value) ** 2
    return stiffness._replace(value=contact, uncertainty=uncertainty)
