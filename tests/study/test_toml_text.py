"""A document written as TOML is read back as it was; what TOML cannot say is named."""

import math
import time
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nanoslip.study.toml_text import DEEPEST, as_toml, from_toml

KEYS = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=8)
VALUES = st.recursive(
    st.booleans() | st.integers(-(2**63), 2**63 - 1) | st.floats(allow_nan=False) | KEYS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=3),
    max_leaves=8,
)


@given(st.dictionaries(KEYS, VALUES, max_size=5))
def test_what_is_written_is_read(document):
    assert from_toml(as_toml(document)) == document


@pytest.mark.parametrize(
    "text",
    [
        "{} = 1",
        "[{}]",
        "[[{}]]",
        "a = {{{} = 1}}",
        "a = [1.5, {{b = 'c', {} = 1}}]",
        'a = {{b = """c"""", {} = 1}}',
        "a = {{b = '''c'''', {} = 1}}",
        '"=".{} = 1',
    ],
)
def test_a_key_of_very_many_parts_is_refused_before_anything_grows_with_their_square(text):
    key = " . ".join(["x", "'='", '"\\""', "#".join('""')] * 5000)
    begin = time.process_time()
    with pytest.raises(ValueError, match=f"a key of more than {DEEPEST} parts"):
        from_toml(text.format(key))
    assert time.process_time() - begin < 2.0  # 20 ms; its parser takes 20 s


def test_dots_that_are_in_no_key_do_not_count():
    dots = "a." * 100
    texts = f'a.b = \'{dots}\' # {dots}\nb = """\\"""{dots}\n{dots}""""\nc = \'\'\'\n\'{dots}\'\'\'\nd = [{"1.5, " * 100}]\n'
    assert from_toml(texts) == tomllib.loads(texts)


def test_what_cannot_be_read_keeps_to_time_however_it_is_quoted():
    for text in ('"""' + '\\"""\n' * 20_000, "'" * 200_001, '"' * 200_001, "." * 200_000, ".a\n" * 100_000):
        begin = time.process_time()
        with pytest.raises(ValueError, match=r"not TOML|more than"):
            from_toml(text)
        assert time.process_time() - begin < 2.0  # 30 ms


def test_values_of_numpy_paths_and_none_are_written():
    document = {
        "a": np.array([1.5, 2.0]),
        "b": np.int64(3),
        "c": Path("x.csv"),
        "d": None,
        "e": {"f": (1, True), "g": None},
    }
    assert tomllib.loads(as_toml(document)) == {"a": [1.5, 2.0], "b": 3, "c": "x.csv", "e": {"f": [1, True]}}
    assert math.isinf(tomllib.loads(as_toml({"x": np.inf}))["x"])


@pytest.mark.parametrize(
    ("document", "where"),
    [({"a": {1, 2}}, "a = "), ({"a": {"b": [1, object()]}}, r"a\.b\[1\] = "), ({"d": [{"x": 1j}]}, r"d\[0\]\.x = ")],
)
def test_what_toml_cannot_say_is_named(document, where):
    with pytest.raises(TypeError, match=rf"^{where}.*: needs a text, a number"):
        as_toml(document)
