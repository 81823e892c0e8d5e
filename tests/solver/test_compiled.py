"""Compiled kernels on disk are used while the kernel files that they call stay as they are, and forgotten when one changes.

Each test works on a copy of the package, with a cache of its own and fresh processes.
"""

import ast
import inspect
import os
import shutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import get_args, get_origin, get_type_hints

import numba
import numpy as np
import pytest
from numpy.typing import NDArray

from nanoslip import solver
from nanoslip.solver.compiled import Kernel, declare_kernel, reporting_compilation
from nanoslip.solver.compiling import KERNEL_FILES, kernel_imports
from nanoslip.solver.contact.kernels.state import first_root
from nanoslip.solver.last import cache_last

PACKAGE = Path(solver.__file__).parent
WATCHED = sorted(path for files in KERNEL_FILES for path in PACKAGE.glob(files))


# A kernel that is called, and a change of another file that changes what it returns: program, file, old and new text.
CALLEE, CONSTANT = (
    (
        """
from nanoslip.solver.compiled import declare_kernel
from nanoslip.solver.dynamics.kernels.motion import Motion, PinState, make_segment
kernel = declare_kernel(entry=True)(make_segment.py_func)
value = kernel(Motion(1.0, 0.5, 2.0, 3.0, 0.1, 0.1, 9.0, 1e-8, 1, 9.0, 0.1, 0.0), PinState(1.0, 0.5, 0.1, 0.2), 0.3).q
""",
        *("dynamics/kernels/motion.py", "motion.spring * stretch", "7.0 * motion.spring * stretch"),
    ),
    # Ratios that differ by 1e-9 are ties, of which the node further right is taken, only if more bits are left out.
    (
        """
import numpy as np
from nanoslip.solver.compiled import declare_kernel
from nanoslip.solver.sliding.kernels.constant_pressures import _worst_violation
kernel = declare_kernel(entry=True)(_worst_violation.py_func)
value = kernel(np.array([1.0 + 1e-9, 1.0]), np.full(2, 0.5), np.ones(2), 1e-12, -1.0, 1)
""",
        *("contact/kernels/events.py", "PLACE = 0xFFFF\n", "PLACE = 0xFFFFFFFF\n"),
    ),
)

SHEAR = """
import numpy as np
from nanoslip.solver.contact.kernels.state import total_shear as kernel
value = kernel(np.full(6, True), np.full(6, 0.5))
"""


@pytest.fixture
def copy(tmp_path):
    target = tmp_path / "copy" / "nanoslip" / "solver"
    shutil.copytree(PACKAGE, target, ignore=shutil.ignore_patterns("__pycache__"))
    (target.parent / "__init__.py").touch()  # without the study, which the door imports
    return target


def called(program, copy, **environment):
    """What the kernel returns in a fresh process, and how many functions that process compiled for the call."""
    program += "print(repr(value), sum(kernel.dispatcher.stats.cache_misses.values()))"
    root = copy.parents[1]
    known = os.environ | {"PYTHONPATH": str(root), "NUMBA_CACHE_DIR": str(root / "cache")} | environment
    done = subprocess.run(
        [sys.executable, "-c", program], env=known, cwd=root, capture_output=True, text=True, check=True
    )
    value, compiled = done.stdout.split()
    return value, int(compiled)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("program", "file", "old", "new"), [CALLEE, CONSTANT], ids=["callee in another file", "constant in another file"]
)
def test_a_change_of_another_file_is_seen_and_nothing_is_compiled_twice(program, file, old, new, copy):
    """With numba's own cache the last line fails: it watches only the file of the function that was called."""
    value, compiled = called(program, copy)
    assert compiled == 1
    assert called(program, copy) == (value, 0)
    text = (copy / file).read_text("utf-8")
    assert text.count(old) == 1
    (copy / file).write_text(text.replace(old, new), "utf-8")
    assert called(program, copy)[0] != value


@pytest.mark.slow
def test_a_change_of_kernels_that_it_cannot_call_compiles_nothing_again(copy):
    assert called(SHEAR, copy) == ("3.0", 1)
    with (copy / "dynamics/kernels/motion.py").open("a", encoding="utf-8") as file:
        file.write("# changed\n")
    assert called(SHEAR, copy) == ("3.0", 0)
    with (copy / "contact/kernels/events.py").open("a", encoding="utf-8") as file:
        file.write("# changed\n")
    assert called(SHEAR, copy) == ("3.0", 1)


@pytest.mark.slow
def test_what_was_kept_of_types_that_have_moved_is_compiled_anew(copy):
    """As after an update in place of sources whose modules have other names now."""
    value, _ = called(CALLEE[0], copy)
    old, new = b"nanoslip.solver.dynamics.kernels.motion", b"nanoslip.solver.dynamics.kernels.notion"
    kept = [path for path in (copy.parents[1] / "cache").rglob("*.nbi") if old in path.read_bytes()]
    assert kept
    for path in kept:
        path.write_bytes(path.read_bytes().replace(old, new))
    assert called(CALLEE[0], copy) == (value, 1)
    assert called(CALLEE[0], copy) == (value, 0)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "length"), [("nbi", 0), ("nbi", 50), ("nbc", 100)])
