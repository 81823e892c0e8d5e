"""A parameter is declared once, as the field of a frozen value: meaning, unit, range, and the place it has in a campaign file.

Checks, tables of manifests, labels of datasets and documentation follow from the declaration.
"""

import dataclasses
import itertools
import math
import sys
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass
from functools import lru_cache
from operator import attrgetter
from types import MappingProxyType
from typing import Any, Literal, NamedTuple, Self, get_args, get_origin

from nanoslip.solver.outcome import InvalidInput, quoted

Roughness = tuple[tuple[float, float], ...]

MOST_WHOLE = 2**63 - 1
"""The largest whole number that arrays and files hold."""

_KEY = "parameter"


@dataclass(frozen=True, slots=True)
class Parameter:
    """Declaration of a parameter. Bounds hold for numbers; None is allowed where the field's type has it."""

    meaning: str
    """What it is, short enough for the label of an axis."""
    table: str = ""
    """Table of a campaign file that takes it; empty where none does."""
    word: str = ""
    """Its key there, where that is not the field's name."""
    unit: str = "1"
    comment: str = ""
    """All there is to say of it, in sentences."""
    symbol: str = ""
    """What it is called in equations."""
    least: float = -math.inf
    most: float = math.inf
    above: float = -math.inf
    below: float = math.inf
    also: tuple[float, ...] = ()
    """Numbers allowed beside those in bounds."""
    need: str = ""
    """What is allowed, where the bounds alone do not say it."""
    note: str = ""
    """Remark after the bounds, in messages."""
    axis: bool = True
    """Whether a campaign can vary it."""
    scale: str = ""
    """Of a drive: the scale (a method or property of `Scales`) that its value in SI is a multiple of."""
    si: Any = None
    """Of a drive: its default in SI, where that is not the field's own."""

    def holds(self, number: float) -> bool:
        """Whether a number is in bounds."""
        inside = self.least <= number <= self.most and self.above < number < self.below
        return inside or number in self.also

    def allowed(self, name: str, whole: bool) -> str:
        """What is allowed, in words."""
        if self.need:
            return self.need
        if whole:
            return f"{self.least:.0f} to {int(self.most)}{self.note}"
        low = f"{_short(self.above)} < " if self.above > -math.inf else f"{_short(self.least)} ≤ "
        high = f" < {_short(self.below)}" if self.below < math.inf else f" ≤ {_short(self.most)}"
        if min(self.most, self.below) == math.inf:
            return (
                f"{name} > {_short(self.above)}{self.note}"
                if self.above > -math.inf
                else f"{name} ≥ {_short(self.least)}"
            )
        return f"{low}{name}{high}{self.note}"


def parameter(default: Any = MISSING, *, meaning: str, **declared: Any) -> Any:
    """A dataclass field that is a parameter; for what is declared see `Parameter`."""
    found = Parameter(meaning, **declared)
    return dataclasses.field(default=default, metadata={_KEY: found})


_declared: dict[type, Mapping[str, Parameter]] = {}
"""What `declared` has found: it is asked for every case of a campaign."""


def declared(kind: type) -> Mapping[str, Parameter]:
    """The parameters among the fields of a dataclass, by name, in their order."""
    if kind not in _declared:
        found = {item.name: item.metadata[_KEY] for item in dataclasses.fields(kind) if _KEY in item.metadata}
        _declared[kind] = MappingProxyType(found)
    return _declared[kind]


@lru_cache(maxsize=64)
def settings_of(*kinds: type) -> Mapping[str, tuple[Any, ...]]:
    """Parameter of any of these types -> those that have it: what the members of a family can be given."""
    names = dict.fromkeys(name for kind in kinds for name in declared(kind))
    return MappingProxyType({name: tuple(kind for kind in kinds if name in declared(kind)) for name in names})


def require(name: str, value: object, allowed: bool, need: str) -> None:
    """Raise InvalidInput, with the value and what is needed, unless it is allowed."""
    if not allowed:
        raise InvalidInput(f"{name} = {quoted(value)}: needs {need}")


