"""Reading of TOML, and writing: campaigns given as dicts are stored as TOML."""

import json
import os
import re
import tomllib
import unicodedata
from collections.abc import Mapping
from typing import Any, Final

from nanoslip.solver.outcome import SHOWN, quote_value


def from_toml(text: str) -> dict[str, Any]:
    """The document that TOML text is. Raises ValueError if it is none, or is nested too deeply."""
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("nested too deeply: needs fewer brackets within brackets") from None
    except ValueError as error:
        raise ValueError(f"not TOML: {error}") from None


def as_toml(document: Mapping[str, Any]) -> str:
    """TOML text of a document: values, then tables, then arrays of tables. Keys whose value is None are left out.

    Takes text, numbers, truth values, paths, lists, tuples, ranges, mappings, and arrays and scalars of numpy.
    Raises TypeError, naming the key, where a value is none of these.
    """
    values, sections = [], []
    for key, value in document.items():
        if isinstance(value, Mapping):
            sections.append(f"[{_key(key)}]\n" + _lines(value, f"{key}."))
        elif isinstance(value, list | tuple) and value and all(isinstance(item, Mapping) for item in value):
            sections += [f"[[{_key(key)}]]\n" + _lines(item, f"{key}[{place}].") for place, item in enumerate(value)]
        else:
            values.append(_lines({key: value}, ""))
    return "\n".join(["".join(values), *sections])


def _lines(table: Mapping[str, Any], where: str) -> str:
    stated = {key: value for key, value in table.items() if value is not None}
    return "".join(f"{_key(key)} = {_value(value, f'{where}{key}')}\n" for key, value in stated.items())


def _key(key: object) -> str:
    return str(key) if re.fullmatch(r"[A-Za-z0-9_-]+", str(key)) else _text(str(key))


def _text(text: str) -> str:
    # JSON's escapes are TOML's; a delete character, which JSON leaves as it is, has to be one too.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any, where: str) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str | os.PathLike):
        return _text(os.fspath(value))
    # Numbers of numpy, too, whose `repr` is another one.
    if isinstance(value, int | float):
        return float.__repr__(value) if isinstance(value, float) else int.__repr__(value)
    if isinstance(value, Mapping):
        inside = (f"{_key(key)} = {_value(item, f'{where}.{key}')}" for key, item in value.items() if item is not None)
        return "{" + ", ".join(inside) + "}"
    if isinstance(value, list | tuple | range):
        return "[" + ", ".join(_value(item, f"{where}[{place}]") for place, item in enumerate(value)) + "]"
    # Arrays and numbers of numpy.
    if hasattr(value, "tolist"):
        return _value(value.tolist(), where)
    raise TypeError(f"{where} = {value!r}: needs a text, a number, true or false, a list or a table")


_TURNING: Final = {"LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI"}
"""Kinds of letters that turn the direction of the letters after them, so that a text reads as another one."""
ONE_LINE: Final = "to be one line without control characters"


def is_one_line(text: str) -> bool:
    """True if a text is without line breaks, control characters and marks of direction, which terminals obey."""
    return text.isprintable() or not any(  # the latter takes ten times as long, and only foreign spaces need it
        unicodedata.category(letter) in ("Cc", "Zl", "Zp") or unicodedata.bidirectional(letter) in _TURNING
        for letter in text
    )


def quote_toml(value: object) -> str:
    """A value in the notation of TOML or nearly so, at most SHOWN characters."""
    try:
        text = float.__repr__(value) if isinstance(value, float) else json.dumps(value, ensure_ascii=False, default=str)
    # Python writes no number of more than 4300 digits, and nothing that is nested deeply.
    except (ValueError, RecursionError):
        return quote_value(value)
    return text if len(text) <= SHOWN else text[: SHOWN - 3] + "..."
