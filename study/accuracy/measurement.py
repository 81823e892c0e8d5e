"""What accuracy costs in time: work-precision diagrams as dataset, table and picture (`nanoslip accuracy`).

This is a measurement, not science: its dataset holds times and names the machine. Nothing else in the study does.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import xarray as xr

from nanoslip.solver.outcome import SolverError
from nanoslip.study.accuracy.diagram import Diagram
from nanoslip.study.accuracy.digit import measure_digit
from nanoslip.study.accuracy.elastic_operator import measure_elastic_operator
from nanoslip.study.accuracy.integrators import measure_integrators
from nanoslip.study.accuracy.picture import draw, draw_digit
from nanoslip.study.accuracy.setup import QUICK, Effort, Setup, contacts
from nanoslip.study.accuracy.slip_numerics import measure_slip_numerics
from nanoslip.study.accuracy.table import as_markdown
from nanoslip.study.accuracy.timing import machine
from nanoslip.study.dataset.file import carrying
from nanoslip.study.dataset.file import write as write_dataset
from nanoslip.study.plan.grids import Measured, as_text
from nanoslip.study.results.entry import written_whole
from nanoslip.study.results.store import StoreError

TITLE: Final = "What accuracy costs in time"


@dataclass(frozen=True, slots=True)
class Measurement:
    """All that was measured."""

    title: str
    setups: tuple[Setup, ...]
    diagrams: tuple[Diagram, ...]
    contacts: tuple[float, ...] = ()
    """Half-widths of the contacts on each operator, a/L_x."""
    front: tuple[Measured, ...] = ()
    """Every discretization of every slab of the setup under each of these contacts."""
    remark: str = ""
    """What could not be measured, and why; empty if nothing."""
    stem: str = "accuracy"
    """Name of all files but for their endings."""
    draw: Callable[[Sequence[Diagram]], bytes] = draw


def measure(setup: Setup, effort: Effort) -> Measurement:
    """Turn every knob: first all that is timed once, to have it compiled, then as much as was asked for."""
    if effort is not QUICK:
        measure(setup, QUICK)
    operator, front = measure_elastic_operator(setup, effort)
    diagrams, remark = [operator, measure_slip_numerics(setup, effort)], ""
    try:
        diagrams.append(measure_integrators(setup, effort))
    except SolverError as error:  # a record without a plateau drives no pin
        remark = f"dynamics: {error}"
    return Measurement(f"{TITLE}: {setup.title}", (setup,), tuple(diagrams), contacts(effort), front, remark)


def measure_another_digit(setups: Sequence[Setup], effort: Effort) -> Measurement:
    """Errors over members and lengths of records. Raises ManifestError where a case has no plateau."""
    diagrams = measure_digit(setups, effort)
    return Measurement("What a digit costs in time", tuple(setups), diagrams, stem="digit", draw=draw_digit)


def as_dataset(measurement: Measurement) -> xr.Dataset:
    """Every diagram's columns over its rows; the setups, what errors are held against and the machine as attributes."""
    variables = {name: variable for diagram in measurement.diagrams for name, variable in diagram.variables().items()}
    cases = [setup.case.flat for setup in measurement.setups]
    drives = [{"name": setup.drive.name, **setup.drive.flat} for setup in measurement.setups]
    attributes = {
        "title": measurement.title,
        "Conventions": "CF-1.11",
        **{f"{diagram.name}_reference": diagram.reference for diagram in measurement.diagrams},
        "case": "; ".join(map(_in_words, cases)),
        "drive": "; ".join(map(_in_words, drives)),
        **({"remark": measurement.remark} if measurement.remark else {}),
        **machine(),
    }
    return xr.Dataset(variables, attrs=attributes)


def _in_words(values: Mapping[str, object]) -> str:
    return ", ".join(f"{name} = {value}" for name, value in values.items() if value is not None)


def write(measurement: Measurement, out: Path, front: Path | None = None) -> list[Path]:
    """Write dataset, table and picture to `out`, and the front where it is wanted; returns the files. Raises StoreError."""
    stem, diagrams = measurement.stem, measurement.diagrams
    dataset = out / f"{stem}.nc"
    write_dataset(carrying(as_dataset(measurement), {}), dataset)
    contents = {
        out / f"{stem}.md": as_markdown(diagrams, measurement.title).encode(),
        out / f"{stem}.png": measurement.draw(diagrams),
    }
    if front is not None:
        contents[front] = as_text(machine(), measurement.contacts, measurement.front).encode()
    for path, content in contents.items():
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with written_whole(path) as scratch:
                scratch.write_bytes(content)
        except OSError as error:
            raise StoreError(f"{path}: cannot be written: {error.strerror or error}") from None
    return [dataset, *contents]
