"""Which small change of the code does no everyday test notice? `make mutants`, or `python -m tests.mutants --of FILE`.

Draws changes of one operator, number, condition or returned value, makes each in a copy of the tree and runs the test files that
can reach it: those that import its module, then those that name something public of its folder, then the mirrored folder's.
A test counts as a killer if it passes without the change. Survivors ask for a law, or are equal to the original.
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


def reaching(file: Path) -> list[str]:
    """Test files that can reach a module, those that import it first."""
    module, mirrored = str(file.with_suffix("")).replace("/", "."), ROOT / "tests" / file.parent
    bodies = [ast.parse(path.read_text()).body for path in (ROOT / file).parent.glob("*.py")]
    public = {each.name for body in bodies for each in body if isinstance(each, ast.FunctionDef | ast.ClassDef)}
    ranks = {}
    for path in sorted((ROOT / "tests").rglob("test_*.py")):
        words = set(re.findall(r"[\w.]+", path.read_text()))
        ranks[path] = f"nanoslip.{module}" in words, len(public & words), mirrored in path.parents
    order = sorted(ranks, key=ranks.__getitem__, reverse=True)
    return [str(path.relative_to(ROOT)) for path in order if any(ranks[path])]


def first_failure(tree: Path, tests: list[str], seconds: float) -> str:
    """The first everyday test that fails; empty if none does, or none is there (exit code 5). Raises TimeoutExpired."""
    words = [sys.executable, "-m", "pytest", "-xq", "--tb=no", "-rfE", "-p", "no:cacheprovider", "-m", "not slow"]
    here = os.environ | {"PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1"}  # two may be of one second and size
    with tempfile.TemporaryFile("w+") as out:  # no pipe, which a test's children would keep open
        done = subprocess.run([*words, *tests], cwd=tree, stdout=out, stderr=out, env=here, timeout=seconds)  # noqa: PLW1510
        out.seek(0)
        found = re.search(r"^(?:FAILED|ERROR) (.*?)(?: - .*)?$", out.read(), re.MULTILINE)
    return "" if done.returncode in {0, 5} else found[1] if found else "tests/conftest.py"


def judged(mutant: Mutant, tree: Path, tests: list[str], seconds: float) -> str:
    """Which test kills a mutant, or that it survived."""
    path, source = tree / mutant.file, (ROOT / mutant.file).read_text()
    try:
        path.write_text(mutant.changed(source))
        killer = first_failure(tree, tests, seconds)
    except subprocess.TimeoutExpired:
        return f"undecided after {seconds:g} s"
    finally:
        path.write_text(source)
    return f"undecided: fails anyway: {killer}" if killer and first_failure(tree, [killer], seconds) else killer


def main() -> None:
    """Draw mutants, judge each and print a row as soon as it is known."""
    read = argparse.ArgumentParser(prog="python -m tests.mutants")
    read.add_argument("--count", type=int, default=100, help="how many [100]")
    read.add_argument("--seed", type=int, default=0, help="of the draw [0]")
    read.add_argument("--of", default="", metavar="FILE[:FUNCTION]", help="only of files whose path begins so")
    read.add_argument("--all", action="store_const", dest="tests", const=["tests"], help="run the whole everyday suite")
    read.add_argument("--tests", nargs="+", help="run these; default: those that can reach the mutant")
    read.add_argument("--seconds", type=float, default=600.0, help="at most for each mutant [600]")
    asked = read.parse_args()
    start, _, function = asked.of.partition(":")
    files = [path.relative_to(ROOT) for part in ("solver", "study") for path in sorted((ROOT / part).rglob("*.py"))]
    files = [path for path in files if str(path).startswith(start) and "kernels" not in path.parts]
    every = [mutant for file in files for mutant in mutants(file, function)]
    drawn, ends = random.Random(asked.seed).sample(every, min(asked.count, len(every))), []
    print(f"{len(drawn)} of {len(every)} mutants, seed {asked.seed}\n\nplace | change | killed by\n---|---|---")
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        shutil.copytree(ROOT, tree, symlinks=True, ignore=lambda at, _: LEFT_OUT if at == str(ROOT) else ())
        for mutant in drawn:
            ends.append(judged(mutant, tree, asked.tests or reaching(mutant.file), asked.seconds) or "survived")
            place, was = f"{mutant.file}:{mutant.node.lineno}", ast.unparse(mutant.node)
            print(f"{place} | `{was}` → `{mutant.text}` | {ends[-1]}", flush=True)
    survived, undecided = ends.count("survived"), sum(each.startswith("undecided") for each in ends)
    print(f"\n{len(ends) - survived - undecided} killed, {survived} survived, {undecided} undecided")


if __name__ == "__main__":
    main()
