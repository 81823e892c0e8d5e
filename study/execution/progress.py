"""Progress of a run: a bar with rate and remaining time on a terminal, else a plain line every few seconds."""

import sys
import time
from collections.abc import Collection, Sequence
from types import TracebackType
from typing import Any, Protocol, Self, TextIO

from nanoslip.solver.outcome import Outcome
from nanoslip.study.execution.forecast import Forecast, Measured, duration
from nanoslip.study.execution.queue import Work

SILENCE = 10.0
"""Seconds between plain lines."""

BAR, OTHERS = 20, 72
"""Characters of a bar on a terminal, and of all that stands beside the name of a task."""


class Progress(Protocol):
    """Called where tasks have ended, while entered."""

    def __enter__(self) -> Self: ...
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...
    def __call__(self, tasks: Sequence[Work], outcome: Outcome, seconds: Collection[float]) -> None: ...


class PlainProgress:
    """A line at the start, every `SILENCE` seconds and at the end."""

    def __init__(self, tasks: Sequence[Work], stream: TextIO, ranks: int = 1, measured: Measured | None = None) -> None:
        self._count = len(tasks)
        self._tasks = f"{self._count} task{'' if self._count == 1 else 's'}"
        self._forecast = Forecast(tasks, ranks, measured)
        self._stream = stream
        self._done = 0

    def __enter__(self) -> Self:
        self._start = self._last = time.monotonic()
        self._say(f"{self._tasks} to do")
        return self

    def __exit__(self, *_: object) -> None:
        self._say(f"{self._done} of {self._tasks} done in {duration(time.monotonic() - self._start)}")

    def __call__(self, tasks: Sequence[Work], outcome: Outcome, seconds: Collection[float]) -> None:
        self._done += len(tasks)
        self._forecast.learn(tasks, seconds)
        now = time.monotonic()
        if now - self._last >= SILENCE:
            self._last = now
            rate = self._done / (now - self._start)
            left = duration(self._forecast.seconds)
            self._say(f"{self._done} of {self._count} tasks, {rate:.2g} per s, about {left} left")

    def _say(self, line: str) -> None:
        self._stream.write(line + "\n")
        self._stream.flush()


class TerminalProgress:
    """A bar that moves with the work done."""

    def __init__(self, tasks: Sequence[Work], console: Any, ranks: int = 1, measured: Measured | None = None) -> None:
        from rich import progress  # noqa: PLC0415  a run under a launcher never needs it

        self._bar = progress.Progress(
            progress.TextColumn("{task.fields[done]} of {task.fields[count]} tasks"),
            progress.BarColumn(BAR),
            progress.TextColumn("{task.fields[rate]}"),
            progress.TextColumn("{task.fields[left]}"),
            progress.TextColumn("{task.description}"),
            console=console,
            disable=not tasks,
        )
        self._room = max(console.width - OTHERS, 0)
        self._forecast = Forecast(tasks, ranks, measured)
        self._done = 0
        self._row = self._bar.add_task("", total=1.0, done=0, count=len(tasks), rate="", left="")

    def __enter__(self) -> Self:
        self._start = time.monotonic()
        self._bar.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        took = f"in {duration(time.monotonic() - self._start)}"
        self._bar.update(self._row, rate="", left=took, description="")
        self._bar.__exit__(kind, error, trace)

    def __call__(self, tasks: Sequence[Work], outcome: Outcome, seconds: Collection[float]) -> None:
        self._done += len(tasks)
        self._forecast.learn(tasks, seconds)
        rate = f"{self._done / (time.monotonic() - self._start):.2g}/s"
        left = f"about {duration(self._forecast.seconds)} left"
        share = self._forecast.share
        label = next((text for text in (tasks[-1].label, tasks[-1].kind) if len(text) <= self._room), "")
        self._bar.update(self._row, completed=share, done=self._done, rate=rate, left=left, description=label)


def open_progress(tasks: Sequence[Work], console: Any, ranks: int = 1, measured: Measured | None = None) -> Progress:
    """The kind of progress that fits this console (of `rich`), on stderr.

    ranks: how many compute at once. measured: what tasks of the campaign took in earlier runs.
    """
    if console.is_terminal:
        return TerminalProgress(tasks, console, ranks, measured)
    return PlainProgress(tasks, sys.stderr, ranks, measured)
