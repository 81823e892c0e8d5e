"""The velocity below which a pin of constant coefficients sticks again is that of energy lost to the damper."""

import math

import numpy as np
import pytest
from stick_slip import claims, critical_velocity

from tests.study.figures.shipped_small import small


def test_the_critical_velocity_is_the_closed_form() -> None:
    data = small("maps/stick_slip")
    where = {"spring_stiffness": 1e5, "pin_mass": 0.5, "damping_ratio": 0.01}
    excess = float((data["static_friction"] - data["kinetic_friction"]).median())
    expected = excess * 100.0 / math.sqrt(math.expm1(4.0 * math.pi * 0.01) * 1e5 * 0.5)  # the load is 100 N
    assert float(critical_velocity(data).sel(where)) == pytest.approx(expected, rel=1e-9)


def test_every_drive_is_counted_once_along_each_parameter() -> None:
    data = small("maps/stick_slip")
    for symbol in ("ζ", "m"):
        rows = [claim.found for claim in claims(data) if claim.meaning.startswith(f"{symbol} =")]
        counts = [int(part.split()[0]) for row in rows for part in row.split(", ")]
        assert sum(counts) == int((data["regime"] != "").sum()) == data["regime"].size
        assert len(rows) == np.unique(data["damping_ratio" if symbol == "ζ" else "pin_mass"]).size
