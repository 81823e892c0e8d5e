"""`nanoslip try`: one case from the command line, computed at once; nothing stays on disk."""

from pathlib import Path

from study import api
from study.commands.shared.one_case import assignments, show_case
from study.commands.shared.refusals import refusals
from study.manifest.one_case import campaign_of


def work(parameters: tuple[str, ...], contact: bool, drive: bool, picture: Path | None) -> None:
    """Compute one case in this process and print it, or draw it."""
    with refusals(MemoryError):
        found = api.run(campaign_of(assignments(parameters), contact, drive), progress=True)
    show_case(found, {}, picture)
