"""Which farm a process is part of. The only importer of mpi4py."""

import atexit
import ctypes
import os
import threading
import time
from contextlib import ExitStack
from typing import Any, Final

from nanoslip.study.execution.farms.agent import Agent
from nanoslip.study.execution.farms.farm import Farm, FarmError, SerialFarm
from nanoslip.study.execution.farms.processes import ProcessFarm
from nanoslip.study.execution.farms.ranks import MPIFarm
from nanoslip.study.execution.interruption import GRACE, LAST_WORDS, Interruption
from nanoslip.study.execution.launch import launcher_rank, processes_started
from nanoslip.study.execution.ledger import say
from nanoslip.study.execution.program import Program
from nanoslip.study.exit_codes import INTERRUPTED
from nanoslip.study.origin import here

LONGEST_START: Final = 300.0
"""Seconds after which a start of MPI is taken to hang: thousands of ranks need a minute."""
_NOT_STARTED: Final = (
    "Error: MPI has not started within {:g} s: a rank is missing, or the launcher speaks another language (srun --mpi=...); "
    "nothing was computed, run again to continue\n"
)


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
    if launcher_rank() == 0:
        for agent in agents:
            agent.adopt(here())  # starts git, and a process that uses MPI should start none
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

        mpi4py.rc.initialize = False
        from mpi4py import MPI as mpi  # noqa: N811, PLC0415

        _start(mpi)
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


def _start(mpi: Any) -> None:
    """Start the library by its own function: mpi4py calls that with the interpreter locked, and no other thread could give up."""
    if mpi.Is_initialized():  # by `python -m mpi4py`
        return
    watch = threading.Timer(LONGEST_START, _give_up)
    watch.daemon = True
    watch.start()
    # The extension's handle finds the symbols of the library that it was linked with.
    code = ctypes.CDLL(mpi.__file__).MPI_Init_thread(None, None, mpi.THREAD_FUNNELED, ctypes.byref(ctypes.c_int()))
    watch.cancel()
    if code:
        raise RuntimeError(f"MPI_Init_thread returned {code}")
    for communicator in (mpi.COMM_WORLD, mpi.COMM_SELF):
        communicator.Set_errhandler(mpi.ERRORS_RETURN)  # as mpi4py does: errors become exceptions
    atexit.register(_end, mpi)


def _give_up() -> None:
    """End this process as an interrupted run does: a batch script starts it again."""
    if launcher_rank() == 0:
        say(_NOT_STARTED.format(LONGEST_START))
    time.sleep(LAST_WORDS)
    os._exit(INTERRUPTED)


def _end(mpi: Any) -> None:
    if not mpi.Is_finalized():
        mpi.Finalize()


def _library(mpi: Any) -> str:
    return str(mpi.Get_library_version()).split("\n", maxsplit=1)[0].strip("\0 ")
