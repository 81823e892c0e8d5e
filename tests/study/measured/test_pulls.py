"""One pull from rest to rest gives its friction, whatever is before and after it in the file."""

import math
from itertools import product

import numpy as np
import pytest
import scipy
from numpy.typing import NDArray

from nanoslip.study.commands.trace import SENTENCES
from nanoslip.study.measured.recording import Trace
from nanoslip.study.measured.trace import FRICTIONS, TraceNumbers, measure_trace

Floats = NDArray[np.float64]
LOAD, STATIC, KINETIC = 20.0, 0.30, 0.25


def pull(time: Floats, start: float, static: float = STATIC, rate: float = 6.0) -> Floats:
    """Force (N) of a stage that begins to pull at `start`: a ramp, a break within 0.1 s, and steady sliding."""
    ramp = rate * np.clip(time - start, 0.0, None)
    breaks = start + static * LOAD / rate
    slides = LOAD * (KINETIC + (static - KINETIC) * np.exp(-np.clip(time - breaks, 0.0, None) / 0.05))
    return np.where(time < breaks, ramp, slides)


def noisy(force: Floats, noise: Floats | float, seed: int) -> Floats:
    return force + noise * np.random.default_rng(seed).standard_normal(len(force))


def measured(time: Floats, force: Floats) -> TraceNumbers:
    return measure_trace(Trace(time, force, "time"), LOAD)


def test_a_quiet_start_makes_no_stick_slip_out_of_the_noise_of_sliding() -> None:
    """36 files with four seconds of rest, whose noise grows up to ten times where the pin slides."""
    held: list[bool] = []
    for seed, (level, _) in enumerate(product((0.02, 0.05, 0.1), range(12))):
        time = np.arange(0.0, 13.0, 0.02)
        force = noisy(pull(time, 4.0), np.where(time < 4.0, 0.01, level), seed)
        found = measured(time, force).numbers
        assert "stick_slip_period" not in found
        two_samples = 2.0 * 6.0 * 0.02
        assert found["static_friction"].value == pytest.approx(STATIC, abs=(2.0 * level + two_samples) / LOAD)
        for name, truth in (("static_friction", STATIC), ("kinetic_friction", KINETIC)):
            held.append(abs(found[name].value - truth) <= 2.0 * found[name].uncertainty)
    assert np.mean(held) > 0.84  # of 93 %, by three standard deviations of 72


def test_a_ramp_without_a_peak_has_no_static_friction() -> None:
    time = np.arange(0.0, 13.0, 0.02)
    for seed in range(12):
        found = measured(time, noisy(pull(time, 4.0, static=KINETIC), 0.1, seed)).numbers
        assert "static_friction" not in found
        assert found["kinetic_friction"].value == pytest.approx(
            KINETIC, abs=4.0 * found["kinetic_friction"].uncertainty
        )


@pytest.mark.parametrize("rest", [1.0, 4.0, 30.0])
@pytest.mark.parametrize("static", [STATIC, KINETIC])
@pytest.mark.parametrize("left", [0.0, 0.02])
def test_steady_sliding_before_the_pin_is_lifted_has_its_friction(rest: float, static: float, left: float) -> None:
    """However short the rest after it is, and if the sensor rests a little beside zero."""
    time = np.arange(0.0, 12.0 + rest, 0.02)
    force = np.where(time < 12.0, pull(time, 0.5, static), left * LOAD * KINETIC)
    found = measured(time, noisy(force, 0.02, 1))
    kinetic = found.numbers["kinetic_friction"]
    assert kinetic.value == pytest.approx(KINETIC, abs=4.0 * kinetic.uncertainty)
    assert "pull_ends" in found.flagged
    assert ("static_friction" in found.numbers) == (static > KINETIC)


def test_stick_slip_that_is_cut_off_after_a_slip_to_nothing_has_not_ended() -> None:
    time = np.arange(0.0, 10.3, 0.01)
    force = noisy(np.interp(time % 1.0, [0.0, 0.97, 1.0], [0.0, 5.0, 0.0]), 0.01, 2)
    assert "pull_ends" not in measured(time, force).flagged


@pytest.mark.slow
def test_no_file_is_without_friction_and_without_a_sentence() -> None:
    """Random levels, ramps and teeth, one after the other."""
    for seed in range(15):
        random = np.random.default_rng(seed)
        pieces = [np.linspace(*random.uniform(0.0, 5.0, 2), int(random.integers(5, 200))) for _ in range(4)]
        force = noisy(np.concatenate(pieces), 0.02, seed)
        found = measured(0.02 * np.arange(len(force)), force)
        assert FRICTIONS & found.numbers.keys() or set(found.flagged) & {
            "no_friction",
            "turned",
            "unsteady",
            "sensor_limit",
        }
        assert set(found.flagged) <= SENTENCES.keys()
        assert not any(math.isinf(number.value) for number in found.numbers.values())


@pytest.mark.slow
def test_rings_of_any_shape_are_no_error() -> None:
    """Decays that begin anywhere, around any level, with and without a ramp before."""
    for seed in range(20):
        random = np.random.default_rng(seed)
        time = np.arange(0.0, 1.0, 0.001)
        start, level, size = random.uniform(0.0, 0.3), random.uniform(0.0, 3.0), random.uniform(0.1, 10.0)
        since = np.clip(time - start, 0.0, None)
        rings = level + size * np.exp(-random.uniform(1.0, 10.0) * since) * np.sin(random.uniform(30.0, 150.0) * since)
        ramp = level * np.clip(time / max(start, 1e-3), 0.0, 1.0)
        found = measured(time, noisy(np.where(time < start, ramp, rings), 0.01, seed))
        assert all(math.isfinite(number.value) for number in found.numbers.values())


def ringing_pull(seed: int, frequency: float, amplitude: float) -> Trace:
    """A pull to 0.35 in 2 s that slides at 0.30, in a force cell that noise keeps ringing (Q = 20), 1000 samples a second."""
    rng, apart = np.random.default_rng(seed), 1e-3
    at = np.arange(10_000) * apart
    turn = 2.0 * np.pi * frequency * apart
    kept = np.exp(-turn / 40.0)
    rung = scipy.signal.lfilter([1.0], [1.0, -2.0 * kept * np.cos(turn), kept**2], rng.standard_normal(14_000))[4000:]
    force = np.where(at < 2.0, 0.175 * at, 0.30) + amplitude * rung / rung.std() + 5e-4 * rng.standard_normal(len(at))
    return Trace(at, force, "time", unit="1")


@pytest.mark.parametrize(("frequency", "amplitude"), [(40.0, 0.005), (40.0, 0.01), (100.0, 0.005)])
def test_a_force_cell_that_rings_makes_no_stick_slip(frequency: float, amplitude: float) -> None:
    """Its ringing rises faster than the stage pulls. Taken for slips, it made μ_s 0.06 too low, and μ_k 0.02.

    Student's t of eight parts is beyond 4 in one of 200.
    """
    found = [measure_trace(ringing_pull(seed, frequency, amplitude)) for seed in range(4)]
    assert all("cell_rings" in each.flagged for each in found)
    assert not any("spring_force_amplitude" in each.numbers for each in found)
    for name, truth in (("static_friction", 0.35), ("kinetic_friction", 0.30)):
        numbers = [each.numbers[name] for each in found]
        assert all(abs(each.value - truth) < 4.0 * each.uncertainty for each in numbers)
        assert np.mean([abs(each.value - truth) < 2.0 * each.uncertainty for each in numbers]) >= 0.75
        assert max(each.uncertainty for each in numbers) < 0.01
