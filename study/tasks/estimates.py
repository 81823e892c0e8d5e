"""Estimated cost of tasks before any has run: seconds on one core, bytes of memory and on disk.

Seconds are steps times rates of an ordinary machine, within a factor of ten; the first finished tasks then scale each kind
(nanoslip.study.run.progress). Bytes are within a factor of three.
"""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from nanoslip.solver.case import MOST_EVENTS, Case, make_image
from nanoslip.solver.contact.closed_forms import smooth_contact
from nanoslip.solver.contact.kernels.path import STRETCHES
from nanoslip.solver.contact.pin import contact_limit, estimate_half_width
from nanoslip.solver.drive import Drive, estimate_duration
from nanoslip.solver.dynamics.stick_slip import MOST_FITTED_SAMPLES
from nanoslip.solver.elasticity.grid_scheme import GridScheme, grid_scheme, trunk
from nanoslip.solver.elasticity.schemes.chain import Chain, spring_stiffness
from nanoslip.solver.last import cache_last
from nanoslip.solver.layout import Layout, Plane, Row
from nanoslip.solver.load_path import path_extent
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.interface import PIECES
from nanoslip.solver.sliding.record import FIRST_CAPACITY, extend_record, farthest, off_the_slab, presliding_length
from nanoslip.solver.sliding.validity import least_plateau
from nanoslip.study.tasks.kind import KINDS
from nanoslip.study.tasks.task import Task

# Rates: seconds on one core.

TASK: Final = 1e-3
"""Time of any task: to hand out, read, write, and look for a contact."""
NODE: Final = 2e-5
"""Time to assemble and condense a node of a slab's grid."""
SOLVE: Final = 1e-9
"""Time of a dense solution over the cube of its unknowns."""
SLIP: Final = 1e-9
"""Time per entry of the row that a node's slip adds to the state."""
STEP: Final = 6e-8
"""Time of a time step of a drive, or of a sample."""
SEGMENT: Final = 2e-7
"""Time of a segment of a drive, integrated exactly: 1.8e-7 to 5e-7 s of a slow pin on five cases."""
SEGMENTS: Final = 3.0
"""Segments in each period of a slow pin, of a drive of the least duration: 1 to 5 seen from 0.1 to 10 µm/s on five cases."""
CRITICAL_SECONDS: Final = 0.85
"""Time of a critical velocity, over a record and its first half: some 30 drives, 2 to 15 to bracket each, 6 to bisect, of 10
to 60 ms. Of 16 drives with two such searches
0.3 to 3.3 s; stiffness, damping and velocity foretell it no better than this mean."""
FIT: Final = 8e-3
"""Time of a fit of Eq. 16-19, samples aside: three least squares of some fifteen steps (8 to 19 ms for 200 to 2000 samples)."""


MOST_SEGMENTS: Final = 9.0
"""Most segments seen in a period of a slow pin."""

# Distance that a pin goes, and number of nodes under it.
#
# Two scaling laws describe sliding. The presliding length μ_i W/K, by which the pin moves until all nodes have slipped, takes
# `EVENTS` events for each node in contact. On the way of the pin every node regains, against its own stiffness, the shear that
# it loses in slips. Both hold to a factor of three: cascades are chaotic.

EVENTS = 6.0
"""Events in a presliding length for each node in contact, at residual_shear 0."""
NODE_STIFFNESS = 3.0
"""Stiffness of a surface node against its neighbours at rest, in G: about a half-plane's under a load one spacing wide."""


# Kept: both time and memory need it.
@lru_cache(maxsize=256)
def grid_nodes(slab: Slab) -> int:
    """Nodes of the slab's grid; 0 of a scheme without one."""
    if not isinstance(slab.scheme, GridScheme):
        return 0
    grid = grid_scheme(slab).grid(trunk(slab))
    return int(sum(grid.counts))


class Sizes(NamedTuple):
    """Estimated numbers of events, slips and nodes of a case."""

    hertz_nodes: float
    """Surface nodes under the pin on a half-plane, or on the springs of a chain: the first guess of initial
    contact."""
    nodes: float
    """Surface nodes in contact: fewer than `hertz_nodes` on a bonded layer that is thinner than the contact."""
    across: float
    """Nodes along a row through the middle of the contact."""
    stiffness: float
    """dF/dδ_p with all nodes stuck, in G·L_y."""
    presliding: float
    """(μ_i·W + τ_0·area)/K, in L_x."""
    step: float
    """Displacement from event to event in steady sliding, in L_x."""
    reach: float
    """δ_p in L_x at which a record ends at the latest: its limit, or where a pin that follows the surface has left the slab."""
    most: float
    """Events that a record may have."""
    events: float
    """Events that fit into its displacement, or that the pin meets on its slab."""


