"""Forecast of task times from finished tasks and the progress of others, and the progress bar."""

import math
import sys
import threading
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from operator import attrgetter
from typing import Any, Final, Self, TextIO

from nanoslip.solver.outcome import Outcome
from nanoslip.study.run.dispatch import MeasuredTimes, Underway, Watch, Work


class TimeForecast:
    """Remaining time of a run: estimates scaled by the rates measured so far, of each kind."""

    def __init__(self, tasks: Sequence[Work], ranks: int = 1, measured: MeasuredTimes | None = None) -> None:
        """measured: times of the campaign's tasks in earlier runs, if any."""
        self._ranks = ranks
        self._measured = MeasuredTimes(measured.as_data() if measured else {})
        self._left: defaultdict[str, float] = defaultdict(float)
        for task in tasks:
            self._left[task.kind] += task.cost
        self._underway: dict[str, tuple[Work, Underway]] = {}
        self._done = 0.0

    def advance(self, task: Work, underway: Underway) -> None:
        """Note the progress of a task."""
        self._underway[task.key] = task, underway

    @property
    def underway(self) -> list[Underway]:
        """Progress of each task that has reported some and has not ended."""
        return [underway for _, underway in list(self._underway.values())]

    def learn(self, task: Work, seconds: float) -> None:
        """Note the seconds that an ended task took."""
        self._underway.pop(task.key, None)
        self._measured.learn(task, seconds)
        self._left[task.kind] -= task.cost
        self._done += seconds

    @property
    def seconds(self) -> float:
        """Seconds until all ranks have finished the remaining tasks."""
        return self._core_seconds() / self._ranks

    @property
    def share(self) -> float:
        """Share of the work that is done, 0 to 1."""
        remaining = self._core_seconds()
        done = self._done + sum(underway.seconds for underway in self.underway)
        return done / (done + remaining) if remaining > 0.0 else 1.0

    def _core_seconds(self) -> float:
        """Seconds left of all tasks together: at the rate of each task that has advanced, else at the rate of its kind."""
        remaining, of_begun = dict(self._left), 0.0
        measured = MeasuredTimes(self._measured.as_data())
        for task, underway in list(self._underway.values()):
            if underway.share > 0.0:
                remaining[task.kind] -= task.cost
                # At a steady rate the rest, 1 - share, takes seconds/share times that.
                of_begun += underway.seconds * (1.0 / underway.share - 1.0)
                measured.learn_part(task, underway.share, underway.seconds)
        of_others = 0.0
        for kind, seconds in remaining.items():
            # Below zero by rounding, once all tasks of a kind have been subtracted.
            of_others += max(seconds, 0.0) * measured.factor(kind)
        return of_begun + of_others


def makespan(tasks: Sequence[Work], ranks: int, seconds: Callable[[Work], float] = attrgetter("cost")) -> float:
    """Lower bound of the seconds that `ranks` ranks need for all tasks: their sum shared evenly, or the longest chain of needs.

    tasks: needs first. seconds: of each task.
    """
    chains: dict[str, float] = {}
    total = 0.0
    for task in tasks:
        task_seconds = seconds(task)
        needed = [chains.get(need, 0.0) for need in task.needs]
        chains[task.key] = task_seconds + max(needed, default=0.0)
        total += task_seconds
    return max(total / ranks, max(chains.values(), default=0.0))


def roughly(seconds: float) -> str:
    """Seconds as text to one digit: `about 0.05 s`, `about 3 min`, `about 2 h`, `about 4 days`."""
    return f"about {to_one_digit(seconds)}"


def to_one_digit(seconds: float) -> str:
    """Seconds as text: `0.05 s`, `3 min`."""
    fitting = (row for row in _UNITS if seconds / row[1] < row[0])
    _, unit, word = next(fitting)
    # To one digit and then plainly: `.1g` alone would write 4e+01.
    number = float(f"{seconds / unit:.1g}")
    return f"{number:g} {word}"


_UNITS: Final = (
    (95.0, 1.0, "s"),
    (95.0, 60.0, "min"),
    (47.0, 3600.0, "h"),
    (math.inf, 86400.0, "days"),
)
"""Numbers below this are in this unit of so many seconds: 95 would be rounded to 100, and two days are 48 h."""


def duration(seconds: float) -> str:
    """Seconds as text: `0.05 s`, `83 s`, `1:23:20`, `11.6 days`."""
    if seconds < 99.5:
        return f"{seconds:.2g} s" if seconds > 1e-3 else "0 s"
    if seconds >= 100.0 * 3600.0:
        return f"{seconds / 86400.0:.3g} days"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}"


SILENCE = 10.0
"""Seconds between plain lines at first."""
PATIENCE = 0.25
"""Interval between plain lines as a share of the elapsed time: a long run writes a line whenever a quarter more has
passed."""

BAR, OTHERS = 20, 72
"""Characters of a bar on a terminal, and of all other columns beside the name of a task."""


CROWDED: Final = 0.5
"""Processor time over elapsed time below which progress names it: times are promised to a factor of two."""


