"""What an ensemble knows: means over members, their standard error, and how much members differ."""

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from solver.outcome import Ending
from solver.quantity import Quantity, attributes
from solver.sliding.sampling import Members, uncertainty_of_members
from study.dataset.collection.counted import counted
from study.dataset.variables import MEMBERS_USED, MEMBERS_WITH_CYCLE, OUTCOMES, all_scalars
from study.manifest.cases import MEMBER
from study.plan.kinds.ensemble import DRAWN
from study.plan.standing.endings import NOTHING_KNOWN

OUTCOME: Final = OUTCOMES[""][0].name
OWN: Final = "own"
"""`Quantity.ensemble` of what has no mean over members."""
NOT_NEEDED: Final = Ending.NOT_NEEDED.value


def observables() -> dict[str, Quantity]:
    """The variables that members make an ensemble of, by name: those that are declared so (`Quantity.ensemble`)."""
    return {name: each for name, each in _declared().items() if each.ensemble != OWN}


def _declared() -> dict[str, Quantity]:
    return {name: each for name, each in all_scalars().items() if each.ensemble}


def ensemble_variables(variables: Mapping[str, xr.Variable]) -> dict[str, xr.Variable]:
    """Mean, standard error and standard deviation over `member` of each observable that has it; none without members."""
    if MEMBER not in variables[OUTCOME].dims:
        return {}
    found = {MEMBERS_USED.name: _members_used(variables)}
    if _CYCLE in variables:
        found[MEMBERS_WITH_CYCLE.name] = _members_with_cycle(variables[_CYCLE])
    for name, observable in observables().items():
        if name in variables:
            found |= _reduced(observable, variables)
    return found


def _members_used(variables: Mapping[str, xr.Variable]) -> xr.Variable:
    ended = variables[OUTCOME]
    used = ~np.isin(_members_last(ended), [*NOTHING_KNOWN, NOT_NEEDED])
    return xr.Variable(_without_member(ended), used.sum(axis=-1), attributes(MEMBERS_USED))


_CYCLE: Final = "cycle_events"
"""0 where the end of a record does not repeat itself, NaN where there is no record."""


def _members_with_cycle(events: xr.Variable) -> xr.Variable:
    found = (_by_member(events) > 0.0).sum(axis=-1)
    return xr.Variable(_without_member(events), found, attributes(MEMBERS_WITH_CYCLE))


def ensemble_name(name: str, part: str) -> str:
    """The variable that holds a part (one of PARTS) of an observable's ensemble."""
    return f"{name}_ensemble_{part}"


def ensemble_quantities(observable: Quantity) -> dict[str, Quantity]:
    """Part -> the variable that holds it, of an observable."""
    mean, error, std, error_of_std, members = (ensemble_name(observable.name, part) for part in PARTS)
    words, units = observable.long_name, observable.units
    return {
        "mean": Quantity(
            mean, f"mean of {words}", units, uncertainty=error, comment="over the members of the ensemble"
        ),
        "uncertainty": Quantity(error, f"error of {words}", units, comment="standard error of the mean over members"),
        "std": Quantity(
            std, f"scatter of {words}", units, uncertainty=error_of_std, comment="standard deviation between members"
        ),
        "std_uncertainty": Quantity(error_of_std, "error of that scatter", units, comment=_OF_STD),
        "members": Quantity(
            members, "members that mean and scatter are of", comment=f"those that have {observable.name}"
        ),
    }


PARTS: Final = ("mean", "uncertainty", "std", "std_uncertainty", "members")
"""What is known of an ensemble's observable."""
_OF_STD: Final = "its standard error as of n normal members, a share of 1/√(2(n - 1)) of it"


def _reduced(observable: Quantity, variables: Mapping[str, xr.Variable]) -> dict[str, xr.Variable]:
    variable = variables[observable.name]
    values = _by_member(variable)
    nothing = 0.0 * variable
    stated, common = (
        _by_member(variables.get(name, nothing)) for name in (observable.uncertainty, observable.in_common)
    )
    spans = _of_each(_by_member(variables["record_spacings"]), values.shape)
    drawn = _of_each(_by_member(variables.get(DRAWN, 0.0 * variables["record_spacings"])), values.shape)
    needed = _of_each(_members_last(variables[OUTCOME]) != NOT_NEEDED, values.shape)
    weights = _by_member(variables["events"]) if observable.ensemble == "per_event" else np.ones_like(values)
    members = Members(values, stated, common, spans, drawn)
    parts: dict[str, Any] = {
        "mean": lambda place: _mean(values[place], weights[place]),
        "uncertainty": lambda place: uncertainty_of_members(observable.ensemble, members.of(place).of(needed[place])),
        "std": lambda place: _std(values[place]),
        "std_uncertainty": lambda place: _error_of_std(values[place]),
        "members": lambda place: np.isfinite(values[place]).sum(),
    }
    found = {}
    for part, quantity in ensemble_quantities(observable).items():
        reduced = np.empty(values.shape[:-1], np.int64 if part == "members" else np.float64)
        for place in np.ndindex(reduced.shape):
            reduced[place] = parts[part](place)
        found[quantity.name] = xr.Variable(_without_member(variable), reduced, attributes(quantity))
    return found


