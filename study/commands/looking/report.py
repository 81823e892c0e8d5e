"""`nanoslip report`: the HTML page of a campaign's dataset."""

from pathlib import Path

from nanoslip.study.commands.shared.arguments import folder
from nanoslip.study.commands.shared.plans import advised
from nanoslip.study.commands.shared.refusals import refusals
from nanoslip.study.commands.shared.sources import is_of
from nanoslip.study.dataset import file
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.report import page
from nanoslip.study.report.console import say, whole
from nanoslip.study.results.store import StoreError


def work(campaign: Path, out: Path | None) -> None:
    """Write the page of a campaign's dataset; the run that made it has printed its table."""
    into = folder(campaign, out)
    with refusals(), file.reading(into / file.FILE) as opened:
        if not is_of(opened, load_manifest(campaign)):
            run, collect = (advised(each, campaign, into) for each in ("run", "collect"))
            raise StoreError(
                f"{into / file.FILE}: no dataset of {campaign} as it is now: {run} computes what is missing, "
                f"{collect} takes what is finished"
            )
        written = page.write(opened, into)
    say(whole(f"report: {written}"))
