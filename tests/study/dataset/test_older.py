"""Datasets of format 3 are read, and whoever meets their ± is told what it was; what cannot be done with them is one message."""

import lzma
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from nanoslip.study import api
from nanoslip.study.dataset import file
from nanoslip.study.dataset.concatenation import NotJoinableError
from nanoslip.study.dataset.file import groups_of
from tests.conftest import Main, compute

DATA = Path(__file__).parent / "data"
KEPT = ("format_3", "format_3_ensemble")
"""Datasets that nanoslip 0.2.0 wrote, xz behind them: of one start, of three. Each has its manifest as an attribute."""
MODEL = "is a model of what one start does not know"


@pytest.fixture(params=KEPT)
def older(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    return unpacked(request.param, tmp_path)


def unpacked(name: str, folder: Path) -> Path:
    """A kept file, byte for byte."""
    path = folder / f"{name}.nc"
    path.write_bytes(lzma.decompress((DATA / f"{name}.nc.xz").read_bytes()))
    return path


@pytest.fixture(scope="module")
def today(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Kept file -> the folder of the same campaign, computed today."""
    found = {}
    for name in KEPT:
        folder = tmp_path_factory.mktemp(name)
        with xr.open_dataset(unpacked(name, folder)) as kept:
            found[name] = compute(folder, kept.attrs["manifest"])
    return found


def test_an_older_dataset_opens_with_the_values_that_are_in_its_file(older: Path) -> None:
    with xr.open_datatree(older) as kept, api.open_dataset(older) as found:
        assert found.attrs == kept.attrs
        there = {{"plateau_uncertainty": "plateau_mean_uncertainty"}.get(name, name): name for name in kept.variables}
        assert set(there) == set(found.variables)
        for name, theirs in there.items():
            np.testing.assert_array_equal(found[name].values, kept[theirs].values, strict=True)
        assert set(groups_of(found)) == set(kept.children)
        assert found["plateau_mean"].attrs["ancillary_variables"] in found
        assert found.nanoslip.tree.attrs == kept.attrs


def test_compare_says_whose_plus_minus_is_a_model_and_judges_by_both(
    main: Main, older: Path, today: dict[str, Path]
) -> None:
    new = today[older.stem]
    code, said, errors = main("compare", older, new)
    assert (code in (0, 1), errors) == (True, "")
    assert said.count(f"± of A (format 3) {MODEL}, that of B (format 4) the 68 % interval over independent starts") == 1
    assert "\ncases in both: 2\n" in said
    assert "\ndrives of cases in both: 2\n" in said
    assert "alone" not in said
    with api.open_dataset(older) as one, api.open_dataset(new) as other:
        mean, error = "plateau_mean", "plateau_mean_uncertainty"
        if "member" in one.dims:
            mean, error = "plateau_mean_ensemble_mean", "plateau_mean_ensemble_uncertainty"
        apart = abs(one[mean] - other["plateau_mean"]) / np.hypot(one[error], other["plateau_mean_uncertainty"])
        told = [float(line.split()[4]) for line in said.splitlines() if line.startswith("plateau_mean ")]
        assert told[0] == pytest.approx(float(apart.max()), rel=0.06)  # two digits, the largest first


def test_compare_of_two_older_datasets_says_so_of_both_and_of_none_of_today(
    main: Main, older: Path, today: dict[str, Path]
) -> None:
    new = today[older.stem]
    assert f"± of B (format 3) {MODEL}, that of A (format 4)" in main("compare", new, older)[1]
    code, said, _ = main("compare", older, older)
    assert (code, said.count(f"± of A (format 3) and B (format 3) {MODEL}")) == (0, 1)
    assert ", 0 within uncertainties (2 combined standard deviations), 0 beyond" in said
    assert "±" not in main("compare", new, new)[1]


def test_an_older_ensemble_is_compared_as_the_mean_of_its_members(
    main: Main, tmp_path: Path, today: dict[str, Path]
) -> None:
    path = unpacked(KEPT[1], tmp_path)
    said = main("compare", path, today[KEPT[1]])[1]
    with api.open_dataset(path) as found:
        means = found["peak_friction"].mean("member").values.ravel()
    rows = [line.split() for line in said.splitlines() if line.startswith("peak_friction ")]
    assert sorted(float(row[1]) for row in rows) == pytest.approx(sorted(means), rel=1e-5)
    assert "2 completed; 1 no_plateau" in said


def test_a_case_of_an_older_dataset_is_shown_with_what_its_plus_minus_is(main: Main, older: Path) -> None:
    code, said, _ = main("show", older, "intrinsic_friction=0.5", "start=0.0")
    assert (code, said.count(f"± {MODEL} (format 3)\n")) == (0, 1)
    (line,) = (each for each in said.splitlines() if each.startswith("plateau_mean "))
    assert "0.338 ± 0.018" in line


def test_the_cases_of_an_older_dataset_are_exported(main: Main, older: Path) -> None:
    code, said, errors = main("export", older, "--csv")
    names, _, *rows = said.splitlines()
    assert (code, errors, len(rows)) == (0, "", 6 if "ensemble" in older.name else 2)
    assert "plateau_mean_uncertainty" in names.split(",")


def test_verify_names_the_nanoslip_that_can_compute_it_again(main: Main, older: Path) -> None:
    code, said, errors = main("verify", older)
    assert (code, said, len(errors.splitlines())) == (2, "", 1)
    assert f"{older}: has format 3, whose numbers this nanoslip does not compute again: needs the one" in errors
    assert "nanoslip 0.2.0, commit 5bca0e454b" in errors


def test_older_datasets_are_joined_with_each_other_and_not_with_those_of_today(
    older: Path, today: dict[str, Path]
) -> None:
    with api.open_dataset(older) as found:
        parts = [found.isel(intrinsic_friction=[at]) for at in range(2)]
        xr.testing.assert_equal(api.concat(parts)["plateau_mean"], found["plateau_mean"])
    with pytest.raises(
        NotJoinableError, match=rf"format 4, .*{older.name} format 3: needs one, as ± means something else"
    ):
        api.concat([older, today[older.stem]])


def test_collect_does_not_replace_an_older_dataset_by_one_without_results(main: Main, tmp_path: Path) -> None:
    """Its results are not read any more, so it could not be made again."""
    path = unpacked(KEPT[0], tmp_path).rename(tmp_path / file.FILE)
    campaign, whole = tmp_path / "campaign.toml", path.read_bytes()
    with xr.open_dataset(path) as kept:
        campaign.write_text(kept.attrs["manifest"])
    code, _, errors = main("collect", campaign, "--out", tmp_path)
    assert (code, "not replaced: has 2 finished cases" in errors, path.read_bytes() == whole) == (2, True, True)
