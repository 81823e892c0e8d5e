"""Run the everyday tests that a change can reach, nearest first: `make test-changed`, or `python -m tests.changed [REVISION]`.

A definition is a function, a class or a variable of a file; the definition "" is what a file does when it is imported.
Names in a definition are followed to other definitions, fixtures by their arguments, commands by the words of a test. A
dynamic import that cannot be followed reaches everything, and so does a changed file of another kind.
"""

import argparse
import ast
import hashlib
import json
import os
import re
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
KEPT = ROOT / ".pytest_cache" / "definitions.json"
"""Hash of a file -> its definitions: an unchanged file is parsed once."""
CLI = "nanoslip/study/commands/cli.py"
CALLS = {":subprocess.run", ":subprocess.Popen", ":nanoslip.study.commands.cli.main"}
"""How tests call commands."""
ENTERED = {
    "nanoslip/solver/slab.py": "nanoslip.solver.elasticity.schemes",
    "nanoslip/solver/drive.py": "nanoslip.solver.dynamics.integrators",
}
"""File of a table -> the modules that enter themselves there."""
FOLLOWED = re.compile(r"nanoslip/(solver/)?__init__|/commands/(cli|conduct|words)|/run/(executor|launch)")
"""Files whose dynamic imports are of written names: public ones, those of ENTERED, places of commands, full names in texts."""
DYNAMIC = {"import_module", "__import__", "run_path", "exec", "eval"}
DOTTED = re.compile(r"[A-Za-z_]\w*(?:\.\w+)*")
PLACED = re.compile(r"\b(?:nanoslip|tests)(?:\.\w+)+|\bnanoslip(?= import\b)|\b\w+\.py\b")
Node = tuple[str, str]  # file, name of a definition in it
File = dict[str, dict[str, Any]]  # name -> what `definition` collects


def imports_of(nodes: Iterable[ast.AST]) -> dict[str, str]:
    """Map each name that imports bring to the full name of what it is."""
    brought: dict[str, str] = {}
    for node in nodes:
        if isinstance(node, ast.Import):
            brought |= {each.asname: each.name for each in node.names if each.asname}
            brought |= {top: top for each in node.names if not each.asname for top in each.name.split(".")[:1]}
        elif isinstance(node, ast.ImportFrom):
            brought |= {each.asname or each.name: f"{node.module}.{each.name}" for each in node.names}
    return brought


def walk(nodes: Iterable[ast.AST]) -> Iterator[ast.AST]:
    """Yield nodes and all below, also of texts that are programs; not docstrings, nor parts of dotted names."""
    left = list(nodes)
    while left:
        node = left.pop()
        yield node
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and "import " in node.value:
            try:
                left += ast.parse(node.value).body
            except SyntaxError:  # no program: names in it are found by PLACED
                continue
        elif not (isinstance(node, ast.Attribute) and DOTTED.fullmatch(ast.unparse(node))):
            docstring = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
            left += () if docstring else ast.iter_child_nodes(node)


def definition(statements: list[ast.AST], brought: dict[str, str]) -> dict[str, Any]:
    """Collect what a definition names; of names that are imported the full ones, with a colon before them."""
    nodes = list(walk(statements))
    brought = brought | imports_of(nodes)
    names, texts, arguments = set(), set(), set()
    for node in nodes:
        if isinstance(node, ast.Name | ast.Attribute) and DOTTED.fullmatch(name := ast.unparse(node)):
            first, dot, rest = name.partition(".")
            names.add(f":{brought[first]}{dot}{rest}" if first in brought else first)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            texts |= {node.value, *(line.split(" ")[0] for line in node.value.splitlines() if "=" not in line)}
            names |= {f":{place}" for place in PLACED.findall(node.value)}
        elif isinstance(node, ast.arg):
            arguments.add(node.arg)
        elif isinstance(node, ast.Call) and ast.unparse(node.func).split(".")[-1] in DYNAMIC:
            names |= set() if isinstance(node.args[0], ast.Constant) else {"*"}
    decorators = " ".join(ast.unparse(each) for node in statements for each in getattr(node, "decorator_list", ()))
    code = hashlib.sha256("".join(map(ast.dump, statements)).encode()).hexdigest()
    found = {"names": sorted(names), "texts": sorted(texts), "arguments": sorted(arguments)}
    return {**found, "decorators": decorators, "code": code}


