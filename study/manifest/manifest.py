"""The content of a campaign file as frozen values."""

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
KNOWABLE: dict[str, Stage] = {"plateau_mean": "slip", "static_friction": "dynamics", "kinetic_friction": "dynamics"}
"""Variable of the dataset that an ensemble can be asked to know -> the stage that yields it."""
FIRST_MEMBERS = 4
"""Of an ensemble that gets members until it knows enough: each further batch is as many as there are."""
MOST_DOUBLED = 8192
"""The most members of such an ensemble: twice as many would be more than MOST_MEMBERS."""
VARIED = ("start", "seed")
"""The parameters in which the members of an ensemble differ."""
SEEDS = 2**32
"""Difference between the seeds of two successive members; large, so that seeds of an axis do not coincide with them."""


def is_share(value: Any) -> bool:
    """Whether it is a number between 0 and 1, both excluded."""
    return isinstance(value, int | float) and not isinstance(value, bool) and 0.0 < value < 1.0


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


@dataclass(frozen=True, slots=True)
class Outputs:
    """What the dataset holds besides the scalars of each case."""

    records: bool = True
    """Friction records, event by event."""
    statistics: bool = False
    """Distributions of the sizes of events: exponents, cut-offs, goodness of fit, correlations."""
    trajectory: bool = True
    """Position, velocity and forces of each drive over time."""
    phases: bool = True
    """Start and end of each macroscopic slip of a drive; as `trajectory` is where it is not given."""
    fit: bool = True
    """Eq. 16-19 fitted to the spring force of each drive."""
    tractions: bool = False
    """Pressure and shear of the slab's surface after initial contact; on by default where `contact` is the only stage."""
    tractions_at: tuple[int, ...] = ()
    """Events after which pressure, shear, slip and gap are kept too; 0 is initial contact."""
    subsurface: bool = False
    """Displacements and stresses inside the slab, after initial contact or after the events of `tractions_at`."""

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
    """An ensemble of every case: its members differ in the pin's start, and in the seed where the nodes' μ_i are drawn.

    members: their number, 1 to MOST_MEMBERS; 1 is no ensemble. The starts are spread evenly over one node spacing, from the
    case's own start on. Where `spread` is not 0, every member has a seed of its own.

    uncertainty: of the observable's mean, relative, 0 < uncertainty < 1: members are added until it is at most that, with every
    drive, and `members` are the most. They come in batches, each as many as all before it and half way between their starts.
    observable: one of KNOWABLE.
    """

    members: int = 1
    uncertainty: float | None = None
    observable: str = "plateau_mean"

    def __post_init__(self) -> None:
        if not (_is_whole(self.members) and 1 <= self.members <= MOST_MEMBERS):
            raise InvalidInput(f"members = {shown(self.members)}: needs a whole number from 1 to {MOST_MEMBERS}")
        observable: Any = self.observable
        if not isinstance(observable, str) or observable not in KNOWABLE:
            raise InvalidInput(f"observable = {shown(observable)}: needs one of {', '.join(KNOWABLE)}")
        if self.uncertainty is None:
            return
        if not is_share(self.uncertainty):
            raise InvalidInput(
                f"uncertainty = {shown(self.uncertainty)}: needs a relative uncertainty, 0 < uncertainty < 1"
            )
        if self.members.bit_count() != 1 or not FIRST_MEMBERS <= self.members <= MOST_DOUBLED:
            allowed = (
                f"a power of two from {FIRST_MEMBERS} to {MOST_DOUBLED} beside uncertainty, as members are doubled"
            )
            raise InvalidInput(f"members = {shown(self.members)}: needs {allowed}")

    def batch(self, member: int) -> int:
        """The batch of a member, from 0. A later batch is computed only if the earlier ones do not reach the target."""
        return 0 if self.uncertainty is None else (member // FIRST_MEMBERS).bit_length()

    def varied(self, case: Case, member: int) -> dict[str, Value]:
        """The parameters in which a member differs from the case, by field name. member: its number, from 0."""
        phase = member / self.members if self.uncertainty is None else halving(member)
        start = (case.start + phase) % 1.0 if member else case.start
        drawn = case.heterogeneity
        changes: dict[str, Value] = {"start": start}
        return changes | ({"seed": drawn.seed + member * SEEDS} if drawn.spread else {})


def halving(number: int) -> float:
    """0, 1/2, 1/4, 3/4, 1/8, 5/8, …: the first 2, 4, 8, … of them are spread evenly (its bits mirrored: van der Corput)."""
    return int(f"{number:b}"[::-1], 2) / 2.0 ** number.bit_length()


@dataclass(frozen=True, slots=True)
class Manifest:
    """A checked campaign. Parameters are listed by field name, their values have the declared type."""

    path: Path
    text: str
    """Text of the campaign file."""
    table_text: str | None
    """Text of the table of cases; None unless the design is `table`."""
    profile_text: str | None
    """Text of the file of the pin's roughness; None where the pin is smooth."""
    sha256: str
    """SHA-256 of the bytes of the campaign file, the table and the roughness, one after the other."""
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
    task_seconds: float | None
    """Seconds after which a task is taken to hang; None where the estimate of its cost decides."""
    scales: Scales
    drives: tuple[CampaignDrive, ...]
    """Table by table, each at every point of the drive axes, the last axis fastest."""
    outputs: Outputs
    ensemble: Ensemble = Ensemble()
    accuracy: float | None = None
    """Relative error asked for instead of a discretization (see study.discretization.front)."""
    front: Path | None = None
    """File of the measured front to choose the discretization from; None for the one that comes with this package."""
    front_text: str | None = None
    """Text of that file."""
    drive_axes: Mapping[str, tuple[Value, ...]] = field(default_factory=dict)
    """Parameter of a drive -> its values."""
    drives_left_out: tuple[str, ...] = ()
    """Names of the file's drives where the stages leave out `dynamics`; `drives` is empty then."""

    @property
    def name(self) -> str:
        """The campaign's short name: its file name without the ending."""
        return self.path.stem

    @property
    def fixed(self) -> dict[str, Value]:
        """The parameters that the tables give, by field name: the same for all cases."""
        tables = (self.constants, self.numerics, self.slip_rule, self.effects, self.heterogeneity, self.limits)
        return {name: value for table in tables for name, value in table.items()}


def _increasing(value: Any) -> bool:
    """Whether it is a list of whole numbers from 0 to the most events of a record, each larger than the one before it."""
    if not isinstance(value, list | tuple) or not all(map(_is_whole, value)):
        return False
    return all(before < after for before, after in itertools.pairwise([-1, *value, MOST_EVENTS + 1]))


def field_names(kind: type) -> tuple[str, ...]:
    """The names of a dataclass's fields, in their order."""
    return tuple(item.name for item in fields(kind))
