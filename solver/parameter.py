"""A parameter is declared once, as the field of a frozen value: meaning, unit, range, and the place it has in a campaign file.

Checks, tables of manifests, labels of datasets and documentation follow from the declaration.
"""

import dataclasses
import difflib
import itertools
import math
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, dataclass, fields, replace
from functools import lru_cache, partial
from operator import attrgetter
from types import MappingProxyType
from typing import Any, Final, Literal, NamedTuple, Self, TypeVar, get_args, get_origin

import numpy as np
from numpy.typing import DTypeLike

from nanoslip.solver.outcome import SHOWN, InvalidInput, Need

# Declaration of a result's number, in the metadata of the dataclass field that holds it.
#
# A field states its name in a dataset, meaning, unit and uncertainty once. Variables, tables and pages follow from it.

SCALED: Final = ("", "normal_load", "contact_load", "intrinsic_friction", "length", "stiffness", "time", "velocity")
"""Scales of a number: none, the load W of all contacts or of a single contact, μ_i (the number becomes a share of
it), or the case's unit (the number becomes SI)."""
OVER_LOAD: Final = {"per": "normal_load", "symbol": "F/W"}
"""Scale and symbol of a friction force over load."""
ENERGY: Final = {"per": "normal_load", "measure": "W·L_x"}
STRESS: Final = {"per": "contact_load", "measure": "W/(L_x·L_y)"}
"""Scale and unit of an energy, and of a stress."""
PLUS_MINUS: Final = (
    "at 68 %, Student's t over independent starts, and the shared error where there is one; "
    "NaN of one member, of members with the same events, and where a member has no value"
)
SHARED_ERROR: Final = "_shared_error"
"""After a number's name: the part of its ± that all members share."""
_SHARED: Final = {
    "plateau": "part of ± that more members do not reduce: drift along the record",
    "stress": "part of ± that more members do not reduce: drift along the record, of force and area",
    "nodes": "part of ± by one node more or less in contact, where members do not show it",
    "events": "part of ± that more members do not reduce: drift of events along the record; NaN, as ±, of records shorter than "
    "two node spacings: events come in bursts that all members may miss",
    "length": "part of ± that more members do not reduce: what the later half of the record adds, as longer ones reach more; of "
    "drives NaN, as ±, over records shorter than two node spacings",
    "repetition": "part of ± that more members do not reduce, where the drive repeats its record: the number depends on the "
    "length of that, as half of it shows; if the stage keeps its direction NaN, as ±, where the record is shorter than two node "
    "spacings, and of the amplitude of a pin that slides, which is that of the repetition",
}
_KEY: Final = "quantity"


def measure_label(meaning: str, measure: str) -> str:
    """Meaning of a number with its unit, as a label: `mean step per event, in L_x`."""
    return f"{meaning}, in {measure}" if measure else meaning


