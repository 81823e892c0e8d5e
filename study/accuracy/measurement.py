"""Error against time of every setting, measured: elastic operator, slip numerics, records, integrators (`nanoslip accuracy`)."""

import math
import platform
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.dynamics.duration import measure_motion
from nanoslip.solver.dynamics.friction_limit import make_friction_limit
from nanoslip.solver.dynamics.integrators import RK4, Exact, integrate
from nanoslip.solver.dynamics.result import DynamicsResult
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.ensemble import Ensemble, mean_of
from nanoslip.solver.outcome import SolverError
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.slide import slide
from nanoslip.solver.sliding.statistics import event_statistics
from nanoslip.study.accuracy.diagram import FRONT_MARK, Diagram, Row, diagram_csv, draw_fronts
from nanoslip.study.accuracy.effects import measure_time
from nanoslip.study.accuracy.operators import measure_elastic_operator
from nanoslip.study.accuracy.records import measure_records
from nanoslip.study.accuracy.setup import Effort, Setup, change_grid, warm_up_setup
from nanoslip.study.manifest.parameters import Value
from nanoslip.study.origin import here, model
from nanoslip.study.provenance import UNKNOWN
from nanoslip.study.results.store import write_files

# The machine that times are measured on.


def machine() -> dict[str, str]:
    """The processor and the software that times are measured with."""
    facts = asdict(here()).items()
    software = {name: value for name, value in facts if value != UNKNOWN}
    return {"processor": model(), "system": platform.system(), **software}


# Slip numerics: n_x and the event floor against what is read off a friction record and a drive.
#
# A record is chaotic: a change in the last digit gives another record, so a distance between settings is one between
# distributions: of means over independent starts. It is given twice: as it is, and over their combined ±.

OBSERVABLES: Final = ("plateau", "static", "kinetic", "step")
"""Mean of F/W on the plateau, μ_s, μ_k, and the mean displacement per event over L_x."""

Reading = dict[str, tuple[float, float]]
"""Observable -> its mean over independent starts, and the ± of the mean."""


def measure_slip_numerics(setup: Setup, effort: Effort) -> Diagram:
    """Each knob alone, the case's own value for the other; all records reach the displacement that the case's reaches."""
    case = setup.case
    if case.max_displacement is None:
        reached = slide(case, surface_compliance(case.slab)).final_displacement
        # The same way on every grid: as many events on more nodes would be a shorter record.
        case = replace(case, max_events=None, max_displacement=reached)
    rows: list[Row] = []
    for knob, cases in _knob_cases(case, effort).items():
        readings = [(value, *_measure_starts(case_of_value, setup, effort)) for value, case_of_value in cases]
        # The last value of each knob is the reference of the others.
        truth = readings[-1][2]
        for value, seconds, reading in readings:
            rows.append(_row(knob, value, seconds, reading, truth))
    plateau, others = ("plateau", "plateau_difference", "plateau_distance"), ("static", "static_distance", "kinetic")
    return Diagram(
        title="Slip numerics",
        reference="the largest n_x and the smallest event floor of this table",
        series="knob",
        shown=("knob", "value", "seconds", *plateau, *others, "step", "step_distance"),
        error="plateau_difference",
        rivals=False,
        rows=tuple(rows),
    )


def _measure_starts(case: Case, setup: Setup, effort: Effort) -> tuple[float, Reading]:
    """Processor time of the first start's record, and the means of the observables over all starts."""
    ensemble, compliance = Ensemble(effort.starts), surface_compliance(case.slab)
    members = (ensemble.case(case, number) for number in range(effort.starts))
    first, *others = members
    record, seconds = measure_time(partial(slide, first, compliance), effort.repeats)
    starts = [record_observables(record, setup)]
    starts += [record_observables(slide(other, compliance), setup) for other in others]
    means: Reading = {}
    for name in OBSERVABLES:
        mean = mean_of(np.array([start[name] for start in starts]))
        means[name] = float(mean.mean), float(mean.uncertainty)
    return seconds, means


def _knob_cases(case: Case, effort: Effort) -> dict[str, list[tuple[float, Case]]]:
    """Knob -> its values and their cases, the reference last."""
    scheme = case.slab.scheme.name
    sizes = []
    for size in effort.record_sizes:
        other = change_grid(case, n_x=size, scheme=scheme)
        sizes.append((float(size), other))
    floors = []
    for floor in sorted(effort.event_floors, reverse=True):
        rule = replace(case.slip_rule, event_floor=floor)
        floors.append((rule.event_floor, replace(case, slip_rule=rule)))
    return {"n_x": sizes, "event_floor": floors}


def record_observables(record: FrictionRecord, setup: Setup) -> dict[str, float]:
    """Observables of a record, and of the setup's drive over it; NaN where there is no plateau."""
    values = dict.fromkeys(OBSERVABLES, math.nan)
    values["step"] = event_statistics(record).mean_step
    plateau = plateau_of(record)
    if plateau.outcome.ok:
        drive = setup.drive.dimensionless(setup.scales)
        _, friction = measure_motion(record, plateau, drive)
        means = (plateau.mean, friction.static_friction, friction.kinetic_friction)
        # The last of the observables, the step, needs no plateau.
        values |= dict(zip(OBSERVABLES, means, strict=False))
    return values


