"""Ranks share the tasks; a defect, a signal or the death of one of them never leaves the others waiting."""

import signal
import subprocess
import sys
import time

import pytest

from tests.conftest import launcher, polite_signal

pytestmark = pytest.mark.mpi
PROGRAM = "tests.mpi.farm_program"
REST = [(0, "plain"), (1, "plain"), (4, "plain"), (0, "chain"), (1, "chain"), (2, "chain")]
PATIENCE = 60.0
"""Seconds after which a run is taken to hang; each takes about one."""


def start(what: str, ranks: int, environment: dict[str, str], *interpreter: str) -> "subprocess.Popen[str]":
    words = [*launcher(ranks), sys.executable, *interpreter, "-m", PROGRAM, what]
    return subprocess.Popen(words, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.mark.parametrize(
    ("ranks", "what"), [(2, "plain"), *(pytest.param(*rest, marks=pytest.mark.slow) for rest in ((4, "chain"), *REST))]
)
def test_every_task_is_computed_once_after_its_needs(environment, ranks, what):
    running = start(what, ranks, environment)
    said, errors = running.communicate(timeout=PATIENCE)
    assert (running.returncode, said) == (0, "100 done, 0 crashed, 100 reported\n"), errors


def test_no_rank_only_waits(environment):
    """Tasks that sleep stand for tasks that compute, so that the law holds on a busy machine too."""
    running = start("pace", 2, environment)
    said, errors = running.communicate(timeout=PATIENCE)
    seconds = float(said.splitlines()[0])
    # 40 tasks of 50 ms are 1.0 s on two ranks at work, 2.0 s on one while the other waits; 1.02 s seen.
    assert 1.0 <= seconds < 1.5, errors


def test_a_defect_on_a_rank_is_told_and_the_campaign_goes_on(environment):
    running = start("crash", 2, environment)
    said, errors = running.communicate(timeout=PATIENCE)
    assert (running.returncode, said) == (1, "98 done, 2 crashed, 100 reported\n")
    assert errors.count("ZeroDivisionError: a defect") == 2
    assert "task 7 crashed" in errors


@pytest.mark.parametrize("ranks", [0, 2])
@pytest.mark.parametrize(
    "interpreter", [(), pytest.param(("-m", "mpi4py"), marks=pytest.mark.slow)], ids=["python", "mpi4py"]
)
def test_a_signal_ends_all_ranks_after_their_task_with_code_99(environment, ranks, interpreter):
    running = start("stop", ranks, environment, *interpreter)
    assert running.stdout is not None
    assert running.stdout.readline() == "started\n"
    running.send_signal(polite_signal() if ranks else signal.SIGTERM)
    said, errors = running.communicate(timeout=PATIENCE)
    assert running.returncode == 99, errors
    done = int(said.split(" done")[0])
    assert 1 <= done <= 8


def test_a_signal_between_the_start_of_mpi_and_that_of_the_farm_ends_all_ranks_with_code_99(environment):
    """Ctrl-C in the first second; that it reaches one rank only is the worst case."""
    running = start("early", 2, environment)
    try:
        _, errors = running.communicate(timeout=PATIENCE / 3)
    except subprocess.TimeoutExpired:
        running.kill()
        raise
    assert running.returncode == 99, errors
    assert "Traceback" not in errors


def test_ranks_that_are_stuck_are_left_after_the_grace_with_code_99(environment):
    running = start("stuck", 2, environment)
    assert running.stdout is not None
    running.stdout.readline()
    begun = time.perf_counter()
    running.send_signal(polite_signal())
    _, errors = running.communicate(timeout=PATIENCE)
    assert time.perf_counter() - begun < 10.0  # the grace is 1 s, the tasks take 60 s
    assert running.returncode == 99
    assert "run again to continue" in errors


def test_the_word_to_leave_arrives_behind_messages_that_nobody_has_read_yet(environment):
    """Rank 0 must not end MPI while they are on their way: what is not sent by then never is."""
    running = start("crowd", 2, environment)
    try:
        _, errors = running.communicate(timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        running.kill()
        raise
    assert running.returncode == 0, errors


@pytest.mark.parametrize("what", ["broken", "fatal"])
def test_the_end_of_a_rank_is_the_end_of_all(environment, what):
    running = start(what, 2, environment)
    _, errors = running.communicate(timeout=PATIENCE)
    assert running.returncode not in (0, 99)
    if what == "broken":
        assert "rank 1 on " in errors
        assert "RuntimeError: this rank is broken" in errors
