"""Recipes: short scripts in `campaigns/recipes`, and for each a page with question, code, picture and what is printed.

`python campaigns/recipes` runs every script and writes the pages, the pictures and the gallery.
"""

import ast
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from nanoslip.study.results.store import write_files

FOLDER: Final = Path(__file__).resolve().parent
RECIPES: Final = ("map", "regimes", "event_sizes", "roughness", "neighbours", "resolution", "base")
"""The scripts, in the order of the gallery. Each writes one picture, of its own name, into the working folder."""
_ROOT: Final = Path(__file__).resolve().parents[2]


@dataclass(frozen=True, slots=True)
class Recipe:
    """A script: its docstring's first line is the question, the rest says what the picture shows."""

    name: str
    question: str
    text: str
    code: str
    """Without the docstring."""


def recipe(name: str) -> Recipe:
    """The recipe of this name, as its file in `FOLDER` says."""
    script = (FOLDER / f"{name}.py").read_text("utf-8")
    tree = ast.parse(script)
    question, _, text = (ast.get_docstring(tree) or "").partition("\n")
    code = "\n".join(script.splitlines()[tree.body[0].end_lineno :])
    return Recipe(name, question, text.strip(), code.strip())


def executed(name: str, into: Path) -> str:
    """Run a script in a folder, with warnings as errors; returns what it prints.

    Raises RuntimeError with its messages where it fails.
    """
    path = os.pathsep.join([str(_ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = os.environ | {"PYTHONPATH": path, "MPLBACKEND": "agg"}
    words = [sys.executable, "-W", "error", str(FOLDER / f"{name}.py")]
    done = subprocess.run(words, cwd=into, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"recipe {name}: {done.stderr}")
    return done.stdout


def page(shown: Recipe, printed: str) -> str:
    """The page of a recipe, as Markdown."""
    lines = "\n".join(line.rstrip() for line in printed.rstrip().splitlines())
    parts = (
        f"# {shown.question}",
        f"![{shown.question}]({shown.name}.png)",
        shown.text,
        f"```python\n{shown.code}\n```",
        f"It prints:\n\n```\n{lines}\n```",
        f"The script is [{shown.name}.py]({shown.name}.py); all recipes are in the [gallery](README.md).",
    )
    return "\n\n".join(parts) + "\n"


def gallery(recipes: Sequence[Recipe]) -> str:
    """The page of all recipes, as Markdown."""
    entries = (
        f"## [{each.question}]({each.name}.md)\n\n[![{each.question}]({each.name}.png)]({each.name}.md)"
        for each in recipes
    )
    return "\n\n".join((_HEAD, *entries)) + "\n"


_HEAD: Final = """# Recipes: what can I do from Python?

Seven questions, each answered by a script of at most 17 lines: copy one and change its numbers. `python map.py` runs in
seconds and leaves its picture in the working folder. Written by `python campaigns/recipes`."""


def main() -> None:
    """Run every recipe; write its picture and its page, and the gallery."""
    recipes, files = [recipe(name) for name in RECIPES], {}
    with TemporaryDirectory() as scratch:
        for each in recipes:
            files[FOLDER / f"{each.name}.md"] = page(each, executed(each.name, Path(scratch))).encode()
            files[FOLDER / f"{each.name}.png"] = (Path(scratch) / f"{each.name}.png").read_bytes()
    write_files(files | {FOLDER / "README.md": gallery(recipes).encode()})


if __name__ == "__main__":
    main()
