"""Progress of a run: a bar with rate and remaining time on a terminal, else a plain line every few seconds."""

import sys
import time
from collections.abc import Sequence
from types import TracebackType
from typing import Any, Protocol, Self, TextIO

from solver.outcome import Outcome
from study.execution.queue import Work

SILENCE = 10.0
"""Seconds between plain lines."""


class Progress(Protocol):
    """Called at each task's end, while entered."""

    def __enter__(self) -> Self: ...
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...
    def __call__(self, task: Work, outcome: Outcome, seconds: float) -> None: ...


class PlainProgress:
    """A line at the start, every `SILENCE` seconds and at the end."""

    def __init__(self, tasks: Sequence[Work], stream: TextIO) -> None:
        self._count = len(tasks)
        self._cost = sum(task.cost for task in tasks)
        self._stream = stream
        self._done = 0
        self._done_cost = 0.0

    def __enter__(self) -> Self:
        self._start = self._last = time.monotonic()
        self._say(f"{self._count} tasks to do")
        return self

    def __exit__(self, *_: object) -> None:
        self._say(f"{self._done} of {self._count} tasks done in {_duration(time.monotonic() - self._start)}")

    def __call__(self, task: Work, outcome: Outcome, seconds: float) -> None:
        self._done += 1
        self._done_cost += task.cost
        now = time.monotonic()
        if now - self._last >= SILENCE:
            self._last = now
            elapsed = now - self._start
            # Tasks differ in length by orders of magnitude: the estimate of what is left is by cost, not by number.
            left = elapsed * max(self._cost / self._done_cost - 1.0, 0.0) if self._done_cost else 0.0
            self._say(
                f"{self._done} of {self._count} tasks, {self._done / elapsed:.2g} per s, about {_duration(left)} left"
            )

    def _say(self, line: str) -> None:
        self._stream.write(line + "\n")
        self._stream.flush()


class TerminalProgress:
    """A bar that moves with the estimated work done."""

    def __init__(self, tasks: Sequence[Work], console: Any) -> None:
        from rich import progress  # noqa: PLC0415  a run under a launcher never needs it

        self._bar = progress.Progress(
            progress.TextColumn("{task.fields[done]} of {task.fields[count]} tasks"),
            progress.BarColumn(),
            progress.TextColumn("{task.fields[rate]}"),
            progress.TimeRemainingColumn(),
            progress.TextColumn("{task.description}"),
            console=console,
        )
        total = sum(task.cost for task in tasks)
        self._done = 0
        self._row = self._bar.add_task("", total=total, done=0, count=len(tasks), rate="")

    def __enter__(self) -> Self:
        self._start = time.monotonic()
        self._bar.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.__exit__(kind, error, trace)

    def __call__(self, task: Work, outcome: Outcome, seconds: float) -> None:
        self._done += 1
        rate = f"{self._done / (time.monotonic() - self._start):.2g}/s"
        self._bar.update(self._row, advance=task.cost, done=self._done, rate=rate, description=task.label)


def open_progress(tasks: Sequence[Work], console: Any) -> Progress:
    """The kind of progress that fits this console (of `rich`), on stderr."""
    return TerminalProgress(tasks, console) if console.is_terminal else PlainProgress(tasks, sys.stderr)


def _duration(seconds: float) -> str:
    if seconds < 100.0:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}"
