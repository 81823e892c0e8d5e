"""Numbers in the units of their campaign: lengths, forces, energies and stresses in SI where it gives such."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields
from functools import lru_cache
from typing import Any, Final

import numpy as np
import xarray as xr

from nanoslip.solver.case import parameters_of_a_case
from nanoslip.solver.drive import Scales
from nanoslip.study.dataset.variables import MEASURES, PREFIXED, SI, describe, variables_by_name
from nanoslip.study.manifest.parameters import as_written, axis_unit, has_unit, names_by_word
from nanoslip.study.toml_text import from_toml


def read_scales(attributes: Mapping[Any, Any]) -> Scales | None:
    """The scales of a dataset, from its attributes; None if these do not state them."""
    try:
        sizes = {item.name: float(attributes[item.name]) for item in fields(Scales)}
        return Scales(**sizes)
    except KeyError:
        return None


_APART: Final = ("scales", "drives")
"""Tables whose numbers are always in SI."""
_SIZES: Final = ("slab_width", "force")
"""Scales of lengths and forces."""


def is_given_in_si(dataset: xr.Dataset) -> bool:
    """True if a dataset states its scales, and its campaign gives a length or force of its cases with a unit."""
    text = str(dataset.attrs.get("manifest", ""))
    return read_scales(dataset.attrs) is not None and _gives_sizes(text)


# Kept, as every number of a table asks for it.
@lru_cache(maxsize=64)
def _gives_sizes(text: str) -> bool:
    tables = [table for name, table in from_toml(text).items() if name not in _APART]
    entries = [entry for table in tables if isinstance(table, dict) for entry in table.items()]
    words, stated = names_by_word(), parameters_of_a_case()
    for word, value in entries:
        parameter = stated.get(words.get(word) or word)
        if parameter and parameter.scale in _SIZES and any(map(has_unit, _leaves(value))):
            return True
    return False


def _leaves(value: Any) -> Iterator[Any]:
    """A value, or each of a list or a range."""
    if isinstance(value, dict):
        value = list(value.values())
    yield from value if isinstance(value, list) else [value]


def si_name(dataset: xr.Dataset, name: str) -> str:
    """Name of a variable's size in SI, for a dataset whose campaign is given in SI; else its own name."""
    twin = f"{name}{SI}"
    if not is_given_in_si(dataset) or not (twin in dataset.variables or has_size(name)):
        return name
    return twin


def has_size(name: str) -> bool:
    """True if a variable is measured in units of the scales."""
    return name in variables_by_name() and variables_by_name()[name].measure in MEASURES


def stored_name(dataset: xr.Dataset, name: str) -> str:
    """The variable in a dataset from which a size in SI follows; other names as they are."""
    base = name.removesuffix(SI)
    is_size = name not in dataset.variables and base in dataset.variables and has_size(base)
    return base if is_size and read_scales(dataset.attrs) else name


def si_factor(scales: Scales, measure: str, load: Any) -> Any:
    """Factor to SI of a number in units of the scales. load: W of its case in SI (N), a number or an array."""
    area = scales.slab_width * scales.slab_depth
    factors: Mapping[str, Any] = {
        "L_x": scales.slab_width,
        "G": scales.shear_modulus,
        "G·L_y": scales.stiffness,
        "G·L_x·L_y": scales.force,
        "W·L_x": load * scales.slab_width,
        "W/(L_x·L_y)": load / area,
    }
    return factors[measure]


def total_load(dataset: xr.Dataset, scales: Scales) -> xr.DataArray:
    """W of all contacts of each case, in N."""
    return dataset["normal_load"] * dataset.get("contacts", 1) * scales.force


def prefix_factor(values: Any, unit: str) -> tuple[float, str]:
    """Factor from an SI unit to that with the prefix that suits the largest of some numbers, and its name.

    A unit that takes no prefix stays; that of a ratio has no name.
    """
    if unit not in PREFIXED:
        return 1.0, "" if unit == "1" else as_written(unit)
    values = np.asarray(values)
    sizes = np.abs(values[np.isfinite(values)])
    return axis_unit(float(sizes.max(initial=0.0)), as_written(unit))


def convert_to_si(dataset: xr.Dataset, names: Iterable[str]) -> tuple[xr.Dataset, dict[str, str]]:
    """A dataset with some numbers in SI, with their ±, each in the unit with the prefix that suits the largest value.

    Beside it the units of those that have one; nothing changes for a campaign that is not given in SI.
    """
    scales = read_scales(dataset.attrs)
    if scales is None or not is_given_in_si(dataset):
        return dataset, {}
    load, converted, units = total_load(dataset, scales), {}, {}
    for name in filter(variables_by_name().__contains__, names):
        declared = describe(name)
        if declared.measure not in MEASURES and declared.units not in PREFIXED:
            continue
        to_si = si_factor(scales, declared.measure, load) if declared.measure in MEASURES else 1.0
        sizes = dataset[name] * to_si
        unit = MEASURES.get(declared.measure, declared.units)
        # A number and its ± share one prefix, that of the number.
        factor, units[name] = prefix_factor(sizes.values, unit)
        for number in {name, declared.uncertainty} & set(map(str, dataset.data_vars)):
            stored = dataset[number]
            # A factor that varies along the cases may reorder the dimensions.
            converted[number] = (stored * to_si * factor).transpose(*stored.dims)
    return dataset.assign(converted), units
