"""Two campaigns are compared case by case: exit code 0 within uncertainties, 1 beyond, 2 where there is nothing to compare."""

import shutil

import netCDF4
import pytest

from nanoslip.study.dataset import file
from nanoslip.study.dataset.file import loaded
from tests.conftest import SMALL, compute


def change(path, name, factor):
    with netCDF4.Dataset(path / "results.nc", "a") as opened:
        opened.set_auto_mask(False)
        opened[name][:] = opened[name][:] * factor


def test_a_dataset_is_the_same_as_itself_whatever_it_is_named_by(main, campaign, finished, tmp_path, monkeypatch):
    small = finished
    code, said, _ = main("compare", small, small / "results.nc")
    assert code == 0
    assert "same parameters, campaign and software" in said
    assert "cases in both: 4\ndrives of cases in both: 8\n" in said
    assert ", 0 within uncertainties (2 combined standard deviations), 0 beyond" in said
    monkeypatch.chdir(tmp_path)
    assert main("compare", campaign, small)[0] == 2  # there is no folder results/small here
    small.rename(tmp_path / "results").rename(tmp_path / "kept")
    (tmp_path / "results").mkdir()
    kept = (tmp_path / "kept").rename(tmp_path / "results" / "small")
    assert main("compare", campaign, kept)[0] == 0


THREE = SMALL.replace("members = 1", "members = 3")
"""± needs members."""


@pytest.fixture(scope="module")
def three(tmp_path_factory):
    """A folder with the dataset of the small campaign over three members: not to be changed."""
    return compute(tmp_path_factory.mktemp("three"), THREE)


def test_a_finer_surface_differs_and_the_largest_differences_come_first(main, three, tmp_path):
    small, finer = three, tmp_path / "finer.toml"
    finer.write_text(THREE.replace("n_x = 17", "n_x = 33").replace("[50.0, 100.0]", "[50.0, 200.0]"))
    assert main("run", finer, "--out", tmp_path / "finer", "--serial")[0] == 0
    code, said, _ = main("compare", small, tmp_path / "finer")
    lines = [line.split() for line in said.splitlines()]
    assert ["n_x", "17", "33"] in lines
    assert ["radius", "50.0,", "100.0", "50.0,", "200.0"] in lines
    assert "cases in A alone: 2, first μ_i = 0.25, R/L_x = 100" in said
    verdicts = [word for line in lines for word in line if word in ("beyond", "within")]
    assert verdicts.index("beyond") == 0
    assert code == 1


def test_what_is_within_uncertainties_is_exit_code_0(main, three, tmp_path):
    small, other = three, tmp_path / "other"
    other.mkdir()
    (other / "results.nc").write_bytes((small / "results.nc").read_bytes())
    change(other, "plateau_mean", 1.0 + 1e-6)
    code, said, _ = main("compare", small, other)
    assert (code, "within" in said, "plateau_mean" in said) == (0, True, True)
    change(other, "plateau_mean", 2.0)
    code, said, _ = main("compare", small, other)
    assert (code, "beyond" in said) == (1, True)


def test_words_of_members_are_told_in_short_unless_the_difference_hides_behind_the_most_frequent_one(
    main, three, tmp_path
):
    one, other = tmp_path / "one", tmp_path / "other"
    for out in (one, other):
        out.mkdir()
        shutil.copy(three / "results.nc", out)
    write_regimes(one, "2 sticks; 1 stick_slip; 1 micro_slip")
    write_regimes(other, "2 sticks; 1 slides; 1 micro_slip")
    said = main("compare", one, other)[1]
    assert "2 sticks; 1 stick_slip; 1 micro_slip  2 sticks; 1 slides; 1 micro_slip" in said
    write_regimes(other, "2 stick_slip; 1 sticks; 1 micro_slip")
    said = main("compare", one, other)[1]
    assert "2 sticks; 2 others" in said
    assert "2 stick_slip; 2 others" in said


def write_regimes(out, words):
    with file.read(out / file.FILE) as found:
        changed = loaded(found)
    changed["regime"].values[...] = words
    file.write(changed, out / file.FILE)


def test_what_cannot_be_compared_is_one_clear_message(main, campaign, finished, tmp_path):
    small = finished
    other = tmp_path / "other.toml"
    other.write_text(SMALL.replace("[50.0, 100.0]", "[200.0, 300.0]"))
    assert main("run", other, "--out", tmp_path / "other", "--serial")[0] == 0
    empty = tmp_path / "empty"
    assert main("collect", campaign, "--out", empty)[0] == 0
    for words, wanted in (
        ((small, tmp_path / "other"), "share no computed case"),
        ((small, empty), "share no computed case"),
        ((small, tmp_path / "none.nc"), "no dataset"),
        ((small, campaign.parent), "No such file"),
    ):
        code, _, errors = main("compare", *words)
        assert (code, len(errors.splitlines())) == (2, 1), errors
        assert wanted in errors
