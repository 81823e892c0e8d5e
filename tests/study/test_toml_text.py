"""A document written as TOML is read back as it was; what TOML cannot say is named."""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from nanoslip.study.toml_text import as_toml, from_toml

KEYS = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=8)
VALUES = st.recursive(
    st.booleans() | st.integers(-(2**63), 2**63 - 1) | st.floats(allow_nan=False) | KEYS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=3),
    max_leaves=8,
)


@pytest.mark.slow
@given(st.dictionaries(KEYS, VALUES, max_size=5))
def test_what_is_written_is_read(document):
    assert from_toml(as_toml(document)) == document


def test_values_of_numpy_paths_and_none_are_written():
    document = {
        "a": np.array([1.5, 2.0]),
        "b": np.int64(3),
        "c": Path("x.csv"),
        "d": None,
        "e": {"f": (1, True), "g": None},
    }
    assert tomllib.loads(as_toml(document)) == {"a": [1.5, 2.0], "b": 3, "c": "x.csv", "e": {"f": [1, True]}}
    lists = {"g": list(np.linspace(0.2, 0.4, 3)), "h": {"i": np.float64(0.1)}, "j": [np.float32(0.5), np.bool_(True)]}
    assert tomllib.loads(as_toml(lists)) == {"g": [0.2, 0.30000000000000004, 0.4], "h": {"i": 0.1}, "j": [0.5, True]}
    assert math.isinf(tomllib.loads(as_toml({"x": np.inf}))["x"])


@pytest.mark.parametrize(
    ("document", "where"),
    [({"a": {1, 2}}, "a = "), ({"a": {"b": [1, object()]}}, r"a\.b\[1\] = "), ({"d": [{"x": 1j}]}, r"d\[0\]\.x = ")],
)
def test_what_toml_cannot_say_is_named(document, where):
    with pytest.raises(TypeError, match=rf"^{where}.*: needs a text, a number"):
        as_toml(document)
