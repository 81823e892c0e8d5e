"""Lines that can be drawn of one case: its friction record, the spring force of its drive, its contact pressure."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from study.dataset.access.accessor import Accessor
from study.dataset.groups import groups_of


@dataclass(frozen=True, slots=True)
class Curve:
    """One line: values over places, and what both are."""

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    x_label: str
    y_label: str


def curves(case: xr.Dataset) -> Iterator[Curve]:
    """The lines that a case has: F/W over δ_p; of a single drive the spring force over time; p over x without a record.

    case: of study.dataset.access.single, one member of an ensemble.
    """
    see = Accessor(case)
    if _has(case, "record", "event"):
        yield _curve(see.teeth(), "displacement", "friction_force")
    elif _has(case, "contact", "contact_node"):
        last = see.contact().isel(event=-1, missing_dims="ignore")
        yield _curve(last, "x", "pressure")
    if _has(case, "trajectory", "sample"):
        yield _curve(see.trajectory(), "time", "sample_spring_force")


def _has(case: xr.Dataset, group: str, sample: str) -> bool:
    """Whether a case has a run of its own in a group, with values along a sample dimension."""
    name = f"{group}_id"
    own = name in case and not case[name].dims and bool(case[name].item())
    return own and sample in groups_of(case)[group].dims


def _curve(run: xr.Dataset, x: str, y: str) -> Curve:
    return Curve(run[x].values, run[y].values, _label(run[x].attrs), _label(run[y].attrs))


def _label(attributes: dict[Any, Any]) -> str:
    """Meaning of a variable, with its symbol and a unit that is not 1."""
    unit = attributes.get("units", "1")
    parts = [attributes["long_name"], attributes.get("symbol", ""), "" if unit == "1" else f"in {unit}"]
    return ", ".join(part for part in parts if part)
