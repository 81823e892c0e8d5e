"""Start of a process, before other imports: rank, end of the job, threads, arithmetic, signals, and its program."""

import math
import os
import re
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Final, Self

from nanoslip.study import processor
from nanoslip.study.exit_codes import INTERRUPTED
from nanoslip.study.notices import print_notice

ONE_THREAD: Final = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
"""Environment of a process that computes: more threads would fight each other, and sums would depend on their number."""

ONE_ARITHMETIC: Final = {"OPENBLAS_CORETYPE": "Haswell", "MKL_CBWR": "AVX2"}
"""Kernels of OpenBLAS and MKL for processors with AVX2 and FMA. Each library would choose the newest kernel that the
processor can run, and each kernel rounds differently. A variable that is already set is kept."""

WARNING: Final = 90
"""Seconds before the end of a job at which its ranks are signalled to stop."""


def end_of_time(environment: Mapping[str, str]) -> float:
    """Time when no task may run any more, in seconds since the epoch; infinite if the environment has none. Slurm >= 22.05."""
    end = environment.get("SLURM_JOB_END_TIME", "")
    return float(end) - WARNING if end.isdigit() else math.inf


def launcher_rank() -> int:
    """Rank of this process as its launcher gives it, 0 without a launcher; needs no MPI."""
    names = ["PMI_RANK", "OMPI_COMM_WORLD_RANK", "PMIX_RANK"]
    # SLURM_PROCID alone also stands in the environment of a batch script, outside of any step.
    if "SLURM_STEP_NUM_TASKS" in os.environ:
        names.append("SLURM_PROCID")
    return next(_numbers(*names), 0)


def _numbers(*names: str) -> Iterator[int]:
    """The variables of the environment, of these, that are numbers."""
    texts = (os.environ.get(name, "") for name in names)
    return (int(text) for text in texts if text.isdigit())


def processes_started() -> int:
    """Number of processes that the launcher started together, 1 without a launcher."""
    # SLURM_NTASKS alone also stands in a batch script's environment, where one process is right.
    return max(_numbers("PMI_SIZE", "OMPI_COMM_WORLD_SIZE", "SLURM_STEP_NUM_TASKS"), default=1)


def processes_here() -> int:
    """Number of processes on this machine; all of them if the launcher does not state it."""
    sizes = list(_numbers("MPI_LOCALNRANKS", "OMPI_COMM_WORLD_LOCAL_SIZE"))
    # "4(x2),3": four on the first machine and on the next, three on the third; the first one has the most.
    first = re.match("[0-9]+", os.environ.get("SLURM_STEP_TASKS_PER_NODE", ""))
    if first:
        sizes.append(int(first[0]))
    return max(sizes, default=processes_started())


def launcher_name() -> str:
    """Name of the launcher of these processes, from the environment; empty without one."""
    names = {"MPI_LOCALNRANKS": "Hydra", "OMPI_COMM_WORLD_SIZE": "Open MPI", "SLURM_STEP_NUM_TASKS": "srun"}
    launchers = [launcher for name, launcher in names.items() if os.environ.get(name)]
    return launchers[0] if launchers else "PMI" if os.environ.get("PMI_SIZE") else ""


def slurm_job() -> str:
    """Number of the job of Slurm that this process is part of, and of the element of an array; empty outside."""
    array = os.environ.get("SLURM_ARRAY_JOB_ID", "")
    if array:
        return f"{array}_{os.environ.get('SLURM_ARRAY_TASK_ID', '')}"
    return os.environ.get("SLURM_JOB_ID", "")


