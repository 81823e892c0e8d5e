"""Kinds of task: their results are the solver's, refusals included, under names that are unambiguous."""

import math
from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects, Interface, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.ensemble import Ensemble
from nanoslip.solver.load_path import LoadPath
from nanoslip.solver.outcome import Ending
from nanoslip.solver.parameter import SHARED_ERROR, quantities
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.sizes import event_distributions
from nanoslip.study.tasks.compliance import compliance_task, task_compliance
from nanoslip.study.tasks.compute import run_task
from nanoslip.study.tasks.contact import contact_task
from nanoslip.study.tasks.contacts import all_batches
from nanoslip.study.tasks.kind import KINDS, MEMBER, result_quantities
from nanoslip.study.tasks.path import path_task
from nanoslip.study.tasks.record import member_records, record_scalars_task, record_task
from nanoslip.study.tasks.states import states_task
from nanoslip.study.tasks.statistics import statistics_task
from tests.conftest import ROOT
from tests.study.plan.running import CASE, drive, first, planned, run, slid


def test_every_file_that_declares_a_kind_is_a_stage_of_its_name():
    """One that the list of stages lacks would never be computed."""
    files = {path.stem: path.read_text("utf-8") for path in (ROOT / "study" / "tasks").glob("*.py")}
    declaring = {name for name, text in files.items() if "\nKIND: Final" in text}
    assert declaring == set(KINDS)
    assert [kind.name for kind in KINDS.values()] == [*KINDS]


def test_a_word_that_no_file_declares_is_no_kind():
    """Nor is another file of the folder."""
    for name in ("nonsense", "kind", "compute", ""):
        assert name not in KINDS
        with pytest.raises(KeyError):
            KINDS[name]


MADE = replace(CASE, slab=Slab(65, scheme="biquadratic"))
TASKS = [
    compliance_task(MADE.slab),
    contact_task(MADE),
    *all_batches(replace(MADE, max_displacement=0.1, interface=Interface(contacts=2)), Ensemble()),
    record_task(MADE),
    path_task(replace(MADE, path=LoadPath(amplitude=0.3))),
    statistics_task(MADE),
    states_task(MADE, (0,), subsurface=False),
]


@pytest.mark.parametrize("task", TASKS, ids=lambda task: task.kind)
def test_a_miniature_is_small_and_brings_its_inputs(task):
    """Those of drives are pulled over a record that is made up (tests/study/run/test_warm_up.py)."""
    known = set[str]()
    for small in KINDS[task.kind].miniature(task):
        assert small.slab.n_x < task.slab.n_x
        assert set(small.needs) <= known
        known.add(small.key)
    assert bool(known) == (task.kind != "compliance")


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_no_two_numbers_of_a_kind_have_one_name(kind):
    found = [each for part in kind.parts for each in quantities(part.type, part.prefix).items()]
    for along in {"", *(ragged.sample for ragged in kind.ragged)} - {MEMBER}:
        keys = [key for key, quantity in found if quantity.along == along]
        assert len(keys) == len(set(keys)) == len(result_quantities(kind, along)), along
    names = [(quantity.along, quantity.name) for _, quantity in found]
    assert len(names) == len(set(names))


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_every_column_lies_along_a_dimension_of_its_kind(kind):
    found = {each.along for part in kind.parts for each in quantities(part.type, part.prefix).values()}
    assert found - {""} == {ragged.sample for ragged in kind.ragged} - {MEMBER}  # along which scalars lie


def test_tasks_of_one_slab_are_given_the_very_same_compliance():
    """What the solver keeps with it is found again; another result's, though equal, is another."""
    first, second = (record_task(Case(radius=50.0, slab=Slab(17), start=start)) for start in (0.0, 0.5))
    inputs = {first.needs[0]: run_task(compliance_task(first.slab), {})}
    assert task_compliance(first, inputs) is task_compliance(second, inputs)
    assert task_compliance(first, inputs) != task_compliance(first, {first.needs[0]: replace(inputs[first.needs[0]])})


ENDLESS = replace(CASE, slab=Slab(65, scheme="half_plane"), effects=Effects(coupling=False))


@pytest.mark.parametrize("effects", [Effects(coupling=False), Effects(friction=False)], ids=str)
def test_a_contact_without_a_matrix_needs_no_compliance(effects):
    case = replace(ENDLESS, effects=effects)
    task = contact_task(case)
    assert task.needs == ()
    state, result = initial_contact(case, surface_compliance(case.slab)), run(task)
    assert result.outcome.ok
    for name in ("pressure", "shear", "slip", "gap"):
        np.testing.assert_array_equal(result.arrays[name], getattr(state, name))


def test_what_reads_the_matrix_needs_it():
    assert record_task(replace(ENDLESS, effects=Effects())).needs == ()
    assert contact_task(replace(CASE, effects=Effects(coupling=False))).needs == (compliance_task(CASE.slab).key,)


