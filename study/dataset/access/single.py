"""One case of a dataset by the values of its parameters, in a manifest's words: with all its drives, or with one of them."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from nanoslip.study.dataset.access.selection import places
from nanoslip.study.dataset.variables import OUTCOMES
from nanoslip.study.manifest.checker import number_or_text
from nanoslip.study.manifest.parameters import words


def one_case(root: xr.Dataset, given: Mapping[str, str]) -> xr.Dataset:
    """The part of a dataset that is one case, without the dimensions that this leaves one value of.

    given: parameter, as manifests or datasets call it -> its value as text. The drives of the case may be several.

    Raises KeyError where no case is like that, ValueError with what is left to choose where several are.
    """
    ending = next(name for kind in ("drive", "") if (name := OUTCOMES[kind][0].name) in root)
    selection = {name: _value(root, name, text) for name, text in _named(given).items()}
    found = places(root, ending, selection)
    left = {dim: np.unique(column) for dim, column in zip(found.dims, found.positions.T, strict=True)}
    of_cases = [str(dim) for dim in root[OUTCOMES[""][0].name].dims]
    part = root.isel({dim: where if len(where) > 1 else where[0] for dim, where in left.items()})
    if several := [dim for dim in of_cases if len(left[dim]) > 1]:
        raise ValueError(f"needs to be one case: give also {'; '.join(_choices(part, several))}")
    return part


def _named(given: Mapping[str, str]) -> dict[str, str]:
    """The same by the names that datasets have."""
    return {words().get(word, word): text for word, text in given.items()}


def _value(root: xr.Dataset, name: str, text: str) -> Any:
    """A value as its coordinate has it: what looks like a number may be a name."""
    return text if name in root.coords and root[name].dtype.kind in "OUT" else number_or_text(text)


def _choices(part: xr.Dataset, dims: Iterable[str]) -> list[str]:
    """The parameters in which cases differ along dimensions, each with its values."""
    along = [str(name) for name in part.coords if set(part[name].dims) & set(dims) and name != "case_id"]
    values = {name: part[name].to_series().dropna().unique().tolist() for name in along}
    told = {name: found for name, found in values.items() if len(found) > 1 and (name != "case" or len(along) == 1)}
    return [
        f"{name} = {', '.join(map(str, found[:8]))}{', …' if len(found) > 8 else ''}" for name, found in told.items()
    ]
