"""Everything public explains itself: it has a docstring, its own or an inherited one; functions have names of what they do."""

import ast
import importlib
import inspect
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from tests.conftest import ROOT

FILES = [
    ROOT / "nanoslip" / "__init__.py",
    *sorted(path for package in ("solver", "study") for path in (ROOT / "nanoslip" / package).rglob("*.py")),
]
NEVER_FIRST = {"of", "whether", "what", "how", "where", "why", "which", "when", "those", "its", "by", "as"}
"""First words of a clause without a noun."""

Node = ast.FunctionDef | ast.ClassDef


def public(body: list[ast.stmt], owner: Any, prefix: str = "") -> Iterator[tuple[str, Node, Any]]:
    """Name, syntax and value of every public function, class and method."""
    for node in body:
        if isinstance(node, Node) and not node.name.startswith("_"):
            value = getattr(owner, node.name)
            yield prefix + node.name, node, value
            if isinstance(node, ast.ClassDef):
                yield from public(node.body, value, f"{prefix}{node.name}.")


@cache
def syntax_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text("utf-8"))


def explanation(node: Node, value: Any) -> str:
    """Its docstring; a method may inherit it, a class may not: `inspect` would find what Python or a base says of itself."""
    return (ast.get_docstring(node) if isinstance(node, ast.ClassDef) else inspect.getdoc(value)) or ""


def unexplained(path: Path) -> Iterator[str]:
    """Names of public objects of a file without a docstring."""
    tree = syntax_of(path)
    if not ast.get_docstring(tree):
        yield f"{path}"
    if path.name != "__main__.py":  # to import it is to run it
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        for name, node, value in public(tree.body, importlib.import_module(module)):
            if not explanation(node, value).strip():
                yield f"{path}: {name}"


def test_everything_public_explains_itself() -> None:
    lacking = [name for path in FILES for name in unexplained(path)]
    assert not lacking, "\n".join(lacking)


def begins_badly(text: str) -> bool:
    """True if a docstring begins with the first word of a clause, not with a verb or a noun."""
    words = re.findall(r"[a-z]+", text.lower())[:2]
    return bool(words) and (words[0] in NEVER_FIRST or words == ["the", "same"])


def texts(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Line and text of every docstring, and of every text that explains the assignment before it."""
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        for each in body if isinstance(body, list) else []:
            if (
                isinstance(each, ast.Expr)
                and isinstance(each.value, ast.Constant)
                and isinstance(each.value.value, str)
            ):
                yield each.lineno, each.value.value


def test_docstrings_begin_with_a_verb_or_the_thing_returned() -> None:
    bad = [
        f"{path}:{line}: {text.splitlines()[0]}"
        for path in FILES
        for line, text in texts(syntax_of(path))
        if begins_badly(text)
    ]
    assert not bad, "\n".join(bad)


def test_first_words_of_clauses_are_found() -> None:
    for text in ("Whether it is done.", "The same of a slab.", "By how much."):
        assert begins_badly(text)
    for text in ("True if done.", "The steady part.", "Offset of a grid.", "(N,) Forces."):
        assert not begins_badly(text)


SPEECH = {"say", "said", "tell", "told", "hear", "heard", "ask", "asked", "wanted", "known"}


def test_functions_read_compute_and_report_and_do_not_speak() -> None:
    names = [(path, node) for path in FILES for node in ast.walk(syntax_of(path)) if isinstance(node, ast.FunctionDef)]
    speaking = [f"{path}:{node.lineno}: {node.name}" for path, node in names if SPEECH & set(node.name.split("_"))]
    assert not speaking, "\n".join(speaking)
