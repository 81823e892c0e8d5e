"""Error against time of every numerical setting: measured, and as work-precision diagrams (`nanoslip accuracy`).

The reference of an elastic operator is the finest affordable compliance: the Galerkin scheme on a much finer and evenly graded
grid. It is nanoslip's own; tests/verification show that it converges to the slab of an independent library.
"""

import math
import platform
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.drive import Scales
from nanoslip.solver.dynamics.friction_limit import friction_limit_of
from nanoslip.solver.dynamics.integrators import RK4, Exact, integrate, measured
from nanoslip.solver.dynamics.result import DynamicsResult
from nanoslip.solver.elasticity.compliance import Compliance, surface_compliance
from nanoslip.solver.ensemble import Ensemble, mean_of
from nanoslip.solver.outcome import InvalidInput, SolverError
from nanoslip.solver.parameter import choices_of
from nanoslip.solver.slab import SCHEMES, Slab
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.slide import slide
from nanoslip.solver.sliding.statistics import event_statistics
from nanoslip.solver.view import with_error
from nanoslip.study.accuracy.effects import timed
from nanoslip.study.figures.shared import COLUMN, MARKERS, column, image
from nanoslip.study.manifest.cases import expand
from nanoslip.study.manifest.columns import rows_as_csv
from nanoslip.study.manifest.manifest import Manifest, NamedDrive
from nanoslip.study.manifest.parameters import Value, words_of
from nanoslip.study.manifest.problems import ManifestError
from nanoslip.study.origin import here, model
from nanoslip.study.plan.grids import Measured, alike, as_text, discretized, hertz_half_width, pareto_front, settings
from nanoslip.study.provenance import UNKNOWN
from nanoslip.study.report.console import Table
from nanoslip.study.results.store import write_files

# The machine that times are measured on.


def machine() -> dict[str, str]:
    """The processor and the software that times are measured with."""
    software = {name: value for name, value in asdict(here()).items() if value != UNKNOWN}
    return {"processor": model(), "system": platform.system(), **software}


@dataclass(frozen=True, slots=True)
class Setup:
    """The physics on which every knob is turned."""

    title: str
    case: Case
    slabs: tuple[Slab, ...]
    """Slabs of which the front is measured, their discretization left to the knobs; the case's own comes first."""
    drive: NamedDrive
    scales: Scales


@dataclass(frozen=True, slots=True)
class Effort:
    """Extent of a measurement: sizes, starts, time steps and repetitions."""

    sizes: tuple[int, ...]
    """n_x of the operators, increasing."""
    reference_size: int
    """n_x of the operator that the others are held against."""
    record_sizes: tuple[int, ...]
    """n_x of the records; the largest is the reference."""
    starts: int
    """Independent starts of each record."""
    event_floors: tuple[float, ...]
    """Event floors in node spacings; the smallest is the reference."""
    time_steps: tuple[float, ...]
    """Time steps of RK4, in s."""
    half_widths: tuple[float, float, int]
    """Narrowest and widest contact on each operator, a/L_x, and how many there are."""
    repeats: int
    """Repetitions of a short timing; the shortest counts."""


POINT: Final = "frictionless"
POINTLESS: Final = "has no accuracy: what is held at one node gives way without limit as rows get finer"

FULL: Final = Effort(
    sizes=(17, 33, 65, 129, 257, 513),
    reference_size=1025,
    record_sizes=(33, 65, 129, 257, 513),
    starts=4,
    event_floors=(1e-12, 1e-8, 1e-7, 1e-6, 1e-5),
    time_steps=(1e-6, 3e-7, 1e-7, 3e-8, 1e-8),
    half_widths=(0.04, 0.42, 24),
    repeats=3,
)
QUICK: Final = Effort(
    sizes=(17, 33),
    reference_size=65,
    record_sizes=(17, 33),
    starts=3,
    event_floors=(1e-6, 1e-5),
    time_steps=(1e-6, 3e-7),
    half_widths=(0.2, 0.4, 3),
    repeats=1,
)


def default_setup() -> Setup:
    """The paper's case (§3): R/L_x = 200, μ_i = 0.5, 2000 events at 129 nodes, and its drive."""
    return Setup("The paper's case", Case(), (Slab(),), NamedDrive("paper"), Scales())


