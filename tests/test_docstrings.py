"""Everything public explains itself: it has a docstring, its own or an inherited one; functions have names of what they do."""

import ast
import importlib
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tests.conftest import ROOT

FILES = [
    ROOT / "nanoslip" / "__init__.py",
    *sorted(path for package in ("solver", "study") for path in (ROOT / "nanoslip" / package).rglob("*.py")),
]
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


def unexplained(path: Path) -> Iterator[str]:
    """What is public in a file and has no docstring, or one that says no more than its name."""
    tree = ast.parse(path.read_text("utf-8"))
    if not ast.get_docstring(tree):
        yield f"{path}"
    if path.name != "__main__.py":  # to import it is to run it
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        for name, node, value in public(tree.body, importlib.import_module(module)):
            if not says_more_than(node.name, explanation(node, value)):
                yield f"{path}: {name}"


def test_everything_public_explains_itself() -> None:
    lacking = [name for path in FILES for name in unexplained(path)]
    assert not lacking, "\n".join(lacking)


def test_a_docstring_that_repeats_the_name_is_none() -> None:
    assert not says_more_than("WholeSpacings", "The whole spacings.")
    assert not says_more_than("whole_spacings", "")
    assert says_more_than("whole_spacings", "Whole node spacings that a record spans.")


SPEECH = {"say", "said", "tell", "told", "hear", "heard", "ask", "asked", "wanted", "known"}


def test_functions_read_compute_and_report_and_do_not_speak() -> None:
    trees = {path: ast.parse(path.read_text("utf-8")) for path in FILES}
    names = [
        (path, node) for path, tree in trees.items() for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)
    ]
    speaking = [f"{path}:{node.lineno}: {node.name}" for path, node in names if SPEECH & set(node.name.split("_"))]
    assert not speaking, "\n".join(speaking)
