"""The parameters of a case in a campaign file: each has one word and one table there, and its value may have a unit."""

import math
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import fields
from decimal import Decimal
from typing import Any, Final, TypeVar

import numpy as np

from nanoslip.solver.case import PIN_SIZES, STOP_CONDITIONS, Case, parameters_of_a_case
from nanoslip.solver.contact.closed_forms import smooth_contact
from nanoslip.solver.drive import Scales
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.parameter import Parameter, declared
from nanoslip.solver.slab import PHYSICS, SCHEMES, Slab
from nanoslip.solver.view import with_error
from nanoslip.study.measured.units import convert

Value = float | int | str
Name = TypeVar("Name")

TABLES: Final = ("constants", "numerics", "slip", "effects", "heterogeneity", "interface", "path", "limits")
"""Tables of a manifest that take parameters of a case."""
STANDARD: Final = ("intrinsic_friction", "radius", "aspect_ratio", "n_x")
"""The parameters that label every case, in the order of a dataset's dimensions."""


def names_by_word() -> dict[str, str]:
    """Name of the parameter that each word of a manifest sets: `events` sets `max_events`; most are equal."""
    return {stated.word or name: name for name, stated in parameters_of_a_case().items()}


_LATIN: Final = {"μ": "mu", "ζ": "zeta", "ν": "nu", "τ": "tau", "δ": "delta"}
"""Greek letters of symbols, as they are typed."""


def spellings(symbols: Mapping[Name, str]) -> dict[Name, set[str]]:
    """Each symbol in Greek and in Latin letters, without empty ones."""
    latin = str.maketrans(_LATIN)
    return {name: {symbol, symbol.translate(latin)} for name, symbol in symbols.items() if symbol}


def with_symbol(word: str, symbols: Mapping[Name, str]) -> list[Name]:
    """The names with this symbol, in Greek or Latin letters: all of it, as `R/L_x`; else without its unit."""
    spelt = spellings(symbols)
    exact = [name for name, words in spelt.items() if word in words]
    if exact:
        return exact
    names = []
    for name, words in spelt.items():
        numerators = {spelling.partition("/")[0] for spelling in words}
        if word in numerators:
            names.append(name)
    return names


def word_for_symbol(key: str, stated: Mapping[str, Parameter]) -> str:
    """Manifest key for a symbol; other words, and ambiguous symbols, are returned unchanged."""
    symbols = {parameter.word or name: parameter.symbol for name, parameter in stated.items()}
    # A key that is also another key's symbol means itself.
    if key in stated or key in symbols:
        return key
    words = with_symbol(key, symbols)
    return words[0] if len(words) == 1 else key


def table_words(table: str) -> tuple[str, ...]:
    """The words that a table of a manifest takes, in the order of declaration."""
    of_table = {name: stated for name, stated in parameters_of_a_case().items() if stated.table == table}
    return tuple(stated.word or name for name, stated in of_table.items())


def axes() -> tuple[str, ...]:
    """The words that can be an axis: all but those whose values are lists or files, of which a profile can."""
    words = []
    for name, stated in parameters_of_a_case().items():
        is_single = not stated.columns and not stated.listed
        if is_single or name == "roughness":
            words.append(stated.word or name)
    return tuple(words)


class FileName(str):
    """The name of a file on an axis, and the value of the parameter that is in it."""

    content: tuple[Any, ...]


SMOOTH: Final = "none"
"""Word on an axis of files for a pin without roughness."""
BETWEEN: Final = "\f"
"""Between the texts of the files of an axis, where they are one text."""


def file_parameters() -> dict[str, Parameter]:
    """Word of each parameter whose value is a CSV file that the campaign names -> its declaration."""
    of_files = {name: stated for name, stated in parameters_of_a_case().items() if stated.columns}
    return {stated.word or name: stated for name, stated in of_files.items()}


FILE_KEYS: Final = ("table", *file_parameters(), "observables")
"""Keys that name a file, of which a campaign consists: its hash is of their bytes, too, and a dataset holds their texts as the
attributes manifest_<key>."""


OTHER_TABLES: Final[dict[str, tuple[str, ...]]] = {}
"""Table without parameters of a case -> its keys. Each is entered where its keys are declared."""


def field_names(kind: Any) -> tuple[str, ...]:
    """The names of a dataclass's fields, in their order."""
    return tuple(item.name for item in fields(kind))


def table_taking(word: str) -> str:
    """The name of the table that takes a word; empty if none does."""
    tables = (table for table in TABLES if word in table_words(table))
    return next(tables, "")


def words_by_name() -> Mapping[str, str]:
    """Name of a parameter -> its word in a manifest."""
    return {name: word for word, name in names_by_word().items()}


