"""At an end of the surface what a pin meets does not repeat: no mean of it is stated as if it did."""

import math
from dataclasses import replace

import numpy as np
import pytest

from solver.case import Case
from solver.contact.initial import initial_contact
from solver.drive import Drive
from solver.dynamics.coefficients import measured
from solver.elasticity.compliance import surface_compliance
from solver.outcome import Ending
from solver.slab import Slab
from solver.sliding.events import slide, slide_to_state
from solver.sliding.plateau import plateau_of
from solver.sliding.record import FrictionRecord
from solver.sliding.statistics import event_statistics
from solver.sliding.validity import OUTGROWN, WHOLE_SLAB, record_flags
from tests.synthetic import modulated_record

BESIDE = Slab(33, support="right_side")
AT_ENDS = {
    "a slab pressed as a whole": Case(radius=2000.0, normal_load=1e-2, slab=BESIDE, max_events=4000),
    "a punch as wide as the slab": Case(pin="flat_punch", half_width=0.5, slab=Slab(33), max_events=6000),
    "a contact at one end": Case(radius=500.0, slab=Slab(33), max_events=10_000),
    "a grid that is too short": Case(
        pin="flat_punch", half_width=0.5, slab=Slab(33, scheme="half_plane"), max_events=6000
    ),
}


def record_of(case: Case) -> FrictionRecord:
    return slide(case, surface_compliance(case.slab))


@pytest.mark.parametrize("label", AT_ENDS)
def test_a_contact_at_an_end_of_the_surface_states_no_uncertainty_of_means(label: str) -> None:
    record = record_of(AT_ENDS[label])
    plateau, events = plateau_of(record), event_statistics(record)
    assert record.at_an_end
    assert plateau.outcome.ok
    assert plateau.mean > 0.0
    for unknown in (plateau.uncertainty, plateau.of_length, events.mean_step_uncertainty, events.mean_drop_uncertainty):
        assert math.isnan(unknown)


def test_kinetic_friction_over_such_a_record_is_not_known_either() -> None:
    record = record_of(AT_ENDS["a slab pressed as a whole"])
    spring = 0.004 * record.initial_stiffness
    duration = 20.0 * 2.0 * math.pi / math.sqrt(spring)
    velocity = 1.5 * record.normal_load / spring / duration
    drive = Drive(spring, 0.1, velocity, duration, samples=2)
    friction = measured(record, plateau_of(record), drive)[1]
    assert friction.kinetic_friction > 0.0
    assert math.isnan(friction.kinetic_friction_uncertainty)
    assert friction.outcome.ending is Ending.COMPLETED


def test_a_record_is_flagged_outgrown_where_it_states_no_uncertainty_of_means() -> None:
    """A contact may reach the last node in the course of an event that another node triggers, and end there."""
    slab = Slab(65, 2.0)
    compliance, flagged = surface_compliance(slab), set()
    for friction, begins in ((0.3, 0.25), (0.9, 0.25), (0.9, 0.3125)):
        case = Case(intrinsic_friction=friction, start=begins, slab=slab, max_events=20_000, max_spacings=2.0)
        start = initial_contact(case, compliance)
        record, end = slide_to_state(case, compliance, start)
        outgrown = bool({OUTGROWN, WHOLE_SLAB} & set(record_flags(case, start, record, end)))
        assert record.at_an_end == outgrown
        flagged.add(outgrown)
    assert flagged == {False, True}


def test_what_is_at_an_end_is_seen_by_nodes_and_sizes_alone() -> None:
    record = modulated_record(2.4, 0.0)
    last = len(record.node_x) - 1
    assert not record.at_an_end
    for node in (0, last):
        assert replace(record, node=np.append(record.node[1:], np.int32(node))).at_an_end
    for inside in (1, last - 1):
        assert not replace(record, node=np.append(record.node[1:], np.int32(inside))).at_an_end
    assert replace(record, end_nodes=1).at_an_end
    assert replace(record, node_slips=np.bincount([last], minlength=last + 1)).at_an_end
    assert replace(record, initial_contact_size=last + 1).at_an_end
    assert replace(record, contact_size=np.append(record.contact_size[1:], np.int32(last + 1))).at_an_end
