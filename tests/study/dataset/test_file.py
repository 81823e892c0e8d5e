"""A file gives back what was written, as xarray itself would write it; what it cannot give is one clear message."""

import copy
import errno
import os
import subprocess
import sys
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr

from nanoslip.study.api import run
from nanoslip.study.dataset import file
from nanoslip.study.dataset.file import (
    SMALLEST_COMPRESSED,
    carrying,
    flatten_variables,
    load_dataset,
    make_tree,
    open_groups,
    read_groups,
    write_tree,
)
from nanoslip.study.dataset.texts import text_array
from nanoslip.study.results.store import StoreError
from tests.conftest import Main
from tests.study.dataset.campaigns import FULL
from tests.study.results.results import NO_FILES


def made(size: int) -> xr.Dataset:
    root = xr.Dataset({"word": ("case", ["", "μ_i = 0.5"])}, {"case": [0, 1], "case_id": ("case", ["x", "y"])}, HERE)
    sample = np.random.default_rng(1).normal(size=size)
    sample[0] = np.nan
    return carrying(
        root, {"runs": xr.Dataset({"force": ("event", sample), "kind": ("event", np.zeros(size, np.int8))})}
    )


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
        file.write_netcdf(made(1), tmp_path / "one.nc")
    assert list(tmp_path.iterdir()) == []


@NO_FILES
def test_what_is_no_file_is_refused_and_nobody_waits_for_it(tmp_path, no_file):
    no_file(tmp_path / "one.nc")
    with pytest.raises(StoreError, match=r"one\.nc: .*regular file"):
        file.open_dataset(tmp_path / "one.nc")


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


@pytest.mark.slow
def test_no_chunk_stays_in_memory_once_it_is_written(tmp_path):
    """netCDF keeps 64 MB of each variable until the file is closed. In a process of its own: no other memory is looked at."""
    script = f"""
import resource, sys
import numpy as np, xarray as xr
from nanoslip.study.dataset.file import write_tree
values = np.random.default_rng(1).normal(size=200_000)
peaks = []
for count in (2, 42):
    given = xr.Dataset({{f"x{{number}}": ("case", values) for number in range(count)}})
    write_tree(xr.DataTree(given), {str(tmp_path / "x.nc")!r})
    peaks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
print(1024 * (peaks[1] - peaks[0]))
"""
    more = int(subprocess.run([sys.executable, "-c", script], capture_output=True, check=True).stdout)
    assert more < 16e6  # of 40 variables of 1.6 MB


@pytest.mark.parametrize("shape", [(2, 2, 1), (9, 8, 11), (1, 40_000, 3)])  # plain, one chunk, several of the texts
def test_a_file_holds_what_was_written(tmp_path, shape):
    """Texts over dimensions as numbers, others as characters; coordinates without missing values, long variables compressed."""
    given = tree(shape)
    write_tree(given, tmp_path / "here.nc")
    with xr.open_datatree(tmp_path / "here.nc") as found:
        for node in found.subtree:
            for name, each in node.to_dataset(inherit=False).variables.items():
                assert bool(each.encoding["zlib"]) == (each.size >= SMALLEST_COMPRESSED)
                assert each.encoding["dtype"] == "S1" or each.dtype.kind != "O"
                assert each.encoding["dtype"] != "S1" or node.path != "/" or each.ndim < 2
                assert "_FillValue" not in each.encoding or name not in node.coords
        root, groups = open_groups(tmp_path / "here.nc")
        assert set(groups) == {"runs"}
        for path, group in {"/": root, **groups}.items():
            xr.testing.assert_identical(group.load(), given[path].to_dataset(inherit=False))
        root.close()


