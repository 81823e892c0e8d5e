"""Records and trajectories of different length are cut apart again as they were put together."""

import numpy as np
import pytest

from study.dataset.collect import collect
from study.dataset.ragged import record as record_of
from study.dataset.ragged import trajectory as trajectory_of
from study.dataset.variables import all_series
from tests.study.dataset.campaigns import CASE_DIMS, changed


def test_records_are_contiguous_ragged_arrays(small):
    _, _, found = small
    assert found["row_size"].attrs["sample_dimension"] == "event"
    assert int(found["row_size"].sum()) == found.sizes["event"] == 240
    assert found["trajectory_row_size"].attrs["sample_dimension"] == "sample"
    assert int(found["trajectory_row_size"].sum()) == found.sizes["sample"] == 8 * 41
    assert found["event_kind"].attrs["flag_meanings"] == "slip release touch"


def test_one_cases_record_is_its_result_and_opens_lazily(small):
    plan, store, found = small
    case = plan.cases[2]
    record = record_of(found, **{name: case.parameters[name] for name in CASE_DIMS})
    assert all(not variable._in_memory for variable in record.data_vars.values())
    result = store.read(plan.case_tasks[case.case_id].record)
    for name, quantity in all_series()[0].columns.items():
        by = 1.0 / result.scalars["normal_load"] if quantity.per else 1
        np.testing.assert_array_equal(record[quantity.name], result.arrays[name] * by)


def test_one_drives_trajectory_is_its_result_in_si(small):
    plan, store, found = small
    case, drive = plan.cases[1], plan.manifest.drives[1]
    moved = trajectory_of(found, **{name: case.parameters[name] for name in CASE_DIMS}, drive="fast")
    result = store.read(plan.case_tasks[case.case_id].drives["fast"])
    assert moved["sample_time"][-1].item() == pytest.approx(
        drive.drive.in_si.duration, rel=1e-14
    )  # there and back: two roundings
    scales = plan.manifest.scales
    np.testing.assert_array_equal(moved["sample_position"], result.arrays["position"] * scales.slab_width)
    assert moved.sizes["slip_phase"] == result.arrays["slip_time"].size


def test_a_selection_that_fits_several_cases_or_none_is_refused(small):
    _, _, found = small
    with pytest.raises(ValueError, match="radius has 2 values"):
        record_of(found, intrinsic_friction=0.5)
    with pytest.raises(KeyError):
        record_of(found, intrinsic_friction=0.3, radius=50.0)


def test_cases_that_share_a_result_share_its_record(build):
    plan, store = build(changed(radius="half_width = [0.1, 0.2]"))  # of a flat punch: the parabola ignores it
    found = collect(plan, store)
    assert found.sizes["record"] == 2
    assert found["record_index"].values.ravel().tolist() == [0, 0, 1, 1]