def definitions(text: str) -> File:
    """All definitions of a file's text."""
    made: dict[str, list[ast.AST]] = defaultdict(list)
    imports: list[ast.AST] = []
    types: list[ast.AST] = []
    left = list(ast.parse(text).body)
    while left:
        match node := left.pop(0):
            case ast.FunctionDef() | ast.ClassDef():
                made[node.name].append(node)
                if any("register" in ast.unparse(each) for each in node.decorator_list):
                    made[""].append(ast.Name(node.name))
            case ast.Import() | ast.ImportFrom():
                imports.append(node)
            case ast.If() if "TYPE_CHECKING" in ast.unparse(node.test):
                types += node.body
            case ast.If() | ast.Try() | ast.With():
                left = [*node.body, *getattr(node, "orelse", []), *left]
            case _:
                names = [each for each in ast.walk(node) if isinstance(each, ast.Name)]
                for name in [each.id for each in names if isinstance(each.ctx, ast.Store)] or [""]:
                    made[name].append(node)
    brought = imports_of([*types, *imports])
    own = {name: definition(made[name], brought) for name in {*made, ""}}
    own[""] |= {"loads": sorted(set(imports_of(imports).values())), "brought": brought}
    return own


def read_all() -> dict[str, File]:
    """All Python files that tests can import, by their path."""
    folders = ("nanoslip/solver", "nanoslip/study", "tests", "campaigns")
    paths = [*(ROOT / "nanoslip").glob("*.py"), *(path for each in folders for path in (ROOT / each).rglob("*.py"))]
    kept: dict[str, File] = json.loads(KEPT.read_text("utf-8")) if KEPT.exists() else {}
    salt, files, now = Path(__file__).read_bytes(), {}, {}
    for path in sorted(paths):
        content = path.read_bytes()
        key = hashlib.sha256(salt + content).hexdigest()
        files[str(path.relative_to(ROOT))] = now[key] = kept.get(key) or definitions(content.decode())
    if now.keys() != kept.keys():
        KEPT.parent.mkdir(exist_ok=True)
        scratch = KEPT.with_suffix(f".{os.getpid()}")
        scratch.write_text(json.dumps(now), "utf-8")
        scratch.replace(KEPT)
    return files


FILES = read_all()
MODULES = {name.removesuffix(".py").removesuffix("/__init__").replace("/", "."): name for name in FILES}
MODULES |= {Path(name).stem: name for name in FILES if name.startswith("campaigns/")}  # tests import scripts so
EVERYTHING = frozenset((file, name) for file in FILES for name in FILES[file])
DECLARED = {name: own["decorators"] for name, own in FILES[CLI].items() if "command('" in own["decorators"]}
NAMED = {name: re.findall(r"name='([\w-]+)'", text) for name, text in DECLARED.items()}
COMMANDS = {other[0] if other else name.replace("_", "-"): (CLI, name) for name, other in NAMED.items()}


@cache
def found(full: str) -> frozenset[Node]:
    """Definitions that a full name stands for: all of a module if the rest of the name is not defined there."""
    if full.endswith(".py"):
        return frozenset(node for node in EVERYTHING if Path(node[0]).name == full)
    parts = full.split(".")
    count = next((count for count in range(len(parts), 0, -1) if ".".join(parts[:count]) in MODULES), 0)
    if not count:
        return frozenset()
    file, name = MODULES[".".join(parts[:count])], (*parts[count:], "")[0]
    first = frozenset({(file, ""), (file, "__getattr__")}) & EVERYTHING
    if name and name in FILES[file]:
        return first | {(file, name)}
    if name in (brought := FILES[file][""]["brought"]):
        return first | found(".".join([brought[name], *parts[count + 1 :]]))
    return frozenset((file, name) for name in FILES[file]) - {*COMMANDS.values()}  # which are called by words


@cache
def uses(node: Node) -> frozenset[Node]:
    """Definitions that a definition names."""
    file, name = node
    own = FILES[file][name]
    seen = {each for full in own.get("loads", ()) for each in found(full) if not each[1]}
    if not name and file in ENTERED:
        seen |= found(ENTERED[file])
    for each in own["names"]:
        seen |= (
            found(each[1:]) if each.startswith(":") else {(file, each), (file, "")} if each in FILES[file] else set()
        )
    if file == CLI and (place := re.search(r"command\('(\w+):(\w+)'", own["decorators"])):
        seen |= found(f"nanoslip.study.commands.{place[1]}.{place[2]}") | {(CLI, "main"), (CLI, "cli")}
    return EVERYTHING if "*" in own["names"] and not FOLLOWED.search(file) else frozenset(seen - {node})


def closed(start: Iterable[Node], within: str = "") -> set[Node]:
    """These definitions and all that they use, one by another, in files of a folder."""
    seen, new = set(), list(start)
    while new:
        if (node := new.pop()) not in seen and node[0].startswith(within):
            seen.add(node)
            new += () if within and uses(node) is EVERYTHING else uses(node) - seen
    return seen


