"""Bytes of the arrays of contacts and friction records while they are computed, to a factor of three."""

from nanoslip.solver.case import Case
from nanoslip.solver.contact.convolved import needs_no_matrix
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.slide import FIRST_CAPACITY
from nanoslip.study.plan.cost.counts import (
    contact_nodes,
    events_of,
    grid_nodes,
    hertz_nodes,
    tableau_entries,
    without_shear,
)

_FLOAT = 8.0
_SYSTEMS = 5.0  # copies of its matrix that a contact holds at once
_CONVOLVED = 40.0  # numbers for each surface node while a contact is looked for without a matrix
_OF_A_SIZE = 25.0  # numbers for each event while its sizes are fitted
_EVENT = 65.0  # bytes of an event in a record
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
    if needs_no_matrix(case):
        return _FLOAT * _CONVOLVED * case.slab.n_x
    return _FLOAT * _SYSTEMS * _touch_entries(case) ** 2


def sliding_bytes(case: Case) -> float:
    """The same while sliding on from initial contact, without the record itself."""
    wide = 2.0 * case.slab.n_x
    entries = max(_touch_entries(case), tableau_entries(case) if case.effects.pin_translation else contact_nodes(case))
    anew = (
        case.effects.pin_translation and not case.effects.coupling
    )  # the compliance; else the displacements of the surface
    whole = wide**2 if anew else wide * entries
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
