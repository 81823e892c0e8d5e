"""The farm and whole campaigns over ranks give what one process gives."""

import signal
import subprocess
import sys
import time

import pytest

from tests.conftest import SMALL, launcher, polite_signal
from tests.study.results.results import OTHER_NUMPY, REMEMBERING, as_clients

# Ranks share the tasks; a defect, a signal or the death of one of them never leaves the others waiting.

pytestmark = pytest.mark.mpi
WAYS = [(ranks, what) for what in ("plain", "chain") for ranks in (0, 1, 2, 4)]
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


@pytest.mark.slow
@pytest.mark.parametrize(("ranks", "what"), WAYS)
def test_every_task_is_computed_once_after_its_needs(start, ranks, what):
    code, said, errors = ended(start(what, ranks))
    assert (code, said) == (0, "100 done, 0 crashed, 100 reported\n"), errors


@pytest.mark.slow
def test_no_rank_only_waits(start):
    """Tasks that sleep stand for tasks that compute, so that the law holds on a busy machine too."""
    _, said, errors = ended(start("pace"))
    # 40 tasks of 50 ms are 1.0 s on two ranks at work, 2.0 s on one while the other waits; 1.02 s seen.
    assert 1.0 <= float(said.splitlines()[0]) < 1.5, errors


@pytest.mark.slow
def test_a_defect_on_a_rank_is_told_and_the_campaign_goes_on(start):
    code, said, errors = ended(start("crash"))
    assert (code, said) == (1, "98 done, 2 crashed, 100 reported\n")
    assert errors.count("ZeroDivisionError: a defect") == 2
    assert "task 7 crashed" in errors


@pytest.mark.parametrize("ranks", [pytest.param(0, marks=pytest.mark.slow), 2])
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


@pytest.mark.slow
def test_a_task_that_ends_after_the_grace_but_before_its_process_keeps_code_99(start):
    """MPI is finalized by then, and there is nothing left to abort."""
    running = start("late", 2)
    assert running.stdout.readline() == "started\n"
    running.send_signal(polite_signal())
    code, _, errors = ended(running)
    assert code == 99, errors


@pytest.mark.slow
def test_a_signal_between_the_start_of_mpi_and_that_of_the_farm_ends_all_ranks_with_code_99(start):
    """Ctrl-C in the first second; that it reaches one rank only is the worst case."""
    code, _, errors = ended(start("early"))
    assert code == 99, errors
    assert "Traceback" not in errors


@pytest.mark.slow
def test_ranks_that_are_stuck_are_left_after_the_grace_with_code_99(start):
    running = start("stuck")
    running.stdout.readline()
    begun = time.perf_counter()
    running.send_signal(polite_signal())
    code, _, errors = ended(running)
    assert time.perf_counter() - begun < 10.0  # the grace is 1 s, the tasks take 60 s
    assert code == 99
    assert "run again" in errors


@pytest.mark.slow
def test_the_word_to_leave_arrives_behind_messages_that_nobody_has_read_yet(start):
    """Rank 0 must not end MPI while they are on their way: what is not sent by then never is."""
    code, _, errors = ended(start("crowd"))
    assert code == 0, errors


@pytest.mark.slow
@pytest.mark.parametrize(
    ("what", "told"), [("broken", ["rank 1 on ", "RuntimeError: this rank is broken"]), ("fatal", [])]
)
def test_the_end_of_a_rank_is_the_end_of_all(start, what, told):
    code, _, errors = ended(start(what))
    assert code not in (0, 99)
    assert all(words in errors for words in told)


# A campaign's dataset is the same, byte for byte, on any number of ranks, in one go or in several.


def dataset(nanoslip, campaign, out, ranks, **changes):
    """What so many ranks make of a campaign; none: one process without a launcher."""
    done = nanoslip("run", campaign, "--out", out, ranks=ranks, **changes)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("dataset:") == 1
    return (out / "results.nc").read_bytes()


@pytest.fixture(scope="module")
def alone(nanoslip, tmp_path_factory):
    """The dataset of the small campaign, computed by one process without a launcher."""
    folder = tmp_path_factory.mktemp("alone")
    (folder / "small.toml").write_text(SMALL)
    return dataset(nanoslip, folder / "small.toml", folder / "out", 0)


