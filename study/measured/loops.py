"""Loops of a measured friction force over the position of a stage that goes to and fro: energy, friction, stiffness, slip.

Forces are taken less the offset of their cell and its drift. A rig, of stiffness k between the stage and the contact, moves the
loop's points by F/k and takes no energy.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np

from nanoslip.solver.arrays import Floats
from nanoslip.study.measured.means import Measured, mean_with_error
from nanoslip.study.measured.recording import FEWEST_POINTS, NOISE, noise_deviation, turning_points

MIDDLE: Final = (0.4, 0.6)
"""Shares of a stroke's way between which friction is that at mid-stroke."""
NEAR_TURN: Final = 0.9
"""Share of a stroke's way from which on friction is that before the turn."""
UNLOADED: Final = (0.05, 0.35)
"""Shares of the swing of force after a turn between which the contact's stiffness is taken: sticks, and is past the turn."""
SLIDES_FROM: Final = 0.2
"""Energy of a cycle over 4 F δ, both at the turns, above which a contact slides (Fouvry, Kapsa, Vincent, Wear 200, 186, 1996)."""


class LoopStroke(NamedTuple):
    """A stroke from turn to turn: its samples, and +1 if it goes towards larger positions, else -1."""

    first: int
    last: int
    way: int


@dataclass(frozen=True, slots=True, eq=False)
class Loops:
    """Numbers of loops by name, and the state of the contact: True if it slides, None if noise leaves it open.

    force, position: in N, or as shares of the load, and m (n,), less offset and drift. strokes: from turn to turn.
    """

    numbers: dict[str, Measured]
    slides: bool | None
    rigid: bool
    """True if the loop is as stiff as the rig: that of the contact is then not known."""
    begins_at_rest: bool
    """True if the only cycle begins without force: its loop is wider than later loops."""
    position: Floats
    force: Floats
    strokes: tuple[LoopStroke, ...]


def strokes_between_turns(position: Floats) -> list[LoopStroke]:
    """Strokes of a stage from turn to turn; a part that is shorter than half of the longest is none."""
    turns = turning_points(position)
    strokes = []
    for first, last in pairwise(turns):
        way = 1 if position[last] > position[first] else -1
        strokes.append(LoopStroke(first, last, way))
    lengths = [abs(position[stroke.last] - position[stroke.first]) for stroke in strokes]
    longest = max(lengths)
    far = [stroke for stroke, length in zip(strokes, lengths, strict=True) if length > longest / 2.0]
    return [stroke for stroke in far if stroke.last - stroke.first >= FEWEST_POINTS]


def measure_loops(position: Floats, force: Floats, unit: str, newtons: float, rig: float = math.inf) -> Loops | None:
    """Numbers of all whole cycles; None if the stage does not go to and fro.

    newtons: newtons per unit of the force. rig: stiffness in N/m between the stage and the contact.
    """
    strokes = strokes_between_turns(position)
    if len({stroke.way for stroke in strokes}) < 2:
        return None
    force = _forces_along_strokes(position, force, strokes)
    first, last = strokes[0].first, strokes[0].last
    begin = float(force[first : first + 3].mean())
    end = float(force[last - 3 : last].mean())
    begins_at_rest = abs(begin) < abs(end) / 2.0
    if begins_at_rest and len(strokes) > 2:
        strokes, begins_at_rest = strokes[1:], False
    soft = newtons / rig
    works = [newtons * _work(position, force, stroke) for stroke in strokes]
    cycles = list(pairwise(range(len(strokes))))
    energies = [works[low] + works[high] for low, high in cycles]
    # Half of the difference between there and back: an offset of the force is the same in both, and drops out.
    ways = [strokes[low].way / 2.0 for low, _ in cycles]
    ends = [_contacts_at_turns(position, force, stroke) for stroke in strokes]
    swings = [(ends[low] - ends[high]) * way for (low, high), way in zip(cycles, ways, strict=True)]
    reaches = [abs(position[stroke.last] - position[stroke.first]) / 2.0 for stroke in strokes[:-1]]
    # The rig between stage and contact takes up a part of the stage's amplitude.
    amplitudes = [reach - swing * soft for reach, swing in zip(reaches, swings, strict=True)]
    middles = [_mean_within_shares(position, force, stroke, *MIDDLE) for stroke in strokes]
    halves = [(middles[low] - middles[high]) * way for (low, high), way in zip(cycles, ways, strict=True)]
    widths = [_width(position, force, strokes[low], strokes[high]) for low, high in cycles]
    slopes = [_slope_after_turn(position, force, stroke) for stroke in strokes[1:]]
    slopes = [slope for slope in slopes if math.isfinite(slope)]
    # The rectangle around the loop, 2 swings high and 2 amplitudes wide.
    most = [4.0 * newtons * swing * reach for swing, reach in zip(swings, amplitudes, strict=True)]
    ratios = [energy / largest for energy, largest in zip(energies, most, strict=True) if largest > 0.0]
    stiffness = mean_with_error([newtons * slope for slope in slopes], "N m-1")
    contact = _less_rig(stiffness, rig)
    ratio = mean_with_error(_separate(ratios), "1")
    slides: bool | None = None
    if ratio.of and float(np.ptp(force)) > NOISE * noise_deviation(force):
        slides = ratio.value > SLIDES_FROM
    # A loop whose contact only yields has no friction of sliding and no slip.
    friction = mean_with_error(_separate(halves) if slides else [], unit)
    slip = mean_with_error(_separate(widths) if slides else [], "m")
    moved = [amplitude for amplitude in amplitudes if amplitude > 0.0]
    found = {
        "cycle_energy": mean_with_error(_separate(energies), "J"),
        "mid_stroke_friction": friction,
        "turn_friction": mean_with_error(_separate(swings), unit),
        "contact_stiffness": contact,
        "contact_amplitude": mean_with_error(_separate(moved), "m"),
        "slip_amplitude": slip,
        "energy_ratio": ratio,
    }
    numbers = {name: number for name, number in found.items() if number.of}
    rigid = stiffness.of > 0 and not contact.of
    return Loops(numbers, slides, rigid, begins_at_rest, position, force, tuple(strokes))


