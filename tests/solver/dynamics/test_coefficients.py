"""What is said of a drive that is too short is never rounded up."""

from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case
from nanoslip.solver.drive import Drive, Scales
from nanoslip.solver.dynamics.coefficients import friction_coefficients
from nanoslip.solver.dynamics.friction_limit import sawtooth
from nanoslip.solver.dynamics.integrators import RK4, Exact, integrate
from nanoslip.solver.outcome import Ending
from nanoslip.solver.simulate import drive_result
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.plateau import plateau_of
from tests.synthetic import STIFFNESS, noisy_record

PAPER = Drive.from_si(Scales(), samples=2)


def test_a_drive_a_little_too_short_does_not_slide_for_the_periods_that_are_needed() -> None:
    record = noisy_record()
    plateau = plateau_of(record)
    motion = integrate(sawtooth(record, plateau), Drive.from_si(Scales()), STIFFNESS)
    slides = float(motion.time[-1] - motion.slip_time[0])
    friction = friction_coefficients(replace(motion, settling_time=slides / 1.9996), record, plateau)
    assert friction.outcome.ending is Ending.NO_PLATEAU
    assert "slid for 1.99 oscillation periods; averaging μ_k needs 2" in friction.outcome.message


@pytest.mark.parametrize(("stage_velocity", "damping_ratio"), [(5e-3, 1.0), (1e-2, 0.5)])
@pytest.mark.parametrize("integrator", [Exact(), RK4(time_step=1e-3)])
def test_the_swing_of_a_pin_on_its_contact_is_no_slip_and_its_force_no_static_friction(
    stage_velocity: float, damping_ratio: float, integrator: Exact | RK4
) -> None:
    """The damper sets the pin in motion at once: it swings past where its contact slides, and sticks again.

    Spring and damper have reached half of what the contact holds then. That was called μ_s, and known to 8 %.
    """
    case = Case(intrinsic_friction=0.1, slab=Slab(33), max_events=2000)
    fast = Drive.from_si(Scales(), samples=2, stage_velocity=stage_velocity, damping_ratio=damping_ratio, duration=0.02)
    found = drive_result(case, replace(fast, integrator=integrator))
    steady = slice(found.plateau.first_event, found.plateau.last_event + 1)
    assert found.coefficients.static_friction * case.normal_load >= found.record.force_after[steady].min()


def test_what_no_force_of_the_record_reaches_is_stated() -> None:
    """A pin a hundred times as heavy is pulled on by its own motion: contact holds half of what spring and damper reach."""
    case = Case(slab=Slab(33), max_events=2000)
    heavy = Drive.from_si(Scales(), pin_mass=50.0, stage_velocity=1e-2, damping_ratio=0.01, duration=0.3)
    for drive in (PAPER, heavy):
        found = drive_result(case, drive)
        record, friction = found.record, found.coefficients
        held = max(record.force_before.max(), record.initial_force, record.final_force) / case.normal_load
        assert friction.static_friction_excess == max(friction.static_friction - held, 0.0)
    assert friction.static_friction_excess > 0.4 * friction.static_friction


@pytest.mark.parametrize(("reached", "known"), [(0.5, True), (1.99, True), (2.01, False)])
def test_the_first_slip_is_measured_from_the_highest_force_of_the_record_run_in_included(
    reached: float, known: bool
) -> None:
    """A tooth before the plateau holds three times the plateau: a pull of twice that is half inertia, and no friction beyond."""
    record = noisy_record()
    plateau = plateau_of(record)
    assert plateau.first_event > 0
    held = 3.0 * plateau.peak
    record.force_before[0] = held * record.normal_load
    motion = integrate(sawtooth(record, plateau), Drive.from_si(Scales()), STIFFNESS)
    pulls = np.full(len(motion.slip_force), reached * held * record.normal_load)
    friction = friction_coefficients(replace(motion, slip_force=pulls), record, plateau)
    assert friction.static_friction == pytest.approx(reached * held if known else np.nan, nan_ok=True)
    excess = max(reached - 1.0, 0.0) * held if known else np.nan
    assert friction.static_friction_excess == pytest.approx(excess, nan_ok=True)
    assert ("is inertia and damper" in friction.outcome.message) is not known
