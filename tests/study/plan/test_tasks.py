"""A task is named by what decides its result, and its result is the solver's, refusals included."""

import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from nanoslip.solver.case import SlipRule
from nanoslip.solver.outcome import Ending
from nanoslip.study.plan.kinds import drive_task
from tests.study.plan.running import CASE, DRIVE, drive, slid


def test_tasks_and_results_travel_between_processes() -> None:
    task = drive_task(CASE, DRIVE)
    assert pickle.loads(pickle.dumps(task)) == task
    result = slid(CASE)
    copy = pickle.loads(pickle.dumps(result))
    assert (copy.key, copy.outcome) == (result.key, result.outcome)
    np.testing.assert_equal(copy.scalars, result.scalars)  # what is not known of so short a record is NaN in both
    np.testing.assert_array_equal(copy.arrays["displacement"], result.arrays["displacement"])


def test_a_rank_that_computes_imports_nothing_heavy() -> None:
    heavy = ("xarray", "matplotlib", "scipy.interpolate")
    command = f"import sys, nanoslip.study.run.compute; print([m for m in {heavy} if m in sys.modules])"
    root = Path(__file__).parents[3]
    done = subprocess.run([sys.executable, "-c", command], capture_output=True, text=True, check=True, cwd=root)
    assert done.stdout.strip() == "[]"


def test_what_needs_a_failed_result_fails_with_its_reason() -> None:
    """With one slip allowed per event a cascade is given up, and there is no record to drive over."""
    hasty = replace(CASE, slip_rule=SlipRule(cascade_limit=1))
    record = slid(hasty)
    result = drive(hasty)
    assert record.outcome.ending is Ending.CASCADE_LIMIT
    assert result.outcome.ending is Ending.NEEDS_FAILED
    assert result.outcome.message == f"its record ended as cascade_limit: {record.outcome.message}"
    assert not result.arrays
