"""Events of a measured force: each fall that was put into a record is found, with its size, time, recurrence and stiffness."""

import csv
import json
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from nanoslip.solver.sliding.sizes import size_distribution
from nanoslip.study.measured.events import event_numbers, find_events
from nanoslip.study.measured.recording import Trace
from tests.conftest import Main

Floats = NDArray[np.float64]
RATE, APART, NOISE = 0.5, 0.01, 2e-4
"""Rise of the force (N/s), time between samples (s), and standard deviation of noise (N)."""


def drops_of_power_law(count: int, exponent: float, smallest: float, seed: int) -> Floats:
    """Independent sizes whose density is a power law from the smallest on."""
    uniform = np.random.default_rng(seed).random(count)
    return smallest * (1.0 - uniform) ** (-1.0 / (exponent - 1.0))


def record(drops: Floats, waits: Floats, seed: int = 1) -> tuple[Trace, Floats]:
    """A force that rises at RATE and falls by each drop after each wait; and the times of the falls."""
    falls = np.cumsum(waits)
    time = np.arange(0.0, falls[-1] + 2.0, APART)
    fallen = np.concatenate(([0.0], np.cumsum(drops)))
    force = 1000.0 + RATE * time - fallen[np.searchsorted(falls, time)]
    noisy = force + NOISE * np.random.default_rng(seed).standard_normal(len(time))
    return Trace(time, noisy, "time"), falls


def test_each_fall_has_its_time_size_recurrence_and_stiffness() -> None:
    random = np.random.default_rng(3)
    drops, waits = random.uniform(0.05, 0.5, 60), random.uniform(0.3, 2.0, 60)
    trace, falls = record(drops, waits)
    found = find_events(trace)
    assert len(found.drop) == 60
    np.testing.assert_allclose(found.at, falls, atol=2.0 * APART)
    # A fall ends between two samples, while the force goes on to rise; two ends of lines of eight samples have 0.9 of the noise.
    np.testing.assert_allclose(found.drop, drops, atol=RATE * APART + 5.0 * NOISE)
    np.testing.assert_allclose(found.recurrence[1:], waits[1:], atol=2.0 * APART)
    np.testing.assert_array_equal(found.step[:-1], found.recurrence[1:])
    assert math.isnan(found.recurrence[0])
    assert math.isnan(found.step[-1])
    np.testing.assert_allclose(found.rise, RATE, rtol=0.05)


def test_noise_alone_has_no_event_and_ringing_after_a_fall_is_none() -> None:
    """A cell that rings at 5 Hz rises faster than the stage pulls."""
    trace, _ = record(np.array([0.3] * 12), np.array([2.0] * 12))
    quiet = Trace(trace.at, RATE * trace.at + NOISE * np.random.default_rng(1).standard_normal(len(trace.at)), "time")
    assert len(find_events(quiet).drop) == 0
    since = trace.at % 2.0
    rung = 0.1 * np.exp(-3.0 * since) * np.sin(10.0 * np.pi * since) * (trace.at > 2.0)
    found = find_events(Trace(trace.at, trace.force - rung, "time"))
    assert len(found.drop) == 12
    np.testing.assert_allclose(found.recurrence[1:], 2.0, atol=0.2)


def test_strokes_to_and_fro_have_events_of_both_signs_and_no_recurrence_over_a_turn() -> None:
    at = np.arange(0.0, 40.0, APART)
    teeth = 2.0 + 0.3 * (at % 1.0)
    way = np.where(at % 20.0 < 10.0, 1.0, -1.0)
    force = way * teeth + NOISE * np.random.default_rng(2).standard_normal(len(at))
    found = find_events(Trace(at, force, "time"))
    assert len(found.drop) == pytest.approx(36, abs=4)
    np.testing.assert_allclose(found.drop, 0.3, atol=0.01)
    assert np.isnan(found.recurrence).sum() == 4
    assert np.nanmax(found.recurrence) < 1.5


def test_a_power_law_of_drops_is_found_as_that_of_a_computed_record() -> None:
    """The exponent of the drops that were put in, by the same function, and within 3 ± of the truth."""
    drops = drops_of_power_law(600, 2.5, 0.2, 5)
    waits = np.random.default_rng(7).uniform(0.3, 2.0, 600)
    trace, _ = record(drops, waits)
    numbers = event_numbers([find_events(trace)], "N", "time")
    assert numbers["sized_events"].value == 600
    exact = size_distribution(*np.array_split(drops, 8), discrete=False, draws=0)
    exponent = numbers["drop_exponent"]
    assert exponent.value == pytest.approx(exact.exponent, abs=exact.exponent_uncertainty)
    assert abs(exponent.value - 2.5) < 3.0 * exponent.uncertainty
    for name in ("drop_correlation", "step_correlation", "drop_step_correlation"):
        assert abs(numbers[name].value) < 4.0 * numbers[name].uncertainty


def test_a_drop_that_decides_the_next_wait_is_correlated_with_it() -> None:
    """Force is made up before the next slip: a slip-predictable record."""
    drops = np.random.default_rng(4).uniform(0.1, 0.5, 80)
    waits = np.concatenate(([1.0], drops[:-1] / RATE))
    numbers = event_numbers([find_events(record(drops, waits)[0])], "N", "time")
    assert numbers["drop_step_correlation"].value > 0.95
    assert abs(numbers["drop_correlation"].value) < 4.0 * numbers["drop_correlation"].uncertainty


def test_the_command_writes_events_of_all_files_and_prints_their_distributions(main: Main, tmp_path: Path) -> None:
    drops = np.full(8, 0.3)
    for name, seed in (("a", 1), ("b", 2)):
        trace, _ = record(drops, np.full(8, 1.0), seed)
        rows = "\n".join(f"{at:.3f},{force:.6f}" for at, force in zip(trace.at, trace.force, strict=True))
        (tmp_path / f"{name}.csv").write_text(f"t [s],F [N]\n{rows}\n")
    table = tmp_path / "events.csv"
    given = ("--load", "200 N", "--velocity", "2 mm/s", "--events", table)
    code, shown, _ = main("trace", tmp_path / "a.csv", *given)
    assert code == 0
    assert "sized_events" in shown
    with table.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 8
    assert float(rows[3]["drop"]) == pytest.approx(0.3 / 200.0, rel=0.05)
    assert float(rows[3]["stiffness [N/m]"]) == pytest.approx(RATE / 2e-3, rel=0.05)
    assert float(rows[3]["recurrence [s]"]) == pytest.approx(1.0, abs=0.03)
    code, shown, _ = main("trace", tmp_path / "a.csv", tmp_path / "b.csv", "--json", *given)
    assert code == 0
    assert json.loads(shown)["events"]["sized_events"]["value"] == 16
    with table.open(newline="") as file:
        assert {row["file"] for row in csv.DictReader(file)} == {"a.csv", "b.csv"}
