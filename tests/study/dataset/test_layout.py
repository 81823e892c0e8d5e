"""Cases lie along the axes of a full product, or along one dimension of their own."""

import numpy as np
import pytest

from study.dataset.access.accessor import Accessor
from study.dataset.collect import collect
from tests.conftest import SMALL
from tests.study.dataset.campaigns import CASE_DIMS, changed


def test_a_full_product_has_the_four_standard_dimensions_and_the_drives(small):
    _, _, found = small
    assert found["plateau_mean"].dims == CASE_DIMS
    assert found["plateau_mean"].shape == (2, 2, 1, 1)
    assert found["static_friction"].dims == (*CASE_DIMS, "drive")
    assert found["drive"].values.tolist() == ["slow", "fast"]
    assert found["stage_velocity"].values.tolist() == [1e-3, 2e-3]
    assert found["n_x"].values.tolist() == [17]
    assert found["normal_load"].item() == 1e-3
    assert found["support"].item() == "bonded"


def test_a_further_axis_is_a_further_dimension(build):
    text = changed(radius='support = ["bonded", "frictionless"]', stages='stages = ["contact", "slip"]').split(
        "[[drives]]"
    )[0]
    found = collect(*build(text))
    assert found["plateau_mean"].dims == (*CASE_DIMS, "support")
    assert found["support"].values.tolist() == ["bonded", "frictionless"]
    assert "static_friction" not in found
    assert not np.array_equal(found["surface_stiffness"][..., 0], found["surface_stiffness"][..., 1])


@pytest.mark.parametrize("design", ["zip", "table"])
def test_a_list_of_cases_lies_along_one_dimension(build, design):
    if design == "zip":
        text = 'design = "zip"\n' + SMALL
    else:
        text = 'table = "cases.csv"\n' + SMALL[: SMALL.index("[axes]")] + SMALL[SMALL.index("[numerics]") :]
    plan, store = build(text)
    found = collect(plan, store)
    assert found["plateau_mean"].dims == ("case",)
    assert found["intrinsic_friction"].dims == ("case",)
    assert found["n_x"].dims == ("case",)
    assert found["radius"].values.tolist() == ([50.0, 100.0] if design == "zip" else [50.0, 50.0, 100.0])
    one = Accessor(found).record(intrinsic_friction=0.5, radius=100.0)
    last = store.read(plan.case_tasks[plan.cases[-1].case_id].record)
    np.testing.assert_array_equal(one["displacement"], last.arrays["displacement"])


def test_parameters_that_do_not_matter_are_no_coordinates(build):
    text = SMALL.split("[[drives]]")[0].replace(', "dynamics"', "")
    smooth = collect(*build(text))
    assert not {"half_width", "distribution", "seed", "rows", "first_spacing"} & set(smooth.coords)
    assert {"spread", "max_events", "slip_order"} <= set(smooth.coords)
    contact = collect(*build(text.replace('"contact", "slip"', '"contact"')))
    assert not {"max_events", "pin_translation"} & set(contact.coords)
    two = 'design = "zip"\n' + text.replace("[50.0, 100.0]", '[50.0, 100.0]\npin = ["parabola", "flat_punch"]')
    mixed = collect(*build(two))
    np.testing.assert_array_equal(mixed["half_width"], [np.nan, 0.25])
    np.testing.assert_array_equal(mixed["radius"], [50.0, np.nan])
