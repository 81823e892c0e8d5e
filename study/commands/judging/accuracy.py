"""`nanoslip accuracy`: error against processor time for every numerical setting, or for members and lengths of records."""

from pathlib import Path

from nanoslip.study.accuracy.measurement import measure, measure_another_digit, write
from nanoslip.study.accuracy.setup import FULL, QUICK, default_setup, digit_setups, first_of, setup_of
from nanoslip.study.accuracy.table import as_table
from nanoslip.study.commands.shared.arguments import folder
from nanoslip.study.commands.shared.exits import Refusal
from nanoslip.study.commands.shared.plans import counted
from nanoslip.study.commands.shared.refusals import refusals
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.report.console import print_table, say, whole


def work(campaign: Path | None, out: Path | None, quick: bool, digit: bool, save: Path | None) -> None:
    """Measure every numerical setting on a campaign's first case, print the diagrams and write them."""
    effort = QUICK if quick else FULL
    if digit and save:
        raise Refusal("--save: needs a front, which is not measured with --digit")
    with refusals():
        manifest = load_manifest(campaign) if campaign else None
        if digit:
            setups = (first_of(manifest),) if manifest else digit_setups()
            say(f"measuring, {counted(len(setups), 'case')}, a minute or two each unless --quick", stderr=True)
            measured = measure_another_digit(setups, effort)
        else:
            setup = setup_of(manifest) if manifest else default_setup()
            slabs = counted(len(setup.slabs), "slab")
            say(f"{setup.title}: measuring, {slabs}, a minute or two each unless --quick", stderr=True)
            measured = measure(setup, effort)
        for diagram in measured.diagrams:
            say(f"{diagram.title}; errors against {diagram.reference}")
            print_table(as_table(diagram))
        if measured.remark:
            say(f"not measured: {measured.remark}")
        for path in write(measured, folder(campaign or Path("accuracy"), out), save):
            say(whole(f"written: {path}"))