@dataclass(frozen=True, slots=True)
class Quantity:
    """Variable of a dataset: a result's number in the solver's units, scaled by the unit in `per`."""

    name: str
    meaning: str
    """Name short enough for the label of an axis."""
    units: str = "1"
    per: str = ""
    """One of SCALED."""
    measure: str = ""
    """Unit of a number without SI unit, as L_x; empty of pure numbers."""
    ensemble: bool = False
    """True if its mean over the members of an ensemble has an uncertainty and a count of the members with a value."""
    shared: Literal["", "plateau", "stress", "nodes", "events", "length", "repetition"] = ""
    """Part of the error that all members share beside their scatter: drift of the record, whole nodes, bursts of events, or what
    a longer record would add to an extreme or to a motion that repeats it; empty if none."""
    alike: str = ""
    """Variable of words that must agree in all members, or there is no mean; nor is there if a member lacks the number."""
    comment: str = ""
    """Full explanation, in sentences."""
    symbol: str = ""
    """Symbol in equations."""
    flags: tuple[str, ...] = ()
    """Names of its bits 1, 2, 4, …; an empty name for an unused bit. The value is a whole number: 0, not NaN, without
    flags."""
    codes: tuple[str, ...] = ()
    """Meanings of its values 0, 1, …, which stay numbers."""
    words: tuple[str, ...] = ()
    """Texts that the variable can hold. A dataset has the text of most members, or an empty one; a result has the
    index into this tuple, or NaN."""
    along: str = ""
    """Sample dimension of a column of values; empty for one number of a case."""
    coordinate: bool = False
    """True if a column gives the displacement, time or place of the other columns."""
    dtype: DTypeLike = np.float64
    """Type of a column's values while they are gathered."""
    counted: bool = False
    """True if each member has a whole number of it."""
    source: str = ""
    """Function that computes it, where that is the user's own, and the hash of its source."""
    si: "Quantity | None" = None
    """A second variable that gives the number in SI, or as a share of μ_i; called after it, with `_si`, without a name."""

    def __post_init__(self) -> None:
        if self.per not in SCALED:
            raise ValueError(f"per = {self.per!r} of {self.name or self.meaning}: needs one of {SCALED}")

    @property
    def long_name(self) -> str:
        """Meaning, with the measure."""
        return measure_label(self.meaning, self.measure)

    @property
    def uncertainty(self) -> str:
        """The variable that holds its ±; empty if it has none."""
        return f"{self.name}_uncertainty" if self.ensemble else ""

    @property
    def shared_error(self) -> str:
        """The variable that holds the part of ± that all members share; empty if there is none."""
        return f"{self.name}{SHARED_ERROR}" if self.shared else ""

    @property
    def members(self) -> str:
        """The variable that counts the members that have a value; empty if there is none."""
        return f"{self.name}_members" if self.ensemble else ""

    @property
    def whole(self) -> bool:
        """True if its values are whole numbers, with 0 for a missing value."""
        return bool(self.flags) or self.dtype is np.int32

    def counts(self) -> "dict[str, Quantity]":
        """Word -> the variable that counts the members that have it."""
        names = {word: (f"{self.name}_{word}_members", f"members with {self.name} {word}") for word in self.words}
        return {word: Quantity(*name, dtype=np.int32) for word, name in names.items()}

    @property
    def beside(self) -> "tuple[Quantity, ...]":
        """Companion variables: its ± and the count of members with a value; of words the count of members with each."""
        if not self.ensemble:
            return tuple(self.counts().values())
        half, unit = f"± of {self.meaning}", (self.units, self.per, self.measure)
        quantities = (
            Quantity(self.uncertainty, half, *unit, comment=PLUS_MINUS),
            Quantity(self.members, f"members that have {self.name}"),
        )
        if not self.shared:
            return quantities
        return (
            *quantities,
            Quantity(self.shared_error, f"shared part of the {half}", *unit, comment=_SHARED[self.shared]),
        )


def quantity(meaning: str, name: str = "", units: str = "1", **more: Any) -> Any:
    """A dataclass field that is a quantity: `mean: float = quantity("mean F/W")`.

    name: of the variable; the field's own (behind the prefix of its part) where empty. more: further fields of `Quantity`.
    """
    return as_field(Quantity(name, meaning, units, **more))


def as_field(declared: Quantity) -> Any:
    """A dataclass field with the declaration of another field."""
    return dataclasses.field(metadata={_KEY: declared})


@lru_cache(maxsize=64)
def quantities(kind: type, prefix: str = "") -> Mapping[str, Quantity]:
    """Name of each number (prefix and field) of a dataclass that is declared as a quantity -> its declaration."""
    return {
        f"{prefix}{item.name}": replace(
            _name_quantity(item.metadata[_KEY], f"{prefix}{item.name}"), counted=item.type is int
        )
        for item in fields(kind)
        if _KEY in item.metadata
    }


def attributes(quantity: Quantity) -> dict[str, Any]:
    """Attributes of the variable in the dataset; words have no unit."""
    more: dict[str, Any] = {
        "symbol": quantity.symbol,
        "ancillary_variables": " ".join(filter(None, (quantity.uncertainty, quantity.members, quantity.shared_error))),
        "comment": quantity.comment,
        "source": quantity.source,
    }
    if quantity.flags:
        more["flag_masks"] = [np.int32(1 << bit) for bit, name in enumerate(quantity.flags) if name]
        more["flag_meanings"] = " ".join(filter(None, quantity.flags))
    if names := quantity.codes or quantity.words:
        more["flag_values"] = np.arange(len(names), dtype=np.int8)
        more["flag_meanings"] = " ".join(names)
    texts = {name: value for name, value in more.items() if len(value)}
    units = {} if quantity.words or not quantity.units else {"units": quantity.units}
    return {"long_name": quantity.long_name} | units | texts