def parameters_text(parameters: Mapping[str, object]) -> str:
    """Parameters and their values in the words of a manifest: `radius = 200.0, events = 5`."""
    words = words_by_name()
    entries = [f"{words.get(name, name)} = {as_typed(value)}" for name, value in parameters.items()]
    return ", ".join(entries)


def as_typed(value: object) -> str:
    """A value as people type it: ten digits of a number, which a division leaves as 0.014899999999999998."""
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def settings() -> tuple[str, ...]:
    """Names of the parameters of a slab's discretization, including the parameters of all schemes."""
    of_slab = [name for name in declared(Slab) if name not in PHYSICS]
    return (*of_slab, *SCHEMES.settings())


LIMITS: dict[str, int | float] = {"max_events": 100_000, "max_presliding": 8.0, "spacing_events": 20_000}
"""Limits of a record where a campaign gives none: run-in takes 1.5 presliding lengths, the rest is steady.

A record goes on to two node spacings where that costs under a second for eight starts of 20 nodes, at 2 to 5 μs an event.

The difference between their means and the means of longer records is measured by tests.verification.run_in. The limit
of events bounds the cost of contacts with millions of events within `max_presliding`."""


MOST_KINDS: Final = 2**14
"""Kinds of cases, alike in all but a case's own parameters, that `Alike` keeps."""


def make_case(parameters: Mapping[str, Any]) -> Case:
    """The case with these parameters by field name, defaults for the rest.

    Where no limit is given, LIMITS hold. Where only displacement or spacings are limited, events are not.
    Raises InvalidInput; its message has the word of a manifest, the value and the range.
    """
    # The solver takes some infinite values as "no limit"; a campaign leaves such a key out. An infinite μ_i never slips.
    for name, value in parameters.items():
        if isinstance(value, float) and math.isinf(value) and name != "intrinsic_friction":
            raise InvalidInput(name, value, "a finite number")
    # A FileName on an axis stands for the numbers in its file.
    parameters = {name: getattr(value, "content", value) for name, value in parameters.items()}
    limits: dict[str, Any] = {}
    if not parameters.keys() & {*STOP_CONDITIONS}:
        limits = dict(LIMITS)
    elif "max_events" not in parameters:
        limits = {"max_events": None}
    try:
        return Case.of({**limits, **parameters})
    except InvalidInput as error:
        raise error.rename_keys(words_by_name()) from None


class Alike:
    """Cases that differ in a few named parameters only. All others are checked and kept once.

    A campaign has millions of cases and few slabs, slip rules, ...: all cases share the parts that are the same.
    """

    def __init__(self, fixed: Mapping[str, Value], names: Sequence[str]) -> None:
        """names: of the parameters that differ; a later value of the same name counts."""
        self._fixed, self._names = fixed, tuple(names)
        places = {item.name: place for place, item in enumerate(fields(Case)) if item.name in declared(Case)}
        # A case's own fields are replaced one by one; all others are inside of its parts, which are shared.
        self._own = [(number, places[name]) for number, name in enumerate(names) if name in places]
        self._others = [number for number, name in enumerate(names) if name not in places]
        self._kinds: dict[tuple[Any, ...], list[Any]] = {}

    def case(self, values: tuple[Any, ...]) -> Case:
        """The case that `make_case` makes of these values beside the fixed ones. Raises InvalidInput as it does."""
        kind = tuple([values[number] for number in self._others])
        arguments = self._kinds.get(kind)
        # `make_case` refuses infinite values that a `Case` takes.
        if arguments is not None and math.inf not in values:
            for number, place in self._own:
                arguments[place] = values[number]
            try:
                return Case(*arguments)
            except InvalidInput:
                # `make_case` refuses it once more, in the words of a manifest.
                pass
        varied = dict(zip(self._names, values, strict=True))
        case = make_case({**self._fixed, **varied})
        if arguments is None:
            # A design that varies a slab has as many kinds as cases: they would take memory and never be met again.
            if len(self._kinds) >= MOST_KINDS:
                self._kinds.clear()
            self._kinds[kind] = [getattr(case, item.name) for item in fields(Case)]
        return case


# Values with units, `"100 N"` or `"20 cm"`: the numbers that they stand for, in the unit of their key.
#
# Those of a case are multiples of the campaign's scales; drives and scales are in SI.

UNITS: Final = {"slab_width": "m", "force": "N", "shear_modulus": "Pa"}
"""Scale of a case's parameter, as a field or property of `Scales` -> its unit."""
YOUNG: Final = "young_modulus"
"""Key of [scales] that replaces `shear_modulus`, with the campaign's Poisson's ratio."""
_QUANTITY: Final = re.compile(
    r"\s*((?>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?))\s*([A-Za-zµμ][-A-Za-zµμ0-9/*·^ ]{0,40})"
)


