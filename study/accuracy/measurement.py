"""What accuracy costs in time: work-precision diagrams as dataset, table and picture (`nanoslip accuracy`).

This is a measurement, not science: its dataset holds times and names the machine. Nothing else in the study does.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import xarray as xr

from solver.outcome import SolverError
from study.accuracy.diagram import Diagram
from study.accuracy.elastic_operator import measure_elastic_operator
from study.accuracy.integrators import measure_integrators
from study.accuracy.picture import draw
from study.accuracy.setup import QUICK, Effort, Setup, contacts
from study.accuracy.slip_numerics import measure_slip_numerics
from study.accuracy.table import as_markdown
from study.accuracy.timing import machine
from study.dataset.file import write as write_dataset
from study.dataset.groups import carrying
from study.discretization.front import Measured, as_text
from study.results.store import StoreError
from study.results.whole_file import written_whole

STEM: Final = "accuracy"
"""Name of all files but for their endings."""


@dataclass(frozen=True, slots=True)
class Measurement:
    """All that was measured."""

    setup: Setup
    diagrams: tuple[Diagram, ...]
    contacts: tuple[float, ...]
    """Half-widths of the contacts on each operator, a/L_x."""
    front: tuple[Measured, ...]
    """Every discretization of every slab of the setup under each of these contacts."""
    remark: str
    """What could not be measured, and why; empty if nothing."""


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
    return Measurement(setup, tuple(diagrams), contacts(effort), front, remark)


def as_dataset(measurement: Measurement) -> xr.Dataset:
    """Every diagram's columns over its rows; the setup, what errors are held against and the machine as attributes."""
    setup = measurement.setup
    variables = {name: variable for diagram in measurement.diagrams for name, variable in diagram.variables().items()}
    case = {name: value for name, value in setup.case.flat.items() if value is not None}
    drive = {"name": setup.drive.name, **setup.drive.flat}
    attributes = {
        "title": f"What accuracy costs in time: {setup.title}",
        "Conventions": "CF-1.11",
        **{f"{diagram.name}_reference": diagram.reference for diagram in measurement.diagrams},
        "case": ", ".join(f"{name} = {value}" for name, value in case.items()),
        "drive": ", ".join(f"{name} = {value}" for name, value in drive.items() if value is not None),
        **({"remark": measurement.remark} if measurement.remark else {}),
        **machine(),
    }
    return xr.Dataset(variables, attrs=attributes)


def write(measurement: Measurement, out: Path, front: Path | None = None) -> list[Path]:
    """Write dataset, table and picture to `out`, and the front where it is wanted; returns the files. Raises StoreError."""
    dataset = out / f"{STEM}.nc"
    write_dataset(carrying(as_dataset(measurement), {}), dataset)
    contents = {
        out / f"{STEM}.md": as_markdown(
            measurement.diagrams, f"What accuracy costs in time: {measurement.setup.title}"
        ).encode(),
        out / f"{STEM}.png": draw(measurement.diagrams),
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
