"""`nanoslip try`: one case from the command line, computed at once; nothing stays on disk."""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

import click

from nanoslip.solver.outcome import InvalidInput
from nanoslip.study import api
from nanoslip.study.commands.shared.choice import assignments
from nanoslip.study.commands.shared.one_case import show_case
from nanoslip.study.commands.shared.refusals import refusals
from nanoslip.study.figures.shared.canvas import format_of
from nanoslip.study.manifest.cases import campaign_of
from nanoslip.study.manifest.checker import ManifestError, number_or_text
from nanoslip.study.manifest.parameters import make_case, words
from nanoslip.study.plan.task import idle
from nanoslip.study.report.console import print_sentences


def work(parameters: tuple[str, ...], contact: bool, drive: bool, picture: Path | None) -> None:
    """Compute one case in this process and print it, or draw it."""
    if contact and drive:
        raise click.UsageError("--contact and --drive exclude each other")
    given = assignments(parameters)
    if picture:
        with refusals(ValueError):
            format_of(picture)  # what cannot be drawn is better known before it is computed
    with refusals(MemoryError), _as_typed():
        found = api.run(campaign_of(given, contact, drive), progress=True)
    print_sentences(_idle(given, contact))
    show_case(found, {}, picture)


def _idle(given: Mapping[str, str], contact: bool) -> Iterator[str]:
    """The parameters that were given and change nothing, as in campaigns, each with the reason."""
    values = {words()[key]: number_or_text(text) for key, text in given.items() if key in words()}
    with suppress(InvalidInput):  # the case is refused, and says why
        yield from idle([make_case(values)], values.keys(), contact)


@contextmanager
def _as_typed() -> Iterator[None]:
    """Name keys in problems as they were typed: without a file, and the tables that a campaign has them in."""
    try:
        yield
    except ManifestError as error:
        places = re.compile(rf"({re.escape(str(api.DICT))}: (\w+(\[\d+\])?\.)?)?")
        raise ManifestError(places.sub("", line, count=1) for line in error.lines) from None
