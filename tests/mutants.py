"""Which small change of the code does no everyday test notice? `make mutants`, or `python -m tests.mutants --of FILE`.

Draws changes of one operator, number, condition or returned value, makes each in a copy of the tree and runs everyday tests on
two processes until one fails: files that name the module first, then those of its folder, then all others. A killer passes
without the change. Survivors ask for a law, or are equal to the original.
"""

import argparse
import ast
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
FIXED = {"annotation", "returns", "decorator_list"}
LEFT_OUT = (".git", ".venv", ".mypy_cache", ".hypothesis", "results", "build")
AREAS = {"solver": ("solver", "hard_cases", "verification"), "study": ("study",)}
"""Package -> folders of tests about it."""
HANGS = 120
"""Seconds after which a test is taken to hang, which kills; the longest takes 20."""
COMPARED = {"Lt": "<= >=", "LtE": "< >", "Gt": ">= <=", "GtE": "> <", "Eq": "!=", "NotEq": "==", "In": "not in", "NotIn": "in",
            "Is": "is not", "IsNot": "is"}  # fmt: skip
COMPUTED = {"Add": "-", "Sub": "+", "Mult": "/", "Div": "*", "FloorDiv": "/", "Mod": "*", "Pow": "*", "BitOr": "&",
            "BitAnd": "|"}  # fmt: skip


class Mutant(NamedTuple):
    """A change of one expression or statement of a file, whose path is relative to the root."""

    file: Path
    node: ast.expr | ast.stmt
    text: str

    def changed(self, source: str) -> str:
        """The file with the change."""
        lines, place = source.encode().splitlines(keepends=True), self.node
        assert place.end_lineno
        before = b"".join(lines[: place.lineno - 1]) + lines[place.lineno - 1][: place.col_offset]
        after = lines[place.end_lineno - 1][place.end_col_offset :] + b"".join(lines[place.end_lineno :])
        return (before + self.text.encode() + after).decode()


def mutants(file: Path, function: str = "") -> Iterator[Mutant]:
    """All mutants of a file, or of its functions of this name. Annotations, texts, assertions and decorators stay."""
    every = list(ast.walk(ast.parse((ROOT / file).read_text())))
    nodes = [each for each in every if getattr(each, "name", "") == function] if function else every[:1]
    while nodes:
        node = nodes.pop()
        if not isinstance(node, ast.Assert | ast.JoinedStr):
            below = [value for name, value in ast.iter_fields(node) if name not in FIXED]
            listed = [each for value in below for each in (value if isinstance(value, list) else [value])]
            nodes += [each for each in listed if isinstance(each, ast.AST)]
            yield from (Mutant(file, *change) for change in _changes(node))


def _changes(node: ast.AST) -> Iterator[tuple[ast.expr | ast.stmt, str]]:
    """What can be replaced at a node, with what replaces it."""
    text = ast.unparse
    match node:
        case ast.Compare(left, [operator], [right]):
            for other in re.findall(r"not in|is not|\S+", COMPARED[type(operator).__name__]):
                yield node, f"({text(left)} {other} {text(right)})"
        case ast.BinOp(left, operator, right) if other := COMPUTED.get(type(operator).__name__):
            yield node, f"(({text(left)}) {other} ({text(right)}))"
        case ast.AugAssign(target, operator, right) if other := COMPUTED.get(type(operator).__name__):
            yield node, f"{text(target)} {other}= {text(right)}"
        case ast.UnaryOp(ast.USub() | ast.Not(), operand):
            yield node, f"({text(operand)})"
        case ast.BoolOp(operator, values):
            other = " or " if isinstance(operator, ast.And) else " and "
            yield node, f"({other.join(f'({text(each)})' for each in values)})"
        case ast.Constant(bool(value)):
            yield node, repr(not value)
        case ast.Constant(int(value) | float(value)):
            yield node, repr(value + 1 if isinstance(value, int) else 2 * value or 1.0)
        case ast.If(test=test) | ast.While(test=test) | ast.IfExp(test=test):
            yield test, f"(not ({text(test)}))"
        case ast.Return(ast.expr() as value) if not isinstance(value, ast.Constant):
            yield value, "None"


