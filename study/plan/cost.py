"""Estimated cost of tasks: seconds on one core, bytes of memory."""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Final, NamedTuple

from nanoslip.solver.case import MOST_EVENTS, Case
from nanoslip.solver.contact.closed_forms import film_half_width
from nanoslip.solver.contact.kernels.state import margin
from nanoslip.solver.contact.pin import LONGEST_STEP, expected_half_width
from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.friction_limit import COARSE
from nanoslip.solver.dynamics.stick_slip import MOST_SAMPLES, MOST_SLIPS
from nanoslip.solver.elasticity.grid_scheme import GridScheme, grid_scheme
from nanoslip.solver.elasticity.schemes.chain import Chain, spring_stiffness
from nanoslip.solver.elasticity.schemes.column import trunk
from nanoslip.solver.last import of_the_last
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.interface import PIECES, batches
from nanoslip.solver.sliding.kernels.slide import STRETCHES
from nanoslip.solver.sliding.record import FIRST_CAPACITY, farthest, off_the_slab
from nanoslip.study.plan.kinds import compliance_needs
from nanoslip.study.plan.task import Task, case_of, drive_of

# What one step of each computation takes: seconds on one core of an ordinary machine.
#
# A prediction is a number of steps (`counts`) times their rate, to a factor of three. What a machine and a campaign really take
# is measured: the first finished tasks of a campaign scale the predictions for the others, kind by kind
# (nanoslip.study.run.progress).

TASK: Final = 1e-3
"""Of any task: hand out, read, write."""
NODE: Final = 2e-5
"""Of a slab's grid, whose stiffness is assembled and condensed."""
ENTRY: Final = 2e-8
"""Of a dense matrix that is written and updated."""
SOLVE: Final = 2e-10
"""Of the cube of the unknowns of a dense solution."""
CONTACT: Final = 1e-3
"""Of one search for the contact, besides its solutions."""
CONVOLUTION: Final = 1.5e-7
"""Of a surface node times the binary digits of their number, in a search for the contact without a matrix."""
SLIP: Final = 1e-9
"""Of an entry of the row that a slip of a node adds to the state."""
EVENT: Final = 1e-6
"""Of an event of a record: written, and read for its scalars."""
STATISTICS: Final = 0.7
"""Of the distributions of event sizes of a member: fits of drawn samples."""
STEP: Final = 6e-8
"""Of a drive: a tooth passed, a time step, a sample."""
RINGING: Final = 5e-6
"""Of a drive's time, counted in periods of the contact's own oscillation over 2 π."""
FIT: Final = 1.2e-5
"""Of a sample and a slip in the fit of the closed form."""


# How many steps a computation takes, before it is done: nodes in contact, events, slips, teeth, solutions.
#
# Two scaling laws describe sliding. The presliding length μ_i W/K, by which the pin moves until all nodes have slipped, takes
# `EVENTS` events for each node in contact. On the way of the pin every node regains, against its own stiffness, the shear that
# it loses in slips. Both hold to a factor of three: cascades are chaotic.

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
    if case.pin == "flat_punch" or slab.scheme.bottomless:
        return hertz
    half_width = film_half_width(case.normal_load, case.radius, slab.poisson, slab.aspect_ratio)
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
    return (
        min(limit, off_the_slab(case))
        if case.effects.pin_translation or case.slip_rule.residual_shear == 1.0
        else limit
    )


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
    if case.interface.contacts > 1:
        return way * PIECES / _reach(case)
    return way / max(mean_step(case), case.slab.spacing / COARSE if drive.profile == "coarse" else 0.0)


def pulled(drive: Drive, case: Case) -> tuple[float, float]:
    """Way of the driven pin, in L_x, and its macroscopic slips: none of one that sticks until the drive ends.

    It moves once the spring's force has reached the plateau's. Slips are those of the closed form: one for each cycle, or a
    single one where damping takes what a slip gains from its excess.
    """
    force = steady_friction(case) * case.total_load
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


# Seconds of each kind of computation, to a factor of three: its steps, counted, times their rates.