def test_what_was_kept_in_part_is_compiled_anew(copy, kind, length):
    """As after a loss of power, or on a full disk."""
    value, _ = called(SHEAR, copy)
    for path in (copy.parents[1] / "cache").rglob(f"*.{kind}"):
        path.write_bytes(path.read_bytes()[:length])
    assert called(SHEAR, copy) == (value, 1)
    assert called(SHEAR, copy) == (value, 0)


@pytest.mark.slow
def test_where_nothing_can_be_written_a_kernel_is_compiled_and_right(copy, tmp_path):
    value, _ = called(CALLEE[0], copy)
    (tmp_path / "file").touch()
    for folder in copy.rglob("kernels"):
        shutil.rmtree(folder / "__pycache__", ignore_errors=True)
        (folder / "__pycache__").touch()
    nowhere = dict.fromkeys(("NUMBA_CACHE_DIR", "HOME", "XDG_CACHE_HOME"), str(tmp_path / "file" / "below"))
    assert called(CALLEE[0], copy, **nowhere)[0] == value


@pytest.mark.parametrize("file", WATCHED, ids=lambda file: str(file.relative_to(PACKAGE)))
def test_all_that_a_kernel_reads_is_in_files_that_are_watched(file):
    """Functions and constants that kernels import from this package are of files whose change compiles them anew."""
    watched = {path.relative_to(PACKAGE.parents[1]).with_suffix("") for path in kernel_imports(file.parent)}
    names = {".".join(path.parts) for path in watched}
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("nanoslip"):
            assert node.module in names, f"{file} imports {node.module}"
        elif isinstance(node, ast.Import):
            assert not any(alias.name.startswith("nanoslip") for alias in node.names)


def test_every_compiled_function_is_watched():
    """The one decorator is used in kernel files only: elsewhere a change would go unnoticed."""
    users = {
        path for path in PACKAGE.rglob("*.py") if "from nanoslip.solver.compiled import" in path.read_text("utf-8")
    }
    assert users
    assert users <= set(WATCHED)


def test_compiling_is_told_as_it_begins_and_only_then():
    doubled = numba.njit(lambda number: 2.0 * number)  # kept nowhere
    told = []
    with reporting_compilation(lambda: told.append("now")):
        assert doubled(1.5) == 3.0
        assert doubled(2.5) == 5.0
    assert told == ["now"]
    assert doubled(3) == 6  # other types, compiled when nobody listens
    assert told == ["now"]


THREADS = """
import sys
from concurrent.futures import ThreadPoolExecutor
from nanoslip.solver.contact.kernels.state import total_shear
from nanoslip.solver.sliding.kernels.cycle import cycle
import numpy as np
before = "numba" in sys.modules
nodes, forces = np.full(6, 7, np.int32), np.full(6, 0.5)
with ThreadPoolExecutor(4) as threads:
    found = [threads.submit(total_shear, forces > 0.0, forces), threads.submit(cycle, nodes, forces, forces)] * 2
    print(before, *(each.result() for each in found))
"""


def test_numba_is_loaded_by_the_first_call_of_any_thread(environment):
    done = subprocess.run([sys.executable, "-c", THREADS], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "3.0", "1", "3.0", "1"]


def holds_arrays(kind):
    """Whether values of an annotated type hold arrays or lists."""
    if get_origin(kind) in (np.ndarray, NDArray, list):  # of numpy 2.5 the alias itself
        return True
    parts = get_type_hints(kind).values() if hasattr(kind, "_fields") else get_args(kind)
    return any(holds_arrays(part) for part in parts)


def test_only_kernels_that_count_references_are_handed_new_arrays():
    """Elsewhere an array would be kept for ever, or freed while it is used: numba itself refuses only those that make some."""
    files = (path.relative_to(PACKAGE.parents[1]).with_suffix("") for path in WATCHED if path.parent.name == "kernels")
    modules = [vars(import_module(".".join(file.parts))) for file in files]
    found = {name: each for module in modules for name, each in module.items() if isinstance(each, Kernel)}
    makers = {name for name, kernel in found.items() if holds_arrays(get_type_hints(kernel.__wrapped__)["return"])}
    assert "empty_record" in makers
    for name, kernel in found.items():
        body = ast.parse(inspect.getsource(kernel.__wrapped__))
        used = {node.id for node in ast.walk(body) if isinstance(node, ast.Name)} & makers
        assert kernel.allocates or not (used or name in makers), name


def test_python_calls_what_is_declared_for_it():
    with pytest.raises(TypeError, match=r"first_root: .*entry=True"):
        first_root(1.0, -2.0, 1.0)


def test_an_interrupt_while_a_kernel_runs_is_an_interrupt():
    """Python says SystemError, caused by it; commands end on an interrupt in a line, and on a SystemError in a traceback."""

    def interrupted():
        raise SystemError("returned a result with an exception set") from KeyboardInterrupt()

    kernel = declare_kernel(entry=True)(interrupted)
    vars(kernel)["dispatcher"] = interrupted
    with pytest.raises(KeyboardInterrupt):
        kernel()


def test_the_very_same_value_is_answered_once_and_an_equal_one_again():
    asked = []

    @cache_last
    def total(numbers):
        asked.append(numbers)
        return sum(numbers)

    first, other = (1.0, 2.0), (4.0,)
    equal = first[:1] + first[1:]
    assert [total(each) for each in (first, first, equal, other, other, first)] == [3.0, 3.0, 3.0, 4.0, 4.0, 3.0]
    assert asked == [first, equal, other, first]