def netcdf_content(path: Path) -> dict[str, object]:
    """All that a file holds as the library of the format gives it, without any decoding."""
    content: dict[str, object] = {}
    with netCDF4.Dataset(path) as opened:
        for group in (opened, *opened.groups.values()):
            group.set_auto_maskandscale(False)
            group.set_auto_chartostring(False)
            content[group.path] = {name: group.getncattr(name) for name in group.ncattrs()}
            for name, variable in group.variables.items():
                attributes = {key: repr(variable.getncattr(key)) for key in variable.ncattrs()}
                settings = (variable.filters(), variable.chunking(), attributes)
                sizes = dict(zip(variable.dimensions, variable.shape, strict=True))
                content[f"{group.path}/{name}"] = (variable.dtype, sizes, settings, variable[...].tobytes())
    return content


def xarray_settings(variable: xr.Variable, is_coordinate: bool) -> dict[str, object]:
    """What xarray is to be told of a variable to write it as nanoslip does."""
    settings: dict[str, object] = {}
    if variable.size >= SMALLEST_COMPRESSED:
        settings = {"zlib": True, "complevel": 1, "shuffle": True}
    if variable.dtype.kind in "OUT":
        settings["dtype"] = "S1"
    elif is_coordinate and variable.dtype.kind == "f":
        settings["_FillValue"] = None
    return settings


def empty_tree() -> xr.DataTree:
    """A root without a case and a group without a run."""
    root = xr.Dataset({"size": ("case", np.zeros(0))}, {"case": np.zeros(0), "rows": ("case", np.zeros(0, int))})
    runs = xr.Dataset({"force": ("event", np.zeros(0))}, {"owner": ("record", np.zeros(0, int))})
    return xr.DataTree.from_dict({"/": root, "runs": runs})


@pytest.mark.parametrize("given", [tree((2, 2, 1)), tree((9, 8, 11)), empty_tree()], ids=["small", "large", "empty"])
def test_a_file_is_the_one_that_xarray_itself_writes(tmp_path, given):
    """Names, types, dimensions, attributes, compression and values, down to the order of coordinates in their lists."""
    write_tree(given, tmp_path / "here.nc")
    for place, group in xr.open_groups(tmp_path / "here.nc").items():
        settings = {name: xarray_settings(value, name in group.coords) for name, value in group.variables.items()}
        with group:
            group.load().drop_encoding().to_netcdf(tmp_path / "there.nc", "a", group=place, encoding=settings)
    assert netcdf_content(tmp_path / "here.nc") == netcdf_content(tmp_path / "there.nc")


def grouped() -> xr.Dataset:
    """A root of two cases with one group."""
    root = xr.Dataset({"a": ("case", [1.0, 2.0])}, {"case": [0, 1], "case_id": ("case", ["x", "y"])})
    root.attrs |= HERE
    return carrying(root, {"runs": xr.Dataset({"row_size": ("record", [3])}, {"record": ["r"]})})


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
    root = grouped()
    assert read_groups(change(root)) is read_groups(root)


