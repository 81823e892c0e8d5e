"""Rank, number of processes and end of the job as the launcher says in the environment; number of threads. Imports no library."""

import math
import os
import sys
from collections.abc import Mapping
from typing import Final

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "NUMBA_NUM_THREADS")


WARNING: Final = 90
"""Seconds before the end of a job at which its ranks are told to stop."""


def end_of_time(environment: Mapping[str, str]) -> float:
    """When no task may run any more, in seconds since the epoch; infinite where the environment does not say. Slurm >= 22.05."""
    end = environment.get("SLURM_JOB_END_TIME", "")
    return float(end) - WARNING if end.isdigit() else math.inf


def launcher_rank() -> int:
    """Rank of this process as its launcher gives it, 0 without a launcher; needs no MPI."""
    names = ["PMI_RANK", "OMPI_COMM_WORLD_RANK", "PMIX_RANK"]
    if "SLURM_STEP_NUM_TASKS" in os.environ:
        names.append("SLURM_PROCID")
    return next((int(os.environ[name]) for name in names if os.environ.get(name, "").isdigit()), 0)


def processes_started() -> int:
    """Number of processes that the launcher started together, 1 without a launcher."""
    # SLURM_NTASKS alone also stands in a batch script's environment, where one process is right.
    names = ("PMI_SIZE", "OMPI_COMM_WORLD_SIZE", "SLURM_STEP_NUM_TASKS")
    sizes = [int(os.environ[name]) for name in names if os.environ.get(name, "").isdigit()]
    return max(sizes, default=1)


def processes_here() -> int:
    """Number of those on this machine; all of them where the launcher does not say."""
    names = ("MPI_LOCALNRANKS", "OMPI_COMM_WORLD_LOCAL_SIZE")
    sizes = [int(os.environ[name]) for name in names if os.environ.get(name, "").isdigit()]
    # "4(x2),3": so many on the first machine (and on how many more); the first one has the most.
    first = os.environ.get("SLURM_STEP_TASKS_PER_NODE", "").partition("(")[0].partition(",")[0]
    return max([*sizes, *([int(first)] if first.isdigit() else [])], default=processes_started())


def launcher_name() -> str:
    """What started these processes together, as far as their environment says; empty without a launcher."""
    names = {"MPI_LOCALNRANKS": "Hydra", "OMPI_COMM_WORLD_SIZE": "Open MPI", "SLURM_STEP_NUM_TASKS": "srun"}
    found = [launcher for name, launcher in names.items() if os.environ.get(name)]
    return found[0] if found else "PMI" if os.environ.get("PMI_SIZE") else ""


def slurm_job() -> str:
    """Number of the job of Slurm that this process is part of, and of the element of an array; empty outside."""
    job, array = os.environ.get("SLURM_JOB_ID", ""), os.environ.get("SLURM_ARRAY_JOB_ID", "")
    return f"{array}_{os.environ.get('SLURM_ARRAY_TASK_ID', '')}" if array else job


def cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def pin_threads() -> None:
    """One thread per rank for BLAS and numba: more would fight each other, and sums would depend on their number.

    To be called before numpy is imported; where it already was, threadpoolctl sets what is loaded, in a tenth of a second.
    """
    for name in _THREADS:
        os.environ[name] = "1"
    if "numpy" in sys.modules:
        import threadpoolctl  # noqa: PLC0415

        threadpoolctl.threadpool_limits(limits=1)
