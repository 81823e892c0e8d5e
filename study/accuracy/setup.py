"""What is measured: a case and a drive, and how much of every knob."""

import platform
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final, TypeVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.case import Case, Heterogeneity
from nanoslip.solver.drive import Scales
from nanoslip.solver.slab import Slab
from nanoslip.study import provenance
from nanoslip.study.manifest.cases import expand
from nanoslip.study.manifest.checker import ManifestError, shown
from nanoslip.study.manifest.manifest import Manifest, NamedDrive
from nanoslip.study.manifest.parameters import Value
from nanoslip.study.origin import model
from nanoslip.study.plan.grids import discretized, pareto_front

# Processor time, and the machine that it was measured on.

T = TypeVar("T")


def timed(run: Callable[[], T], repeats: int = 1) -> tuple[T, float]:
    """What `run` returns and the shortest of its processor times, in s."""
    shortest = float("inf")
    for _ in range(repeats):
        start = time.process_time()
        result = run()
        shortest = min(shortest, time.process_time() - start)
    return result, shortest


def machine() -> dict[str, str]:
    """The processor and the software that times are measured with."""
    return {"processor": model(), "system": platform.system(), **provenance.attributes()}


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
    tolerances: tuple[float, ...]
    """Relative ones, of scipy's adaptive steps."""
    half_widths: tuple[float, float, int]
    """Narrowest and widest contact on each operator, a/L_x, and how many there are."""
    repeats: int
    """Of a short timing; the shortest counts."""
    members: tuple[int, ...]
    """Of the means whose errors are measured."""
    lengths: tuple[float, ...]
    """Of records, in presliding lengths, increasing; the default one is among them."""
    most_starts: int
    """Members with records of the default and of the largest length."""
    fewer_starts: int
    """Members with records of the other lengths."""


POINT: Final = "frictionless"
POINTLESS: Final = "has no accuracy: what is held at one node gives way without limit as rows get finer"

FULL: Final = Effort(
    sizes=(17, 33, 65, 129, 257, 513),
    reference_size=1025,
    record_sizes=(33, 65, 129, 257, 513),
    starts=4,
    event_floors=(1e-12, 1e-8, 1e-7, 1e-6, 1e-5),
    time_steps=(1e-6, 3e-7, 1e-7, 3e-8, 1e-8),
    tolerances=(1e-4, 1e-8),
    half_widths=(0.04, 0.42, 24),
    repeats=3,
    members=(3, 6, 8, 16, 32, 64),
    lengths=(3.0, 4.0, 6.0, 8.0, 16.0, 32.0),
    most_starts=512,
    fewer_starts=256,
)
QUICK: Final = Effort(
    sizes=(17, 33),
    reference_size=65,
    record_sizes=(17, 33),
    starts=3,
    event_floors=(1e-6, 1e-5),
    time_steps=(1e-6, 3e-7),
    tolerances=(1e-4,),
    half_widths=(0.2, 0.4, 3),
    repeats=1,
    members=(3, 6, 8),
    lengths=(4.0, 8.0, 16.0),
    most_starts=48,
    fewer_starts=24,
)


def default_setup() -> Setup:
    """The paper's case (§3): R/L_x = 200, μ_i = 0.5, 2000 events at 129 nodes, and its drive."""
    return Setup("The paper's case", Case(), (Slab(),), NamedDrive("paper"), Scales())


def digit_setups() -> tuple[Setup, ...]:
    """Cases whose starts differ for different reasons, with the paper's drive: few nodes, unlike nodes, many nodes."""
    few = Case(intrinsic_friction=0.25, normal_load=2.5e-4, slab=Slab(33))
    unlike = Case(slab=Slab(65), heterogeneity=Heterogeneity(spread=0.3))
    cases = {"few nodes": few, "unlike nodes": unlike, "many nodes": Case()}
    return tuple(Setup(title, case, (case.slab,), NamedDrive("paper"), Scales()) for title, case in cases.items())


def setup_of(manifest: Manifest) -> Setup:
    """`first_of` a campaign, of which grids can be measured. Raises ManifestError."""
    setup = first_of(manifest)
    if setup.case.pin != "parabola":
        raise ManifestError([f"{manifest.path}: pin = {shown(setup.case.pin)}: accuracy is measured with a parabola"])
    if setup.case.slab.support == POINT:
        raise ManifestError([f"{manifest.path}: support = {shown(POINT)}: {POINTLESS}"])
    return replace(setup, slabs=tuple(slab for slab in setup.slabs if slab.support != POINT))


def first_of(manifest: Manifest) -> Setup:
    """A campaign's first case and first drive (the paper's where it has none), and all its slabs. Raises ManifestError."""
    cases = expand(manifest)
    first = cases[0]
    if first.case is None:
        raise ManifestError([f"{manifest.path}: its first case is no case: {first.outcome.message}"])
    slabs = dict.fromkeys(discretized(each.case.slab, {}) for each in cases if each.case)
    drive = next((each.drive for each in manifest.drives if each.drive), NamedDrive("paper"))
    return Setup(manifest.title, first.case, tuple(slabs), drive, manifest.scales)


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

    name: str
    """Dimension of the rows in the dataset, and the first word of their variables."""
    title: str
    reference: str
    """What the errors are held against."""
    series: str
    """Column whose values tell curves of a diagram apart."""
    shown: tuple[str, ...]
    """Columns of its table; an uncertainty is shown with its value."""
    error: str
    """Column of the error in the diagram; empty where rows are not to be compared."""
    rivals: bool
    """Whether rows of different series compete: where they do not answer the same question each has its own front."""
    words: Mapping[str, str]
    """Every column -> its meaning."""
    rows: tuple[Row, ...]

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
        if not self.error:
            return marked
        time, error = self.column("seconds"), self.column(self.error)
        for group in self.groups:
            marked[group] = pareto_front(time[group], error[group])
        return marked

    def column(self, name: str) -> NDArray[np.generic]:
        """One column, shape (rows,)."""
        return np.array([row[name] for row in self.rows], dtype=object if name in self.texts else None)

    @property
    def texts(self) -> frozenset[str]:
        """Columns of words."""
        return frozenset(name for row in self.rows for name, value in row.items() if isinstance(value, str))

    def variables(self) -> dict[str, xr.Variable]:
        """The columns as variables of a dataset, and which rows are on the front."""
        found = {
            f"{self.name}_{name}": xr.Variable(self.name, self.column(name), {"long_name": words, "units": _unit(name)})
            for name, words in self.words.items()
        }
        if not self.error:
            return found
        attributes = {"long_name": f"no other row beats it in time and {self.error}", "units": "1"}
        return found | {f"{self.name}_on_front": xr.Variable(self.name, self.on_front.astype(np.int8), attributes)}


def _unit(name: str) -> str:
    return "s" if name in ("seconds", "time_step") else "1"
