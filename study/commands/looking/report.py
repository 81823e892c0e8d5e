"""`nanoslip report`: the HTML page of a campaign's dataset."""

from pathlib import Path

from study.commands.shared.arguments import folder
from study.commands.shared.datasets import print_summary
from study.commands.shared.refusals import refusals
from study.dataset import file
from study.report import page
from study.report.console import say, whole


def work(campaign: Path, out: Path | None) -> None:
    """Print the summary of a campaign's dataset and write its page."""
    into = folder(campaign, out)
    with refusals(), file.reading(into / file.FILE) as opened:
        print_summary(opened)
        written = page.write(opened, into)
    say(whole(f"report: {written}"))