def plain(key: str, value: Any, stated: Parameter, scales: Scales | None = None) -> Any:
    """The number that a text such as "100 N" is for a parameter; any other value as it is. Raises InvalidInput.

    scales: of the campaign, for a parameter of a case.
    """
    unit = UNITS.get(stated.scale, "") if scales else stated.unit
    if not isinstance(value, str) or unit in ("", "1"):
        return value
    match = _QUANTITY.fullmatch(value)
    if match is None:
        return value
    number, its_unit = match.groups()
    try:
        size = _convert_unit(number, its_unit, unit, scales if stated.scale == "force" else None)
        # Decimals: "0.3 mm" over "1 mm" is 0.3 to the last bit, the same case as one that is written without a unit.
        scale = getattr(scales, stated.scale) if scales else 1
        return float(size / Decimal(str(scale)))
    # Among them are the exceptions of pint, for units that it does not know or that are of another dimension.
    except (AttributeError, TypeError, ValueError, ArithmeticError):
        example = f"{number} {as_written(unit)}"
        raise InvalidInput(key, value, f'a number, or one with a unit as "{example}"') from None


def has_unit(value: Any) -> bool:
    """True if a value is a text with a number and its unit."""
    return isinstance(value, str) and _QUANTITY.fullmatch(value) is not None


def twice(value: str) -> str:
    """Twice a quantity that has a unit, in the same unit."""
    match = _QUANTITY.fullmatch(value)
    assert match is not None
    return f"{2 * Decimal(match[1])} {match[2]}"


def _convert_unit(number: str, unit: str, into: str, scales: Scales | None) -> Decimal:
    """A quantity in another unit. scales: for a force, which may be given per depth of the slab, as plane strain has it."""
    try:
        return convert(number, unit, into)
    except TypeError:
        # Another dimension: a load per depth, as a line contact has it, times the depth of the slab.
        if scales is None:
            raise
        per_depth = convert(number, unit, "N/m")
        return per_depth * Decimal(str(scales.slab_depth))


def resembles_ball(table: Mapping[str, Any]) -> bool:
    """True if keys of a campaign, as typed, suggest a ball where a cylinder is computed.

    That is a radius as a length, with scales but no depth, in plane strain.
    """
    radii, names, pins = (np.ravel(table.get(key, "")).tolist() for key in ("radius", "scheme", "pin"))
    schemes = [SCHEMES[name] for name in names if name in SCHEMES]
    # A number over the width is typed by people who know the model; a flat punch has no radius, and a chain no depth.
    a_length = any(map(has_unit, radii))
    plane_strain = not any("y" in scheme.LAYOUT.AXES or not scheme.continuum for scheme in schemes)
    scaled = bool({"slab_width", "shear_modulus", YOUNG} & table.keys())
    return a_length and plane_strain and scaled and "slab_depth" not in table and "flat_punch" not in pins


def largest_half_width(top: Mapping[str, Any], scales: Scales) -> float:
    """Half-width in m of a campaign's largest contact of balls by Hertz, at most; NaN unless its sizes are given with units.

    On a plane of nodes only: in a row the width is that of the slab itself.
    """
    values_by_name: dict[str, list[Any]] = {}
    for table in ("numerics", "constants", "axes"):
        for word, value in top.get(table, {}).items():
            name = names_by_word().get(word, word)
            values = list(value.values()) if isinstance(value, dict) else value
            values_by_name[name] = values if isinstance(values, list) else [values]
    schemes = values_by_name.get("scheme", [])
    # What is no name of a scheme, of whatever type, is refused in its table.
    named = [SCHEMES[name] for name in schemes if isinstance(name, str) and name in SCHEMES]
    planes = ["y" in scheme.LAYOUT.AXES for scheme in named]
    punches = "flat_punch" in values_by_name.get("pin", [])
    has_modulus = bool({"shear_modulus", YOUNG} & top.get("scales", {}).keys())
    if punches or not planes or not all(planes) or len(named) < len(schemes) or not has_modulus:
        return math.nan
    radius = _largest_size(values_by_name.get("radius", []), "m")
    load = _largest_size(values_by_name.get("normal_load", []), "N")
    is_ratio = parameters_of_a_case()["poisson"].holds
    ratios = [value for value in values_by_name.get("poisson", []) if isinstance(value, float) and is_ratio(value)]
    # The softest flat has the least ν. With 1 m for L_x lengths are in m, and loads in G·m².
    poisson = min(ratios, default=Slab().poisson)
    contact = smooth_contact(named[0].LAYOUT)
    half_width = contact.hertz(load / scales.shear_modulus, radius, poisson)
    return half_width if math.isfinite(half_width) else math.nan