def test_a_file_gives_root_and_groups_until_it_is_closed(tmp_path):
    file.write_netcdf(grouped(), tmp_path / "one.nc")
    root, groups = open_groups(tmp_path / "one.nc")
    assert set(groups) == {"runs"}
    assert flatten_variables(carrying(root, groups)).keys() == {"a", "case", "case_id", "runs/row_size", "runs/record"}
    whole = make_tree(load_dataset(root)).load()
    root.close()
    (tmp_path / "one.nc").unlink()
    assert whole["runs"]["row_size"].item() == 3


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Root and groups, each a file of its own: the checker of groups knows of groups with a dimension `time` only."""
    found = run(FULL)
    folder = tmp_path_factory.mktemp("parts")
    facts = {name: found.attrs[name] for name in ("Conventions", "title", "history")}
    for name, part in {"root": found, **read_groups(found)}.items():
        whole = part if name == "root" else part.assign_attrs(facts)
        file.write_netcdf(carrying(whole.copy(), {}), folder / f"{name}.nc")
    return sorted(folder.iterdir())


@pytest.mark.slow  # 8 s for the checker's own imports
def test_root_and_groups_pass_the_checker_of_cf_1_11(parts: list[Path]) -> None:
    """Its command: what it imports warns, and a warning is an error here."""
    words = [str(Path(sys.executable).with_name("compliance-checker")), "--test", "cf:1.11", *map(str, parts)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert len(parts) == 6
    assert done.stdout.count("All tests passed!") == len(parts), done.stdout + done.stderr
    assert done.returncode == 0
    assert "exceptions occurred" not in done.stdout + done.stderr


HERE = {file.FORMAT: file.VERSION, "title": "Made"}


def test_texts_that_are_all_empty_or_none_at_all_are_kept_and_can_be_turned_about(tmp_path):
    """As a map of words over two axes needs it."""
    words = {
        "empty": ("b", np.array(["", "", ""], object)),
        "word": (("a", "b"), np.array([["x", "yy", ""]] * 2, object)),
    }
    none = xr.Dataset({"name": ("software", text_array([]))})
    file.write_netcdf(
        carrying(xr.Dataset(words, {"case_id": ("a", ["p", "q"]), "a": [0, 1]}, HERE), {"software": none}),
        tmp_path / "one.nc",
    )
    with file.open_dataset(tmp_path / "one.nc") as again:
        assert again["empty"].values.tolist() == ["", "", ""]
        assert read_groups(again)["software"]["name"].dtype == object
        assert read_groups(again)["software"].sizes["software"] == 0
        assert again["word"].transpose("b", "a").values.tolist() == [["x", "x"], ["yy", "yy"], ["", ""]]


@pytest.mark.parametrize(
    ("has", "said"),
    [
        ({file.FORMAT: 4}, "has format 4, of an older nanoslip; this one reads format 5: nanoslip run writes it"),
        ({file.FORMAT: 6}, "has format 6, of a newer nanoslip; this one reads format 5: read it with that one"),
        (
            {file.FORMAT: 99, "nanoslip_version": "9.1"},
            r"has format 99, of a newer nanoslip \(its results are by 9.1\); this one",
        ),
        ({}, "no dataset of nanoslip: it has no attribute nanoslip_format"),
        *(({file.FORMAT: other}, "no dataset of nanoslip") for other in ("3", [3, 3], 3.5)),
    ],
)
def test_a_file_of_another_format_is_refused_with_what_reads_it(tmp_path, has, said):
    xr.Dataset({"a": 1.0}, attrs=has).to_netcdf(tmp_path / "old.nc")
    with pytest.raises(StoreError, match=rf"old\.nc: {said}"):
        file.open_dataset(tmp_path / "old.nc")


@pytest.mark.slow
def test_a_disk_that_is_full_while_a_dataset_is_written_is_named(tmp_path: Path, environment: dict[str, str]) -> None:
    """netCDF alone reports an `HDF error`. A limit of this process stands for the disk's."""
    program = (
        "import resource, signal, sys, numpy as np, xarray as xr\n"
        "from pathlib import Path\n"
        "from nanoslip.study.dataset import file\n"
        "data = file.carrying(xr.Dataset({'a': ('x', np.random.default_rng(1).random(10**6))}), {})\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (10**6, 10**6))\n"
        "try:\n    file.write_netcdf(data, Path(sys.argv[1]))\nexcept file.StoreError as error:\n    print(error)\n"
    )
    words = [sys.executable, "-c", program, str(tmp_path / "results.nc")]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=100, check=False)
    assert done.stdout.endswith("results.nc: cannot be written: File too large\n"), done.stderr
    assert not list(tmp_path.iterdir())


def test_collect_does_not_replace_a_dataset_of_another_format(main: Main, campaign: Path, tmp_path: Path):
    """Its results may not be read any more, so that it could not be made again."""
    path = tmp_path / file.FILE
    xr.Dataset({"a": 1.0}, attrs={file.FORMAT: 3}).to_netcdf(path)
    whole = path.read_bytes()
    code, _, errors = main("collect", campaign, "--out", tmp_path)
    assert (code, "another format" in errors, path.read_bytes() == whole) == (2, True, True)
    assert main("collect", campaign, "--out", tmp_path, "--replace")[0] == 0


