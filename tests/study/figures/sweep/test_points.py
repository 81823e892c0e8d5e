"""Points hold every case once, with its axes; a ratio's uncertainty follows from both numbers; members are mean and error."""

from dataclasses import fields

import numpy as np
import pytest

import nanoslip
from nanoslip.study.figures.points import points_of, ratio
from tests.study.figures.cases import listed, product

LOADS = [1e-4, 1e-3]


def test_every_case_is_a_point_beside_its_axes() -> None:
    points = points_of(product(intrinsic_friction=[0.2, 0.4, 0.6], normal_load=LOADS, n_x=[33]), "plateau_mean")
    assert list(points.axes) == ["intrinsic_friction", "normal_load"]  # one n_x is no axis
    np.testing.assert_array_equal(points.values, 0.5 * points.axes["intrinsic_friction"])
    np.testing.assert_allclose(points.errors, 0.01 * points.values, rtol=1e-12)
    assert points.label == "F/W on the plateau"


def test_some_of_the_points_are_these_in_every_array() -> None:
    points = points_of(product(intrinsic_friction=[0.2, 0.4, 0.6], normal_load=LOADS), "plateau_mean")
    some = points.at(np.array([4, 1]))
    for name, values in points.columns().items():
        assert some.columns()[name].tolist() == [values[4], values[1]]
    for each in fields(points):
        if isinstance(array := getattr(points, each.name), np.ndarray):
            np.testing.assert_array_equal(getattr(some, each.name), array[[4, 1]])


def test_a_ratio_has_the_uncertainties_of_both() -> None:
    data = product(intrinsic_friction=[0.2, 0.4], normal_load=LOADS)
    data["peak_friction"] = 2.0 * data.plateau_mean
    exact = points_of(data, "plateau_mean", "intrinsic_friction")
    np.testing.assert_allclose(exact.values, 0.5)
    np.testing.assert_allclose(exact.errors, 0.005)
    data["kinetic_friction"] = data.plateau_mean
    data["kinetic_friction_uncertainty"] = data.plateau_mean_uncertainty
    both = points_of(data, "kinetic_friction", "plateau_mean")
    np.testing.assert_allclose(both.errors, np.sqrt(2.0) * 0.01)
    assert np.isnan(points_of(data, "peak_friction", "intrinsic_friction").errors).all()


def test_a_ratio_of_a_number_to_itself_is_exact() -> None:
    """Of the plateau it was 1 ± 0.0099."""
    same = points_of(product(intrinsic_friction=[0.0, 0.4], normal_load=LOADS), "plateau_mean", "plateau_mean")
    np.testing.assert_array_equal(same.values, [np.nan, np.nan, 1.0, 1.0])
    np.testing.assert_array_equal(same.errors, [np.nan, np.nan, 0.0, 0.0])


def test_a_ratio_to_nothing_is_no_number() -> None:
    points = points_of(product(intrinsic_friction=[0.0, 0.4]), "plateau_mean", "intrinsic_friction")
    assert points.there.tolist() == [False, True]


def test_of_a_list_of_cases_what_follows_from_its_columns_is_no_axis() -> None:
    columns = {"radius": [50.0, 100.0], "n_x": [33, 65], "bottom_row": [17, 33]}
    data = listed(columns, [0.2, 0.3], manifest='design = "zip"\n[axes]\nradius = [50.0, 100.0]\nn_x = [33, 65]\n')
    assert list(points_of(data, "plateau_mean").axes) == ["radius", "n_x"]
    data.attrs["manifest_table"] = "n_x, radius\n33, 50\n65, 100\n"
    assert list(points_of(data, "plateau_mean").axes) == ["radius", "n_x"]


def test_a_setting_that_some_cases_lack_becomes_words() -> None:
    data = listed({"coupling_stiffness": [np.nan, 10.0]}, [0.2, 0.3])
    assert points_of(data, "plateau_mean").axes["coupling_stiffness"].tolist() == ["–", "10"]
    never = listed({"intrinsic_friction": [np.inf, 0.5]}, [0.2, 0.3])
    assert points_of(never, "plateau_mean").axes["intrinsic_friction"].tolist() == ["inf", "0.5"]


def test_numbers_are_means_with_their_uncertainty() -> None:
    data = nanoslip.run({
        "title": "Starts",
        "stages": ["contact", "slip"],
        "axes": {"intrinsic_friction": [0.25, 0.5]},
        "numerics": {"n_x": 17},
        "limits": {"presliding": 3.0},
        "ensemble": {"members": 3},
    })  # fmt: skip
    points = points_of(data, "plateau_mean")
    assert points.values.shape == (2,)
    np.testing.assert_array_equal(points.values, data.plateau_mean.values.ravel())
    np.testing.assert_array_equal(points.errors, data.plateau_mean_uncertainty.values.ravel())
    assert (points.errors > 0.0).all()
    assert points.members.tolist() == [3, 3]


def test_a_variable_that_is_not_there_is_named() -> None:
    with pytest.raises(KeyError, match="static_friction"):
        points_of(product(intrinsic_friction=[0.2]), "static_friction")


def test_a_ratio_is_named_before_what_its_upper_part_is_measured_in() -> None:
    """It read "... in L_x over F/W"."""
    assert ratio("mean_step", "plateau_mean") == "mean step per event over F/W, in L_x"
    assert ratio("surface_stiffness", "normal_load") == "lateral stiffness K over W/(G·L_x·L_y), in G·L_y"
    assert ratio("plateau_mean", "intrinsic_friction") == "F/W on the plateau over μ_i"
    assert ratio("stage_velocity", "spring_stiffness") == "velocity of the stage V_o (m/s) over k (N/m)"
