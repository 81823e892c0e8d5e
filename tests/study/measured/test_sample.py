"""The sample recordings that `nanoslip new trace` writes: stick-slip in closed form, and friction over a load that rises.

Their numbers are found again.
"""

import json
import math

import numpy as np
import pytest

from nanoslip.study.shipped import starters

STATIC, KINETIC, LOAD = 0.474, 0.44, 0.2
"""μ_s, μ_k, and the normal load in N."""
SPRING, MASS, VELOCITY = 150.0, 0.08, 0.5e-3
"""Spring (N/m), mass of the pin (kg) and velocity of the stage (m/s)."""
FREQUENCY = math.sqrt(SPRING / MASS)
HALF, RATE = (STATIC - KINETIC) * LOAD, SPRING * VELOCITY
"""Half of a slip's fall (N), and the rise of the force of a stuck pin (N/s)."""
SLIP = 2.0 * (math.pi - math.atan(HALF * FREQUENCY / RATE)) / FREQUENCY
"""Time of a slip: until the pin is at rest again (Eq. 16-19 without a damper)."""
PERIOD = SLIP + 2.0 * HALF / RATE


def recording() -> str:
    """The text of the sample: 6 s at 200 Hz, with noise of 0.1 mN."""
    time = np.arange(1200) / 200.0
    first = STATIC * LOAD / RATE
    phase = np.mod(time - first, PERIOD)
    swing = HALF * np.cos(FREQUENCY * phase) + RATE / FREQUENCY * np.sin(FREQUENCY * phase)
    after = np.where(phase < SLIP, swing, RATE * (phase - SLIP) - HALF)
    force = np.where(time < first, RATE * time, KINETIC * LOAD + after)
    force += 1e-4 * np.random.default_rng(1).standard_normal(len(time))
    rows = [f"{t:.3f},{1e3 * f:.2f},{1e3 * LOAD:.0f}\n" for t, f in zip(time, force, strict=True)]
    return "".join(["t [s],F [mN],W [mN]\n", *rows])


SLOPE, INTERCEPT = 0.25, 5e-3
"""Friction over load, and friction without load in N."""


def recording_over_load() -> str:
    """The text of the other sample: 30 s of sliding at 20 Hz, under a load that rises to 0.2 N, with noise of 0.1 mN."""
    time = np.arange(600) / 20.0
    load = np.linspace(0.02, 0.2, len(time))
    force = INTERCEPT + SLOPE * load + 1e-4 * np.random.default_rng(2).standard_normal(len(time))
    columns = zip(time, 1e3 * force, 1e3 * load, strict=True)
    rows = [f"{t:.2f},{f:.2f},{w:.2f}\n" for t, f, w in columns]
    return "".join(["t [s],F [mN],W [mN]\n", *rows])


def test_the_sample_is_the_closed_form_with_noise():
    assert starters()["trace"].with_suffix(".csv").read_text("utf-8") == recording()
    over_load = starters()["trace"].with_name("trace_over_load.csv")
    assert over_load.read_text("utf-8") == recording_over_load()


def test_the_numbers_of_the_sample_are_found_within_three_of_their_errors(main, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main("new", "trace")[0] == 0
    code, said, _ = main("trace", "trace.csv", "--json")
    found = json.loads(said)
    assert (code, found["flags"]) == (0, [])
    known = {
        "static_friction": STATIC,
        "kinetic_friction": KINETIC,
        "natural_period": 2.0 * math.pi / FREQUENCY,
        "stick_slip_period": PERIOD,
    }
    for name, value in known.items():
        number = found[name]
        assert number["value"] == pytest.approx(value, abs=3.0 * number["uncertainty"]), name
        assert number["value"] == pytest.approx(value, rel=1e-2), name


def test_the_line_of_the_other_sample_is_found_within_three_of_its_errors(main, tmp_path, monkeypatch):
    """In its table, too, and in mN, as a campaign of this load has its forces."""
    monkeypatch.chdir(tmp_path)
    assert main("new", "trace")[0] == 0
    code, said, _ = main("trace", "trace_over_load.csv", "--json")
    found = json.loads(said)
    assert (code, found["flags"]) == (0, ["load_changes"])
    for name, value in (("friction_slope", SLOPE), ("friction_intercept", INTERCEPT)):
        number = found[name]
        assert number["value"] == pytest.approx(value, abs=3.0 * number["uncertainty"]), name
        assert number["value"] == pytest.approx(value, rel=1e-2), name
    rows = [line.split() for line in main("trace", "trace_over_load.csv")[1].splitlines()]
    (intercept,) = [row for row in rows if row[:1] == ["friction_intercept"]]
    milli = 1e3 * found["friction_intercept"]["value"]
    assert float(intercept[intercept.index("±") - 1]) == pytest.approx(milli, rel=1e-2)
    assert "mN" in intercept
