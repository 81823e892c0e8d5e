"""What accuracy costs in time: work-precision diagrams as dataset, table and picture (`nanoslip accuracy`).

This is a measurement, not science: its dataset holds times and names the machine. Nothing else in the study does.
"""

import io
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final, Literal, get_args

import numpy as np
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from nanoslip.solver.case import Case
from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.friction_limit import FrictionLimit, friction_limit_of
from nanoslip.solver.dynamics.integrators import RK4, Exact, integrate, measured
from nanoslip.solver.dynamics.result import DynamicsResult
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.ensemble import Ensemble, mean_of
from nanoslip.solver.outcome import SolverError
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.slide import slide
from nanoslip.solver.sliding.statistics import event_statistics
from nanoslip.solver.view import with_error
from nanoslip.study.accuracy.digit import BY_LENGTH, BY_MEMBERS, DIGIT, measure_digit
from nanoslip.study.accuracy.digit import OBSERVABLES as PICTURED
from nanoslip.study.accuracy.elastic_operator import measure_elastic_operator
from nanoslip.study.accuracy.setup import QUICK, Diagram, Effort, Row, Setup, contacts, machine, on, timed
from nanoslip.study.dataset.file import carrying
from nanoslip.study.dataset.file import write as write_dataset
from nanoslip.study.figures.shared import COLORS, PAGE, column, image
from nanoslip.study.manifest.manifest import MEMBERS
from nanoslip.study.manifest.parameters import Value, words_of
from nanoslip.study.plan.grids import Measured, as_text
from nanoslip.study.report.console import Table
from nanoslip.study.results.entry import written_whole
from nanoslip.study.results.store import StoreError

# Slip numerics: n_x and the event floor against what is read off a friction record and a drive.
#
# A record is chaotic: a change in the last digit gives another record, so a distance between settings is one between
# distributions: of means over independent starts. It is given twice: as it is, and over their combined ±.

OBSERVABLES_OF_SLIP: Final = {
    "plateau": "mean of F/W on the plateau",
    "static": "static friction coefficient μ_s",
    "kinetic": "kinetic friction coefficient μ_k",
    "step": "mean displacement per event over L_x",
}

Reading = dict[str, tuple[float, float]]
"""Observable -> its mean over independent starts, and the ± of that."""


def measure_slip_numerics(setup: Setup, effort: Effort) -> Diagram:
    """Each knob alone, the case's own value for the other; all records reach the displacement that the case's reaches."""
    case = setup.case
    if case.max_displacement is None:
        reached = slide(case, surface_compliance(case.slab)).final_displacement
        case = replace(case, max_events=None, max_displacement=reached)
    rows: list[Row] = []
    for knob, cases in _turned(case, effort).items():
        readings = [(value, *_over_starts(each, setup, effort)) for value, each in cases]
        rows += [_row(knob, value, seconds, reading, readings[-1][2]) for value, seconds, reading in readings]
    return _sheet_of_slip(tuple(rows))


def _over_starts(case: Case, setup: Setup, effort: Effort) -> tuple[float, Reading]:
    """Processor time of the first start's record, and the means of what is read off all of them."""
    ensemble, compliance = Ensemble(effort.starts), surface_compliance(case.slab)
    first, *others = (ensemble.case(case, number) for number in range(effort.starts))
    record, seconds = timed(partial(slide, first, compliance), effort.repeats)
    each = [read(record, setup), *(read(slide(other, compliance), setup) for other in others)]
    means = {name: mean_of(np.array([one[name] for one in each])) for name in OBSERVABLES_OF_SLIP}
    return seconds, {name: (float(mean.mean), float(mean.uncertainty)) for name, mean in means.items()}


def _turned(case: Case, effort: Effort) -> dict[str, list[tuple[float, Case]]]:
    """Knob -> its values and their cases, the reference last."""
    sizes = [(float(size), on(case, n_x=size, scheme=case.slab.scheme.name)) for size in effort.record_sizes]
    floors = [
        (floor, replace(case, slip_rule=replace(case.slip_rule, event_floor=floor)))
        for floor in sorted(effort.event_floors, reverse=True)
    ]
    return {"n_x": sizes, "event_floor": floors}


def read(record: FrictionRecord, setup: Setup) -> dict[str, float]:
    """Observables of a record, and of the setup's drive over it; NaN where there is no plateau."""
    step, plateau = event_statistics(record).mean_step, plateau_of(record)
    if not plateau.outcome.ok:
        return {"plateau": math.nan, "static": math.nan, "kinetic": math.nan, "step": step}
    _, coefficients = measured(record, plateau, setup.drive.dimensionless(setup.scales))
    return {
        "plateau": plateau.mean,
        "static": coefficients.static_friction,
        "kinetic": coefficients.kinetic_friction,
        "step": step,
    }


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


