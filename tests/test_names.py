"""Names of functions say what they do: a verb with its object, or the noun that is returned.

A name is private if only its author can read it: one that begins with a preposition (`in_stages`), ends in one, or is a bare
participle (`grown`). Conversions begin with from, to, as or with, as everywhere in Python.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def split_words(text: str) -> frozenset[str]:
    return frozenset(text.split())


PREPOSITIONS = split_words(
    """of in by as from with without over at on beyond to for before after between beside per under within near along against
    into onto like until than behind"""
)
CONVERSIONS = frozenset({"from", "to", "as", "with"})
IRREGULAR = split_words(
    """found held kept known given drawn grown worn taken left made slid said told shown seen written meant gone chosen sold built
    felt heard stuck begun"""
)
"""Participles that are no verbs in another form, and do not end in -ed."""
VERBS = frozenset({"need", "feed", "exceed", "proceed", "embed"})
MOST_PRIVATE = 0.055
"""Share of private names: what is left of an older way to name. It may fall, never rise."""


def function_names(path: Path) -> Iterator[str]:
    """Functions and methods of a file, without those that Python or a decorator names."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("__"):
            decorators = {ast.unparse(decorator) for decorator in node.decorator_list}
            if not decorators & {"property", "cached_property"}:
                yield node.name


def is_private_way(name: str) -> bool:
    words = name.strip("_").lower().split("_")
    first, last = words[0], words[-1]
    if first in PREPOSITIONS and (first not in CONVERSIONS or len(words) == 1):
        return True
    if last in PREPOSITIONS:
        return True
    participle = first in IRREGULAR or (first.endswith("ed") and len(first) > 4)
    return participle and first not in VERBS


@pytest.mark.parametrize("name", ["in_stages", "grown", "values_of", "_named", "looked_up", "sorted_by"])
def test_a_private_way_to_name_is_noticed(name):
    assert is_private_way(name)


@pytest.mark.parametrize(
    "name", ["grow_contact", "from_si", "as_table", "find_verdict", "plateau", "is_member", "need_memory"]
)
def test_a_verb_or_a_noun_is_none(name):
    assert not is_private_way(name)


def test_no_more_functions_have_private_names():
    names = [
        name
        for folder in ("solver", "study")
        for path in sorted((ROOT / folder).rglob("*.py"))
        for name in function_names(path)
    ]
    private = sorted(filter(is_private_way, names))
    assert len(names) > 2000
    assert len(private) <= MOST_PRIVATE * len(names), private
