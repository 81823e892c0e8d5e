"""The physics on which accuracy is measured, and the extent of the measurement."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from nanoslip.solver.case import Case
from nanoslip.solver.drive import Scales
from nanoslip.solver.slab import Slab
from nanoslip.study.manifest.cases import expand
from nanoslip.study.manifest.manifest import Manifest, NamedDrive
from nanoslip.study.manifest.problems import ManifestError
from nanoslip.study.plan.grids import discretized


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
    members: tuple[int, ...]
    """Members with records of the usual length, increasing."""
    lengths: tuple[float, ...]
    """Lengths of records in presliding lengths, increasing; the last is the reference."""
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
    members=(3, 8, 16, 32, 64),
    lengths=(3.0, 4.0, 8.0, 16.0, 32.0),
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
    members=(3, 6),
    lengths=(3.0, 8.0),
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
