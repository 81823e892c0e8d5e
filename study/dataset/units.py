"""Units, symbols and values of a dataset as tables and figures write them: in SI where its campaign gives lengths or forces."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields
from functools import lru_cache
from types import MappingProxyType
from typing import Any, Final

import numpy as np
import xarray as xr

from nanoslip.solver.case import parameters_of_a_case
from nanoslip.solver.drive import Scales
from nanoslip.solver.dynamics.regime import REGIMES
from nanoslip.solver.parameter import measure_label
from nanoslip.study.dataset.variables import (
    MEASURES,
    PREFIXED,
    SI,
    Described,
    describe,
    describe_own_number,
    describe_size,
    own_numbers,
    parameters,
    variables_by_name,
)
from nanoslip.study.manifest.parameters import Value, as_written, axis_unit, compact, has_unit, names_by_word, si_text
from nanoslip.study.measured.columns import read_cells
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
    text, table = (str(dataset.attrs.get(name, "")) for name in ("manifest", TABLE))
    return read_scales(dataset.attrs) is not None and _gives_sizes(text, table)


TABLE: Final = "manifest_table"
"""Attribute with the text of a campaign's CSV table of cases."""


def table_columns(text: str) -> dict[str, list[str]]:
    """Columns of a CSV table of cases as its author wrote them: word of a parameter -> a cell for each case; none of no text."""
    rows = [[cell.strip() for cell in cells] for _, cells in read_cells(text)]
    if not rows:
        return {}
    header, *cases = rows
    columns = zip(*cases, strict=True)
    return {word: list(column) for word, column in zip(header, columns, strict=True)}


# Kept, as every number of a table asks for it.
@lru_cache(maxsize=64)
def _gives_sizes(text: str, table: str) -> bool:
    tables = [part for name, part in from_toml(text).items() if name not in _APART]
    tables.append(table_columns(table))
    entries = [entry for part in tables if isinstance(part, dict) for entry in part.items()]
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
    """Name of a variable's size in SI if the campaign is given in SI; else the variable's name."""
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


def total_load(dataset: xr.Dataset, scales: Scales) -> xr.Variable:
    """W of all contacts of each case, in N."""
    # Variables, not arrays: to compare the coordinates takes far longer, and so does `get` of an array that is not there.
    numbers = dataset.variables
    return numbers["normal_load"] * numbers.get("contacts", 1) * scales.force


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


# Names and values of variables as people read them, in tables, on axes, in legends and in captions.

LETTERS: Final = 3
"""Names so short are symbols themselves: n_x."""


def variable_description(name: str, dataset: xr.Dataset | None = None) -> Described:
    """Declaration of a variable, or of a user's number in a dataset; an undeclared variable has only its name."""
    if name in variables_by_name():
        return variables_by_name()[name]
    if dataset is not None and name in own_numbers(dataset):
        return describe_own_number(dataset, name)
    if size := describe_size(name):
        return size
    # The name alone, as that of a pure number.
    return Described(name, "", "", "1", "", name, "", "", "", ())


def symbol(name: str) -> str:
    """Symbol of a variable, else its name in words."""
    own_symbol = variable_description(name).symbol
    if own_symbol:
        return own_symbol
    return name if len(name) <= LETTERS else name.replace("_", " ")


def label(name: str, over: str = "", dataset: xr.Dataset | None = None, unit: str | None = None) -> str:
    """Axis label of a variable or its ratio to another: meaning, symbol, unit; for a ratio, the unit of the numerator.

    dataset: for one's own numbers, which it describes. unit: one with a prefix, in place of the variable's.
    """
    variable = variable_description(name, dataset)
    sign = f" {variable.symbol}" if variable.symbol not in variable.meaning else ""
    measure = "" if "/" in sign else variable.measure
    if over:
        numerator = symbol_with_unit(variable.meaning + sign, name)
        return measure_label(f"{numerator} over {symbol_and_unit(over)}", measure)
    text = measure_label(variable.meaning, measure) + sign
    return symbol_with_unit(text, name, unit or readable(variable.units))


def symbol_and_unit(name: str, unit: str | None = None) -> str:
    """A variable where there is little room: symbol and unit. unit: one with a prefix, in place of the variable's."""
    return symbol_with_unit(symbol(name), name, unit)


