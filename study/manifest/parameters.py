"""The flat names of a case: every parameter of Case and its parts has one word and one table of a campaign file."""

import math
import re
from collections.abc import Mapping
from typing import Any, Final

from solver.case import Case, parameters_of_a_case
from solver.outcome import InvalidInput
from solver.parameter import declared
from solver.slab import PHYSICS, SCHEMES, Slab

Value = float | int | str

TABLES: Final = ("constants", "numerics", "slip", "effects", "heterogeneity", "limits")
"""Tables of a manifest that take parameters of a case."""
STANDARD: Final = ("intrinsic_friction", "radius", "aspect_ratio", "n_x")
"""Parameters that every case is labelled with, in the order of a dataset's dimensions."""


def words() -> dict[str, str]:
    """Word of a manifest -> the parameter that it sets (`events` sets `max_events`; most are spelled alike)."""
    return {stated.word or name: name for name, stated in parameters_of_a_case().items()}


def words_of(table: str) -> tuple[str, ...]:
    """The words that a table of a manifest takes."""
    return tuple(stated.word or name for name, stated in parameters_of_a_case().items() if stated.table == table)


def axes() -> tuple[str, ...]:
    """The words that can be an axis; a pin's profile is a file."""
    return tuple(stated.word or name for name, stated in parameters_of_a_case().items() if stated.axis)


def table_of(word: str) -> str:
    """The table that takes a word; empty where none does."""
    return next((table for table in TABLES if word in words_of(table)), "")


def in_words(text: str) -> str:
    """A text about parameters with their words of a manifest in place of their names."""
    named = {name: word for word, name in words().items() if word != name}
    return re.sub("|".join(rf"\b{name}\b" for name in named), lambda found: named[found.group()], text)


def settings() -> tuple[str, ...]:
    """Parameters that say how a slab is discretized."""
    return (*(name for name in declared(Slab) if name not in PHYSICS), *SCHEMES.settings())


LIMITS: dict[str, int | float] = {"max_events": 100_000, "max_spacings": 2.0}
"""Limits of a record where a campaign has none. What the pin meets repeats with the node spacing: from one spacing after first
touch on, the mean over whole spacings is known ten times better than from 2000 events, for four times their cost. Two leave
room for initial contact to be forgotten. The events bound what slippery or light contacts cost: millions a spacing."""


def make_case(parameters: Mapping[str, Any]) -> Case:
    """The case with these fields, defaults for the rest.

    A limit of displacement or spacings without one of events stands alone; without any limit there are LIMITS.
    Raises InvalidInput with the word of a manifest, value and range.
    """
    for name, value in parameters.items():
        if isinstance(value, float) and math.isinf(value) and name != "intrinsic_friction":
            raise InvalidInput(f"{name} = {value!r}: needs a finite number")
    limits: dict[str, Any] = {}
    if not parameters.keys() & {"max_events", "max_displacement", "max_spacings"}:
        limits = LIMITS
    elif "max_events" not in parameters:
        limits = {"max_events": None}
    try:
        return Case.of({**limits, **parameters})
    except InvalidInput as error:
        raise InvalidInput(in_words(str(error))) from None
