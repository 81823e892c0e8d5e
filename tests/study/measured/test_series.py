"""Several recordings are one table, and a line over their loads that has the numbers they were made with."""

import json
from pathlib import Path

import numpy as np
import pytest

from nanoslip.study.measured.means import Measured
from nanoslip.study.measured.over_load import friction_of_files, has_different_loads
from tests.conftest import Main

SLOPE, INTERCEPT = 0.25, 0.6
LOADS = (2.0, 5.0, 10.0, 20.0)


def written(folder: Path, load: float, seed: int, with_load: bool = True) -> Path:
    """A pull that slides steadily at INTERCEPT + SLOPE·load (N), with noise of 10 mN."""
    time = np.arange(0.0, 12.0, 0.02)
    level = INTERCEPT + SLOPE * load
    force = np.minimum(level * time / 2.0, level) + 0.01 * np.random.default_rng(seed).standard_normal(len(time))
    file = folder / f"{load:g}N_{seed}.csv"
    rows = [
        f"{at:.3f},{value:.5f},{load:.3f}" if with_load else f"{at:.3f},{value:.5f}"
        for at, value in zip(time, force, strict=True)
    ]
    header = "t [s],Ft [N],Fn [N]" if with_load else "t [s],F [N]"
    file.write_text("\n".join([header, *rows]))
    return file


def test_slope_and_intercept_of_a_series_hold_as_often_as_they_state() -> None:
    """68 % of 150 series of five files each, by three standard deviations of such a count."""
    random, loads = np.random.default_rng(1), [1.0, 2.0, 4.0, 8.0, 16.0]
    held = []
    for _ in range(150):
        forces = [Measured(INTERCEPT + SLOPE * load + 0.05 * random.standard_normal(), 0.01, 8, "N") for load in loads]
        found = friction_of_files(loads, forces)
        for name, truth in (("friction_slope", SLOPE), ("friction_intercept", INTERCEPT)):
            held.append(abs(found[name].value - truth) <= found[name].uncertainty)
    assert np.mean(held) == pytest.approx(0.683, abs=0.114)


def test_two_files_have_the_line_and_error_of_their_own() -> None:
    found = friction_of_files([1.0, 3.0], [Measured(1.0, 0.03, 8, "N"), Measured(2.0, 0.04, 8, "N")])
    assert found["friction_slope"][:2] == pytest.approx((0.5, 0.025))
    assert found["friction_intercept"][:2] == pytest.approx((0.5, 0.5 * np.hypot(3 * 0.03, 0.04)))


def test_equal_loads_are_no_line() -> None:
    assert not has_different_loads([5.0, 5.01, 4.99])
    assert not has_different_loads([5.0])
    assert has_different_loads([5.0, 6.0])


@pytest.mark.slow
@pytest.mark.parametrize("with_load", [True, False])
def test_files_of_different_loads_give_the_line_that_they_were_made_with(
    main: Main, tmp_path: Path, with_load: bool
) -> None:
    files = [written(tmp_path, load, seed, with_load) for seed, load in enumerate(LOADS)]
    loads = () if with_load else tuple(word for load in LOADS for word in ("--load", f"{load} N"))
    picture = tmp_path / "line.png"
    code, shown, _ = main("trace", *files, *loads, "-o", picture)
    assert code == 0
    assert all(file.name in shown for file in files)
    assert picture.read_bytes().startswith(b"\x89PNG")
    found = json.loads(main("trace", *files, *loads, "--json")[1])
    for name, truth in (("friction_slope", SLOPE), ("friction_intercept", INTERCEPT)):
        number = found[name]
        assert number["value"] == pytest.approx(truth, rel=0.02)
        assert abs(number["value"] - truth) < 4.0 * number["uncertainty"]
    assert found["load_correlation"]["value"] > 0.999
    assert found["files"][files[0].name]["load"] == pytest.approx(LOADS[0])


def test_files_of_one_load_have_their_mean(main: Main, tmp_path: Path) -> None:
    files = [written(tmp_path, 10.0, seed) for seed in range(4)]
    found = json.loads(main("trace", *files, "--json")[1])
    assert "friction_slope" not in found
    assert found["kinetic_friction"]["of"] == 4
    assert found["kinetic_friction"]["value"] == pytest.approx(SLOPE + INTERCEPT / 10.0, rel=2e-3)


def test_a_file_that_is_none_does_not_cost_the_others(main: Main, tmp_path: Path) -> None:
    bad = tmp_path / "bad.csv"
    bad.write_text("no numbers")
    code, shown, errors = main("trace", written(tmp_path, 5.0, 1), bad, written(tmp_path, 10.0, 2))
    assert code == 2
    assert "friction_slope" in shown
    assert "1 of 3 files" in errors
    assert "bad.csv" in errors


def test_what_belongs_to_one_file_is_refused_of_several(main: Main, tmp_path: Path) -> None:
    files = [written(tmp_path, load, 1) for load in (5.0, 10.0)]
    for words in (("--over", "smoke"), ("mu_i=0.5",), ("--load", "1 N", "--load", "2 N", "--load", "3 N")):
        code, _, errors = main("trace", *files, *words)
        assert code == 2
        assert "needs one" in errors