def column_title(name: str, dataset: xr.Dataset) -> str:
    """Head of a variable's column: its symbol, and the unit of a user's number."""
    if "source" not in dataset[name].attrs:
        return symbol(name)
    return symbol_and_unit(name, readable(variable_description(name, dataset).units))


def symbol_with_unit(text: str, name: str, unit: str | None = None) -> str:
    """Symbol of a variable with its unit, if any: `V_o (m/s)`. unit: one with a prefix, in place of the variable's."""
    if unit is None:
        unit = unit_text(name)
    return f"{text} ({unit})" if unit else text


def unit_text(name: str) -> str:
    """The unit of a variable as people write it; empty of pure numbers and words."""
    return readable(variable_description(name).units)


def readable(units: str) -> str:
    """Units of a dataset as people write them; empty of pure numbers."""
    return "" if units == "1" else as_written(units)


def format_value(value: Any) -> str:
    """A value of a coordinate, as short as it can be: 0.25, 200, 3e4."""
    if not isinstance(value, float) or not math.isfinite(value):
        return str(value)
    # Exponents as people write them: 3e4, not 3e+04.
    plain = f"{value:.6g}".replace("e+0", "e").replace("e-0", "e-")
    plain = plain.replace("e+", "e")
    digits, _, exponent = f"{value:.5e}".partition("e")
    powers = f"{digits.rstrip('0').rstrip('.')}e{int(exponent)}"
    # Up to thousands people read digits more easily, even if there are more of them.
    has_large_exponent = abs(int(exponent)) > 3
    shorter = len(powers) < len(plain) and has_large_exponent
    return powers if shorter else plain


def hyphenate(word: str) -> str:
    """A regime as people write it, stick-slip; any other word as it is."""
    return word.replace("_", "-") if word in REGIMES else word


LONGEST_TALLY: Final = 30
"""Characters of counted words in a table; of longer lists the most frequent value is shown, with the count of
others."""


def format_words(tally: Mapping[str, int], most: float = LONGEST_TALLY) -> str:
    """Words of members with how many have each, the most frequent first; the word alone that all have.

    As `4 of 8 starts stick-slip; 4 slides`.
    """
    if len(tally) == 1:
        return hyphenate(next(iter(tally)))
    starts = sum(tally.values())
    first, *others = tally.items()
    word, count = first
    parts = [f"{count} of {starts} starts {hyphenate(word)}"]
    parts += [f"{count} {hyphenate(word)}" for word, count in others]
    text = "; ".join(parts)
    if len(text) <= most or len(parts) < 3:
        return text
    return f"{parts[0]}; {starts - count} others"


def label_in_symbols(values: Mapping[str, Any], units: Mapping[str, str] = MappingProxyType({})) -> str:
    """Coordinates with their values and units: `R/L_x = 200, n_x = 65, V_o = 2 mm/s`.

    units: with prefixes, of coordinates whose values are in them.
    """
    parts = (f"{symbol(name)} = {value_with_unit(name, value, units.get(name))}" for name, value in values.items())
    return ", ".join(parts)


def value_with_unit(name: str, value: Any, unit: str | None = None) -> str:
    """A value of a coordinate with its unit; with a prefix that suits it, unless a unit is given."""
    if unit is None and is_prefixed(name) and isinstance(value, float) and math.isfinite(value):
        return compact(value, unit_text(name), digits=DIGITS)
    unit = unit_text(name) if unit is None else unit
    return f"{format_value(value)} {unit}".rstrip()


DIGITS: Final = 6
"""Digits of a coordinate's value, to tell it from its neighbours."""


def is_prefixed(name: str) -> bool:
    """True if the unit of a variable takes prefixes."""
    return variable_description(name).units in PREFIXED


_SYMBOLS: Final = {name: parameter.symbol for name, parameter in parameters().items() if parameter.symbol}
"""Parameter -> its name in tables and figures."""


def parameter_symbol(parameter: str) -> str:
    """Symbol of a parameter, else its name in a campaign file."""
    return _SYMBOLS.get(parameter, parameter)


def with_size(name: str, value: Value, scales: Scales | None) -> str:
    """Value of a parameter, and beside a length or load its size in SI."""
    si = si_text(scales, name, value) if scales else ""
    return f"{format_value(value)} ({si})" if si else format_value(value)
