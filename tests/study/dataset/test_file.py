"""A file gives back what was written, and what it cannot give is one clear message."""

import netCDF4
import numpy as np
import pytest
import xarray as xr

from study.dataset import file
from study.dataset.groups import carrying, groups_of
from study.dataset.store import StoreError


def made(size: int) -> xr.Dataset:
    root = xr.Dataset({"word": ("case", ["", "μ_i = 0.5"])}, {"case": [0, 1]}, {file.FORMAT: file.VERSION})
    sample = np.random.default_rng(1).normal(size=size)
    sample[0] = np.nan
    return carrying(
        root, {"record": xr.Dataset({"force": ("event", sample), "kind": ("event", np.zeros(size, np.int8))})}
    )


@pytest.mark.parametrize("size", [1, file.SMALLEST_COMPRESSED])
def test_what_is_read_is_what_was_written_compressed_where_it_is_long(tmp_path, size):
    file.write(made(size), tmp_path / "one.nc")
    with file.read(tmp_path / "one.nc") as again:
        xr.testing.assert_identical(again.load(), made(size))
        assert groups_of(again)["record"]["kind"].dtype == np.int8
        xr.testing.assert_identical(groups_of(again)["record"].load(), groups_of(made(size))["record"])
    with netCDF4.Dataset(tmp_path / "one.nc") as opened:
        assert opened["record/force"].filters()["zlib"] == (size > 1)


def test_texts_that_are_all_empty_or_none_at_all_are_kept(tmp_path):
    root = xr.Dataset({"word": ("case", np.array(["", ""], object))}, attrs={file.FORMAT: file.VERSION})
    none = xr.Dataset({"name": ("software", np.array([], object))})
    file.write(carrying(root, {"software": none}), tmp_path / "one.nc")
    with file.read(tmp_path / "one.nc") as again:
        assert again["word"].values.tolist() == ["", ""]
        assert groups_of(again)["software"].sizes["software"] == 0


@pytest.mark.parametrize(
    ("has", "said"), [(2, "has format 2; this nanoslip reads format 3"), (None, "has no format: older")]
)
def test_a_file_of_another_format_is_refused_with_what_to_do(tmp_path, has, said):
    path = tmp_path / "old.nc"
    xr.Dataset({"a": 1.0}, attrs={} if has is None else {file.FORMAT: has}).to_netcdf(path)
    with pytest.raises(StoreError, match=rf"old\.nc: {said}.*collect the campaign again"):
        file.read(path)
