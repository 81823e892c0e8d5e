"""Which software computed the results of a dataset: each result counts once, however many cases share it."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.parameter import attributes
from nanoslip.study.dataset.collection.ragged import texts
from nanoslip.study.dataset.file import MIXED
from nanoslip.study.dataset.variables import SOFTWARE
from nanoslip.study.origin import Origin, Origins, census, mixture


class Makers:
    """The results of a campaign, piece by piece. Of millions of them little is kept: keys as bytes, and a number."""

    def __init__(self) -> None:
        self._origins: dict[Origins, int] = {}
        self._keys: list[NDArray[np.bytes_]] = []
        self._numbers: list[NDArray[np.int32]] = []

    def add(self, made: Mapping[str, Origins]) -> None:
        """made: key -> which software a result stems from."""
        # Few objects are told apart by where they are: their hash takes longer.
        each = {id(origins): origins for origins in made.values()}
        number = {where: self._origins.setdefault(origins, len(self._origins)) for where, origins in each.items()}
        self._keys.append(np.array(list(made), np.bytes_))
        self._numbers.append(np.fromiter((number[id(its)] for its in made.values()), np.int32, len(made)))

    def census(self) -> Counter[Origin]:
        """How many results stem from which software."""
        found = Counter[Origin]()
        if self._keys:
            _, first = np.unique(np.concatenate(self._keys), return_index=True)
            counts = np.bincount(np.concatenate(self._numbers)[first], minlength=len(self._origins))
            for origins, count in zip(self._origins, counts.tolist(), strict=True):
                for origin, one in census([origins]).items():
                    found[origin] += count * one
        return found


def software(counts: Mapping[Origin, int]) -> xr.Dataset:
    """The software that computed the results, one origin each."""
    origins = sorted(counts)
    name, count, *facts = SOFTWARE
    found: dict[str, Any] = {
        name.name: (name.name, texts(origin.name for origin in origins), attributes(name)),
        count.name: (name.name, np.array([counts[origin] for origin in origins], np.int64), attributes(count)),
    }
    for item, quantity in zip(fields(Origin), facts, strict=True):
        found[quantity.name] = (name.name, texts(getattr(each, item.name) for each in origins), attributes(quantity))
    return xr.Dataset(found)


def software_attributes(counts: Mapping[Origin, int]) -> dict[str, str]:
    """What the software is that computed the results; where several did, all of it, the most frequent first."""
    found = {}
    for item in fields(Origin):
        values: Counter[str] = Counter()
        for origin, count in counts.items():
            values[getattr(origin, item.name)] += count
        several = [f"{value} ({count} results)" for value, count in sorted(values.items(), key=lambda v: (-v[1], v[0]))]
        found[item.name] = ", ".join(several if len(several) > 1 else values) or "nothing is computed yet"
    mixed = mixture(counts)
    return {**found, MIXED: mixed} if mixed else found
