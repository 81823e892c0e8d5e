"""Command that measures what accuracy costs in time: accuracy."""

from pathlib import Path

from nanoslip.study.accuracy.diagram import as_table
from nanoslip.study.accuracy.measurement import measure_accuracy, write_measurement
from nanoslip.study.accuracy.setup import default_setup, make_setup, measurement_effort
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.report.console import note, print_table, whole
from nanoslip.study.results.files import results_folder
from nanoslip.study.results.store import try_writing


def show_accuracy(campaign: Path | None, out: Path | None, quick: bool) -> None:
    """Measure every numerical setting on a campaign's first case, print the diagrams and write them."""
    setup = make_setup(load_manifest(campaign)) if campaign else default_setup()
    into = results_folder(campaign or Path("accuracy"), out)
    try_writing(into)
    note(f"{setup.title}: measuring, a minute or two unless --quick", stderr=True)
    measured = measure_accuracy(setup, measurement_effort(setup.case, quick))
    for diagram in measured.diagrams:
        note(f"{diagram.title}; errors against {diagram.reference}")
        print_table(as_table(diagram))
    if measured.remark:
        note(f"not measured: {measured.remark}")
    for path in write_measurement(measured, into):
        note(whole(f"written: {path}"))
