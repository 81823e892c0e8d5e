"""A dataset as one flat table: a row for each case (and drive), or for each event or sample; parameters first, then numbers."""

from dataclasses import dataclass
from typing import Any

import xarray as xr

from nanoslip.study.dataset.access.accessor import Accessor
from nanoslip.study.dataset.variables import OUTCOMES, all_groups


@dataclass(frozen=True, slots=True)
class Column:
    """One variable over all rows."""

    name: str
    units: str
    """Empty where it has none: words, names, switches."""
    meaning: str
    values: list[Any]


def case_columns(root: xr.Dataset) -> list[Column]:
    """Every parameter and scalar of a dataset over its cases, or over its cases and drives where it has drives."""
    ending = root[next(name for kind in ("drive", "") if (name := OUTCOMES[kind][0].name) in root)]
    ids = {group.id.name for group in all_groups().values()}
    names = [name for name in (*ending.dims, *root.coords, *root.data_vars) if set(root[name].dims) <= set(ending.dims)]
    return [_column(root[name], ending) for name in dict.fromkeys(names) if name not in ids]


def event_columns(root: xr.Dataset) -> list[Column]:
    """Every event of every friction record. Raises ValueError where the dataset has none."""
    return _long(Accessor(root).events())


def sample_columns(root: xr.Dataset) -> list[Column]:
    """Every sample of every drive. Raises ValueError where the dataset has none."""
    return _long(Accessor(root).samples())


def _long(table: xr.Dataset) -> list[Column]:
    """The runs of a group: whose they are, the number within a run, then the group's own columns."""
    own = {name for group in all_groups().values() for name in group.columns}
    labels = [name for name in table.coords if name not in (*own, *table.dims)]
    names = dict.fromkeys([*labels, *table.coords, *table.data_vars])
    return [_column(table[name], table[labels[0]]) for name in names if name not in table.dims]


def _column(values: xr.DataArray, over: xr.DataArray) -> Column:
    attributes = values.attrs
    return Column(
        str(values.name), attributes.get("units", ""), attributes.get("long_name", ""), values_over(values, over)
    )


def values_over(values: xr.DataArray, over: xr.DataArray) -> list[Any]:
    """The values of a variable at each place of another one of its dataset, which lies along all its dimensions; in order."""
    laid = values.variable.set_dims(dict(over.sizes))  # type: ignore[no-untyped-call]  # without eighty coordinates
    found: list[Any] = laid.values.ravel().tolist()
    return found
