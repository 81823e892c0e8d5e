"""A Slurm of our own for the tests: controller, two nodes and munge on this host, gone when the tests are over."""

import contextlib
import os
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

NODES = 2
PROGRAMS = ("slurmctld", "slurmd", "munged", "srun", "sbatch", "scontrol")


class Controller:
    """The commands of this Slurm."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.environment = {
            name: value for name, value in os.environ.items() if not name.startswith(("SLURM", "PMI", "SBATCH"))
        } | {"SLURM_CONF": str(folder / "slurm.conf")}

    def __call__(self, *words: object, check: bool = True) -> str:
        done = subprocess.run(
            list(map(str, words)), env=self.environment, capture_output=True, text=True, timeout=120, check=False
        )
        assert done.returncode == 0 or not check, f"{words}: {done.stderr}"
        return done.stdout

    def job(self, number: str) -> dict[str, str]:
        """Facts of a job that the controller knows."""
        return dict(word.split("=", 1) for word in self("scontrol", "show", "job", "-o", number).split() if "=" in word)

    def wait(self, number: str, *states: str, patience: float = 120.0) -> dict[str, str]:
        """Wait until a job is in one of these states; a requeued job starts soon instead of after two minutes."""
        end = time.monotonic() + patience
        while time.monotonic() < end:
            job = self.job(number)
            if job["JobState"] in states:
                return job
            if job["JobState"] == "PENDING" and job["Restarts"] != "0":
                time.sleep(3.0)  # nodes refuse a job in the second in which its last start's credential was revoked
                self("scontrol", "update", f"JobId={number}", "StartTime=now", check=False)
            time.sleep(0.2)
        raise AssertionError(f"job {number} is {job['JobState']} after {patience} s, not {' or '.join(states)}")


@pytest.fixture(scope="session")
def slurm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Controller]:
    """A controller that answers; skips where it cannot be started."""
    if missing := [name for name in PROGRAMS if shutil.which(name) is None]:
        pytest.skip(f"no {', '.join(missing)} here: a Slurm controller cannot be started")
    if os.geteuid() != 0:
        pytest.skip("starting a Slurm controller needs root")
    folder = tmp_path_factory.mktemp("slurm")
    (folder / "slurm.conf").write_text(_configuration(folder))
    controller = Controller(folder)
    with contextlib.ExitStack() as daemons:
        daemons.enter_context(_munge())
        daemons.callback(_stop, folder / "slurmctld.pid")
        subprocess.run(["slurmctld", "-c"], env=controller.environment, check=True)
        for node in range(1, NODES + 1):
            for kind in ("spool", "tmp"):
                (folder / kind / f"n{node}").mkdir(parents=True)
            daemons.callback(_stop, folder / f"slurmd.n{node}.pid")
            subprocess.run(["slurmd", "-N", f"n{node}"], env=controller.environment, check=True)
        controller("srun", "-N", NODES, "--immediate=30", "true")  # sinfo says idle before nodes have registered
        yield controller
        controller("scancel", "--user", "root", check=False)


@contextlib.contextmanager
def _munge() -> Iterator[None]:
    """The authentication that Slurm wants: one that already answers, else one of our own."""
    if subprocess.run(["munge", "-n"], capture_output=True, check=False).returncode == 0:
        yield
        return
    run = Path("/run/munge")
    for folder in (run, Path("/var/log/munge")):
        folder.mkdir(parents=True, exist_ok=True)
        shutil.chown(folder, "munge", "munge")
    for leftover in run.glob("munge.socket.2*"):
        leftover.unlink()
    subprocess.run(["munged"], user="munge", group="munge", extra_groups=[], check=True)
    try:
        yield
    finally:
        _stop(run / "munged.pid")


def _stop(pid_file: Path) -> None:
    """End a daemon by the number it left, and wait until it is gone."""
    if not pid_file.exists():
        return
    number = int(pid_file.read_text())
    with contextlib.suppress(ProcessLookupError):
        os.kill(number, signal.SIGTERM)
        end = time.monotonic() + 15.0
        while pid_file.exists() and time.monotonic() < end:
            time.sleep(0.1)


def _configuration(folder: Path) -> str:
    host = socket.gethostname().split(".")[0]
    controller, *nodes = _free_ports(1 + NODES)
    (folder / "state").mkdir()
    lines = {
        "ClusterName": "tests",
        "SlurmctldHost": f"{host}(127.0.0.1)",
        "SlurmctldPort": controller,
        "AuthType": "auth/munge",
        "CredType": "cred/munge",
        "SlurmUser": "root",
        "SlurmdUser": "root",
        "StateSaveLocation": folder / "state",
        "SlurmdSpoolDir": folder / "spool" / "%n",
        "TmpFS": folder / "tmp" / "%n",
        "SlurmctldPidFile": folder / "slurmctld.pid",
        "SlurmdPidFile": folder / "slurmd.%n.pid",
        "SlurmctldLogFile": folder / "slurmctld.log",
        "SlurmdLogFile": folder / "slurmd.%n.log",
        "ProctrackType": "proctrack/linuxproc",
        "TaskPlugin": "task/none",
        "JobAcctGatherType": "jobacct_gather/none",
        "AccountingStorageType": "accounting_storage/none",
        "SelectType": "select/cons_tres",
        "SelectTypeParameters": "CR_Core",
        "SchedulerParameters": "sched_interval=1,bf_interval=1,batch_sched_delay=0",
        "SlurmdParameters": "config_overrides",
        "MpiDefault": "none",
        "ReturnToService": 2,
        "KillWait": 5,
        "JobRequeue": 1,
    }
    places = [
        f"NodeName=n{number} NodeHostname={host} NodeAddr=127.0.0.1 Port={port} CPUs=2 RealMemory=2000 State=UNKNOWN"
        for number, port in enumerate(nodes, 1)
    ]
    partition = "PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP"
    return "\n".join([*(f"{name}={value}" for name, value in lines.items()), *places, partition, ""])


def _free_ports(count: int) -> list[int]:
    with contextlib.ExitStack() as sockets:
        taken = [sockets.enter_context(socket.socket()) for _ in range(count)]
        for each in taken:
            each.bind(("127.0.0.1", 0))
        return [each.getsockname()[1] for each in taken]