def test_a_look_at_initial_contact_needs_what_the_contact_needs():
    look = states_task(ENDLESS, (0,), subsurface=False)
    assert look.needs == ()
    np.testing.assert_array_equal(run(look).arrays["surface_pressure"], run(contact_task(ENDLESS)).arrays["pressure"])


def test_a_datum_too_near_is_a_result_of_the_contact_itself():
    shallow = replace(ENDLESS, slab=Slab(65, 0.3, scheme="half_plane"))
    outcome = run(contact_task(shallow)).outcome
    assert outcome.ending is Ending.INVALID
    assert "deeper datum" in outcome.message


def test_a_record_without_a_plateau_says_so_and_is_kept():
    """Its outcome can be filtered; its numbers, but for the plateau's, are as good as any record's."""
    result = slid(replace(CASE, max_events=5))
    assert result.outcome.ending is Ending.NO_PLATEAU
    assert "raise limits.events" in result.outcome.message
    alone = {name for name in first(result) if name.endswith(SHARED_ERROR)}  # one start shares with no other
    missing = {name for name, number in first(result).items() if np.isnan(number)} - alone
    of_plateau = {name for name in first(result) if name.startswith("plateau_") and not name.endswith("_event")} - alone
    assert missing == of_plateau | {"static_excess", "fluctuation", "unseen_force"}  # which are over it
    assert first(result)["events"] == len(result.arrays["displacement"]) == 5


def test_a_record_without_a_plateau_stands_in_the_way_of_drives_alone():
    short = replace(CASE, max_events=5)
    record = slid(short)
    scalars = record_scalars_task(record_task(short))
    copied = run_task(scalars, {scalars.needs[0]: record})
    assert (copied.outcome, copied.scalars) == (record.outcome, record.scalars)
    assert run(compliance_task(short.slab), states_task(short, (5,), False)).outcome.ok


def test_a_drive_over_a_record_without_a_plateau_says_so():
    result = drive(replace(CASE, max_events=5))
    assert result.outcome.ending is Ending.NO_PLATEAU
    assert result.outcome.message.startswith("the friction record")
    assert not first(result)


def test_the_numbers_are_those_of_all_members_together():
    members = 2
    ensemble = Ensemble(members)
    compliance, record = compliance_task(CASE.slab), record_task(CASE, ensemble)
    result = run(compliance, record, statistics_task(CASE, ensemble))
    records = member_records(run(compliance, record))
    expected, bins = event_distributions(records)
    assert result.outcome.ok
    assert len(records) == members
    assert all(len(values) == 1 for values in result.scalars.values())
    names = ("slips_exponent", "slips_exponent_uncertainty", "slips_exponent_members", "drop_step_correlation")
    np.testing.assert_array_equal([first(result)[name] for name in names], [getattr(expected, name) for name in names])
    assert first(result)["sized_events"] == expected.sized_events > 50 * members
    np.testing.assert_array_equal(result.arrays["bin_density"], bins.bin_density)


def test_a_short_record_has_none_and_a_failed_one_says_why():
    short = replace(CASE, max_events=5)
    result = run(compliance_task(short.slab), record_task(short), statistics_task(short))
    assert result.outcome.ok
    assert math.isnan(first(result)["slips_exponent"])
    assert math.isnan(first(result)["slips_goodness"])
    failed = replace(slid(short), outcome=replace(result.outcome, ending=Ending.CONTACT_LOST))
    task = statistics_task(short)
    assert run_task(task, {task.needs[0]: failed}).outcome.ending is Ending.NEEDS_FAILED


@pytest.mark.parametrize("kept", ["true", "false"])
def test_they_need_the_whole_record_whether_it_is_kept_or_not(tmp_path, kept):
    plan = planned(tmp_path, f"outputs.statistics = true\noutputs.records = {kept}")
    tasks = {task.key: task for task in plan.tasks}
    (mine,) = (task for task in plan.tasks if task.kind == "statistics")
    record = tasks[mine.needs[0]]
    assert not record.scalars_only
    assert record.intermediate == (kept == "false")
    assert all(task.kind != "statistics" for task in planned(tmp_path, "").tasks)


def test_what_needs_a_failed_result_fails_with_its_reason():
    """With one slip allowed per event a cascade is given up, and there is no record to drive over."""
    hasty = replace(CASE, slip_rule=SlipRule(cascade_limit=1))
    record = slid(hasty)
    result = drive(hasty)
    assert record.outcome.ending is Ending.CASCADE_LIMIT
    assert result.outcome.ending is Ending.NEEDS_FAILED
    assert result.outcome.message.endswith(f"cascade_limit: {record.outcome.message}")
    assert not result.arrays
