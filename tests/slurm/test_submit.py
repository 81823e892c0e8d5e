"""A real scheduler takes the script, runs the campaign on two nodes, and goes on where a job was cut short."""

import os
import re
import shutil
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from nanoslip.study.results import attempts as runs
from nanoslip.study.results.files import Shard
from nanoslip.study.results.store import Store
from tests.conftest import ROOT, SMALL, launcher, longer
from tests.study.results.results import written

pytestmark = [pytest.mark.slurm, pytest.mark.slow]


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """The repository's settings for two ranks on two nodes, with this Python and its MPI."""
    launcher(1)  # skips without an MPI of our own
    shutil.copy(ROOT / "slurm" / "job.sh.j2", tmp_path)
    path = tmp_path / "site.toml"
    path.write_text(
        f"""
        nodes = 2
        tasks = 2
        time = "5"
        command = "{sys.executable} -m nanoslip"
        setup = ["export PYTHONPATH={ROOT} PATH={Path(sys.executable).parent}:$PATH"]
        """
    )
    return path


def submitted_jobs(slurm, campaign: Path, site: Path, *options: object) -> tuple[list[str], Path]:
    """Hand a campaign to sbatch as a user would; the number of each job and the folder of results."""
    out = campaign.parent / "out"
    nanoslip = ("env", f"PYTHONPATH={ROOT}", sys.executable, "-m", "nanoslip")
    said = slurm(*nanoslip, "submit", campaign, "--out", out, "--site", site, "--submit", *options)
    return re.findall(r"Submitted batch job (\d+)", said), out


@pytest.fixture
def long(site: Path) -> Path:
    """A campaign that takes some ten seconds on two ranks."""
    path = site.with_name("long.toml")
    path.write_text(longer(radii=20, events=600))
    return path


@pytest.fixture
def at_work(slurm, long: Path, site: Path) -> tuple[str, Path]:
    """A job whose ranks are at the long campaign; its number and the folder of results, some of which are there."""
    (number,), out = submitted_jobs(slurm, long, site)
    while len(written(out)) < 3:
        assert slurm.job(number)["JobState"] in ("PENDING", "RUNNING", "COMPLETING")
        time.sleep(0.02)
    return number, out


def test_a_campaign_runs_to_its_end_on_two_nodes(slurm, site):
    campaign = (
        site.with_name("""50%x 'a"b' $(id) #; ü""") / "smoke %j.toml"
    )  # names that shell and sbatch could misread
    campaign.parent.mkdir()
    campaign.write_text((ROOT / "campaigns" / "smoke.toml").read_text())
    (number,), out = submitted_jobs(slurm, campaign, site)
    job = slurm.wait(number, "COMPLETED", "FAILED")
    log = (out / f"slurm-{number}.log").read_text()
    assert (job["JobState"], job["ExitCode"]) == ("COMPLETED", "0:0"), log
    assert "2 ranks" in log
    assert (out / "results.nc").is_file()


def test_a_job_told_to_stop_is_requeued_and_goes_on_to_the_end(slurm, long, at_work, nanoslip):
    number, out = at_work
    slurm("scancel", "--signal", signal.SIGTERM.name, number)  # to the ranks, as before the time limit
    job = slurm.wait(number, "COMPLETED", "FAILED")
    log = (out / f"slurm-{number}.log").read_text()
    assert (job["JobState"], int(job["Restarts"]) >= 1) == ("COMPLETED", True), log
    before, _, after = log.partition("interrupted: what is finished is kept")
    assert _tasks_left(after)[0] < _tasks_left(before)[-1]

    alone = long.with_name("alone")
    assert nanoslip("run", long, "--out", alone).returncode == 0
    assert (out / "results.nc").is_file()
    one, other = Store(alone), Store(out)  # who computed them is not the same: one of the two sees git
    assert one.finished() == other.finished()
    for key in one.finished():
        here, there = one.read(key), other.read(key)
        assert here.outcome == there.outcome
        np.testing.assert_equal(dict(here.scalars), dict(there.scalars))
        for name, array in here.arrays.items():
            np.testing.assert_array_equal(array, there.arrays[name])