def condensation_seconds(slab: Slab) -> float:
    """Seconds of `surface_compliance`; next to none where it is no matrix."""
    return 0.0 if slab.scheme.endless else NODE * grid_nodes(slab) + ENTRY * slab.n_x**2


def touch_seconds(case: Case) -> float:
    """Seconds of initial contact that nothing follows."""
    if not case.contact_by_convolution:
        return contact_seconds(case)
    n_x = case.slab.n_x
    rounds = 0.5 * math.cbrt(n_x) if touches_in_spots(case) else 1.0  # conjugate gradients, over those of one spot
    return CONTACT + CONVOLUTION * n_x * math.log2(n_x) * rounds


def contact_seconds(case: Case) -> float:
    """Seconds of initial contact, found from the matrix of the slab's compliance."""
    nodes = math.sqrt(hertz_nodes(case) * contact_nodes(case))
    unknowns = nodes if without_shear(case) else 2.0 * nodes
    updates = nodes if case.slip_rule.residual_shear == 1.0 else 0.0  # nodes come to slide one by one
    return _solution_seconds(unknowns) + ENTRY * (unknowns**2 + updates * nodes**2)


def record_seconds(case: Case) -> float:
    """Seconds of a case's friction record, initial contact included."""
    return contact_seconds(case) + _slide_seconds(case, events_of(case))


def statistics_seconds() -> float:
    """Seconds of the distributions of the sizes of a record's events."""
    return STATISTICS


def states_seconds(case: Case, events: Sequence[int], subsurface: bool) -> float:
    """Seconds of the contacts after some events of a record, and of the inside of the slab there."""
    last = min(float(max(events, default=0)), events_of(case))
    inside = len(events) * NODE * grid_nodes(case.slab) if subsurface else 0.0
    return inside + (contact_seconds(case) + _slide_seconds(case, last) if last else touch_seconds(case))


def drive_seconds(drive: Drive, case: Case, fitted: bool = True) -> float:
    """Seconds of motion and fit. A drive that ends after some slips is followed twice: to spread its samples over that."""
    way, slips = pulled(drive, case)
    passes = 1.0 if drive.max_slips is None else 2.0
    fit = FIT * min(drive.samples, MOST_SAMPLES) * slips if fitted and slips < MOST_SLIPS else 0.0
    return STEP * drive.samples + passes * _motion_seconds(drive, case, way) + fit


def _slide_seconds(case: Case, events: float) -> float:
    if case.slip_rule.residual_shear == 1.0:
        return coulomb_steps(case, events) * _solution_seconds(2.0 * contact_nodes(case))
    row = tableau_entries(case) if case.effects.pin_translation else contact_nodes(case)
    return ENTRY * row**2 + SLIP * row * slips_of(case, events) + EVENT * events


def _solution_seconds(unknowns: float) -> float:
    return CONTACT + SOLVE * unknowns**3


def _motion_seconds(drive: Drive, case: Case, way: float) -> float:
    teeth = teeth_of(drive, case, way)
    step: float | None = getattr(drive.integrator, "time_step", None)
    if step is not None:
        steps = drive.duration / step
        looks = 1.0 + math.log2(1.0 + teeth / steps)  # for the tooth that a step ends on
        return STEP * steps * looks if steps <= drive.step_limit else 0.0  # else refused
    yields = teeth and drive.surface_compliance
    ringing = RINGING * math.sqrt(lateral_stiffness(case)) * way / drive.stage_velocity if yields else 0.0
    return STEP * min(teeth, drive.step_limit) + ringing


# Bytes of the arrays of contacts and friction records while they are computed, to a factor of three.

_FLOAT = 8.0
_SYSTEMS = 5.0  # copies of its matrix that a contact holds at once
_CONVOLVED = 40.0  # numbers for each surface node while a contact is looked for without a matrix
_OF_A_SIZE = 25.0  # numbers for each event while its sizes are fitted
_EVENT = 65.0  # bytes of an event in a record
_FIELDS = 16.0  # fields over the surface while a pin slides: places, forces, displacements, their changes
_INNER = 4500.0  # numbers for each surface node when the inside of the slab is solved for
_NODE = 500.0  # numbers for each node of a slab's grid: its sparse stiffness, copies and products
_SQUARE = (
    12.0  # numbers for each square of a surface node: the compliance, its blocks, and those of even and odd fields
)


