"""Members of a later batch wait for all before them, and for nothing else; without a target nobody waits."""

from dataclasses import replace
from pathlib import Path

import pytest

from study.manifest.reader import parse_manifest
from study.plan.memory import need_of
from study.plan.plan import Plan, make_plan
from study.plan.task import Task
from study.plan.tasks import in_stages
from tests.conftest import PARTLY_REFUSED

HEAD = 'title = "x"\nnumerics.n_x = 17\nlimits.events = 60\naxes.radius = [50.0, 100.0]\n'
UNTIL = "[ensemble]\nmembers = 16\nuncertainty = 0.01\n"
DRIVE = '[[drives]]\nname = "a"\nsamples = 5\n'
ALL = HEAD + "outputs = {tractions_at = [3], statistics = true}\n" + UNTIL + DRIVE
BARE = HEAD + "outputs = {records = false, trajectory = false}\n" + UNTIL + DRIVE


def planned(text: str) -> Plan:
    return make_plan(parse_manifest(Path("mine.toml"), text, {}))


def upstream(plan: Plan, key: str) -> set[str]:
    """The keys of all that a task needs, directly or not."""
    tasks = {task.key: task for task in plan.tasks}
    found: set[str] = set()
    waiting = [key]
    while waiting:
        new = set(tasks[waiting.pop()].needs) - found
        found |= new
        waiting.extend(new)
    return found


def members(plan: Plan, kind: str, drive: str = "") -> list[list[str]]:
    """Of each ensemble the keys of its members' tasks of this kind."""
    keys = [plan.case_tasks[case.case_id].keys[kind, drive] for case in plan.cases]
    return [keys[begin : begin + 16] for begin in range(0, len(keys), 16)]


@pytest.mark.parametrize("text", [HEAD + UNTIL, ALL, BARE], ids=["records", "all outputs", "scalars alone"])
def test_a_member_needs_the_records_of_the_batches_before_its_own_and_of_no_other(text: str) -> None:
    """4, then 4 more, then 8 more: a batch doubles what is there."""
    plan = planned(text)
    for records in members(plan, "record"):
        for number, key in enumerate(records):
            before = 0 if number < 4 else 4 if number < 8 else 8
            assert {place for place, each in enumerate(records) if each in upstream(plan, key)} == set(range(before))


@pytest.mark.parametrize(("kind", "drive"), [("states", ""), ("statistics", ""), ("drive", "a")])
def test_whatever_is_of_a_member_waits_as_its_record_does(kind: str, drive: str) -> None:
    plan = planned(ALL)
    asked = {task.key for task in plan.tasks if task.kind == "ensemble"}
    for records, others in zip(members(plan, "record"), members(plan, kind, drive), strict=True):
        for record, other in zip(records, others, strict=True):
            assert asked & upstream(plan, other) == asked & upstream(plan, record)


@pytest.mark.parametrize("text", [ALL, BARE], ids=["all outputs", "scalars alone"])
def test_needs_come_first_in_the_order_and_in_the_stages(text: str) -> None:
    plan = planned(text)
    for ordered in (plan.tasks, tuple(in_stages(reversed(plan.tasks)))):
        seen: set[str] = set()
        for task in ordered:
            assert seen.issuperset(task.needs), task.label
            seen.add(task.key)
        assert seen == {task.key for task in plan.tasks}


def test_there_is_a_question_before_each_batch_but_the_first() -> None:
    asked = [task for task in planned(HEAD + UNTIL).tasks if task.kind == "ensemble"]
    assert sorted((len(task.needs), task.label) for task in asked) == [
        (4, "ensemble radius=100 member=4"),
        (4, "ensemble radius=50 member=4"),
        (8, "ensemble radius=100 member=8"),
        (8, "ensemble radius=50 member=8"),
    ]


