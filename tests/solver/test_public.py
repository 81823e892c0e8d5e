"""The solver's public names: each there, typed, and imported when it is first used; schemes and integrators are known at once."""

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

from nanoslip import solver


def test_the_names_that_type_checkers_see_are_those_that_are_there():
    (checking,) = [
        node for node in ast.parse(Path(solver.__file__).read_text("utf-8")).body if isinstance(node, ast.If)
    ]
    imports = [node for node in checking.body if isinstance(node, ast.ImportFrom)]
    seen = {each.name: str(node.module) for node in imports for each in node.names}
    assert sorted(seen) == sorted(solver.__all__)
    for name, module in seen.items():
        assert getattr(solver, name) is getattr(importlib.import_module(module), name)
    assert set(solver.__all__) <= set(dir(solver))


def test_a_name_that_is_not_there_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'friction'"):
        solver.friction  # noqa: B018


@pytest.mark.parametrize(
    "program",
    [
        "from nanoslip.solver.slab import SCHEMES; print(*sorted(SCHEMES))",
        "from nanoslip.solver import Slab; from nanoslip.solver.slab import SCHEMES; print(*sorted(SCHEMES))",
    ],
)
def test_every_scheme_can_be_chosen_by_its_name_whatever_is_imported(environment, program):
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["biquadratic", "chain", "galerkin", "half_plane", "strip"]


def test_every_integrator_can_be_chosen_by_its_name_whatever_is_imported(environment):
    program = "from nanoslip.solver.drive import INTEGRATORS; print(*sorted(INTEGRATORS))"
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["exact", "rk4"]
