"""Data flows one way: a folder imports only from folders above it in its package's list, and so do the files of a folder.

The lists are also the reading order. A folder holds some rooms, a file one notion; neither is cut to please a count.
"""

import ast
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

ORDER = {
    "solver": "compiled compiling last outcome quantity view parameter family slab case ensemble drive elasticity contact "
    "sliding dynamics simulate",
    "solver.elasticity": "grid lagrange support stiffness condensation grid_scheme boundary_value schemes "
    "interior compliance conditioning",
    "solver.elasticity.condensation": "parity translations elimination dissection condensed",
    "solver.elasticity.schemes": "convolution endless grading column biquadratic galerkin half_plane chain",
    "solver.contact": "kernels outcomes closed_forms pin node_friction soundness normal convolved "
    "window tableau compiled_contact coulomb state initial",
    "solver.contact.normal": "system exchange contact",
    "solver.contact.kernels": "enumerations state vectors pin_height slip_distance equilibrium contact_change violations cascade "
    "next_event loading",
    "solver.contact.convolved": "conjugate_gradients contact",
    "solver.contact.coulomb": "contact roles motion",
    "solver.sliding": "kernels record columns plateau full_contact tangential coulomb hindsight events "
    "statistics distributions validity",
    "solver.sliding.distributions": "power_law rivals events record",
    "solver.sliding.kernels": "events step full_contact tangential",
    "solver.dynamics": "friction_limit kernels result precision proportion method rigid exact rk4 integrate coefficients "
    "stick_slip regime",
    "solver.dynamics.kernels": "state teeth slips oscillator roots segment_end friction_law recording cruise event_driven rigid "
    "runge_kutta",
    "study": "shipped toml_text exit_codes xarray_accessor garbage canonical provenance machine origin manifest "
    "discretization plan results dataset execution figures report accuracy api commands __main__",
    "study.manifest": "parameters problems columns drives manifest checker named_files drive_tables reader "
    "effects cases one_case",
    "study.discretization": "front targets",
    "study.plan": "task keys cost kinds tasks case_tasks order plan standing size outlook flags spans memory",
    "study.plan.cost": "condensation sliding seconds arrays drive",
    "study.plan.standing": "endings outline",
    "study.plan.kinds": "kind compliance contact record statistics states drive",
    "study.results": "whole_file lines entry own logs attempts runs store lease shard merging",
    "study.results.logs": "log places all_logs",
    "study.dataset": "seal texts groups netcdf file made_of variables members collection description access comparison "
    "pair verification agreement",
    "study.dataset.collection": "counted ragged pieces layout column coordinates table makers entering collect",
    "study.dataset.agreement": "matching verdicts facts",
    "study.dataset.access": "selection single accessor tidy placement concatenation",
    "study.execution": "launch interruption program queue forecast progress ledger dispatch farms compiling executor failures "
    "journal batch",
    "study.execution.compiling": "sawtooth miniatures warm_up",
    "study.execution.batch": "cutting submission",
    "study.execution.farms": "begun pickling outbox mail child process agent coordinator farm processes ranks opening",
    "study.report": "columns console common summary interchange case_table curves text_plot journal overview picture page",
    "study.figures": "shared sweep frames recipes views reproduction further catalogue gallery",
    "study.figures.shared": "paper claims canvas files figure power_law closed_form independence tiles",
    "study.figures.sweep": "label points names roles scale lines tiles",
    "study.figures.views": "view choice alike answer runs contacts drives sizes interiors records catalogue",
    "study.figures.frames": "moments drawing film",
    "study.figures.reproduction": "punch records resolution drive stick motion scores choices",
    "study.figures.further": "findings modulation continuum chains sizes correlations nodes stick_slip_map friction_map schemes",
    "study.accuracy": "timing setup diagram elastic_operator slip_numerics integrators digit picture table measurement",
    "study.commands": "shared preparing running computing looking judging cli",
    "study.commands.running": "order finished killed broken_off remaining head_start planning conduct",
    "study.commands.preparing": "declared campaigns new check plan explain",
    "study.commands.computing": "declared run status collect merge submit",
    "study.commands.looking": "declared report figure show try frames",
    "study.commands.judging": "declared export compare verify describe accuracy",
    "study.commands.shared": "exits refusals lazy arguments group machine plans glance datasets sources choice one_case",
}
"""Folder -> what is in it, from the first to the last; `__init__` of a folder may import all of it."""