@cache
def fixtures(file: str) -> dict[str, set[Node]]:
    """Definitions of all fixtures that a file of tests sees, by their names; those that all tests use, by a star too."""
    seen = defaultdict(set)
    for place in [*(f"{folder}/conftest.py" for folder in Path(file).parents), file]:
        for name, own in FILES.get(place, {}).items():
            for key in (
                (name, "*") if "autouse" in own["decorators"] else (name,) if "fixture" in own["decorators"] else ()
            ):
                seen[key].add((place, name))
    return seen


def start(file: str, test: str) -> set[Node]:
    """A test, all that it uses among tests, and the commands that it calls: if it names none, every command."""
    known, own = fixtures(file), set[Node]()
    new = {(file, test), (file, "")} | known.get("*", set())
    while new - own:
        own = closed(new, "tests/")
        here = [FILES[file][name] for file, name in own]
        asked = {word for each in here for word in each["arguments"]}
        asked |= {word for each in here for word in re.findall(r"usefixtures\('(\w+)'\)", each["decorators"])}
        new = own.union(*(known[word] for word in asked & known.keys()))
    words = {word for file, name in own if name for word in FILES[file][name]["texts"]}
    calls = any(CALLS & {*each["names"]} for each in here)
    return own | ({COMMANDS[word] for word in COMMANDS.keys() & words} or {*COMMANDS.values()} if calls else set())


def reach(file: str, test: str) -> set[Node]:
    """All definitions that a test can run."""
    return closed(start(file, test))


def distances(changed: Iterable[Node]) -> dict[Node, int]:
    """Number of uses from a definition to the nearest changed one; what reaches everything is farther than all others."""
    users, stars = defaultdict(list), [node for node in EVERYTHING if uses(node) is EVERYTHING]
    for node in EVERYTHING.difference(stars):
        for other in uses(node):
            users[other].append(node)
    far: dict[Node, int] = {}
    for first, nodes in ((0, changed), (len(EVERYTHING), stars)):
        queue = [node for node in nodes if node not in far]
        far |= dict.fromkeys(queue, first)
        for node in queue:  # which grows
            new = {other: far[node] + 1 for other in users[node] if other not in far}
            far |= new
            queue += new
    return far


def chosen(changed: Iterable[Node]) -> list[str]:
    """The tests that reach changed definitions, files with the nearest first, and those directly in tests/."""
    far, files = distances(changed), defaultdict[str, list[tuple[int, str]]](list)
    for file in (each for each in FILES if Path(each).name.startswith("test_")):
        for test in (each for each in FILES[file] if each.startswith("test")):
            near = min((far[node] for node in start(file, test) & far.keys()), default=sys.maxsize)
            if near < sys.maxsize or Path(file).parent == Path("tests"):
                files[file].append((near, f"{file}::{test}"))
    return [test for tests in sorted(files.values(), key=min) for _, test in tests]


def differing(path: str, before: str) -> set[Node]:
    """Definitions of a file that differ from its former text. Files beside the sources count as all of their folder."""
    file = f"nanoslip/{path}" if path.startswith(("solver/", "study/")) else path
    if file in FILES and not file.endswith("conftest.py"):
        former = definitions(before)
        return {(file, name) for name, own in FILES[file].items() if former.get(name) != own}
    if file.startswith("docs/") or file.endswith((".md", ".cff")):  # tests of files read them
        return set()
    beside = {node for node in EVERYTHING if file.startswith(f"{Path(node[0]).parent}/")}
    return beside if beside and not file.endswith(".py") else set(EVERYTHING)


def git(*words: str) -> list[str]:
    """Lines that git prints."""
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()


def changes(since: str) -> set[Node]:
    """Definitions that differ from a revision."""
    old = set(git("ls-tree", "-r", "--name-only", since))
    paths = git("diff", "--no-renames", "--name-only", since) + git("ls-files", "--others", "--exclude-standard")
    former = {
        path: "\n".join(git("show", f"{since}:{path}")) if path in old and path.endswith(".py") else ""
        for path in paths
    }
    return {node for path in paths for node in differing(path, former[path])}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("since", nargs="?", default="HEAD")
    parser.add_argument("--list", action="store_true", help="only print which")
    given, rest = parser.parse_known_args()
    which = chosen(changes(given.since))
    if given.list:
        print("\n".join(which))
    elif which:
        os.execv(
            sys.executable, [sys.executable, "-m", "pytest", "-m", "not slow", "--no-loadscope-reorder", *rest, *which]
        )
