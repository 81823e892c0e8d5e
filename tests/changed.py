"""The everyday tests that a change can reach: `make test-changed`, or `python -m tests.changed [REVISION]`.

From each test its names are followed: a function to what it uses, a fixture to what makes it, a command to what it calls, a
kernel to the kernels that it calls. All imports of the packages are statements or written names. What is not understood, as
pyproject.toml, reaches everything; a file beside the sources reaches the tests of files.
"""

import argparse
import ast
import os
import re
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
CLI, COMMANDS = "nanoslip/study/commands/cli.py", "nanoslip/study/commands/"
RUNNERS = {"main", "nanoslip", "computed", "finished", "compute", "cli", "clean_environment", "launcher", "subprocess"}
"""Names by which tests call commands."""
PLACED = re.compile(r"\b(?:nanoslip|tests)(?:\.\w+)+")
ENTERED = {
    "nanoslip/solver/slab.py": "nanoslip.solver.elasticity.schemes",
    "nanoslip/solver/drive.py": "nanoslip.solver.dynamics.integrators",
}
"""File of a table -> the modules that enter themselves there."""
Node = tuple[str, str]  # file, name in it; "" is what a file does when it is imported


def sources() -> Iterator[Path]:
    """All Python files that tests can import."""
    for folder in ("nanoslip/solver", "nanoslip/study", "tests", "campaigns"):
        yield from sorted((ROOT / folder).rglob("*.py"))
    yield from sorted((ROOT / "nanoslip").glob("*.py"))


FILES = {str(path.relative_to(ROOT)) for path in sources()}
SCRIPTS = {Path(name).stem: name for name in FILES if name.startswith("campaigns/")}


def file_of(module: str) -> str | None:
    """The file of a module, None of what is no module here."""
    stem = module.replace(".", "/")
    return next(
        (name for name in (SCRIPTS.get(module, ""), f"{stem}.py", f"{stem}/__init__.py") if name in FILES), None
    )


@cache
def public() -> dict[str, str]:
    """Name of `nanoslip` -> the module it is from."""
    whole = ast.parse((ROOT / "nanoslip/__init__.py").read_text("utf-8"))
    imports = (node for node in ast.walk(whole) if isinstance(node, ast.ImportFrom))
    return {alias.name: str(node.module) for node in imports for alias in node.names if alias.asname}


