"""Validity flags, with advice, of contacts that obey all laws and still mean little for a pin on a slab; and checks of records.

`predict_flags` estimates flags from Hertz's contact before a run; `contact_flags` and `record_flags` evaluate results. A flag
changes no outcome. Hertz's half-width neglects the slab's ends and bottom: it is 6 % too large at a/L_x = 1/3 and 14 % at 1/2 on
a slab as tall as wide, 22 and 30 % on one a quarter as tall (films have their own). Friction also drags the contact back, so
flags of the ends come early for initial contact and late for long records.
"""

import math
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import Case, Image, make_image
from nanoslip.solver.contact.closed_forms import smooth_contact
from nanoslip.solver.contact.kernels.events import STEEPEST
from nanoslip.solver.contact.pin import (
    contact_limit,
    estimate_half_width,
    limit_over_pressure,
    make_pin,
    roughness_slopes,
    surface_from_pin,
)
from nanoslip.solver.contact.soundness import DOWNHILL, STEEP_PIN, energy_created, steepest_across
from nanoslip.solver.contact.state import ContactState, contact_width
from nanoslip.solver.layout import Plane, Row
from nanoslip.solver.outcome import COMPLETED, Ending, Outcome
from nanoslip.solver.parameter import quantity
from nanoslip.solver.sliding.record import RUN_IN, FrictionRecord

CREATED = 1e-6
"""Energy that events may create, as a share of the pin's work and of the energy that other events lose: a touch pays
back the overshoot of a coarse event floor."""
NEAR = 0.45
"""Distance of the contact's edge from the slab's end, in half-widths, below which the end counts: there the free side raises
a pressed parabola's largest pressure by a tenth (6 % at 0.75, 19 % at 0.15), on a slab as tall as wide or taller. Plateaus
notice an end only when the contact is at it: F/(Wμ_i) is 0.52 up to 0.13 half-widths and 0.71 then (μ_i = 0.5, n_x = 129)."""
EDGE = 0.125
"""Spacings beyond the edge of Hertz's contact up to which nodes are in contact: 0.2 of galerkin slabs with μ_i = 0.1, 0.1 with
μ_i = 1, 0.05 of the paper's stencil with μ_i = 0.5. So a record has at least 2a over the spacing and a quarter, rounded down, to
within one node."""
LARGEST_PRESSURE = 0.1
"""Mean pressure over G above which displacements have gradients of about a tenth (Hertz: the slope at the contact's edge is
4(1 - ν)/π times it, 0.85 at ν = 1/3, the shear below the middle 0.38 times): the share that linear elasticity neglects. A shear
traction of as much shears the surface by a tenth, too."""

MISSED = 0.5
"""Share of the slope of a pin's roughness that nodes may miss. Below it plateaus were within 2.5 % of the plateaus at
n_x = 1025; at 0.8 to 1 they were 4 to 10 % too low: random knots every 0.002 L_x and waves of 0.05 L_x, strip, R =
200, n_x from 65 on."""
MISSING = "within 2.5 % where nodes miss at most 50 %, 4 to 10 % too low at 80 % or more"
"""MISSED in words."""
FELT = 0.02
"""Slope of the roughness, over a/R at the contact's edge, from which it is felt: plateaus noticed it at 0.07, not at 0.007."""


BARELY: Final = 0.12
"""Nodes that enter or leave, by how far the pin goes, below which an ensemble is expected to have a member without any. Slips
at the edge let nodes leave and touch, too: of 21 default cases of eight starts those up to 0.05 spacings long had such a member,
those from 0.067 spacings on had none (two ends)."""


_WIDEN: Final = (
    "if the pin is given in units, raise scales.slab_width, and n_x with it; or lower limits.presliding or displacement"
)


