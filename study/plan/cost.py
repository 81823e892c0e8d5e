"""What a contact and a friction record cost, before they are computed: nodes in contact, slips, seconds, bytes.

Nodes in contact are Hertz's, or those of a thin layer. A node slips when its shear has grown to μ_i times its pressure,
loses 1 - residual_shear of it, and gets it back as the pin moves on against the node's own stiffness, about 3.5 G whatever the
slab: that many slips a displacement takes. How many come in one event depends on what else gives way: the softer the slab
under the pin, the more other nodes a slip loads (a third of the nodes in contact, over the lateral stiffness K in G). All
was measured on one core; a test holds it to a factor of three, which is what chaos leaves. Blocks of a chain have the stiffness
of their springs, and the root of their coupling says how many slip together.
"""

import math

from solver.case import MOST_EVENTS, Case
from solver.contact.compiled_contact import margin
from solver.contact.coulomb.motion import LONGEST_STEP
from solver.contact.normal import expected_half_width
from solver.elasticity.schemes.chain import Chain, spring_stiffness
from solver.sliding.columns import FIRST_CAPACITY
from solver.sliding.coulomb import OFF_THE_SLAB
from solver.sliding.kernels.step import STRETCHES
from study.plan.condensation import condensation_bytes
from study.plan.task import Task

NODE_STIFFNESS = 3.5
"""Of a surface node against its neighbours at rest, in G: slips per displacement, times what they drop, over nodes."""
TOGETHER = 0.35
"""Slips in an event of steady sliding, times K, over nodes in contact."""
LEAST_STEP = 1e-13
"""The least step of the pin, over what the load moves it (W/K): without friction every event takes it."""
OF_A_CHAIN = 0.9
"""Slips in an event of a chain, over the root of its coupling: measured for couplings from 1 to 300."""
TRAVEL = 1.5
"""Displacement at which the pin has left the slab, in L_x."""
CHANGES_PER_SPACING = 0.75
"""Events of Coulomb sliding per node spacing that the pin moves: touches and releases."""


def contact_nodes(case: Case) -> float:
    """Surface nodes under the pin, about: Hertz's, or fewer on a bonded layer that is thinner than the contact."""
    slab, hertz = case.slab, _hertz_nodes(case)
    if case.pin == "flat_punch" or slab.scheme.endless or not slab.scheme.continuum:
        return hertz
    modulus = 2.0 * (1.0 - slab.poisson) / (1.0 - 2.0 * slab.poisson)  # of a layer that cannot give way sideways
    half_width = math.cbrt(1.5 * case.normal_load * case.radius * slab.aspect_ratio / modulus)
    return min(hertz, _nodes_across(case, half_width)) if half_width > slab.aspect_ratio else hertz


def _hertz_nodes(case: Case) -> float:
    """The same on a half-plane, or on the springs of a chain: what pressing the pin down begins with."""
    return _nodes_across(case, expected_half_width(case))


def _nodes_across(case: Case, half_width: float) -> float:
    return min(2.0 * half_width * (case.slab.n_x - 1) + 1.0, float(case.slab.n_x))


def lateral_stiffness(case: Case) -> float:
    """dF/dδ_p with all nodes stuck, in G·L_y, about: shear and bending of the slab, less what a wide pin holds, in series."""
    height, scheme = case.slab.aspect_ratio, case.slab.scheme
    if isinstance(scheme, Chain):
        return scheme.lateral_stiffness(case.slab, contact_nodes(case))
    if case.slab.scheme.endless:
        return 1.0 / max(0.56 + 0.21 * math.log(height), 0.05)
    width = contact_nodes(case) * case.slab.spacing
    compliance = max(0.05 + 1.2 * height + 0.6 * height**3 + 1.3 * min(height, 1.0) * (0.55 - width), 0.05)
    if case.slab.support == "right_side":
        compliance = min(compliance, 0.5)
    return 1.0 / (compliance + (1.0 if case.slab.support == "frictionless" else 0.0))


def mean_step(case: Case) -> float:
    """Displacement from event to event in steady sliding, in L_x."""
    moved = case.normal_load / lateral_stiffness(case)
    floor = case.slip_rule.event_floor * min(case.slab.spacing, STRETCHES * _finite(case.intrinsic_friction) * moved)
    return max(slips_per_event(case) / _slips_per_displacement(case), floor, LEAST_STEP * moved)


def slips_per_event(case: Case) -> float:
    """Slips in an event of steady sliding."""
    if isinstance(case.slab.scheme, Chain):
        return max(OF_A_CHAIN * math.sqrt(case.slab.scheme.coupling_stiffness), 1.0)
    return max(TOGETHER * contact_nodes(case) / lateral_stiffness(case), 1.0)


