"""Runs of different length, one behind the other: CF contiguous ragged arrays with the labels of what they belong to."""

import weakref
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import SpooledTemporaryFile
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import DTypeLike, NDArray

from nanoslip.solver.outcome import Ending
from nanoslip.solver.parameter import attributes
from nanoslip.study.canonical import content_hash
from nanoslip.study.dataset import texts
from nanoslip.study.dataset.variables import Group, Series
from nanoslip.study.tasks.kind import ACROSS, MEMBER, MEMBER_OUTCOME, member_column
from nanoslip.study.tasks.task import TaskResult

NAME_LENGTH: Final = 12
"""Hexadecimal digits of a run's name."""
HELD: Final = 1 << 23
"""Bytes of a column's samples that are held in memory: more go to disk meanwhile."""


class Samples:
    """Values along a sample dimension, one run after the other; few of them are in memory at a time."""

    def __init__(self, folder: Path | None) -> None:
        """folder: of the unnamed temporary file for many values; None for the system's own."""
        self._file = SpooledTemporaryFile(HELD, dir=str(folder) if folder else None)  # noqa: SIM115  the values are mapped from it
        weakref.finalize(self, self._file.close)
        self._type: np.dtype[Any] | None = None

    def add(self, run: NDArray[Any]) -> None:
        """Append values; all runs have the same type. Raises OSError if the disk refuses."""
        self._file.write(run.tobytes())
        self._type = run.dtype

    def values(self, dtype: DTypeLike) -> NDArray[Any]:
        """All values as one array; empty, of this dtype, if there are none."""
        kind: Any = dtype if self._type is None else self._type
        with self._file as file:
            if file.tell() > HELD:
                return np.memmap(file, kind, "c")
            file.seek(0)
            # Of a `bytearray`: an array over `bytes` could not be written to.
            return np.frombuffer(bytearray(file.read()), kind)


class Runs:
    """The runs of a group. Results that several cases share are kept once."""

    def __init__(self, group: Group, folder: Path | None = None) -> None:
        """folder: where long columns lie meanwhile."""
        self.group = group
        self._names: dict[tuple[str, ...], str] = {}
        self._owners: list[tuple[str, str]] = []
        self._counts: dict[str, list[int]] = {name: [] for name in group.samples}
        self._columns = {name: Samples(folder) for name in group.columns}

    def add(self, results: Sequence[TaskResult], factors: Mapping[str, float], case_id: str, drive: str) -> str:
        """Append the run of a case's results of the group's kinds; returns its name, empty if there is nothing.

        factors: by `Quantity.per`.
        """
        parts = _once([result for result in results if self._has_columns(result)])
        keys = tuple(result.key for result in parts)
        # Cases whose results are the same tasks share one run.
        if not keys or keys in self._names:
            return self._names.get(keys, "")
        for sample, series in self.group.samples.items():
            columns_of_parts = [(stated, part) for part in parts for stated in series if stated.kind == part.kind]
            lengths = [self._append_columns(stated, part, factors) for stated, part in columns_of_parts]
            self._counts[sample].append(sum(lengths))
        self._owners.append((case_id, drive))
        # The name of a single result is its key, shortened; several results have a key of their
        # own.
        name = keys[0][:NAME_LENGTH]
        if len(keys) > 1:
            name = content_hash(keys, length=NAME_LENGTH)
        return self._names.setdefault(keys, name)

    def _append_columns(self, series: Series, result: TaskResult, factors: Mapping[str, float]) -> int:
        """Append the columns of a result; returns their length."""
        runs = {name: _run(result, name, series) for name in series.columns}
        for name, quantity in series.columns.items():
            values = runs[name]
            if quantity.per:
                # What overflows is infinite, and no number of the dataset.
                with np.errstate(over="ignore"):
                    values = values * factors[quantity.per]
            self._columns[quantity.name].add(values)
        return next(iter(runs.values())).size

    def _has_columns(self, result: TaskResult) -> bool:
        """True if a result has the columns of the group, and not its scalars alone."""
        for series in self.group.series:
            if series.kind != result.kind:
                continue
            if series.columns.keys() - ACROSS <= _arrays(result, series).keys():
                return True
        return False

    def dataset(self) -> xr.Dataset:
        """The columns over the samples; over the instances their names, owners and the count of samples."""
        variables_by_name: dict[str, Any] = {}
        instances = self.group.name
        for sample, series in self.group.samples.items():
            count = series[0].count
            counts = np.array(self._counts[sample], np.int64)
            described = attributes(count) | {"sample_dimension": sample}
            variables_by_name[count.name] = (instances, counts, described)
        for name, quantity in self.group.columns.items():
            values = self._columns[name].values(quantity.dtype)
            variables_by_name[name] = (quantity.along, values, attributes(quantity))
        labels = texts.text_array(self._names.values())
        variables_by_name[instances] = (instances, labels, attributes(self.group.label))
        for number, owner in enumerate(self.group.owners):
            owners = texts.text_array(names[number] for names in self._owners)
            variables_by_name[owner.name] = (instances, owners, attributes(owner))
        columns = self.group.columns.items()
        coordinates = [name for name, quantity in columns if quantity.coordinate]
        coordinates += [owner.name for owner in self.group.owners]
        return xr.Dataset(variables_by_name).set_coords(coordinates)


def _once(results: list[TaskResult]) -> list[TaskResult]:
    """Drop initial contact if states of the contact begin with it."""
    if len(results) > 1 and 0 in results[-1].arrays["surface_event"]:
        return results[-1:]
    return results


def _arrays(result: TaskResult, series: Series) -> Mapping[str, Any]:
    if series.sample != MEMBER:
        return result.arrays
    first = next(iter(result.scalars.values()), ())
    count = len(first)
    if not count:
        return {}
    outcomes = result.members or (result.outcome,) * count
    # Numbers of a part that an older version did not have.
    unknown = dict.fromkeys(series.columns, [np.nan] * count)
    endings = [_PLACES[outcome.ending] for outcome in outcomes]
    return {**unknown, **result.scalars, MEMBER_OUTCOME.name: endings}


_PLACES: Final = {ending: place for place, ending in enumerate(Ending)}


def _run(result: TaskResult, name: str, series: Series) -> NDArray[Any]:
    """The first member's column; or a number of every member."""
    if series.sample == MEMBER:
        values = _arrays(result, series)[name]
        return np.array(values, series.columns[name].dtype)
    # Plane strain has no y.
    if name in ACROSS and name not in result.arrays:
        present = next(iter(series.columns))
        return np.zeros(member_column(result, present, series.sample).size)
    return member_column(result, name, series.sample)
