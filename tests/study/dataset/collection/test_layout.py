"""Cases lie along the axes of a full product, or along one dimension of their own."""

from collections import Counter

import numpy as np
import pytest

from nanoslip.study.dataset.access import Accessor
from nanoslip.study.dataset.collect import collect
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


AXES = "[drive_axes]\nspring_stiffness = [1e5, 2e5]\npin_mass = [0.5, 0.2, 1.0]\n"


HEAD = (
    SMALL[: SMALL.index("[[drives]]")].replace("radius = [50.0, 100.0]", "radius = [50.0]") + "[outputs]\nfit = false\n"
)
DRIVES = SMALL[SMALL.index("[[drives]]") :]


def test_axes_of_drives_are_dimensions_and_one_record_serves_all(build):
    """Beside `drive`, as there are several tables; every drive's value stands where its own task says."""
    plan, store = build(HEAD + AXES + DRIVES)
    found = collect(plan, store)
    assert Counter(task.kind for task in plan.tasks) == {"compliance": 1, "record": 2, "drive": 2 * 2 * 2 * 3}
    assert found["regime"].dims == (*CASE_DIMS, "drive", "spring_stiffness", "pin_mass")
    assert found["plateau_mean"].dims == CASE_DIMS
    assert found["spring_stiffness"].values.tolist() == [1e5, 2e5]
    assert found["stage_velocity"].dims == ("drive",)
    assert not [name for name in found.data_vars if str(name).startswith(("fitted_", "fit_"))]  # outputs.fit = false
    for case in plan.cases:
        for drive in plan.manifest.drives:
            here = found.sel(intrinsic_friction=case.parameters["intrinsic_friction"], drive=drive.name, **drive.point)
            result = store.read(plan.case_tasks[case.case_id].drives[drive.label])
            assert here["steps"].item() == result.scalars["steps"][0]
            assert here["drive_outcome"].item() == result.outcome.ending


def test_what_follows_from_an_axis_varies_along_it_alone(build):
    axes = "[drive_axes]\nspring_stiffness = [1e5, 2e5]\npin_mass = [0.5, 0.05]\nprofile = ['mean']\n"
    found = collect(*build(HEAD + axes + '[[drives]]\nname = "one"\nsamples = 5\nduration_periods = 2\n'))
    assert found["duration"].dims == ("spring_stiffness", "pin_mass")
    np.testing.assert_allclose(
        found["duration"], 4.0 * np.pi * np.sqrt(found["pin_mass"] / found["spring_stiffness"]).T, rtol=1e-15
    )
    assert (found["duration_periods"].item(), found["drive"].item(), found["profile"].item()) == (2.0, "one", "mean")
    assert found["steps"].dims == (*CASE_DIMS, "spring_stiffness", "pin_mass")


def test_a_point_that_excludes_itself_is_invalid_with_its_case_and_the_others_done(build):
    drive = (
        '[drive_axes]\ntime_step = [1e-6, 1e-3]\nduration = [1e-4, 2e-3]\n[[drives]]\nname = "a"\nintegrator = "rk4"\n'
    )
    found = collect(*build(HEAD + drive))
    endings = found["drive_outcome"].isel(intrinsic_friction=0).squeeze()
    assert endings.dims == ("time_step", "duration")
    assert (endings == "invalid").values.tolist() == [[False, False], [True, False]]
    assert "needs 0 < time_step" in found["drive_message"].sel(time_step=1e-3, duration=1e-4)[0].item()
    assert set(found["outcome"].values.ravel()) == {"completed"}


def test_a_list_of_cases_lies_before_the_axes_of_drives_and_members_along_none(build):
    found = collect(*build(HEAD.replace("members = 1", "members = 3") + AXES + DRIVES))
    dims = ("drive", "spring_stiffness", "pin_mass")
    for name in ("static_friction", "static_friction_uncertainty", "static_friction_members"):
        assert found[name].dims == (*CASE_DIMS, *dims)
    assert np.isfinite(found["static_friction_uncertainty"]).any()
    zipped = collect(*build('design = "zip"\n' + HEAD.replace("[50.0]", "[50.0, 100.0]") + AXES + DRIVES))
    assert zipped["static_friction"].dims == ("case", *dims)


def test_a_single_case_has_the_four_standard_dimensions(build):
    text = SMALL.split("[axes]")[0].replace(', "dynamics"', "") + "[numerics]\nn_x = 17\n[limits]\nevents = 200\n"
    found = collect(*build(text))
    assert found["plateau_mean"].dims == CASE_DIMS
    assert found["outcome"].values.ravel().tolist() == ["completed"]
