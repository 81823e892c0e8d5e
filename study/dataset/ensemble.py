"""What an ensemble knows: means over members, their standard error, and how much members differ."""

import math
from collections import Counter
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from solver.quantity import Quantity
from solver.sliding.sampling import ensemble_uncertainty
from study.dataset.variables import attributes
from study.manifest.cases import MEMBER

OBSERVABLES: Final = {
    "plateau_mean": "plateau F/W",
    "peak_friction": "largest F/W",
    "mean_step": "mean step, in L_x",
    "mean_drop": "mean drop of F/W",
    "static_friction": "μ_s",
    "kinetic_friction": "μ_k",
}
"""Variables that members make a distribution of."""


ONE_EVENT: Final = ("static_friction", "peak_friction")
"""Those that are one event of a record: what a member states of it is the scatter itself."""
PER_EVENT: Final = ("mean_step", "mean_drop")
"""Those that are means over events: a member counts by how many it has."""


def ensemble_variables(variables: Mapping[str, xr.Variable]) -> dict[str, xr.Variable]:
    """Mean, standard error and standard deviation over `member` of each observable that has it; none without members."""
    found: dict[str, xr.Variable] = {}
    for name in OBSERVABLES:
        if name in variables and MEMBER in variables[name].dims:
            found |= _reduced(name, variables)
    return found


def ensemble_name(name: str, part: str) -> str:
    """The variable that holds a part (`mean`, `uncertainty`, `std`) of an observable's ensemble."""
    return f"{name}_ensemble_{part}"


def ensemble_quantities(name: str, units: str = "1") -> dict[str, Quantity]:
    """Part -> the variable that holds it, of an observable with these units."""
    mean, error, std = (ensemble_name(name, part) for part in ("mean", "uncertainty", "std"))
    words = OBSERVABLES[name]
    return {
        "mean": Quantity(
            mean, f"mean of {words}", units, uncertainty=error, comment="over the members of the ensemble"
        ),
        "uncertainty": Quantity(
            error, f"error of the mean of {words}", units, comment="standard error of the mean over members"
        ),
        "std": Quantity(std, f"scatter of {words}", units, comment="standard deviation between members"),
    }


def _uncertainty_of(name: str, variable: xr.Variable) -> str:
    """The variable that holds what each member states of its own value; of a name that is free where members state nothing."""
    return str(variable.attrs.get("ancillary_variables", f"{name}_uncertainty"))


def _reduced(name: str, variables: Mapping[str, xr.Variable]) -> dict[str, xr.Variable]:
    variable = variables[name]
    dims = tuple(dim for dim in variable.dims if dim != MEMBER)
    values = _by_member(variable)
    stated = _by_member(variables.get(_uncertainty_of(name, variable), 0.0 * variable))
    spans = _by_member(variables["record_spacings"])
    if spans.ndim < values.ndim:  # a record serves all drives
        between = (1,) * (values.ndim - spans.ndim)
        spans = np.broadcast_to(spans.reshape(*spans.shape[:-1], *between, spans.shape[-1]), values.shape)
    weights = _by_member(variables["events"]) if name in PER_EVENT else np.ones_like(values)
    parts: dict[str, Any] = {
        "mean": lambda place: _mean(values[place], weights[place]),
        "uncertainty": lambda place: _uncertainty(name, values[place], stated[place], spans[place]),
        "std": lambda place: _std(values[place]),
    }
    found = {}
    for part, quantity in ensemble_quantities(name, str(variable.attrs["units"])).items():
        reduced = np.empty(values.shape[:-1])
        for place in np.ndindex(reduced.shape):
            reduced[place] = parts[part](place)
        found[quantity.name] = xr.Variable(dims, reduced, attributes(quantity))
    return found


def _uncertainty(
    name: str, values: NDArray[np.float64], stated: NDArray[np.float64], spans: NDArray[np.float64]
) -> float:
    """Standard error of the mean over members; of one event of each it is that of independent ones."""
    if name in ONE_EVENT:
        return _std(values) / math.sqrt(max(int(np.isfinite(values).sum()), 1))
    return ensemble_uncertainty(
        values, stated, float(np.mean(spans[np.isfinite(spans)])) if np.isfinite(spans).any() else 0.0
    )


def _by_member(variable: xr.Variable) -> NDArray[np.float64]:
    """Its numbers with the members last."""
    return np.moveaxis(variable.values.astype(float), variable.dims.index(MEMBER), -1)


def _mean(values: NDArray[np.float64], weights: NDArray[np.float64]) -> float:
    here = np.isfinite(values) & (weights > 0.0)
    return float(np.average(values[here], weights=weights[here])) if here.any() else float("nan")


def _std(values: NDArray[np.float64]) -> float:
    found = values[np.isfinite(values)]
    return float(np.std(found, ddof=1)) if len(found) > 1 else float("nan")


def over_members(dataset: xr.Dataset) -> xr.Dataset:
    """The scalars of a dataset with the members of each ensemble as one case; the dataset itself where it has no members.

    Observables and their uncertainties are the ensemble's, other numbers means over members, endings are counted.
    """
    if MEMBER not in dataset.dims:
        return dataset
    cases = dataset[[name for name in dataset.data_vars if set(dataset[name].dims) <= _dims_of_cases(dataset)]].load()
    kept = {name: each if MEMBER not in each.dims else _joined(each) for name, each in cases.data_vars.items()}
    for name in OBSERVABLES:
        if ensemble_name(name, "mean") in dataset:
            kept[name] = cases[ensemble_name(name, "mean")]
            kept[_uncertainty_of(name, cases[name].variable)] = cases[ensemble_name(name, "uncertainty")]
    coordinates = {name: each for name, each in cases.coords.items() if MEMBER not in each.dims}
    return xr.Dataset({name: each.variable for name, each in kept.items()}, coordinates, dataset.attrs)


def _dims_of_cases(dataset: xr.Dataset) -> set[Any]:
    return {dim for name in ("outcome", "drive_outcome") if name in dataset for dim in dataset[name].dims}


def _joined(array: xr.DataArray) -> xr.DataArray:
    """One value of all members: the mean of numbers, all flags that any has, texts that occur with their counts."""
    if "flag_masks" in array.attrs:
        return array.reduce(np.bitwise_or.reduce, MEMBER, keep_attrs=True)
    if array.dtype.kind not in "OUT":
        return array.astype(float).mean(MEMBER, keep_attrs=True)
    values = np.moveaxis(array.values, array.dims.index(MEMBER), -1)
    texts = np.empty(values.shape[:-1], dtype=object)
    for place in np.ndindex(texts.shape):
        texts[place] = _counted(values[place])
    return xr.DataArray(texts, dims=[dim for dim in array.dims if dim != MEMBER], attrs=array.attrs)


def _counted(values: NDArray[Any]) -> str:
    """The text that all members have, else every text with the number of members that have it."""
    counts = Counter(str(value) for value in values)
    if len(counts) == 1:
        return next(iter(counts))
    return "; ".join(f"{count} {text}" for text, count in counts.most_common() if text)
