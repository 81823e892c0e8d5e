"""Data flows one way: a folder imports only from folders above it in its package's list, and so do the files of a folder.

The lists are also the reading order. A folder holds some rooms, a file one notion; neither is cut to please a count.
"""

import ast
import re
import subprocess
import sys
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

ORDER = {
    "nanoslip": "solver study",
    "nanoslip.solver": "arrays compiled compiling last outcome progress parameter view layout slab load_path case "
    "ensemble drive elasticity contact sliding effects dynamics driven simulate",
    "nanoslip.solver.elasticity": "fields grid condensation grid_scheme schemes interior compliance",
    "nanoslip.solver.elasticity.schemes": "column biquadratic galerkin endless half_plane planar half_space strip layer chain",
    "nanoslip.solver.contact": "kernels closed_forms pin state soundness disc normal convolved tableau window compiled_contact"
    " coulomb initial",
    "nanoslip.solver.contact.kernels": "pivots state events path",
    "nanoslip.solver.sliding": "kernels record plateau validity coarsening way full_contact constant_pressures coulomb_friction"
    " slide path statistics interface slider power_law sizes",
    "nanoslip.solver.sliding.kernels": "constant_pressures cycle",
    "nanoslip.solver.dynamics": "friction_limit kernels result coefficients stick_slip regime integrators duration"
    " critical to_and_fro",
    "nanoslip.solver.dynamics.kernels": "motion steps runge_kutta",
    "nanoslip.solver.driven": "kernels contact_drive",
    "nanoslip.solver.driven.kernels": "drive",
    "nanoslip.study": "shipped toml_text exit_codes notices memory canonical provenance processor origin "
    "measured manifest tasks plan results dataset run figures inference report accuracy api commands",
    "nanoslip.study.measured": "units columns recording slips means cycles loops over_load events trace",
    "nanoslip.study.manifest": "parameters vocabulary problems surface observables checker manifest designs keys"
    " effects reader cases",
    "nanoslip.study.tasks": "task kind estimates compute miniature functions compliance contact contacts record path"
    " statistics states observables drive drive_observables",
    "nanoslip.study.plan": "plan expectations",
    "nanoslip.study.results": "files entry attempts store",
    "nanoslip.study.dataset": "texts variables content file runs collect units table access flat join agreement compare"
    " verify",
    "nanoslip.study.run": "launch dispatch progress journal child farm executor batch campaign",
    "nanoslip.study.report": "console summary single_case budget curves page",
    "nanoslip.study.figures": "points shared roles sweep answer frames views gallery",
    "nanoslip.study.inference": "surrogate sensitivity fit campaign pictures",
    "nanoslip.study.accuracy": "effects task_times deciding spending setup diagram operators records measurement",
    "nanoslip.study.commands": "words plans reading datasets answering prepare run draw look judge accuracy infer"
    " computed_loops trace traces cli",
}
"""Folder -> what is in it, from the first to the last; `__init__` of a folder may import all of it."""

SIDE_BY_SIDE = {"run": {"report"}, "report": {"run"}}
"""Folders that do not know each other, though one has to be named first."""

HOMES = {
    "mpi4py": {"nanoslip.study.run.farm"},
    "netCDF4": {"nanoslip.study.dataset", "nanoslip.study.report"},
    "xarray": {
        "nanoslip.solver.view",
        "nanoslip.solver.simulate",
        "nanoslip.study.dataset",
        "nanoslip.study.report",
        "nanoslip.study.figures",
        "nanoslip.study.inference",
        "nanoslip.study.api",
        "nanoslip.study.commands.computed_loops",
        "nanoslip.study.commands.answering",
        "nanoslip.study.commands.datasets",
        "nanoslip.study.commands.infer",
        "nanoslip.study.commands.trace",
        "nanoslip.study.commands.draw",
        "nanoslip.study.commands.look",
    },
    "matplotlib": {
        "nanoslip.solver.view",
        "nanoslip.study.accuracy",
        "nanoslip.study.report",
        "nanoslip.study.figures",
        "nanoslip.study.inference",
    },
    "numba": {"nanoslip.solver.compiling"},
}
"""Library -> the modules and folders that may use it; others may be used everywhere."""

MOST_FILES, MOST_LINES, MOST_LINES_OF_CLASS = 25, 800, 240
DEEPEST, MOST_ENTERED = 18, 92
"""What must be known: files on the longest chain of imports, and files whose functions the smallest campaign enters:
two fewer if no kernel is compiled."""

