"""Tests assert facts: keys, numbers, names, exit codes. Sentences may be mended without a test noticing."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

SENTENCE = re.compile(r"[A-Za-z'μ_]+(?:[,;:]? [A-Za-z'μ_]+){3}")
"""Four words and more in a row."""
MOST = 60
"""Assertions with such words: wording is held once for each kind of message."""
TESTS = Path(__file__).parent


def sentences(text: str) -> Iterator[str]:
    """The words in a row that assertions of a file compare with, one of each assertion."""
    for node in ast.walk(ast.parse(text)):
        compared: list[ast.AST] = []
        if isinstance(node, ast.Assert):
            compared = list(ast.walk(node.test))
        elif isinstance(node, ast.Call) and getattr(node.func, "attr", "") in ("raises", "warns"):
            compared = [each.value for each in node.keywords if each.arg == "match"]
        values = [each.value for each in compared if isinstance(each, ast.Constant)]
        yield from [each for each in values if isinstance(each, str) and SENTENCE.search(each)][:1]


def test_few_assertions_hold_a_sentence() -> None:
    found = [f"{path.name}: {each}" for path in TESTS.rglob("*.py") for each in sentences(path.read_text("utf-8"))]
    assert len(found) <= MOST, found


def test_a_sentence_is_found_where_it_is_compared() -> None:
    lines = 'assert "raise the load a little" in x', 'assert f(x) == "needs 1 to 8", "why it is so here"'
    assert [len(list(sentences(line))) for line in lines] == [1, 0]
    assert len(list(sentences('pytest.raises(E, match="no such case is there")'))) == 1
