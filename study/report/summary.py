"""The cases of a dataset as a table: one row each, labelled by the parameters in which they differ."""

import itertools
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import xarray as xr

from solver.sliding.validity import flags_in
from study.dataset.ensemble import over_members
from study.dataset.variables import VALIDITY, parameters
from study.manifest.parameters import Value
from study.plan.flags import flag_lines
from study.report.console import Table

MOST_ROWS: Final = 500
"""The most rows of a table on the terminal or the page."""
FEW: Final = 50
"""Drives whose endings are not counted."""
SYMBOLS: Final = {name: each.symbol for name, each in parameters().items() if each.symbol}
"""Parameter -> what tables and figures call it."""


@dataclass(frozen=True, slots=True)
class Point:
    """One case of a dataset, with its drive where there are drives."""

    label: dict[str, Value]
    """The parameters in which it differs from the other cases."""
    values: xr.Dataset
    """The scalars of this case."""
    selection: dict[str, Value]
    """What singles it out for the accessor of study.dataset.access."""


def points(dataset: xr.Dataset, variable: str) -> Iterator[Point]:
    """The cases that a variable has, with their drives where it has them, in the variable's order."""
    dims = dataset[variable].dims
    varying = [str(name) for name in _varying(dataset, dims)]
    scalars = dataset[[name for name in dataset.data_vars if set(dataset[name].dims) <= set(dims)]].load()
    for position in np.ndindex(*(dataset.sizes[dim] for dim in dims)):
        values = scalars.isel(dict(zip(dims, position, strict=True)))
        label = {name: values[name].item() for name in varying}
        selection = {str(dim): values[dim].item() for dim in dims}
        yield Point(label, values, selection)


def scalar_table(dataset: xr.Dataset) -> Table:
    """One row for each case and drive, up to `MOST_ROWS`; the members of an ensemble are one row."""
    dataset = over_members(dataset)
    found = points(dataset, "static_friction" if "static_friction" in dataset else "outcome")
    shown = list(itertools.islice(found, MOST_ROWS))
    columns = [(title, names) for title, names in _COLUMNS if names[0] in dataset]
    varying = tuple(shown[0].label)
    header = (*(SYMBOLS.get(name, name) for name in varying), *(title for title, _ in columns), "outcome")
    rows = [
        (
            *(_number(point.label[name]) for name in varying),
            *(_cell(point.values, names) for _, names in columns),
            _ending(point.values),
        )
        for point in shown
    ]
    if next(found, None) is not None:
        rows.append((*("…" for _ in header[1:]), f"the dataset has more than {MOST_ROWS} rows"))
    return Table(header, tuple(rows))


def flag_summary(dataset: xr.Dataset) -> list[str]:
    """One line for each validity flag: how many cases have it, the first of them, and the advice."""
    if VALIDITY.name not in dataset:
        return []
    dataset = over_members(dataset)
    masks = dataset[VALIDITY.name]
    varying = [str(name) for name in _varying(dataset, masks.dims)]

    def first(number: int) -> str:
        here = masks[np.unravel_index(number, masks.shape)]
        return words({name: here[name].item() for name in varying})

    return flag_lines(masks.values.ravel().tolist(), first if masks.size > 1 else lambda _: "")


def drive_summary(dataset: xr.Dataset) -> list[str]:
    """How many drives ended how, and what their pins did; nothing of so few that a look at the table tells."""
    endings = [name for name in ("drive_outcome", "regime") if name in dataset and dataset[name].size > FEW]
    lines = []
    for name in endings:
        counts = Counter(dataset[name].values.ravel().tolist())
        said = ", ".join(f"{count} {word}" for word, count in counts.most_common() if word)
        if said:
            lines.append(f"{name} of {dataset[name].size} drives: {said}")
    return lines


def words(label: dict[str, Value]) -> str:
    """A label as text: `R/L_x = 200, normal_load = 0.001`."""
    return ", ".join(f"{SYMBOLS.get(name, name)} = {_number(value)}" for name, value in label.items())


_COLUMNS: Final = (
    ("plateau F/W", ("plateau_mean", "plateau_uncertainty")),
    ("peak F/W", ("peak_friction",)),
    ("K/(G·L_y)", ("surface_stiffness",)),
    ("μ_s", ("static_friction", "static_friction_uncertainty")),
    ("μ_k", ("kinetic_friction", "kinetic_friction_uncertainty")),
    ("events", ("events",)),
    ("spacings", ("record_spacings",)),
    ("δ_p/L_x", ("final_displacement",)),
)


def _varying(dataset: xr.Dataset, dims: tuple[Any, ...]) -> list[Any]:
    """Coordinates with more than one value: dimensions, or the parameters along the dimension `case`."""
    if "case" not in dims:
        return [dim for dim in dims if dataset.sizes[dim] > 1]
    along = [name for name in dataset.coords if "case" in dataset[name].dims and name not in ("case", "case_id")]
    several = [name for name in along if len(set(dataset[name].values.ravel().tolist())) > 1]
    return (several or ["case"]) + [dim for dim in dims if dim != "case"]


def _number(value: Value) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _cell(values: xr.Dataset, names: tuple[str, ...]) -> str:
    value, *uncertainty = (float(values[name]) for name in names if name in values)
    if math.isnan(value):
        return "–"
    if uncertainty and math.isfinite(uncertainty[0]):
        return f"{value:.4g} ± {uncertainty[0]:.1g}"
    return f"{value:.5g}"


def _ending(values: xr.Dataset) -> str:
    """How a case and its drive ended: the first bad outcome with its advice, and the case's flags in brackets."""
    ending, message = "completed", ""
    for found, why in (("outcome", "message"), ("drive_outcome", "drive_message")):
        if found in values and (values[found] != "completed" or values[why] != ""):
            ending, message = str(values[found].item()), str(values[why].item())
            break
    flags = flags_in(int(values[VALIDITY.name])) if VALIDITY.name in values else ()
    named = f" [{', '.join(flag.name for flag in flags)}]" if flags else ""
    return f"{ending}{named}" + (f": {message}" if message else "")