def _row(knob: str, value: float, seconds: float, reading: Reading, truth: Reading) -> Row:
    row: dict[str, Value] = {"knob": knob, "value": value, "seconds": seconds}
    for name, (mean, uncertainty) in reading.items():
        difference = abs(mean - truth[name][0])
        combined = math.hypot(uncertainty, truth[name][1])
        row |= {
            name: mean,
            f"{name}_uncertainty": uncertainty,
            f"{name}_difference": difference / abs(truth[name][0]),
            f"{name}_distance": difference / combined if combined else math.nan,
        }
    return row


# The dynamic stage: RK4's steps against the exact integrator, from crossing to crossing of the friction profile.

SAMPLES: Final = 2000


def measure_integrators(setup: Setup, effort: Effort) -> Diagram:
    """Errors and times of every integrator over the setup's record. Raises SolverError if it has no plateau.

    RK4 runs the whole drive; a step that is refused as unstable, or of which the drive needs more than step_limit, has no row.
    """
    record = slide(setup.case, surface_compliance(setup.case.slab))
    in_si = replace(setup.drive.in_si, integrator=Exact(), samples=SAMPLES)
    drive = replace(setup.drive, in_si=in_si).dimensionless(setup.scales)
    profile = make_friction_limit(record, plateau_of(record), drive.profile)

    def run(integrator: Exact | RK4) -> tuple[DynamicsResult, float]:
        """The drive with another integrator, and its processor time."""
        with_integrator = replace(drive, integrator=integrator)
        return measure_time(partial(integrate, profile, with_integrator, record.initial_stiffness), effort.repeats)

    truth, seconds = run(Exact())
    none = {"spring_force": 0.0, "velocity": 0.0}
    rows: list[Row] = [{"integrator": "exact", "step": 0.0, "seconds": seconds, **none}]
    unit = setup.scales.time(setup.drive.pin_mass)
    for step in effort.time_steps if drive.surface_compliance else ():
        motion, seconds = run(RK4(step / unit))
        if motion.outcome.ok:
            errors = {name: _apart(getattr(motion, name), getattr(truth, name)) for name in none}
            rows.append({"integrator": "rk4", "step": step, "seconds": seconds, **errors})
    return Diagram(
        title="Dynamics",
        reference="the exact integrator, which tests compare with DOP853; each RK4 row is one draw where motion is chaotic",
        series="integrator",
        shown=("integrator", "step", "seconds", "spring_force", "velocity"),
        error="velocity",
        rivals=True,
        rows=tuple(rows),
    )


def _apart(computed: NDArray[np.float64], truth: NDArray[np.float64]) -> float:
    """Root mean square difference over the root mean square of the truth."""
    difference = np.mean((computed - truth) ** 2)
    return float(np.sqrt(difference / np.mean(truth**2)))


def as_markdown(measurement: "Measurement") -> str:
    """The machine of the measurement, and each diagram's reference and file."""
    on = ", ".join(f"{name} {value}" for name, value in machine().items())
    parts = [f"# {measurement.title}\n\nMeasured with: {on}. {FRONT_MARK}: on the front.\n"]
    parts += [
        f"- [{diagram.title}]({diagram.file}). Reference: {diagram.reference}." for diagram in measurement.diagrams
    ]
    return "\n".join(parts) + "\n"


TITLE: Final = "What accuracy costs in time"


@dataclass(frozen=True, slots=True)
class Measurement:
    """Results of all measurements."""

    title: str
    diagrams: tuple[Diagram, ...]
    remark: str
    """Reason why a value could not be measured; empty if none."""


def measure_accuracy(setup: Setup, effort: Effort) -> Measurement:
    """Measure every setting: the least of each first, so that no time contains compilation, then the requested effort."""
    _measure(setup, warm_up_setup(effort))
    return _measure(setup, effort)


def _measure(setup: Setup, effort: Effort) -> Measurement:
    measures, remark = (measure_elastic_operator, measure_slip_numerics, measure_records), ""
    diagrams = [measure(setup, effort) for measure in measures]
    try:
        diagrams.append(measure_integrators(setup, effort))
    # A record without a plateau drives no pin.
    except SolverError as error:
        remark = f"dynamics: {error}"
    return Measurement(f"{TITLE}: {setup.title}", tuple(diagrams), remark)


def write_measurement(measurement: Measurement, out: Path) -> list[Path]:
    """Write tables and picture to `out`; returns the files. Raises StoreError."""
    contents = {
        out / "accuracy.md": as_markdown(measurement).encode(),
        out / "accuracy.png": draw_fronts(measurement.diagrams),
        **{out / diagram.file: diagram_csv(diagram).encode() for diagram in measurement.diagrams},
    }
    write_files(contents)
    return list(contents)