def check(value: Any) -> None:
    """Give every parameter of a frozen value its declared type (200 and 200.0 are one case); refuse what is out of range."""
    kind = type(value)
    if kind not in _checks:
        checks = tuple(_Check.of(item) for item in dataclasses.fields(kind) if _KEY in item.metadata)
        _checks[kind] = checks, attrgetter(*(each.name for each in checks), "__class__"), [_NOTHING] * len(checks)
    checks, values_of, accepted = _checks[kind]
    for place, given in enumerate(values_of(value)[:-1]):
        if given is not accepted[place]:  # of a campaign's many cases most values are the last one's
            taken = checks[place].taken(given)
            if taken is given:
                accepted[place] = given
            else:
                object.__setattr__(value, checks[place].name, taken)


_NOTHING = object()


class _Check(NamedTuple):
    """How a value of one field is checked."""

    name: str
    stated: Parameter
    optional: bool
    """Whether None is allowed."""
    choices: tuple[str, ...]
    plain: Any
    """The declared type, where that is one that values are converted to."""

    @classmethod
    def of(cls, item: "dataclasses.Field[Any]") -> Self:
        kinds = (item.type, *get_args(item.type))
        plain = next((plain for plain in _CONVERSIONS if plain in kinds), None)
        return cls(item.name, item.metadata[_KEY], type(None) in kinds, choices_of(item.type), plain)

    def taken(self, given: Any) -> Any:
        """The value in its declared type. Raises InvalidInput."""
        if given is None and self.optional:
            return None
        if self.choices:
            if not (isinstance(given, str) and given in self.choices):
                require(self.name, given, False, "one of " + ", ".join(self.choices))
            return given
        if self.plain is None:
            return given
        value = _CONVERSIONS[self.plain](self.name, given)
        if self.plain in (int, float) and not self.stated.holds(value):
            require(self.name, value, False, self.stated.allowed(self.name, self.plain is int))
        return value


_checks: dict[type, tuple[tuple[_Check, ...], Callable[[Any], Any], list[Any]]] = {}
"""What `check` does with the fields of a type: how each is checked, what it holds, and what of each was accepted last."""


def choices_of(kind: Any) -> tuple[str, ...]:
    """The words that a field of this type takes; none where it takes others than words."""
    literal = next((each for each in (kind, *get_args(kind)) if get_origin(each) is Literal), None)
    return get_args(literal) if literal is not None else ()


def as_float(name: str, given: Any) -> float:
    """A number as a float. Raises InvalidInput where it is none, or more than floats hold."""
    if type(given) is float and not math.isnan(given):
        return (
            given or 0.0
        )  # -0.0 and 0.0 are one number; others stay the objects that they are: millions of cases share them
    fits = not isinstance(given, int) or abs(given) <= sys.float_info.max
    require(name, given, fits, f"a number of at most {sys.float_info.max:.2g}")
    number = not isinstance(given, bool | str) and _converts(float, given) and not math.isnan(float(given))
    require(name, given, number, "a number")
    return float(given) + 0.0


def as_int(name: str, given: Any) -> int:
    """A whole number as an int. Raises InvalidInput where it is none."""
    if isinstance(given, bool | str) or not _converts(int, given) or int(given) != given:
        raise InvalidInput(f"{name} = {quoted(given)}: needs a whole number")
    return int(given)


def _as_bool(name: str, given: Any) -> bool:
    require(name, given, isinstance(given, bool), "true or false")
    return bool(given)


def _as_points(name: str, given: Any) -> Roughness:
    try:
        points = tuple((as_float(name, xi), as_float(name, height)) for xi, height in given)
    except (TypeError, ValueError):
        raise InvalidInput(f"{name} = {quoted(given)}: needs pairs of numbers (ξ, height)") from None
    require(name, given, all(map(math.isfinite, itertools.chain(*points))), "finite numbers")
    return points


_CONVERSIONS: dict[Any, Callable[[str, Any], Any]] = {
    bool: _as_bool,
    int: as_int,
    float: as_float,
    Roughness: _as_points,
}
"""Declared type -> how a value becomes of it."""


def _converts(kind: type, given: Any) -> bool:
    try:
        kind(given)
    except (TypeError, ValueError, OverflowError):
        return False
    return True


def _short(number: float) -> str:
    """A bound as one writes it: 1e-4, 0.5, 1e24."""
    text = f"{number:g}"
    if number and math.isfinite(number) and not 1e-3 <= abs(number) < 1e3:
        mantissa, exponent = f"{number:e}".split("e")
        text = f"{float(mantissa):g}e{int(exponent)}"
    return text
