"""The canonical text of a value is JSON of its content; texts that are made from what is alike are no other ones."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import pytest

from nanoslip.solver.case import Case, Heterogeneity
from nanoslip.solver.slab import Slab
from nanoslip.study import canonical
from nanoslip.study.canonical import CanonicalText, Texts, canonical_text, content_hash
from nanoslip.study.tasks.task import OF_CONTACT, OF_RECORD, deciding_fields, deciding_texts, list_dotted_fields
from tests.study.plan.test_keys import BASES, Greased, changed


def plain(value: Any) -> Any:
    """A value as JSON has it, without any haste."""
    if isinstance(value, float):
        return {"float": value.hex()}
    if is_dataclass(value):
        return {"type": type(value).__name__} | {item.name: plain(getattr(value, item.name)) for item in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    return [plain(each) for each in value] if isinstance(value, tuple | list) else value


def as_json(value: Any) -> str:
    return json.dumps(plain(value), sort_keys=True, separators=(",", ":"))


VALUES = [
    None, True, 1, 1.0, -0.0, math.inf, 10**30, "µ \"%s\" \n\0", (), [1, (2.0, "x")], {"b": 1, "a": {}, 3: None},
    Case(), Case(slab=Slab(scheme="chain")), {"%": 0.1, "case": Case(heterogeneity=Heterogeneity(spread=0.1))},
]  # fmt: skip


@pytest.mark.parametrize("value", VALUES, ids=repr)
def test_a_text_is_sorted_json_in_which_numbers_lose_no_bit(value):
    assert canonical_text(value) == as_json(value)


def test_a_text_that_is_known_stands_for_its_value():
    known = {"a": CanonicalText(canonical_text(Case())), "b": [CanonicalText("null")]}
    assert canonical_text(known) == canonical_text({"a": Case(), "b": [None]})


OTHERS = [changed(base, path) for base in BASES.values() for path, _ in list_dotted_fields(base)]
CASES = [*BASES.values(), *filter(None, OTHERS)]


@pytest.mark.parametrize("content", [lambda case: case.flat, lambda case: {"radius": case.radius}])
def test_texts_of_many_cases_are_those_of_each(content):
    texts = Texts(content)
    assert [texts(case) for case in CASES] == [canonical_text(content(case)) for case in CASES]


@pytest.mark.parametrize("exclusions", [OF_RECORD, OF_CONTACT], ids=["record", "contact"])
def test_texts_of_what_decides_are_those_of_each_case(exclusions):
    texts = deciding_texts(exclusions)
    for case in (*CASES, Greased(), Greased(film=1e-9), Greased(film=2e-9)):
        assert texts(case) == canonical_text(deciding_fields(case, exclusions))


def test_what_a_number_decides_beside_itself_has_to_be_said():
    def content(case: Case) -> dict[str, object]:
        return {"radius": case.radius, "large": case.radius > 100.0}

    texts = Texts(content, lambda case: case.radius > 100.0)
    for radius in (50.0, 200.0, 60.0, 300.0):
        assert texts(Case(radius=radius)) == canonical_text(content(Case(radius=radius)))


@dataclass(frozen=True)
class Bare:
    number: float
    word: str = "100 %s"


def test_numbers_that_nobody_checks_are_told_apart_by_type():
    texts = Texts(lambda value: {"number": value.number, "word": value.word})
    for value in (Bare(1.0), Bare(1.5), replace(Bare(2.0), word="\0")):
        assert texts(value) == canonical_text({"number": value.number, "word": value.word})


def test_what_is_kept_is_bounded(monkeypatch):
    monkeypatch.setattr(canonical, "MOST_PATTERNS", 3)
    texts = Texts(lambda case: case.flat)
    cases = [Case(max_events=events, radius=10.0 + events) for events in range(1, 9)]
    assert [texts(case) for case in cases] == [canonical_text(case.flat) for case in cases]
    assert len(texts._patterns) <= 3


def test_different_contents_have_different_hashes():
    values = [0, 0.0, "0", None, False, "", (), (0,), {"0": 0}, 0.3, 0.1 + 0.2, float("inf"), ("a", "b"), ("ab",)]
    assert len({content_hash(value) for value in values}) == len(values)
    assert content_hash("a", "b") != content_hash("ab")


def test_what_has_no_canonical_form_is_refused():
    with pytest.raises(TypeError, match="set"):
        content_hash({1, 2})
