"""The driven pin: from crossing to crossing against Runge-Kutta."""

from dataclasses import replace
from typing import Final

from nanoslip import Case, Drive, Scales, Slab, friction_record, plateau_of
from nanoslip.solver.dynamics.friction_limit import make_friction_limit
from nanoslip.solver.dynamics.integrators import RK4, integrate
from tests.benchmarks.table import Row, best, seconds, verdict, versus

SCALES: Final = Scales()
UNIT: Final = SCALES.time(pin_mass=0.5)
PAPER: Final = Drive(
    spring_stiffness=2e5 / SCALES.stiffness,
    damping_ratio=0.1,
    stage_velocity=2e-3 * UNIT / SCALES.slab_width,
    duration=0.2 / UNIT,
)
"""§3.3: 0.5 kg, 2e5 N/m, ζ = 0.1, 2 mm/s, 0.2 s."""

STEP = 1e-7
"""The paper's step, in s."""


def rows() -> list[Row]:
    """Speed on the paper's case."""
    record = friction_record(Case(intrinsic_friction=0.5, radius=200.0, slab=Slab(scheme="biquadratic")))
    profile, contact = make_friction_limit(record, plateau_of(record), PAPER.profile), record.initial_stiffness
    exact = best(lambda: integrate(profile, PAPER, contact), repeats=10)
    segments = integrate(profile, PAPER, contact).steps
    stepping = replace(PAPER, integrator=RK4(STEP / UNIT))
    rk4 = best(lambda: integrate(profile, stepping, contact), repeats=10)
    steps = integrate(profile, stepping, contact).steps
    what = f"0.2 s of the paper's drive, exact ({segments} segments, {seconds(exact / segments)} each)"
    by_steps = f"compiled RK4 at 100 ns, {seconds(rk4 / steps)} per step"
    aim = verdict("≥ 8 × faster", rk4 >= 8.0 * exact)
    return [versus(what, exact, rk4, by_steps, aim, ratio=f"1/{rk4 / exact:.1f}")]