# Kept: time, memory and disk space need them.
@cache_last
def estimate_sizes(case: Case) -> Sizes:
    """Sizes of a case, from scaling laws."""
    slab, rule = case.slab, case.slip_rule
    is_coulomb = rule.residual_shear == 1.0
    hertz = across = _nodes_across(case, estimate_half_width(case))
    if case.pin != "flat_punch" and not slab.scheme.bottomless:
        contact = smooth_contact(slab.scheme.LAYOUT)
        half_width = contact.film(case.normal_load, case.radius, slab.poisson, slab.aspect_ratio)
        # The law of a thin film holds where the contact is wider than the layer is high; else the layer is a half-plane.
        if half_width > slab.aspect_ratio:
            across = min(hertz, _nodes_across(case, half_width))
    stiffness = slab.scheme.lateral_stiffness(slab, across)
    hertz, nodes = map(slab.layout.nodes_of_width, (hertz, across))
    # Nodes that never slip leave no events: an infinite μ_i is as good as a million.
    limit = contact_limit(case, nodes * slab.node_area)
    presliding = min(limit, 1e6 * case.normal_load) / stiffness
    least = rule.event_floor * min(slab.spacing, STRETCHES * presliding)
    # Share of its shear that a node loses in a slip.
    lost = max(1.0 - rule.residual_shear, 1e-6)
    # Never 0: numbers of events are lengths over it.
    step = max(lost * presliding / (EVENTS * nodes), least, 1e-300)
    length = presliding_length(limit, stiffness)
    reach = extend_record(case, length, farthest(case, length) / step)
    if case.effects.pin_translation or is_coulomb:
        reach = min(reach, off_the_slab(case))
    most = float(case.max_events or MOST_EVENTS)
    # In Coulomb sliding a node is touched and one released in each spacing; all come to slide first.
    events = reach / step
    if is_coulomb:
        events = 2.0 * nodes + slab.rows * reach / slab.spacing
    return Sizes(hertz, nodes, across, stiffness, presliding, step, reach, most, min(events, most))


def _nodes_across(case: Case, half_width: float) -> float:
    nodes = 2.0 * half_width * (case.slab.n_x - 1) + 1.0
    return min(nodes, float(case.slab.n_x))


def estimate_displacement(case: Case) -> float:
    """δ_p that a record reaches, in L_x: its limit, or its events' mean steps."""
    sizes = estimate_sizes(case)
    # Coulomb sliding: the first events bring all nodes to slide, then there is one for each spacing.
    if case.slip_rule.residual_shear == 1.0:
        steady = max(sizes.most - 2.0 * sizes.nodes, 0.0)
        return min(sizes.reach, steady * case.slab.spacing)
    return min(sizes.reach, sizes.events * sizes.step)


def path_length(case: Case) -> tuple[int, float, float]:
    """Legs of a case's path, the way of its pin, and how far it goes, both in L_x."""
    return path_extent(case.path, estimate_sizes(case).presliding)


def _followed_in_row(case: Case, across: float) -> float:
    """Nodes in a window with this many in contact; a rough pin may meet any node."""
    if case.heterogeneity.roughness:
        return case.slab.n_x
    return across + 2.0 * case.slab.layout.followed_margin


def _followed_on_plane(case: Case, across: float) -> float:
    """Nodes in a patch with this many across the contact; a rough pin may meet nodes below its lowest contact by twice the range
    of its roughness."""
    rough = float(np.ptp(make_image(case.heterogeneity.roughness).height))
    # A sphere rises by x²/2R: to twice the range h of the roughness within x = 2√(Rh), a diameter of 4√(Rh).
    spaces = case.slab.n_x - 1
    width_of_roughness = 4.0 * spaces * math.sqrt(case.radius * rough)
    diameter = math.hypot(across, width_of_roughness) + 2.0 * case.slab.layout.followed_margin
    return case.slab.layout.nodes_of_width(diameter)


_FOLLOWED: Final[dict[type[Layout], Callable[[Case, float], float]]] = {
    Row: _followed_in_row,
    Plane: _followed_on_plane,
}
"""Layout -> nodes that are followed, of a contact with this number of nodes across."""


def _tableau_entries(case: Case) -> float:
    """Entries of a row of the tableau: both directions of all nodes that are followed, and the load."""
    count_followed = _FOLLOWED[case.slab.scheme.LAYOUT]
    followed = count_followed(case, estimate_sizes(case).across)
    return 2.0 * min(followed, case.slab.nodes) + 1.0