def nearest_first(file: Path) -> list[list[str]]:
    """All files of tests: those that name a module, those about its folder, those about its package, the others."""
    package, *folders, name = file.with_suffix("").parts
    folder = ".".join(("nanoslip", package, *folders))
    named = re.compile(rf"{re.escape(folder)}(\.| import .*\b){name}\b")

    def distance(path: Path) -> int:
        text, (area, *_) = path.read_text(), path.relative_to(ROOT / "tests").parts
        return 0 if named.search(text) else 1 if folder in text else 2 if area in AREAS[package] else 3

    every = sorted((ROOT / "tests").rglob("test_*.py"))
    return [[str(path.relative_to(ROOT)) for path in every if distance(path) == far] for far in range(4)]


def first_failure(tree: Path, tests: list[str], seconds: float) -> str:
    """The first everyday test that fails; empty if none does, or none is there (exit code 5). Raises TimeoutExpired.

    conftest.py where nothing can be imported (exit code 4); an end of pytest itself decides nothing.
    """
    words = [sys.executable, "-m", "pytest", "-xq", "--tb=no", "-rfE", "-p", "no:cacheprovider", "-m", "not slow"]
    words += ["-n2", "--dist=loadfile", "--no-loadscope-reorder"]
    words += ["-o", f"faulthandler_timeout={HANGS}", "-o", "faulthandler_exit_on_timeout=true"]
    here = os.environ | {"PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1"}  # two may be of one second and size
    with tempfile.TemporaryFile("w+") as out:  # no pipe, which a test's children would keep open
        done = subprocess.run([*words, *tests], cwd=tree, stdout=out, stderr=out, env=here, timeout=seconds)  # noqa: PLW1510
        out.seek(0)
        found = re.search(r"^(?:FAILED|ERROR) (.*?)(?: - .*)?$", out.read(), re.MULTILINE)
    if done.returncode in {0, 5}:
        return ""
    unknown = "tests/conftest.py" if done.returncode == 4 else f"undecided: exit code {done.returncode}"
    return found[1] if found else unknown


def judged(mutant: Mutant, tree: Path, tests: list[list[str]], seconds: float) -> str:
    """Which test kills a mutant, or that it survived."""
    path = tree / mutant.file
    source = path.read_text()
    try:
        path.write_text(mutant.changed(source))
        killer = next(filter(None, (first_failure(tree, files, seconds) for files in tests if files)), "")
    except subprocess.TimeoutExpired:
        return f"undecided after {seconds:g} s"
    finally:
        path.write_text(source)
    anyway = killer and not killer.startswith("undecided") and first_failure(tree, [killer], seconds)
    return f"undecided: fails anyway: {killer}" if anyway else killer


def main() -> None:
    """Draw mutants, judge each and print a row as soon as it is known."""
    read = argparse.ArgumentParser(prog="python -m tests.mutants")
    read.add_argument("--count", type=int, default=30, help="how many [30]")
    read.add_argument("--seed", type=int, default=0, help="of the draw [0]")
    read.add_argument(
        "--of", nargs="+", default=[""], metavar="FILE[:FUNCTION]", help="only of files whose path begins so"
    )
    read.add_argument("--tests", nargs="+", help="run these; default: all, the nearest first")
    read.add_argument("--seconds", type=float, default=600.0, help="at most for each group of files [600]")
    asked = read.parse_args()
    files = [path.relative_to(ROOT) for part in AREAS for path in sorted((ROOT / part).rglob("*.py"))]
    every = [
        mutant
        for start, _, function in (each.partition(":") for each in asked.of)
        for file in files
        if str(file).startswith(start) and "kernels" not in file.parts
        for mutant in mutants(file, function)
    ]
    drawn, ends = random.Random(asked.seed).sample(every, min(asked.count, len(every))), []
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        shutil.copytree(ROOT, tree, symlinks=True, ignore=lambda at, _: LEFT_OUT if at == str(ROOT) else ())
        print(f"{len(drawn)} of {len(every)} mutants, seed {asked.seed}\n\nplace | change | killed by\n---|---|---")
        for mutant in drawn:
            tests = [asked.tests] if asked.tests else nearest_first(mutant.file)
            ends.append(judged(mutant, tree, tests, asked.seconds) or "survived")
            place, was = f"{mutant.file}:{mutant.node.lineno}", ast.unparse(mutant.node)
            print(f"{place} | `{was}` → `{mutant.text}` | {ends[-1]}", flush=True)
    survived, undecided = (sum(each.startswith(word) for each in ends) for word in ("survived", "undecided"))
    print(f"\n{len(ends) - survived - undecided} killed, {survived} survived, {undecided} undecided")


if __name__ == "__main__":
    main()
