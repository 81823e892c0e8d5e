"""A force cell that rings after each slip hides how far the force falls."""

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.drive import Drive, Scales
from nanoslip.solver.dynamics.stick_slip import stick_slip
from nanoslip.study.measured.recording import Trace
from nanoslip.study.measured.trace import TraceNumbers, measure_trace

LOAD, MASS, STIFFNESS, VELOCITY = 100.0, 0.5, 2e4, 2e-3
TRUE = {
    "static_friction": 0.31,
    "kinetic_friction": 0.26,
    "damping_ratio": 0.1,
    "natural_period": 2.0 * np.pi * (MASS / STIFFNESS) ** 0.5,
}
APART = 2e-4


def stick_slip_force() -> NDArray[np.float64]:
    """Spring force (N) of Eq. 16-19 in 4 s."""
    scales = Scales()
    drive = Drive.from_si(
        scales,
        MASS,
        spring_stiffness=STIFFNESS,
        stage_velocity=VELOCITY,
        damping_ratio=TRUE["damping_ratio"],
        duration=4.0,
    )
    time = np.arange(0.0, 4.0, APART) / scales.time(MASS)
    frictions = (TRUE[name] * LOAD / scales.force for name in ("kinetic_friction", "static_friction"))
    return stick_slip(time, drive, *frictions).spring_force * scales.force


def seen_by_cell(force: NDArray[np.float64], frequency: float, quality: float) -> NDArray[np.float64]:
    """Reading of a cell that is an oscillator of this frequency (Hz) and quality factor."""
    omega = 2.0 * np.pi * frequency
    oscillator = ([omega**2], [1.0, omega / quality, omega**2])
    above, below, _ = scipy.signal.cont2discrete(oscillator, APART, method="foh")
    return scipy.signal.lfilter(above.ravel(), below, force)


def measured(force: NDArray[np.float64], noise: float = 0.02) -> TraceNumbers:
    noisy = force + noise * np.random.default_rng(1).standard_normal(len(force))
    return measure_trace(Trace(np.arange(len(force)) * APART, noisy, "time"), LOAD)


def test_means_over_the_ringing_of_a_cell_hide_how_far_the_force_falls() -> None:
    found = measured(seen_by_cell(stick_slip_force(), 60.0, 20.0))
    assert "cell_rings" in found.flagged
    assert np.isnan(found.numbers["spring_force_amplitude"].uncertainty)