class Progress(Watch):
    """Observer that prints, while entered: a line at the start, every `SILENCE` seconds and at the end.

    A thread reports: a single task may take longer than that.
    """

    _every = PATIENCE

    def __init__(
        self, tasks: Sequence[Work], stream: TextIO, ranks: int = 1, measured: MeasuredTimes | None = None
    ) -> None:
        super().__init__()
        self._count, self._done, self._ranks = len(tasks), 0, ranks
        self._forecast = TimeForecast(tasks, ranks, measured)
        self._kinds = Counter(task.kind for task in tasks)
        self._stream, self._left = stream, threading.Event()
        self._reporting = threading.Thread(target=self._report, name="progress", daemon=True)

    def __enter__(self) -> Self:
        self._start = self._last = time.monotonic()
        self._begin()
        self._reporting.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._left.set()
        self._reporting.join()
        self._end(f"in {duration(time.monotonic() - self._start)}")

    def ended(self, task: Work, outcome: Outcome, seconds: float) -> None:
        """A task has ended."""
        self._done += 1
        self._kinds[task.kind] -= 1
        self._forecast.learn(task, seconds)
        self._last = time.monotonic()

    def advanced(self, task: Work, underway: Underway) -> None:
        """A task that is being computed has advanced."""
        self._forecast.advance(task, underway)
        self._last = time.monotonic()

    def _report(self) -> None:
        while not self._left.wait(max(SILENCE, self._every * (time.monotonic() - self._start))):
            self._show()

    def _begin(self) -> None:
        seconds = self._forecast.seconds
        # What is done before the next line needs no forecast.
        expected = f", {roughly(seconds)}" if seconds >= SILENCE else ""
        self._print(f"{self._tasks} to do{expected}")

    def _end(self, took: str) -> None:
        self._print(f"{self._done} of {self._tasks} done {took}")

    def _show(self) -> None:
        rate, time_left = self._pace()
        share = self._processor_share("this process gets " if self._ranks == 1 else "each process gets ")
        parts = [f"{self._done} of {self._count} tasks", rate, time_left, self._done_of_task(), share]
        state = ", ".join(filter(None, parts))
        # A counter with a plus sign before it has only what is more than zero: kinds with tasks left.
        kinds = ", ".join(+self._kinds)
        self._print(f"{state}: {kinds}")

    def _done_of_task(self) -> str:
        """Share that is done of the only task that has advanced, as text."""
        underway = self._forecast.underway
        return f"{underway[0].share:.0%} of the task done" if len(underway) == 1 else ""

    def _processor_share(self, process: str = "") -> str:
        """Share of a core that a process gets, as text behind its name, if that is far less than one."""
        underway = self._forecast.underway
        seconds = sum(task.seconds for task in underway)
        processor = sum(task.processor for task in underway)
        if processor >= CROWDED * seconds:
            return ""
        return f"{process}{processor / seconds:.0%} of a core"

    @property
    def _tasks(self) -> str:
        return f"{self._count} task{'' if self._count == 1 else 's'}"

    def _pace(self) -> tuple[str, str]:
        """Time passed, or tasks per second so far once some are done, and the remaining time, as text."""
        now = time.monotonic()
        passed = now - self._start
        # The forecast is as old as the last news.
        seconds_left = self._forecast.seconds - (now - self._last)
        per_second = self._done / passed
        rate = f"{per_second:.2g} per s" if per_second >= 1.0 else duration(passed)
        if seconds_left < 0.0 and self._done < self._count:
            # All that is known is that the estimate was too short: if no scale of time is more likely than another, what is
            # left is as likely longer as shorter than what has passed (Gott, Nature 363, 315, 1993).
            return rate, f"late, {roughly(now - self._last)} left"
        return rate, f"about {duration(max(seconds_left, 0.0))} left"

    def _print(self, line: str) -> None:
        self._stream.write(line + "\n")
        self._stream.flush()


class TerminalProgress(Progress):
    """A bar that moves with the work done, and never back if estimates rise."""

    # Its line on the terminal is rewritten.
    _every = 0.0

    def __init__(
        self, tasks: Sequence[Work], console: Any, ranks: int = 1, measured: MeasuredTimes | None = None
    ) -> None:
        from rich import progress  # noqa: PLC0415  a run under a launcher never needs it

        super().__init__(tasks, console.file, ranks, measured)
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
        self._share = 0.0
        self._label = ""
        texts: dict[str, Any] = {"rate": "", "left": ""}
        self._row = self._bar.add_task("", total=1.0, done=0, count=len(tasks), **texts)

    def ended(self, task: Work, outcome: Outcome, seconds: float) -> None:
        """A task has ended."""
        super().ended(task, outcome, seconds)
        self._show_task(task)

    def advanced(self, task: Work, underway: Underway) -> None:
        """A task that is being computed has advanced."""
        super().advanced(task, underway)
        self._show_task(task)

    def _show_task(self, task: Work) -> None:
        """Redraw the line, with the name of this task if it has room."""
        texts = (task.label, task.kind, "")
        self._label = next(text for text in texts if len(text) <= self._room)
        self._show()

    def _begin(self) -> None:
        self._bar.__enter__()

    def _end(self, took: str) -> None:
        self._bar.update(self._row, rate="", left=took, description="")
        self._bar.__exit__(None, None, None)

    def _show(self) -> None:
        self._share = max(self._share, self._forecast.share)
        rate, time_left = self._pace()
        # The row has no room for both: what the processes get explains why the rate is low.
        texts: dict[str, Any] = {"rate": self._processor_share() or rate, "left": time_left, "description": self._label}
        self._bar.update(self._row, completed=self._share, done=self._done, **texts)


def open_progress(
    tasks: Sequence[Work], console: Any, ranks: int = 1, measured: MeasuredTimes | None = None
) -> Progress:
    """The kind of progress that fits this console (of `rich`), on stderr.

    ranks: how many compute at once. measured: times of the campaign's tasks in earlier runs.
    """
    if console.is_terminal:
        return TerminalProgress(tasks, console, ranks, measured)
    return Progress(tasks, sys.stderr, ranks, measured)
