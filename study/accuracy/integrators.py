"""The dynamic stage: each integrator × step against the exact one, from crossing to crossing of the friction profile.

scipy's adaptive steps know no crossings, so they are given what they are made for: a stretch between two crossings,
where Eq. 12 is linear. Their time is that stretch's times the segments of the whole drive, which leaves out what finding
the crossings would cost; their error is that of the stretch.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.friction_limit import FrictionLimit, friction_limit_of
from nanoslip.solver.dynamics.integrators import RK4, DynamicsResult, Exact, integrate
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.slide import slide
from nanoslip.study.accuracy.diagram import Diagram, Row
from nanoslip.study.accuracy.setup import Effort, Setup
from nanoslip.study.accuracy.timing import timed

SAMPLES: Final = 2000
Method = Literal["RK45", "DOP853"]
METHODS: Final[tuple[Method, ...]] = get_args(Method)


@dataclass(frozen=True, slots=True)
class Course:
    """What the pin meets: a friction profile, its lateral stiffness K and how it is pulled."""

    profile: FrictionLimit
    contact: float
    drive: Drive

    def run(self, drive: Drive) -> DynamicsResult:
        """The pin pulled over it, perhaps otherwise."""
        return integrate(self.profile, drive, self.contact)


def measure_integrators(setup: Setup, effort: Effort) -> Diagram:
    """Errors and times of every integrator over the setup's record. Raises NoPlateauError where it has no plateau."""
    course = _course(setup)
    truth, seconds = timed(partial(course.run, course.drive), effort.repeats)
    exact: Row = {"integrator": "exact", "step": 0.0, "seconds": seconds, "spring_force": 0.0, "velocity": 0.0}
    rows = [exact, *_stepped(course, truth, setup, effort), *_adaptive(course, truth.steps, effort)]
    return _sheet(tuple(rows))


def _course(setup: Setup) -> Course:
    record = slide(setup.case, surface_compliance(setup.case.slab))
    in_si = replace(setup.drive.in_si, integrator=Exact(), samples=SAMPLES)
    drive = replace(setup.drive, in_si=in_si).dimensionless(setup.scales)
    return Course(friction_limit_of(record, plateau_of(record), drive.profile), record.initial_stiffness, drive)


def _stepped(course: Course, truth: DynamicsResult, setup: Setup, effort: Effort) -> Iterator[Row]:
    """RK4, the whole drive; a step that is refused as unstable has no row."""
    unit = setup.scales.time(setup.drive.pin_mass)
    if not course.drive.surface_compliance:
        return
    for step in effort.time_steps:
        drive = replace(course.drive, integrator=RK4(step / unit))
        found, seconds = timed(partial(course.run, drive), effort.repeats)
        if found.outcome.ok:
            yield {
                "integrator": "rk4",
                "step": step,
                "seconds": seconds,
                "spring_force": _apart(found.spring_force, truth.spring_force),
                "velocity": _apart(found.velocity, truth.velocity),
            }


def _adaptive(course: Course, segments: int, effort: Effort) -> Iterator[Row]:
    """scipy's steps while the contact is stuck: the spring stretches with K from x = 0 to shortly before the first slip."""
    if not course.drive.surface_compliance:
        return
    stretch = replace(course.drive, duration=_stuck_until(course), samples=1)
    truth = course.run(stretch)
    for method in METHODS:
        for tolerance in effort.tolerances:
            end, seconds = timed(partial(_stuck, course, stretch, method, tolerance), effort.repeats)
            yield {
                "integrator": method,
                "step": tolerance,
                "seconds": seconds * segments / truth.steps,
                "spring_force": abs(stretch.spring_stiffness * (end[0] - truth.position[-1]) / truth.spring_force[-1]),
                "velocity": abs(end[1] / truth.velocity[-1] - 1.0),
            }


def _stuck_until(course: Course) -> float:
    """A time, by halving the drive's duration, at which the pin is still on its first segment."""
    duration = course.drive.duration
    while course.run(replace(course.drive, duration=duration, samples=1)).steps > 1:
        duration /= 2.0
    return duration


def _stuck(course: Course, drive: Drive, method: Method, tolerance: float) -> NDArray[np.float64]:
    """Position and velocity after the drive's duration by Eq. 12 with F = K·x."""
    k, stage = drive.spring_stiffness, drive.stage_velocity
    damping = 2.0 * drive.damping_ratio * np.sqrt(k)

    def motion(t: float, state: NDArray[np.float64]) -> tuple[float, float]:
        x, v = state
        return v, k * (stage * t - x) + damping * (stage - v) - course.contact * x

    scale = stage * drive.duration
    span = (0.0, drive.duration)
    found = solve_ivp(
        motion, span, np.zeros(2), method, rtol=tolerance, atol=np.array([tolerance * scale, tolerance * stage])
    )
    return np.asarray(found.y[:, -1])


def _apart(found: NDArray[np.float64], truth: NDArray[np.float64]) -> float:
    """Root mean square difference over the root mean square of the truth."""
    return float(np.sqrt(np.mean((found - truth) ** 2) / np.mean(truth**2)))


def _sheet(rows: tuple[Row, ...]) -> Diagram:
    return Diagram(
        name="integrator",
        title="Dynamics",
        reference="the exact integrator, itself held against DOP853 with event location by the tests",
        series="integrator",
        shown=("integrator", "step", "seconds", "spring_force", "velocity"),
        error="velocity",
        rivals=True,
        words={
            "integrator": "integrator; RK45 and DOP853 are scipy's, on one stretch without crossings, their time scaled up",
            "step": "time step in s; of scipy's, the relative tolerance",
            "seconds": "processor time of the whole drive",
            "spring_force": "error of the spring force, root mean square over the drive, relative",
            "velocity": "error of the pin's velocity, likewise",
        },
        rows=rows,
    )
