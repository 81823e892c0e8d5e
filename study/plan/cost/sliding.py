"""What decides the cost of a contact and a friction record, before they are computed: nodes in contact, steps, events, slips.

Nodes in contact are Hertz's, or those of a thin layer. A node slips when its shear has grown to μ_i times its pressure,
loses 1 - residual_shear of it, and gets it back as the pin moves on against the node's own stiffness, about 3 G whatever the
slab: that many slips a displacement takes. How many come in one event depends on what else gives way: the softer the slab
under the pin, the more other nodes a slip loads (half of the nodes in contact, over the lateral stiffness K in G). All
was measured on one core; a test holds it to a factor of three, which is what chaos leaves. Blocks of a chain have the stiffness
of their springs, and the root of their coupling says how many slip together.
"""

import itertools
import math
from typing import NamedTuple

from solver.case import MOST_EVENTS, Case
from solver.contact.closed_forms import winkler_half_width
from solver.contact.normal.contact import expected_half_width
from solver.contact.window import margin
from solver.elasticity.schemes.biquadratic import Biquadratic
from solver.elasticity.schemes.chain import Chain, spring_stiffness
from solver.elasticity.stiffness import confined_modulus
from solver.last import of_the_last
from solver.sliding.columns import farthest
from solver.sliding.coulomb import OFF_THE_SLAB
from solver.sliding.kernels.step import STRETCHES

NODE_STIFFNESS = 2.9
"""Of a surface node against its neighbours at rest, in G: slips per displacement, times what they drop, over nodes."""
BIQUADRATIC_NODE_STIFFNESS = 4.7
"""The same of the paper's stencil, which takes a single node for stiffer than it is."""
TOGETHER = 0.45
"""Slips in an event of steady sliding, times K, over nodes in contact."""
LEAST_STEP = 1e-13
"""The least step of the pin, over what the load moves it (W/K): without friction every event takes it."""
MOST_TOGETHER = 300.0
"""Slips of a node in one event, at most: a slab that gives way farther lets go of the pin. 285 seen (ν = 0.4999, 3 L_x high)."""
OF_A_CHAIN = 0.9
"""Slips in an event of a chain, over the root of its coupling: measured for couplings from 1 to 300."""
UNDER_ROUGH = 1.3
"""Nodes that a rough pin could meet soon, over those in contact, where it touches in one spot."""
TRAVEL = 1.5
"""Displacement at which the pin has left the slab, in L_x."""
PLATEAU = 0.53
"""F/W over μ_i of steady sliding at residual_shear 0, whatever the grid (§3.2.1)."""
CHANGES_PER_SPACING = 0.75
"""Events of Coulomb sliding per node spacing that the pin moves: touches and releases."""


@of_the_last
def contact_nodes(case: Case) -> float:
    """Surface nodes under the pin, about: Hertz's, or fewer on a bonded layer that is thinner than the contact."""
    slab, hertz = case.slab, hertz_nodes(case)
    if case.pin == "flat_punch" or slab.scheme.endless or not slab.scheme.continuum:
        return hertz
    half_width = winkler_half_width(case.normal_load, case.radius, confined_modulus(slab.poisson) / slab.aspect_ratio)
    return min(hertz, _nodes_across(case, half_width)) if half_width > slab.aspect_ratio else hertz


@of_the_last
def hertz_nodes(case: Case) -> float:
    """The same on a half-plane, or on the springs of a chain: what pressing the pin down begins with."""
    return _nodes_across(case, expected_half_width(case))


def _nodes_across(case: Case, half_width: float) -> float:
    return min(2.0 * half_width * (case.slab.n_x - 1) + 1.0, float(case.slab.n_x))


class _Steady(NamedTuple):
    """What steady sliding of a case is like."""

    stiffness: float
    slips: float
    step: float


@of_the_last
def _steady(case: Case) -> _Steady:
    nodes = contact_nodes(case)
    stiffness = _lateral_stiffness(case, nodes)
    slips = _slips_per_event(case, nodes, stiffness)
    friction, moved = _finite(case.intrinsic_friction), case.normal_load / stiffness
    floor = case.slip_rule.event_floor * min(case.slab.spacing, STRETCHES * friction * moved)
    # Each node in contact has to keep up with the pin, at so much a slip.
    drop = friction * case.normal_load * max(1.0 - case.slip_rule.residual_shear, 1e-6)
    slips_per_displacement = _node_stiffness(case) * nodes**2 / max(drop, 1e-300)
    return _Steady(stiffness, slips, max(slips / slips_per_displacement, floor, LEAST_STEP * moved))


def lateral_stiffness(case: Case) -> float:
    """dF/dδ_p with all nodes stuck, in G·L_y, about: shear and bending of the slab, less what a wide pin holds, in series."""
    return _steady(case).stiffness