def _sheet_of_slip(rows: tuple[Row, ...]) -> Diagram:
    words = {"knob": "what was changed", "value": "its value", "seconds": "processor time of one record"}
    for name, meaning in OBSERVABLES_OF_SLIP.items():
        words |= {
            name: meaning,
            f"{name}_uncertainty": f"± of the {meaning}, over independent starts",
            f"{name}_difference": f"difference of the {meaning} from the reference's, over it",
            f"{name}_distance": f"difference of the {meaning} from the reference's, over their combined uncertainty",
        }
    return Diagram(
        name="slip_numerics",
        title="Slip numerics",
        reference="the largest n_x and the smallest event floor of this table, each against the others of its knob",
        series="knob",
        shown=(
            *("knob", "value", "seconds", "plateau", "plateau_difference", "plateau_distance"),
            *("static", "static_distance", "kinetic", "step", "step_distance"),
        ),
        error="plateau_difference",
        rivals=False,
        words=words,
        rows=rows,
    )


# The dynamic stage: each integrator × step against the exact one, from crossing to crossing of the friction profile.
#
# scipy's adaptive steps know no crossings, so they are given what they are made for: a stretch between two crossings, where Eq.
# 12 is linear. Their time is that stretch's times the segments of the whole drive, which leaves out what finding the crossings
# would cost; their error is that of the stretch.

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
    return _sheet_of_integrators(tuple(rows))


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


def _sheet_of_integrators(rows: tuple[Row, ...]) -> Diagram:
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


# Diagrams as tables: on the terminal, and in Markdown.

MARK = "*"


def as_table(diagram: Diagram) -> Table:
    """All rows of a diagram, a value and its uncertainty in one cell; the rows on the front are marked."""
    keys = words_of("numerics")  # stay as they are written
    header = [name if name in keys else name.replace("_", " ") for name in diagram.shown]
    cells = [tuple(_cell(row[name], row.get(f"{name}_uncertainty")) for name in diagram.shown) for row in diagram.rows]
    if not diagram.error:
        return Table(tuple(header), tuple(cells))
    rows = ((*row, MARK if marked else "") for row, marked in zip(cells, diagram.on_front, strict=True))
    return Table((*header, "front"), tuple(rows))


def as_markdown(diagrams: Iterable[Diagram], title: str) -> str:
    """All diagrams, each under its name with what its errors are held against; their columns where no front is marked."""
    parts = [f"# {title}\n"]
    for diagram in diagrams:
        table = as_table(diagram)
        lines = [table.header, ("---",) * len(table.header), *table.rows]
        front = f" {MARK}: no other row is as good in less time." if diagram.error else ""
        parts.append(f"## {diagram.title}\n\nReference: {diagram.reference}.{front}\n")
        if not diagram.error:
            columns = zip(table.header, (diagram.words[name] for name in diagram.shown), strict=True)
            parts.append("\n".join(f"- *{name}*: {meaning}" for name, meaning in columns) + "\n")
        parts.append("\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n")
    return "\n".join(parts)


def _cell(value: Value, uncertainty: Value | None) -> str:
    if not isinstance(value, float):
        return str(value)
    if math.isnan(value):
        return "–"
    if isinstance(uncertainty, float) and math.isfinite(uncertainty):
        return with_error(value, uncertainty)
    return f"{value:.3g}"


# Work-precision measurement: error against processor time, one panel a diagram, the Pareto front as a line.

MARKERS: Final = "osD^vP"


def draw(diagrams: Sequence[Diagram]) -> bytes:
    """All diagrams side by side, as PNG."""
    figure = Figure(figsize=(5.2 * len(diagrams), 4.4), layout="constrained")
    canvas = FigureCanvasAgg(figure)
    for axes, diagram in zip(np.atleast_1d(figure.subplots(1, len(diagrams))), diagrams, strict=True):
        _draw(axes, diagram)
    buffer = io.BytesIO()
    canvas.print_figure(buffer, dpi=110, format="png", metadata={"Software": None})
    return buffer.getvalue()


def _draw(axes: Any, diagram: Diagram) -> None:
    """A panel. What the errors are held against has none: it stands on the lower edge."""
    time, error = (diagram.column(name).astype(float) for name in ("seconds", diagram.error))
    series = diagram.column(diagram.series)
    floor = 0.3 * np.nanmin(error[error > 0.0], initial=np.inf)
    shown = np.where(error == 0.0, floor, error)
    for marker, name in zip(MARKERS, dict.fromkeys(series.tolist()), strict=False):
        mine = series == name
        axes.loglog(time[mine], shown[mine], marker, label=str(name), markersize=5, alpha=0.8)
    for number, rivals in enumerate(diagram.groups):
        best = np.flatnonzero(diagram.on_front & rivals)
        best = best[np.argsort(time[best])]
        label = "Pareto front" if number == 0 else None
        axes.step(time[best], shown[best], where="post", color="black", linewidth=0.9, label=label)
    if (error == 0.0).any():
        axes.axhline(floor, color="grey", linewidth=0.6, linestyle=":", label="reference (no error by definition)")
    axes.set(
        title=diagram.title, xlabel="processor time (s)", ylabel=f"relative error: {diagram.error.replace('_', ' ')}"
    )
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)


