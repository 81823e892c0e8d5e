"""How many steps a computation takes, before it is done: nodes in contact, events, slips, teeth, solutions.

Two scaling laws describe sliding. The presliding length μ_i W/K, by which the pin moves until all nodes have slipped, takes
`EVENTS` events for each node in contact. On the way of the pin every node regains, against its own stiffness, the shear that it
loses in slips. Both hold to a factor of three: cascades are chaotic.
"""

import itertools
import math
from functools import lru_cache

from nanoslip.solver.case import MOST_EVENTS, Case
from nanoslip.solver.contact.closed_forms import winkler_half_width
from nanoslip.solver.contact.compiled_contact import margin
from nanoslip.solver.contact.coulomb import LONGEST_STEP
from nanoslip.solver.contact.normal import expected_half_width
from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.friction_limit import COARSE
from nanoslip.solver.elasticity.grid import confined_modulus
from nanoslip.solver.elasticity.grid_scheme import GridScheme, grid_scheme
from nanoslip.solver.elasticity.schemes.chain import Chain, spring_stiffness
from nanoslip.solver.elasticity.schemes.column import trunk
from nanoslip.solver.last import of_the_last
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.kernels.slide import STRETCHES
from nanoslip.solver.sliding.slide import OFF_THE_SLAB, farthest

EVENTS = 6.0
"""Events in a presliding length for each node in contact, at residual_shear 0."""
NODE_STIFFNESS = 3.0
"""Of a surface node against its neighbours at rest, in G: about that of an elastic half-plane under a load one spacing wide."""
PLATEAU = 0.53
"""F/W over μ_i of steady sliding at residual_shear 0, whatever the grid (§3.2.1)."""
EXCESS = 0.02
"""Static friction over kinetic friction, less 1, for slips after the first."""


@lru_cache(maxsize=256)  # asked for time and memory
def grid_nodes(slab: Slab) -> int:
    """Nodes of the slab's grid; 0 of a scheme without one."""
    return int(sum(grid_scheme(slab).grid(trunk(slab)).counts)) if isinstance(slab.scheme, GridScheme) else 0


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


@of_the_last
def lateral_stiffness(case: Case) -> float:
    """dF/dδ_p with all nodes stuck, in G·L_y, about.

    A half-plane: Flamant's displacement down to its reference depth. A slab held at its side: a rod of half its length. Else
    Timoshenko's cantilever; its sheared width grows under the contact by 45 degrees up to the slab's, and the contact keeps its
    top from turning by as much of it as it covers. A slab held at one node gives way there, too.
    """
    slab, nodes, soft = case.slab, contact_nodes(case), 1.0 - case.slab.poisson
    height, width, scheme = slab.aspect_ratio, nodes * slab.spacing, slab.scheme
    if isinstance(scheme, Chain):
        return scheme.lateral_stiffness(slab, nodes)
    if scheme.endless:
        return math.pi / (soft * max(math.log(4.0 * height / width), 1.0))
    if slab.support == "right_side":
        return 4.0 * min(height, 0.5) / soft
    shear = 1.2 * height / min(width + height, 1.0)
    bending = 0.5 * soft * height**3 * (4.0 - 3.0 * width)
    return 1.0 / (shear + bending + (soft if slab.support == "frictionless" else 0.0))


@of_the_last
def mean_step(case: Case) -> float:
    """Displacement from event to event in steady sliding, in L_x."""
    presliding = _finite(case.intrinsic_friction) * case.normal_load / lateral_stiffness(case)
    least = case.slip_rule.event_floor * min(case.slab.spacing, STRETCHES * presliding)
    return max(_lost(case) * presliding / (EVENTS * contact_nodes(case)), least, 1e-300)


def slips_of(case: Case, events: float) -> float:
    """Slips of so many events, at least one in each: fewer while the pin is not yet sliding as a whole."""
    scheme, friction = case.slab.scheme, steady_friction(case) * case.normal_load
    leaf, coupling = spring_stiffness(scheme, case.slab) if isinstance(scheme, Chain) else (NODE_STIFFNESS, 0.0)
    way = events * mean_step(case)
    under_way = min(way * lateral_stiffness(case) / max(friction, 1e-300), 1.0)
    drop = _lost(case) * _finite(case.intrinsic_friction) * case.normal_load / contact_nodes(case)
    slips = way * contact_nodes(case) * (leaf + 2.0 * coupling) / max(drop, 1e-300)
    return max(slips * under_way, events)


def _lost(case: Case) -> float:
    """Share of its shear that a node loses in a slip."""
    return max(1.0 - case.slip_rule.residual_shear, 1e-6)