def _name_quantity(declared: Quantity, key: str) -> Quantity:
    name, twin = declared.name or key, declared.si
    return replace(
        declared,
        name=name,
        si=twin and replace(twin, name=twin.name or f"{name}_si", ensemble=declared.ensemble, shared=declared.shared),
    )


Roughness = tuple[tuple[float, ...], ...]
"""Points of numbers, as many in each: (ξ, height) of a profile, (ξ, y, height) of an image."""
Numbers = tuple[float, ...]

MOST_WHOLE = 2**63 - 1
"""The largest whole number that arrays and files hold."""

_PARAMETER_KEY = "parameter"


@dataclass(frozen=True, slots=True)
class Parameter:
    """Declaration of a parameter. Bounds hold for numbers; None is allowed where the field's type has it."""

    meaning: str
    """Name short enough for the label of an axis."""
    table: str = ""
    """Table of a campaign file that holds it, by default its type's (`TABLE`); empty if it is in no table."""
    word: str = ""
    """Key in a campaign file, if that is not the field's name."""
    unit: str = ""
    """SI unit, by default 1 of numbers; empty of anything else."""
    measure: str = ""
    """Unit of a number without SI unit, as L_x; empty of pure numbers."""
    comment: str = ""
    """Full explanation, in sentences."""
    symbol: str = ""
    """Symbol in equations."""
    least: float = -math.inf
    most: float = math.inf
    above: float = -math.inf
    below: float = math.inf
    also: tuple[float, ...] = ()
    """Numbers allowed in addition to the range."""
    need: str = ""
    """Allowed values, if the bounds alone do not state them."""
    note: str = ""
    """Remark after the bounds, in messages."""
    columns: tuple[str, ...] = ()
    """Columns of the CSV file that a campaign names as its value; a parameter without is a value itself, and can be an axis."""
    listed: bool = False
    """True if its value is a list of numbers, which is no axis."""
    scale: str = ""
    """The scale (a method or property of `Scales`) that its value in SI is a multiple of."""
    si: Any = None
    """Default of a drive in SI, if that is not the field's own."""

    @property
    def long_name(self) -> str:
        """Meaning, with the measure."""
        return measure_label(self.meaning, self.measure)

    def holds(self, number: float) -> bool:
        """True if a number is in bounds."""
        inside = self.least <= number <= self.most and self.above < number < self.below
        return inside or number in self.also

    def describe_range(self, name: str, whole: bool) -> str:
        """Allowed values, in words."""
        if self.need:
            return self.need
        if whole:
            most = "2^63 - 1" if self.most == MOST_WHOLE else f"{self.most:.0f}"
            return f"{self.least:.0f} to {most}{self.note}"
        open_below = self.above > -math.inf
        if min(self.most, self.below) == math.inf:
            return f"{name} > {_short(self.above)}{self.note}" if open_below else f"{name} ≥ {_short(self.least)}"
        low = f"{_short(self.above)} < " if open_below else f"{_short(self.least)} ≤ "
        high = f" < {_short(self.below)}" if self.below < math.inf else f" ≤ {_short(self.most)}"
        return f"{low}{name}{high}{self.note}"


def parameter(default: Any = MISSING, *, meaning: str, **declared: Any) -> Any:
    """A dataclass field that is a parameter; `Parameter` explains the arguments."""
    stated = Parameter(meaning, **declared)
    return dataclasses.field(default=default, metadata={_PARAMETER_KEY: stated})


_declared: dict[type, Mapping[str, Parameter]] = {}
"""Cache of `declared`, which is called for every case of a campaign."""


def declared(kind: type) -> Mapping[str, Parameter]:
    """The parameters among the fields of a dataclass, by name, in their order."""
    if kind not in _declared:
        parameters = (item for item in fields(kind) if _PARAMETER_KEY in item.metadata)
        _declared[kind] = MappingProxyType({item.name: _complete_parameter(item, kind) for item in parameters})
    return _declared[kind]


def _complete_parameter(item: "dataclasses.Field[Any]", kind: Any) -> Parameter:
    stated: Parameter = item.metadata[_PARAMETER_KEY]
    number = _field_conversion(item.type) not in (None, bool)
    table = stated.table or getattr(kind, "TABLE", "")
    return replace(stated, table=table, unit=stated.unit or ("1" if number else ""))


