"""Additions by users of the laboratory are made in one place: it is then known to manifests, plans, keys, datasets and tables.

Each toy is declared here as its real fellows are, and nowhere else. What nobody declared is refused by name.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from nanoslip.solver.case import PARTS, SlipRule
from nanoslip.solver.drive import INTEGRATORS, Drive
from nanoslip.solver.dynamics.integrators import RK4, Method
from nanoslip.solver.dynamics.kernels.motion import Course, Motion, ToothTable
from nanoslip.solver.outcome import InvalidInput, Outcome
from nanoslip.solver.parameter import parameter, validate
from nanoslip.solver.slab import SCHEMES, Scheme, Slab
from nanoslip.study.dataset import variables
from nanoslip.study.dataset.collect import collect
from nanoslip.study.dataset.variables import describe
from nanoslip.study.manifest.problems import ManifestError
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.plan import Plan, make_plan
from nanoslip.study.report.summary import scalar_table
from nanoslip.study.results.store import Store
from tests.conftest import Main
from tests.study.dataset.campaigns import compute

Campaign = Callable[[str], tuple[Plan, xr.Dataset]]

BED, STEPS, TIRED = "stiffness of the springs per length", "steps in a period of pin and spring", "how tired a node is"

DRIVEN = """
limits.events = 200
ensemble.members = 1
numerics.n_x = 17
constants.radius = 50.0
[[drives]]
name = "a"
samples = 5
"""


@pytest.fixture
def campaign(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Campaign:
    """A campaign with these lines, computed."""
    monkeypatch.setattr(
        variables, "variables_by_name", variables.variables_by_name.__wrapped__
    )  # which remembers what was declared

    def computed(lines: str) -> tuple[Plan, xr.Dataset]:
        path = tmp_path / "toy.toml"
        path.write_text(f'title = "A toy"\n{lines}')
        plan, store = make_plan(load_manifest(path)), Store(tmp_path / "results")
        compute(plan, store)
        return plan, collect(plan, store)

    return computed


@dataclass(frozen=True, slots=True)
class Winkler(Scheme):
    """Independent springs under every node."""

    name = "winkler"
    bed_modulus: float = parameter(1.0, table="numerics", meaning=BED, measure="G", above=0.0)

    def __post_init__(self) -> None:
        validate(self)

    def complete_settings(self, slab: Slab) -> "Winkler":
        return self

    def matrix(self, slab: Slab) -> np.ndarray:
        return np.eye(2 * slab.n_x) / (self.bed_modulus * slab.spacing)

    def lateral_stiffness(self, slab: Slab, nodes: float) -> float:
        return nodes * self.bed_modulus * slab.spacing


def test_a_scheme(campaign: Campaign, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(SCHEMES, "winkler", Winkler)
    lines = 'limits.events = 100\nensemble.members = 1\n[numerics]\nn_x = 17\nscheme = "winkler"\n'
    lines += "[axes]\nbed_modulus = [1.0, 2.0]\n"
    plan, found = campaign(lines)
    assert [case.case.slab.scheme.bed_modulus for case in plan.cases if case.case] == [1.0, 2.0]
    assert len({task.key for task in plan.tasks}) == 4  # two compliances, two records
    assert found.outcome.values.ravel().tolist() == ["completed", "completed"]
    assert found.scheme == "winkler"
    assert found.bed_modulus.attrs["long_name"] == f"{BED}, in G"
    np.testing.assert_allclose(
        found.surface_stiffness.values.ravel() / found.initial_contact_size.values.ravel(), [1 / 16, 1 / 8]
    )
    assert "bed_modulus" in scalar_table(found).header
    assert (describe("bed_modulus").meaning, describe("bed_modulus").measure) == (
        BED,
        "G",
    )
    with pytest.raises(ManifestError, match=r"axes\.bed_modulus\[1\] = 0\.0: "):
        campaign(lines.replace("2.0]", "0.0]"))
    with pytest.raises(ManifestError, match=r"numerics\.rows = 4: .*biquadratic"):
        campaign(lines.replace("n_x = 17", "n_x = 17\nrows = 4"))


def test_a_scheme_that_nobody_registered_is_refused(campaign: Campaign) -> None:
    known = ", ".join(SCHEMES)
    with pytest.raises(ManifestError, match=rf'scheme = "winkler": needs one of {known}$'):
        campaign('numerics.scheme = "winkler"')
    with pytest.raises(ManifestError, match=r"axes\.bed_modulus = \[1\.0\]: unknown"):
        campaign("axes.bed_modulus = [1.0]")


@dataclass(frozen=True, slots=True)
class HalfSteps(Method):
    """Runge-Kutta steps so many to a period of the spring."""

    name = "half_steps"
    rests = False
    steps_per_period: int = parameter(100_000, meaning=STEPS, least=1, most=10**9)

    def __post_init__(self) -> None:
        validate(self)

    def fit(self, drive: Drive) -> None:
        """Every drive fits."""

    def run(self, teeth: ToothTable, motion: Motion, drive: Drive) -> tuple[Course, Outcome]:
        step = 2.0 * np.pi / np.sqrt(motion.spring) / self.steps_per_period
        return RK4(float(step)).run(teeth, motion, drive)


def test_an_integrator(campaign: Campaign, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(INTEGRATORS, "half_steps", HalfSteps)
    lines = DRIVEN + 'integrator = "half_steps"\nduration = 0.01\n'
    plan, found = campaign(lines + "steps_per_period = 200_000\n")
    other, _ = campaign(lines)
    assert plan.tasks[-1].key != other.tasks[-1].key
    assert found.integrator == "half_steps"
    assert found.steps_per_period == 200_000
    assert describe("steps_per_period").meaning == STEPS
    assert found.steps > 1000
    with pytest.raises(ManifestError, match=r"drives\[0\]\.steps_per_period = 0: "):
        campaign(lines + "steps_per_period = 0\n")
    with pytest.raises(ManifestError, match=r"drives\[0\]\.steps_per_period = 7: .*half_steps"):
        campaign(DRIVEN + "steps_per_period = 7\n")
    with pytest.raises(ManifestError, match=r"surface_compliance = false: .*exact"):
        campaign(lines + "surface_compliance = false\n")


def test_an_integrator_that_nobody_registered_is_refused(campaign: Campaign) -> None:
    with pytest.raises(ManifestError, match=r'integrator = "half_steps": needs one of exact, rk4$'):
        campaign(DRIVEN + 'integrator = "half_steps"\n')


@dataclass(frozen=True, slots=True)
class Tired(SlipRule):
    """A slip rule with a parameter more."""

    tiredness: float = parameter(0.0, table="slip", word="tired", meaning=TIRED, least=0.0, most=1.0)

    def __post_init__(self) -> None:
        validate(self)
        if self.tiredness and self.residual_shear:
            raise InvalidInput("tiredness", self.tiredness, "0", {"residual_shear": self.residual_shear})


def test_a_parameter(campaign: Campaign, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(PARTS, "slip_rule", Tired)
    lines = "limits.events = 20\nnumerics.n_x = 17\n[axes]\ntired = [0.0, 1]\n"
    plan, found = campaign(lines)
    assert [case.case.slip_rule.tiredness for case in plan.cases if case.case] == [0.0, 1.0]  # type: ignore[attr-defined]
    assert len({task.key for task in plan.tasks}) == 3  # one compliance
    assert len({case.case_id for case in plan.cases}) == 2
    assert found.tiredness.values.tolist() == [0.0, 1.0]
    assert found.tiredness.attrs["long_name"] == TIRED
    assert "tiredness" in scalar_table(found).header
    assert describe("tiredness").meaning == TIRED
    with pytest.raises(ManifestError, match=r"axes\.tired\[1\] = 2: "):
        campaign(lines.replace("1]", "2]"))
    with pytest.raises(ManifestError, match=r"numerics\.tired = 1: .*\[slip\] or \[axes\]"):
        campaign("numerics.tired = 1")


def test_what_is_said_of_a_campaign_is_said_in_its_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, main: Main
) -> None:
    """A parameter's word in a manifest need not be its name in the solver: nobody who wrote `tired` reads `tiredness`."""
    monkeypatch.setitem(PARTS, "slip_rule", Tired)
    path = tmp_path / "toy.toml"
    path.write_text('title = "A toy"\n[axes]\nresidual_shear = [0.0, 0.5]\ntired = [0.5, 1]\nradius = [200.0, 1e-6]\n')
    plan = make_plan(load_manifest(path))
    assert plan.cases[-1].outcome.message.startswith("tired = 1.0 with residual_shear = 0.5: ")
    assert {"tired=0.5", "tired=1"} <= {word for task in plan.tasks for word in task.label.split()}
    code, out, _ = main("plan", path)
    assert code == 0
    assert ", tired = 1: tired = 1.0 with residual_shear = 0.5: needs 0" in out
    assert re.search("expected: .*, first .*tired = 0.5", out)
    assert "tiredness" not in out
