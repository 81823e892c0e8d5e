"""Seconds of contacts, friction records and what is read off them, on one core of an ordinary machine.

Measured from 17 to 1025 nodes in contact; a test holds them to a factor of three.
"""

import math
from collections.abc import Callable, Sequence

from solver.case import Case
from solver.contact.convolved.contact import needs_no_matrix
from solver.contact.coulomb.motion import LONGEST_STEP
from study.plan.cost.condensation import condensation_seconds
from study.plan.cost.sliding import (
    contact_nodes,
    coulomb_path,
    coulomb_within,
    events_of,
    events_within,
    hertz_nodes,
    slips_of,
    tableau_entries,
    touches_in_spots,
    without_shear,
)

_TOUCH = (5e-4, 2e-7, 3.5e-10)  # by powers 0, 2, 3 of the nodes in contact: rounds of solutions, factors and a tableau
_PRESSED = 0.27  # of that without shear: half the unknowns, and no tableau
_CONVOLUTION = (2e-5, 2e-9)  # of the surface, by powers 0, 1 of its nodes times their digits in base 2
_CONVOLUTIONS = 50.0  # that a contact without a matrix takes on a smooth pin
_OF_SPOTS = 25.0  # the same on a rough one that touches in many spots, times the cube root of the surface's nodes
_SCALARS = (8e-4, 8e-7)  # of a record, and of each event
_SLIP = (5e-8, 3e-10, 8e-13)  # by powers 0, 1, 2 of the entries of a tableau's row: longer ones come from memory
_FROZEN_SLIP = (4e-8, 1.2e-10, 5e-13)
_ROUGH = 1.9  # a slip on a rough pin over one on a smooth pin
_COULOMB_TOUCH = (
    2e-8  # initial contact with Coulomb friction, times the cube of the nodes: they come to slide one by one
)
_COULOMB_STEP = (3.5e-4, 2e-9)  # by powers 0, 3 of the nodes in contact: a few dense solves
_SOLVES = 3.0  # steps that an event of it is worth: roles change one at a time until all are right
_DISTRIBUTIONS = (0.6, 4e-5)  # of event sizes, and of each event: fits of a hundred drawn samples
_INSIDE = (8e-3, 6e-6)  # inside of the slab, by powers 0, 1.5 of n_x: one sparse factorization


def compliance_seconds(case: Case, slides: bool) -> float:
    """Seconds of the compliance of a case's slab; none where nothing reads its matrix."""
    return 0.0 if needs_no_matrix(case) and not slides else condensation_seconds(case.slab)


def touch_seconds(case: Case) -> float:
    """Seconds of initial contact that nothing follows."""
    if not needs_no_matrix(case):
        return contact_seconds(case)
    n_x = case.slab.n_x
    passes = _OF_SPOTS * math.cbrt(n_x) if touches_in_spots(case) else _CONVOLUTIONS
    return passes * _polynomial(_CONVOLUTION, n_x * math.log2(n_x), (0.0, 1.0))


def contact_seconds(case: Case) -> float:
    """Seconds of initial contact, found from the matrix of the slab's compliance."""
    first, nodes = hertz_nodes(case), contact_nodes(case)
    seconds = _polynomial(_TOUCH, math.sqrt(first * nodes), (0.0, 2.0, 3.0))
    if case.slip_rule.residual_shear == 1.0:
        seconds += _COULOMB_TOUCH * nodes**3
    return seconds * (_PRESSED if without_shear(case) else 1.0)


def record_seconds(case: Case) -> float:
    """Seconds of a case's friction record, initial contact included."""
    return contact_seconds(case) + _slide_seconds(case, events_of(case), coulomb_path)


def spacing_seconds(case: Case) -> float:
    """The same of a record over one node spacing, whatever limits the case has."""
    events = events_within(case, case.slab.spacing, None)
    return contact_seconds(case) + _slide_seconds(case, events, _coulomb_spacing)


def _coulomb_spacing(case: Case) -> tuple[float, float]:
    return coulomb_within(case, case.slab.spacing, None)


def statistics_seconds(case: Case) -> float:
    """Seconds of the distributions of the sizes of a record's events."""
    return _polynomial(_DISTRIBUTIONS, events_of(case), (0.0, 1.0))


def states_seconds(case: Case, events: Sequence[int], subsurface: bool) -> float:
    """Seconds of the contacts after some events of a record, and of the inside of the slab there."""
    last = min(float(max(events, default=0)), events_of(case))
    inside = len(events) * _polynomial(_INSIDE, case.slab.n_x, (0.0, 1.5)) if subsurface else 0.0
    if not last:
        return touch_seconds(case) + inside
    return contact_seconds(case) + inside + _slide_seconds(case, last, coulomb_path)


def _slide_seconds(case: Case, events: float, path: Callable[[Case], tuple[float, float]]) -> float:
    """path: of Coulomb sliding, its events and the displacement they take."""
    nodes = contact_nodes(case)
    if case.slip_rule.residual_shear == 1.0:
        changes, travel = path(case)
        steps = _SOLVES * changes + travel / (LONGEST_STEP * case.slab.spacing)
        return _polynomial(_COULOMB_STEP, nodes, (0.0, 3.0)) * steps
    if case.effects.pin_translation:
        slip = _polynomial(_SLIP, tableau_entries(case), (0.0, 1.0, 2.0)) * (
            _ROUGH if case.heterogeneity.roughness else 1.0
        )
        start = _polynomial(_TOUCH, nodes, (0.0, 2.0, 3.0))  # a tableau, and another one when the contact has grown
    else:
        slip, start = _polynomial(_FROZEN_SLIP, nodes, (0.0, 1.0, 2.0)), 0.0
    return start + slip * slips_of(case, events) + _polynomial(_SCALARS, events, (0.0, 1.0))


def _polynomial(coefficients: tuple[float, ...], base: float, powers: tuple[float, ...]) -> float:
    total = 0.0
    for each, power in zip(coefficients, powers, strict=True):
        total += each * base**power
    return total
