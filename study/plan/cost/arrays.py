"""Bytes of the arrays of contacts and friction records while they are computed, roughly."""

from solver.case import Case
from solver.contact.convolved.contact import needs_no_matrix
from solver.elasticity.grid_scheme import GridScheme
from solver.slab import Slab
from solver.sliding.columns import FIRST_CAPACITY
from study.plan.cost.counts import contact_nodes, events_of, grid_nodes, hertz_nodes, tableau_entries, without_shear

_FLOAT = 8.0
_TABLEAUS = 5.0  # copies of its tableau that a contact holds at once
_GROWING = 6.5  # the same while the contact has outgrown one
_ROUNDS = 3.9  # copies of its system while the contact is looked for
_SYSTEMS = 6.0  # copies of its system that a contact without shear, or with Coulomb friction, holds at once
_CONVOLVED = 40.0  # numbers for each surface node while a contact is looked for without a matrix
_OF_A_SIZE = 25.0  # numbers for each event while its sizes are fitted
_EVENT = 65.0  # bytes of an event in a record
_INNER = 4500.0  # numbers for each surface node when the inside of the slab is solved for


_NODE = 500.0  # numbers for each node of a slab's grid: its sparse stiffness, copies and products
_SQUARE = 10.0  # numbers for each square of a surface node: the compliance, and those of even and odd fields
_CLOSED_FORM = 16.0  # the same of a compliance in closed form, and three more of its size


def condensation_bytes(slab: Slab) -> float:
    """Bytes of arrays that `surface_compliance` holds at most at once, its result included."""
    square = _SQUARE if isinstance(slab.scheme, GridScheme) else _CLOSED_FORM
    return _FLOAT * (_NODE * grid_nodes(slab) + square * slab.n_x**2)


def contact_bytes(case: Case) -> float:
    """Bytes of arrays while initial contact is computed, beside the compliance, which is mapped."""
    return _FLOAT * (_CONVOLVED * case.slab.n_x if needs_no_matrix(case) else _touch_numbers(case))


def sliding_bytes(case: Case) -> float:
    """Bytes of arrays while sliding on from initial contact, without the record itself."""
    return _FLOAT * max(_touch_numbers(case), _slide_numbers(case))


def inside_bytes(slab: Slab) -> float:
    """The same of the displacements and stresses inside the slab."""
    return _FLOAT * _INNER * slab.n_x


def statistics_bytes(case: Case) -> float:
    """The same of the distributions of the sizes of a record's events."""
    return _FLOAT * _OF_A_SIZE * events_of(case)


def _touch_numbers(case: Case) -> float:
    nodes = contact_nodes(case)
    if without_shear(case):
        return _SYSTEMS * nodes**2
    if case.slip_rule.residual_shear == 1.0:
        return _SYSTEMS * (2.0 * nodes) ** 2
    if case.initial_contact == "gradual":
        return 5.0 * (2.0 * case.slab.n_x + 1.0) ** 2
    entries = tableau_entries(case)
    seen = (
        2.0 * entries**2 + 2.0 * case.slab.n_x * entries
    )  # the whole surface's displacements are a product with these
    return max(_TABLEAUS * entries**2, seen, _ROUNDS * (2.0 * hertz_nodes(case)) ** 2)


def _slide_numbers(case: Case) -> float:
    nodes, n_x = contact_nodes(case), float(case.slab.n_x)
    if not case.effects.pin_translation:
        return 3.0 * nodes**2
    # Without coupling the compliance is written down anew.
    operator = 0.0 if case.effects.coupling else (2.0 * n_x) ** 2
    if case.slip_rule.residual_shear == 1.0:
        return operator + _SYSTEMS * (2.0 * nodes) ** 2
    entries = tableau_entries(case)
    return operator + (_TABLEAUS if entries >= 2.0 * n_x else _GROWING) * entries**2


def record_bytes(case: Case) -> float:
    """Room for the events, which doubles as they come, and the record made of them."""
    if case.slip_rule.residual_shear == 1.0:
        return 8.0 * _EVENT * events_of(case)  # Python's own numbers
    events = events_of(case)
    room = min(FIRST_CAPACITY, float(case.max_events or FIRST_CAPACITY))
    return _EVENT * max(room + events, 2.5 * events)