BODIES = (
    *(f"contact.{name}" for name in ("normal", "convolved", "compiled_contact", "coulomb", "initial")),
    *("elasticity.compliance", "elasticity.interior", "sliding.slide", "sliding.slider"),
)
"""Files of the solver that compute: whoever only declares, plans or shows has no need of them."""
DECLARING = (
    *(f"tasks.{name}" for name in ORDER["nanoslip.study.tasks"].split()),
    *("manifest.cases", "plan.plan", "results.store", "dataset.collect", "dataset.compare", "report.page"),
)
FILES = {
    path: path.read_text("utf-8")
    for package in ("solver", "study")
    for path in (ROOT / "nanoslip" / package).rglob("*.py")
}


@cache
def tree_of(path: Path) -> ast.Module:
    """What a file is parsed to, once: most processes of a test run do not ask."""
    return ast.parse(FILES[path])


def module_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts)


@cache
def imported(path: Path) -> set[str]:
    """Full names of all that a file imports, wherever in it."""
    names = set()
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def none(offenders: Iterable[str]) -> None:
    found = sorted(offenders)
    assert not found, "\n".join(found)


def test_every_file_has_its_place_in_its_folder() -> None:
    found: dict[str, set[str]] = {}
    for path in FILES:
        folder, _, name = module_of(path).rpartition(".")
        if name == "__init__":
            folder, _, name = folder.rpartition(".")
        if folder:
            found.setdefault(folder, set()).add(name)
    listed = {folder: set(names.split()) for folder, names in ORDER.items()}
    none(
        f"{folder}: {found.get(folder, set()) ^ listed.get(folder, set())}"
        for folder in found.keys() | listed.keys()
        if found.get(folder) != listed.get(folder)
    )


def wrong_ways(path: Path) -> Iterator[str]:
    """Imports of a file from below or beside, at every level of folders that it and what it imports have in common."""
    module = module_of(path).removesuffix(".__init__").split(".")
    for name in imported(path):
        other = name.split(".")
        common = 0
        while common < len(module) and common < len(other) and module[common] == other[common]:
            common += 1
        folder = ".".join(module[:common])
        if common == len(module) or folder not in ORDER:  # a folder's __init__, or another package
            continue
        order, here, there = ORDER[folder].split(), module[common], other[common]
        if there in order and order.index(there) >= order.index(here):
            yield f"{path} imports {name} from below"
        if there in SIDE_BY_SIDE.get(here, ()):
            yield f"{path} imports {name} from beside"


def test_imports_point_upwards() -> None:
    none(wrong for path in FILES for wrong in wrong_ways(path))


def strangers(path: Path) -> Iterator[str]:
    """Libraries that a file may not import."""
    module, names = module_of(path), imported(path)
    libraries = {name.split(".")[0] for name in names} - set(sys.stdlib_module_names)
    for library in libraries & set(HOMES):
        if not any(f"{module}.".startswith(f"{home}.") for home in HOMES[library]):
            yield f"{path} imports {library}"
    if module.startswith("nanoslip.solver"):
        shown = {library for library, homes in HOMES.items() if module in homes}  # imported where a user asks to see
        for library in libraries - {"nanoslip", "numpy", "scipy", "numba"} - shown:
            yield f"{path} imports {library}"
        for part in (name for name in names if name.startswith("scipy.")):
            yield f"{path} imports {part}: `import scipy` loads a part when it is first used"


def test_libraries_stay_at_home() -> None:
    none(stranger for path in FILES for stranger in strangers(path))


BARE = re.compile(r"""(?<!nanoslip )\b(from|import) (solver|study)\b|["'](solver|study)\.(?!py\b)\w""")


def test_packages_have_one_name() -> None:
    """Where the source tree is on Python's path, `solver` is found too: each of its modules would be there a second time."""
    files = [*FILES, ROOT / "setup.py", *(ROOT / "nanoslip").glob("*.py"), *(ROOT / "tests").rglob("*.py")]
    none(f"{path}: {found[0]}" for path in files for found in BARE.finditer(path.read_text("utf-8")))


