"""Which small change of the code does no everyday test notice? `make mutants`, or `python -m tests.mutants --of FILE`.

Draws changes of one operator, number, condition or returned value, makes each in a copy of the tree and runs the everyday tests
that execute its line, as one run under coverage found: of a line outside functions, those that execute any of its file.
A test counts as a killer if it passes without the change. Survivors ask for a law, or are equal to the original.
"""

import argparse
import ast
import hashlib
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import NamedTuple

import pytest
from coverage import Coverage, CoverageData

ROOT = Path(__file__).resolve().parents[1]
FIXED = {"annotation", "returns", "decorator_list"}
LEFT_OUT = (".git", ".venv", ".mypy_cache", ".hypothesis", "results", "build")
CONTEXT = "MUTANTS_CONTEXT"
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


def executing(mutant: Mutant, measured: Path) -> list[str]:
    """Everyday tests that execute a mutant's statement, or use a fixture that does, those of quick files first."""
    found, place, first = CoverageData(str(measured / "coverage")), f"/tree/{mutant.file}", mutant.node.lineno
    found.read()
    by_line = next((found.contexts_by_lineno(each) for each in found.measured_files() if each.endswith(place)), {})
    nodes = [each for each in ast.walk(ast.parse((ROOT / mutant.file).read_text())) if isinstance(each, ast.stmt)]
    bodies = [range(each.body[0].lineno, each.end_lineno + 1) for each in nodes if isinstance(each, ast.FunctionDef)]
    lines = [line for body in bodies for line in body] or [*by_line]
    if first in lines:
        statement = max(each.lineno for each in nodes if each.lineno <= first <= each.end_lineno)
        lines = range(statement, mutant.node.end_lineno + 1)
    contexts = {name for line in lines for name in by_line.get(line, ())}
    chosen, total = [], Counter()
    for name, seconds, used in map(json.loads, (measured / "tests").read_text().splitlines()):
        file = name.split("::")[0]
        if contexts.intersection([name, file, *used]):
            chosen.append((file, seconds, name))
            total[file] += seconds
    return [name for *_, name in sorted(chosen, key=lambda each: (total[each[0]], *each))]


def measure(tree: Path, folder: Path) -> None:
    """Run the everyday tests under coverage, with the processes that they start; this module is their plugin."""
    shutil.rmtree(folder.parent, ignore_errors=True)
    folder.mkdir(parents=True)
    settings = folder / "settings"
    settings.write_text(
        f"[run]\ndata_file = {folder / 'coverage'}\nparallel = true\ncontext = ${{{CONTEXT}-}}\npatch = fork, _exit\n"
        f"include = {tree}/solver/*, {tree}/study/*\ndisable_warnings = no-data-collected, module-not-measured\n"
    )
    here = os.environ | {"PYTHONPATH": str(tree), "COVERAGE_PROCESS_START": str(settings)}
    words = ["pytest", "-q", "--tb=no", "-n2", "--dist=loadfile", "-p", "tests.mutants", "-m", "not slow", "tests"]
    subprocess.run([sys.executable, "-m", *words], cwd=tree, env=here, check=False)  # some count modules, and fail
    Coverage(config_file=str(settings)).combine([str(folder)])


@contextmanager
def _executed_by(name: str) -> Iterator[None]:
    before, os.environ[CONTEXT] = os.environ.get(CONTEXT, ""), name
    try:
        Coverage.current().switch_context(name)
        yield
    finally:
        os.environ[CONTEXT] = before
        Coverage.current().switch_context(before)


def pytest_configure() -> None:
    """Have processes name the test that started them."""
    start = subprocess.Popen.__init__

    def started(self, *words, env=None, **options):
        start(self, *words, env=env and {**env, CONTEXT: os.environ.get(CONTEXT, "")}, **options)

    subprocess.Popen.__init__ = started


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    with _executed_by(collector.nodeid):
        return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef):
    name = f"{fixturedef.baseid}::{fixturedef.argname}"
    with nullcontext() if fixturedef.scope == "function" else _executed_by(name):
        return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    ours = [vars(module) for name, module in sys.modules.items() if name.startswith(("nanoslip", "tests"))]
    for each in (value for names in ours for value in names.values() if hasattr(type(value), "cache_clear")):
        each.cache_clear()  # what an earlier test computed this one computes itself
    used = [f"{each[-1].baseid}::{each[-1].argname}" for each in item._fixtureinfo.name2fixturedefs.values()]
    begun = time.perf_counter()
    with _executed_by(item.nodeid):
        done = yield
    with Path(os.environ["COVERAGE_PROCESS_START"]).with_name("tests").open("a") as file:
        print(json.dumps([item.nodeid, time.perf_counter() - begun, used]), file=file)
    return done


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
    read.add_argument("--tests", nargs="+", help="run these; default: those that execute the mutant's line")
    read.add_argument("--seconds", type=float, default=600.0, help="at most for each mutant [600]")
    asked = read.parse_args()
    start, _, function = asked.of.partition(":")
    files = [path.relative_to(ROOT) for part in ("solver", "study") for path in sorted((ROOT / part).rglob("*.py"))]
    files = [path for path in files if str(path).startswith(start) and "kernels" not in path.parts]
    every = [mutant for file in files for mutant in mutants(file, function)]
    drawn, ends = random.Random(asked.seed).sample(every, min(asked.count, len(every))), []
    sources = [
        path.read_bytes() for part in ("solver", "study", "tests") for path in sorted((ROOT / part).rglob("*.py"))
    ]
    measured = ROOT / "build" / "mutants" / hashlib.sha256(b"".join(sources)).hexdigest()[:16]
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        shutil.copytree(ROOT, tree, symlinks=True, ignore=lambda at, _: LEFT_OUT if at == str(ROOT) else ())
        if not (asked.tests or (measured / "coverage").exists()):
            measure(tree, measured)
        print(f"{len(drawn)} of {len(every)} mutants, seed {asked.seed}\n\nplace | change | killed by\n---|---|---")
        for mutant in drawn:
            tests = asked.tests or executing(mutant, measured)
            ends.append(
                (judged(mutant, tree, tests, asked.seconds) or "survived") if tests else "survived: not executed"
            )
            place, was = f"{mutant.file}:{mutant.node.lineno}", ast.unparse(mutant.node)
            print(f"{place} | `{was}` → `{mutant.text}` | {ends[-1]}", flush=True)
    survived, undecided = (sum(each.startswith(word) for each in ends) for word in ("survived", "undecided"))
    print(f"\n{len(ends) - survived - undecided} killed, {survived} survived, {undecided} undecided")


if __name__ == "__main__":
    main()