def _finite(intrinsic_friction: float) -> float:
    """Nodes that never slip leave no events; the record ends at once or in one step."""
    return min(intrinsic_friction, 1e6)


@of_the_last
def events_of(case: Case) -> float:
    """Events of a record: as many as it may have, or as fit into its displacement, or as the pin finds on its slab."""
    if (
        case.slip_rule.residual_shear == 1.0
    ):  # the pin touches and releases a node in each spacing, all come to slide first
        return min(2.0 * contact_nodes(case) + _reach(case) / case.slab.spacing, _most(case))
    return min(_reach(case) / mean_step(case), _most(case))


def expected_displacement(case: Case) -> float:
    """δ_p that a record reaches, in L_x: its limit, or its events' mean steps."""
    if case.slip_rule.residual_shear == 1.0:
        return min(_reach(case), max(_most(case) - 2.0 * contact_nodes(case), 0.0) * case.slab.spacing)
    return min(_reach(case), events_of(case) * mean_step(case))


def coulomb_steps(case: Case, events: float) -> float:
    """Solutions of Coulomb sliding over so many events: one for each, and those of its longest steps."""
    return events + min(expected_displacement(case), events * case.slab.spacing) / (LONGEST_STEP * case.slab.spacing)


def _reach(case: Case) -> float:
    """δ_p in L_x at which a record ends at the latest: its limit, or where a pin that follows the surface has left the slab."""
    limit = farthest(case, lateral_stiffness(case))
    return min(limit, OFF_THE_SLAB) if case.effects.pin_translation or case.slip_rule.residual_shear == 1.0 else limit


def _most(case: Case) -> float:
    return float(case.max_events or MOST_EVENTS)


def steady_friction(case: Case) -> float:
    """F/W of steady sliding, about."""
    return (1.0 - (1.0 - PLATEAU) * _lost(case)) * _finite(case.intrinsic_friction)


def without_shear(case: Case) -> bool:
    """Whether initial contact is the normal problem alone: no tableau is set up."""
    if not (case.effects.friction and case.effects.coupling):
        return True
    return case.initial_contact == "frictionless" and case.slip_rule.residual_shear < 1.0


@of_the_last
def tableau_entries(case: Case) -> float:
    """Entries of a row of the tableau: both directions of all nodes that are followed, and the load."""
    n_x = case.slab.n_x
    margins = 4.0 if case.heterogeneity.roughness else 2.0  # a rough pin may meet nodes farther on
    followed = n_x if touches_in_spots(case) else contact_nodes(case) + margins * margin(n_x)
    return 2.0 * min(followed, n_x) + 1.0


@of_the_last
def touches_in_spots(case: Case) -> bool:
    """Whether a rough pin touches here and there only: flanks, from node to node, are steeper than the mean pressure over G."""
    points = case.heterogeneity.roughness
    if not points:
        return False
    steep = [abs(b[1] - a[1]) / max(b[0] - a[0], case.slab.spacing) for a, b in itertools.pairwise(points)]
    return sum(steep) / len(steep) > case.normal_load / (contact_nodes(case) * case.slab.spacing)


def teeth_of(drive: Drive, case: Case, way: float) -> float:
    """Teeth on a way of the pin, in L_x."""
    if drive.profile == "mean":
        return 0.0
    return way / max(mean_step(case), case.slab.spacing / COARSE if drive.profile == "coarse" else 0.0)


def pulled(drive: Drive, case: Case) -> tuple[float, float]:
    """Way of the driven pin, in L_x, and its macroscopic slips: none of one that sticks until the drive ends.

    It moves once the spring's force has reached the plateau's. Slips are those of the closed form: one for each cycle, or a
    single one where damping takes what a slip gains from its excess.
    """
    force = steady_friction(case) * case.normal_load
    way = drive.stage_velocity * drive.duration - force / drive.spring_stiffness
    if not way > 0.0:
        return 0.0, 0.0
    pace, excess = math.sqrt(drive.spring_stiffness), EXCESS * force
    slips = 1.0
    if math.log(math.hypot(1.0, excess / (pace * drive.stage_velocity))) > 2.0 * math.pi * drive.damping_ratio:
        cycle = 2.0 * excess / drive.spring_stiffness + 2.0 * math.pi * drive.stage_velocity / pace
        slips = max(way / cycle, 1.0)
    if drive.max_slips is not None and slips > drive.max_slips:
        return way * drive.max_slips / slips, float(drive.max_slips)
    return way, slips