def setup_of(manifest: Manifest) -> Setup:
    """A campaign's first case and first drive (the paper's where it has none), and all its slabs that can be measured.

    Raises ManifestError.
    """
    cases = expand(manifest)
    first = cases[0].case
    if first is None:
        raise ManifestError.in_file(manifest.path, remark=f"its first case is no case: {cases[0].outcome.message}")
    if first.pin != "parabola":
        raise ManifestError.of("pin", first.pin, "a parabola, with which accuracy is measured")
    if first.slab.support == POINT:
        raise ManifestError.of("support", POINT, remark=POINTLESS)
    bodies = [each.case.slab for each in cases if each.case]
    slabs = dict.fromkeys(slab if slab.scheme.endless else discretized(slab, {}) for slab in bodies)
    drive = next((each.drive for each in manifest.drives if each.drive), NamedDrive("paper"))
    return Setup(manifest.title, first, tuple(slab for slab in slabs if slab.support != POINT), drive, manifest.scales)


def contacts(effort: Effort) -> tuple[float, ...]:
    """Half-widths of the contacts on each operator, a/L_x, increasing by equal factors."""
    return tuple(float(f"{width:.6g}") for width in np.geomspace(*effort.half_widths))


def on(case: Case, **discretization: object) -> Case:
    """The case on its slab with another grid, the scheme's own values for what is not given. Raises InvalidInput."""
    return replace(case, slab=discretized(case.slab, discretization))


# One diagram's numbers: a row for each setting, with its time and its errors.

Row = Mapping[str, Value]


@dataclass(frozen=True, slots=True)
class Diagram:
    """Table of results over one setting or several; every row has the same columns."""

    title: str
    reference: str
    """Reference of the errors."""
    series: str
    """Column whose values distinguish curves of a diagram."""
    shown: tuple[str, ...]
    """Columns of its table; an uncertainty is shown with its value."""
    error: str
    """Column of the error in the diagram."""
    rivals: bool
    """True if rows of different series compete; series that answer different questions have a front each."""
    rows: tuple[Row, ...]

    @property
    def file(self) -> str:
        """Name of its table."""
        return f"{self.title.lower().replace(' ', '_')}.csv"

    @property
    def groups(self) -> list[NDArray[np.bool_]]:
        """Masks of the rows that are rivals."""
        if self.rivals:
            return [np.ones(len(self.rows), dtype=np.bool_)]
        series = self.column(self.series)
        return [series == name for name in dict.fromkeys(series.tolist())]

    @property
    def on_front(self) -> NDArray[np.bool_]:
        """Mask of the rows that no rival beats in time and error."""
        marked = np.zeros(len(self.rows), dtype=np.bool_)
        time, error = self.column("seconds"), self.column(self.error)
        for group in self.groups:
            marked[group] = pareto_front(time[group], error[group])
        return marked

    def column(self, name: str) -> NDArray[np.generic]:
        """One column, shape (rows,)."""
        return np.array([row[name] for row in self.rows])


# The surface compliance of a slab: scheme × n_x × grading.

Vector = NDArray[np.float64]

DISPLACEMENT: Final = 3e-4
"""Displacement of the record whose time counts as the cost of using an operator, in L_x."""
OF_OPERATORS: Final = ("normal_compliance", "tangential_compliance", "stiffness", "approach", "half_width", "pressure")
"""Quantities whose largest error is the error of an operator: energies of an elliptic pressure and of an elliptic shear,
lateral stiffness K of the stuck contact, and approach, half-width (from the second moment) and largest pressure of
frictionless contact."""
COUPLING: Final = "coupling"
GRADINGS: Final[tuple[dict[str, int], ...]] = (
    {"coarsest_row": 5},
    {"coarsest_row": 9},
    {"coarsest_row": 33},
    {"coarsest_row": 65},
    {"rows_per_level": 1},
    {"rows_per_level": 4},
    {"rows_per_level": 4, "coarsest_row": 33},
)
"""Gradings of the Galerkin scheme that are tried besides its own."""
REFERENCE: Final[dict[str, Any]] = {"scheme": "galerkin", "coarsest_row": 129, "rows_per_level": 4}
"""Discretization of the reference; its n_x is the effort's."""


