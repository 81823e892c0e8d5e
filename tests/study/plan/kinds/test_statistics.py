"""Statistics are read off a record that is there already, and only where a campaign asks for them."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nanoslip.solver.ensemble import Ensemble
from nanoslip.solver.outcome import Ending
from nanoslip.solver.sliding.sizes import event_distributions
from nanoslip.study.manifest.checker import ManifestError
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.kinds import compliance_task, record_task, statistics_task
from nanoslip.study.plan.plan import Plan, make_plan
from nanoslip.study.run.compute import records_in, run_task
from tests.study.plan.running import CASE, first, run, slid


def planned(folder: Path, lines: str) -> Plan:
    path = folder / "campaign.toml"
    path.write_text(f'title = "x"\n{lines}\nnumerics.n_x = 17\nlimits.events = 50\n')
    return make_plan(load_manifest(path))


@pytest.mark.parametrize("members", [1, 3])
def test_the_numbers_are_those_of_all_members_together(members: int) -> None:
    ensemble = Ensemble(members)
    compliance, record = compliance_task(CASE.slab), record_task(CASE, ensemble)
    result = run(compliance, record, statistics_task(CASE, ensemble))
    records = records_in(run(compliance, record))
    expected, bins = event_distributions(records)
    assert result.outcome.ok
    assert len(records) == members
    assert all(len(values) == 1 for values in result.scalars.values())
    names = ("slips_exponent", "slips_exponent_uncertainty", "slips_exponent_members", "drop_step_correlation")
    np.testing.assert_array_equal([first(result)[name] for name in names], [getattr(expected, name) for name in names])
    assert first(result)["sized_events"] == expected.sized_events > 50 * members
    np.testing.assert_array_equal(result.arrays["bin_density"], bins.bin_density)


def test_a_short_record_has_none_and_a_failed_one_says_why() -> None:
    short = replace(CASE, max_events=5)
    result = run(compliance_task(short.slab), record_task(short), statistics_task(short))
    assert result.outcome.ok
    assert math.isnan(first(result)["slips_exponent"])
    assert math.isnan(first(result)["slips_preferred"])
    failed = replace(slid(short), outcome=replace(result.outcome, ending=Ending.CONTACT_LOST))
    task = statistics_task(short)
    assert run_task(task, {task.needs[0]: failed}).outcome.ending is Ending.NEEDS_FAILED


@pytest.mark.parametrize("kept", ["true", "false"])
def test_they_need_the_whole_record_whether_it_is_kept_or_not(tmp_path: Path, kept: str) -> None:
    plan = planned(tmp_path, f"outputs.statistics = true\noutputs.records = {kept}")
    tasks = {task.key: task for task in plan.tasks}
    (mine,) = (task for task in plan.tasks if task.kind == "statistics")
    record = tasks[mine.needs[0]]
    assert not record.scalars_only
    assert record.intermediate == (kept == "false")
    assert all(task.kind != "statistics" for task in planned(tmp_path, "").tasks)


def test_without_events_there_is_nothing_to_count(tmp_path: Path) -> None:
    with pytest.raises(ManifestError, match=r'outputs.statistics = true: needs stage "slip"'):
        planned(tmp_path, 'stages = ["contact"]\noutputs.statistics = true')
