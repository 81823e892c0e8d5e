"""What each variable of a dataset is: name, unit, meaning, and the variable that states its uncertainty."""

import difflib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

from study.dataset.variables import (
    ADVICE,
    COMPANIONS,
    COMPUTED_BY,
    DISCRETIZATION_ERROR,
    OUTCOMES,
    SCALARS,
    SERIES,
    Quantity,
    parameters,
)

_CASES, _DRIVES = "cases", "cases, drive"


@dataclass(frozen=True, slots=True)
class Described:
    """One variable of a dataset."""

    name: str
    units: str
    meaning: str
    uncertainty: str = ""
    """The variable that states how uncertain this one is; empty where none does."""
    comment: str = ""
    dims: str = ""
    """The dimensions: `cases` stands for the axes of the campaign."""


def rows() -> tuple[Described, ...]:
    """All variables that a dataset may have, in the order of parameters, results of cases, runs of different length."""
    return tuple(_variables().values())


def described(name: str) -> Described:
    """A variable by its name. Raises KeyError, naming similar ones, where there is none."""
    found = _variables()
    if name not in found:
        near = ", ".join(difflib.get_close_matches(name, found, 3))
        raise KeyError(f"{name}: no variable of a dataset" + (f"; similar: {near}" if near else ""))
    return found[name]


def text_of(variable: Described) -> str:
    """All that is known of a variable, line by line."""
    facts = {
        "meaning": variable.meaning,
        "along": variable.dims,
        "unit": variable.units,
        "uncertainty": variable.uncertainty,
        "comment": variable.comment,
    }
    return "\n".join([variable.name, *(f"  {what}: {text}" for what, text in facts.items() if text)])


@lru_cache(maxsize=1)
def _variables() -> dict[str, Described]:
    found: dict[str, Described] = {}
    for quantity, dims in _quantities():
        one = Described(quantity.name, quantity.units, quantity.long_name, quantity.uncertainty, quantity.comment, dims)
        found.setdefault(one.name, one)
    return found


def _quantities() -> Iterator[tuple[Quantity, str]]:
    yield from ((quantity, _CASES) for quantity in (*parameters().values(), *OUTCOMES[""], COMPUTED_BY[""]))
    yield from ((quantity, _DRIVES) for quantity in (*OUTCOMES["drive"], COMPUTED_BY["drive"]))
    yield from ((quantity, _CASES) for quantity in (DISCRETIZATION_ERROR, ADVICE))
    for part in (SCALARS, COMPANIONS):
        for kind, scalars in part.items():
            yield from ((quantity, _DRIVES if kind == "drive" else _CASES) for quantity in scalars.values())
    for series in SERIES:
        yield from ((quantity, series.sample) for quantity in series.columns.values())
