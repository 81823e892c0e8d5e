"""`nanoslip report`: the HTML page of a campaign's dataset."""

from pathlib import Path

from study.commands.shared.arguments import folder
from study.commands.shared.refusals import refusals
from study.dataset import file
from study.report import page
from study.report.console import say, whole


def work(campaign: Path, out: Path | None) -> None:
    """Write the page of a campaign's dataset; the run that made it has printed its table."""
    into = folder(campaign, out)
    with refusals(), file.reading(into / file.FILE) as opened:
        written = page.write(opened, into)
    say(whole(f"report: {written}"))
