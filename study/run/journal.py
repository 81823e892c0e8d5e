"""Journal of a run: user, hosts and software, failed attempts, and long tasks in progress.

A line of `runs.jsonl` when it begins to compute, a few on the way, and one when it has ended; one of `attempts.jsonl` for each
attempt that fails; `begun.txt` while it runs.
"""

import datetime
import os
import secrets
import shlex
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from threading import Lock
from typing import Any, Final

from nanoslip.solver.outcome import UNDONE, Ending, Outcome
from nanoslip.study.notices import print_notice
from nanoslip.study.origin import foreign, here, this_machine, user
from nanoslip.study.results import attempts, files
from nanoslip.study.results.attempts import Attempt, RunRecord
from nanoslip.study.results.store import Store
from nanoslip.study.run.dispatch import Done, MeasuredTimes, RunTally, Underway, Watch, Work
from nanoslip.study.run.launch import launcher_name, slurm_job

FIRST: Final = 2.0
"""Seconds after which a run first records the times of its tasks; then after twice as long, and so on."""


BEGUN: Final = "begun.txt"
"""Keys of the long tasks that a running run has begun: if the whole run is killed, one of them may be the cause."""
LONG_TASK: Final = 1.0
"""Seconds above which a task is noted, as is a task of unknown time: shorter ones are too many."""


class Journal(Watch):
    """Journal of a run. Failures to write are printed once and ignored."""

    def __init__(self, out: Path, command: str = "") -> None:
        """command: the command that was started; by default the command line."""
        super().__init__()
        self.undone: set[str] = set()
        """Keys of the tasks that have ended without a result."""
        self.out = out
        # Heads alone: it looks for what is kept, which whoever needs the numbers checks.
        self._store = Store(out, whole=False)
        self._shown = Watch()
        words = ("nanoslip", *sys.argv[1:])
        self._command = command or shlex.join(words)
        self._notice = lru_cache(None)(print_notice)
        self._run: RunRecord | None = None
        self._failed: set[str] = set()
        self._measured = MeasuredTimes()
        self._started, self._next = 0.0, FIRST
        # A signal forgets what was begun, from another thread.
        self._lock = Lock()
        self._begun: int | None = None
        self._forgotten = False

    def begin(self, processes: int, unit: str) -> None:
        """Record user, hosts and software at the start."""
        home = here()
        self._failed.update(attempts.final(self.out, home.solver))
        self._run = RunRecord(
            run=secrets.token_hex(6),
            begun=_now(),
            processes=processes,
            unit=unit,
            user=user(),
            command=self._command,
            nanoslip=home.nanoslip_version,
            solver=home.solver,
            source_commit=home.source_commit,
            launcher=launcher_name(),
            slurm_job=slurm_job(),
            **this_machine(),
        )
        self._started = time.monotonic()
        self._add(self._run)

    def show(self, shown: Watch) -> None:
        """Show this observer the ends and the progress of all tasks."""
        self._shown = shown

    def begun(self, tasks: Sequence[tuple[Work, float]]) -> None:
        """Record long tasks in progress; a full disk is ignored."""
        long = [task.key for task, seconds in tasks if seconds >= LONG_TASK]
        if not long:
            return
        with self._lock, suppress(OSError):
            # A signal has come: what is handed out from now on may not be blamed.
            if self._forgotten:
                return
            if self._begun is None:
                flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND
                self._begun = files.open_regular(self.out / BEGUN, flags)
            # Written to the file itself, without a buffer: what kills the run would take that with it.
            lines = "".join(f"{key}\n" for key in long)
            os.write(self._begun, lines.encode())

    def forget(self) -> None:
        """Delete the record of tasks in progress: the run ends normally or after a signal."""
        with self._lock, suppress(OSError):
            self._forgotten = True
            if self._begun is not None:
                os.close(self._begun)
                self._begun = None
            (self.out / BEGUN).unlink(missing_ok=True)

    def ended(self, task: Any, outcome: Outcome, seconds: float) -> None:
        """Record the duration of a finished task, and that an earlier failure is resolved."""
        if outcome.ending in UNDONE or outcome.ending is Ending.NEEDS_FAILED:
            self.undone.add(task.key)
        else:
            if task.key in self._failed:
                resolved = Done(task.key, outcome, seconds)
                self._note(task, resolved, final=False)
            self._measured.learn(task, seconds)
            if self._run and (elapsed := time.monotonic() - self._started) >= self._next:
                # Each interval twice the one before: a run of a day adds some fifteen lines.
                self._next = 2.0 * elapsed
                so_far = replace(self._run, kinds=self._measured.as_data())
                self._add(so_far)
        self._shown.ended(task, outcome, seconds)

    def advanced(self, task: Any, underway: Underway) -> None:
        """A task that is being computed has advanced."""
        self._shown.advanced(task, underway)

    def failed(self, task: Any, done: Done, final: bool) -> None:
        """Write down an attempt that has failed."""
        self._failed.add(task.key)
        self._note(task, done, final)

    def kept(self, key: str) -> Outcome | None:
        """Outcome in the store, of a result by this software."""
        meta = self._store.metas().get(key)
        if meta is None or foreign(meta.origins, here()):
            return None
        return meta.outcome

    def computed(self, tally: RunTally) -> None:
        """Record outcomes of its tasks."""
        if self._run:
            self._run = replace(
                self._run,
                hosts=dict(sorted(tally.hosts.items())),
                done=tally.done,
                failed=tally.crashed,
                wall_seconds=round(time.monotonic() - self._started, 3),
                core_seconds=round(tally.seconds, 3),
                processor_seconds=round(tally.processor, 3),
                kinds=self._measured.as_data(),
            )

    def end(self, code: int) -> None:
        """Write down that it has ended, where it had begun to compute. code: exit code of the command."""
        if self._run:
            last = replace(self._run, ended=_now(), exit_code=code)
            self._add(last)

    def _add(self, run: RunRecord) -> None:
        if problem := attempts.add_run(self.out, run):
            self._notice(problem)

    def _note(self, task: Any, done: Done, final: bool) -> None:
        attempt = Attempt(
            task=task.key,
            label=task.label,
            ending=done.outcome.ending.value,
            message=done.outcome.message,
            final=final,
            passing=done.passing,
            solver=here().solver,
            where=str(done.where or ""),
            ended=_now(),
            trace=done.trace,
            cause=done.outcome.cause,
        )
        if problem := attempts.add_attempt(self.out, attempt):
            self._notice(problem)


def long_task_keys(out: Path) -> frozenset[str]:
    """Keys of the long tasks that a run had in hand which was killed as a whole."""
    lines = files.read_lines(out / BEGUN)
    return frozenset(word for line in lines for word in line.split())


def read_task_times(*folders: Path) -> MeasuredTimes:
    """Times of finished tasks in the journals of these folders, of runs with this software."""
    # By name, as a run has several lines, of which the last one counts; a folder may be named twice.
    runs: dict[str, RunRecord] = {}
    for out in dict.fromkeys(folders):
        runs |= {run.run: run for run in attempts.read_runs(out)}
    mine = (here().solver, here().nanoslip_version)
    ours = [run for run in runs.values() if (run.solver, run.nanoslip) == mine]
    return MeasuredTimes(*(run.kinds for run in ours))


def _now() -> str:
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
