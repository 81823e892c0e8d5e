"""Each case finds its own tasks, however many cases there are."""

from collections.abc import Iterator

from nanoslip.solver.outcome import COMPLETED
from nanoslip.study.manifest.cases import CampaignCase, Labels
from nanoslip.study.plan.plan import TasksOfCases

KEYS: list[dict[tuple[str, str], str]] = [
    {("compliance", ""): "c", ("record", ""): "r0"},
    {},
    {("compliance", ""): "c", ("record", ""): "r2", ("drive", "a"): "d2", ("drive", "b"): "e2"},
    {("compliance", ""): "c", ("record", ""): "r0"},
]


def cases() -> Iterator[CampaignCase]:
    for number in range(len(KEYS)):
        yield CampaignCase(f"case {number}", Labels((), {}), (), None, COMPLETED)


def test_a_case_has_the_tasks_that_were_given_for_it() -> None:
    found = TasksOfCases()
    for case, keys in zip(cases(), KEYS, strict=True):
        found.add(case, keys)
    assert list(found) == [case.case_id for case in cases()]
    assert [found[case_id].keys for case_id in found] == KEYS
    assert [found[f"case {number}"].record for number in (2, 0, 1, 2)] == ["r2", "r0", None, "r2"]
    assert found["case 2"].drives == {"a": "d2", "b": "e2"}
    assert "case 9" not in found
    assert [(case.case_id, tasks.keys) for case, tasks in found.in_order()] == list(zip(found, KEYS, strict=True))
    assert all(found[case.case_id] is tasks for case, tasks in found.in_order())


def test_cases_with_the_same_kinds_of_tasks_are_found_together_in_their_order() -> None:
    several, one = TasksOfCases(), TasksOfCases()
    for case, keys in zip(cases(), KEYS, strict=True):
        several.add(case, keys)
        one.add(case, KEYS[0])
    assert list(several.alike()) == [
        (tuple(KEYS[0]), [0, 3], ["c", "r0", "c", "r0"]),
        ((), [1], []),
        (tuple(KEYS[2]), [2], ["c", "r2", "d2", "e2"]),
    ]
    assert list(one.alike()) == [(tuple(KEYS[0]), [0, 1, 2, 3], ["c", "r0"] * 4)]
    assert list(TasksOfCases().alike()) == []
