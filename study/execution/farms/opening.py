"""Which farm a process is part of. The only importer of mpi4py."""

import warnings
from contextlib import ExitStack
from typing import Any

from study.execution.farms.agent import Agent
from study.execution.farms.farm import Farm, FarmError, SerialFarm
from study.execution.farms.processes import ProcessFarm
from study.execution.farms.ranks import MPIFarm
from study.execution.interruption import GRACE, Interruption
from study.execution.launch import launcher_rank, processes_started
from study.execution.program import Program


def open_farm(program: Program, grace: float = GRACE, serial: bool = False, jobs: int | None = None) -> Farm:
    """The farm this process is part of: MPI's ranks where there are several, else `jobs` processes, else one.

    serial: this process itself computes. Raises FarmError where a launcher started several processes that do not see each other,
    or that would each start more.
    """
    started = processes_started()
    if jobs is not None and (serial or started > 1):
        other = "--serial" if serial else f"a launcher that has started {started} processes"
        raise FarmError(f"--jobs {jobs} with {other}: leave one of them out")
    if serial:
        return SerialFarm(program.load, grace)
    agents = [Agent(program, launcher_rank() + number) for number in range(jobs or 1)]
    with ExitStack() as stack:
        stack.callback(agents[0].close)
        interruption = Interruption(grace)
        if started > 1:  # a signal while MPI starts would end this rank alone, and the others would wait for it
            stack.enter_context(interruption)
        agents[0].start()  # before MPI, which may not like its process to start others
        mpi = None if jobs else _mpi(started)
        stack.pop_all()  # the farm goes on with them
    return MPIFarm(mpi, agents[0], interruption) if mpi else ProcessFarm(agents, grace)


def _mpi(started: int) -> Any:
    """The library where there are several ranks; None where nobody has started several processes. Raises FarmError."""
    try:
        import mpi4py  # noqa: PLC0415  a run without ranks must not need an MPI library

        mpi4py.rc.thread_level = "funneled"
        with warnings.catch_warnings():
            # Under a foreign launcher mpi4py warns in every process; the error says it once.
            warnings.filterwarnings("ignore", message="suspicious MPI execution environment")
            from mpi4py import MPI as mpi  # noqa: N811, PLC0415
    except (ImportError, RuntimeError) as error:
        if started > 1:
            raise FarmError(f"{started} processes were started, but none can use MPI: {error}") from error
        return None
    if mpi.COMM_WORLD.Get_size() > 1:
        return mpi
    if started > 1:
        raise FarmError(
            f"{started} processes were started, but each sees only itself (MPI library: {_library(mpi)}): the launcher "
            "belongs to another MPI. Use the mpiexec of this library, or srun with the --mpi type that it speaks"
        )
    return None


def _library(mpi: Any) -> str:
    return str(mpi.Get_library_version()).split("\n", maxsplit=1)[0].strip("\0 ")
