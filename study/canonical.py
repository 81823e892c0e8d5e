"""The canonical text of a value: what content hashes are made of. Equal contents have equal texts, and no others have."""

import json
from collections.abc import Callable, Hashable, Mapping
from dataclasses import fields, is_dataclass
from json.encoder import encode_basestring_ascii
from operator import attrgetter
from typing import Any, Final, NamedTuple


class CanonicalText(str):
    """A canonical text that is known already: it stands for its value in another one."""

    __slots__ = ()


def canonical_text(value: object) -> str:
    """A value as text, whatever the order in which mappings were filled.

    Takes None, bool, int, float, str, sequences, mappings and dataclasses (type and fields). 200 and 200.0 differ here.
    """
    if isinstance(value, str):
        return value if isinstance(value, CanonicalText) else encode_basestring_ascii(value)
    if isinstance(value, float):
        return _NUMBER % value.hex()
    if value is None or isinstance(value, bool | int):
        return json.dumps(value)
    if is_dataclass(value):
        kind = {"type": type(value).__name__}  # two types without fields differ
        return _of_mapping(kind | {item.name: getattr(value, item.name) for item in fields(value)})
    if isinstance(value, Mapping):
        return _of_mapping({str(key): item for key, item in value.items()})
    if isinstance(value, tuple | list):
        return f"[{','.join(map(canonical_text, value))}]"
    raise TypeError(f"{value!r}: no canonical form for {type(value).__name__}")


def _of_mapping(content: Mapping[str, object]) -> str:
    items = [f"{encode_basestring_ascii(key)}:{canonical_text(content[key])}" for key in sorted(content)]
    return f"{{{','.join(items)}}}"


_NUMBER: Final = '{"float":"%s"}'
_HOLE: Final = "\0"
"""A place for a number: no text has this character, as it is escaped in strings."""
MOST_PATTERNS: Final = 2**14
"""Patterns that are kept: one for each case of the largest ensemble, at 1 kB or two each."""


class _Digits(dict[float, str]):
    """Number -> its hexadecimal digits, kept for those that are asked for again and again."""

    def __missing__(self, number: float) -> str:
        digits = number.hex()
        if number:  # 0.0 and -0.0 are equal
            if len(self) >= MOST_PATTERNS:
                self.clear()
            self[number] = digits
        return digits


_digits: Final = _Digits()


class _Pattern(NamedTuple):
    """A text with places for numbers, and which of a value's fields go there."""

    text: str
    places: tuple[int, ...]


class Texts:
    """Canonical texts of many dataclass values that differ in few of their fields, each from what is alike in them.

    A text is made anew only where more differs than floats among the value's own fields.
    """

    def __init__(
        self, content: Callable[[Any], Mapping[str, object]], others: Callable[[Any], Hashable] = lambda _: ()
    ) -> None:
        """content: what is written of a value. Of its own floats nothing may depend but entries that are they, by their names,
        and `others`: whatever else of the content they decide.
        """
        self._content, self._others = content, others
        self._getters: dict[type, tuple[tuple[str, ...], Callable[[Any], Any]]] = {}
        self._patterns: dict[Hashable, _Pattern] = {}

    def __call__(self, value: Any) -> CanonicalText:
        """The text of what is to be written of a value."""
        kind = type(value)
        if kind not in self._getters:
            names = tuple(item.name for item in fields(kind))
            self._getters[kind] = names, attrgetter(*names)
        names, getter = self._getters[kind]
        own = getter(value)
        alike = kind, self._others(value), *[float if type(each) is float else each for each in own]
        found = self._patterns.get(alike)
        if found is None:
            if len(self._patterns) >= MOST_PATTERNS:
                self._patterns.clear()
            found = self._patterns[alike] = self._pattern(value, names, own)
        return CanonicalText(found.text % tuple([_digits[own[place]] for place in found.places]))

    def _pattern(self, value: Any, names: tuple[str, ...], own: tuple[Any, ...]) -> _Pattern:
        content = dict(self._content(value))
        numbers = {name: place for place, name in enumerate(names) if type(own[place]) is float and name in content}
        text = _of_mapping(content | dict.fromkeys(numbers, CanonicalText(_HOLE)))
        places = tuple(numbers[name] for name in sorted(numbers))
        return _Pattern(text.replace("%", "%%").replace(_HOLE, _NUMBER), places)
