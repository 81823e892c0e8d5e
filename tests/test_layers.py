"""Data flows one way: a file imports only from files above it in its package's list, also the reading order."""

import ast
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

ORDER = {
    "solver": [
        "outcome",
        "case",
        "grid",
        "grading",
        "interpolation",
        "support",
        "schemes",
        "boundary_value",
        "column",
        "subsurface",
        "parity",
        "compliance",
        "conditioning",
        "pin",
        "soundness",
        "heterogeneity",
        "pressing",
        "_kernels",
        "_frozen_kernels",
        "tableau",
        "coulomb",
        "contact",
        "frozen",
        "sliding",
        "sampling",
        "validity",
        "plateau",
        "profile",
        "dynamics",
        "regime",
        "observables",
        "analytic",
        "laboratory",
    ],
    "study": [
        "provenance",
        "origin",
        "parameters",
        "problems",
        "columns",
        "drives",
        "manifest",
        "effects",
        "cases",
        "front",
        "targets",
        "tasks",
        "condensation",
        "cost",
        "drive_cost",
        "plan",
        "flags",
        "spans",
        "memory",
        "backlog",
        "interruption",
        "progress",
        "ledger",
        "crew",
        "launch",
        "farm",
        "store",
        "warmup",
        "vocabulary",
        "ensemble",
        "ragged",
        "dataset",
        "comparison",
        "verification",
        "console",
        "accuracy",
        "summary",
        "report",
        "submission",
        "cli",
        "__main__",
    ],
}
"""`__init__` of a package may import all of it; the files of a subpackage count as that subpackage."""

HOMES = {
    "mpi4py": {"farm"},
    "netCDF4": {"dataset", "accuracy", "report"},
    "xarray": {"ensemble", "ragged", "dataset", "verification", "accuracy", "summary", "report"},
    "matplotlib": {"accuracy", "report"},
}
FILES = sorted(path for package in ORDER for path in (ROOT / package).rglob("*.py"))


def imported(path: Path) -> set[str]:
    """Full names of all that a file imports, wherever in it."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_point_upwards(path: Path) -> None:
    package, *inside = path.relative_to(ROOT).with_suffix("").parts
    order, place = ORDER[package], inside[0]
    if inside == ["__init__"]:
        return
    assert place in order, f"{place} has no place in the list of {package}"
    own = {name.split(".")[1] for name in imported(path) if name.startswith(f"{package}.")}
    below = {name for name in own if name != place and name not in order[: order.index(place)]}
    assert not below, f"{path} imports from below: {below}"


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_libraries_stay_at_home(path: Path) -> None:
    package, *inside = path.relative_to(ROOT).with_suffix("").parts
    libraries = {name.split(".")[0] for name in imported(path)} - set(sys.stdlib_module_names)
    strangers = {library for library in libraries if inside[0] not in HOMES.get(library, {inside[0]})}
    assert not strangers, f"{path} imports {strangers}"
    if package == "solver":
        assert libraries <= {"solver", "numpy", "scipy", "numba"}