def discretizations(slab: Slab, size: int) -> Iterator[Slab]:
    """Discretize a body at one n_x: a surface without ends in its one way, a slab by every grid scheme and grading."""
    if slab.scheme.endless:
        yield replace(slab, n_x=size)
        return
    ways: list[dict[str, Any]] = [
        {"scheme": name} for name, kind in SCHEMES.items() if kind.continuum and not kind.endless
    ]
    for way in ways + [{"scheme": "galerkin", **grading} for grading in GRADINGS]:
        with suppress(InvalidInput):  # rows finer than the surface
            yield discretized(slab, {"n_x": size, **way})


def reference_slab(slab: Slab, size: int) -> Slab:
    """Discretize the same body as finely as possible, its rows no coarser than the surface allows."""
    if slab.scheme.endless:
        return replace(slab, n_x=size)
    coarsest = min(size, REFERENCE["coarsest_row"])
    return discretized(slab, {"n_x": size, **REFERENCE, "coarsest_row": coarsest})


@dataclass(frozen=True, slots=True)
class Tried:
    """A discretization: its processor times in s, and half-width of the contact -> observable -> value."""

    slab: Slab
    seconds: float
    """Time to compute the compliance, in s."""
    record_seconds: float
    """Time to slide the reference displacement on it, in s."""
    values: Mapping[float, Mapping[str, float]]


def measure_elastic_operator(setup: Setup, effort: Effort) -> tuple[Diagram, tuple[Measured, ...]]:
    """Errors and times of every discretization: the diagram of the first slab, its errors the largest of all contacts about
    as wide as the setup's own; the front of all slabs and contacts, no error smaller than the reference's own doubt."""
    widths = contacts(effort)
    own = float(np.clip(hertz_half_width(setup.case), widths[0], widths[-1]))
    near = [width for width in widths if alike(width, own)]
    rows: list[Row] = []
    measured: list[Measured] = []
    reference = ""
    for slab in setup.slabs:
        truth, doubt = _reference(slab, effort, widths)
        for tried in _every(setup, slab, effort):
            errors = {width: relative_errors(tried.values[width], truth[width]) for width in widths}
            times = {"seconds": tried.seconds, "record_seconds": tried.record_seconds}
            sure = tuple(max(_worst(errors[width]), doubt[width]) for width in widths)
            measured.append(Measured(tried.slab, sum(times.values()), sure))
            if slab == setup.slabs[0]:
                worst = {name: max(errors[width][name] for width in near) for name in errors[near[0]]}
                rows.append({**_knobs(tried.slab), **times, **worst, "error": _worst(worst)})
                reference = _words(reference_slab(slab, effort.reference_size), max(doubt[width] for width in near))
    return _sheet(reference, tuple(rows)), tuple(measured)


