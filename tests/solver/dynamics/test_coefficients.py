"""What is said of a drive that is too short is never rounded up to what would have been enough."""

from dataclasses import replace

from solver.drive import Drive, Scales
from solver.dynamics.coefficients import friction_coefficients
from solver.dynamics.friction_limit import sawtooth
from solver.dynamics.integrate import integrate
from solver.outcome import Ending
from solver.sliding.plateau import plateau_of
from tests.synthetic import STIFFNESS, noisy_record


def test_a_drive_a_little_too_short_does_not_slide_for_the_periods_that_are_needed() -> None:
    record = noisy_record()
    plateau = plateau_of(record)
    motion = integrate(sawtooth(record, plateau), Drive.from_si(Scales()), STIFFNESS)
    slides = float(motion.time[-1] - motion.slip_time[0])
    friction = friction_coefficients(replace(motion, settling_time=slides / 1.9996), record, plateau)
    assert friction.outcome.ending is Ending.NO_PLATEAU
    assert "slides for 1.99 of its periods, 2 are needed" in friction.outcome.message
