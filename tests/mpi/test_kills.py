"""A run that is killed, whatever is hit by whatever signal, goes on to the same dataset and computes nothing twice."""

import os
import random

import pytest

from tests.mpi import kills
from tests.study.results.results import until_written

pytestmark = [pytest.mark.mpi, pytest.mark.slow]
SEED = int(os.environ.get("NANOSLIP_SCENE_SEED", "2"))
"""CI draws another one for every content of the sources: in time each target receives each signal, at any moment."""


def drawn_kinds(seed):
    """Numbers of trials: each target once, and among them each signal."""
    draw, signals = random.Random(seed), len(kills.SIGNALS)
    order = draw.sample(range(signals), signals)
    return [target * signals + order[target % signals] for target in range(len(kills.TARGETS))]


NUMBERS = drawn_kinds(SEED)
RACES = (4, 16)
"""Of trials: SIGKILL to the rank that holds the lease, and to all."""


def test_in_time_each_target_receives_each_signal():
    drawn = [drawn_kinds(seed) for seed in range(100)]
    for numbers in drawn:
        kinds = [kills.KINDS[number] for number in numbers]
        assert {target for target, _ in kinds} == set(kills.TARGETS)
        assert {sent for _, sent in kinds} == set(kills.SIGNALS)
    assert set().union(*drawn) == set(range(len(kills.KINDS)))


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


@pytest.mark.parametrize("number", NUMBERS, ids=kills.TARGETS)
def test_a_run_that_is_killed_goes_on_to_the_same_dataset(campaigns, tmp_path, number):
    trial = kills.run(number, SEED, campaigns, tmp_path)
    assert trial.broken == [], f"NANOSLIP_SCENE_SEED={SEED}: {trial}"


@pytest.mark.parametrize("number", RACES, ids=[kills.KINDS[number][0] for number in RACES])
def test_of_two_launches_that_race_one_computes_whatever_is_killed(campaigns, tmp_path, number):
    trial = kills.race(number, SEED, campaigns, tmp_path)
    assert trial.broken == [], f"NANOSLIP_SCENE_SEED={SEED}: {trial}"