@pytest.mark.slow
@pytest.mark.parametrize("ranks", [1, 4])
def test_any_number_of_ranks_gives_the_same_dataset(nanoslip, campaign, tmp_path, alone, ranks):
    assert dataset(nanoslip, campaign, tmp_path / "out", ranks) == alone


@pytest.mark.slow
def test_what_ranks_keep_until_their_logs_are_closed_is_in_the_dataset(nanoslip, campaign, alone, tmp_path):
    """Ranks on several nodes are several clients of a file system."""
    assert dataset(nanoslip, campaign, tmp_path / "out", 2, PYTHONPATH=as_clients(tmp_path)) == alone


@pytest.mark.parametrize(
    ("n_x", "option", "said"),
    [(18, "--retry", "n_x = 18"), pytest.param(17, "--nonsense", "No such option", marks=pytest.mark.slow)],
)
def test_wrong_input_is_said_once_by_all_ranks_together(nanoslip, campaign, n_x, option, said):
    campaign.write_text(SMALL.replace("n_x = 17", f"n_x = {n_x}"))
    done = nanoslip("run", campaign, option, ranks=2)
    assert (done.returncode, done.stderr.count(said)) == (2, 1)
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_ranks_on_nodes_that_remember_what_is_not_there_share_a_new_folder(nanoslip, campaign, alone, tmp_path):
    """None looks for the folder before rank 0 has made it: else it would find no result for half a minute."""
    changes = {"PYTHONPATH": as_clients(tmp_path, REMEMBERING)}
    assert dataset(nanoslip, campaign, tmp_path / "out", 3, **changes) == alone
    assert list((tmp_path / "memory").iterdir())  # of what rank 0 has looked for


@pytest.mark.slow
def test_a_rank_with_other_software_computes_nothing_and_the_run_ends_with_code_2(nanoslip, campaign, tmp_path):
    path = as_clients(tmp_path, OTHER_NUMPY)
    done = nanoslip("run", campaign, "--out", tmp_path / "out", ranks=3, PYTHONPATH=path)
    assert (done.returncode, " ".join(done.stderr.split()).count("numpy 1.0.0 instead of ")) == (2, 1), done.stderr
    assert nanoslip("run", campaign, "--out", tmp_path / "out", ranks=1).returncode == 0


@pytest.mark.slow
def test_an_ensemble_is_the_same_on_two_ranks(nanoslip, campaign, tmp_path):
    """Until its target is reached, too: members that a drive slides beyond those of its record."""
    target = "target.within = 0.02\ntarget.of = ['kinetic_friction']\ntarget.most = 6"
    campaign.write_text(SMALL.replace("ensemble.members = 1", target))
    one, other = (dataset(nanoslip, campaign, tmp_path / f"out{ranks}", ranks) for ranks in (0, 2))
    assert one == other
    assert b"plateau_mean_uncertainty" in one


# Ranks of a user's own program share a campaign by `nanoslip.run(..., comm=)`, and the program goes on.


@pytest.mark.slow
def test_ranks_of_a_program_share_campaigns_and_go_on_whatever_comes_of_them(environment, alone, tmp_path):
    """One that completes, one with a task that kills its process, a wrong one, and one whose folder is a file."""
    deadly = 'title = "x"\nstages = ["contact"]\naxes.normal_load = [1e-3, 2e-3, 3e-3]\nnumerics.n_x = 17\n'
    texts = {"small": SMALL, "deadly": deadly, "wrong": SMALL.replace("[50.0", "[-50.0"), "again": SMALL}
    for name, text in texts.items():
        (tmp_path / f"{name}.toml").write_text(text)
    (tmp_path / "3").touch()
    words = [*launcher(3), sys.executable, "-m", "tests.mpi.own_program", str(tmp_path)]
    words += [f"{tmp_path / name}.toml" for name in texts]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 0, done.stderr
    root, idle, other = done.stdout.splitlines()
    assert root == "{'completed': 4}, {'completed': 2, 'crashed': 1}, ManifestError, StoreError, my own message"
    assert other == "None, None, ManifestError, StoreError, my own message"
    assert not idle
    assert (tmp_path / "0" / "results.nc").read_bytes() == alone
    assert '"processes": 2, "unit": "ranks"' in (tmp_path / "0" / "runs.jsonl").read_text()
