"""Campaigns of very many cases: time and memory of commands that look at all of them, each in a process of its own.

`python -m tests.benchmarks.scale 1000000` prints the rows of campaigns of so many cases; a million take minutes.
"""

import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from nanoslip.study.commands.plans import plan_campaign
from nanoslip.study.results.store import Store
from nanoslip.study.tasks.compute import run_task
from nanoslip.study.tasks.task import TaskResult
from tests.benchmarks.apart import alone
from tests.benchmarks.table import Row, as_rows, at_most, seconds
from tests.written_tables import show

SIZES = (10_000, 100_000)
"""Cases of the campaigns that are measured unless others are asked for."""
CASES = """\
title = "{count} small cases, of which scalars are kept"
[axes]
intrinsic_friction = {intrinsic_friction}
radius = {radius}
aspect_ratio = {aspect_ratio}
[numerics]
n_x = 33
[limits]
events = 50
[ensemble]
members = 1
[outputs]
records = false
"""
HEIGHTS = 10
"""Slabs of a campaign."""


@dataclass(frozen=True)
class Command:
    """A command that looks at all cases of a campaign."""

    words: tuple[str, ...]
    most: float
    """Processor seconds that are aimed at with 100 000 cases."""
    finished: bool = True
    """Whether all results of the campaign are there."""
    what: str = ""


COMMANDS = (
    Command(("plan",), 10.0, finished=False),
    Command(("status",), 3.0, what=", all finished"),
    Command(("collect",), 20.0, what=", all finished"),
    Command(("run",), 5.0, what=", nothing to do"),
)


@dataclass(frozen=True)
class Taken:
    """What a process took."""

    seconds: float
    """Of processors."""
    memory: float
    """Bytes, when they were most."""


def rows(sizes: tuple[int, ...] = SIZES) -> list[Row]:
    """A row for each command and number of cases."""
    with TemporaryDirectory() as folder:
        made = {count: campaign_of(count, Path(folder)) for count in (1, *sizes)}
        found = [_row(command, count, made) for command in COMMANDS if not command.finished for count in sizes]
        for path in made.values():  # what this process holds would count as a command's
            alone(_finish, path)
        return found + [_row(command, count, made) for command in COMMANDS if command.finished for count in sizes]


def _row(command: Command, count: int, made: Mapping[int, Path]) -> Row:
    one, found = (_taken(*command.words, path, "--out", _out(path)) for path in (made[1], made[count]))
    each = (found.seconds - one.seconds) / count
    return Row(
        f"nanoslip {' '.join(command.words)}{command.what}, {count} cases",
        f"{seconds(found.seconds)}, {found.memory / 1e6:.0f} MB",
        f"{seconds(one.seconds)}, {one.memory / 1e6:.0f} MB: 1 case",
        f"{seconds(each)}, {(found.memory - one.memory) / count:.0f} bytes each",
        at_most(found.seconds, command.most) if count == 100_000 else "",
    )


def _out(campaign: Path) -> Path:
    return campaign.with_suffix("")


def _finish(campaign: Path) -> None:
    """Make up the results of a campaign: those of its first tasks, with another plateau each, for all."""
    plan, store = plan_campaign(campaign), Store(_out(campaign))
    store.prepare()
    first: dict[str, TaskResult] = {}
    for number, task in enumerate(plan.tasks):
        if task.kind not in first:
            first[task.kind] = run_task(task, {key: store.read(key) for key in task.needs})
        result = replace(first[task.kind], key=task.key)
        scalars = {**result.scalars, "plateau_mean": [0.1 + 1e-7 * number]} if result.scalars else {}
        store.write(replace(result, scalars=scalars), task.shared)


def campaign_of(count: int, folder: Path) -> Path:
    """The file of a campaign with so many cases: a multiple of HEIGHTS, or one."""
    heights = HEIGHTS if count > 1 else 1
    frictions = max(size for size in range(1, int((count // heights) ** 0.5) + 1) if count // heights % size == 0)
    path = folder / f"{count}.toml"
    path.write_text(
        CASES.format(
            count=count,
            intrinsic_friction=np.linspace(0.1, 0.9, frictions).tolist(),
            radius=np.linspace(20.0, 400.0, count // heights // frictions).tolist(),
            aspect_ratio=np.linspace(0.5, 3.0, heights).tolist(),
        ),
        "utf-8",
    )
    return path


def _taken(*words: object) -> Taken:
    """What `nanoslip WORDS` takes. Raises RuntimeError where it fails."""
    command = [sys.executable, "-m", "nanoslip", *map(str, words)]
    started = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(started.pid, 0)
    started.returncode = os.waitstatus_to_exitcode(status)
    if started.returncode:
        raise RuntimeError(f"nanoslip {' '.join(map(str, words))}: exit code {started.returncode}")
    return Taken(used.ru_utime + used.ru_stime, 1024.0 * used.ru_maxrss)


if __name__ == "__main__":
    show(as_rows(rows(tuple(map(int, sys.argv[1:])) or SIZES)))
