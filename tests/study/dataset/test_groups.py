"""A dataset finds its groups again after whatever keeps its encoding, and in any file of its own."""

import copy
import pickle

import numpy as np
import pytest
import xarray as xr

from nanoslip.study.dataset import file
from nanoslip.study.dataset.file import LostGroupsError, carrying, flattened, groups_of, loaded, opened, tree_of


def made() -> xr.Dataset:
    """A root of two cases with one group."""
    root = xr.Dataset({"a": ("case", [1.0, 2.0])}, {"case": [0, 1], "case_id": ("case", ["x", "y"])})
    root.attrs[file.FORMAT] = file.VERSION
    return carrying(root, {"record": xr.Dataset({"row_size": ("record", [3])}, {"record": ["r"]})})


KEPT = {
    "sel": lambda root: root.sel(case=1),
    "isel": lambda root: root.isel(case=[0]),
    "one variable": lambda root: root[["a"]],
    "where": lambda root: root.where(root["a"] > 1.0),
    "where, dropping": lambda root: root.where(root["a"] > 1.0, drop=True),
    "squeeze": lambda root: root.isel(case=[0]).squeeze(),
    "assign": lambda root: root.assign(b=1.0),
    "a deep copy": lambda root: root.copy(deep=True),
    "copy.deepcopy": copy.deepcopy,
    "sortby": lambda root: root.sortby("a"),
}


@pytest.mark.parametrize("change", KEPT.values(), ids=KEPT)
def test_selections_and_copies_keep_the_groups(change):
    root = made()
    assert groups_of(change(root)) is groups_of(root)


def test_what_was_computed_anew_has_lost_them():
    with pytest.raises(LostGroupsError, match="has lost its records"):
        groups_of(xr.Dataset({"a": made()["a"].variable}))


def test_a_dataset_in_memory_goes_to_another_process_whole():
    again = pickle.loads(pickle.dumps(made()))
    xr.testing.assert_identical(groups_of(again)["record"], groups_of(made())["record"])


def test_a_file_gives_root_and_groups_until_it_is_closed(tmp_path):
    file.write(made(), tmp_path / "one.nc")
    root, groups = opened(tmp_path / "one.nc")
    assert set(groups) == {"record"}
    assert flattened(carrying(root, groups)).keys() == {"a", "case", "case_id", "record/row_size", "record/record"}
    whole = tree_of(loaded(root)).load()
    root.close()
    (tmp_path / "one.nc").unlink()
    assert whole["record"]["row_size"].item() == 3


def test_a_file_may_be_open_several_times_and_closed_in_any_order(tmp_path):
    """Strings of variable length would break netCDF down here."""
    file.write(made(), tmp_path / "one.nc")
    kept = file.read(tmp_path / "one.nc")
    for _ in range(30):
        with file.read(tmp_path / "one.nc") as again:
            assert groups_of(again)["record"]["record"].values.tolist() == ["r"]
            assert again["case_id"].values.tolist() == ["x", "y"]
    np.testing.assert_array_equal(kept["a"], [1.0, 2.0])


def test_texts_of_a_file_can_be_turned_about(tmp_path):
    """As a map of words over two axes needs it."""
    root = xr.Dataset(
        {"word": (("a", "b"), np.array([["x", "yy", ""]] * 2, dtype=object))}, {"case_id": ("a", ["p", "q"])}
    )
    root.attrs[file.FORMAT] = file.VERSION
    file.write(carrying(root, {}), tmp_path / "one.nc")
    with file.read(tmp_path / "one.nc") as again:
        assert again["word"].transpose("b", "a").values.tolist() == [["x", "x"], ["yy", "yy"], ["", ""]]