def test_a_rank_that_is_killed_ends_the_step_soon_and_the_job_goes_on_in_another_start(slurm, at_work):
    number, out = at_work
    starts = int(slurm.job(number)["Restarts"])  # more than none where MPI has failed to start
    os.kill(_rank(1, out), signal.SIGKILL)
    killed = time.monotonic()
    while slurm.job(number)["JobState"] == "RUNNING":
        assert time.monotonic() - killed < 30.0
        time.sleep(0.1)
    job = slurm.wait(number, "COMPLETED", "FAILED")
    log = (out / f"slurm-{number}.log").read_text()
    assert (job["JobState"], int(job["Restarts"]) > starts) == ("COMPLETED", True), log
    before, _, after = log.partition("task 1: Killed")
    assert _tasks_left(after)[0] < _tasks_left(before)[-1]
    assert (out / "results.nc").is_file()


def _rank(rank: int, out: Path) -> int:
    """The process of a rank that computes into this folder: not its child, which has not the folder in its words."""
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            words = (folder / "cmdline").read_bytes().split(b"\0")
            environment = (folder / "environ").read_bytes().split(b"\0")
            if str(out).encode() in words and b"--out" in words and f"SLURM_PROCID={rank}".encode() in environment:
                return int(folder.name)
    raise LookupError(f"no rank {rank} that computes into {out}")


def test_ranks_that_cannot_see_each_other_end_the_job_with_code_2(slurm, site):
    site.write_text(site.read_text() + 'mpi = "none"\n')
    campaign = site.with_name("small.toml")
    campaign.write_text(SMALL)
    (number,), out = submitted_jobs(slurm, campaign, site)
    job = slurm.wait(number, "COMPLETED", "FAILED")
    log = (out / f"slurm-{number}.log").read_text()
    assert (job["JobState"], job["ExitCode"]) == ("FAILED", "2:0"), log
    assert log.count("2 processes were started") == 1


def test_an_array_of_small_jobs_is_requeued_job_by_job_and_merged_at_its_end(slurm, site, long, nanoslip):
    site.write_text(site.read_text().replace("nodes = 2", "nodes = 1").replace("tasks = 2", "tasks = 1"))
    (array, merging), out = submitted_jobs(slurm, long, site, "--shards", 3)
    first = Shard(1, 3).folder(out)
    while not runs.read_runs(first):  # until it computes
        assert slurm.job(f"{array}_1")["JobState"] in ("PENDING", "RUNNING", "COMPLETING")
        time.sleep(0.02)
    slurm("scancel", "--signal", signal.SIGTERM.name, f"{array}_1")
    told = slurm.wait(f"{array}_1", "COMPLETED", "FAILED")
    job = slurm.wait(merging, "COMPLETED", "FAILED")
    logs = {path.name: path.read_text() for path in out.glob("slurm-*.log")}
    assert (job["JobState"], job["ExitCode"], int(told["Restarts"]) >= 1) == ("COMPLETED", "0:0", True), logs
    assert sorted(logs) == sorted([*(f"slurm-{array}_{number}.log" for number in (1, 2, 3)), f"slurm-{merging}.log"])
    assert (out / "results.nc").is_file()
    assert not (out / "shards").exists()
    assert {run.slurm_job for run in runs.read_runs(out)} == {f"{array}_{number}" for number in (1, 2, 3)}
    assert '"finished": true' in nanoslip("status", long, "--out", out, "--json").stdout


def _tasks_left(log: str) -> list[int]:
    """Number of tasks that each start in this part of a job's log had left; there are more where MPI failed to start."""
    left = [int(count) for count in re.findall(r"(\d+) tasks? left, 2 ranks", log)]
    assert left, log
    return left
