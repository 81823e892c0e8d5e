"""Friction over a load that changes has the slope and intercept that it was made with, within their ±."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from nanoslip.solver.outcome import InvalidInput
from nanoslip.study.measured.over_load import friction_over_load, has_changing_load
from nanoslip.study.measured.recording import Trace
from nanoslip.study.measured.trace import measure_trace
from tests.conftest import Main

SLOPE, INTERCEPT = 0.25, 0.6


def made(seed: int, rest: float = 1.0) -> tuple[NDArray[np.float64], ...]:
    """Time (s), load and force (N): at rest first, then a load from 0.5 to 30 N while the pin slides."""
    time = np.arange(0.0, 30.0, 0.05)
    load = np.maximum(0.5, time)
    force = np.where(time < rest, 0.0, INTERCEPT + SLOPE * load)
    return time, load, force + 0.05 * np.random.default_rng(seed).standard_normal(len(time))


def test_slope_and_intercept_hold_within_their_uncertainty() -> None:
    """2 ± in 19 of 20; of 60 numbers of 30 files, three standard deviations are 8 %."""
    held = []
    for seed in range(30):
        time, load, force = made(seed)
        found = measure_trace(Trace(time, force, "time", load=load)).numbers
        for name, truth in (("friction_slope", SLOPE), ("friction_intercept", INTERCEPT)):
            number = found[name]
            held.append(abs(number.value - truth) <= 2.0 * number.uncertainty)
            assert abs(number.value - truth) < 0.05 * truth
        assert found["load_correlation"].value > 0.99
    assert np.mean(held) > 0.85


def test_a_pin_at_rest_for_a_quarter_of_the_file_does_not_bend_the_line() -> None:
    _, load, force = made(1, rest=7.5)
    assert friction_over_load(load, force)["friction_slope"].value == pytest.approx(SLOPE, rel=0.02)


def test_a_load_that_wobbles_or_is_pressed_on_once_divides() -> None:
    time = np.arange(0.0, 30.0, 0.05)
    assert not has_changing_load(12.0 + 3.0 * np.sin(time))
    assert not has_changing_load(np.interp(time, [0.0, 1.0, 4.0, 25.0, 26.0], [0.0, 0.0, 12.0, 12.0, 0.0]))
    assert has_changing_load(made(0)[1])
    assert has_changing_load(-made(0)[1])


def test_strokes_under_a_load_that_changes_are_refused_with_its_range() -> None:
    time, load, force = made(2)
    with pytest.raises(InvalidInput, match=r"0\.5 to 29\.95 N"):
        measure_trace(Trace(time, force * np.sign(np.sin(time)), "time", load=load))


def test_the_command_states_and_draws_the_line(main: Main, tmp_path: Path) -> None:
    rows = ("{:.3f},{:.4f},{:.4f}".format(*row) for row in zip(*made(3), strict=True))
    file, picture = tmp_path / "lab.csv", tmp_path / "lab.png"
    file.write_text("\n".join(["Time [s],Fn [N],Ft [N]", *rows]))
    code, shown, errors = main("trace", file, "-o", picture)
    assert (code, errors) == (0, "")
    assert "friction_intercept" in shown
    assert picture.stat().st_size > 1000
