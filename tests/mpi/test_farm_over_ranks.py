"""Ranks share the tasks; a defect, a signal or the death of one of them never leaves the others waiting."""

import signal
import subprocess
import sys
import time

import pytest

from tests.conftest import launcher, polite_signal

pytestmark = pytest.mark.mpi
REST = [(4, "chain"), *((ranks, "plain") for ranks in (0, 1, 4)), *((ranks, "chain") for ranks in (0, 1, 2))]
PATIENCE = 60.0
"""Seconds after which a run is taken to hang; each takes about one."""


@pytest.fixture
def start(environment):
    """Begin a run of made-up tasks."""

    def started(what, ranks=2, interpreter=()):
        words = [*launcher(ranks), sys.executable, *interpreter, "-m", "tests.mpi.farm_program", what]
        return subprocess.Popen(words, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    return started


def ended(running):
    """How a run has ended, and what it has said since it was last heard."""
    try:
        said, errors = running.communicate(timeout=PATIENCE)
    finally:
        running.kill()
    return running.returncode, said, errors


@pytest.mark.parametrize(
    ("ranks", "what"), [(2, "plain"), *(pytest.param(*each, marks=pytest.mark.slow) for each in REST)]
)
def test_every_task_is_computed_once_after_its_needs(start, ranks, what):
    code, said, errors = ended(start(what, ranks))
    assert (code, said) == (0, "100 done, 0 crashed, 100 reported\n"), errors


def test_no_rank_only_waits(start):
    """Tasks that sleep stand for tasks that compute, so that the law holds on a busy machine too."""
    _, said, errors = ended(start("pace"))
    # 40 tasks of 50 ms are 1.0 s on two ranks at work, 2.0 s on one while the other waits; 1.02 s seen.
    assert 1.0 <= float(said.splitlines()[0]) < 1.5, errors


def test_a_defect_on_a_rank_is_told_and_the_campaign_goes_on(start):
    code, said, errors = ended(start("crash"))
    assert (code, said) == (1, "98 done, 2 crashed, 100 reported\n")
    assert errors.count("ZeroDivisionError: a defect") == 2
    assert "task 7 crashed" in errors


@pytest.mark.parametrize("ranks", [0, 2])
@pytest.mark.parametrize(
    "interpreter", [(), pytest.param(("-m", "mpi4py"), marks=pytest.mark.slow)], ids=["python", "mpi4py"]
)
def test_a_signal_ends_all_ranks_after_their_task_with_code_99(start, ranks, interpreter):
    running = start("stop", ranks, interpreter)
    assert running.stdout.readline() == "started\n"
    running.send_signal(polite_signal() if ranks else signal.SIGTERM)
    code, said, errors = ended(running)
    assert code == 99, errors
    assert 1 <= int(said.split(" done")[0]) <= 8


def test_a_signal_between_the_start_of_mpi_and_that_of_the_farm_ends_all_ranks_with_code_99(start):
    """Ctrl-C in the first second; that it reaches one rank only is the worst case."""
    code, _, errors = ended(start("early"))
    assert code == 99, errors
    assert "Traceback" not in errors


def test_ranks_that_are_stuck_are_left_after_the_grace_with_code_99(start):
    running = start("stuck")
    running.stdout.readline()
    begun = time.perf_counter()
    running.send_signal(polite_signal())
    code, _, errors = ended(running)
    assert time.perf_counter() - begun < 10.0  # the grace is 1 s, the tasks take 60 s
    assert code == 99
    assert "run again to continue" in errors


def test_the_word_to_leave_arrives_behind_messages_that_nobody_has_read_yet(start):
    """Rank 0 must not end MPI while they are on their way: what is not sent by then never is."""
    code, _, errors = ended(start("crowd"))
    assert code == 0, errors


@pytest.mark.parametrize(
    ("what", "told"), [("broken", ["rank 1 on ", "RuntimeError: this rank is broken"]), ("fatal", [])]
)
def test_the_end_of_a_rank_is_the_end_of_all(start, what, told):
    code, _, errors = ended(start(what))
    assert code not in (0, 99)
    assert all(words in errors for words in told)