def cores() -> int:
    """Number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def computing_environment() -> dict[str, str]:
    """Environment of a process that computes: that of this process with one thread and one arithmetic."""
    has_haswell = {"avx2", "fma"} <= set(processor.instructions())
    arithmetic = ONE_ARITHMETIC if has_haswell else {}
    # What the user has set outweighs the kernel, never the number of threads: sums depend on that.
    return arithmetic | os.environ | ONE_THREAD


def pin_arithmetic() -> None:
    """Pin one thread of this process for BLAS and numba, and the kernel of BLAS.

    To be called before numpy is imported. Afterwards threadpoolctl can still limit the threads of a loaded BLAS, in a
    tenth of a second, but not change its kernel.
    """
    os.environ.update(computing_environment())
    if "numpy" in sys.modules:
        import threadpoolctl  # noqa: PLC0415

        threadpoolctl.threadpool_limits(limits=1)


# The executor of a process: named, so that a caller who passes it on need not import it.


@dataclass(frozen=True, slots=True)
class Settle:
    """Last task of a process: sync its results, so that other machines see them."""

    key: str = "settle"
    needs: tuple[str, ...] = ()
    kind: str = "settle"
    cost: float = 0.01
    limit: float = 60.0
    label: str = "writing results out"


@dataclass(frozen=True, slots=True)
class Program:
    """A function of a module that, called with the argument, returns the function that computes a task."""

    module: str
    name: str
    argument: Any = None

    def load(self) -> Callable[[Any], Any]:
        """The function that computes a task. Imports the module."""
        make: Callable[[Any], Callable[[Any], Any]]
        make = getattr(import_module(self.module), self.name)
        return make(self.argument)


def task_program(out: Path) -> Program:
    """Program that computes the tasks of a campaign in its processes, with the results in this folder.

    Raises InvalidInput if numba is told not to compile, as each task would fail.
    """
    from nanoslip.solver.outcome import InvalidInput  # noqa: PLC0415  help would load numpy and the solver

    name = "NUMBA_DISABLE_JIT"
    if os.environ.get(name, "0") != "0":
        raise InvalidInput(name, os.environ[name], "to be unset: kernels do not work without numba's compiler")
    return Program("nanoslip.study.run.executor", "executor", out.absolute())


# SIGTERM, SIGINT and SIGUSR1: the first sets a flag, a second one or the end of a grace period ends the process.

SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGUSR1)
GRACE = 20.0
"""Seconds that a running task has to finish after a signal."""
ECHO = 2.0
"""Seconds in which a further signal repeats the first: a terminal signals the ranks, and so does their launcher."""
LAST_WORDS = 0.5
"""Seconds between a process's last message and its end: launchers drop output that they have not passed on by
then."""


class Interruption:
    """While entered, a first signal only sets a flag; a later one, or the end of the grace (s), ends the process.

    A thread waits for signals, because Python's handlers wait for the main thread, which may be in a kernel for minutes.
    The end of the process loses only the task in progress. Nested entries have no effect.
    """

    def __init__(self, grace: float) -> None:
        self.end: Callable[[int], object] = os._exit
        """Ends the process with an exit code where that cannot wait."""
        self.at_request: Callable[[], object] = lambda: None
        """Called as soon as the process is to stop, in any thread."""
        self._grace = grace
        self._requested = threading.Event()
        self._patience: threading.Timer | None = None
        self._watcher: threading.Thread | None = None

    @property
    def requested(self) -> bool:
        """True once a stop was requested."""
        return self._requested.is_set()

    def request(self) -> None:
        """Request a stop of this process, as a signal would (without the grace)."""
        self._requested.set()
        self.at_request()

    def __enter__(self) -> Self:
        if self._watcher is not None:
            return self
        self._read_end, self._write_end = os.pipe()
        # As `set_wakeup_fd` demands: a handler must never wait for room in the pipe.
        os.set_blocking(self._write_end, False)
        # The watching thread reads the signal from the pipe.
        self._handlers = {number: signal.signal(number, lambda *_: None) for number in SIGNALS}
        self._old_wakeup = signal.set_wakeup_fd(self._write_end)
        self._watcher = threading.Thread(target=self._watch, name="interruption", daemon=True)
        self._watcher.start()
        return self

    def __exit__(self, *_: object) -> None:
        signal.set_wakeup_fd(self._old_wakeup)
        for number, handler in self._handlers.items():
            signal.signal(number, handler)
        # The end of its pipe ends the watcher.
        os.close(self._write_end)
        if self._watcher is not None:
            self._watcher.join()
            self._watcher = None
        os.close(self._read_end)
        if self._patience is not None:
            self._patience.cancel()
            self._patience.join()

    def _watch(self) -> None:
        first = math.inf
        while received := os.read(self._read_end, 1):
            # Every signal that has a Python handler is written there, whoever has set that.
            if received[0] not in SIGNALS:
                continue
            if time.monotonic() > first + ECHO:
                self._leave("a second signal arrived")
            if self._patience is None:
                first = time.monotonic()
                self.request()
                self._patience = threading.Timer(
                    self._grace, self._leave, [f"the grace period of {self._grace:g} s is over"]
                )
                self._patience.daemon = True
                self._patience.start()

    def _leave(self, reason: str) -> None:
        print_notice(f"stopped during a task, as {reason}; run again to continue")
        time.sleep(LAST_WORDS)
        self.end(INTERRUPTED)