def _slips_per_displacement(case: Case) -> float:
    """Each node in contact has to keep up with the pin, at so much a slip."""
    nodes = contact_nodes(case)
    drop = _finite(case.intrinsic_friction) * case.normal_load * max(1.0 - case.slip_rule.residual_shear, 1e-6)
    return _node_stiffness(case) * nodes**2 / max(drop, 1e-300)


def _node_stiffness(case: Case) -> float:
    scheme = case.slab.scheme
    if not isinstance(scheme, Chain):
        return NODE_STIFFNESS
    leaf, coupling = spring_stiffness(scheme, case.slab)
    return leaf + 2.0 * coupling


def events_of(case: Case) -> float:
    """Events of a record: as many as it may have, or as fit into its displacement, or as the pin finds on its slab."""
    farthest = min(case.farthest, TRAVEL) if case.effects.pin_translation else case.farthest
    return min(farthest / mean_step(case), float(case.max_events or MOST_EVENTS))


def expected_displacement(case: Case) -> float:
    """δ_p that a record reaches, in L_x: its limit, or its events' mean steps."""
    if case.slip_rule.residual_shear == 1.0:
        return _coulomb_path(case)[1]
    return min(case.farthest, events_of(case) * mean_step(case))


def slips_of(case: Case, events: float) -> float:
    """Slips of so many events: fewer in each while the pin is not yet sliding as a whole, after F/K."""
    to_full_sliding = _finite(case.intrinsic_friction) * case.normal_load / lateral_stiffness(case)
    under_way = min(events * mean_step(case) / max(to_full_sliding, 1e-300), 1.0)
    return events * max(slips_per_event(case) * under_way, 1.0)


def _finite(intrinsic_friction: float) -> float:
    """Nodes that never slip leave no events; the record ends at once or in one step."""
    return min(intrinsic_friction, 1e6)


# Seconds on one core, as measured from 17 to 1025 nodes in contact.
_TOUCH = (4e-4, 2.5e-7, 1.6e-9)  # by powers 0, 2, 3 of the nodes in contact: rounds of dense solves
_TOUCH_OF_ALL = 0.5  # of that where the contact is all of the surface: nothing is looked for
_PRESSED = 0.2  # of that without shear: half the unknowns
_SCALARS = (1.2e-3, 1.2e-6)  # of a record, and of each event
_SLIP = (5e-8, 5e-10, 1e-12)  # by powers 0, 1, 2 of the entries of a tableau's row: longer ones come from memory
_FROZEN_SLIP = (4.5e-8, 1.5e-10, 5e-13)
_ROUGH = 2.0  # a slip on a rough pin over one on a smooth pin
_COULOMB_TOUCH = (
    2e-8  # initial contact with Coulomb friction, times the cube of the nodes: they come to slide one by one
)
_COULOMB_STEP = (3.5e-4, 2e-9)  # by powers 0, 3 of the nodes in contact: a few dense solves
_SOLVES = 3.0  # steps that an event of it is worth: roles change one at a time until all are right
_DISTRIBUTIONS = (0.35, 6e-5)  # of event sizes, and of each event: fits of a hundred drawn samples
_INSIDE = (8e-3, 6e-6)  # inside of the slab, by powers 0, 1.5 of n_x: one sparse factorization


def seconds_of(task: Task, case: Case) -> float:
    """Seconds that a contact, a friction record, its statistics or states take to compute, on one core."""
    touch = _touch_seconds(case)
    if task.kind == "contact":
        return touch
    if task.kind == "statistics":
        return _polynomial(_DISTRIBUTIONS, events_of(case), (0.0, 1.0))
    if task.kind == "states":
        events = min(float(max(task.events, default=0)), events_of(case))
        inside = len(task.events) * _polynomial(_INSIDE, task.slab.n_x, (0.0, 1.5)) if task.subsurface else 0.0
        return touch + inside + (_slide_seconds(case, events) if events else 0.0)
    return record_seconds(case)


def record_seconds(case: Case) -> float:
    """Seconds of a case's friction record, initial contact included."""
    return _touch_seconds(case) + _slide_seconds(case, events_of(case))


def _touch_seconds(case: Case) -> float:
    first, nodes = _hertz_nodes(case), contact_nodes(case)
    seconds = _polynomial(_TOUCH, math.sqrt(first * nodes), (0.0, 2.0, 3.0))
    if first == case.slab.n_x:
        seconds *= _TOUCH_OF_ALL
    if case.slip_rule.residual_shear == 1.0:
        seconds += _COULOMB_TOUCH * nodes**3
    return seconds * (1.0 if case.effects.friction and case.effects.coupling else _PRESSED)


