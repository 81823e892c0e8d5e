"""A run that is killed, whatever is hit by whatever signal, goes on to the same dataset and computes nothing twice."""

import pytest

from tests.mpi import kills

pytestmark = [pytest.mark.mpi, pytest.mark.slow]
NUMBERS = (0, 5, 8, 12, 15, 16)
"""Of trials: each target, each signal."""
RACES = (0, 4, 8, 16)
"""Of trials: SIGKILL to each target but a child, whose run goes on."""


@pytest.fixture(scope="module")
def campaigns(tmp_path_factory):
    """What each campaign comes to without a kill."""
    return kills.undisturbed(tmp_path_factory.mktemp("undisturbed"))


@pytest.mark.parametrize(
    "number", NUMBERS, ids=[f"{what} {sent.name}" for what, sent in map(kills.KINDS.__getitem__, NUMBERS)]
)
def test_a_run_that_is_killed_goes_on_to_the_same_dataset(campaigns, tmp_path, number):
    found = kills.run(number, 2, campaigns, tmp_path)
    assert found.broken == []
    assert found.killed or found.target != "a child"  # of any other the run may have ended before


@pytest.mark.parametrize("number", RACES, ids=[kills.KINDS[number][0] for number in RACES])
def test_of_two_launches_that_race_one_computes_whatever_is_killed(campaigns, tmp_path, number):
    assert kills.race(number, 2, campaigns, tmp_path).broken == []