def _largest_size(values: Sequence[Any], unit: str) -> float:
    """The largest of these values that have a unit, in this SI unit; NaN if none is right."""
    stated, sizes = Parameter("size", unit=unit), []
    for value in filter(has_unit, values):
        # A wrong one is refused in its table.
        with suppress(InvalidInput):
            sizes.append(float(plain("size", value, stated)))
    largest = max(sizes, default=math.nan)
    return largest if largest > 0.0 else math.nan


def si_line(scales: Scales, fixed: Mapping[str, Any], axes: Mapping[str, Sequence[Any]]) -> str:
    """Lengths, loads and node spacing in SI of cases with these parameters, in one line."""
    common = {**Case.of({}).flat, **fixed}
    values = {**{name: (value,) for name, value in common.items()}, **axes}
    # The radius of a flat punch and the half-width of a ball have defaults, which mean nothing.
    idle = {size for shape, size in PIN_SIZES.items() if shape not in values["pin"]}
    parts = [f"L_x = {compact(scales.slab_width, 'm')}"]
    for name, stated in parameters_of_a_case().items():
        if stated.scale not in UNITS or not stated.symbol or name in idle:
            continue
        scale = getattr(scales, stated.scale)
        sizes = [float(value) * scale for value in values[name]]
        # As a strength that nobody asked for.
        if not any(sizes):
            continue
        symbol = stated.symbol.partition("/")[0]
        parts.append(f"{symbol} = {span(sizes, UNITS[stated.scale])}")
    spacings = [scales.slab_width / (int(n_x) - 1) for n_x in values["n_x"]]
    parts += [f"L_y = {compact(scales.slab_depth, 'm')}", f"G = {compact(scales.shear_modulus, 'Pa')}"]
    ratios = {*values["poisson"]}
    # E = 2(1 + ν)G; with several ν there is one for each.
    if len(ratios) == 1:
        poisson = float(values["poisson"][0])
        young = 2.0 * (1.0 + poisson) * scales.shear_modulus
        parts.append(f"E = {compact(young, 'Pa')}")
    return f"{', '.join(parts)}, nodes {span(spacings, 'm')} apart"


def si_text(scales: Scales, name: str, value: Any) -> str:
    """A length or load of a case in SI, as 200 mm; empty of other parameters."""
    stated = parameters_of_a_case().get(name)
    if stated is None or stated.scale not in UNITS or not math.isfinite(value):
        return ""
    size = float(value) * getattr(scales, stated.scale)
    return compact(size, UNITS[stated.scale])


FARTHEST: Final = 1e-2
"""Ratio of two sizes down to which they are stated in one unit: below it the smaller has two zeros or more behind its point."""


def span(values: Sequence[float], unit: str) -> str:
    """The least and the most of values in SI, in words and in one unit unless they are far apart; one if equal."""
    least, most = min(values), max(values)
    ends = list(dict.fromkeys(compact(end, unit) for end in (least, most)))
    if len(ends) == 1 or not unit or abs(least) < FARTHEST * abs(most):
        return " to ".join(ends)
    factor, _ = axis_unit(abs(most), unit)
    return f"{least * factor:.4g} to {ends[1]}"


def compact(value: float, unit: str, error: float | None = None, digits: int = 4) -> str:
    """A value in SI with the prefix that suits it, to these digits, or rounded beside its ±: 15.62 μm."""
    # The one SI unit that has a prefix already: m kg would be no unit.
    if unit == "kg":
        value, unit = 1e3 * value, "g"
    power, prefix = _prefix(value) if unit else (0, "")
    # A decimal shift is exact, a product with 1e-9 is not: 15 nm would be 15.000000000000002 of them.
    size = float(Decimal(value).scaleb(-power))
    number = f"{size:.{digits}g}" if error is None else with_error(size, error * 10.0**-power)
    return f"{number} {prefix}{unit}".rstrip()


def axis_unit(size: float, unit: str) -> tuple[float, str]:
    """Factor from an SI unit to that with the prefix that suits numbers of this size, and its name: 1e6, μm."""
    if unit == "kg":  # which has a prefix already
        factor, name = axis_unit(1e3 * size, "g")
        return 1e3 * factor, name
    power, prefix = _prefix(size)
    return 10.0**-power, f"{prefix}{unit}"


def _prefix(size: float) -> tuple[int, str]:
    """Power of ten of the SI prefix that suits a number, and the prefix."""
    # Rounded as it will be shown: 999.96 mm is 1 m, not 1000 mm. SI has prefixes from quecto (10^-30) to quetta (10^30).
    exponent = Decimal(f"{size:.4g}").adjusted()
    thousands = min(max(exponent // 3, -10), 10)
    return 3 * thousands, "qryzafpnμm kMGTPEZYRQ"[thousands + 10].strip()


def as_written(unit: str) -> str:
    """A unit as people write it: N m-1 as N/m."""
    return re.sub(r" (\w+)-1", r"/\1", unit)
