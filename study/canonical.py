"""Content hashes, and the canonical texts that are hashed: two values have the same text if and only if they are equal."""

import hashlib
import json
from collections.abc import Callable, Hashable, Mapping
from dataclasses import fields, is_dataclass
from json.encoder import encode_basestring_ascii
from operator import attrgetter
from typing import Any, Final, NamedTuple

from nanoslip.solver.parameter import declared


class CanonicalText(str):
    """A canonical text made earlier, for insertion into that of a larger value."""

    __slots__ = ()


def content_hash(*parts: object, length: int = 20) -> str:
    """Hexadecimal hash of values: equal for equal contents, whatever the order in which mappings were filled.

    Takes the same values as `canonical_text`. 200 and 200.0 differ here: numbers are expected to have become their
    declared type.
    """
    text = f"[{','.join(map(canonical_text, parts))}]"
    return hashlib.sha256(text.encode()).hexdigest()[:length]


def canonical_text(value: object) -> str:
    """A value as text, whatever the order in which mappings were filled.

    Takes None, bool, int, float, str, sequences, mappings and dataclasses (type and fields). 200 and 200.0 differ here.
    """
    if isinstance(value, str):
        return value if isinstance(value, CanonicalText) else encode_basestring_ascii(value)
    if isinstance(value, float):
        return _NUMBER % value.hex()
    if value is None or isinstance(value, int):
        return str(value) if type(value) is int else json.dumps(value)  # which takes ten times as long
    if is_dataclass(value):
        # Two types without fields differ by their names alone.
        kind = {"type": type(value).__name__}
        return _canonical_mapping(kind | {item.name: getattr(value, item.name) for item in fields(value)})
    if isinstance(value, Mapping):
        return _canonical_mapping({str(key): item for key, item in value.items()})
    if isinstance(value, tuple | list):
        return f"[{','.join(map(canonical_text, value))}]"
    raise TypeError(f"{value!r}: no canonical form for {type(value).__name__}")


def _canonical_mapping(content: Mapping[str, object]) -> str:
    items = [f"{encode_basestring_ascii(key)}:{canonical_text(content[key])}" for key in sorted(content)]
    return f"{{{','.join(items)}}}"


_NUMBER: Final = '{"float":"%s"}'
_HOLE: Final = "\0"
"""A place for a number: no text has this character, as it is escaped in strings."""
MOST_PATTERNS: Final = 2**14
"""Patterns that are kept: one for each case of the largest ensemble, at 1 kB or two each."""


class _Pattern(NamedTuple):
    """A text with places for numbers, and which of a value's numbers go there."""

    text: str
    places: tuple[int, ...]


class _Fields(NamedTuple):
    """The fields of a type: fields that are declared as floats, so that every given value becomes a float, and all
    other fields."""

    names: tuple[str, ...]
    numbers: Callable[[Any], Any]
    rest: Callable[[Any], Any]


class Texts:
    """Canonical texts of many dataclass values that differ in few fields, each from a text that similar values share.

    A text is made anew only if the values differ in more than their float parameters.
    """

    def __init__(
        self, content: Callable[[Any], Mapping[str, object]], others: Callable[[Any], Hashable] = lambda _: ()
    ) -> None:
        """content: entries to write for a value. Float parameters may appear there as entries with their names; no
        other entry may depend on them, except through `others`, which returns everything else that they decide.
        """
        self._content, self._others = content, others
        self._fields: dict[type, _Fields] = {}
        self._patterns: dict[tuple[Hashable, ...], tuple[_Pattern, Any]] = {}

    def __call__(self, value: Any) -> CanonicalText:
        """The canonical text of a value's content."""
        its = self._fields.get(type(value)) or self._fields.setdefault(type(value), _canonical_fields(type(value)))
        rest = its.rest(value)
        # By identity, as parts are shared, and hashing them would take longer than all else.
        alike = (self._others(value), *map(id, rest))
        pattern, _ = self._patterns.get(alike, (None, None))
        if pattern is None:
            if len(self._patterns) >= MOST_PATTERNS:
                self._patterns.clear()
            pattern = _pattern(self._content(value), its.names)
            # While the parts are kept no other object has their identity.
            self._patterns[alike] = pattern, rest
        numbers = its.numbers(value)
        return CanonicalText(pattern.text % tuple([numbers[place].hex() for place in pattern.places]))


def _canonical_fields(kind: type) -> _Fields:
    names = tuple(item.name for item in fields(kind) if item.type is float and item.name in declared(kind))
    rest = (item.name for item in fields(kind) if item.name not in names)
    return _Fields(names, attrgetter(*names, "__class__"), attrgetter(*rest, "__class__"))


def _pattern(content: Mapping[str, object], numbers: tuple[str, ...]) -> _Pattern:
    written = sorted(name for name in numbers if name in content)
    text = _canonical_mapping({**content, **dict.fromkeys(written, CanonicalText(_HOLE))})
    places = tuple(numbers.index(name) for name in written)
    return _Pattern(text.replace("%", "%%").replace(_HOLE, _NUMBER), places)
