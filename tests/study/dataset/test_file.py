"""A file gives back what was written, and what it cannot give is one clear message."""

from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr

from nanoslip.study.dataset import file
from nanoslip.study.dataset.file import SMALLEST_COMPRESSED, carrying, groups_of
from nanoslip.study.results.store import StoreError
from tests.study.results.results import NO_FILES


def made(size: int) -> xr.Dataset:
    root = xr.Dataset({"word": ("case", ["", "μ_i = 0.5"])}, {"case": [0, 1]}, {file.FORMAT: file.VERSION})
    sample = np.random.default_rng(1).normal(size=size)
    sample[0] = np.nan
    return carrying(
        root, {"record": xr.Dataset({"force": ("event", sample), "kind": ("event", np.zeros(size, np.int8))})}
    )


@pytest.mark.parametrize("size", [1, SMALLEST_COMPRESSED])
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
    ("has", "said"),
    [
        (
            {file.FORMAT: 2},
            "has format 2, of an older nanoslip; this one reads formats 3 to 4: nanoslip run writes it anew",
        ),
        (
            {file.FORMAT: 5},
            "has format 5, of a newer nanoslip; this one reads formats 3 to 4: read it with the newer one",
        ),
        (
            {file.FORMAT: 99, "nanoslip_version": "9.1"},
            r"has format 99, of a newer nanoslip \(its results are by 9.1\); this one",
        ),
        ({}, "no dataset of nanoslip: it has no attribute nanoslip_format"),
        ({file.FORMAT: "3"}, "no dataset of nanoslip"),
        ({file.FORMAT: [3, 3]}, "no dataset of nanoslip"),
        ({file.FORMAT: 3.5}, "no dataset of nanoslip"),
    ],
)
def test_a_file_of_another_format_is_refused_with_what_reads_it(tmp_path, has, said):
    path = tmp_path / "old.nc"
    xr.Dataset({"a": 1.0}, attrs=has).to_netcdf(path)
    with pytest.raises(StoreError, match=rf"old\.nc: {said}"):
        file.read(path)


def test_no_bit_of_a_dataset_changes_without_being_found(tmp_path):
    path = tmp_path / "one.nc"
    file.write(made(100), path)
    whole = path.read_bytes()
    with file.read(path):
        pass  # nothing is wrong with it
    seal = len(whole) - len("\nsha256 \n") - 64
    for bit in np.random.default_rng(1).permutation(8 * seal)[:500]:
        changed = bytearray(whole)
        changed[bit // 8] ^= 1 << bit % 8
        path.write_bytes(changed)
        with pytest.raises(
            StoreError, match=r"one\.nc: its bytes are not those that were collected: .*nanoslip collect"
        ):
            file.read(path)


def test_a_dataset_that_another_program_has_changed_is_read_as_it_is(tmp_path):
    """netCDF drops what stands behind a file that it changes."""
    path = tmp_path / "one.nc"
    file.write(made(100), path)
    with netCDF4.Dataset(path, "a") as changed:
        changed.setncattr("note", "mine " * 1000)
    with file.read(path) as found:
        assert found.attrs["note"].startswith("mine")


@pytest.fixture
def unchecked(monkeypatch: pytest.MonkeyPatch) -> None:
    """As a file that is too large to be checked when it is opened."""
    monkeypatch.setattr(file, "MOST_CHECKED", 0)


@pytest.mark.usefixtures("unchecked")
def test_bytes_that_were_damaged_are_refused_when_they_are_read(tmp_path):
    """Not when the file is opened: a compressed column is unpacked when somebody asks for it."""
    path = tmp_path / "one.nc"
    file.write(made(65_536), path)
    whole = path.read_bytes()
    middle = len(whole) // 2  # of the one long column
    path.write_bytes(whole[:middle] + bytes(256) + whole[middle + 256 :])
    with pytest.raises(StoreError, match=r"one\.nc: cannot be read: .*nanoslip collect"), file.reading(path) as again:
        groups_of(again)["record"]["force"].load()


@pytest.mark.usefixtures("unchecked")
def test_a_text_that_was_damaged_is_refused_when_the_file_is_opened(tmp_path):
    path = tmp_path / "one.nc"
    words = np.array([str(number) * 9 for number in np.random.default_rng(1).random(4096)], object)
    file.write(carrying(xr.Dataset({"word": ("case", words)}, attrs={file.FORMAT: file.VERSION}), {}), path)
    whole = path.read_bytes()
    middle = len(whole) // 2
    path.write_bytes(whole[:middle] + bytes(256) + whole[middle + 256 :])
    with pytest.raises(StoreError, match=r"one\.nc: no dataset"):
        file.read(path)


@pytest.mark.parametrize(
    ("refused", "said"),
    [(OSError(28, "No space left on device"), "No space left"), (RuntimeError("NetCDF: HDF error"), "HDF error")],
)
def test_a_disk_that_refuses_the_dataset_is_named_and_nothing_is_left_of_it(tmp_path, monkeypatch, refused, said):
    """HDF5 says of a full disk no more than that."""

    def full(_: object, scratch: Path) -> None:
        scratch.touch()
        raise refused

    monkeypatch.setattr(file, "write_tree", full)
    with pytest.raises(StoreError, match=rf"one\.nc: cannot be written: .*{said}"):
        file.write(made(1), tmp_path / "one.nc")
    assert list(tmp_path.iterdir()) == []


@NO_FILES
def test_what_is_no_file_is_refused_and_nobody_waits_for_it(tmp_path, no_file):
    no_file(tmp_path / "one.nc")
    with pytest.raises(StoreError, match=r"one\.nc: no dataset \(no regular file\)"):
        file.read(tmp_path / "one.nc")
