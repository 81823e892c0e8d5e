"""A campaign's dataset is the same, byte for byte, on any number of ranks, in one go or in several."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from nanoslip.study.results.store import FOLDER
from tests.conftest import SMALL, launcher, longer, polite_signal
from tests.study.results.results import as_clients, until_written, written

pytestmark = pytest.mark.mpi

LONG = longer(radii=20, events=600)
"""A few seconds on two ranks."""


@pytest.fixture(scope="module")
def alone(nanoslip, tmp_path_factory) -> bytes:
    """The dataset of the small campaign, computed by one process without a launcher."""
    folder = tmp_path_factory.mktemp("alone")
    (folder / "small.toml").write_text(SMALL)
    done = nanoslip("run", folder / "small.toml", "--out", folder / "out")
    assert done.returncode == 0, done.stderr
    return (folder / "out" / "results.nc").read_bytes()


@pytest.mark.parametrize("ranks", [2, *(pytest.param(ranks, marks=pytest.mark.slow) for ranks in (1, 4))])
def test_any_number_of_ranks_gives_the_same_dataset(nanoslip, campaign, alone, ranks):
    out = campaign.parent / "out"
    done = nanoslip("run", campaign, "--out", out, ranks=ranks)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("dataset:") == 1
    assert (out / "results.nc").read_bytes() == alone


def test_what_ranks_keep_until_their_logs_are_closed_is_in_the_dataset(nanoslip, campaign, alone, tmp_path):
    """Ranks on several nodes are several clients of a file system."""
    out = campaign.parent / "out"
    done = nanoslip("run", campaign, "--out", out, ranks=2, PYTHONPATH=as_clients(tmp_path))
    assert done.returncode == 0, done.stderr
    assert (out / "results.nc").read_bytes() == alone


@pytest.mark.slow
def test_a_run_that_goes_on_gives_the_same_dataset(nanoslip, campaign, alone):
    out = campaign.parent / "out"
    assert nanoslip("run", campaign, "--out", out, ranks=2).returncode == 0
    first, *_, last = sorted((out / FOLDER).glob("*.log"))
    first.unlink()
    last.write_bytes(last.read_bytes()[:-100])
    done = nanoslip("run", campaign, "--out", out, ranks=4)
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("will be computed again") == 1
    assert (out / "results.nc").read_bytes() == alone


def test_wrong_input_is_said_once_by_all_ranks_together(nanoslip, campaign):
    campaign.write_text(SMALL.replace("n_x = 17", "n_x = 18"))
    done = nanoslip("run", campaign, "--out", campaign.parent / "out", ranks=4)
    assert done.returncode == 2
    assert done.stderr.count("n_x = 18") == 1
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_a_wrong_option_is_said_once_by_all_ranks_together(nanoslip, campaign):
    done = nanoslip("run", campaign, "--nonsense", ranks=2)
    assert (done.returncode, done.stderr.count("No such option")) == (2, 1)


@pytest.fixture(scope="module")
def whole(nanoslip, tmp_path_factory) -> Path:
    """The folder of the long campaign, computed in one go."""
    folder = tmp_path_factory.mktemp("whole")
    (folder / "long.toml").write_text(LONG)
    assert nanoslip("run", folder / "long.toml", "--out", folder).returncode == 0
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("kill", [True, False], ids=["killed", "told to stop"])
def test_a_run_cut_short_goes_on_to_the_same_dataset(nanoslip, environment, whole, tmp_path, kill):
    campaign, cut = whole / "long.toml", tmp_path / "cut"
    words = [*launcher(2), sys.executable, "-m", "nanoslip", "run", str(campaign), "--out", str(cut)]
    running = subprocess.Popen(words, env=environment, stderr=subprocess.PIPE, text=True, start_new_session=True)
    until_written(cut, 5, running)
    if kill:
        os.killpg(running.pid, signal.SIGKILL)  # launcher and ranks at once
    else:
        running.send_signal(polite_signal())
    running.communicate(timeout=60)
    assert running.returncode == (-signal.SIGKILL if kill else 99)
    assert not (cut / "results.nc").exists()
    assert len(written(cut)) < len(written(whole))
    done = nanoslip("run", campaign, "--out", cut, ranks=2)
    assert done.returncode == 0, done.stderr
    assert (cut / "results.nc").read_bytes() == (whole / "results.nc").read_bytes()
    assert written(cut) == written(whole)  # finished tasks were not computed twice
    assert not list((cut / FOLDER).glob(".*"))  # nor are scratch files left


@pytest.mark.slow
def test_an_ensemble_is_the_same_on_two_ranks(nanoslip, campaign):
    """Until its target is reached, too: members that a drive slides beyond those of its record."""
    target = "target.within = 0.02\ntarget.of = ['kinetic_friction']\ntarget.most = 6"
    campaign.write_text(SMALL.replace("ensemble.members = 1", target))
    found = []
    for ranks in (0, 2):
        out = campaign.parent / f"out{ranks}"
        done = nanoslip("run", campaign, "--out", out, ranks=ranks)
        assert done.returncode == 0, done.stderr
        found.append((out / "results.nc").read_bytes())
    assert found[0] == found[1]
    assert b"plateau_mean_uncertainty" in found[0]