def _touch_entries(case: Case) -> float:
    """Entries of a row of the matrix of initial contact."""
    effects = case.effects
    frictionless = case.initial_contact == "frictionless" and case.slip_rule.residual_shear < 1.0
    # The normal problem alone: no tableau is set up.
    if frictionless or not (effects.friction and effects.coupling):
        return estimate_sizes(case).nodes
    if case.initial_contact == "gradual":
        return 2.0 * case.slab.nodes + 1.0
    return max(_tableau_entries(case), 2.0 * estimate_sizes(case).hertz_nodes)


def _has_base(case: Case) -> bool:
    """True if a contact is near a disc of nodes, and its tableau made from that of the disc."""
    is_smooth = not case.heterogeneity.roughness
    return "y" in case.slab.layout.AXES and is_smooth and case.slip_rule.residual_shear < 1.0


# Seconds of each kind of computation.


def condensation_seconds(slab: Slab) -> float:
    """Seconds of `surface_compliance`; next to none if it is no matrix."""
    return NODE * grid_nodes(slab)


def touch_seconds(case: Case) -> float:
    """Seconds of initial contact that nothing follows."""
    # Fourier transforms of n nodes take n log n.
    if case.contact_by_convolution:
        on_surface = case.slab.nodes
        return TASK + STEP * on_surface * math.log2(on_surface)
    nodes = estimate_sizes(case).hertz_nodes
    # Inverses of few sets, at the speed of a product of matrices.
    if "y" in case.slab.layout.AXES and case.initial_contact != "gradual":
        return TASK + SOLVE * nodes**3
    return TASK + SOLVE * nodes * _touch_entries(case) ** 2


def record_seconds(case: Case) -> float:
    """Seconds of a case's friction record, initial contact included."""
    return touch_seconds(case) + slide_seconds(case, estimate_sizes(case).events)


def slide_seconds(case: Case, events: float) -> float:
    """A slip updates a row of the state. Coulomb sliding solves for the sliding nodes at each event: 0.8 s for 8 presliding
    lengths with 201 nodes, 40 s for 2 with 795."""
    nodes, stiffness = estimate_sizes(case).nodes, estimate_sizes(case).stiffness
    if case.slip_rule.residual_shear == 1.0:
        solution = TASK + SOLVE / 32.0 * nodes**3
        return (events + nodes) * solution
    row = _tableau_entries(case) if case.effects.pin_translation else nodes
    slab, scheme = case.slab, case.slab.scheme
    # On a plane a node's forces stand for the depth of a spacing.
    leaf, coupling = NODE_STIFFNESS * slab.layout.node_depth, 0.0
    if isinstance(scheme, Chain):
        leaf, coupling = spring_stiffness(scheme, slab)
    # Slips per event: all nodes regain own stiffness · step each, and lose `lost` · μ_i W/nodes in a slip. With the
    # step lost · μ_i W/(K · EVENTS · nodes) that is own stiffness · nodes/(K · EVENTS).
    slips = (leaf + 2.0 * coupling) / EVENTS * nodes / stiffness
    in_an_event = min(max(slips, 1.0), nodes)
    return SLIP * row * (events * in_an_event + row)


def drive_duration(drive: Drive, case: Case) -> float:
    """The duration of a drive, in its unit; estimated for the least friction possible if the drive has no
    duration."""
    if drive.duration is not None:
        return drive.duration
    if drive.stage_stroke is not None:
        return drive.cycles_duration
    force = min(least_plateau(case), 1e6) * case.total_load
    stiffness = estimate_sizes(case).stiffness
    duration = estimate_duration(drive, force, force, stiffness, estimate_displacement(case))
    # A stage that hardly moves would take for ever: finite numbers can still be added up.
    return min(duration, 1e30)


def _time_step(drive: Drive) -> float | None:
    """Time step of a drive's integrator; None of one from tooth to tooth."""
    step: float | None = getattr(drive.integrator, "time_step", None)
    return step


def drive_steps(drive: Drive, case: Case) -> float:
    """Segments that a drive needs, one for each tooth on the way of its stage, or time steps; step_limit aside."""
    duration = drive_duration(drive, case)
    way = drive.stage_velocity * duration
    sizes = estimate_sizes(case)
    # The limit of an interface is that of all its contacts together, in so many pieces over the whole record.
    teeth = way / sizes.step
    if case.interface.contacts > 1:
        teeth = way * PIECES / sizes.reach
    step = _time_step(drive)
    if step:
        return duration / step
    return 0.0 if drive.profile == "mean" else teeth