def _forces_along_strokes(position: Floats, force: Floats, strokes: Sequence[LoopStroke]) -> Floats:
    """Forces that act along the stroke towards larger positions: the sign of a cell is not known."""
    # Friction has the sign of the way; the force of a contact that only yields rises with the position.
    means = [float(force[stroke.first : stroke.last].mean()) for stroke in strokes]
    along = sum(stroke.way * mean for stroke, mean in zip(strokes, means, strict=True))
    rises = float(np.polyfit(position - position.mean(), force, 1)[0])
    size = len(strokes) * float(np.abs(force).mean())
    is_sliding = abs(along) > 0.1 * size
    return force * math.copysign(1.0, along if is_sliding else rises)


def _separate(values: Sequence[float]) -> list[float]:
    """Every second of the numbers of neighbouring strokes: the others share a stroke with these."""
    return list(values[::2])


def _work(position: Floats, force: Floats, stroke: LoopStroke) -> float:
    """Integral of the force over the way of a stroke."""
    samples = slice(stroke.first, stroke.last + 1)
    steps, forces = np.diff(position[samples]), force[samples]
    trapezia = steps * (forces[1:] + forces[:-1]) / 2.0
    return float(np.sum(trapezia))


def _shares(position: Floats, stroke: LoopStroke) -> Floats:
    """Shares of a stroke's way at its samples."""
    own = position[stroke.first : stroke.last + 1]
    shares: Floats = (own - own[0]) / (own[-1] - own[0])
    return shares


def _mean_within_shares(position: Floats, force: Floats, stroke: LoopStroke, low: float, high: float) -> float:
    """Mean force between two shares of a stroke's way; NaN of no sample."""
    shares = _shares(position, stroke)
    is_within = (shares >= low) & (shares <= high)
    chosen = force[stroke.first : stroke.last + 1][is_within]
    return float(chosen.mean()) if len(chosen) else math.nan


def _contacts_at_turns(position: Floats, force: Floats, stroke: LoopStroke) -> float:
    """Force at the end of a stroke: of its last tenth, on the line through this at the turn."""
    shares = _shares(position, stroke)
    last = shares >= NEAR_TURN
    forces = force[stroke.first : stroke.last + 1][last]
    if len(forces) < 3:
        return float(forces[-1])
    line = np.polyfit(shares[last] - 1.0, forces, 1)
    return float(np.polyval(line, 0.0))


def _width(position: Floats, force: Floats, there: LoopStroke, back: LoopStroke) -> float:
    """Half of the loop's width where the force is zero: there neither rig nor contact is strained."""
    places = [_place_of_zero(position, force, stroke) for stroke in (there, back)]
    return abs(places[1] - places[0]) / 2.0


def _place_of_zero(position: Floats, force: Floats, stroke: LoopStroke) -> float:
    """The position where the force of a stroke passes zero for the first time; of noise the middle of all such places."""
    samples = slice(stroke.first, stroke.last + 1)
    forces, own = force[samples], position[samples]
    signs = stroke.way * forces >= 0.0
    passed = np.flatnonzero(~signs[:-1] & signs[1:])
    if not len(passed):
        return float(own[0])
    near = passed[passed < passed[0] + FEWEST_POINTS]
    way, rise = np.diff(own), np.diff(forces)
    places = own[near] - forces[near] * way[near] / rise[near]
    return float(np.median(places))


def _slope_after_turn(position: Floats, force: Floats, stroke: LoopStroke) -> float:
    """Slope of the force after the turn with which a stroke begins, while its contact sticks; NaN of too few samples."""
    forces = stroke.way * force[stroke.first : stroke.last + 1]
    own = position[stroke.first : stroke.last + 1]
    begin = float(forces[:3].mean())
    level = float(np.median(forces[len(forces) // 2 :]))
    if not level > begin:
        return math.nan
    gone = (forces - begin) / (level - begin)
    past = np.flatnonzero(gone > UNLOADED[1])
    if not len(past):
        return math.nan
    within = np.flatnonzero(gone[: past[0]] >= UNLOADED[0])
    if len(within) < 2:
        return math.nan
    chosen = slice(int(within[0]), int(within[-1]) + 1)
    if not float(np.ptp(own[chosen])) > 0.0:
        return math.nan
    slope, _ = np.polyfit(own[chosen], forces[chosen], 1)
    return stroke.way * float(slope)


def _less_rig(stiffness: Measured, rig: float) -> Measured:
    """Stiffness of the contact from that of contact and rig in a row; none where the rig is all of it within 2 ±."""
    if math.isinf(rig) or not stiffness.of:
        return stiffness
    error = stiffness.uncertainty if math.isfinite(stiffness.uncertainty) else 0.0
    if stiffness.value + 2.0 * error >= rig:
        return Measured(math.nan, math.nan, 0, stiffness.unit)
    # Springs in series: 1/k = 1/k_contact + 1/k_rig, so errors grow by (k_contact/k)².
    contact = 1.0 / (1.0 / stiffness.value - 1.0 / rig)
    uncertainty = stiffness.uncertainty * (contact / stiffness.value) ** 2
    return stiffness._replace(value=contact, uncertainty=uncertainty)