class Flag(Enum):
    """Validity flag: a limit beyond which a contact is doubtful. It has the bit `mask`, a name, meaning and advice.

    Only older datasets have the bits 64 and 256. `near_ends`, `outgrown` and `whole_slab` are degrees of the same
    problem: a contact has the last flag that applies.
    """

    few_nodes = (
        1,
        f"fewer than {Row.FEWEST} nodes in contact ({Plane.FEWEST} with a plane of nodes, as of a ball)",
        "raise n_x; or, if the pin is given in units, lower scales.slab_width",
    )
    near_ends = (
        2,
        f"contact nearer to an end of the slab than {NEAR:g} of its half-width",
        _WIDEN,
    )
    outgrown = (
        4,
        "contact reaches the end of the surface and is cut off there",
        _WIDEN,
    )
    whole_slab = (
        8,
        "the pin covers the whole slab: slab width, not load and radius, sets the contact size",
        _WIDEN,
    )
    beyond_contact = (
        16,
        "pin moved by more than the contact's half-width, away from where it came down",
        "lower limits.presliding or displacement",
    )
    large_strain = (
        32,
        f"mean pressure or slip.strength above {LARGEST_PRESSURE:g} G: strains beyond linear elasticity",
        "take the numbers as a first estimate; finite elements with finite strains compute such a contact",
    )
    unresolved_slab = (
        128,
        "grid scheme with poisson > 0.38: volumetric locking makes friction too high, by 2 % at 0.39, 5 % at 0.42, 13 % at 0.45, "
        "30 % at 0.49; or a film on a biquadratic grid with wider cells than the contact",
        "use the scheme strip, right up to poisson 0.5",
        True,
    )
    unresolved_roughness = (
        512,
        f"nodes too far apart for the pin's roughness: they miss more than {MISSED:g} of its slope",
        "raise n_x (nanoslip profile gives the value), or smooth the profile",
        True,
    )
    short_profile = (
        1024,
        "the pin's roughness profile is shorter than the contact, and constant beyond",
        "use a longer profile, or lower normal_load or radius",
    )
    short_record = (
        2048,
        "no node entered or left the contact while the pin slid: means are those of a pin just pressed down, and may be off by "
        "more than ±",
        "set limits.spacings = 2.1: records then slide over two node spacings, with which the surface repeats",
    )

    def __init__(self, mask: int, meaning: str, advice: str, unresolved: bool = False) -> None:
        """unresolved: True if nodes miss part of what the numbers depend on."""
        self.mask, self.meaning, self.advice, self.unresolved = mask, meaning, advice, unresolved


FLAGS = tuple(Flag)
KNOWN: int = sum(flag.mask for flag in FLAGS)
"""Bits of all flags."""
DOUBTFUL: int = sum(flag.mask for flag in FLAGS if flag is not Flag.short_record)
"""Bits of flags with which a number is no number of a pin on a slab; that of a short record is one, of less accuracy."""
Flags = tuple[Flag, ...]
_NAME_OF_BIT = {flag.mask: flag.name for flag in FLAGS}


@dataclass(frozen=True, slots=True)
class Validity:
    """Validity flags of a contact or record, and its half-width."""

    validity_flags: int = quantity(
        "warnings that the contact is doubtful",
        comment="at any time of the record; expected flags if the contact was not reached; "
        "bits by flag_masks; 0: none, or not computed "
        "(see outcome); advice explains each",
        flags=tuple(_NAME_OF_BIT.get(1 << bit, "") for bit in range(FLAGS[-1].mask.bit_length())),
    )
    contact_half_width: float = quantity(
        "half-width of the contact",
        symbol="a/L_x",
        ensemble=True,
        comment="after initial contact: half of the contact's width, without gaps in it; its edges are where the "
        "square of pressure, drawn through the last two nodes, is zero",
        measure="L_x",
    )


def contact_validity(case: Case, start: ContactState) -> Validity:
    """Validity of initial contact alone."""
    return Validity(encode_flags(contact_flags(case, start)), contact_half_width(start))