def _of_each(record: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    """What is known of each record, of each of its drives where the shape has them."""
    drives = (1,) * (len(shape) - record.ndim)
    return np.broadcast_to(record.reshape(*record.shape[:-1], *drives, record.shape[-1]), shape)


def _by_member(variable: xr.Variable) -> NDArray[np.float64]:
    """Its numbers with the members last."""
    return _members_last(variable).astype(float)


def _members_last(variable: xr.Variable) -> NDArray[Any]:
    return np.moveaxis(variable.values, variable.dims.index(MEMBER), -1)


def _without_member(variable: xr.Variable) -> tuple[Any, ...]:
    return tuple(dim for dim in variable.dims if dim != MEMBER)


def _mean(values: NDArray[np.float64], weights: NDArray[np.float64]) -> float:
    here = np.isfinite(values) & (weights > 0.0)
    return float(np.average(values[here], weights=weights[here])) if here.any() else float("nan")


def _std(values: NDArray[np.float64]) -> float:
    found = values[np.isfinite(values)]
    return float(np.std(found, ddof=1)) if len(found) > 1 else float("nan")


def _error_of_std(values: NDArray[np.float64]) -> float:
    members = int(np.isfinite(values).sum())
    return _std(values) / math.sqrt(2.0 * (members - 1)) if members > 1 else float("nan")


def over_members(dataset: xr.Dataset) -> xr.Dataset:
    """The scalars of a dataset with the members of each ensemble as one case; the dataset itself where it has no members.

    Observables and their uncertainties are the ensemble's, other numbers means over the members that have them, endings are
    counted. `NAME_ensemble_members` says of each number how many have it. What has no mean over members is left out.
    """
    if MEMBER not in dataset.dims:
        return dataset
    cases = dataset[[name for name in dataset.data_vars if set(dataset[name].dims) <= _dims_of_cases(dataset)]].load()
    cases = cases.drop_vars([name for name, each in _declared().items() if each.ensemble == OWN], errors="ignore")
    used = cases[OUTCOME] != NOT_NEEDED
    kept = {str(name): _joined(each, used) if MEMBER in each.dims else each for name, each in cases.data_vars.items()}
    kept |= {
        ensemble_name(str(name), "members"): _having(each) for name, each in cases.data_vars.items() if _averaged(each)
    }
    for name, observable in observables().items():
        if ensemble_name(name, "mean") in dataset:
            own = {name: cases[ensemble_name(name, "mean")]}
            own[observable.uncertainty or f"{name}_uncertainty"] = cases[ensemble_name(name, "uncertainty")]
            kept |= own | _twins(cases, own)
    coordinates = {name: each for name, each in cases.coords.items() if MEMBER not in each.dims}
    return xr.Dataset({name: each.variable for name, each in kept.items()}, coordinates, dataset.attrs)


def _averaged(array: xr.DataArray) -> bool:
    return MEMBER in array.dims and "flag_masks" not in array.attrs and array.dtype.kind not in "OUT"


def _having(array: xr.DataArray) -> xr.DataArray:
    return array.notnull().sum(MEMBER)


def _twins(cases: xr.Dataset, reduced: Mapping[str, xr.DataArray]) -> dict[str, xr.DataArray]:
    """The same numbers in SI or over μ_i, where the cases have them: of all members the same multiple."""
    twins = {name: each.si.name for name, each in all_scalars().items() if each.si}
    found = {}
    for name, values in reduced.items():
        if (twin := twins.get(name, "")) in cases:
            factor = (cases[twin] / cases[name]).mean(MEMBER)
            found[twin] = (values * factor).assign_attrs(cases[twin].attrs)
    return found


def _dims_of_cases(dataset: xr.Dataset) -> set[Any]:
    return {dim for name in ("outcome", "drive_outcome") if name in dataset for dim in dataset[name].dims}


def _joined(array: xr.DataArray, used: xr.DataArray) -> xr.DataArray:
    """One value of all members: the mean of numbers, all flags that any has, texts that occur with their counts.

    used: which members are needed; the others have neither numbers nor flags, but say that they are not.
    """
    if "flag_masks" in array.attrs:
        return array.reduce(np.bitwise_or.reduce, MEMBER, keep_attrs=True)
    if _averaged(array):
        return array.astype(float).mean(MEMBER, keep_attrs=True)
    values, counting = (
        _members_last(each.variable) for each in (array, used.broadcast_like(array).transpose(*array.dims))
    )
    texts = np.empty(values.shape[:-1], dtype=object)
    for place in np.ndindex(texts.shape):
        texts[place] = counted(values[place][counting[place]].tolist())
    return xr.DataArray(texts, dims=_without_member(array.variable), attrs=array.attrs)
