"""Everything public explains itself: it has a docstring, its own or an inherited one, for `help()` and for editors."""

import ast
import importlib
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import ROOT

FILES = [
    ROOT / "nanoslip.py",
    *sorted(path for package in ("solver", "study") for path in (ROOT / package).rglob("*.py")),
]
IMPORTED = [path for path in FILES if path.name != "__main__.py"]
"""To import a `__main__` is to run it."""
NO_MEANING = {"a", "an", "the", "of", "this", "its", "it", "is"}

Node = ast.FunctionDef | ast.ClassDef


def public(body: list[ast.stmt], owner: Any, prefix: str = "") -> Iterator[tuple[str, Node, Any]]:
    """Name, syntax and value of every public function, class and method."""
    for node in body:
        if isinstance(node, Node) and not node.name.startswith("_"):
            value = getattr(owner, node.name)
            yield prefix + node.name, node, value
            if isinstance(node, ast.ClassDef):
                yield from public(node.body, value, f"{prefix}{node.name}.")


def explanation(node: Node, value: Any) -> str:
    """Its docstring; a method may inherit it, a class may not: `inspect` would find what Python or a base says of itself."""
    return (ast.get_docstring(node) if isinstance(node, ast.ClassDef) else inspect.getdoc(value)) or ""


def says_more_than(name: str, text: str) -> bool:
    """Whether the first line of a docstring has a word that its name has not."""
    own = set(re.findall(r"[a-z]+", re.sub(r"([A-Z])", r" \1", name).lower()))
    said = set(re.findall(r"\w+", text.strip().split("\n")[0].lower()))
    return bool(said - own - NO_MEANING)


@pytest.mark.parametrize("path", IMPORTED, ids=lambda path: str(path.relative_to(ROOT)))
def test_everything_public_explains_itself(path: Path) -> None:
    tree = ast.parse(path.read_text("utf-8"))
    module = importlib.import_module(".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"))
    unexplained = [
        name
        for name, node, value in public(tree.body, module)
        if not says_more_than(node.name, explanation(node, value))
    ]
    assert not unexplained, f"{path}: no docstring, or one that says no more than the name"


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_file_says_what_it_is_for(path: Path) -> None:
    assert ast.get_docstring(ast.parse(path.read_text("utf-8")))


def test_a_docstring_that_repeats_the_name_is_none() -> None:
    assert not says_more_than("WholeSpacings", "The whole spacings.")
    assert not says_more_than("whole_spacings", "")
    assert says_more_than("whole_spacings", "Whole node spacings that a record spans.")
