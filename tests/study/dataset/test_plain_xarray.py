"""Plain xarray can do with a file of results what it can do with any: nothing of it has to be read by nanoslip first."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr

from nanoslip.study.api import open as open_dataset, run
from nanoslip.study.dataset.file import FILE, with_texts

BASE: dict[str, Any] = {
    "title": "base",
    "stages": ["contact", "slip"],
    "axes": {"intrinsic_friction": [0.25, 0.5], "normal_load": [1e-3, 2e-3]},
    "numerics": {"n_x": 17, "scheme": "strip"},
    "limits": {"events": 40},
    "ensemble": {"members": 2},
}
LIST = BASE | {"design": "zip", "interface": {"contacts": 2}}
"""A list of cases, with the variables of an interface."""


@pytest.fixture(scope="module", params=["list", pytest.param("everything", marks=pytest.mark.slow)])
def folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A dataset of either layout, with all variables between them: campaigns of fewer stages have none but theirs."""
    if request.param == "everything":
        return Path(request.getfixturevalue("full_folder"))
    folder: Path = tmp_path_factory.mktemp("plain")
    run(LIST, folder).close()
    return folder


def along(data: xr.Dataset) -> str:
    """The last dimension of the cases with several."""
    return str([dim for dim in data["case_id"].dims if data.sizes[dim] > 1][-1])


def number_of(data: xr.Dataset) -> xr.DataArray:
    """A number of each case."""
    over = data["case_id"].dims
    return next(each for each in data.data_vars.values() if each.dtype.kind == "f" and each.dims == over)


def drawn(data: xr.Dataset) -> Any:
    mpl.use("Agg")
    number = number_of(data).squeeze()
    return number.plot(x=number.dims[0])  # type: ignore[call-arg]


STRICT: dict[str, Any] = {"combine_attrs": "override", "compat": "no_conflicts", "join": "outer"}
DOES: dict[str, Callable[[xr.Dataset, Path], Any]] = {
    "transpose": lambda data, _: data.transpose(),
    "transpose a number": lambda data, _: number_of(data).transpose(),
    "stack": lambda data, _: data.stack(place=data["case_id"].dims),
    "stack a number": lambda data, _: number_of(data).stack(place=data["case_id"].dims[::-1]).to_series(),
    "groupby": lambda data, _: data.groupby(along(data)).mean(),
    "groupby outcome": lambda data, _: number_of(data).groupby(data["outcome"]).mean(),
    "where": lambda data, _: data.where(number_of(data) > 0),
    "to_dataframe": lambda data, _: data.to_dataframe(),
    "merge": lambda data, _: xr.merge([data, data.isel({along(data): [0]})], **STRICT),
    "concat": lambda data, _: xr.concat(
        [data.isel({along(data): [at]}) for at in (1, 0)], along(data), data_vars="minimal", coords="minimal"
    ),
    "combine": lambda data, _: xr.combine_by_coords([data.isel({along(data): [at]}) for at in (1, 0)], **STRICT),
    "netcdf": lambda data, folder: data.to_netcdf(folder / "again.nc"),
    "plot": lambda data, _: drawn(data),
}
OTHERS: dict[str, Callable[[xr.Dataset, Path], Any]] = {
    "dask": lambda data, _: data.chunk(1).transpose().compute(),
    "zarr": lambda data, folder: data.to_zarr(folder / "again.zarr", mode="w"),
}


@pytest.mark.slow
@pytest.mark.parametrize("does", DOES.values(), ids=DOES)
def test_all_that_xarray_does_it_does_with_a_file_that_it_has_opened(does, folder, tmp_path):
    with xr.open_dataset(folder / FILE) as data:
        assert does(data, tmp_path) is not Ellipsis
    with open_dataset(folder) as data:
        assert does(data, tmp_path) is not Ellipsis


@pytest.mark.parametrize("package", OTHERS)
def test_packages_beside_xarray_handle_the_file(package, folder, tmp_path):
    pytest.importorskip(package)
    with xr.open_dataset(folder / FILE) as data:
        OTHERS[package](data, tmp_path)


def test_numbers_stand_for_the_texts_that_nanoslip_gives(folder):
    """The place in flag_meanings, a content hash of 12 digits, or a name in the group `texts`: -1 of no text."""
    with xr.open_dataset(folder / FILE) as data, open_dataset(folder) as known:
        words = data["outcome"].attrs["flag_meanings"].split()
        assert [words[code] for code in data["outcome"].values.ravel()] == known["outcome"].values.ravel().tolist()
        assert [f"{name:012x}" for name in data["case_id"].values.ravel()] == known["case_id"].values.ravel().tolist()
        with xr.open_dataset(folder / FILE, group="texts") as texts:
            found = texts["text"].sel(name=data["message"])
            np.testing.assert_array_equal(found.values, known["message"].values)
        assert all(each.ndim < 2 or each.dtype.kind in "biuf" for each in data.variables.values())
        xr.testing.assert_identical(with_texts(data).load(), known.load())


def test_files_that_xarray_joins_keep_the_meaning_of_their_numbers(tmp_path):
    """Codes of words are those of the declared list, names those of the texts themselves: neither depends on the file."""
    low, high = (
        run(BASE | {"axes": {"intrinsic_friction": [friction]}, "constants": {"radius": radius}}, tmp_path / name)
        for name, friction, radius in (("low", 0.25, 200.0), ("high", 0.5, 1e-9))
    )
    assert low["outcome"].item() != high["outcome"].item()
    parts = [xr.open_dataset(tmp_path / name / FILE) for name in ("low", "high")]
    joined = xr.combine_by_coords([part[["outcome", "message"]].reset_coords(drop=True) for part in parts], **STRICT)
    for part in parts:
        again = joined.sel(intrinsic_friction=part["intrinsic_friction"], radius=part["radius"])
        assert again["outcome"].item() == part["outcome"].item()
        assert again["message"].item() == part["message"].item()
