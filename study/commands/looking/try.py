"""`nanoslip try`: one case from the command line, computed at once; nothing stays on disk."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from study import api
from study.commands.shared.choice import assignments
from study.commands.shared.one_case import show_case
from study.commands.shared.refusals import refusals
from study.figures.shared.canvas import format_of
from study.manifest.one_case import campaign_of
from study.manifest.problems import ManifestError


def work(parameters: tuple[str, ...], contact: bool, drive: bool, picture: Path | None) -> None:
    """Compute one case in this process and print it, or draw it."""
    given = assignments(parameters)
    if picture:
        with refusals(ValueError):
            format_of(picture)  # what cannot be drawn is better known before it is computed
    with refusals(MemoryError), _as_typed():
        found = api.run(campaign_of(given, contact, drive), progress=True)
    show_case(found, {}, picture)


@contextmanager
def _as_typed() -> Iterator[None]:
    """Name keys in problems as they were typed: without a file, and the tables that a campaign has them in."""
    try:
        yield
    except ManifestError as error:
        places = re.compile(rf"({re.escape(str(api.DICT))}: (\w+(\[\d+\])?\.)?)?")
        raise ManifestError(places.sub("", line, count=1) for line in error.lines) from None