def _lateral_stiffness(case: Case, nodes: float) -> float:
    slab = case.slab
    height, scheme = slab.aspect_ratio, slab.scheme
    if isinstance(scheme, Chain):
        return scheme.lateral_stiffness(slab, nodes)
    if scheme.endless:
        return 1.0 / max(0.56 + 0.21 * math.log(height), 0.05)
    width = nodes * slab.spacing
    compliance = max(0.05 + 1.2 * height + 0.6 * height**3 + 1.3 * min(height, 1.0) * (0.55 - width), 0.05)
    if slab.support == "right_side":
        compliance = min(compliance, 0.5)
    return 1.0 / (compliance + (1.0 if slab.support == "frictionless" else 0.0))


def mean_step(case: Case) -> float:
    """Displacement from event to event in steady sliding, in L_x."""
    return _steady(case).step


def _slips_per_event(case: Case, nodes: float, stiffness: float) -> float:
    if isinstance(case.slab.scheme, Chain):
        return max(OF_A_CHAIN * math.sqrt(case.slab.scheme.coupling_stiffness), 1.0)
    return max(min(TOGETHER / stiffness, MOST_TOGETHER) * nodes, 1.0)


def _node_stiffness(case: Case) -> float:
    scheme = case.slab.scheme
    if isinstance(scheme, Chain):
        leaf, coupling = spring_stiffness(scheme, case.slab)
        return leaf + 2.0 * coupling
    return BIQUADRATIC_NODE_STIFFNESS if isinstance(scheme, Biquadratic) else NODE_STIFFNESS


def reach(case: Case) -> float:
    """δ_p in L_x at which a record ends at the latest."""
    return farthest(case, lateral_stiffness(case))


@of_the_last
def events_of(case: Case) -> float:
    """Events of a record: as many as it may have, or as fit into its displacement, or as the pin finds on its slab."""
    return events_within(case, reach(case), case.max_events)


def steady_friction(case: Case) -> float:
    """F/W of steady sliding, about."""
    return (1.0 - (1.0 - PLATEAU) * (1.0 - case.slip_rule.residual_shear)) * _finite(case.intrinsic_friction)


def events_within(case: Case, farthest: float, most: int | None) -> float:
    """The same of a record with other limits: δ_p in L_x, and events."""
    if case.effects.pin_translation:
        farthest = min(farthest, TRAVEL)
    return min(farthest / mean_step(case), float(most or MOST_EVENTS))


def expected_displacement(case: Case) -> float:
    """δ_p that a record reaches, in L_x: its limit, or its events' mean steps."""
    if case.slip_rule.residual_shear == 1.0:
        return coulomb_path(case)[1]
    return min(reach(case), events_of(case) * mean_step(case))


def slips_of(case: Case, events: float) -> float:
    """Slips of so many events: fewer in each while the pin is not yet sliding as a whole, after F/K."""
    steady = _steady(case)
    to_full_sliding = _finite(case.intrinsic_friction) * case.normal_load / steady.stiffness
    under_way = min(events * steady.step / max(to_full_sliding, 1e-300), 1.0)
    return events * max(steady.slips * under_way, 1.0)


def _finite(intrinsic_friction: float) -> float:
    """Nodes that never slip leave no events; the record ends at once or in one step."""
    return min(intrinsic_friction, 1e6)


def coulomb_path(case: Case) -> tuple[float, float]:
    """Events of Coulomb sliding, and the displacement they take."""
    return coulomb_within(case, reach(case), case.max_events)


def coulomb_within(case: Case, farthest: float, most: int | None) -> tuple[float, float]:
    """The same of a record with other limits: δ_p in L_x, and events."""
    farthest = min(farthest, OFF_THE_SLAB)
    events = float(most) if most else math.inf
    # All nodes come to slide first; then the pin touches and releases them one by one.
    onset = 2.0 * contact_nodes(case)
    travel = min(farthest, max(events - onset, 0.0) * case.slab.spacing / CHANGES_PER_SPACING)
    changes = onset + travel * CHANGES_PER_SPACING / case.slab.spacing
    return min(events, changes), travel


def without_shear(case: Case) -> bool:
    """Whether initial contact is the normal problem alone: no tableau is set up."""
    if not (case.effects.friction and case.effects.coupling):
        return True
    return case.initial_contact == "frictionless" and case.slip_rule.residual_shear < 1.0


@of_the_last
def tableau_entries(case: Case) -> float:
    """Entries of a row of the tableau: both directions of all nodes that are followed, and the load."""
    n_x, nodes = case.slab.n_x, contact_nodes(case)
    followed = nodes + 2.0 * margin(n_x)
    if case.heterogeneity.roughness:
        followed = n_x if touches_in_spots(case) else UNDER_ROUGH * nodes + 4.0 * margin(n_x)
    return 2.0 * min(followed, n_x) + 1.0


@of_the_last
def touches_in_spots(case: Case) -> bool:
    """Whether a rough pin touches here and there only: flanks, from node to node, are steeper than the mean pressure over G."""
    points = case.heterogeneity.roughness
    if not points:
        return False
    steep = [abs(b[1] - a[1]) / max(b[0] - a[0], case.slab.spacing) for a, b in itertools.pairwise(points)]
    return sum(steep) / len(steep) > case.normal_load / (contact_nodes(case) * case.slab.spacing)
