"""The closed form of Eq. 16-19 is what the exact integrator gives where friction is constant and the contact is rigid."""

import numpy as np
import pytest
from drive import closed_form, damper_force, load_of

import nanoslip

CONSTANT = {
    "title": "Constant friction",
    "stages": ["contact", "slip", "dynamics"],
    "axes": {"intrinsic_friction": [0.5]},
    "numerics": {"n_x": 33},
    "limits": {"spacings": 2},
    "ensemble": {"members": 1},
    "drives": [{"name": "mean", "profile": "mean", "surface_compliance": False, "samples": 400}],
}


def test_constant_friction_moves_the_pin_as_the_closed_form_says() -> None:
    """μ_s = μ_k = the plateau: both are closed forms of the same motion, equal to rounding of a position of 0.3 mm."""
    data = nanoslip.run(CONSTANT)
    plateau = float(data["plateau_mean"].squeeze())
    model = closed_form(data, plateau, plateau, plateau, samples=400)
    run = data.nanoslip.trajectory(intrinsic_friction=0.5)
    assert model.time == pytest.approx(run["time"].values, rel=1e-12)
    assert model.position == pytest.approx(run["sample_position"].values, abs=1e-12)
    assert model.spring_force == pytest.approx(run["sample_spring_force"].values, abs=1e-9)


def test_the_paper_s_load_and_damper() -> None:
    """§3.3: 100 N, and 0.13 N of the damper at rest."""
    data = nanoslip.run({**CONSTANT, "drives": [{"name": "paper", "samples": 10}]})
    assert load_of(data) == pytest.approx(100.0)
    assert damper_force(data) * load_of(data) == pytest.approx(0.13, abs=0.005)
    assert np.isfinite(damper_force(data))
