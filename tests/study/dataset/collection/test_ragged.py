"""Records and trajectories of different length are cut apart again as they were put together."""

import numpy as np
import pytest

from nanoslip.study.dataset import file
from nanoslip.study.dataset import variables as ragged
from nanoslip.study.dataset.access import Accessor
from nanoslip.study.dataset.collect import collect
from nanoslip.study.dataset.file import groups_of
from nanoslip.study.dataset.variables import Samples, all_groups
from tests.study.dataset.campaigns import CASE_DIMS, changed


def test_records_are_contiguous_ragged_arrays(small):
    _, _, found = small
    record, trajectory = groups_of(found)["record"], groups_of(found)["trajectory"]
    assert record["row_size"].attrs["sample_dimension"] == "event"
    assert int(record["row_size"].sum()) == record.sizes["event"] == 4 * 200
    assert trajectory["trajectory_row_size"].attrs["sample_dimension"] == "sample"
    assert int(trajectory["trajectory_row_size"].sum()) == trajectory.sizes["sample"] == 8 * 41
    assert record["event_kind"].attrs["flag_meanings"] == "slip release touch"


def test_runs_carry_the_labels_of_what_they_belong_to(small):
    _, _, found = small
    record, trajectory = groups_of(found)["record"], groups_of(found)["trajectory"]
    assert record["record"].values.tolist() == found["record_id"].values.ravel().tolist()
    assert record["case_id"].values.tolist() == found["case_id"].values.ravel().tolist()
    assert trajectory["trajectory"].values.tolist() == found["trajectory_id"].values.ravel().tolist()
    assert trajectory["case_id"].values.tolist() == np.repeat(found["case_id"].values.ravel(), 2).tolist()
    assert trajectory["drive"].values.tolist() == 4 * ["slow", "fast"]


def test_one_cases_record_is_its_result_and_opens_lazily(small):
    plan, store, found = small
    case = plan.cases[2]
    record = Accessor(found).record(**{name: case.parameters[name] for name in CASE_DIMS})
    columns = [variable for variable in record.variables.values() if variable.dims == ("event",)]
    assert sum(not variable._in_memory for variable in columns) == len(columns) - 4  # number and drop, made of forces
    result = store.read(plan.case_tasks[case.case_id].record)
    for name, quantity in all_groups()["record"].series[0].columns.items():
        by = 1.0 / result.scalars["normal_load"][0] if quantity.per else 1
        np.testing.assert_array_equal(record[quantity.name], result.arrays[name] * by)


def test_one_drives_trajectory_is_its_result_in_si(small):
    plan, store, found = small
    case, drive = plan.cases[1], plan.manifest.drives[1]
    moved = Accessor(found).trajectory(**{name: case.parameters[name] for name in CASE_DIMS}, drive="fast")
    result = store.read(plan.case_tasks[case.case_id].drives["fast"])
    assert moved["time"][-1].item() == pytest.approx(
        drive.drive.in_si.duration, rel=1e-14
    )  # there and back: two roundings
    scales = plan.manifest.scales
    np.testing.assert_array_equal(moved["sample_position"], result.arrays["position"] * scales.slab_width)
    assert moved.sizes["slip_phase"] == result.arrays["slip_time"].size


def test_cases_that_share_a_result_share_its_record(build):
    plan, store = build(changed(radius="half_width = [0.1, 0.2]"))  # of a flat punch: the parabola ignores it
    found = collect(plan, store)
    first, second = groups_of(found)["record"]["record"].values.tolist()
    assert found["record_id"].values.ravel().tolist() == [first, first, second, second]


@pytest.mark.parametrize("held", [0, 100, 1 << 26])
def test_long_columns_lie_on_disk_meanwhile_and_are_the_same(tmp_path, monkeypatch, held):
    """Without a name: nothing is left of them, whatever happens."""
    monkeypatch.setattr(ragged, "HELD", held)
    column = Samples(tmp_path)
    runs = [np.arange(number, dtype=np.int8) for number in (0, 7, 70, 0, 3)]
    for run in runs:
        column.add(run)
    values = column.values(np.float64)
    np.testing.assert_array_equal(values, np.concatenate(runs))
    assert (values.dtype, isinstance(values, np.memmap)) == (np.int8, held < 100)
    assert Samples(tmp_path).values(np.int32).dtype == np.int32
    assert not list(tmp_path.iterdir())


def test_a_dataset_of_long_columns_is_the_same(small, monkeypatch, tmp_path):
    plan, store, found = small
    monkeypatch.setattr(ragged, "HELD", 0)
    for number, dataset in enumerate((found, collect(plan, store))):
        file.write(dataset, tmp_path / f"{number}.nc")
    assert (tmp_path / "0.nc").read_bytes() == (tmp_path / "1.nc").read_bytes()
