"""`nanoslip status`: how much of a campaign is finished, and how it ended, from the files of results alone."""

import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import click

from nanoslip.solver.outcome import Ending
from nanoslip.study.commands.shared.machine import print_json
from nanoslip.study.commands.shared.plans import Standing, advised, counted, kinds_as_data, print_foreign, standing
from nanoslip.study.commands.shared.refusals import refusals
from nanoslip.study.plan.plan import PENDING, ended
from nanoslip.study.report.console import Table, console, print_table, say, table_text
from nanoslip.study.run.progress import duration

_GIVEN_UP: Final = "are not tried any more: failed, or need one that has"
_UNMERGED: Final = "counted with the results of {shards} not merged yet; {merge} brings them together"
INTERVAL: Final = 2.0
"""Seconds between two looks at the results."""


def work(campaign: Path, out: Path | None, watch: bool, as_json: bool) -> None:
    """Print how many of a campaign's tasks are finished and how its cases ended; with `watch` until all are finished."""
    if watch and as_json:
        raise click.UsageError("--watch and --json exclude each other")
    with refusals():
        found = standing(campaign, out)
        if as_json:
            print_json(_data(found))
        elif watch:
            _watch(found)
        else:
            say(found.plan.manifest.title)
            print_table(*_tables(found))
            if found.given_up:
                again = advised("run", campaign, found.into, "--retry")
                say(f"{counted(len(found.given_up), 'task')} {_GIVEN_UP}; {again} tries again")
            if len(found.stores) > 1:
                shards = counted(len(found.stores) - 1, "shard")
                say(_UNMERGED.format(shards=shards, merge=advised("merge", campaign, found.into)))
            print_foreign(found.foreign, campaign, found.into)


def _watch(found: Standing) -> None:
    """Redraw on a terminal, else print a line whenever something has changed; ends with the last task, or by Ctrl-C."""
    out = console()
    try:
        if not out.is_terminal:
            _print_changes(found)
            return
        from rich.live import Live  # noqa: PLC0415  slow to load, and only who watches needs it

        with Live(console=out, auto_refresh=False) as screen:
            for each in _again(found):
                screen.update(table_text(each.plan.manifest.title, _tables(each)), refresh=True)
    except KeyboardInterrupt:
        return


def _print_changes(found: Standing) -> None:
    said = ""
    for each in _again(found):
        line = _line(each)
        if line != said:
            click.echo(line)
            said = line


def _again(found: Standing) -> Iterator[Standing]:
    """The state of a campaign now and every few seconds, the last time when nothing is left."""
    yield found
    while found.remaining:
        time.sleep(INTERVAL)
        found = found.again()
        yield found


def _tables(found: Standing) -> tuple[Table, Table]:
    """Tasks by kind, and cases and drives by outcome."""
    tasks = [
        (kind, str(each.finished), str(each.left), duration(each.core_seconds_left), str(each.all))
        for kind, each in found.kinds.items()
    ]
    cases, drives = ended(found.plan, found.outcomes)
    words = sorted(cases | drives, key=lambda word: (word != _COMPLETED, word in _UNHURT, word))
    header = ("outcome", "cases", "drives") if drives else ("outcome", "cases")
    rows = [(word, str(cases[word]), str(drives[word]))[: len(header)] for word in words]
    failed = frozenset(number for number, word in enumerate(words) if word not in (_COMPLETED, *_UNHURT))
    titles = ("tasks", "finished", "left", "core time left", "all")
    return Table(titles, tuple(tasks)), Table(header, tuple(rows), len(header), failed)


def _line(found: Standing) -> str:
    """The state in one line."""
    cases, drives = ended(found.plan, found.outcomes)
    count = len(found.plan.tasks)
    parts = [f"{count - len(found.remaining) - len(found.given_up)} of {count} tasks", f"cases: {_words(cases)}"]
    return "; ".join([*parts, *([f"drives: {_words(drives)}"] if drives else [])])


def _words(counted: Counter[str]) -> str:
    return ", ".join(f"{count} {word}" for word, count in sorted(counted.items(), key=lambda item: (-item[1], item[0])))


def _data(found: Standing) -> dict[str, Any]:
    """The state for scripts."""
    cases, drives = ended(found.plan, found.outcomes)
    return {
        "title": found.plan.manifest.title,
        "finished": not found.remaining and not found.given_up,
        "tasks": kinds_as_data(found.kinds),
        "cases": dict(cases),
        "drives": dict(drives),
        "given_up": len(found.given_up),
        "foreign_results": len(found.foreign),
    }


_COMPLETED: Final = Ending.COMPLETED.value
_UNHURT: Final = (PENDING, Ending.NOT_NEEDED.value)
"""Beside it what asks for nothing."""
