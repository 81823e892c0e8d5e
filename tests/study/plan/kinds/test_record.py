"""The result of a record is the solver's record, with what is read off it; without a plateau it is a record all the same."""

from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.outcome import Ending
from nanoslip.solver.sliding.slide import slide
from nanoslip.study.plan.kinds import compliance_task, record_scalars_task, record_task, states_task
from nanoslip.study.run.compute import run_task
from tests.study.plan.running import CASE, first, run, slid


def test_a_friction_result_holds_the_whole_record() -> None:
    record = slide(CASE, surface_compliance(CASE.slab))
    result = slid(CASE)
    for name in ("displacement", "force_before", "force_after", "kind", "slips"):
        np.testing.assert_array_equal(result.arrays[name], getattr(record, name))
    scalars = first(result)
    assert scalars["events"] == 300 == scalars["slips"] + scalars["releases"] + scalars["touches"]
    assert scalars["mean_step"] == pytest.approx(record.displacement[-1] / 300, rel=1e-15)
    assert scalars["surface_stiffness"] == record.initial_stiffness
    assert scalars["peak_friction"] == record.force_before.max() / CASE.normal_load
    assert scalars["plateau_start"] < scalars["plateau_end"] <= scalars["final_displacement"]
    assert scalars["cascade_slips"] == record.slips.sum() > scalars["slips"]
    assert 0.0 < scalars["plateau_mean"] < scalars["peak_friction"] < CASE.intrinsic_friction


def test_a_record_without_a_plateau_says_so_and_is_kept() -> None:
    """Its outcome can be filtered; its numbers, but for the plateau's, are as good as any record's."""
    result = slid(replace(CASE, max_events=5))
    assert result.outcome.ending is Ending.NO_PLATEAU
    assert "raise limits.events" in result.outcome.message
    missing = {name for name, number in first(result).items() if np.isnan(number)}
    of_plateau = {name for name in first(result) if name.startswith("plateau_") and not name.endswith("_event")}
    assert missing == of_plateau
    assert first(result)["events"] == len(result.arrays["displacement"]) == 5


def test_a_record_without_a_plateau_stands_in_the_way_of_drives_alone() -> None:
    short = replace(CASE, max_events=5)
    record = slid(short)
    scalars = record_scalars_task(record_task(short))
    copied = run_task(scalars, {scalars.needs[0]: record})
    assert (copied.outcome, copied.scalars) == (record.outcome, record.scalars)
    assert run(compliance_task(short.slab), states_task(short, (5,), False)).outcome.ok
