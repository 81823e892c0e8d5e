"""The physics on which accuracy is measured, and the extent of the measurement."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from nanoslip.solver.case import Case
from nanoslip.solver.contact.pin import estimate_half_width
from nanoslip.solver.drive import Scales
from nanoslip.solver.slab import PHYSICS, Slab
from nanoslip.study.manifest import parameters
from nanoslip.study.manifest.cases import expand
from nanoslip.study.manifest.manifest import Manifest, NamedDrive
from nanoslip.study.manifest.problems import ManifestError


@dataclass(frozen=True, slots=True)
class Setup:
    """The physics on which every knob is turned."""

    title: str
    case: Case
    drive: NamedDrive
    scales: Scales


@dataclass(frozen=True, slots=True)
class Effort:
    """Extent of a measurement: sizes, starts, time steps and repetitions."""

    sizes: tuple[int, ...]
    """n_x of the operators, increasing."""
    reference_size: int
    """n_x of the reference operator."""
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
    """Narrowest and widest contact, a/L_x, and how many there are; operators have those like the case's own."""
    repeats: int
    """Repetitions of a short timing; the shortest counts."""


POINTLESS: Final = "has no accuracy: what is held at one node gives way without limit as rows get finer"

FULL: Final = Effort(
    # 2^N + 1 nodes: each surface has the nodes of the one before.
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

ACROSS_BALL: Final = (13, 17, 25, 33)
"""n_x of a ball: the number of nodes in contact grows as the square of n_x, and time faster than the square of the
nodes."""


def measurement_effort(case: Case, quick: bool) -> Effort:
    """The extent of a measurement of a case; of a ball, with a square of nodes for each row, fewer and coarser ones."""
    effort = QUICK if quick else FULL
    if quick or "y" not in case.slab.layout.AXES:
        return effort
    return replace(
        effort,
        sizes=ACROSS_BALL,
        reference_size=QUICK.reference_size,
        record_sizes=ACROSS_BALL,
        members=FULL.members[:3],
        lengths=FULL.lengths[:3],
    )


def warm_up_setup(effort: Effort) -> Effort:
    """The first of everything: it runs, and so compiles or loads, all that the whole effort times."""
    return replace(
        effort,
        sizes=effort.sizes[:1],
        reference_size=effort.sizes[0],
        record_sizes=effort.record_sizes[:1],
        starts=effort.members[0],
        event_floors=effort.event_floors[-1:],
        time_steps=effort.time_steps[:1],
        members=effort.members[:1],
        lengths=effort.lengths[:1],
        repeats=1,
    )


def default_setup() -> Setup:
    """The paper's case (§3): R/L_x = 200, μ_i = 0.5, 2000 events at 129 nodes, and its drive."""
    return Setup("The paper's case", Case(), NamedDrive("paper"), Scales())


def make_setup(manifest: Manifest) -> Setup:
    """A campaign's first case and first drive (the paper's where it has none). Raises ManifestError."""
    case = expand(manifest)[0]
    first = case.case
    if first is None:
        raise ManifestError.in_file(manifest.path, remark=f"its first case is no case: {case.outcome.message}")
    # Operators are judged by elliptic pressures, which a parabola has.
    if first.pin != "parabola":
        raise ManifestError.of("pin", first.pin, "a parabola, with which accuracy is measured")
    if first.slab.support == "frictionless":
        raise ManifestError.of("support", first.slab.support, remark=POINTLESS)
    drives = (named.drive for named in manifest.drives if named.drive)
    drive = next(drives, NamedDrive("paper"))
    return Setup(manifest.title, first, drive, manifest.scales)


ALIKE_WIDTHS: Final = 1.25
"""Ratio of half-widths up to which contacts are alike. A contact consists of whole nodes, so errors jump as its width grows."""


def contacts(case: Case, effort: Effort) -> tuple[float, ...]:
    """Half-widths of the effort's contacts that are about as wide as a case's own (Hertz), a/L_x."""
    widths = np.geomspace(*effort.half_widths)
    # Clipped, so that also the narrowest and the widest case find contacts like their own.
    half_width = np.clip(estimate_half_width(case), widths[0], widths[-1])
    ratios = np.maximum(widths / half_width, half_width / widths)
    # To six digits: the last bits of a power are rounding.
    return tuple(float(f"{width:.6g}") for width in widths[ratios <= ALIKE_WIDTHS])


def change_discretization(slab: Slab, discretization: Mapping[str, Any]) -> Slab:
    """Change the discretization of a slab, its other settings by default. Raises InvalidInput."""
    physics = {name: getattr(slab, name) for name in PHYSICS}
    return Slab.of({**physics, **discretization})


def discretization_settings(slab: Slab) -> dict[str, Any]:
    """The parameters of a slab's discretization by field name; None for the settings of other schemes."""
    return {name: slab.flat[name] for name in parameters.settings()}


def change_grid(case: Case, **discretization: object) -> Case:
    """The case with another grid; the scheme's defaults for settings that are not given. Raises InvalidInput."""
    return replace(case, slab=change_discretization(case.slab, discretization))
