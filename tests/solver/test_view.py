"""From Python: public names, a result as a line in a console, as a dataset with a campaign's names and numbers, as a picture."""

import subprocess
import sys
from functools import cache

import numpy as np
import pytest
from matplotlib.figure import Figure

import nanoslip
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.outcome import Ending
from nanoslip.solver.view import with_error

CASE = nanoslip.Case(intrinsic_friction=0.5, radius=50.0, slab=nanoslip.Slab(n_x=17), max_events=200)
CAMPAIGN = {
    "title": "the same case",
    "stages": ["contact", "slip", "dynamics"],
    "axes": {"intrinsic_friction": [0.5], "radius": [50.0]},
    "numerics": {"n_x": 17},
    "limits": {"events": 200},
    "ensemble": {"members": 1},
    "outputs": {"tractions": True},
    "drives": [{"name": "slow", "samples": 40}],
}


@cache
def record():
    return nanoslip.friction_record(CASE)


@cache
def short():
    return nanoslip.plateau_of(nanoslip.friction_record(nanoslip.Case(slab=CASE.slab, max_events=4)))


@pytest.fixture(scope="module")
def driven():
    return nanoslip.drive_result(CASE, nanoslip.Drive.from_si(samples=40), record())


@pytest.fixture(scope="module")
def dataset():
    return nanoslip.run(CAMPAIGN)


def blank():
    return Figure().add_subplot()


def test_every_result_is_one_line_without_its_arrays(driven):
    sizes = nanoslip.event_sizes(record())
    for each in (
        *(record(), driven, driven.plateau, driven.motion, driven.coefficients, nanoslip.contact_state(CASE), sizes),
        nanoslip.size_distribution(sizes.slips, discrete=True),
        nanoslip.logarithmic_histogram(sizes.slips, discrete=True),
        nanoslip.event_statistics(record()),
        nanoslip.surface_compliance(CASE.slab),
    ):
        line = repr(each)
        assert line.startswith(f"{type(each).__name__}(")
        assert len(line) < 160
        assert "\n" not in line
        assert "array" not in line


def test_the_line_says_what_came_out(driven):
    assert repr(record()).startswith("FrictionRecord(200 events, δ_p/L_x to ")
    assert repr(record()).endswith(", completed)")
    assert f"F/W {record().final_force / record().normal_load:.4g}" in repr(record())
    assert f"F/W {driven.plateau.mean:.4g}" in repr(driven.plateau)
    assert repr(short()).startswith("Plateau(no_plateau: ")


@pytest.mark.parametrize(
    ("number", "uncertainty", "text"),
    [
        (0.1367, 9e-5, "0.13670 ± 0.00009"),
        (0.1349, 1e-4, "0.13490 ± 0.00010"),
        (0.3115, 0.0204, "0.31 ± 0.02"),
        (0.3116, 0.0149, "0.312 ± 0.015"),
        (0.29144, 0.0096, "0.291 ± 0.010"),
        (0.29144, 0.0094, "0.291 ± 0.009"),
        (8750.4, 312.0, "8800 ± 300"),
        (8750.4, 95.0, "8750 ± 100"),
        (0.003, 0.02, "0.00 ± 0.02"),
        (3.2144e-6, 4.4e-8, "3.21e-06 ± 4e-08"),
        (3.2144e-6, 1.44e-8, "3.214e-06 ± 1.4e-08"),
        (3.2144e9, 4.4e7, "3.21e+09 ± 4e+07"),
        (-2.0, 0.3, "-2.0 ± 0.3"),
        (0.00390625, 0.0, "0.00391 ± ?"),
        (0.08730000002, 3e-11, "0.0873 ± ?"),  # rounding
        (0.0, 0.0, "0 ± ?"),
        (0.123456, float("nan"), "0.123 ± ?"),
        (float("inf"), 1.0, "inf"),
        (float("nan"), 1.0, "nan"),
    ],
)
def test_an_uncertainty_has_one_digit_or_two_from_1_on_and_its_number_ends_at_the_same_place(number, uncertainty, text):
    assert with_error(number, uncertainty) == text


