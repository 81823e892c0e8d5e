"""Runs of different length, one behind the other: CF contiguous ragged arrays with the labels of what they belong to."""

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any, Final

import numpy as np
import xarray as xr
from numpy.typing import DTypeLike, NDArray

from nanoslip.solver.parameter import attributes
from nanoslip.study.canonical import content_hash
from nanoslip.study.dataset.variables import Group, Series
from nanoslip.study.plan.kinds.kind import MEMBER, column
from nanoslip.study.plan.task import TaskResult

# Texts of an ensemble: what all members say, else how many say what; and the same in few letters, for tables.

LONGEST: Final = 30
"""Characters of a counted text in a table; of a longer one the most frequent text is told, and how many say something else."""
_PARTS: Final = re.compile(r"; (?=\d+ )")
_COUNT: Final = re.compile(r"(\d+) ")


def counted(values: Sequence[Any]) -> str:
    """The text that all members have, else every text with the number of members that have it, the most frequent first."""
    counts = Counter(str(value) for value in values)
    if len(counts) == 1:
        return next(iter(counts))
    return "; ".join(f"{count} {text}" for text, count in counts.most_common() if text)


def is_counted(text: str) -> bool:
    """Whether a text begins with a number of members."""
    return _COUNT.match(text) is not None


def _parts(text: str) -> list[tuple[int, str]]:
    """Of a counted text: how many members say what."""
    return [(int(number), said) for number, _, said in (part.partition(" ") for part in _PARTS.split(text))]


def commonest(text: str) -> tuple[str, float]:
    """The text that most members have, and their share of those that have any; all of it of a text that is not counted."""
    if not is_counted(text):
        return text, 1.0
    parts = _parts(text)
    return parts[0][1], parts[0][0] / sum(number for number, _ in parts)


def joined(text: str) -> str:
    """A counted text in which texts that differ in numbers alone are one, the first of them, with the members of all."""
    if not is_counted(text):
        return text
    kinds: dict[str, list[tuple[int, str]]] = {}
    for number, said in _parts(text):
        kinds.setdefault(without_numbers(said), []).append((number, said))
    found = [
        f"{sum(number for number, _ in each)} {each[0][1]}{' (numbers differ)' if len(each) > 1 else ''}"
        for each in sorted(kinds.values(), key=lambda each: -sum(number for number, _ in each))
    ]
    return "; ".join(found)


@lru_cache(maxsize=1024)  # of a million messages few are different
def without_numbers(message: str) -> str:
    """A message without its numbers: what those have in common that differ in nothing else."""
    return re.sub(r"\d[\d.e+-]*", "#", message)


def shortened(text: str) -> str:
    """A counted text in at most `LONGEST` characters where its first words allow it; any other text as it is."""
    first, *others = _PARTS.split(text)
    if len(text) <= LONGEST or not others or not is_counted(first):
        return text
    numbers = [int(found[1]) for each in others if (found := _COUNT.match(each))]
    return f"{first}; {sum(numbers)} others"


def in_short(dataset: xr.Dataset) -> xr.Dataset:
    """A dataset whose counted texts are short, for a table."""
    texts = {str(name): each for name, each in dataset.data_vars.items() if each.dtype.kind == "O"}
    return dataset.assign({name: each.copy(data=_each_shortened(each.values)) for name, each in texts.items()})


def _each_shortened(values: Any) -> Any:
    found = np.empty(values.shape, dtype=object)
    found.ravel()[:] = [shortened(value) if isinstance(value, str) else value for value in values.ravel().tolist()]
    return found


NAME_LENGTH: Final = 12
"""Hexadecimal digits of a run's name."""
HELD: Final = 1 << 23
"""Bytes of a column's samples that are held in memory: more go to disk meanwhile."""


class Samples:
    """Values along a sample dimension, one run behind the other: however many there are, few of them in memory."""

    def __init__(self, folder: Path | None) -> None:
        """folder: where many lie until nobody has them any more, without a name; None for the system's own."""
        self._folder = folder
        self._runs: list[NDArray[Any]] = []
        self._held = 0
        self._file: IO[bytes] | None = None

    def add(self, run: NDArray[Any]) -> None:
        """Append values; all runs are of one type. Raises OSError where the disk refuses."""
        self._runs.append(run.copy())  # a view would keep all of its result
        self._held += run.nbytes
        if self._held > HELD:
            self._file = self._file or TemporaryFile(dir=self._folder)  # noqa: SIM115  the values are mapped from it
            np.concatenate(self._runs).tofile(self._file)
            self._runs, self._held = [run[:0].copy()], 0

    def values(self, dtype: DTypeLike) -> NDArray[Any]:
        """All of them; of this type where there are none."""
        rest = np.concatenate(self._runs) if self._runs else np.empty(0, dtype)
        if self._file is None:
            return rest
        with self._file as file:
            rest.tofile(file)
            return np.memmap(file, rest.dtype, "c")


