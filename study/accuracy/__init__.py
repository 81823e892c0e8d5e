"""What accuracy costs in time: work-precision diagrams as dataset, table and picture (`nanoslip accuracy`).

This is a measurement, not science: its dataset holds times and names the machine. Nothing else in the study does.
"""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Final

import xarray as xr

from solver.outcome import SolverError
from study.accuracy.chaos import measure_chaos
from study.accuracy.clock import machine
from study.accuracy.motion import measure_motion
from study.accuracy.operator import measure_operator, reference_slab
from study.accuracy.picture import draw
from study.accuracy.scene import FULL, QUICK, Effort, Scene, contacts, default_scene, scene_of
from study.accuracy.sheet import Sheet
from study.accuracy.table import as_markdown, as_table
from study.dataset import write as write_dataset
from study.front import Measured, as_text
from study.parameters import flat
from study.store import StoreError, written_whole

STEM: Final = "accuracy"
"""Name of all files but for their endings."""

__all__ = [
    "FULL",
    "QUICK",
    "Diagrams",
    "Effort",
    "Scene",
    "Sheet",
    "as_dataset",
    "as_table",
    "default_scene",
    "measure",
    "reference_slab",
    "scene_of",
    "write",
]


@dataclass(frozen=True, slots=True)
class Diagrams:
    """All that was measured."""

    scene: Scene
    sheets: tuple[Sheet, ...]
    contacts: tuple[float, ...]
    """Half-widths of the contacts on each operator, a/L_x."""
    front: tuple[Measured, ...]
    """Every discretization of every slab of the scene under each of these contacts."""
    remark: str
    """What could not be measured, and why; empty if nothing."""


def measure(scene: Scene, effort: Effort) -> Diagrams:
    """Turn every knob: first all that is timed once, to have it compiled, then as much as was asked for."""
    if effort is not QUICK:
        measure(scene, QUICK)
    operator, front = measure_operator(scene, effort)
    sheets, remark = [operator, measure_chaos(scene, effort)], ""
    try:
        sheets.append(measure_motion(scene, effort))
    except SolverError as error:  # a record without a plateau drives no pin
        remark = f"dynamics: {error}"
    return Diagrams(scene, tuple(sheets), contacts(effort), front, remark)


def as_dataset(diagrams: Diagrams) -> xr.Dataset:
    """Every sheet's columns over its rows; the scene, what errors are held against and the machine as attributes."""
    scene = diagrams.scene
    variables = {name: variable for sheet in diagrams.sheets for name, variable in sheet.variables().items()}
    case = {name: value for name, value in flat(scene.case).items() if value is not None}
    drive = {item.name: getattr(scene.drive, item.name) for item in fields(scene.drive)}
    attributes = {
        "title": f"What accuracy costs in time: {scene.title}",
        "Conventions": "CF-1.11",
        **{f"{sheet.name}_reference": sheet.reference for sheet in diagrams.sheets},
        "case": ", ".join(f"{name} = {value}" for name, value in case.items()),
        "drive": ", ".join(f"{name} = {value}" for name, value in drive.items() if value is not None),
        **({"remark": diagrams.remark} if diagrams.remark else {}),
        **machine(),
    }
    return xr.Dataset(variables, attrs=attributes)


def write(diagrams: Diagrams, out: Path, front: Path | None = None) -> list[Path]:
    """Write dataset, table and picture to `out`, and the front where it is wanted; returns the files. Raises StoreError."""
    dataset = out / f"{STEM}.nc"
    write_dataset(as_dataset(diagrams), dataset)
    contents = {
        out / f"{STEM}.md": as_markdown(
            diagrams.sheets, f"What accuracy costs in time: {diagrams.scene.title}"
        ).encode(),
        out / f"{STEM}.png": draw(diagrams.sheets),
    }
    if front is not None:
        contents[front] = as_text(machine(), diagrams.contacts, diagrams.front).encode()
    for path, content in contents.items():
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with written_whole(path) as scratch:
                scratch.write_bytes(content)
        except OSError as error:
            raise StoreError(f"{path}: cannot be written: {error.strerror or error}") from None
    return [dataset, *contents]