def draw_digit(diagrams: Sequence[Diagram]) -> bytes:
    """A panel for each observable, as PNG: members joined by lines, lengths of records by dashed ones.

    A dotted line is the law of independent members: a hundred times the seconds, a tenth of the error.
    """
    rows = diagrams[-1].rows
    cases = list(dict.fromkeys(row["case"] for row in rows))
    with column(2.9, PAGE) as figure:
        panels = figure.subplots(1, len(PICTURED), sharex=True, sharey=True)
        for axes, (name, title) in zip(panels, PICTURED.items(), strict=True):
            for case, color in zip(cases, COLORS, strict=False):
                for way, style in ((BY_MEMBERS, "o-"), (BY_LENGTH, "s--")):
                    mine = [row for row in rows if (row["case"], row["way"]) == (case, way)]
                    points = np.array([(row["seconds"], row[name]) for row in mine], float).T
                    hollow = {} if way == BY_MEMBERS else {"markerfacecolor": "white"}
                    axes.loglog(*points, style, color=color, markersize=3.5, label=f"{case}: {way}", **hollow)
                    for row in mine if way == BY_MEMBERS else ():
                        time, error = float(row["seconds"]), float(row[name])
                        if row["members"] == MEMBERS and error > 0.0:
                            law = (time, error), (DIGIT * time, error / math.sqrt(DIGIT))
                            axes.axline(*law, color="grey", linestyle=":", zorder=0.5)
            axes.set(title=title, xlabel="core seconds")
        panels[0].set_ylabel("relative error of the mean")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(cases))
        return image(figure, "png")


TITLE: Final = "What accuracy costs in time"


@dataclass(frozen=True, slots=True)
class Measurement:
    """All that was measured."""

    title: str
    setups: tuple[Setup, ...]
    diagrams: tuple[Diagram, ...]
    contacts: tuple[float, ...] = ()
    """Half-widths of the contacts on each operator, a/L_x."""
    front: tuple[Measured, ...] = ()
    """Every discretization of every slab of the setup under each of these contacts."""
    remark: str = ""
    """What could not be measured, and why; empty if nothing."""
    stem: str = "accuracy"
    """Name of all files but for their endings."""
    draw: Callable[[Sequence[Diagram]], bytes] = draw


def measure(setup: Setup, effort: Effort) -> Measurement:
    """Turn every knob: first all that is timed once, to have it compiled, then as much as was asked for."""
    if effort is not QUICK:
        measure(setup, QUICK)
    operator, front = measure_elastic_operator(setup, effort)
    diagrams, remark = [operator, measure_slip_numerics(setup, effort)], ""
    try:
        diagrams.append(measure_integrators(setup, effort))
    except SolverError as error:  # a record without a plateau drives no pin
        remark = f"dynamics: {error}"
    return Measurement(f"{TITLE}: {setup.title}", (setup,), tuple(diagrams), contacts(effort), front, remark)


def measure_another_digit(setups: Sequence[Setup], effort: Effort) -> Measurement:
    """Errors over members and lengths of records. Raises ManifestError where a case has no plateau."""
    diagrams = measure_digit(setups, effort)
    return Measurement("What a digit costs in time", tuple(setups), diagrams, stem="digit", draw=draw_digit)


def as_dataset(measurement: Measurement) -> xr.Dataset:
    """Every diagram's columns over its rows; the setups, what errors are held against and the machine as attributes."""
    variables = {name: variable for diagram in measurement.diagrams for name, variable in diagram.variables().items()}
    cases = [setup.case.flat for setup in measurement.setups]
    drives = [{"name": setup.drive.name, **setup.drive.flat} for setup in measurement.setups]
    attributes = {
        "title": measurement.title,
        "Conventions": "CF-1.11",
        **{f"{diagram.name}_reference": diagram.reference for diagram in measurement.diagrams},
        "case": "; ".join(map(_in_words, cases)),
        "drive": "; ".join(map(_in_words, drives)),
        **({"remark": measurement.remark} if measurement.remark else {}),
        **machine(),
    }
    return xr.Dataset(variables, attrs=attributes)


def _in_words(values: Mapping[str, object]) -> str:
    return ", ".join(f"{name} = {value}" for name, value in values.items() if value is not None)


def write(measurement: Measurement, out: Path, front: Path | None = None) -> list[Path]:
    """Write dataset, table and picture to `out`, and the front where it is wanted; returns the files. Raises StoreError."""
    stem, diagrams = measurement.stem, measurement.diagrams
    dataset = out / f"{stem}.nc"
    write_dataset(carrying(as_dataset(measurement), {}), dataset)
    contents = {
        out / f"{stem}.md": as_markdown(diagrams, measurement.title).encode(),
        out / f"{stem}.png": measurement.draw(diagrams),
    }
    if front is not None:
        contents[front] = as_text(machine(), measurement.contacts, measurement.front).encode()
    for path, content in contents.items():
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with written_whole(path) as scratch:
                scratch.write_bytes(content)
        except OSError as error:
            raise StoreError(f"{path}: cannot be written: {error.strerror or error}") from None
    return [dataset, *contents]
