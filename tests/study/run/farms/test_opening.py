"""A run never becomes N lone processes that each do everything."""

import socket
import subprocess
import sys

import pytest

from nanoslip.study.run.farm import FarmError, ProcessFarm, SerialFarm
from nanoslip.study.run.launch import Program, launcher_rank
from nanoslip.study.run.mpi import open_farm

NOTHING = Program("builtins", "callable")


@pytest.mark.parametrize(
    "started",
    [
        {"OMPI_COMM_WORLD_SIZE": "4", "OMPI_COMM_WORLD_RANK": "0"},
        {"SLURM_STEP_NUM_TASKS": "4", "SLURM_PROCID": "0"},
    ],
)
def test_n_processes_that_see_only_themselves_are_refused_by_one_message(nanoslip, campaign, started):
    first = nanoslip("run", campaign, **started)
    assert first.returncode == 2
    assert first.stderr.startswith("Error: 4 processes were started, but each sees only itself")
    assert "Traceback" not in first.stderr
    other = {name: "1" if name.endswith(("RANK", "PROCID")) else value for name, value in started.items()}
    second = nanoslip("run", campaign, **other)
    assert (second.returncode, second.stderr) == (2, "")
    assert not (campaign.parent / "results").exists()


def test_slurm_tasks_of_a_batch_script_do_not_mean_that_a_launcher_was_used(monkeypatch):
    for name in (
        "PMI_SIZE",
        "OMPI_COMM_WORLD_SIZE",
        "SLURM_STEP_NUM_TASKS",
        "PMI_RANK",
        "OMPI_COMM_WORLD_RANK",
        "PMIX_RANK",
    ):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("SLURM_NTASKS", "8")
    monkeypatch.setenv("SLURM_PROCID", "3")
    assert launcher_rank() == 0
    monkeypatch.setitem(sys.modules, "mpi4py", None)  # importing it fails
    with open_farm(NOTHING) as farm:
        assert isinstance(farm, ProcessFarm)


def test_processes_without_mpi4py_are_refused_unless_serial_is_meant(monkeypatch):
    monkeypatch.setitem(sys.modules, "mpi4py", None)
    monkeypatch.setenv("OMPI_COMM_WORLD_SIZE", "2")
    with pytest.raises(FarmError, match="2 processes were started, but none can use MPI"):
        open_farm(NOTHING)
    assert isinstance(open_farm(NOTHING, serial=True), SerialFarm)


def test_without_an_mpi_library_one_process_computes_and_several_refuse(nanoslip, campaign):
    missing = {"MPI4PY_LIBMPI": "/no/such/library"}
    assert nanoslip("run", campaign, "--out", campaign.parent / "out", **missing).returncode == 0
    several = nanoslip("run", campaign, **missing, OMPI_COMM_WORLD_SIZE="2")
    assert several.returncode == 2
    assert several.stderr.startswith("Error: 2 processes were started, but none can use MPI: cannot load MPI library")


@pytest.mark.mpi
@pytest.mark.parametrize(("rank", "messages"), [(0, 1), (1, 0)])
def test_a_start_of_mpi_that_hangs_is_given_up_with_one_message_and_code_99(environment, rank, messages):
    """A launcher that never answers, as MPICH hears it."""
    program = (
        "from nanoslip.study.run import mpi; from nanoslip.study.run.launch import Program; "
        "mpi.LONGEST_START = 0.5; mpi.open_farm(Program('builtins', 'callable'))"
    )
    ours, theirs = socket.socketpair()
    with ours, theirs:
        mute = {"PMI_FD": str(theirs.fileno()), "PMI_RANK": str(rank), "PMI_SIZE": "2"}
        done = subprocess.run(
            [sys.executable, "-c", program],
            env=environment | mute,
            pass_fds=[theirs.fileno()],
            capture_output=True,
            text=True,
            timeout=60.0,
            check=False,
        )
    if "each sees only itself" in done.stderr:
        pytest.skip("not MPICH: it asks nobody at that place")
    assert (done.returncode, done.stderr.count("MPI has not started within 0.5 s")) == (99, messages), done.stderr
    assert "Traceback" not in done.stderr
