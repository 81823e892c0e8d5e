"""A run that is killed, whatever is hit by whatever signal, goes on to the same dataset and computes nothing twice."""

import pytest

from tests.mpi.kills import trial
from tests.mpi.kills.campaigns import CAMPAIGNS
from tests.mpi.kills.running import Undisturbed, undisturbed

pytestmark = [pytest.mark.mpi, pytest.mark.slow]
NUMBERS = (0, 5, 8, 12, 15, 16)
"""Of trials: each target, each signal."""
RACES = (0, 4, 8, 16)
"""Of trials: SIGKILL to each target but a child, whose run goes on."""


@pytest.fixture(scope="module")
def campaigns(tmp_path_factory: pytest.TempPathFactory) -> list[Undisturbed]:
    """What each campaign comes to without a kill."""
    folder = tmp_path_factory.mktemp("undisturbed")
    return [undisturbed(name, text, folder) for name, text in CAMPAIGNS.items()]


@pytest.mark.parametrize(
    "number", NUMBERS, ids=[f"{what} {sent.name}" for what, sent in map(trial.KINDS.__getitem__, NUMBERS)]
)
def test_a_run_that_is_killed_goes_on_to_the_same_dataset(campaigns, tmp_path, number):
    assert trial.run(number, 2, campaigns, tmp_path).broken == []


@pytest.mark.parametrize("number", RACES, ids=[trial.KINDS[number][0] for number in RACES])
def test_of_two_launches_that_race_one_computes_whatever_is_killed(campaigns, tmp_path, number):
    assert trial.race(number, 2, campaigns, tmp_path).broken == []