def _slide_seconds(case: Case, events: float) -> float:
    nodes = contact_nodes(case)
    if case.slip_rule.residual_shear == 1.0:
        changes, travel = _coulomb_path(case)
        steps = _SOLVES * changes + travel / (LONGEST_STEP * case.slab.spacing)
        return _polynomial(_COULOMB_STEP, nodes, (0.0, 3.0)) * steps
    if case.effects.pin_translation:
        slip = _polynomial(_SLIP, _entries(case), (0.0, 1.0, 2.0)) * (_ROUGH if case.heterogeneity.roughness else 1.0)
        start = _polynomial(_TOUCH, nodes, (0.0, 2.0, 3.0))  # a tableau, and another one when the contact has grown
    else:
        slip, start = _polynomial(_FROZEN_SLIP, nodes, (0.0, 1.0, 2.0)), 0.0
    return start + slip * slips_of(case, events) + _polynomial(_SCALARS, events, (0.0, 1.0))


def _coulomb_path(case: Case) -> tuple[float, float]:
    """Events of Coulomb sliding, and the displacement they take."""
    farthest = min(case.farthest, OFF_THE_SLAB)
    events = float(case.max_events) if case.max_events else math.inf
    # All nodes come to slide first; then the pin touches and releases them one by one.
    onset = 2.0 * contact_nodes(case)
    travel = min(farthest, max(events - onset, 0.0) * case.slab.spacing / CHANGES_PER_SPACING)
    changes = onset + travel * CHANGES_PER_SPACING / case.slab.spacing
    return min(events, changes), travel


def _entries(case: Case) -> float:
    """Entries of a row of the tableau: both directions of all nodes that are followed, and the load."""
    n_x = case.slab.n_x
    followed = n_x if case.heterogeneity.roughness else min(contact_nodes(case) + 2.0 * margin(n_x), n_x)
    return 2.0 * followed + 1.0


def _polynomial(coefficients: tuple[float, ...], base: float, powers: tuple[float, ...]) -> float:
    return sum(each * math.pow(base, power) for each, power in zip(coefficients, powers, strict=True))


_FLOAT = 8.0
_TABLEAUS = 4.2  # copies of its tableau that a contact holds at once
_GROWING = 6.5  # the same while the contact has outgrown one
_ROUNDS = 3.9  # copies of its system while the contact is looked for
_SYSTEMS = 6.0  # copies of its system that a contact without shear, or with Coulomb friction, holds at once
_OF_A_SIZE = 25.0  # numbers for each event while its sizes are fitted
_EVENT = 65.0  # bytes of an event in a record
_INNER = 4500.0  # numbers for each surface node when the inside of the slab is solved for


def memory_of(task: Task) -> float:
    """Rough bytes of arrays while a task runs, beside the compliance that it maps and the program's own."""
    if task.kind == "compliance" or task.case is None:
        return condensation_bytes(task.slab)
    case = task.case
    if task.drive is not None:
        return _FLOAT * (5.0 * task.drive.samples + 16.0 * events_of(case))
    if task.kind == "statistics":
        return _FLOAT * _OF_A_SIZE * events_of(case)
    found = _touch_numbers(case)
    if task.kind != "contact":
        found = max(found, _slide_numbers(case))
    if task.subsurface:
        found = max(found, _INNER * task.slab.n_x)
    return _FLOAT * found + (record_bytes(case) if task.kind == "record" else 0.0)


def _touch_numbers(case: Case) -> float:
    nodes = contact_nodes(case)
    if not (case.effects.friction and case.effects.coupling):
        return _SYSTEMS * nodes**2
    if case.slip_rule.residual_shear == 1.0:
        return _SYSTEMS * (2.0 * nodes) ** 2
    if case.initial_contact == "gradual":
        return 5.0 * (2.0 * case.slab.n_x + 1.0) ** 2
    entries = _entries(case)
    seen = (
        2.0 * entries**2 + 2.0 * case.slab.n_x * entries
    )  # the whole surface's displacements are a product with these
    return max(_TABLEAUS * entries**2, seen, _ROUNDS * (2.0 * _hertz_nodes(case)) ** 2)


def _slide_numbers(case: Case) -> float:
    nodes, n_x = contact_nodes(case), float(case.slab.n_x)
    if not case.effects.pin_translation:
        return 3.0 * nodes**2
    # Without coupling the compliance is written down anew.
    operator = 0.0 if case.effects.coupling else (2.0 * n_x) ** 2
    if case.slip_rule.residual_shear == 1.0:
        return operator + _SYSTEMS * (2.0 * nodes) ** 2
    entries = _entries(case)
    return operator + (_TABLEAUS if entries >= 2.0 * n_x else _GROWING) * entries**2


def record_bytes(case: Case) -> float:
    """Room for the events, which doubles as they come, and the record made of them."""
    if case.slip_rule.residual_shear == 1.0:
        return 8.0 * _EVENT * _coulomb_path(case)[0]  # Python's own numbers
    events = events_of(case)
    room = min(FIRST_CAPACITY, float(case.max_events or FIRST_CAPACITY))
    return _EVENT * max(room + events, 2.5 * events)