def condensation_bytes(slab: Slab) -> float:
    """Bytes of arrays that `surface_compliance` holds at most at once, its result included."""
    return _FLOAT * (_NODE * grid_nodes(slab) + _SQUARE * slab.n_x**2)


def contact_bytes(case: Case) -> float:
    """Bytes of arrays while initial contact is computed, beside the compliance, which is mapped."""
    if case.contact_by_convolution:
        return _FLOAT * _CONVOLVED * case.slab.n_x
    return _FLOAT * _SYSTEMS * _touch_entries(case) ** 2


def sliding_bytes(case: Case) -> float:
    """The same while sliding on from initial contact, without the record itself."""
    wide = 2.0 * case.slab.n_x
    entries = max(_touch_entries(case), tableau_entries(case) if case.effects.pin_translation else contact_nodes(case))
    anew = case.effects.pin_translation and not (case.effects.coupling or case.slab.scheme.endless)  # the compliance
    whole = wide * (wide if anew else _FIELDS)
    return _FLOAT * (_SYSTEMS * entries**2 + whole)


def inside_bytes(slab: Slab) -> float:
    """The same of the displacements and stresses inside the slab."""
    return _FLOAT * _INNER * slab.n_x


def statistics_bytes(case: Case) -> float:
    """The same of the distributions of the sizes of a record's events."""
    return _FLOAT * _OF_A_SIZE * events_of(case)


def record_bytes(case: Case) -> float:
    """Room for the events, which doubles as they come, and the record made of them."""
    events = events_of(case)
    return _EVENT * max(min(FIRST_CAPACITY, float(case.max_events or FIRST_CAPACITY)) + events, 2.5 * events)


def _touch_entries(case: Case) -> float:
    """Entries of a row of the matrix of initial contact."""
    if without_shear(case):
        return contact_nodes(case)
    if case.initial_contact == "gradual":
        return 2.0 * case.slab.n_x + 1.0
    return max(tableau_entries(case), 2.0 * hertz_nodes(case))


# What each kind of task costs.


class Estimate(NamedTuple):
    """What a task costs, to a factor of three."""

    seconds: float
    """On one core of an ordinary machine (nanoslip.study.plan.cost)."""
    memory: float
    """Bytes of arrays while it runs, beside the compliance that it maps and the program's own."""
    disk: float
    """Bytes of its result."""


@lru_cache(maxsize=256)  # the tasks of a campaign share the number itself
def disk_of(scalars: float, arrays: float = 0.0) -> float:
    """Bytes of a result with so many scalars and so many numbers in arrays."""
    return _ARCHIVE + _SCALAR * scalars + 8.0 * arrays


_ARCHIVE = 1000.0  # of a result: its ending, its origin, and the archive's own
_SCALAR = 30.0  # as text, with its name


def estimate(task: Task) -> Estimate:
    """What a task costs, roughly: its own kind's, handing out, reading and writing included."""
    seconds, memory, disk = ESTIMATES[task.kind](task)
    return Estimate(min(TASK + seconds, LONGEST), memory, disk)


LONGEST: Final = 1e12
"""Thirty thousand years will do for what never ends."""


def _compliance(task: Task) -> Estimate:
    matrix = disk_of(0, (2.0 * task.slab.n_x) ** 2)
    return Estimate(condensation_seconds(task.slab), condensation_bytes(task.slab), matrix)


def _contact(task: Task) -> Estimate:
    case = case_of(task)
    arrays = 0.0 if task.scalars_only else _CONTACT_ARRAYS + _CONTACT_PER_NODE * case.slab.n_x
    members = task.ensemble.likely
    return Estimate(members * touch_seconds(case), contact_bytes(case), disk_of(10 * members, arrays))


_CONTACT_ARRAYS = 250.0  # numbers' worth of the names of its arrays
_CONTACT_PER_NODE = 10.0  # numbers of each surface node


