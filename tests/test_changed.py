"""`make test-changed` leaves out no test that a change can reach: what tests run is followed from their names."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from nanoslip.solver.contact.kernels.path import follow_path
from tests.changed import EVERYTHING, FILES, chosen, differing, reach

ROOT = Path(__file__).parents[1]
TRACED = """
import importlib, pkgutil, sys, threading
import pytest, nanoslip
from numba.core import event
for module in pkgutil.walk_packages(nanoslip.__path__, "nanoslip."):
    "__main__" in module.name or importlib.import_module(module.name)
ran = set()
class Compiled(event.Listener):
    def on_start(self, event):
        code = event.data["dispatcher"].py_func.__code__
        ran.add((code.co_filename, code.co_name))
    def on_end(self, event):
        pass
event.register("numba:compile", Compiled())
def entered(frame, event, _):
    if event == "call" and frame.f_code.co_flags & 1:  # functions: not the bodies of modules and classes
        ran.add((frame.f_code.co_filename, frame.f_code.co_qualname.partition(".")[0]))
class Tracer:
    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item):
        ran.clear()
        sys.setprofile(entered)
        threading.setprofile(entered)
        try:
            return (yield)
        finally:
            sys.setprofile(None)
            threading.setprofile(None)
            print("\\nRAN", repr((item.nodeid.partition("[")[0].split("::"), sorted(ran))))
sys.exit(pytest.main(["-qs", "-p", "no:cacheprovider", *sys.argv[1:]], [Tracer()]))
"""
KERNELS = "tests/solver/test_contact.py::test_sticking_needs_slips_and_frictionless_touch_none"
SOME = """
tests/solver/test_stick_slip.py::test_without_a_slip_there_is_nothing_to_fit
tests/study/plan/test_keys.py::test_a_friction_record_is_known_without_the_drive
tests/study/figures/test_sweep.py::test_a_ratio_has_the_uncertainties_of_both
tests/study/report/test_page.py::test_the_page_holds_all_of_it_and_needs_no_other_file
tests/study/commands/test_one_case.py::test_a_case_is_found_by_the_words_of_its_campaign
tests/study/commands/test_datasets.py::test_cases_events_and_samples_are_exported
"""
"""Tests of the solver, of plans, figures, pages and commands."""


@pytest.mark.slow
@pytest.mark.parametrize("tests", [KERNELS, SOME], ids=["kernels", "functions"])
def test_what_runs_is_what_is_followed(tests: str, environment: dict[str, str], tmp_path: Path) -> None:
    """No function runs in a test and no kernel is compiled for it that is not followed to."""
    words = [sys.executable, "-c", TRACED, *tests.split()]
    cache = {"NUMBA_CACHE_DIR": str(tmp_path)} if tests == KERNELS else {}
    done = subprocess.run(words, env=environment | cache, cwd=ROOT, capture_output=True, text=True, check=True)
    ours = {str((ROOT / file).resolve()): file for file in FILES if file.startswith("nanoslip/")}
    ran = [ast.literal_eval(line[4:]) for line in done.stdout.splitlines() if line.startswith("RAN ")]
    assert len(ran) >= len(tests.split())
    for test, functions in ran:
        places = {(ours.get(str(Path(path).resolve()), ""), name) for path, name in functions} & EVERYTHING
        assert any(tests == SOME or "kernels" in file for file, _ in places)
        assert places <= reach(*test), test
        assert len(reach(*test)) < len(EVERYTHING) / 2


def test_a_change_reaches_the_tests_of_what_calls_it_and_no_others() -> None:
    """From a kernel to the slips that it computes, from a command's function to the command; the nearest first."""
    kernel = chosen({(f"{follow_path.__module__.replace('.', '/')}.py", follow_path.__name__)})
    assert "tests/study/commands/test_running.py" in {each.partition("::")[0] for each in kernel}
    assert not [each for each in kernel if each.startswith("tests/study/test_canonical.py")]
    assert kernel[0].startswith("tests/solver/")


def test_only_definitions_that_differ_are_changed() -> None:
    path = "solver/sliding/plateau.py"
    before = (ROOT / path).read_text()
    assert differing(path, before) == set()
    changed = differing(path, before.replace("def plateau_of(", "def plateau_of(more: int, "))
    assert changed == {(f"nanoslip/{path}", "plateau_of")}


def test_what_is_not_understood_reaches_everything() -> None:
    assert all(
        differing(path, "") == EVERYTHING for path in ("pyproject.toml", "setup.py", "tests/conftest.py", "gone.py")
    )
    assert {file for file, _ in differing("study/report/templates/page.html", "")} >= {"nanoslip/study/report/page.py"}
    assert differing("README.md", "") == set()