def drive_periods(drive: Drive, case: Case) -> float:
    """Periods of a pin that swings on spring and contact, in each of which it may come to rest on a tooth.

    0 without teeth, and in time steps. Up to MOST_SEGMENTS segments were seen in each period of a slow pin.
    """
    if drive.profile != "sawtooth" or _time_step(drive):
        return 0.0
    damped = estimate_sizes(case).stiffness + drive.spring_stiffness * (1.0 - drive.damping_ratio**2)
    return drive_duration(drive, case) * math.sqrt(max(damped, 0.0)) / (2.0 * math.pi)


def drive_seconds(drive: Drive, case: Case, fitted: bool, critical: bool = False) -> float:
    """Seconds of motion and fit: steps, and samples; of the contact that is slid as far as the stage moves; of bisections."""
    sizes, duration = estimate_sizes(case), drive_duration(drive, case)
    contact = 0.0
    # A contact that remembers is slid once more, under its drive.
    if drive.memory and drive.stage_velocity * duration:
        events = drive.stage_velocity * duration / sizes.step
        contact = touch_seconds(case) + slide_seconds(case, events)
    samples = min(drive.output_times, MOST_FITTED_SAMPLES)
    sampled = STEP * 50.0 * samples + _motion_seconds(drive, case)
    # A stage to and fro has neither a fit nor a critical velocity.
    of_one_way = 0.0 if drive.stage_stroke is not None else CRITICAL_SECONDS * critical + FIT * fitted
    return contact + of_one_way + sampled


def _motion_seconds(drive: Drive, case: Case) -> float:
    """Seconds of the time steps of a drive, or of its segments: one for each tooth, and more as the pin swings on it."""
    steps = drive_steps(drive, case) + SEGMENTS * drive_periods(drive, case)
    rate = STEP if _time_step(drive) else SEGMENT
    return rate * min(steps, drive.step_limit)


# Bytes of the arrays of contacts and friction records while they are computed.

FLOAT: Final = 8.0
"""Bytes of a number."""
# Copies of its matrix that a contact holds at once; on a plane of nodes no matrix is kept, but perhaps a base of tableaus.
_SYSTEMS: Final[dict[type[Layout], float]] = {Row: 3.4, Plane: 2.5}
# The same if its tableau is made from a base, of which a quarter is kept: 1.4 with 1000 nodes in contact, 1.5 with 240.
_FROM_BASE = 1.5
# Numbers for each surface node while a contact is looked for without a matrix.
_CONVOLVED = 40.0
# Bytes of an event in a record.
_EVENT = 65.0
# Fields over the surface while a pin slides: places, forces, displacements, their changes.
_FIELDS = 16.0


def contact_bytes(case: Case) -> float:
    """Bytes of arrays while initial contact is computed, beside the compliance, which is mapped."""
    if case.contact_by_convolution:
        return FLOAT * _CONVOLVED * case.slab.nodes
    return FLOAT * _systems(case) * _touch_entries(case) ** 2


def _systems(case: Case) -> float:
    return _FROM_BASE if _has_base(case) else _SYSTEMS[case.slab.scheme.LAYOUT]


def sliding_bytes(case: Case) -> float:
    """Memory while sliding on from initial contact, without the record itself."""
    unknowns = 2.0 * case.slab.nodes
    sliding = _tableau_entries(case) if case.effects.pin_translation else estimate_sizes(case).nodes
    entries = max(_touch_entries(case), sliding)
    # Without coupling a compliance that is a matrix is made anew.
    is_kept = case.effects.coupling or case.slab.scheme.endless
    is_copied = case.effects.pin_translation and not is_kept
    matrix_entries = unknowns * (unknowns if is_copied else _FIELDS)
    return FLOAT * (_systems(case) * entries**2 + matrix_entries)


def record_bytes(case: Case) -> float:
    """Room for the events, which doubles as they come, and the record made of them."""
    events = estimate_sizes(case).events
    first = min(FIRST_CAPACITY, float(case.max_events or FIRST_CAPACITY))
    return _EVENT * max(first + events, 2.5 * events)


# Cost of a task, whatever its kind.


RESULT: Final = 3000.0
"""Bytes of a result besides the numbers in its arrays: its scalars and its description."""
LONGEST: Final = 1e12
"""Thirty thousand years, for runs that never end."""


def estimate(task: Task) -> tuple[float, float, float]:
    """Rough cost of a task, with distribution, reading and writing: seconds, bytes of memory, bytes of its result."""
    seconds, memory, numbers = KINDS[task.kind].estimate(task)
    disk = RESULT + FLOAT * (0.0 if task.scalars_only else numbers)
    if task.free:
        return 0.0, memory, disk
    return min(TASK + seconds, LONGEST), memory, disk
