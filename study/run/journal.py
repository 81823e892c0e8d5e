"""What a run writes down of itself: a line when it begins to compute, a few on the way, and one when it has ended."""

import datetime
import secrets
import shlex
import sys
import time
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from nanoslip.solver.outcome import UNDONE, Ending, Outcome
from nanoslip.study.origin import here, this_machine, user
from nanoslip.study.plan.task import Task
from nanoslip.study.results import attempts as runs
from nanoslip.study.results.attempts import Run
from nanoslip.study.run.dispatch import Report, Tally
from nanoslip.study.run.launch import launcher_name, slurm_job
from nanoslip.study.run.progress import Measured

FIRST: Final = 2.0
"""Seconds after which a run writes down what its tasks took so far; again after twice as long, and so on."""


class Journal:
    """The lines of one run. What cannot be written is printed once and stands in the way of nothing."""

    def __init__(self, out: Path, command: str = "") -> None:
        """command: what was started; without it the command line."""
        self._out = out
        self._command = command or shlex.join(("nanoslip", *sys.argv[1:]))
        self._run: Run | None = None
        self._started = 0.0
        self._printed = ""
        self._measured = Measured()
        self._next = FIRST

    def begin(self, processes: int, unit: str) -> None:
        """Write down who begins to compute here, and with what else."""
        machine, home = this_machine(), here()
        self._run = Run(
            run=secrets.token_hex(6),
            begun=_now(),
            processes=processes,
            unit=unit,
            user=user(),
            command=self._command,
            nanoslip=home.nanoslip_version,
            solver=home.solver,
            source_commit=home.source_commit,
            host=machine.host,
            launcher=launcher_name(),
            mpi=machine.mpi,
            slurm_job=slurm_job(),
            processor=machine.processor,
            features=machine.features,
            blas=machine.blas,
            python=machine.python,
            libraries=machine.libraries,
        )
        self._started = time.monotonic()
        self._add(self._run)

    def noting(self, report: Report[Task]) -> Report[Task]:
        """A callback that notes how long tasks with a result took, then calls `report`."""

        def note(tasks: Sequence[Task], outcome: Outcome, seconds: Collection[float]) -> None:
            if outcome.ending not in UNDONE and outcome.ending is not Ending.NEEDS_FAILED:
                self._measured.learn(tasks, seconds)
                self._write_on_the_way()
            report(tasks, outcome, seconds)

        return note

    def computed(self, tally: Tally) -> None:
        """Note what became of its tasks."""
        if self._run:
            self._run = replace(
                self._run,
                hosts=dict(sorted(tally.hosts.items())),
                done=tally.done,
                failed=tally.crashed,
                wall_seconds=round(time.monotonic() - self._started, 3),
                core_seconds=round(tally.seconds, 3),
                kinds=self._measured.as_data(),
            )

    def end(self, code: int) -> None:
        """Write down that it has ended, where it had begun to compute. code: exit code of the command."""
        if self._run:
            self._add(replace(self._run, ended=_now(), exit_code=code))

    def _write_on_the_way(self) -> None:
        if self._run and (elapsed := time.monotonic() - self._started) >= self._next:
            self._next = 2.0 * elapsed
            self._run = replace(self._run, kinds=self._measured.as_data())
            self._add(self._run)

    def _add(self, run: Run) -> None:
        if (problem := runs.add_run(self._out, run)) and problem != self._printed:
            self._printed = problem
            sys.stderr.write(f"{problem}\n")


def measured_in(*folders: Path) -> Measured:
    """What finished tasks took, by the journals of these folders: of runs of this software, whose predictions are comparable."""
    found = {run.run: run for out in dict.fromkeys(folders) for run in runs.read(out)}
    mine = (here().solver, here().nanoslip_version)
    return Measured(*(run.kinds for run in found.values() if (run.solver, run.nanoslip) == mine))


def _now() -> str:
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
