"""What the launcher's environment says is understood, and what it does not say is no limit."""

import math

import pytest

from nanoslip.study.run.launch import WARNING, end_of_time


@pytest.mark.parametrize(
    ("environment", "end"),
    [
        ({}, math.inf),
        ({"SLURM_JOB_END_TIME": "1700000000"}, 1700000000.0 - WARNING),
        ({"SLURM_JOB_END_TIME": ""}, math.inf),
        ({"SLURM_JOB_END_TIME": "Unknown"}, math.inf),
    ],
)
def test_a_job_says_when_it_ends(environment: dict[str, str], end: float) -> None:
    assert end_of_time(environment) == end
