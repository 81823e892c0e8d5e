"""A stage that goes to and fro, from a campaign to what is read of it: numbers, lines, views, and words as typed."""

import numpy as np
import pytest
import xarray as xr

from nanoslip.solver.outcome import Ending
from nanoslip.study import api
from nanoslip.study.figures.shared import View
from nanoslip.study.figures.views import draw_stage_loops
from nanoslip.study.report.curves import curves, inertial_range

SCENE = {
    "title": "A stage that goes to and fro",
    "scales": {"slab_width": "2 mm", "young_modulus": "2 MPa"},
    "constants": {"radius": "100 mm", "normal_load": "0.2 N"},
    "numerics": {"n_x": 17},
    "limits": {"presliding": 4},
    "ensemble": {"members": 2},
}
STAGE = {
    "spring_stiffness": "150 N/m",
    "pin_mass": "80 g",
    "stage_velocity": "0.5 mm/s",
    "damping_ratio": 1.0,
    "samples": 400,
    "stage_cycles": 2,
}
LONG, SHORT = 10e-3, 0.1e-3
"""Strokes (m) of a stage that slides at mid-stroke, and of one that stays far below sliding."""


@pytest.fixture(scope="module")
def pulled() -> xr.Dataset:
    """Two strokes, with ± of two starts."""
    drives = [{"name": "long", "stage_stroke": LONG, **STAGE}, {"name": "short", "stage_stroke": "0.1 mm", **STAGE}]
    return api.run({**SCENE, "drives": drives}, progress=False).squeeze()


def test_the_energies_of_a_cycle_balance_and_the_stroke_of_the_pin_is_shorter(pulled: xr.Dataset) -> None:
    """But for what pin and spring store from cycle to cycle, as far as a loop does not close."""
    found = pulled.sel(drive="long")
    lost = found["contact_energy"] + found["damper_energy"]
    assert float(found["stage_energy"]) == pytest.approx(float(lost), rel=2e-2)
    assert 0.0 < float(found["damper_energy"]) < 0.2 * float(found["contact_energy"])
    # The spring is stretched by as much at either turn.
    stretch = 2.0 * float(found["midstroke_friction"]) * 0.2 / 150.0
    assert float(found["pin_stroke_si"]) == pytest.approx(LONG - stretch, rel=2e-2)
    assert float(found["contact_energy_uncertainty"]) > 0.0


def test_below_sliding_a_record_loses_nothing_which_its_outcome_says(pulled: xr.Dataset) -> None:
    found = pulled.sel(drive="short")
    assert found["drive_outcome"].item() == Ending.COMPLETED.value
    assert "memory = true" in found["drive_message"].item()
    assert abs(float(found["contact_energy"])) < 1e-9
    assert np.isnan(float(found["midstroke_friction"]))
    assert found["leg_regime"].item() == "partial_slip"


def test_a_line_is_the_spring_force_over_the_stage_and_friction_of_either_sign_is_no_inertia() -> None:
    case = api.run({**SCENE, "drives": [{"stage_stroke": LONG, **STAGE}]}, progress=False).squeeze()
    line = list(curves(case))[-1]
    assert line.x.min() == pytest.approx(-LONG / 2.0)
    assert line.x.max() == pytest.approx(LONG / 2.0)
    assert line.y.min() < -0.5 * line.y.max()
    assert inertial_range(case) is None


def test_loops_are_a_view_of_the_last_two_cycles(pulled: xr.Dataset) -> None:
    (view,) = [each for each in draw_stage_loops(pulled) if isinstance(each, View)]
    columns = view.columns()
    assert {"stage", "position", "spring_force"} <= columns.keys()
    assert columns["stage"].min() == pytest.approx(-LONG / 2.0)
    assert np.ptp(columns["position"]) < LONG


def test_try_repeats_stroke_and_amplitude_of_stage_and_pin_in_the_units_of_a_laboratory(main) -> None:
    given = [
        "n_x=17",
        "presliding=3",
        "radius=100mm",
        "slab_width=2mm",
        "young_modulus=2MPa",
        "slab_depth=10mm",
        "normal_load=0.2N",
    ]
    typed = [f"{key}={value}" for key, value in STAGE.items()]
    code, said, _ = main("try", *given, *typed, "members=2", "stage_stroke=10 mm")
    answer = said.splitlines()[0]
    assert code == 0
    assert "the stage moves 10 mm end to end, ±5 mm, the pin " in answer
    assert "J" in answer.partition("area of the loop")[2].split(",")[0]
    assert said.count("┤") == 12
    code, said, _ = main("try", *given, *typed, "members=2", "stage_stroke=0.1 mm")
    assert (code, "memory = true" in said) == (0, True)
