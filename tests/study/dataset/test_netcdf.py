"""A dataset is written as xarray itself writes it, a chunk at a time."""

import subprocess
import sys
import tracemalloc
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest
import xarray as xr

from nanoslip.study.dataset.file import SMALLEST_COMPRESSED, write_tree

COMPRESSED = {"zlib": True, "complevel": 1, "shuffle": True}
DIMS = ("load", "radius", "member")


def tree(shape: tuple[int, int, int]) -> xr.DataTree:
    """Every type of variable that a dataset has, over cases of this shape, and a group with dimensions of its own."""
    rng, count = np.random.default_rng(1), int(np.prod(shape))
    numbers = rng.normal(size=shape)
    numbers.flat[0] = np.nan
    words = np.array([f"μ_i = {number % 7}" * (number % 3) for number in range(count)], object).reshape(shape)
    root = xr.Dataset(
        {
            "outcome": (DIMS, words, {"long_name": "how it ended"}),
            "plateau": (DIMS, numbers, {"units": "1", "flag_masks": [np.int32(1), np.int32(2)]}),
            "flags": (DIMS, rng.integers(0, 9, shape).astype(np.int32)),
            "empty": (DIMS[:1], np.full(shape[0], "", object)),
            "alone": ((), "a word"),
        },
        {
            "case_id": (DIMS, np.array([f"{number:012x}" for number in range(count)], object).reshape(shape)),
            "load": np.linspace(1.0, 2.0, shape[0]),
            "rows": (DIMS, np.arange(count).reshape(shape)),
            "start": (DIMS[:2], numbers[..., 0]),
            "pin": ((), "parabola"),
            "friction": ((), True),
            "scale": ((), 1.5),
        },
        {"nanoslip_format": 3, "title": "μ", "slab_width": 1e-3},
    )
    runs = xr.Dataset({"force": ("event", numbers.ravel()), "kind": ("event", np.zeros(count, np.int8))})
    labels = {"record": ("record", np.array(["parabola", "b"], object)), "radius": ("record", [1.0, 2.0])}
    return xr.DataTree.from_dict({"/": root, "runs": runs.assign_coords(labels)})


def by_xarray(given: xr.DataTree, path: Path) -> None:
    """What it writes where each variable is told apart: texts as characters, coordinates without missing values."""

    def encoding(variable: xr.Variable, coordinate: bool) -> dict[str, Any]:
        compressed = COMPRESSED if variable.size >= SMALLEST_COMPRESSED else {}
        if variable.dtype.kind in "OUT":
            return {"dtype": "S1", **compressed}
        return {**({"_FillValue": None} if coordinate and variable.dtype.kind == "f" else {}), **compressed}

    given.to_netcdf(
        path,
        engine="netcdf4",
        encoding={
            node.path: {
                str(name): encoding(each, name in node.coords)
                for name, each in node.to_dataset(inherit=False).variables.items()
            }
            for node in given.subtree
        },
    )


def declared(group: netCDF4.Dataset) -> Any:
    """All that a file says of a group but its values, in its order."""
    variables = [
        (name, each.dtype, each.dimensions, each.chunking(), each.filters(), repr(each.__dict__))
        for name, each in group.variables.items()
    ]
    sizes = [(name, len(each)) for name, each in group.dimensions.items()]
    return repr(group.__dict__), sizes, variables, [(name, declared(each)) for name, each in group.groups.items()]


def test_no_chunk_stays_in_memory_once_it_is_written(tmp_path):
    """netCDF keeps 64 MB of each variable until the file is closed. In a process of its own: no other memory is looked at."""
    script = f"""
import resource, sys
import numpy as np, xarray as xr
from nanoslip.study.dataset.file import write_tree
values = np.random.default_rng(1).normal(size=500_000)
peaks = []
for count in (2, 42):
    given = xr.Dataset({{f"x{{number}}": ("case", values) for number in range(count)}})
    write_tree(xr.DataTree(given), {str(tmp_path / "x.nc")!r})
    peaks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
print(1024 * (peaks[1] - peaks[0]))
"""
    more = int(subprocess.run([sys.executable, "-c", script], capture_output=True, check=True).stdout)
    assert more < 20e6  # of 40 variables of 4 MB


@pytest.mark.parametrize("shape", [(2, 2, 1), (9, 8, 11), (1, 40_000, 3)])  # plain, one chunk, several of the texts
def test_a_file_says_and_holds_what_xarray_would_have_it(tmp_path, shape):
    write_tree(tree(shape), tmp_path / "here.nc")
    by_xarray(tree(shape), tmp_path / "xarray.nc")
    with netCDF4.Dataset(tmp_path / "here.nc") as here, netCDF4.Dataset(tmp_path / "xarray.nc") as other:
        assert declared(here) == declared(other)
    with xr.open_datatree(tmp_path / "here.nc") as here, xr.open_datatree(tmp_path / "xarray.nc") as other:
        xr.testing.assert_identical(here.load(), other.load())


def test_texts_of_which_there_are_none_are_texts_still(tmp_path):
    """xarray itself would make numbers of them."""
    write_tree(xr.DataTree(xr.Dataset({"name": ("software", np.array([], object))})), tmp_path / "none.nc")
    with xr.open_dataset(tmp_path / "none.nc") as found:
        assert found["name"].dtype == object


def test_the_same_dataset_is_the_same_bytes(tmp_path):
    for name in ("one.nc", "two.nc"):
        write_tree(tree((9, 8, 11)), tmp_path / name)
    assert (tmp_path / "one.nc").read_bytes() == (tmp_path / "two.nc").read_bytes()


def test_the_characters_of_texts_are_never_all_in_memory(tmp_path):
    """A text that one case has takes its length of every case: 60 MB here, of which a chunk of at most 16 MiB is made."""
    texts = np.full(100_000, "", object)
    texts[7] = "x" * 600
    given = xr.DataTree.from_dict({"/": xr.Dataset({f"word{number}": ("case", texts) for number in range(3)})})
    tracemalloc.start()
    write_tree(given, tmp_path / "long.nc")
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 40e6  # a chunk, netCDF4's copy of it, and a little