def test_a_dataset_of_a_result_is_the_campaign_s(driven, dataset):
    """Names, dimensions, attributes and bits: one way from a number to its variable."""
    theirs = {
        "record": (record().to_xarray(), dataset.nanoslip.record()),
        "drive": (driven.to_xarray(nanoslip.Scales(), pin_mass=0.5), dataset.nanoslip.trajectory()),
        "plateau": (driven.plateau.to_xarray(), dataset.nanoslip.record()),
        "sizes": (nanoslip.event_sizes(record()).to_xarray().drop_vars("event_step"), dataset.nanoslip.record()),
    }
    for name, (found, expected) in theirs.items():
        assert len(found.variables) >= 4, name
        assert found.attrs == {"outcome": "completed", "message": ""} or name == "sizes"
        for each in found.variables:
            np.testing.assert_equal(found[each].attrs, expected[each].attrs)
            assert found[each].dims == expected[each].dims, each
            if each not in ("event_drop", "event_dissipated"):  # of sizes, without what is rounding
                np.testing.assert_array_equal(found[each].values, expected[each].values, err_msg=str(each))


def test_a_contact_is_the_campaign_s_but_for_the_rounding_of_its_load(dataset):
    found, expected = nanoslip.contact_state(CASE).to_xarray(), dataset.nanoslip.contact()
    assert {"pressure", "shear", "slip", "gap", "x", "approach", "maximum_pressure"} <= set(found.variables)
    for each in found.variables:
        np.testing.assert_equal(found[each].attrs, expected[each].attrs)
        np.testing.assert_allclose(found[each].values, expected[each].values, rtol=1e-11, atol=1e-15)


def test_without_scales_a_drive_says_its_units(driven):
    found = driven.to_xarray()
    assert found["time"].attrs["units"] == "1"
    assert found["time"].attrs["long_name"].endswith(", in √(m/(G·L_y))")
    np.testing.assert_array_equal(found["time"].values, driven.motion.time)
    np.testing.assert_array_equal(found["sample_position"].values, driven.motion.position)


def test_the_picture_of_a_record_is_its_sawtooth(dataset):
    axes = record().plot(blank())
    (line,) = axes.lines
    expected = dataset.nanoslip.teeth()
    np.testing.assert_array_equal(line.get_xdata(), expected["displacement"].values)
    np.testing.assert_allclose(line.get_ydata(), expected["friction_force"].values, rtol=1e-14)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("pin displacement δ_p/L_x", "friction force F/W")


def test_the_picture_of_a_contact_holds_all_of_its_load():
    contact: ContactState = nanoslip.contact_state(CASE)
    pressure, shear = contact.plot(blank()).lines
    assert pressure.get_ydata().sum() * CASE.slab.spacing == pytest.approx(1.0, rel=1e-9)  # in W
    assert (pressure.get_label(), shear.get_label()) == ("pressure p", "shear q")


def test_the_picture_of_a_drive_shows_its_coefficients(driven):
    lines = {line.get_label(): line.get_ydata() for line in driven.plot(blank()).lines}
    assert lines["μ_s"][0] == driven.coefficients.static_friction
    assert lines["spring"].max() == pytest.approx(driven.motion.spring_force.max() / CASE.normal_load)
    assert ("μ_k" in lines) == np.isfinite(driven.coefficients.kinetic_friction)


def test_the_picture_of_sizes_is_a_share_that_falls_from_one():
    axes = nanoslip.event_sizes(record()).plot(blank())
    assert axes.get_xscale() == axes.get_yscale() == "log"
    for line in axes.lines:
        assert line.get_ydata()[0] == 1.0
        assert np.all(np.diff(line.get_ydata()) < 0.0)


def test_the_picture_of_what_failed_says_so(driven):
    assert driven.plateau.plot(blank()).get_title() == ""
    assert short().outcome.ending is Ending.NO_PLATEAU
    assert "no_plateau: " in short().plot(blank()).get_title()
    assert short().to_xarray().attrs["outcome"] == "no_plateau"


def output_of(program, environment, folder):
    """Words that a program prints in a process of its own."""
    words = [sys.executable, "-c", program]
    done = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, check=True)
    return done.stdout.split()


SLAB = "from nanoslip.solver.slab import SCHEMES; print(*sorted(SCHEMES))"


@pytest.mark.parametrize(
    ("program", "said"),
    [
        (SLAB, ["biquadratic", "chain", "galerkin", "half_plane", "half_space", "layer", "strip"]),
        (
            "from nanoslip import Slab; Slab; " + SLAB,
            ["biquadratic", "chain", "galerkin", "half_plane", "half_space", "layer", "strip"],
        ),
        ("from nanoslip.solver.drive import INTEGRATORS; print(*sorted(INTEGRATORS))", ["exact", "rk4"]),
        ("import sys, nanoslip.solver; print({'xarray', 'matplotlib'} & set(sys.modules) or 'none')", ["none"]),
    ],
)
def test_schemes_and_integrators_are_known_whatever_is_imported_and_computing_needs_neither_xarray_nor_matplotlib(
    program, said, environment, tmp_path
):
    assert output_of(program, environment, tmp_path) == said