def _reference(
    slab: Slab, effort: Effort, widths: tuple[float, ...]
) -> tuple[dict[float, dict[str, float]], dict[float, float]]:
    """Half-width of the contact -> the finest observables, and their distance from those of a surface half as fine."""
    sizes = (effort.reference_size, (effort.reference_size + 1) // 2)
    fine, coarse = (observables_on(surface_compliance(reference_slab(slab, size)), widths) for size in sizes)
    return fine, {width: _worst(relative_errors(coarse[width], fine[width])) for width in widths}


def _every(setup: Setup, slab: Slab, effort: Effort) -> Iterator[Tried]:
    """Yield every discretization once: on some slabs and sizes different words mean the same grid."""
    for each in dict.fromkeys(each for size in effort.sizes for each in discretizations(slab, size)):
        yield from _try(setup, each, effort)


def relative_errors(values: Mapping[str, float], truth: Mapping[str, float]) -> dict[str, float]:
    """Observable -> |value/truth - 1|."""
    return {name: abs(values[name] / truth[name] - 1.0) for name in values}


def observables_on(compliance: Compliance, half_widths: Iterable[float]) -> dict[float, dict[str, float]]:
    """Half-width of the contact -> observable -> value, dimensionless, at a load of 1e-3 G·L_x·L_y."""
    return {width: {**_energies(compliance, width), **_contact(compliance, width)} for width in half_widths}


def _energies(compliance: Compliance, half_width: float) -> dict[str, float]:
    """Energies of unit elliptic loads, and the work of an odd shear on what an elliptic pressure moves sideways."""
    x, n = compliance.x, compliance.slab.n_x
    even = nodal_forces(x, half_width)
    odd = even * x / half_width
    c = compliance.matrix
    return {
        "normal_compliance": 0.5 * float(even @ c[n:, n:] @ even),
        "tangential_compliance": 0.5 * float(even @ c[:n, :n] @ even),
        COUPLING: float(odd @ c[:n, n:] @ even),
    }


def nodal_forces(x: Vector, half_width: float) -> Vector:
    """Nodal forces (n,) of a unit load q = 2/(πa)·√(1 - (x/a)²): what each node's width of surface carries, and its moment.

    Linear between nodes: f_i = ∫ q·hat_i dx, so that the sum is 1 whatever the spacing.
    """
    s = np.clip(x / half_width, -1.0, 1.0)
    root = np.sqrt(1.0 - s**2)
    # Twice the integral of q: ∫∫q = x·(½ + (s√(1-s²) + asin s)/π) - ∫x q dx.
    share = 0.5 + (s * root + np.arcsin(s)) / np.pi
    moment = -2.0 * half_width / (3.0 * np.pi) * root**3
    second = x * share - moment
    slope = np.diff(second) / np.diff(x)
    return np.diff(slope, prepend=share[0], append=share[-1])


def _contact(compliance: Compliance, half_width: float) -> dict[str, float]:
    """Frictionless contact of a parabola, and the lateral stiffness of its stuck nodes."""
    slab, normal_load = compliance.slab, 1e-3
    radius = np.pi * half_width**2 / (2.0 * normal_load * (1.0 - slab.poisson))
    state = initial_contact(
        Case(radius=radius, normal_load=normal_load, slab=slab, initial_contact="frictionless"), compliance
    )
    if not state.outcome.ok:
        return dict.fromkeys(("stiffness", "approach", "half_width", "pressure"), math.nan)
    normal = -state.nodal_force[1] / normal_load
    return {
        "stiffness": lateral_stiffness(compliance, np.flatnonzero(state.contact)),
        "approach": state.approach,
        "half_width": 2.0 * math.sqrt(float(normal @ compliance.x**2)),
        "pressure": float(state.pressure.max()) / normal_load,
    }


def lateral_stiffness(compliance: Compliance, nodes: NDArray[np.int64]) -> float:
    """K = dF/dδ_p of nodes that all stick, the load constant and the approach free (Eq. 15), in G·L_y."""
    m, rows = len(nodes), np.concatenate((nodes, nodes + compliance.slab.n_x))
    pressed = np.concatenate((np.zeros(m), np.ones(m)))[:, None]
    bordered = np.block([[compliance.matrix[np.ix_(rows, rows)], pressed], [pressed.T, np.zeros((1, 1))]])
    moved = np.concatenate((np.ones(m), np.zeros(m + 1)))
    return float(np.linalg.solve(bordered, moved)[:m].sum())


def _try(setup: Setup, slab: Slab, effort: Effort) -> Iterator[Tried]:
    """The discretization measured, or nothing where the slab or its contact has no answer in it."""
    case = replace(setup.case, slab=slab, max_events=None, max_displacement=DISPLACEMENT)
    try:
        compliance, seconds = timed(partial(surface_compliance, slab), effort.repeats)
    except SolverError:
        return
    values = observables_on(compliance, contacts(effort))
    _, record_seconds = timed(partial(slide, case, compliance), effort.repeats)
    if not any(math.isnan(value) for each in values.values() for value in each.values()):
        yield Tried(slab, seconds, record_seconds, values)


def _worst(errors: Mapping[str, float]) -> float:
    """The largest error, the coupling's left out."""
    return max(errors[name] for name in OF_OPERATORS)


def _words(slab: Slab, doubt: float) -> str:
    """The reference and its doubt."""
    grid = ", ".join(f"{name} = {value}" for name, value in settings(slab).items() if value is not None)
    return f"{grid}; one with a surface half as fine differs from it by {doubt:.1e}"


def _knobs(slab: Slab) -> dict[str, Value]:
    """Settings that discretize a slab; numbers that its scheme does not have are NaN, words empty."""
    kinds: tuple[Any, ...] = tuple(SCHEMES.values())
    words = {item.name for kind in kinds for item in fields(kind) if choices_of(item.type)}
    nothing = {name: "" if name in words else math.nan for name in settings(slab)}
    return {name: nothing[name] if value is None else value for name, value in settings(slab).items()}


def _sheet(reference: str, rows: tuple[Row, ...]) -> Diagram:
    grid, times = ("n_x", "scheme", "rows_per_level", "coarsest_row"), ("seconds", "record_seconds")
    shown = (*grid, *times, "error", *OF_OPERATORS, COUPLING)
    return Diagram("Elastic operator", reference, "scheme", shown, "error", rivals=True, rows=rows)


# Slip numerics: n_x and the event floor against what is read off a friction record and a drive.
#
# A record is chaotic: a change in the last digit gives another record, so a distance between settings is one between
# distributions: of means over independent starts. It is given twice: as it is, and over their combined ±.

OBSERVABLES: Final = ("plateau", "static", "kinetic", "step")
"""Mean of F/W on the plateau, μ_s, μ_k, and the mean displacement per event over L_x."""

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
    means = {name: mean_of(np.array([one[name] for one in each])) for name in OBSERVABLES}
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
    values = dict.fromkeys(OBSERVABLES, math.nan) | {"step": event_statistics(record).mean_step}
    plateau = plateau_of(record)
    if plateau.outcome.ok:
        _, friction = measured(record, plateau, setup.drive.dimensionless(setup.scales))
        means = (plateau.mean, friction.static_friction, friction.kinetic_friction)
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


def _sheet_of_slip(rows: tuple[Row, ...]) -> Diagram:
    plateau, others = ("plateau", "plateau_difference", "plateau_distance"), ("static", "static_distance", "kinetic")
    return Diagram(
        title="Slip numerics",
        reference="the largest n_x and the smallest event floor of this table",
        series="knob",
        shown=("knob", "value", "seconds", *plateau, *others, "step", "step_distance"),
        error="plateau_difference",
        rivals=False,
        rows=rows,
    )


# The dynamic stage: RK4's steps against the exact integrator, from crossing to crossing of the friction profile.

SAMPLES: Final = 2000


def measure_integrators(setup: Setup, effort: Effort) -> Diagram:
    """Errors and times of every integrator over the setup's record. Raises SolverError if it has no plateau.

    RK4 runs the whole drive; a step that is refused as unstable has no row.
    """
    record = slide(setup.case, surface_compliance(setup.case.slab))
    in_si = replace(setup.drive.in_si, integrator=Exact(), samples=SAMPLES)
    drive = replace(setup.drive, in_si=in_si).dimensionless(setup.scales)
    profile = friction_limit_of(record, plateau_of(record), drive.profile)

    def run(integrator: Exact | RK4) -> tuple[DynamicsResult, float]:
        """The drive with another integrator, and its processor time."""
        own = replace(drive, integrator=integrator)
        return timed(partial(integrate, profile, own, record.initial_stiffness), effort.repeats)

    truth, seconds = run(Exact())
    rows: list[Row] = [{"integrator": "exact", "step": 0.0, "seconds": seconds, "spring_force": 0.0, "velocity": 0.0}]
    unit = setup.scales.time(setup.drive.pin_mass)
    for step in effort.time_steps if drive.surface_compliance else ():
        found, seconds = run(RK4(step / unit))
        if found.outcome.ok:
            errors = {name: _apart(getattr(found, name), getattr(truth, name)) for name in ("spring_force", "velocity")}
            rows.append({"integrator": "rk4", "step": step, "seconds": seconds, **errors})
    return Diagram(
        title="Dynamics",
        reference="the exact integrator, which tests compare with DOP853",
        series="integrator",
        shown=("integrator", "step", "seconds", "spring_force", "velocity"),
        error="velocity",
        rivals=True,
        rows=tuple(rows),
    )


def _apart(found: NDArray[np.float64], truth: NDArray[np.float64]) -> float:
    """Root mean square difference over the root mean square of the truth."""
    return float(np.sqrt(np.mean((found - truth) ** 2) / np.mean(truth**2)))


# Diagrams as tables: on the terminal, and as CSV.

MARK = "*"


def as_table(diagram: Diagram) -> Table:
    """All rows of a diagram, a value and its uncertainty in one cell; the rows on the front are marked."""
    keys = words_of("numerics")  # stay as they are written
    header = [name if name in keys else name.replace("_", " ") for name in diagram.shown]
    rows = (
        (*(_cell(row[name], row.get(f"{name}_uncertainty")) for name in diagram.shown), MARK if marked else "")
        for row, marked in zip(diagram.rows, diagram.on_front, strict=True)
    )
    return Table((*header, "front"), tuple(rows))


def as_csv(diagram: Diagram) -> str:
    """The table of a diagram."""
    table = as_table(diagram)
    return rows_as_csv((table.header, *table.rows))


def as_markdown(measurement: "Measurement") -> str:
    """The machine of the measurement, and each diagram's reference and file."""
    on = ", ".join(f"{name} {value}" for name, value in machine().items())
    parts = [f"# {measurement.title}\n\nMeasured with: {on}. {MARK}: on the front.\n"]
    parts += [f"- [{each.title}]({each.file}). Reference: {each.reference}." for each in measurement.diagrams]
    return "\n".join(parts) + "\n"


def _cell(value: Value, uncertainty: Value | None) -> str:
    if not isinstance(value, float):
        return str(value)
    if math.isnan(value):
        return "–"
    if isinstance(uncertainty, float) and math.isfinite(uncertainty):
        return with_error(value, uncertainty)
    return f"{value:.3g}"


# Work-precision measurement: error against processor time, one panel a diagram, the Pareto front as a line.


def draw(diagrams: Sequence[Diagram]) -> bytes:
    """All diagrams side by side, as PNG."""
    with column(3.4, 1.4 * COLUMN * len(diagrams)) as figure:
        for axes, diagram in zip(np.atleast_1d(figure.subplots(1, len(diagrams))), diagrams, strict=True):
            _draw(axes, diagram)
        return image(figure, "png")


def _draw(axes: Any, diagram: Diagram) -> None:
    """A panel. The reference, without error, is at the lower edge."""
    time, error = (diagram.column(name).astype(float) for name in ("seconds", diagram.error))
    series = diagram.column(diagram.series)
    floor = 0.3 * np.nanmin(error[error > 0.0], initial=np.inf)
    shown = np.where(error == 0.0, floor, error)
    for marker, name in zip(MARKERS, dict.fromkeys(series.tolist()), strict=False):
        mine = series == name
        axes.loglog(time[mine], shown[mine], marker, label=str(name), markersize=3, alpha=0.8)
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
    axes.legend()


TITLE: Final = "What accuracy costs in time"


@dataclass(frozen=True, slots=True)
class Measurement:
    """Results of all measurements."""

    title: str
    diagrams: tuple[Diagram, ...]
    contacts: tuple[float, ...]
    """Half-widths of the contacts on each operator, a/L_x."""
    front: tuple[Measured, ...]
    """Every discretization of every slab of the setup under each of these contacts."""
    remark: str
    """Reason why a value could not be measured; empty if none."""


def measure(setup: Setup, effort: Effort) -> Measurement:
    """Measure every setting: first all once, for compilation, then with the requested effort."""
    if effort is not QUICK:
        measure(setup, QUICK)
    operator, front = measure_elastic_operator(setup, effort)
    diagrams, remark = [operator, measure_slip_numerics(setup, effort)], ""
    try:
        diagrams.append(measure_integrators(setup, effort))
    except SolverError as error:  # a record without a plateau drives no pin
        remark = f"dynamics: {error}"
    return Measurement(f"{TITLE}: {setup.title}", tuple(diagrams), contacts(effort), front, remark)


def write(measurement: Measurement, out: Path, front: Path | None = None) -> list[Path]:
    """Write tables and picture to `out`, and the front where it is wanted; returns the files. Raises StoreError."""
    contents = {
        out / "accuracy.md": as_markdown(measurement).encode(),
        out / "accuracy.png": draw(measurement.diagrams),
        **{out / each.file: as_csv(each).encode() for each in measurement.diagrams},
    }
    if front is not None:
        contents[front] = as_text(machine(), measurement.contacts, measurement.front).encode()
    write_files(contents)
    return list(contents)
