"""Setup of a measurement: a case, a drive, and the values of every setting."""

import platform
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.drive import Scales
from nanoslip.solver.slab import Slab
from nanoslip.study.manifest.cases import expand
from nanoslip.study.manifest.checker import ManifestError
from nanoslip.study.manifest.manifest import Manifest, NamedDrive
from nanoslip.study.manifest.parameters import Value
from nanoslip.study.origin import here, model
from nanoslip.study.plan.grids import discretized, pareto_front
from nanoslip.study.provenance import UNKNOWN
from nanoslip.study.toml_text import shown

# Processor time, and the machine that it was measured on.

T = TypeVar("T")


def timed(run: Callable[[], T], repeats: int = 1) -> tuple[T, float]:
    """Result of `run`, and the shortest of its processor times in s."""
    shortest = float("inf")
    for _ in range(repeats):
        start = time.process_time()
        result = run()
        shortest = min(shortest, time.process_time() - start)
    return result, shortest


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
    """How far each knob is turned."""

    sizes: tuple[int, ...]
    """n_x of the operators, increasing."""
    reference_size: int
    """n_x of the operator that the others are held against."""
    record_sizes: tuple[int, ...]
    """n_x of the records; the largest is the reference."""
    starts: int
    """Independent starts of each record."""
    event_floors: tuple[float, ...]
    """In node spacings; the smallest is the reference."""
    time_steps: tuple[float, ...]
    """Of RK4, in s."""
    half_widths: tuple[float, float, int]
    """Narrowest and widest contact on each operator, a/L_x, and how many there are."""
    repeats: int
    """Of a short timing; the shortest counts."""


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
        raise ManifestError([f"{manifest.path}: its first case is no case: {cases[0].outcome.message}"])
    if first.pin != "parabola":
        raise ManifestError([f"{manifest.path}: pin = {shown(first.pin)}: accuracy is measured with a parabola"])
    if first.slab.support == POINT:
        raise ManifestError([f"{manifest.path}: support = {shown(POINT)}: {POINTLESS}"])
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
    """Rows of one knob or several; every row has the same columns."""

    title: str
    reference: str
    """What the errors are held against."""
    series: str
    """Column whose values tell curves of a diagram apart."""
    shown: tuple[str, ...]
    """Columns of its table; an uncertainty is shown with its value."""
    error: str
    """Column of the error in the diagram."""
    rivals: bool
    """Whether rows of different series compete: where they do not answer the same question each has its own front."""
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
        """Which rows no rival beats in time and error."""
        marked = np.zeros(len(self.rows), dtype=np.bool_)
        time, error = self.column("seconds"), self.column(self.error)
        for group in self.groups:
            marked[group] = pareto_front(time[group], error[group])
        return marked

    def column(self, name: str) -> NDArray[np.generic]:
        """One column, shape (rows,)."""
        return np.array([row[name] for row in self.rows])