@lru_cache(maxsize=64)
def family_settings(*kinds: type) -> Mapping[str, tuple[Any, ...]]:
    """Parameter of any of these types -> the types that have it: the settings of a family's members."""
    names = dict.fromkeys(name for kind in kinds for name in declared(kind))
    return MappingProxyType({name: tuple(kind for kind in kinds if name in declared(kind)) for name in names})


def require(name: str, value: object, allowed: bool, need: Need) -> None:
    """Raise InvalidInput, with the value and the requirement, unless it is allowed."""
    if not allowed:
        raise InvalidInput(name, value, need)


@lru_cache(maxsize=64)  # asked for each of a campaign's cases; a kind that registers later is another key
def merge_parameters(*kinds: type) -> Mapping[str, Parameter]:
    """The parameters of several dataclasses together, by name, in their order."""
    return MappingProxyType({name: stated for kind in kinds for name, stated in declared(kind).items()})


def refuse_unknown(values: Mapping[str, Any], stated: Mapping[str, Parameter], owner: str) -> None:
    """Raise InvalidInput, with the nearest name, for a key that is no parameter's name. owner: of the parameters, in words."""
    for key in values.keys() - stated.keys():
        spelt = {
            text: name
            for name, parameter in stated.items()
            for text in (parameter.symbol, parameter.word, name)
            if text
        }
        near = difflib.get_close_matches(str(key)[:SHOWN], spelt, 1, cutoff=0.5)
        meant = "".join(f"; nearest: {spelt[text]}" for text in near)
        raise InvalidInput(key, values[key], f"the name of a parameter of {owner}{meant}")


def validate(value: Any) -> None:
    """Give every parameter of a frozen value its declared type, so that 200 and 200.0 are the same case; refuse
    values out of range."""
    kind = type(value)
    if kind not in _checks:
        types = {item.name: item.type for item in fields(kind)}
        checks = tuple(_Check.make(name, stated, types[name]) for name, stated in declared(kind).items())
        _checks[kind] = checks, attrgetter(*(check.name for check in checks), "__class__"), [_NOTHING] * len(checks)
    checks, values_of, accepted = _checks[kind]
    for place, entry in enumerate(values_of(value)[:-1]):
        if entry is not accepted[place]:  # of a campaign's many cases most values are the last one's
            accepted_value = checks[place].convert_value(entry)
            if accepted_value is entry:
                accepted[place] = entry
            else:
                object.__setattr__(value, checks[place].name, accepted_value)


_NOTHING = object()


class _Check(NamedTuple):
    """Check of a field's value."""

    name: str
    stated: Parameter
    optional: bool
    """True if None is allowed."""
    choices: tuple[str, ...]
    plain: Any
    """The declared type, if values are converted to it."""

    @classmethod
    def make(cls, name: str, stated: Parameter, kind: Any) -> Self:
        return cls(name, stated, type(None) in get_args(kind), field_choices(kind), _field_conversion(kind))

    def convert_value(self, entered: Any) -> Any:
        """The value in its declared type. Raises InvalidInput."""
        if entered is None and self.optional:
            return None
        if self.choices:
            if not (isinstance(entered, str) and entered in self.choices):
                require(self.name, entered, False, f"one of {', '.join(self.choices)}{self.stated.note}")
            return entered
        if self.plain is None:
            return entered
        value = _CONVERSIONS[self.plain](self.name, entered)
        several = value if self.stated.columns or self.stated.listed else ()
        for entry in (value,) if self.plain in (int, float) else several:
            numbers = entry if self.plain is Roughness else (entry,)
            if not all(map(self.stated.holds, numbers)):
                require(self.name, entry, False, partial(self.stated.describe_range, whole=self.plain is int))
        return value


_checks: dict[type, tuple[tuple[_Check, ...], Callable[[Any], Any], list[Any]]] = {}
"""Cache of `check` by type: the check of each field, the reader of all values, and the values accepted last."""


def field_choices(kind: Any) -> tuple[str, ...]:
    """The words that a field of this type takes; none if it takes others than words."""
    literal = next((alternative for alternative in (kind, *get_args(kind)) if get_origin(alternative) is Literal), None)
    return get_args(literal) if literal is not None else ()


