"""The parameters of a case in a campaign file: each has one word and one table there."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, Final, TypeVar

from nanoslip.solver.case import STOP_CONDITIONS, Case, parameters_of_a_case
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.parameter import Parameter, declared
from nanoslip.solver.slab import PHYSICS, SCHEMES, Slab

Value = float | int | str
Name = TypeVar("Name")

TABLES: Final = ("constants", "numerics", "slip", "effects", "heterogeneity", "interface", "limits")
"""Tables of a manifest that take parameters of a case."""
STANDARD: Final = ("intrinsic_friction", "radius", "aspect_ratio", "n_x")
"""The parameters that label every case, in the order of a dataset's dimensions."""


def words() -> dict[str, str]:
    """Word of a manifest -> name of the parameter that it sets: `events` sets `max_events`; most are the same."""
    return {stated.word or name: name for name, stated in parameters_of_a_case().items()}


_LATIN: Final = {"μ": "mu", "ζ": "zeta", "ν": "nu", "τ": "tau", "δ": "delta"}
"""Greek letters of symbols, as they are typed."""


def with_symbol(word: str, symbols: Mapping[Name, str]) -> list[Name]:
    """The names with this symbol, in Greek or Latin letters: all of it, as `R/L_x`; else without its unit."""
    latin = str.maketrans(_LATIN)
    spelt = {name: {symbol, symbol.translate(latin)} for name, symbol in symbols.items() if symbol}
    whole = [name for name, each in spelt.items() if word in each]
    return whole or [name for name, each in spelt.items() if word in {one.partition("/")[0] for one in each}]


def of_symbol(key: str, stated: Mapping[str, Parameter]) -> str:
    """The word of the only parameter that has this symbol; any other key, or the symbol of several, as it is."""
    symbols = {each.word or name: each.symbol for name, each in stated.items()}
    found = [] if key in stated or key in symbols else with_symbol(key, symbols)
    return found[0] if len(found) == 1 else key


def words_of(table: str) -> tuple[str, ...]:
    """The words that a table of a manifest takes, in the order of declaration."""
    return tuple(stated.word or name for name, stated in parameters_of_a_case().items() if stated.table == table)


def axes() -> tuple[str, ...]:
    """The words that can be an axis: all but those whose values are files, of which a profile can."""
    stated = parameters_of_a_case().items()
    return tuple(each.word or name for name, each in stated if not each.columns or name == "roughness")


class FileName(str):
    """The name of a file on an axis, and the value of the parameter that is in it."""

    content: tuple[Any, ...]


SMOOTH: Final = "none"
"""What stands on an axis of files for a pin without roughness."""
BETWEEN: Final = "\f"
"""Between the texts of the files of an axis, where they are one text."""


def in_files() -> dict[str, Parameter]:
    """Word of each parameter whose value is a CSV file that the campaign names -> its declaration."""
    return {stated.word or name: stated for name, stated in parameters_of_a_case().items() if stated.columns}


HASHED: Final = ("table", *in_files())
"""Keys of the files that a campaign consists of: its hash is of their bytes, too."""
NAMED: Final = (*HASHED, "front")
"""Keys that name a file; a dataset holds its text as the attribute manifest_<key>."""


def table_of(word: str) -> str:
    """The name of the table that takes a word; empty where none does."""
    return next((table for table in TABLES if word in words_of(table)), "")


def in_words(text: str) -> str:
    """A text in which every parameter's name is replaced by its word in a manifest."""
    named = {name: word for word, name in words().items() if word != name}
    return re.sub("|".join(rf"\b{name}\b" for name in named), lambda found: named[found.group()], text)


def settings() -> tuple[str, ...]:
    """Names of the parameters of a slab's discretization, those of all schemes included."""
    return (*(name for name in declared(Slab) if name not in PHYSICS), *SCHEMES.settings())


LIMITS: dict[str, int | float] = {"max_events": 100_000, "max_presliding": 8.0}
"""Limits of a record where a campaign gives none: run-in takes 1.5 presliding lengths, the rest is steady.

How far their means are from those of longer ones is measured by tests.verification.run_in. The limit of events bounds the cost of
contacts with millions of events in that length."""


MOST_KINDS: Final = 2**14
"""Kinds of cases, alike in all but a case's own parameters, that `Alike` keeps."""


def make_case(parameters: Mapping[str, Any]) -> Case:
    """The case with these parameters by field name, defaults for the rest.

    Where no limit is given, LIMITS hold. Where only displacement or spacings are limited, events are not.
    Raises InvalidInput; its message has the word of a manifest, the value and the range.
    """
    for name, value in parameters.items():
        if isinstance(value, float) and math.isinf(value) and name != "intrinsic_friction":
            raise InvalidInput(f"{name} = {value!r}: needs a finite number")
    parameters = {name: getattr(value, "content", value) for name, value in parameters.items()}
    limits: dict[str, Any] = {}
    if not parameters.keys() & {*STOP_CONDITIONS}:
        limits = dict(LIMITS)
    elif "max_events" not in parameters:
        limits = {"max_events": None}
    try:
        return Case.of({**limits, **parameters})
    except InvalidInput as error:
        raise InvalidInput(in_words(str(error))) from None


class Alike:
    """Cases with the same parameters but a few, given by name. What they have in common is checked and kept once.

    A campaign has millions of cases and few slabs, slip rules, ...: all cases share the parts that are the same.
    """

    def __init__(self, fixed: Mapping[str, Value], names: Sequence[str]) -> None:
        """names: of the parameters that differ; a later value of the same name counts."""
        self._fixed, self._names = fixed, tuple(names)
        own = {item.name: place for place, item in enumerate(fields(Case)) if item.name in declared(Case)}
        self._own = [(number, own[name]) for number, name in enumerate(names) if name in own]
        self._others = [number for number, name in enumerate(names) if name not in own]
        self._kinds: dict[tuple[Any, ...], list[Any]] = {}

    def case(self, values: tuple[Any, ...]) -> Case:
        """The case that `make_case` makes of these values beside the fixed ones. Raises InvalidInput as it does."""
        kind = tuple([values[number] for number in self._others])
        known = self._kinds.get(kind)
        if known is None:
            return self._first(kind, values)
        if math.inf in values:  # which some take that a campaign refuses
            return self._made(values)
        for number, place in self._own:
            known[place] = values[number]
        try:
            return Case(*known)
        except InvalidInput:
            return self._made(values)  # says the same in the words of a manifest

    def _first(self, kind: tuple[Any, ...], values: tuple[Any, ...]) -> Case:
        case = self._made(values)
        if len(self._kinds) >= MOST_KINDS:
            self._kinds.clear()
        self._kinds[kind] = [getattr(case, item.name) for item in fields(Case)]
        return case

    def _made(self, values: tuple[Any, ...]) -> Case:
        return make_case({**self._fixed, **dict(zip(self._names, values, strict=True))})