def test_the_first_batch_is_an_ensemble_of_four() -> None:
    """Task for task: who has computed one has begun with the other."""
    plan = planned(HEAD + UNTIL)
    four = {task.key for task in planned(HEAD + "ensemble.members = 4\n").tasks}
    assert {task.key for task in plan.tasks if not task.batch and task.kind != "ensemble"} == four


def test_another_uncertainty_leaves_the_first_batch_and_nothing_else() -> None:
    plan, stricter = (
        {task.key: task for task in planned(HEAD + text).tasks} for text in (UNTIL, UNTIL.replace("0.01", "0.001"))
    )
    kept = [task for key, task in plan.items() if key in stricter]
    assert all(not task.batch for task in kept)
    assert len([task for task in kept if task.kind == "record"]) == 8


def test_what_the_next_question_reads_is_a_file_of_its_own() -> None:
    """Logs are not read by tasks; of the last batch nothing is asked."""
    plan = planned(HEAD + UNTIL)
    tasks = {task.key: task for task in plan.tasks}
    read = {need for task in plan.tasks for need in task.needs}
    assert all(tasks[key].shared for key in read if tasks[key].kind != "compliance")
    assert [task.shared for task in plan.tasks if task.kind == "record"].count(True) == 2 * 8


def test_members_of_one_record_ask_once() -> None:
    """A size that the pin does not have changes no record, so both cases are one ensemble."""
    text = HEAD.replace("[50.0, 100.0]", "[50.0, 100.0]\nconstants = {pin = 'flat_punch', half_width = 0.25}") + UNTIL
    kinds = [task.kind for task in planned(text).tasks]
    assert (kinds.count("record"), kinds.count("ensemble")) == (16, 2)


def test_refused_cases_ask_nothing() -> None:
    """One of the four is: five rows are too many at n_x = 9."""
    text = PARTLY_REFUSED.split("[limits]")[0].replace("[0.25, 0.5]", "[0.5]").replace("[50.0, 100.0]", "[50.0]")
    plan = planned(text.replace('"dynamics"', "").replace(", ]", "]") + UNTIL)
    asking = [case for case in plan.cases[::16] if case.case is not None]
    assert (len(plan.cases), len(asking)) == (4 * 16, 3)
    assert [task.kind for task in plan.tasks].count("ensemble") == 2 * len(asking)


def test_the_cost_of_waiting_tasks_is_that_of_any_other() -> None:
    """What is planned by time, as limits and the longest chain are, counts them as if they were needed."""

    def costs(batch: int) -> list[float]:
        return sorted(task.cost for task in tasks if task.kind == "record" and task.batch == batch)

    tasks: tuple[Task, ...] = planned(HEAD + UNTIL).tasks
    assert costs(1) == costs(0)
    assert min(costs(2)) > 0.0


def test_a_record_that_waits_maps_the_compliance_as_any_other() -> None:
    """What it needs beside the compliance is an answer, and neither its memory nor its cost is another's."""
    tasks = planned(HEAD + UNTIL).tasks
    first, later = (next(task for task in tasks if task.kind == "record" and task.batch == batch) for batch in (0, 2))
    assert need_of(first) == need_of(replace(later, memory=first.memory))
    assert later.memory == pytest.approx(first.memory, rel=0.5)


@pytest.mark.parametrize("text", [ALL, BARE], ids=["all outputs", "scalars alone"])
@pytest.mark.parametrize("observable", ["static_friction", "kinetic_friction"])
def test_who_is_asked_for_friction_of_drives_needs_the_drives_before(text: str, observable: str) -> None:
    plan = planned(text.replace("0.01\n", f'0.01\nobservable = "{observable}"\n'))
    for records, drives in zip(members(plan, "record"), members(plan, "drive", "a"), strict=True):
        for number, key in enumerate(records):
            before = 0 if number < 4 else 4 if number < 8 else 8
            assert {place for place, each in enumerate(drives) if each in upstream(plan, key)} == set(range(before))
    tasks = {task.key: task for task in plan.tasks}
    assert all(tasks[need].shared for task in plan.tasks if task.kind == "ensemble" for need in task.needs)