def record_validity(case: Case, start: ContactState, record: FrictionRecord, end: ContactState) -> Validity:
    """Validity of a friction record from `start` to `end`."""
    return Validity(encode_flags(record_flags(case, start, record, end)), contact_half_width(start))


class _Seen(NamedTuple):
    """Facts from which flags are decided."""

    fewest: int
    """Nodes in contact."""
    most: int
    half_width: float
    """Half-width of initial contact, in L_x."""
    margin: float
    """Distance from the contact's edge to the nearer end of the surface, in L_x; 0 or less with a node at that end in
    contact."""
    travel: float
    """Distance that the pin moved towards an end of the surface, in L_x."""


def predict_flags(case: Case, displacement: float = 0.0) -> Flags:
    """The flags to be expected of a case, from Hertz's half-width (a film's, a flat punch's own), without computing anything.

    displacement: δ_p that its record is expected to reach, in L_x; 0 is initial contact alone. A guess: see above.
    """
    half_width = min(guess_half_width(case), 0.5)
    rounding = 0.499 if case.pin == "flat_punch" else 1e-9
    layout = case.slab.layout
    most = min(layout.count_nodes(half_width, rounding), layout.nodes)
    fewest = min(_fewest_nodes(case, half_width, displacement), case.slab.nodes)
    travel = _travel(case, displacement)
    seen = _Seen(fewest, most, half_width, 0.5 - half_width - travel, travel)
    entering = displacement / case.slab.spacing * layout.edge_nodes(half_width)
    short = 0.0 < entering < BARELY and case.effects.pin_translation
    return _decide_flags(case, seen, half_width) or (Flag.short_record,) * short


def _fewest_nodes(case: Case, half_width: float, displacement: float) -> int:
    """Fewest nodes expected in a contact of this half-width that the pin drags over this displacement.

    Nodes up to `EDGE` beyond the edges are in contact. How many, depends on where the pin is between two nodes: its start counts,
    or any place where it moves by half a spacing or more.
    """
    beyond = 0.499 if case.pin == "flat_punch" else EDGE
    if displacement < 0.5 * case.slab.spacing:
        return case.slab.layout.count_nodes(half_width, beyond, case.start)
    return case.slab.layout.fewest_nodes(half_width, beyond)


def contact_flags(case: Case, state: ContactState) -> Flags:
    """The flags of a contact at a single pin position; no flags for a contact that was not reached."""
    if not state.outcome.ok:
        return ()
    size = int(state.contact.sum())
    margin = _margin(case, state.contact.nonzero()[0])
    seen = _Seen(size, size, contact_half_width(state), margin, 0.0)
    return _decide_flags(case, seen, guess_half_width(case))


def record_flags(case: Case, start: ContactState, record: FrictionRecord, end: ContactState) -> Flags:
    """Flags of a friction record from `start` to `end` at any time; none for a record that failed before sliding.

    Contact sizes are recorded after every event; positions follow from both ends and from the nodes that slipped or triggered
    events. A surface without ends continues under the pin: there only start and end are compared with the grid.
    """
    if not start.outcome.ok or (not record.outcome.ok and not record.node.size):
        return ()
    first = int(start.contact.sum())
    fewest = int(record.contact_size.min(initial=first))
    most = int(record.contact_size.max(initial=first))
    nodes = (start.contact | end.contact).nonzero()[0]
    if not case.slab.scheme.endless:
        slipped = record.node_slips.nonzero()[0]
        nodes = np.concatenate((nodes, slipped, record.node))
    travel = _travel(case, record.final_displacement - start.displacement)
    half_width = contact_half_width(start)
    seen = _Seen(fewest, most, half_width, _margin(case, nodes), travel)
    # A pin that moves on meets new nodes, and leaves others: a record without either shows one place of the surface.
    has_changed = record.touches.any() or record.releases.any()
    same = not has_changed and record.spacing < math.inf
    short = same and RUN_IN < record.presliding_lengths < math.inf
    doubts = _decide_flags(case, seen, guess_half_width(case))
    return doubts or (Flag.short_record,) * short  # the others doubt more than its length


