"""Texts of a dataset as whole numbers in its file, as netCDF has no type for them that every program can handle.

Arrays of characters get another dimension, along which xarray cannot transpose values that it has not read; strings
of variable length crash netCDF 4.10 if a file is open twice and closed once. So a text over dimensions is a number in
the file:

- a word of a fixed list, as `outcome` and `regime`, its place in the list: CF's `flag_values` and `flag_meanings`; -1
for none; - any other text its name, of 48 bits: a content hash of 12 hexadecimal digits, as `case_id`, its value;
  another text the first 12 digits of its SHA-256, under which the group `texts` has it. Files that are joined keep
  the meaning of their numbers.

Single texts and labels along a dimension stay characters.
"""

import hashlib
import re
from collections.abc import Iterable, Mapping
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

TEXTS: Final = "texts"
"""Group of the texts by name; its dimension and coordinate is `name`."""
_NAME: Final = "name"
_TEXT: Final = "text"
_STORED: Final = "stored_as"
"""Attribute of a variable whose numbers are texts: the way."""
_WORD: Final = "flag_meanings"
_HASH: Final = re.compile(r"[0-9a-f]{12}")
NONE: Final = -1
"""Name of an empty text."""
TextsByName = dict[int, str]
"""Name of a text -> the text."""


def text_array(values: Iterable[str]) -> NDArray[Any]:
    """Strings as an array that netCDF keeps at their length."""
    texts = list(values)
    # xarray takes no objects for numbers.
    return np.array(texts, dtype=object if texts else str)


def are_texts(variable: xr.Variable) -> bool:
    """True if the values of a variable are texts."""
    return variable.dtype.kind in "OUT"


def encode_texts(variable: xr.Variable, table: TextsByName) -> xr.Variable:
    """Texts as numbers; adds all texts but content hashes to the table."""
    values = variable.values.ravel().tolist()
    different = dict.fromkeys(map(str, values))
    words = str(variable.attrs.get(_WORD, "")).split()
    if words and different.keys() <= {*words, ""}:
        codes = {"": NONE, **{word: number for number, word in enumerate(words)}}
        kind: type[np.integer[Any]] = np.int8
        marks = {_STORED: _WORD}
    else:
        codes = {text: _name_text(text, table) for text in different}
        kind = np.int64
        marks = {_STORED: _NAME}
    places = [codes[str(text)] for text in values]
    numbers = np.array(places, kind).reshape(variable.shape)
    attributes = {**variable.attrs, **marks}
    return xr.Variable(variable.dims, numbers, attributes)


def _name_text(text: str, table: TextsByName) -> int:
    """Name of a text."""
    if not text or _HASH.fullmatch(text):
        return int(text, 16) if text else NONE
    digits = hashlib.sha256(text.encode()).hexdigest()[:12]
    name = int(digits, 16)
    # Two texts in 2^48 collide: the later one takes the next free number.
    while table.setdefault(name, text) != text:
        name += 1
    return name


def are_stored(variable: xr.Variable) -> bool:
    """True if a variable holds numbers of texts."""
    return _STORED in variable.attrs and variable.dtype.kind in "iu"


def decode_texts(variable: xr.Variable, table: Mapping[int, str]) -> xr.Variable:
    """Texts from numbers, in memory. Raises ValueError if a number has no text."""
    numbers = variable.values
    # Each number once: a dataset of many cases repeats a few of them.
    different, places = np.unique(numbers, return_inverse=True)
    if variable.attrs[_STORED] == _WORD:
        listed = str(variable.attrs.get(_WORD, "")).split()
        words = dict(enumerate(listed))
        words |= {NONE: ""} if words else {}
        decoded = [words.get(code) for code in different.tolist()]
    elif variable.attrs[_STORED] != _NAME:
        raise ValueError(f"{_STORED}: needs {_WORD} or {_NAME}")
    else:
        table = {NONE: "", **table}
        # A name that the table lacks is a content hash, which is its own text.
        decoded = [table.get(name, f"{name:012x}") for name in different.tolist()]
    if None in decoded:
        raise ValueError(f"numbers without a meaning in {_WORD}")
    attributes = {name: value for name, value in variable.attrs.items() if name != _STORED}
    encoding: dict[str, Any] = {"dtype": "S1"}
    # The groups of a file that xarray itself has opened are found by its source.
    if "source" in variable.encoding:
        encoding["source"] = variable.encoding["source"]
    different_texts = np.array([*decoded, ""], object)[:-1]
    texts = different_texts[places.reshape(numbers.shape)]
    return xr.Variable(variable.dims, texts, attributes, encoding)


def as_group(table: TextsByName) -> xr.Dataset:
    """The group of a file that has the texts by name; that of no text, too."""
    table = {NONE: "", **table}
    names = sorted(table)
    about = {
        "long_name": "text of a name",
        "comment": "of variables with stored_as = name; content hashes are names themselves",
    }
    contents = np.array([table[name] for name in names], object)
    numbers = np.array(names, np.int64)
    labels = (_NAME, numbers, {"long_name": "name of a text"})
    variables = {_TEXT: (_NAME, contents, about)}
    return xr.Dataset(variables, {_NAME: labels})


def text_table(group: xr.Dataset | None) -> TextsByName:
    """The texts of such a group by name. Raises KeyError if it is none."""
    if group is None:
        return {}
    texts: NDArray[Any] = group[_TEXT].values
    names = group[_NAME].values.tolist()
    words = map(str, texts.tolist())
    return dict(zip(names, words, strict=True))
