"""`nanoslip accuracy`: error against processor time for every numerical setting."""

from pathlib import Path

from study.accuracy.measurement import measure, write
from study.accuracy.setup import FULL, QUICK, default_setup, setup_of
from study.accuracy.table import as_table
from study.commands.shared.arguments import folder
from study.commands.shared.plans import counted
from study.commands.shared.refusals import refusals
from study.manifest.reader import load_manifest
from study.report.console import print_table, say, whole


def work(campaign: Path | None, out: Path | None, quick: bool, save: Path | None) -> None:
    """Measure every numerical setting on a campaign's first case, print the diagrams and write them."""
    with refusals():
        setup = setup_of(load_manifest(campaign)) if campaign else default_setup()
        say(
            f"{setup.title}: measuring, {counted(len(setup.slabs), 'slab')}, a minute or two each unless --quick",
            stderr=True,
        )
        measured = measure(setup, QUICK if quick else FULL)
        for diagram in measured.diagrams:
            say(f"{diagram.title}; errors against {diagram.reference}")
            print_table(as_table(diagram))
        if measured.remark:
            say(f"not measured: {measured.remark}")
        for path in write(measured, folder(campaign or Path("accuracy"), out), save):
            say(whole(f"written: {path}"))
