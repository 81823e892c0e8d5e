"""`nanoslip export`: the numbers of a campaign as a flat table, CSV or JSON."""

from collections.abc import Callable
from pathlib import Path
from typing import Final

import click

from nanoslip.study.commands.shared.refusals import refusals
from nanoslip.study.commands.shared.sources import dataset_of
from nanoslip.study.dataset.access import Column, case_columns, event_columns, sample_columns
from nanoslip.study.figures.shared.files import write_files
from nanoslip.study.report.console import say, whole
from nanoslip.study.report.page import as_csv, as_json

_TABLES: Final[dict[str | None, Callable[..., list[Column]]]] = {
    None: case_columns,
    "records": event_columns,
    "trajectories": sample_columns,
}
"""Option -> how its columns are read."""


def work(campaign: Path, out: Path | None, form: str | None, table: str | None, output: Path | None) -> None:
    """Write a table of a campaign's cases, events or samples to a file or to standard output."""
    with refusals(ValueError), dataset_of(campaign, out) as found:
        columns, title = _TABLES[table](found), str(found.attrs["title"])
    as_asked = form or ("json" if output and output.suffix.lower() == ".json" else "csv")
    text = as_json(columns, title) if as_asked == "json" else as_csv(columns)
    if output is None:
        click.echo(text, nl=False)
        return
    with refusals():
        write_files({output: text.encode()})
    say(f"{whole(f'written: {output}')} ({len(columns[0].values)} rows)", stderr=True)