@pytest.mark.parametrize(
    "content", [b"", b"nonsense", b"\x89HDF\r\n\x1a\n" + bytes(200)], ids=["empty", "text", "stub"]
)
def test_another_file_is_refused_by_name(tmp_path, content):
    (tmp_path / "other.nc").write_bytes(content)
    with pytest.raises(StoreError, match=r"other\.nc"):
        file.open_dataset(tmp_path / "other.nc")


@pytest.mark.parametrize("encoding", [float("nan"), "no-such"])
def test_texts_in_no_encoding_are_refused_by_name(tmp_path, encoding):
    with netCDF4.Dataset(tmp_path / "other.nc", "w") as other:
        other.createDimension("case", 2)
        other.createDimension("letter", 4)
        names = other.createVariable("name", "S1", ("case", "letter"))
        names[:] = np.full((2, 4), b"a", "S1")
        names.setncattr("_Encoding", encoding)
    with pytest.raises(StoreError, match=r"other\.nc"):
        file.open_dataset(tmp_path / "other.nc")


def test_a_file_with_texts_beyond_all_memory_is_refused_by_name(tmp_path):
    with netCDF4.Dataset(tmp_path / "other.nc", "w") as other:
        other.createDimension("case", 2**44)
        other.createVariable("case", "f8", ("case",), zlib=True)
    with pytest.raises(StoreError, match=r"other\.nc"):
        file.open_dataset(tmp_path / "other.nc")


def damaged(dataset: xr.Dataset, path: Path) -> Path:
    """The file of a dataset with zeros in the middle, of its one long column."""
    file.write_netcdf(dataset, path)
    whole = path.read_bytes()
    middle = len(whole) // 2
    path.write_bytes(whole[:middle] + bytes(256) + whole[middle + 256 :])
    return path


def test_damage_to_a_file_too_large_to_be_checked_is_refused_when_it_is_read(tmp_path, monkeypatch):
    """Of numbers not when the file is opened: a compressed column is unpacked when somebody asks for it; of texts at once."""
    monkeypatch.setattr(file, "MOST_CHECKED", 0)
    path = damaged(made(65_536), tmp_path / "one.nc")
    with pytest.raises(StoreError, match=r"one\.nc: .*nanoslip collect"), file.reading(path) as again:
        read_groups(again)["runs"]["force"].load()
    words = np.array([str(number) * 9 for number in np.random.default_rng(1).random(4096)], object)
    path = damaged(carrying(xr.Dataset({"word": ("case", words)}, attrs=HERE), {}), tmp_path / "two.nc")
    with pytest.raises(StoreError, match=r"two\.nc: "):
        file.open_dataset(path)


@pytest.mark.parametrize("kind", [errno.EPIPE, errno.ENOSPC])
def test_a_pipe_that_is_closed_or_a_full_disk_is_no_damage_to_what_is_read(tmp_path, kind):
    file.write_netcdf(grouped(), tmp_path / "one.nc")
    with pytest.raises(OSError, match=os.strerror(kind)), file.reading(tmp_path / "one.nc"):
        raise OSError(kind, os.strerror(kind))


def test_a_file_may_be_open_several_times_and_closed_in_any_order(tmp_path):
    """Strings of variable length would break netCDF down here."""
    file.write_netcdf(grouped(), tmp_path / "one.nc")
    kept = file.open_dataset(tmp_path / "one.nc")
    for _ in range(30):
        with file.open_dataset(tmp_path / "one.nc") as again:
            assert read_groups(again)["runs"]["record"].values.tolist() == ["r"]
            assert again["case_id"].values.tolist() == ["x", "y"]
    np.testing.assert_array_equal(kept["a"], [1.0, 2.0])