APART = {
    "what users write: words, numbers, units, names": """commands.cli.work solver.parameter._short commands.datasets.assignments
        commands.infer commands.infer.read_numbers commands.infer.read_ranges figures.frames.parse_events figures.points._values
        figures.points.points_named figures.shared.file_format measured.recording._words measured.units._pint_unit
        manifest.vocabulary.missing_physics manifest.vocabulary.key_meant
        manifest.vocabulary.otherwise manifest.observables.parse_reference
        results.files.Shard.parse run.batch run.batch.parse_time_limit""",
    "files of users": """measured.columns measured.columns._cells measured.columns._split_labels measured.columns._title
        measured.columns.read_cells measured.columns.read_columns manifest.surface manifest.checker.NamedFiles.source
        manifest.observables manifest.observables.explain_docstring tasks.functions tasks.functions._imported_modules""",
    "files of this program, their names and hashes": """dataset.file
        dataset.texts dataset.texts.decode_texts dataset.texts.encode_texts manifest.checker.NamedFiles.read
        results.entry results.entry.later
        results.files results.files.read_lines results.store run.journal.long_task_keys toml_text._key""",
    "names and symbols": """dataset.variables.si_coordinates dataset.variables.describe_size dataset.units.stored_name
        figures.points.axis_named report.summary solver.compiling solver.view.label_numbers figures.gallery._number
        figures.points manifest.checker._read_file manifest.parameters manifest.parameters.as_written
        manifest.parameters.si_line manifest.parameters.with_symbol manifest.problems.key_shown plan.expectations._name_with_size
        tasks.task._parameters run.child._other_software dataset.verify.Recomputed._scale""",
    "digits of a number": "dataset.units.format_value solver.view.round_with_error",
    "lines and words of a text that is shown": """notices.print_notice solver.outcome.Outcome.__post_init__ report.console
        report.console.print_error commands.judge.describe_variables report.page.theme_svg run.child.ChildProcess.last_words""",
    "what the machine lists": """origin._mpi origin.Origin.arithmetic processor.description processor.instructions
        results.files._is_zombie
        run.child.deaths_for_memory run.launch.processes_here run.farm._library commands.prepare._submit""",
}
"""Texts that the package takes apart -> where. No sentence is among them, of its own or of a library: facts travel as values."""
CUTS = {"split", "rsplit", "partition", "rpartition", "removeprefix", "removesuffix", "splitlines"}


def cuts(node: ast.AST, place: str) -> Iterator[str]:
    """Functions that take a text apart, each as often as it does."""
    for child in ast.iter_child_nodes(node):
        named = isinstance(child, ast.FunctionDef | ast.ClassDef)
        yield from cuts(child, f"{place}.{child.name}" if named else place)
        if isinstance(child, ast.Call) and isinstance(child.func, ast.Attribute):
            of = ast.unparse(child.func.value)
            if (child.func.attr in CUTS and of != "np") or (of == "re" and child.func.attr != "escape"):
                yield place


def test_no_sentence_is_taken_apart() -> None:
    found = {place for path in FILES for place in cuts(tree_of(path), module_of(path).removeprefix("nanoslip."))}
    allowed = {name for names in APART.values() for name in names.split()}
    none({name.removeprefix("study.") for name in found} ^ allowed)


def too_large() -> Iterator[str]:
    """Folders of too many files, files and classes of too many lines."""
    for folder, names in ORDER.items():
        if sum(f"{folder}.{name}" not in ORDER for name in names.split()) > MOST_FILES:
            yield folder
    for path, text in FILES.items():
        if text.count("\n") > MOST_LINES:
            yield f"{path}"
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.ClassDef) and (node.end_lineno or 0) - node.lineno >= MOST_LINES_OF_CLASS:
                yield f"{path}: {node.name}"


def test_folders_files_and_classes_are_read_at_once() -> None:
    none(too_large())


def test_what_is_imported_is_not_deep() -> None:
    """A reader of the last file may have to know all of the chain."""
    files = {module_of(path).removesuffix(".__init__"): path for path in FILES}
    known: dict[str, int] = {}

    def depth(module: str) -> int:
        if module not in known:
            names = {part for name in imported(files[module]) for part in (name, name.rpartition(".")[0])}
            known[module] = 1 + max((depth(name) for name in names & files.keys() - {module}), default=0)
        return known[module]

    assert max(map(depth, files)) <= DEEPEST


def test_what_declares_or_shows_loads_nothing_that_computes(environment: dict[str, str]) -> None:
    modules = ", ".join(f"nanoslip.study.{name}" for name in DECLARING)
    bodies = tuple(f"nanoslip.solver.{name}" for name in BODIES)
    program = f"import sys, {modules}; print([name for name in {bodies} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


WALK = """
import sys, threading
files = set()
def entered(frame, event, _):
    if event == "call" and frame.f_code.co_flags & 1:  # functions: not the bodies of modules and classes
        files.add(frame.f_code.co_filename)
from nanoslip import main
sys.argv = ["nanoslip", "run", sys.argv[1], "--serial", "--out", sys.argv[2]]
sys.setprofile(entered)
threading.setprofile(entered)
try:
    main()
except SystemExit:
    pass
sys.setprofile(None)
print(*files, sep="\\n")
"""


@pytest.mark.slow
def test_the_smallest_campaign_enters_few_files(environment: dict[str, str], tmp_path: Path) -> None:
    words = [sys.executable, "-c", WALK, str(ROOT / "campaigns" / "smoke.toml"), str(tmp_path / "smoke")]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, check=True)
    assert (tmp_path / "smoke" / "results.nc").exists()
    ours = {path.resolve() for path in FILES}
    assert 20 < len({Path(line).resolve() for line in done.stdout.splitlines()} & ours) <= MOST_ENTERED