def as_float(name: str, value: Any) -> float:
    """A number as a float. Raises InvalidInput if it is none, or more than floats hold."""
    if type(value) is float and not math.isnan(value):
        # -0.0 and 0.0 are one number; others stay the objects that they are: millions of cases share them.
        return value or 0.0
    fits = not isinstance(value, int) or abs(value) <= sys.float_info.max
    require(name, value, fits, f"a number of at most {sys.float_info.max:.2g}")
    number = not isinstance(value, bool | str) and _converts(float, value) and not math.isnan(float(value))
    measured = isinstance(value, str) and value[:1].isdigit() and value[-1:].isalpha()
    require(name, value, number, f"a number{_NO_UNIT if measured else ''}")
    return float(value) + 0.0


_NO_UNIT: Final = " without a unit; lengths, loads, scales and drives of a campaign may have one"


def as_int(name: str, value: Any) -> int:
    """A whole number as an int. Raises InvalidInput if it is none."""
    is_whole = not isinstance(value, bool | str) and _converts(int, value) and int(value) == value
    require(name, value, is_whole, "a whole number")
    return int(value)


def _as_bool(name: str, value: Any) -> bool:
    require(name, value, isinstance(value, bool), "true or false")
    return bool(value)


def _as_points(name: str, value: Any) -> Roughness:
    try:
        points = tuple(tuple([as_float(name, number) for number in point]) for point in value)
    except TypeError:
        points = ((),)
    alike = {len(point) for point in points}
    require(name, value, alike <= {2} or alike == {3}, "points of two numbers each; of an image (ξ, y, height)")
    require(name, value, all(map(math.isfinite, itertools.chain(*points))), "finite numbers")
    return points


def _as_numbers(name: str, value: Any) -> Numbers:
    require(name, value, isinstance(value, Iterable) and not isinstance(value, str), "a list of numbers")
    return tuple(as_float(name, number) for number in value)


_CONVERSIONS: dict[Any, Callable[[str, Any], Any]] = {
    Roughness: _as_points,
    Numbers: _as_numbers,
    bool: _as_bool,
    int: as_int,
    float: as_float,
}
"""Declared type -> how a value becomes of it."""


def _field_conversion(kind: Any) -> Any:
    """The type to which a field's values are converted (of an optional field the type beside None); None if they are
    not converted."""
    kinds = (kind, *(get_args(kind) if get_origin(kind) is not tuple else ()))
    return next((plain for plain in _CONVERSIONS if plain in kinds), None)


def _converts(kind: type, value: Any) -> bool:
    try:
        kind(value)
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


# A family of methods, such as the schemes: one settings type each, registered by its name. What is not registered is refused.

T = TypeVar("T")
_Kind = TypeVar("_Kind", bound=type)


class Family(dict[str, type[T]]):
    """Name of a member -> its settings type, a frozen dataclass with that `name`. word: what parameters call the choice."""

    def __init__(self, word: str) -> None:
        super().__init__()
        self.word = word

    def register(self, kind: _Kind) -> _Kind:
        """Decorator that registers a settings type for values, manifests and documentation."""
        self[kind.name] = kind  # type: ignore[attr-defined]
        return kind

    def find_member(self, name: object) -> type[T]:
        """Settings type of this name. Raises InvalidInput if none is registered."""
        if isinstance(name, str) and name in self:
            return self[name]
        raise InvalidInput(self.word, name, f"one of {', '.join(self)}")

    def settings(self) -> Mapping[str, tuple[Any, ...]]:
        """Setting of any member -> the members that have it."""
        kinds: tuple[Any, ...] = tuple(self.values())
        return family_settings(*kinds)

    def member(self, parameters: Mapping[str, Any], default: str) -> T:
        """The member that these parameters choose, with its settings among them. Raises InvalidInput for another's settings."""
        chosen = parameters.get(self.word, default)
        chosen_settings: Mapping[str, Any] = {}
        if not isinstance(chosen, str) and type(chosen) in self.values():
            chosen_settings = {name: getattr(chosen, name) for name in declared(type(chosen))}
            chosen = chosen.name
        kind = self.find_member(chosen)
        settings = {**parameters, **chosen_settings}
        settings = {name: settings[name] for name in self.settings() if settings.get(name) is not None}
        for name, value in settings.items():
            owners = self.settings()[name]
            needed = " or ".join(f'"{owner.name}"' for owner in owners)
            require(name, value, kind in owners, f"{self.word} = {needed}")
        return kind(**settings)

    def flat(self, member: Any) -> dict[str, Any]:
        """Choice and settings of all members, by parameter; None for settings of the other members."""
        return {self.word: member.name} | {name: getattr(member, name, None) for name in self.settings()}