class Runs:
    """The runs of one group. Results that several cases share are kept once."""

    def __init__(self, group: Group, folder: Path | None = None) -> None:
        """folder: where long columns lie meanwhile."""
        self.group = group
        self._names: dict[tuple[str, ...], str] = {}
        self._owners: list[tuple[str, str]] = []
        self._counts: dict[str, list[int]] = {name: [] for name in group.samples}
        self._columns = {name: Samples(folder) for name in group.columns}

    def add(self, results: Sequence[TaskResult], factors: Mapping[str, float], case_id: str, drive: str) -> str:
        """Append the run of a case's results of the group's kinds; returns its name, empty where there is nothing.

        factors: by `Quantity.per`.
        """
        parts = _once([result for result in results if self._held(result)])
        keys = tuple(result.key for result in parts)
        if not keys or keys in self._names:
            return self._names.get(keys, "")
        for sample, series in self.group.samples.items():
            pairs = [(each, result) for result in parts for each in series if each.kind == result.kind]
            self._counts[sample].append(sum(_length(each, result) for each, result in pairs))
            for each, result in pairs:
                for name, quantity in each.columns.items():
                    run = _run(result, name, each)
                    self._columns[quantity.name].add(run * factors[quantity.per] if quantity.per else run)
        self._owners.append((case_id, drive))
        name = keys[0][:NAME_LENGTH] if len(keys) == 1 else content_hash(keys, length=NAME_LENGTH)
        return self._names.setdefault(keys, name)

    def _held(self, result: TaskResult) -> bool:
        """Whether a result has the columns of the group, and not its scalars alone."""
        return any(each.kind == result.kind and set(each.columns) <= _there(result, each) for each in self.group.series)

    def dataset(self) -> xr.Dataset:
        """The columns over the samples; over the instances their names, owners and the count of samples."""
        found: dict[str, Any] = {}
        for sample, series in self.group.samples.items():
            count = series[0].count
            counts = np.array(self._counts[sample], np.int64)
            found[count.name] = (self.group.name, counts, {**attributes(count), "sample_dimension": sample})
        for name, quantity in self.group.columns.items():
            found[name] = (quantity.along, self._columns[name].values(quantity.dtype), attributes(quantity))
        places = [name for name, quantity in self.group.columns.items() if quantity.coordinate]
        return xr.Dataset(found).set_coords(places).assign_coords(self._labels())

    def _labels(self) -> dict[str, Any]:
        instance = self.group.name
        labels: dict[str, Any] = {instance: (instance, texts(self._names.values()), attributes(self.group.label))}
        for number, owner in enumerate(self.group.owners):
            labels[owner.name] = (instance, texts(names[number] for names in self._owners), attributes(owner))
        return labels


def _once(results: list[TaskResult]) -> list[TaskResult]:
    """Without initial contact where states of the contact begin with it."""
    if len(results) > 1 and 0 in results[-1].arrays["surface_event"]:
        return results[-1:]
    return results


def _there(result: TaskResult, series: Series) -> set[str]:
    return set(result.scalars if series.sample == MEMBER else result.arrays)


def _run(result: TaskResult, name: str, series: Series) -> NDArray[Any]:
    """The first member's column; or a number of every member."""
    if series.sample == MEMBER:
        return np.array(result.scalars[name], float)
    return column(result, name, series.sample)


def _length(series: Series, result: TaskResult) -> int:
    return int(_run(result, next(iter(series.columns)), series).size)


def texts(values: Iterable[str]) -> NDArray[Any]:
    """Strings as an array that netCDF keeps at their length."""
    return np.array(list(values), dtype=object)


def starts(counts: NDArray[Any]) -> NDArray[np.int64]:
    """Where each run of so many values begins, and where the last one ends."""
    return np.concatenate(([0], np.cumsum(counts, dtype=np.int64)))


def windows(group: xr.Dataset, declared: Group) -> dict[str, tuple[str, NDArray[np.int64]]]:
    """Sample dimension that a group has -> the variable of its counts, and where each run begins."""
    counts = {name: series[0].count.name for name, series in declared.samples.items()}
    return {
        name: (count, starts(group.variables[count].values))
        for name, count in counts.items()
        if count in group.variables
    }
