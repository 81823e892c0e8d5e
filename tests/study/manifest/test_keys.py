"""Every key in full: its example is a line that a campaign takes, and stands for the default."""

import tomllib
from typing import Any

import pytest

from nanoslip.solver.drive import Scales
from nanoslip.study.manifest.cases import tables
from nanoslip.study.manifest.keys import Key, find_key, key_text, keys, text_of_table
from nanoslip.study.manifest.manifest import SECONDS_KEY, TOP_LEVEL
from nanoslip.study.manifest.parameters import plain


def values(key: Key) -> list[Any]:
    """What each line of an example gives, in the unit of its key."""
    lines = [tomllib.loads(line) for line in key.example.split(", or ")]
    scales = None if key.stated.unit != "1" else Scales()
    return [plain(key.word, line[key.word], key.stated, scales) for line in lines]


@pytest.mark.parametrize(
    "key", [key for key in keys() if key.example and not key.stated.columns], ids=lambda key: f"{key.table}-{key.word}"
)
def test_an_example_is_the_default_with_and_without_a_unit(key: Key) -> None:
    default = tomllib.loads(f"value = {key.default}")["value"]
    for value in values(key):
        assert value == (default if isinstance(default, str | list) else pytest.approx(default, rel=1e-6))


def test_a_number_in_si_has_an_example_with_a_unit() -> None:
    without = {key.word for key in keys() if key.stated.unit not in ("", "1") and len(key.example.split(", or ")) < 2}
    assert without == {
        "stage_travel",
        "stage_frequency",
        "stage_stroke",
        "duration",
        "time_step",
        "seconds",
        "young_modulus",
    }  # which have no number as default


@pytest.mark.parametrize(("name", "word"), [("R", "radius"), ("mu_i", "intrinsic_friction"), ("k", "spring_stiffness")])
def test_a_key_is_found_by_its_symbol(name: str, word: str) -> None:
    found = find_key(name)
    assert found is not None
    assert found.word == word


@pytest.mark.parametrize("table", ["scales", "[slip]", "drives", "ensemble", "target", "outputs", "about"])
def test_a_table_has_all_its_keys(table: str) -> None:
    lines = text_of_table(table).splitlines()
    assert len(lines) >= 3
    assert lines[0] == f"[{table.strip('[]')}]"
    assert all(": " in line for line in lines[2:])  # what each key means
    assert not text_of_table("tables")


def test_all_of_a_key_fits_a_terminal_of_80_columns_or_is_a_sentence() -> None:
    for key in keys():
        facts = dict(line.strip().split(": ", 1) for line in key_text(key).splitlines()[1:])
        assert {"meaning", "key", "allowed", "default"} <= facts.keys(), key.word
        assert len(f"  allowed: {facts['allowed']}") <= 80 or key.word in ("of", "scheme"), key.word  # which list names


def test_every_key_that_a_file_takes_is_described() -> None:
    """Those of all tables and outside of them; symbols of scales and parameters too."""
    offered = {*TOP_LEVEL, *(word for words in tables().values() for word in words), SECONDS_KEY}
    assert [word for word in offered if not (find_key(word) or text_of_table(word))] == []
    assert [symbol for symbol in ("E", "G", "L_y", "L_x", "R", "nu", "mu_i", "W") if find_key(symbol) is None] == []
