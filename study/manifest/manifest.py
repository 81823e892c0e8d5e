"""A campaign as its author wrote it: what a manifest says, as frozen values."""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Literal, get_args

from solver.case import MOST_EVENTS, Case
from solver.drive import Scales
from solver.outcome import InvalidInput, quoted
from study.manifest.drives import CampaignDrive
from study.manifest.parameters import Value
from study.manifest.problems import shown

Stage = Literal["contact", "slip", "dynamics"]
Design = Literal["product", "zip", "table"]
STAGES: tuple[Stage, ...] = get_args(Stage)
MOST_MEMBERS = 10_000
VARIED = ("start", "seed")
"""Parameters in which members of an ensemble differ."""
SEEDS = 2**32
"""Distance between the seeds of members: nobody's axis of seeds meets another member's."""


@dataclass(frozen=True, slots=True)
class Outputs:
    """What the dataset holds besides the scalars of each case."""

    records: bool = True
    """Friction records, event by event."""
    trajectory: bool = True
    """Position, velocity and forces of each drive over time."""
    phases: bool = True
    """Start and end of each macroscopic slip of a drive; like `trajectory` where it is not given."""
    fit: bool = True
    """Eq. 16-19 fitted to the spring force of each drive."""
    tractions: bool = False
    """Pressure and shear of the slab's surface after initial contact; on by itself where nothing follows."""
    tractions_at: tuple[int, ...] = ()
    """Events after which pressure, shear, slip and gap are kept too; 0 is initial contact."""
    subsurface: bool = False
    """Displacements and stresses inside the slab, after initial contact or after those events."""

    def __post_init__(self) -> None:
        for name in field_names(Outputs):
            value: Any = getattr(self, name)
            if name == "tractions_at":
                if not _increasing(value):
                    raise InvalidInput(
                        f"{name} = {quoted(value)}: needs a list of events, increasing from 0 to {MOST_EVENTS}"
                    )
                object.__setattr__(self, name, tuple(value))
            elif not isinstance(value, bool):
                raise InvalidInput(f"{name} = {quoted(value)}: needs true or false")


@dataclass(frozen=True, slots=True)
class Ensemble:
    """Members of every case: the same physics with the pin started elsewhere, and other nodes where their μ_i are drawn.

    members: how many, 1 to MOST_MEMBERS. Their starts are spread evenly over a node spacing from the case's own on; with a
    `spread` every member has a seed of its own. 1 is no ensemble.
    """

    members: int = 1

    def __post_init__(self) -> None:
        count: Any = self.members
        if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MOST_MEMBERS:
            raise InvalidInput(f"members = {shown(count)}: needs a whole number from 1 to {MOST_MEMBERS}")

    def varied(self, case: Case, member: int) -> dict[str, Value]:
        """The parameters in which a member differs from the case."""
        start = (case.start + member / self.members) % 1.0 if member else case.start
        drawn = case.heterogeneity
        changes: dict[str, Value] = {"start": start}
        return changes | ({"seed": drawn.seed + member * SEEDS} if drawn.spread else {})


@dataclass(frozen=True, slots=True)
class Manifest:
    """A campaign as its author wrote it, checked. Parameters go by field name and have their declared type."""

    path: Path
    text: str
    """The campaign file."""
    table_text: str | None
    """The table of cases, with design `table`."""
    profile_text: str | None
    """The pin's roughness, where there is one."""
    sha256: str
    """Of the campaign file's bytes followed by the table's and the roughness's."""
    title: str
    stages: tuple[Stage, ...]
    design: Design
    axes: Mapping[str, tuple[Value, ...]]
    """Parameter -> its values; with `zip` and `table` the i-th values of all axes are one case."""
    constants: Mapping[str, Value]
    numerics: Mapping[str, Value]
    slip_rule: Mapping[str, Value]
    effects: Mapping[str, Value]
    heterogeneity: Mapping[str, Value]
    limits: Mapping[str, Value]
    scales: Scales
    drives: tuple[CampaignDrive, ...]
    """Table by table, each at every point of the drive axes, the last axis fastest."""
    outputs: Outputs
    ensemble: Ensemble = Ensemble()
    accuracy: float | None = None
    """The error asked for instead of a discretization (see study.discretization.front)."""
    front: Path | None = None
    """The measured front to choose from; None for this package's."""
    front_text: str | None = None
    """That front's file."""
    drive_axes: Mapping[str, tuple[Value, ...]] = field(default_factory=dict)
    """Parameter of a drive -> its values."""
    drives_left_out: tuple[str, ...] = ()
    """Names of the drives that the file has and the stages leave out; `drives` is empty then."""

    @property
    def name(self) -> str:
        """The campaign's short name: its file name without the ending."""
        return self.path.stem

    @property
    def fixed(self) -> dict[str, Value]:
        """The parameters that were given and are the same in all cases."""
        tables = (self.constants, self.numerics, self.slip_rule, self.effects, self.heterogeneity, self.limits)
        return {name: value for table in tables for name, value in table.items()}


def _increasing(value: Any) -> bool:
    """Whether it is a list of whole numbers from 0 to the most events of a record, each larger than the one before it."""
    if not isinstance(value, list | tuple) or any(isinstance(one, bool) or not isinstance(one, int) for one in value):
        return False
    return all(before < after for before, after in itertools.pairwise([-1, *value, MOST_EVENTS + 1]))


def field_names(kind: type) -> tuple[str, ...]:
    """The names of a dataclass\'s fields."""
    return tuple(item.name for item in fields(kind))
