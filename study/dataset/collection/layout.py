"""Where each case and drive of a campaign lies in its dataset: the dimensions, and the settings of drives along theirs."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.parameter import attributes
from nanoslip.study.dataset.collection.ragged import texts
from nanoslip.study.dataset.variables import DRIVE_NAME, parameters
from nanoslip.study.manifest.cases import cases_of
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.parameters import STANDARD, Value


@dataclass(frozen=True, slots=True)
class Layout:
    """Where each case and each drive lies: the axes that are dimensions, and a position along them."""

    axes: dict[str, tuple[Value, ...]]
    """Of the cases."""
    lengths: dict[str, int]
    """Of what varies from case to case, the last one fastest: as in `axes`, but in the campaign's order."""
    drive_axes: dict[str, tuple[Value, ...]]
    """Of the drives, which follow those of the cases."""
    drive_position: Mapping[str, tuple[int, ...]]
    """Label of a drive -> position."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Of a variable over the cases."""
        return tuple(len(values) for values in self.axes.values())

    def places(self, numbers: range) -> NDArray[np.intp]:
        """Where the cases of these numbers lie, counted through all of them, the last dimension fastest."""
        steps = {name: math.prod(self.shape[number:]) for number, name in enumerate(self.axes, 1)}
        found = np.zeros(len(numbers), np.intp)
        if not self.lengths:  # a single case
            return found
        along = np.unravel_index(np.arange(numbers.start, numbers.stop), tuple(self.lengths.values()))
        for name, at in zip(self.lengths, along, strict=True):
            found += steps.get(name, 0) * at  # an axis of one value may be no dimension
        return found


def layout_of(manifest: Manifest) -> Layout:
    """The axes where the design is a full product, else the list of cases.

    Drives lie along `drive`, where there are several tables of them, and along the drive axes of several values.
    """
    drive_axes = _drive_axes(manifest)
    return Layout(*_of_cases(manifest), drive_axes, _drive_positions(manifest, drive_axes))


def _drive_axes(manifest: Manifest) -> dict[str, tuple[Value, ...]]:
    names = tuple(dict.fromkeys(drive.name for drive in manifest.drives))
    found = {"drive": names, **manifest.drive_axes}
    return {name: values for name, values in found.items() if len(values) > 1}


def _drive_positions(manifest: Manifest, axes: dict[str, tuple[Value, ...]]) -> dict[str, tuple[int, ...]]:
    numbers = {name: {value: number for number, value in enumerate(values)} for name, values in axes.items()}
    points = {drive.label: {"drive": drive.name, **drive.point} for drive in manifest.drives}
    return {label: tuple(numbers[name][point[name]] for name in axes) for label, point in points.items()}


def _of_cases(manifest: Manifest) -> tuple[dict[str, tuple[Value, ...]], dict[str, int]]:
    if manifest.design != "product":
        points = manifest.case_count
        return {"case": tuple(range(points))}, {"case": points}
    given = manifest.axes
    names = (*STANDARD, *(name for name, values in given.items() if name not in STANDARD and len(values) > 1))
    first = next(cases_of(manifest, range(1))).parameters
    axes = {name: tuple(given.get(name, (first[name],))) for name in names}
    return axes, {name: len(values) for name, values in given.items()}


def drive_coordinates(manifest: Manifest, layout: Layout) -> dict[str, Any]:
    """The drives' names and settings: along their own dimension, along `drive`, and along those with which they vary."""
    found: dict[str, Any] = {}
    points = {layout.drive_position[each.label]: {"drive": each.name, **each.settings} for each in manifest.drives}
    for name in ("drive", *parameters()) if points else ():
        label = DRIVE_NAME if name == "drive" else parameters()[name]
        if name in layout.drive_axes:
            found[name] = (name, array_of(layout.drive_axes[name]), attributes(label))
            continue
        given = {position: point.get(name) for position, point in points.items()}
        if any(value is not None for value in given.values()):
            found[name] = (*_spread(given, layout.drive_axes), attributes(label))
    return found


def _spread(given: Mapping[tuple[int, ...], Any], axes: Mapping[str, Sequence[Value]]) -> tuple[tuple[str, ...], Any]:
    """Dimensions and values of a setting of the drives, without the axes along which it is the same; `drive` stays."""
    values = np.full(tuple(len(each) for each in axes.values()), None, dtype=object)
    for position, value in given.items():
        values[position] = value
    dims = tuple(axes)
    for axis in axes:
        first = values.take([0], dims.index(axis))
        if axis != "drive" and np.all(values == first):
            values, dims = first.squeeze(dims.index(axis)), tuple(dim for dim in dims if dim != axis)
    missing: Any = "" if any(isinstance(value, str) for value in given.values()) else np.nan
    flat = [missing if value is None else value for value in values.ravel().tolist()]
    return dims, array_of(flat).reshape(values.shape)[()]


def array_of(values: Any) -> Any:
    """Values of a label, texts at their length."""
    return texts(values) if any(isinstance(value, str) for value in values) else np.array(values)
