"""The flat names of a case: every field of Case and its parts is one parameter with one word and one table."""

import math
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from solver.case import Case, Effects, Heterogeneity, Slab, SlipRule
from solver.outcome import InvalidInput

Value = float | int | str

TABLES: dict[str, tuple[str, ...]] = {
    "constants": ("intrinsic_friction", "radius", "normal_load", "poisson", "aspect_ratio", "pin", "half_width"),
    "numerics": (
        "n_x",
        "scheme",
        "support",
        "rows_per_level",
        "coarsest_row",
        "bottom_row",
        "first_spacing",
        "rows",
        "initial_contact",
        "start",
    ),
    "slip": ("slip_order", "residual_shear", "event_floor", "cascade_limit"),
    "effects": ("friction", "coupling", "pin_translation"),
    "heterogeneity": ("distribution", "spread", "seed", "roughness"),
    "limits": ("events", "displacement", "spacings"),
}
"""Table of a manifest -> the words it takes."""

WORDS: tuple[str, ...] = tuple(word for words in TABLES.values() for word in words)
AXES: tuple[str, ...] = tuple(word for word in WORDS if word != "roughness")
"""Those that can be an axis; a pin's profile is a file."""
STANDARD = ("intrinsic_friction", "radius", "aspect_ratio", "n_x")
"""Parameters that every case is labelled with, in the order of a dataset's dimensions."""

PHYSICS = ("aspect_ratio", "poisson", "support")
"""Fields of a slab that say what it is."""
SETTINGS = tuple(item.name for item in fields(Slab) if item.name not in PHYSICS)
"""Fields of a slab that say how it is discretized."""

_PARTS: dict[str, Any] = {
    "slab": Slab,
    "slip_rule": SlipRule,
    "effects": Effects,
    "heterogeneity": Heterogeneity,
}
"""Field of a case -> the type of its part; the fields of these are parameters as those of the case itself are."""
_NAMES = {part: tuple(item.name for item in fields(kind)) for part, kind in _PARTS.items()}
_CASE = tuple(item.name for item in fields(Case) if item.name not in _PARTS)
_FIELD_OF_WORD = {"events": "max_events", "displacement": "max_displacement", "spacings": "max_spacings"}


LIMITS: dict[str, int | float] = {"max_events": 100_000, "max_spacings": 2.0}
"""Limits of a record where a campaign has none. What the pin meets repeats with the node spacing: from one spacing after first
touch on, the mean over whole spacings is known ten times better than from 2000 events, for four times their cost. Two leave
room for initial contact to be forgotten. The events bound what slippery or light contacts cost: millions a spacing."""


def field_name(word: str) -> str:
    """The field that a manifest's word sets (`events` sets `max_events`; most are spelled alike)."""
    return _FIELD_OF_WORD.get(word, word)


def make_case(parameters: Mapping[str, Any]) -> Case:
    """The case with these fields, defaults for the rest.

    A limit of displacement or spacings without one of events stands alone; without any limit there are LIMITS.
    Raises InvalidInput with the field, value and range.
    """
    for name, value in parameters.items():
        if isinstance(value, float) and math.isinf(value) and name != "intrinsic_friction":
            raise InvalidInput(f"{name} = {value!r}: needs a finite number")
    own = {name: value for name, value in parameters.items() if name in _CASE}
    if not own.keys() & {"max_events", "max_displacement", "max_spacings"}:
        own |= LIMITS
    elif "max_events" not in own:
        own = {"max_events": None, **own}
    parts = {
        part: kind(**{name: value for name, value in parameters.items() if name in _NAMES[part]})
        for part, kind in _PARTS.items()
    }
    return Case(**own, **parts)


def flat(case: Case) -> dict[str, Value | None]:
    """Every parameter of a case by field name; the inverse of `make_case`."""
    own = {name: getattr(case, name) for name in _CASE}
    return own | {name: getattr(getattr(case, part), name) for part, names in _NAMES.items() for name in names}
