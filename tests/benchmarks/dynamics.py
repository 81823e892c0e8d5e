"""The driven pin: from crossing to crossing against Runge-Kutta and scipy's adaptive steps; errors; many drives."""

from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from nanoslip import Case, Drive, DynamicsResult, FrictionRecord, Scales, Slab, friction_record, plateau_of
from nanoslip.solver.dynamics.friction_limit import FrictionLimit, friction_limit_of
from nanoslip.solver.dynamics.integrators import RK4, integrate
from tests.benchmarks.table import Row, best, seconds, verdict, versus
from tests.solver.drives import PROBLEMS, reference

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
STRETCH = (0.075, 0.0755)
"""What scipy integrates, in s: from within the first macroscopic slip."""
VELOCITIES = PAPER.stage_velocity * np.geomspace(0.5, 2.0, 8)


def rows() -> list[Row]:
    """Speed on the paper's case, and errors on hand-made profiles that take every branch."""
    record = friction_record(Case(intrinsic_friction=0.5, radius=200.0, slab=Slab(scheme="biquadratic")))
    profile, contact = _profile(record), record.initial_stiffness
    exact = best(lambda: integrate(profile, PAPER, contact), repeats=10)
    segments = integrate(profile, PAPER, contact).steps
    stepping = replace(PAPER, integrator=RK4(STEP / UNIT))
    rk4 = best(lambda: integrate(profile, stepping, contact), repeats=10)
    steps = integrate(profile, stepping, contact).steps
    begin, end = (_until(profile, contact, time) for time in STRETCH)
    share = (end.steps - begin.steps) / segments
    adaptive = best(lambda: adaptive_state(profile, contact, begin), repeats=2) / share
    off = abs(adaptive_state(profile, contact, begin)[1] / end.velocity[-1] - 1.0)
    several = best(lambda: _several(record), repeats=3)
    drives = [replace(PAPER, stage_velocity=velocity) for velocity in VELOCITIES]
    alone = sum(best(partial(integrate, profile, drive, contact), repeats=3) for drive in drives)
    what, same = "0.2 s of the paper's drive, exact", f"({segments} segments, {seconds(exact / segments)} each)"
    scipys = f"scipy solve_ivp, RK45 to 1e-8, from {share:.1%} of the segments, "
    by_steps = f"compiled RK4 at 100 ns, {seconds(rk4 / steps)} per step"
    aims = verdict("≥ 8 × faster", rk4 >= 8.0 * exact), verdict("read once: ≤ 1.1", several <= 1.1 * alone)
    several_what = f"{len(drives)} drives of one record in memory"
    return [
        versus(f"{what} {same}", exact, rk4, by_steps, aims[0], ratio=f"1/{rk4 / exact:.1f}"),
        versus(what, exact, adaptive, f"{scipys}velocity error {off:.0e}", ratio=f"1/{adaptive / exact:.0f}"),
        versus(several_what, several, alone, "integrations alone", aims[1]),
        _error_row(),
    ]


def adaptive_state(profile: FrictionLimit, contact: float, begin: DynamicsResult) -> NDArray[np.float64]:
    """Position, velocity and friction at the stretch's end, by scipy's Runge-Kutta steps of order 5.

    Eq. 13 as a rate: F changes with the contact's stiffness K within ±F̃, and with F̃ where it would leave them. The jump
    of F̃ at an edge only clips it, which is as far as a rate goes: a restart at every edge would cost far more.
    """
    k, stage = PAPER.spring_stiffness, PAPER.stage_velocity
    damping = 2.0 * PAPER.damping_ratio * np.sqrt(k)
    start, period = float(profile.edges[profile.periodic_from]), profile.period

    def motion(t: float, state: NDArray[np.float64]) -> tuple[float, float, float]:
        x, v, friction = state
        far = abs(x)
        if far >= profile.edges[-1]:
            far = start + (far - start) % period
        tooth = int(np.searchsorted(profile.edges, far, side="right")) - 1
        limit = profile.force[tooth] + profile.slope[tooth] * (far - profile.edges[tooth])
        held = min(max(friction, -limit), limit)
        slides = abs(friction) >= limit and friction * v > 0.0
        rate = np.sign(friction) * np.sign(x) * profile.slope[tooth] if slides else contact
        return v, k * (stage * t - x) + damping * (stage - v) - held, rate * v

    first = np.array([begin.position[-1], begin.velocity[-1], begin.friction_force[-1]])
    span = (STRETCH[0] / UNIT, STRETCH[1] / UNIT)
    return np.asarray(solve_ivp(motion, span, first, rtol=1e-8, atol=1e-8 * np.abs(first)).y[:, -1])


def _until(profile: FrictionLimit, contact: float, time: float) -> DynamicsResult:
    return integrate(profile, replace(PAPER, duration=time / UNIT, samples=1), contact)


def _profile(record: FrictionRecord) -> FrictionLimit:
    return friction_limit_of(record, plateau_of(record), PAPER.profile)


def _several(record: FrictionRecord) -> list[DynamicsResult]:
    """From the record in memory to every drive's result; plateau and profile are found once."""
    profile = _profile(record)
    drives = [replace(PAPER, stage_velocity=velocity) for velocity in VELOCITIES]
    return [integrate(profile, drive, record.initial_stiffness) for drive in drives]


def _error_row() -> Row:
    """Largest error of position, velocity and friction at the end of each hand-made drive, per largest value of each."""
    errors = {}
    for name, problem in PROBLEMS.items():
        result = problem.driven()
        course = np.array([result.position, result.velocity, result.friction_force])
        error = np.abs(course[:, -1] - reference(problem, problem.duration))
        errors[name] = float((error / np.abs(course).max(axis=1)).max())
    worst = max(errors, key=errors.__getitem__)
    what = f"largest error at the end of {len(errors)} drives: {worst}"
    target, peer = verdict("≤ 1e-9", errors[worst] <= 1e-9), "DOP853 with event location, to 1e-12"
    return Row(what, f"{errors[worst]:.1e} of the amplitude", peer, target=target)
