"""`nanoslip show`: one case of a campaign, its numbers and its lines."""

from pathlib import Path

from nanoslip.study.commands.shared.choice import assignments
from nanoslip.study.commands.shared.one_case import show_case
from nanoslip.study.commands.shared.refusals import refusals
from nanoslip.study.commands.shared.sources import dataset_of
from nanoslip.study.figures.shared.canvas import format_of
from nanoslip.study.report.console import say


def work(campaign: Path, parameters: tuple[str, ...], out: Path | None, picture: Path | None) -> None:
    """Print the case of a campaign that has these parameters, or draw it."""
    given = assignments(parameters)
    if picture:
        with refusals(ValueError):
            format_of(picture)
    with refusals(), dataset_of(campaign, out) as found:
        say(found.attrs["title"])
        show_case(found, given, picture)
