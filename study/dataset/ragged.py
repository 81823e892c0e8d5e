"""Runs of different length, one behind the other: CF contiguous ragged arrays, and the way back to one run."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from study.dataset.variables import ABSENT, Series, all_series, attributes
from study.manifest.parameters import Value
from study.plan.task import TaskResult


class Runs:
    """The runs of one series. Results that several cases share are kept once."""

    def __init__(self, series: Series) -> None:
        self.series = series
        self._number: dict[str, int] = {}
        self._owners: list[tuple[str, str]] = []
        self._counts: list[int] = []
        self._columns: dict[str, list[NDArray[Any]]] = {name: [] for name in series.columns}

    def add(self, result: TaskResult, factors: dict[str, float], case_id: str, drive: str) -> int:
        """Append the run of a result and return its number. factors: by `Quantity.per`."""
        if result.key in self._number:
            return self._number[result.key]
        runs = {name: result.arrays[name] for name in self._columns if name in result.arrays}
        if not runs:
            return ABSENT
        self._counts.append(next(iter(runs.values())).size)
        self._owners.append((case_id, drive))
        for name, run in runs.items():
            per = self.series.columns[name].per
            self._columns[name].append(run * factors[per] if per else run)
        return self._number.setdefault(result.key, len(self._number))

    def variables(self) -> dict[str, Any]:
        """The columns over the samples; over the instances the count of samples and what each belongs to."""
        instance, sample = self.series.instance, self.series.sample
        count = self.series.count
        counts = np.array(self._counts, np.int64)
        found: dict[str, Any] = {
            count.name: (instance, counts, {**attributes(count), "sample_dimension": sample}),
        }
        for number, owner in enumerate(self.series.owners):
            found[owner.name] = (instance, texts(names[number] for names in self._owners), attributes(owner))
        for name, quantity in self.series.columns.items():
            runs = self._columns[name]
            values = np.concatenate(runs) if runs else np.full(sum(self._counts), np.nan)
            found[quantity.name] = (sample, values, attributes(quantity))
        return found


def texts(values: Iterable[str]) -> NDArray[Any]:
    """Strings as an array that netCDF keeps at their length."""
    return np.array(list(values), dtype=object)


def record(dataset: xr.Dataset, **selection: Value) -> xr.Dataset:
    """The friction record of one case, over `event`; nothing is read before it is used.

    selection: what singles out the case, by names of coordinates (`intrinsic_friction=0.5, radius=50.0`).
    Raises KeyError where no case is like that, ValueError where several are or the one has no record.
    """
    return _cut(dataset, "record", selection)


def trajectory(dataset: xr.Dataset, **selection: Value) -> xr.Dataset:
    """The motion of the pin for one case and drive over `sample`, and its macroscopic slips over `slip_phase`.

    As `record`, with `drive="name"` in the selection where there are several.
    """
    return _cut(dataset, "trajectory", selection)


def _cut(dataset: xr.Dataset, instance: str, selection: dict[str, Value]) -> xr.Dataset:
    numbers = dataset[f"{instance}_index"]
    for name, value in selection.items():
        if name in numbers.indexes:
            numbers = numbers.sel({name: value})
        else:  # a parameter along `case`
            numbers = numbers.isel({numbers[name].dims[0]: np.flatnonzero(numbers[name] == value)})
    if numbers.size != 1:
        several = ", ".join(f"{name} has {size} values" for name, size in numbers.sizes.items() if size != 1)
        raise ValueError(f"{selection}: needs to single out one case, but {several}")
    number = int(numbers.item())
    if number == ABSENT:
        raise ValueError(f"{selection}: this case has no {instance}")
    runs = [series for series in all_series() if series.instance == instance and series.count.name in dataset]
    window = {}
    for series in runs:
        counts = dataset[series.count.name].values
        start = int(counts[:number].sum())
        window[series.sample] = slice(start, start + int(counts[number]))
    names = [name for name in dataset.data_vars if set(dataset[name].dims) & set(window)]
    return dataset[names].isel(window).assign_coords(numbers.squeeze().coords)