def guess_half_width(case: Case) -> float:
    """Half-width of the contact before anything is computed: Hertz's, narrower on a film, a punch's own."""
    slab, expected = case.slab, estimate_half_width(case)
    if case.pin == "flat_punch" or slab.scheme.bottomless:
        return expected
    on_film = smooth_contact(slab.scheme.LAYOUT).film(case.normal_load, case.radius, slab.poisson, slab.aspect_ratio)
    return min(expected, on_film)


def least_plateau(case: Case) -> float:
    """Smallest F/W of steady sliding: (1 + r)/2 of the limit, r = residual_shear (campaigns/interface/from_one_contact.md)."""
    return 0.5 * (1.0 + case.slip_rule.residual_shear) * sliding_friction(case)


def sliding_friction(case: Case) -> float:
    """F/W of steady sliding if slips drop no stress: μ_i, and with a strength τ_0·area/W more, by the area that is guessed."""
    area = case.slab.layout.contact_area(min(guess_half_width(case), 0.5))
    return contact_limit(case, area) / case.normal_load


def may_create_energy(case: Case) -> bool:
    """True if the slope at the contact's edge is expected above the mean shear of a slip over its pressure (see `DOWNHILL`)."""
    if case.pin != "parabola" or not (case.effects.pin_translation and case.effects.friction):
        return False
    slope = min(guess_half_width(case), 0.5) / case.radius
    return case.slip_rule.residual_shear < 1.0 and 0.0 < least_plateau(case) < slope <= STEEPEST


def resolving_nodes(image: Image) -> int | None:
    """The smallest n_x = 2^N + 1 of which nodes see enough of a roughness' slope; None if none up to 2^20 + 1 does."""
    for power in range(2, 21):
        slope, missed = roughness_slopes(image, 0.5**power)
        if missed <= MISSED * slope:
            return int(2**power + 1)
    return None


def contact_half_width(state: ContactState) -> float:
    """Half of the contact's width, in L_x; NaN for a contact that was not reached."""
    return contact_width(state) / 2.0 if state.outcome.ok else math.nan


def encode_flags(flags: Flags) -> int:
    """The flags as bits of an integer."""
    return sum([flag.mask for flag in flags])


def decode_flags(mask: int) -> Flags:
    """The flags that are bits of a number."""
    return tuple(flag for flag in FLAGS if mask & flag.mask)


def flag_advice(flags: Iterable[Flag]) -> str:
    """Advice on flags, in one line; empty without flags."""
    return "; ".join(f"{flag.name}: {flag.advice}" for flag in flags)


def _travel(case: Case, displacement: float) -> float:
    """Distance that a displacement brings the pin towards an end of the surface, in L_x; 0 where the surface goes on."""
    return 0.0 if case.slab.scheme.endless else abs(displacement)


def _margin(case: Case, nodes: NDArray[Any]) -> float:
    """Distance from the edge of the contact of these nodes (at least one) to the nearer end of the surface."""
    last, places = case.slab.n_x - 1, case.slab.layout.places(nodes)
    first = min(int(along.min()) for along in places)
    farthest = max(int(along.max()) for along in places)
    between = min(first, last - farthest)
    # The contact is taken to end half a spacing beyond its last node.
    return (between - 0.5) * case.slab.spacing


