"""Two datasets side by side: whatever differs is named with its case, and by how much it may differ depends on its path."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import netCDF4
import numpy as np
import pytest

from nanoslip.study.dataset.compare import Verdict
from nanoslip.study.plan.task import Task, TaskResult
from nanoslip.study.run.compute import run_task
from tests.study.dataset.verifying import DRIVEN, STEADY, Run, computed, once, verdicts, verified

CHANGES: dict[str, tuple[str, Any, float, list[int]]] = {
    "a scalar": ("surface_stiffness", (0, 1, 0, 0), 1e-6, [2]),
    "a count": ("events", (1, 1, 0, 0), 1, [4]),
    "an event's force": ("record/event_friction_after", 270, 1e-7, [2]),
    "the last event's force": ("record/event_friction_after", -1, 1e-7, [4]),
    "an event's node": ("record/event_node", 430, 1, [3]),
    "a trajectory's position": ("trajectory/sample_position", 41 * 7 + 3, 1e-9, [4]),
    "an axis": ("radius", 0, 1.0, [0]),
    "a constant": ("normal_load", (), 1e-6, [0]),
    "a drive's setting": ("stage_velocity", 0, 1e-6, [0]),
}


@pytest.mark.parametrize(("name", "place", "change", "rows"), CHANGES.values(), ids=CHANGES)
def test_a_changed_value_is_different_and_named_with_its_case(altered, tmp_path, name, place, change, rows):
    def alter(opened: netCDF4.Dataset) -> None:
        opened[name][place] = opened[name][place] + change

    findings = verified(altered(alter), tmp_path)
    assert [number for number, each in enumerate(findings) if each.verdict is Verdict.DIFFERENT] == rows
    assert name.rpartition("/")[2] in findings[rows[0]].remark


def test_changed_words_are_different_but_advice_is_within_tolerance(altered, tmp_path):
    def alter(opened: netCDF4.Dataset) -> None:
        opened["outcome"][0, 0, 0, 0] = "no_slip"
        opened["record/case_id"][1] = "ffffffffffff"
        opened["message"][1, 0, 0, 0] = "do it otherwise"
        opened["mean_step"].units = "m"
        opened.slab_width = 2e-3

    findings = verified(altered(alter), tmp_path)
    assert verdicts(findings) == [2, 2, 2, 1, 0]
    assert "units of mean_step" in findings[0].remark
    assert "attribute slab_width" in findings[0].remark
    assert "outcome: 'no_slip' kept, 'completed' recomputed" in findings[1].remark
    assert "case_id: 'ffffffffffff' kept" in findings[2].remark
    assert "message" in findings[3].remark


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("", "record_id: recomputed, but none kept"),
        ("ffffffffffff", "record_id: ffffffffffff is not in the group record"),
        (1, "case_id: "),
    ],
)
def test_a_record_that_is_not_the_cases_is_different(altered, tmp_path, name, said):
    """It is lost, in no group, or another case's."""

    def alter(opened: netCDF4.Dataset) -> None:
        opened["record_id"][0, 0, 0, 0] = opened["record/record"][name] if isinstance(name, int) else name

    findings = verified(altered(alter), tmp_path)
    assert verdicts(findings) == [0, 2, 0, 0, 0]
    assert said in findings[1].remark


def test_a_last_digit_is_within_tolerance_and_named(altered, tmp_path):
    def alter(opened: netCDF4.Dataset) -> None:
        at = (0, 1, 0, 0)
        opened["surface_stiffness"][at] = np.nextafter(opened["surface_stiffness"][at], 1.0)

    findings = verified(altered(alter), tmp_path)
    assert verdicts(findings) == [0, 0, 1, 0, 0]
    assert findings[2].remark.startswith("surface_stiffness by ")


def test_a_variable_that_is_missing_or_added_is_named(altered, tmp_path):
    def alter(opened: netCDF4.Dataset) -> None:
        opened.renameVariable("peak_friction", "greatest_friction")

    shared, *_ = verified(altered(alter), tmp_path)
    assert shared.verdict is Verdict.DIFFERENT
    assert "peak_friction: is missing" in shared.remark
    assert "greatest_friction" in shared.remark


def test_a_record_on_another_path_is_held_to_what_states_an_uncertainty(tmp_path):
    """A friction of 1e-5 more turns some decisions and moves no mean by much; a fifth more moves the contact, too."""

    def nudged(by: float) -> Run:
        def run(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
            if task.case is None:
                return run_task(task, inputs)
            case = replace(task.case, intrinsic_friction=task.case.intrinsic_friction * (1.0 + by))
            return run_task(replace(task, case=case), inputs)

        return run

    path = computed(tmp_path / "steady", STEADY)
    little = verified(path, tmp_path / "little", run=nudged(1e-5))
    assert verdicts(little) == [0, 1, 1]
    assert all("takes another path" in each.remark for each in little[1:])
    much = verified(path, tmp_path / "much", run=nudged(0.2))
    assert verdicts(much) == [0, 2, 2]
    assert "initial_slips" in much[1].remark  # which precedes sliding
    assert "contact_half_width" in much[2].remark  # friction pulls at its edges


def test_a_drive_may_take_another_path_only_where_last_digits_moved(tmp_path):
    """As on another processor: a step more, and the friction of one sample on the other side of a tooth; μ_k is held."""
    path = computed(tmp_path / "steady", DRIVEN)

    def touched(digits: float, kinetic: float = 1.0) -> Run:
        def run(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
            result = once(task, inputs)
            if task.kind == "compliance":
                return result
            scalars = {name: [value * (1.0 + digits) for value in each] for name, each in result.scalars.items()}
            arrays = {
                name: values * (1 + digits) if values.dtype == float else values
                for name, values in result.arrays.items()
            }
            if task.kind == "drive":
                scalars["steps"] = [steps + 1 for steps in result.scalars["steps"]]
                scalars["kinetic_friction"] = [kinetic * value for value in scalars["kinetic_friction"]]
                arrays["friction_force"] = arrays["friction_force"] * np.where(
                    np.arange(len(arrays["friction_force"])) == 30, 1.03, 1.0
                )
            return replace(result, scalars=scalars, arrays=arrays)

        return run

    moved = verified(path, tmp_path / "moved", run=touched(1e-13))
    assert verdicts(moved) == [0, 1]
    assert "a drive takes another path" in moved[1].remark
    wrong = verified(path, tmp_path / "wrong", run=touched(1e-13, kinetic=1.5))
    assert verdicts(wrong) == [0, 2]
    assert "kinetic_friction" in wrong[1].remark
    still = verified(path, tmp_path / "still", run=touched(0.0))
    assert verdicts(still) == [0, 2]
    assert "sample_friction" in still[1].remark
    assert "steps" in still[1].remark