class Source:
    """The names that a file defines, with the statements of each, and those that it imports."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.made: dict[str, list[ast.AST]] = defaultdict(list)
        self.imports: dict[str, tuple[str, str]] = {}
        self._take(ast.parse((ROOT / name).read_text("utf-8")).body)

    def _take(self, body: list[ast.stmt]) -> None:
        for node in body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                entered = any("register" in ast.unparse(each) for each in node.decorator_list)
                self.made["" if entered else node.name].append(node)
                if entered:
                    self.made[node.name].append(node)
            elif isinstance(node, ast.Import | ast.ImportFrom):
                self.imports |= dict(_imported(node))
            elif isinstance(node, ast.Assign | ast.AnnAssign):
                for each in ast.walk(node):
                    if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store):
                        self.made[each.id].append(node)
            elif isinstance(node, ast.If | ast.Try | ast.With):
                if not (isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)):
                    self._take([*node.body, *getattr(node, "orelse", [])])
            elif not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):
                self.made[""].append(node)


def _imported(node: ast.Import | ast.ImportFrom) -> Iterator[tuple[str, tuple[str, str]]]:
    """Local name -> module and name in it."""
    for alias in node.names:
        if isinstance(node, ast.Import):
            whole = alias.name if alias.asname else alias.name.split(".")[0]
            yield alias.asname or whole, (whole, "")
        else:
            yield alias.asname or alias.name, (str(node.module), alias.name)


source = cache(Source)


def found(module: str, name: str) -> set[Node]:
    """What a name of a module is, or all of a module."""
    if module == "nanoslip" and name in public():
        return found(public()[name], name)
    if name and (inner := file_of(f"{module}.{name}")):
        return {(inner, "")}
    file = file_of(module)
    if file is None:
        return set()
    if name in source(file).made:
        return {(file, name), (file, "")}
    if name in source(file).imports:
        return {(file, ""), *found(*source(file).imports[name])}
    return {(file, "")}


def whole(module: str) -> set[Node]:
    """All that a text names: a module, or a name in it."""
    for count in range(len(parts := module.split(".")), 0, -1):
        if (file := file_of(".".join(parts[:count]))) and file != "nanoslip/__init__.py":
            rest = parts[count] if count < len(parts) else ""
            return found(".".join(parts[:count]), rest) if rest else {(file, each) for each in (*source(file).made, "")}
    return found("nanoslip", parts[1]) if parts[0] == "nanoslip" and len(parts) > 1 else set()


@cache
def words(node: Node) -> frozenset[str]:
    """Texts, names and arguments of a definition."""
    said = set()
    for statement in source(node[0]).made.get(node[1], ()):
        for each in ast.walk(statement):
            if isinstance(each, ast.Constant) and isinstance(each.value, str):
                said |= {each.value, *(line.split(" ")[0] for line in each.value.splitlines() if "=" not in line)}
            elif isinstance(each, ast.Name):
                said.add(each.id)
    return frozenset(said)


@cache
def arguments(node: Node) -> frozenset[str]:
    """What a definition takes by its name, fixtures among it."""
    walked = (each for statement in source(node[0]).made.get(node[1], ()) for each in ast.walk(statement))
    return frozenset(
        each.arg if isinstance(each, ast.arg) else str(each.value)
        for each in walked
        if isinstance(each, ast.arg) or (isinstance(each, ast.Constant) and each.value in RUNNERS)
    )


@cache
def uses(node: Node) -> frozenset[Node]:
    """What a definition uses, in its file and elsewhere."""
    file, name = node
    here, seen = source(file), set()
    if name == "":
        seen |= whole(ENTERED[file]) if file in ENTERED else set()
        if file != "nanoslip/__init__.py":
            for module, other in here.imports.values():
                seen |= {each for each in found(module, other) if each[1] == ""}
    for statement in here.made.get(name, ()):
        local = {
            k: v
            for each in ast.walk(statement)
            if isinstance(each, ast.Import | ast.ImportFrom)
            for k, v in _imported(each)
        }
        known = here.imports | local
        for each in ast.walk(statement):
            if isinstance(each, ast.Name) and each.id in here.made:
                seen.add((file, each.id))
            elif isinstance(each, ast.Name) and each.id in known:
                seen |= found(*known[each.id])
            elif isinstance(each, ast.Attribute) and isinstance(each.value, ast.Name) and each.value.id in known:
                module, inner = known[each.value.id]
                seen |= found(f"{module}.{inner}" if inner else module, each.attr)
            elif isinstance(each, ast.Constant) and isinstance(each.value, str):
                for place in PLACED.findall(each.value):
                    seen |= whole(place)
    return frozenset(seen - {node})


@cache
def commands() -> dict[str, set[Node]]:
    """Command -> its declaration and the function that it calls."""
    all_of = {}
    for function in (
        each for nodes in source(CLI).made.values() for each in nodes if isinstance(each, ast.FunctionDef)
    ):
        for call in function.decorator_list:
            if isinstance(call, ast.Call) and getattr(call.func, "id", "") == "command":
                named = next(
                    (
                        each.value.value
                        for each in call.keywords
                        if each.arg == "name" and isinstance(each.value, ast.Constant)
                    ),
                    None,
                )
                place, _, called = next(
                    str(each.value) for each in call.args if isinstance(each, ast.Constant)
                ).partition(":")
                all_of[str(named or function.name.replace("_", "-"))] = {
                    (CLI, function.name),
                    (f"{COMMANDS}{place}.py", called),
                    (f"{COMMANDS}{place}.py", ""),
                }
    return all_of


def closed(start: Iterable[Node]) -> set[Node]:
    """All that these use, one by another."""
    seen, new = set(), list(start)
    while new:
        node = new.pop()
        if node not in seen:
            seen.add(node)
            new.extend(uses(node) - seen)
    return seen


@cache
def fixtures(file: str) -> dict[str, Node]:
    """Fixture -> where it is made, as a file of tests sees it; those that all tests use are named with a star."""
    seen: dict[str, Node] = {}
    for place in [*(f"{folder}/conftest.py" for folder in reversed(Path(file).parents)), file]:
        for name, nodes in source(place).made.items() if place in FILES else ():
            for node in nodes:
                said = " ".join(ast.unparse(each) for each in getattr(node, "decorator_list", ()))
                if "fixture" in said:
                    seen[f"*{name}" if "autouse" in said else name] = (place, name)
    return seen


def reach(file: str, test: str) -> set[str]:
    """Files with something that a test uses."""
    known = fixtures(file)
    start = {(file, test), (file, "")} | {place for name, place in known.items() if name.startswith("*")}
    own: set[Node] = set()
    while start - own:  # a fixture is used by its name: as an argument, or in usefixtures
        own = set(closed_in_tests(frozenset(start)))
        start = own | {known[word] for node in own for word in arguments(node) if word in known}
    said = {word for node in own if node[1] for word in words(node)}
    runs = RUNNERS & {
        word
        for node in own
        if node[1]
        for word in (*arguments(node), *(each[1] for each in uses(node) if each[0] in (CLI, "tests/conftest.py")))
    } | ({"subprocess"} & said)
    if runs:
        ran = {"run"} if runs & {"computed", "finished", "compute"} else set()
        named = (said & commands().keys()) | ran or commands().keys()
        start |= {(CLI, "main"), (CLI, "cli"), (CLI, ""), *(each for name in named for each in commands()[name])}
    everything = closed(start)
    entered = {each[0] for each in everything if each[1] == "" and source(each[0]).made.get("")}
    return {each[0] for each in everything if each[1]} | entered


@cache
def closed_in_tests(start: frozenset[Node]) -> frozenset[Node]:
    seen, new = set(), list(start)
    while new:
        node = new.pop()
        if node not in seen and node[0].startswith("tests/"):
            seen.add(node)
            new.extend(uses(node) - seen)
    return frozenset(seen)


def tests() -> Iterator[tuple[str, str]]:
    """Every test by its file and name."""
    for file in sorted(FILES):
        if file.startswith("tests/") and Path(file).name.startswith("test_"):
            for name, nodes in source(file).made.items():
                if name.startswith("test") and isinstance(nodes[0], ast.FunctionDef):
                    yield file, name


def chosen(changed: Iterable[str]) -> list[str]:
    """The tests that changes can reach, or "tests"; tests of files whenever something has changed."""
    names: set[str] = set()
    for each in changed:
        name = f"nanoslip/{each}" if each.startswith(("solver/", "study/")) else each
        if name.endswith("conftest.py") or not (
            name in FILES
            or name.startswith("nanoslip/")
            or name.startswith(("docs/", "campaigns/"))
            or name.endswith((".md", ".cff"))
        ):
            return ["tests"]
        names |= (
            {name}
            if name in FILES
            else {other for other in FILES if name.startswith("nanoslip/") and str(Path(other).parent) in name}
        )
        names.add(name)
    files = [
        (file, test)
        for file, test in tests()
        if names and (Path(file).parent == Path("tests") or reach(file, test) & names)
    ]
    return [f"{file}::{test}" for file, test in files]


def changes(since: str) -> list[str]:
    """Files that differ from a revision, new ones too."""
    told = [["diff", "--name-only", since], ["ls-files", "--others", "--exclude-standard"]]
    return [
        line
        for each in told
        for line in subprocess.run(
            ["git", *each], cwd=ROOT, capture_output=True, text=True, check=True
        ).stdout.splitlines()
    ]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("since", nargs="?", default="HEAD")
    parser.add_argument("--list", action="store_true", help="only say which")
    parser.add_argument("--files", nargs="*", help="as if these had changed")
    given, rest = parser.parse_known_args()
    which = chosen(given.files if given.files is not None else changes(given.since))
    if given.list:
        print("\n".join(which))
    elif which:
        os.execv(sys.executable, [sys.executable, "-m", "pytest", "-m", "not slow", *rest, *which])