SIDE_BY_SIDE = {"execution": {"report"}, "report": {"execution"}}
"""Folders that do not know each other, though one has to be named first."""

HOMES = {
    "mpi4py": {"study.execution.farms.opening"},
    "netCDF4": {"study.dataset", "study.accuracy", "study.report"},
    "xarray": {
        "solver.view",
        "solver.simulate",
        "study.dataset",
        "study.accuracy",
        "study.report",
        "study.figures",
        "study.api",
        "study.commands.shared.datasets",
        "study.commands.shared.one_case",
        "study.commands.shared.sources",
    },
    "matplotlib": {"solver.view", "study.accuracy", "study.report", "study.figures"},
    "numba": {"solver.compiling"},
}
"""Library -> the modules and folders that may use it; others may be used everywhere."""

MOST_FILES, MOST_LINES, MOST_LINES_OF_CLASS = 25, 700, 150
FILES = sorted(path for package in ("solver", "study") for path in (ROOT / package).rglob("*.py"))
FOLDERS = sorted({path.parent for path in FILES})


def module_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts)


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


def in_folder(folder: str) -> list[str]:
    return ORDER[folder].split()


@pytest.mark.parametrize("folder", [module_of(folder / "__init__")[: -len(".__init__")] for folder in FOLDERS])
def test_every_file_has_its_place_in_its_folder(folder: str) -> None:
    path = ROOT.joinpath(*folder.split("."))
    found = {file.stem for file in path.glob("*.py")} | {each.parent.name for each in path.glob("*/*.py")}
    assert found - {"__init__"} == set(in_folder(folder)), folder


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_point_upwards(path: Path) -> None:
    """At every level of folders that a file and what it imports have in common."""
    module = module_of(path).removesuffix(".__init__").split(".")
    for name in imported(path):
        other = name.split(".")
        common = 0
        while common < len(module) and common < len(other) and module[common] == other[common]:
            common += 1
        folder = ".".join(module[:common])
        if common == len(module) or folder not in ORDER:  # a folder's __init__, or another package
            continue
        order, here, there = in_folder(folder), module[common], other[common]
        if there in order:
            assert order.index(there) < order.index(here), f"{path} imports {name} from below"
            assert there not in SIDE_BY_SIDE.get(here, ()), f"{path} imports {name} from beside"


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_libraries_stay_at_home(path: Path) -> None:
    module = module_of(path)
    libraries = {name.split(".")[0] for name in imported(path)} - set(sys.stdlib_module_names)
    for library in libraries & set(HOMES):
        assert any(f"{module}.".startswith(f"{home}.") for home in HOMES[library]), f"{path} imports {library}"
    if module.startswith("solver"):
        shown = {library for library, homes in HOMES.items() if module in homes}  # imported where a user asks to see
        assert libraries <= {"solver", "numpy", "scipy", "numba"} | shown
        parts = {name for name in imported(path) if name.startswith("scipy.")}
        assert not parts, f"{path} imports {parts}: `import scipy` loads a part when it is first used"


@pytest.mark.parametrize("folder", sorted(ORDER))
def test_a_folder_is_seen_at_once(folder: str) -> None:
    files = [name for name in in_folder(folder) if f"{folder}.{name}" not in ORDER]
    assert len(files) <= MOST_FILES


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_file_and_its_classes_are_read_at_once(path: Path) -> None:
    text = path.read_text("utf-8")
    assert text.count("\n") <= MOST_LINES
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ClassDef) and node.end_lineno:
            assert node.end_lineno - node.lineno < MOST_LINES_OF_CLASS, node.name