def _decide_flags(case: Case, seen: _Seen, expected: float) -> Flags:
    """expected: half-width of the contact, before anything is computed."""
    image = make_image(case.heterogeneity.roughness)
    slope, missed = roughness_slopes(image, case.slab.spacing)
    narrowest = min(seen.half_width, expected)  # few nodes make a narrow contact seem wide
    several = Row.FEWEST / 2 * case.slab.spacing  # of fewer nodes the one flag says enough
    scheme, layout = case.slab.scheme, case.slab.layout
    place = _place(case, seen)
    # The mean pressure is a strain, in units of G.
    pressed = case.normal_load > LARGEST_PRESSURE * layout.contact_area(narrowest)
    strained = pressed or case.slip_rule.strength > LARGEST_PRESSURE
    # The slope of the pin itself, at the contact's edge, is half-width over radius.
    is_felt = slope > FELT * narrowest / case.radius
    flags: list[Flag] = []
    if seen.fewest < layout.FEWEST:
        flags.append(Flag.few_nodes)
    if place is not None:
        flags.append(place)
    if seen.travel > seen.half_width:
        flags.append(Flag.beyond_contact)
    if strained:
        flags.append(Flag.large_strain)
    if not scheme.resolves(case.slab, max(narrowest, several)):
        flags.append(Flag.unresolved_slab)
    if missed > MISSED * slope and is_felt:
        flags.append(Flag.unresolved_roughness)
    if any(0.0 < length < 2.0 * narrowest for length in image.lengths):
        flags.append(Flag.short_profile)
    return tuple(flags)


def _place(case: Case, seen: _Seen) -> Flag | None:
    """Flag of a contact too near to the ends of the surface; for a half-plane these are the ends of its grid."""
    if seen.most == case.slab.nodes:
        return Flag.whole_slab
    if seen.margin <= 0.0:
        return Flag.outgrown
    near = not case.slab.scheme.endless and seen.margin < NEAR * seen.half_width
    return Flag.near_ends if near else None


def lawfulness(
    case: Case, start: ContactState, record: FrictionRecord, end: ContactState, load_work: float = 0.0
) -> Outcome:
    """COMPLETED, or the law that a record from `start` to `end` violates as a whole. load_work: done by the load."""
    stiffness = record.initial_stiffness
    if case.slip_rule.residual_shear < 1.0 and stiffness <= 0.0:
        other = "an aspect_ratio nearer 1" if case.slab.scheme.reciprocal else "the scheme galerkin"
        message = f"lateral stiffness K = {stiffness:.3g}: an elastic slab's is above 0; use {other}"
        return Outcome(Ending.SINGULAR_OPERATOR, message, cause="stiffness")
    xi = surface_from_pin(case, end.first_node) + end.u - end.displacement
    if steepest_across(case, end.contact, xi) > STEEPEST:
        return STEEP_PIN
    # Classical sliding has looked at its energy event by event.
    if case.slip_rule.residual_shear == 1.0 or not _creates_energy(case, start, record, end, load_work):
        return COMPLETED
    limit = limit_over_pressure(case, end.pressure, end.first_node)
    mean_shear = 0.5 * (1.0 + case.slip_rule.residual_shear) * limit
    is_steep = np.abs(make_pin(case).slope(xi)) > mean_shear
    return DOWNHILL if is_steep[end.contact].any() else energy_created(case)


def _creates_energy(
    case: Case, start: ContactState, record: FrictionRecord, end: ContactState, load_work: float
) -> bool:
    """True if events created more energy than the rounding error of load times displacement in each event."""
    created = -np.minimum(record.dissipated, 0.0).sum()
    lost = np.maximum(record.dissipated, 0.0).sum()
    moved = np.concatenate(([start.displacement], record.displacement))
    steps = np.abs(moved[1:] - moved[:-1])
    before = np.concatenate(([record.initial_force], record.force_after))[:-1]
    # F is straight from event to event: the trapezoidal rule is exact.
    work = float(np.abs(before + record.force_before) @ steps) / 2.0
    farthest = float(np.abs(end.u[end.contact]).max(initial=0.0))
    # Whatever the load displaces or the pin carries is known to a rounding of its own, event by event.
    heights = case.normal_load + abs(end.approach) + abs(end.displacement) + farthest
    rounding = sys.float_info.epsilon * case.normal_load * heights * len(record.dissipated)
    return bool(created > CREATED * (lost + work + abs(load_work)) + rounding)
