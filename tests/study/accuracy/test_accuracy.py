"""Work and precision: what is measured is what it says; how long it takes is nobody's test."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nanoslip import Case, Slab, friction_record, surface_compliance
from nanoslip.solver.contact.pin import estimate_half_width
from nanoslip.solver.effects import make_plane_strain
from nanoslip.solver.elasticity.schemes import Galerkin
from nanoslip.solver.layout import Plane
from nanoslip.study.accuracy import measurement as measurement_module
from nanoslip.study.accuracy.diagram import Diagram
from nanoslip.study.accuracy.measurement import Measurement, measure_accuracy
from nanoslip.study.accuracy.operators import (
    lateral_stiffness,
    measure_elastic_operator,
    nodal_forces,
    nodal_forces_of_ball,
    punch_observables,
)
from nanoslip.study.accuracy.records import as_ball
from nanoslip.study.accuracy.setup import (
    FULL,
    QUICK,
    Effort,
    Setup,
    contacts,
    default_setup,
    make_setup,
    measurement_effort,
)
from nanoslip.study.manifest.manifest import NamedDrive
from nanoslip.study.manifest.problems import ManifestError
from nanoslip.study.manifest.reader import load_manifest
from tests.conftest import Main

SMALL = replace(
    default_setup(),
    case=Case(slab=Slab(n_x=17), max_events=None, max_displacement=3e-3),
    drive=NamedDrive.of("short", duration=0.05),
)


@pytest.fixture(scope="module")
def measurement() -> Measurement:
    """Every knob, a little."""
    return measure_accuracy(SMALL, QUICK)


@pytest.mark.parametrize("half_width", [0.05, 0.27, 0.5])
def test_elliptic_forces_carry_the_whole_load_and_its_moments(half_width):
    x = np.linspace(-0.5, 0.5, 257)
    force = nodal_forces(x, half_width)
    assert force.sum() == pytest.approx(1.0, abs=1e-13)
    assert force @ x == pytest.approx(0.0, abs=1e-13)
    # ∫x²q dx = a²/4; linear interpolation of x² between nodes adds at most h²/4.
    assert force @ x**2 == pytest.approx(half_width**2 / 4, abs=(x[1] - x[0]) ** 2 / 4)


@pytest.mark.parametrize("scheme", ["biquadratic", "galerkin"])
def test_the_lateral_stiffness_is_that_of_a_record_whose_nodes_all_stick(scheme):
    case = Case(
        intrinsic_friction=math.inf,
        slab=Slab(n_x=33, scheme=scheme),
        initial_contact="frictionless",
        max_displacement=1e-9,
    )
    compliance = surface_compliance(case.slab)
    record = friction_record(case, compliance)
    size = record.initial_contact_size
    nodes = np.arange(size) + (33 - size) // 2
    assert lateral_stiffness(compliance, nodes) == pytest.approx(record.initial_stiffness, rel=1e-9)


def test_finer_operators_are_nearer_to_the_finest():
    """Ungraded grids of 9 and 17 nodes against 65: smooth loads, order 1 and more."""
    found = {
        n_x: punch_observables(surface_compliance(Slab(n_x=n_x, scheme=Galerkin(coarsest_row=n_x))), (0.3,))[0.3]
        for n_x in (9, 17, 65)
    }
    for name in ("normal_compliance", "tangential_compliance"):
        error = [abs(found[n_x][name] / found[65][name] - 1.0) for n_x in (9, 17)]
        assert error[1] < error[0] / 2, name


@pytest.mark.slow
def test_there_is_a_diagram_of_every_sort_of_numerics(measurement):
    assert [diagram.title for diagram in measurement.diagrams] == [
        "Elastic operator",
        "Slip numerics",
        "Records",
        "Dynamics",
    ]
    for diagram in measurement.diagrams:
        assert np.all(diagram.column("seconds").astype(float) > 0.0)
        assert diagram.on_front.any()


def test_operators_are_measured_with_contacts_like_the_cases_own_and_none_twice(measurement):
    rows = measurement.diagrams[0].rows
    grids = [tuple(str(row[name]) for name in ("n_x", "scheme", "rows_per_level", "coarsest_row")) for row in rows]
    assert len(set(grids)) == len(grids) > 0
    assert [width / 0.2913 == pytest.approx(1.0, abs=0.25) for width in contacts(Case(), FULL)] == 4 * [True]
    assert contacts(Case(), QUICK) == (0.282843,)


def test_what_errors_are_held_against_has_none(measurement):
    chaos, _, motion = measurement.diagrams[1:]
    for knob, reference in (("n_x", 33.0), ("event_floor", 1e-6)):
        apart = {row["value"]: row["step_difference"] for row in chaos.rows if row["knob"] == knob}
        assert [value for value, difference in apart.items() if difference == 0.0] == [reference]
    assert [row["integrator"] for row in motion.rows if row["velocity"] == 0.0] == ["exact"]
    assert all(row["velocity"] > 0.0 for row in motion.rows if row["integrator"] == "rk4")


def test_records_have_the_error_of_their_members(measurement):
    """More members of the same records; lengths of the same members; a ball beside which plane strain is wrong."""
    found = {(row["knob"], row["value"]): row for row in measurement.diagrams[2].rows}
    assert [*found] == [
        *(("members", count) for count in (3, 6)),
        *(("presliding", length) for length in (3.0, 8.0)),
        ("dimension", 2),
        ("dimension", 3),
    ]
    for (knob, _), row in found.items():
        least = 0.0 if knob == "dimension" else row["plateau_uncertainty"] / row["plateau"]
        assert row["error"] >= 0.99 * least
        assert 0.2 < row["plateau"] < 0.4
    assert found["members", 6]["seconds"] > found["members", 3]["seconds"]
    assert found["dimension", 2]["error"] > 0.0 == found["dimension", 3]["error"]


def test_a_ball_has_the_half_width_of_its_cylinder():
    case = Case(slab=Slab(n_x=65))
    ball = as_ball(case)
    assert ball.slab.scheme.LAYOUT is Plane
    assert estimate_half_width(ball) == pytest.approx(estimate_half_width(case), rel=1e-12)
    assert estimate_half_width(make_plane_strain(ball)) == pytest.approx(estimate_half_width(case), rel=1e-12)
    assert as_ball(ball) == ball


BALL = """\
title = "A ball"
[constants]
radius = 2.0
normal_load = 0.02
[numerics]
n_x = 13
scheme = "{scheme}"
[[drives]]
name = "rig"
duration = 0.05
"""


@pytest.mark.slow
@pytest.mark.everyday(1)
@pytest.mark.parametrize("scheme", ["half_space", "layer"])
def test_every_setting_of_a_ball_is_measured(tmp_path: Path, scheme: str):
    """Errors of coarse planes of nodes against a finer one: below 15 % on a contact of 4 spacings to either side."""
    (tmp_path / "ball.toml").write_text(BALL.format(scheme=scheme))
    setup = make_setup(load_manifest(tmp_path / "ball.toml"))
    assert measurement_effort(setup.case, quick=True) == QUICK
    assert max(measurement_effort(setup.case, quick=False).sizes) < max(FULL.sizes)
    small = replace(QUICK, sizes=(13, 17), reference_size=33, record_sizes=(13,), event_floors=(1e-6,), members=(3,))
    found = measure_accuracy(setup, replace(small, lengths=(3.0,)))
    operators, chaos, records, motion = found.diagrams
    assert [(row["scheme"], row["n_x"]) for row in operators.rows] == [(scheme, 13), (scheme, 17)]
    for row in operators.rows:
        assert 0.0 < float(row["error"]) < 0.15
        assert float(row["seconds"]) > 1e-4  # a convolution that is kept is found in 1e-5 s
    assert len(chaos.rows) == 2
    assert {row["value"] for row in records.rows if row["knob"] == "dimension"} == {2, 3}
    assert motion.rows[0]["integrator"] == "exact"


def test_elliptic_forces_of_a_ball_carry_the_whole_load_and_its_moments():
    compliance = surface_compliance(Slab(n_x=33, scheme="half_space"))
    force, spacing = nodal_forces_of_ball(compliance, 0.3), 1.0 / 32
    assert force.sum() == pytest.approx(1.0, abs=1e-5)  # the square root at the edge of a column, by 16 Gauss points
    for place in (compliance.x, compliance.y):
        assert force @ place == pytest.approx(0.0, abs=1e-12)
        # ∫x²q dA = a²/5; x² at the middle of a square misses its mean by h²/12.
        assert force @ place**2 == pytest.approx(0.3**2 / 5, abs=spacing**2 / 12)


def test_the_least_of_all_is_measured_before_anything_is_timed(monkeypatch: pytest.MonkeyPatch):
    """So that no time contains compilation: whatever the effort, each sort runs once before the run that counts."""
    efforts: list[Effort] = []

    def measure(setup: Setup, effort: Effort) -> Diagram:
        efforts.append(effort)
        return Diagram("-", "-", "-", (), "-", True, ())

    for name in ("elastic_operator", "slip_numerics", "records", "integrators"):
        monkeypatch.setattr(measurement_module, f"measure_{name}", measure)
    for effort in (QUICK, FULL):
        efforts.clear()
        measure_accuracy(SMALL, effort)
        assert efforts[4:] == [effort] * 4
        assert len(set(efforts[:4])) == 1
        assert max(efforts[0].sizes) == min(effort.sizes)


def test_series_that_are_no_rivals_have_a_front_each():
    rows = tuple(
        {"knob": knob, "seconds": seconds, "error": error}
        for knob, seconds, error in [("a", 1.0, 0.1), ("b", 2.0, 0.2), ("b", 3.0, 0.3)]
    )
    diagram = Diagram("-", "-", "knob", ("knob",), "error", True, rows)
    assert diagram.on_front.tolist() == [True, False, False]
    assert replace(diagram, rivals=False).on_front.tolist() == [True, True, False]


@pytest.mark.slow
def test_the_command_writes_tables_and_a_picture(main: Main, tmp_path: Path):
    path = tmp_path / "mine.toml"
    path.write_text(
        'title = "Mine"\nstages = ["contact", "slip"]\n[constants]\npoisson = 0.3\n'
        "[numerics]\nn_x = 17\n[limits]\ndisplacement = 1e-3\n"
    )
    code, said, _ = main("accuracy", path, "--quick", "--out", tmp_path / "out")
    assert code == 0
    assert "Elastic operator" in said
    page, table = ((tmp_path / "out" / name).read_text("utf-8") for name in ("accuracy.md", "elastic_operator.csv"))
    assert page.startswith("# What accuracy costs in time: Mine\n\nMeasured with: processor ")
    assert "\n- [Elastic operator](elastic_operator.csv). Reference: " in page
    assert set(re.findall(r"^33,(\w+)", table, re.MULTILINE)) == {"biquadratic", "galerkin"}
    assert (tmp_path / "out" / "accuracy.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("scheme", ["strip", "half_plane"])
def test_a_surface_without_ends_is_held_against_itself_with_more_nodes(tmp_path: Path, scheme: str):
    path = tmp_path / "mine.toml"
    path.write_text(f'title = "Mine"\nstages = ["contact", "slip"]\n[numerics]\nn_x = 33\nscheme = "{scheme}"\n')
    setup = make_setup(load_manifest(path))
    diagram = measure_elastic_operator(setup, replace(QUICK, sizes=(17, 33, 129), reference_size=257))
    assert [(row["scheme"], row["n_x"]) for row in diagram.rows] == [(scheme, n_x) for n_x in (17, 33, 129)]
    # Linear between nodes: energies of smooth loads converge with the square of the spacing.
    errors = diagram.column("normal_compliance").astype(float)
    assert errors[2] < 0.1 * errors[0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[constants]\npin = "flat_punch"\n', "needs a parabola, with which"),
        ('[axes]\nsupport = ["frictionless", "bonded"]\n', "gives way without limit"),
    ],
)
def test_what_has_no_accuracy_is_refused(tmp_path: Path, text: str, message: str):
    path = tmp_path / "mine.toml"
    path.write_text(f'title = "-"\n{text}')
    with pytest.raises(ManifestError, match=message):
        make_setup(load_manifest(path))


def test_a_campaign_is_measured_with_its_own_first_case_and_drive(tmp_path: Path):
    path = tmp_path / "mine.toml"
    path.write_text('title = "Mine"\n[axes]\nsupport = ["bonded", "frictionless"]\n[[drives]]\nname = "own"\n')
    setup = make_setup(load_manifest(path))
    assert (setup.title, setup.case.slab.support, setup.drive.name) == ("Mine", "bonded", "own")


@pytest.mark.slow
def test_a_record_without_a_plateau_drives_no_pin():
    found = measure_accuracy(replace(SMALL, case=replace(SMALL.case, max_displacement=1e-6)), QUICK)
    assert [diagram.title for diagram in found.diagrams] == ["Elastic operator", "Slip numerics", "Records"]
    assert found.remark.startswith("dynamics: ")
