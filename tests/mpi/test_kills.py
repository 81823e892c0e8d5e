"""A run that is killed, whatever is hit by whatever signal, goes on to the same dataset and computes nothing twice."""

import pytest

from tests.mpi import kills
from tests.study.results.results import until_written

pytestmark = [pytest.mark.mpi, pytest.mark.slow]
NUMBERS = (0, 1, 5, 8, 12, 15, 16)
"""Of trials: each target, each signal."""
RACES = (4, 16)
"""Of trials: SIGKILL to the rank that holds the lease, and to all."""


@pytest.fixture(scope="module")
def campaigns(tmp_path_factory):
    """What each campaign comes to without a kill."""
    return kills.undisturbed(tmp_path_factory.mktemp("undisturbed"))


def test_whatever_is_to_be_killed_is_found_while_a_run_computes(campaigns, tmp_path):
    """Else nothing is killed, and all that must hold then holds."""
    out = tmp_path / "out"
    running = kills.start(campaigns[0].campaign, out, 2, tmp_path / "said")
    until_written(out, 1, running)
    found = {target: kills.meant(target, str(out), running.pid) for target in kills.TARGETS}
    kills.killed(str(out))
    running.wait(kills.PATIENCE)
    assert [target for target, processes in found.items() if not processes] == []


@pytest.mark.parametrize(
    "number", NUMBERS, ids=[f"{what} {sent.name}" for what, sent in map(kills.KINDS.__getitem__, NUMBERS)]
)
def test_a_run_that_is_killed_goes_on_to_the_same_dataset(campaigns, tmp_path, number):
    assert kills.run(number, 2, campaigns, tmp_path).broken == []


@pytest.mark.parametrize("number", RACES, ids=[kills.KINDS[number][0] for number in RACES])
def test_of_two_launches_that_race_one_computes_whatever_is_killed(campaigns, tmp_path, number):
    assert kills.race(number, 2, campaigns, tmp_path).broken == []