def _contacts(task: Task) -> Estimate:
    case, (first, beyond) = case_of(task), task.contacts
    memory = sliding_bytes(case) + record_bytes(case) + 2.0 * _FLOAT * _PORTION
    return Estimate((beyond - first) * record_seconds(case), memory, disk_of(_RECORD_SCALARS, _PORTION))


_PORTION = 6.0 * PIECES  # numbers' worth of a portion


def _record(task: Task) -> Estimate:
    case = case_of(task)
    members = task.ensemble.likely
    if case.interface.contacts > 1:
        arrays = 0.0 if task.scalars_only else _RECORD_ARRAYS + _RECORD_PER_EVENT * PIECES
        inputs = members * len(batches(case.interface.contacts)) * _FLOAT * _PORTION
        return Estimate(0.0, inputs + _FLOAT * members * arrays, disk_of(members * _RECORD_SCALARS, members * arrays))
    if task.needs[:1] != compliance_needs(case.slab):  # another record's scalars
        return Estimate(0.0, 0.0, disk_of(members * _RECORD_SCALARS))
    arrays = (
        0.0
        if task.scalars_only
        else _RECORD_ARRAYS + _RECORD_PER_EVENT * events_of(case) + _RECORD_PER_NODE * case.slab.n_x
    )
    memory = sliding_bytes(case) + members * record_bytes(case)
    return Estimate(members * record_seconds(case), memory, disk_of(members * _RECORD_SCALARS, members * arrays))


_RECORD_SCALARS = 36.0
_RECORD_ARRAYS = 350.0  # numbers' worth of the names of its arrays
_RECORD_PER_EVENT = 8.7
_RECORD_PER_NODE = 2.0


def _statistics(task: Task) -> Estimate:
    case, members = case_of(task), task.ensemble.likely
    return Estimate(
        members * statistics_seconds(), members * statistics_bytes(case), disk_of(_STATISTICS_SCALARS, _STATISTICS_BINS)
    )


_STATISTICS_SCALARS = 51.0
_STATISTICS_BINS = 800.0  # numbers of the bins of all sizes


def _states(task: Task) -> Estimate:
    case, looks = case_of(task), len(task.events)
    memory = sliding_bytes(case) if any(task.events) else contact_bytes(case)
    nodes = _STATES_PER_NODE * looks * task.slab.n_x
    if task.subsurface:
        memory = max(memory, inside_bytes(task.slab))
        nodes += _STATES_PER_NODE_INSIDE * looks * task.slab.n_x
    return Estimate(states_seconds(case, task.events, task.subsurface), memory, disk_of(0, _STATES_ARRAYS + nodes))


_STATES_ARRAYS = 250.0  # numbers' worth of the names of its arrays
_STATES_PER_NODE = 6.0  # numbers of each surface node
_STATES_PER_NODE_INSIDE = 8.0 * 8.0  # of the nodes under one of the surface, on a graded grid


def _drive(task: Task) -> Estimate:
    case, drive = case_of(task), drive_of(task)
    arrays = 0.0 if task.scalars_only else _DRIVE_ARRAYS + _DRIVE_PER_SAMPLE * drive.samples
    memory = 8.0 * (
        2.0 * _DRIVE_PER_SAMPLE * drive.samples + _DRIVE_PER_EVENT * events_of(case)
    )  # the fit's columns, too
    members = task.ensemble.likely
    return Estimate(members * drive_seconds(drive, case, task.fitted), memory, disk_of(24 * members, arrays))


_DRIVE_ARRAYS = 550.0  # numbers' worth of its binned force, its slips, and the names of its arrays
_DRIVE_PER_SAMPLE = 5.0
_DRIVE_PER_EVENT = 16.0  # numbers of the record that it is pulled over


ESTIMATES: Final[Mapping[str, Callable[[Task], Estimate]]] = {
    "compliance": _compliance,
    "contact": _contact,
    "contacts": _contacts,
    "record": _record,
    "statistics": _statistics,
    "states": _states,
    "drive": _drive,
}
"""Name of a kind -> what its tasks cost, from their cases alone."""
