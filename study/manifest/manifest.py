"""The content of a campaign file as frozen values, its drives included."""

import dataclasses
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal, Self, get_args

from nanoslip.solver.case import MOST_EVENTS, Case
from nanoslip.solver.drive import (
    ANY_SIZE,
    FREQUENCY,
    PERIODS,
    TRAVEL,
    Drive,
    Scales,
    convert_to_seconds,
    only_length,
    parameters_of_a_drive,
    si_defaults,
)
from nanoslip.solver.ensemble import ALONE, FEWEST, Ensemble, Places
from nanoslip.solver.load_path import LoadPath
from nanoslip.solver.outcome import COMPLETED, LONGEST_MESSAGE, InvalidInput, Outcome
from nanoslip.solver.parameter import MOST_WHOLE, Parameter, declared, parameter, require, validate
from nanoslip.study.manifest.observables import REFERENCE, Observable, require_references
from nanoslip.study.manifest.parameters import OTHER_TABLES, TABLES, YOUNG, Value, as_written, field_names, span
from nanoslip.study.toml_text import ONE_LINE, from_toml, is_one_line, quote_toml

# Who made a campaign and how others may use it: the table [about], for attributes of the dataset. It decides no result.


@dataclass(frozen=True, slots=True)
class About:
    """Authors, licence and DOI, for attributes of the dataset."""

    author: tuple[str, ...] = parameter((), meaning="names of the authors", need="a text, or a list of texts")
    orcid: tuple[str, ...] = parameter((), meaning="ORCID of each author, as a URL", need="a text, or a list of texts")
    licence: str = parameter("", meaning="licence of the dataset", need="an identifier, as CC-BY-4.0, or a URL")
    doi: str = parameter("", meaning="DOI of the dataset, as reserved by an archive", need="a text")

    def __post_init__(self) -> None:
        for name in ("author", "orcid"):
            value: Any = getattr(self, name)
            lines = list(value) if isinstance(value, list | tuple) else [value]
            require(name, value, all(map(_is_line, lines)), declared(About)[name].need)
            object.__setattr__(self, name, tuple(line.strip() for line in lines))
        for name in ("licence", "doi"):
            value = getattr(self, name)
            need = declared(About)[name].need
            require(name, value, value == "" or _is_line(value), need)

    @property
    def attributes(self) -> dict[str, str]:
        """Attributes of a dataset, in the words of ACDD 1.3 (Attribute Convention for Data Discovery), as given."""
        attributes = {
            "creator_name": "; ".join(self.author),
            "creator_url": "; ".join(self.orcid),
            "license": self.licence,
            "id": self.doi,
        }
        # ACDD wants an id to be unique within the authority that gave it.
        if self.doi:
            attributes["naming_authority"] = "org.doi"
        return {name: text for name, text in attributes.items() if text}


def _is_line(value: Any) -> bool:
    return isinstance(value, str) and bool(value.strip()) and is_one_line(value)


# The drives of a campaign, which are given in SI, and their conversion to the solver's units.


@dataclass(frozen=True, slots=True)
class NamedDrive:
    """One way to pull the pin: its name, the pin's mass, and a drive in SI (N/m, m/s, s); the paper's by default."""

    name: str
    pin_mass: float = parameter(0.5, meaning="mass of the pin", symbol="m", unit="kg", **ANY_SIZE)
    duration_periods: float | None = parameter(
        None, meaning="duration in periods of the pin", comment="on its spring, 2π√(m/k)", **ANY_SIZE
    )
    """Duration in units of 2π√(m/k), if it was given so; `in_si` has it in s."""
    stage_travel: float | None = parameter(None, meaning="distance that the stage moves", unit="m", **ANY_SIZE)
    """Stage travel, if the duration was given by it; `in_si` has the duration in s."""
    stage_frequency: float | None = parameter(
        None,
        meaning="frequency of a stage to and fro",
        comment="cycles per second, in place of stage_velocity",
        unit="s-1",
        **ANY_SIZE,
    )
    """Frequency, if the velocity of a stage with a stroke was given by it; `in_si` has the velocity."""
    in_si: Drive = field(default_factory=lambda: Drive.of(si_defaults()))
    """The drive with its values in SI. The ranges of its parameters are the same as in the solver's units."""

    def __post_init__(self) -> None:
        is_name = isinstance(self.name, str) and bool(self.name.strip())
        require("name", self.name, is_name, "a name")
        require("name", self.name, is_one_line(self.name), ONE_LINE)
        require("name", self.name, len(self.name) <= LONGEST_MESSAGE, f"at most {LONGEST_MESSAGE} characters")
        validate(self)

    @classmethod
    def of(cls, name: str, **entries: Any) -> Self:
        """The drive from the entries of a table [[drives]]; the paper's values for the rest. Raises InvalidInput."""
        of_pin = {key: entries.pop(key) for key in declared(cls) if key in entries}
        # Made without a drive first: mass and lengths are checked before a duration is computed from them.
        checked = cls(name, **of_pin)
        length = {PERIODS: checked.duration_periods, TRAVEL: checked.stage_travel}
        frequency = {FREQUENCY: checked.stage_frequency}
        in_seconds = convert_to_seconds({**entries, **length, **frequency}, checked.pin_mass)
        drive = Drive.of({**si_defaults(), **in_seconds})
        return cls(name, **of_pin, in_si=drive)

    @property
    def flat(self) -> dict[str, Any]:
        """Every parameter but the name, in SI, by name; None for parameters that it does not use."""
        of_pin = {name: getattr(self, name) for name in declared(type(self))}
        parameters = of_pin | self.in_si.flat
        # A stage that goes one way reads neither: their defaults beside it would be labels without an effect.
        if self.in_si.stage_stroke is None:
            parameters |= {"stage_motion": None, "stage_cycles": None}
        return parameters

    def dimensionless(self, scales: Scales) -> Drive:
        """Drive in the solver's units. Raises InvalidInput if a value is out of range in them."""
        length = only_length({PERIODS: self.duration_periods, TRAVEL: self.stage_travel})
        return self.in_si.convert_units(scales, self.pin_mass, length)


@dataclass(frozen=True, slots=True)
class CampaignDrive:
    """A drive of a campaign: a table [[drives]] at one point of the drive axes."""

    name: str
    """Name of its table."""
    point: Mapping[str, Value]
    """Values on the drive axes; empty without axes."""
    settings: Mapping[str, Value | None]
    """Every entry of its table but the name, as given if there is no drive; None for entries that it does not use."""
    drive: NamedDrive | None
    """None if its values exclude each other."""
    given: frozenset[str] = frozenset()
    """Parameters that the file itself gives, here or on an axis."""
    refused: InvalidInput | None = None
    """Reason why there is no drive."""

    @property
    def outcome(self) -> Outcome:
        """COMPLETED, or why there is no drive."""
        return self.refused.outcome if self.refused else COMPLETED

    @property
    def label(self) -> str:
        """Name and the values in which it differs from the campaign's other drives, in one line."""
        values = [f"{name}={value}" for name, value in self.point.items()]
        return " ".join([self.name, *values])


def drive_parameters() -> Mapping[str, Parameter]:
    """Every parameter that a table [[drives]] takes beside the name, with its declaration."""
    return {**declared(NamedDrive), **parameters_of_a_drive()}


def drive_sizes(settings: Mapping[str, Sequence[Any]]) -> list[str]:
    """Pin mass, spring, damping and stage velocity of drives in SI, as `m = 500 g`; missing ones are left out."""
    lines = []
    # Parameters without a symbol may be words, as `profile` is, and have no size.
    symbolic = {name: stated for name, stated in drive_parameters().items() if stated.symbol}
    for name, stated in symbolic.items():
        values = [value for value in settings.get(name, ()) if math.isfinite(value)]
        if not values:
            continue
        unit = "" if stated.unit == "1" else as_written(stated.unit)
        lines.append(f"{stated.symbol} = {span(values, unit)}")
    return lines


Stage = Literal["contact", "slip", "dynamics"]
Design = Literal["product", "zip", "table", "sobol", "latin_hypercube"]
STAGES: tuple[Stage, ...] = get_args(Stage)
MOST_MEMBERS = 10_000
USUAL_MEMBERS = 8
"""Default number of members of an ensemble."""
MOST_TO_TARGET = 96
"""Default limit of members for an ensemble that grows until its target is met."""
MOST_CASES: Final = 10**6
"""Most cases of a campaign, and most drives of a case. A plan of a million takes 1.2 GB."""
MOST_DRIVEN: Final = 4 * MOST_CASES
"""Largest number of cases times drives: the largest plan takes 4 GB."""
KNOWABLE: dict[str, Stage] = {
    "contact_half_width": "contact",
    "approach": "contact",
    "mean_pressure": "contact",
    "maximum_pressure": "contact",
    "plateau_mean": "slip",
    "peak_friction": "slip",
    "surface_stiffness": "slip",
    "mean_step": "slip",
    "mean_drop": "slip",
    "static_friction": "dynamics",
    "kinetic_friction": "dynamics",
    "stick_slip_period": "dynamics",
    "spring_force_amplitude": "dynamics",
    "loop_energy": "dynamics",
    "contact_energy": "dynamics",
    "midstroke_friction": "dynamics",
    "turn_static_friction": "dynamics",
}
"""Stage that yields each variable that an ensemble can target."""
OF_CONTACTS = ("approach", "mean_pressure", "maximum_pressure")
"""Variables that no friction record has: campaigns that slide compute them only with `outputs.tractions`."""


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


@dataclass(frozen=True, slots=True)
class Outputs:
    """Contents of the dataset besides the scalars of each case."""

    records: bool = parameter(True, meaning="friction records, event by event, and slips of each surface node")
    statistics: bool = parameter(
        False,
        meaning="distributions of event sizes over all members",
        comment="exponents, cut-offs, goodness of fit, correlations",
    )
    trajectory: bool = parameter(True, meaning="motion and forces of each drive, at its `samples`")
    phases: bool = parameter(
        True, meaning="start and end of each macroscopic slip of a drive", comment="default: as `trajectory`"
    )
    fit: bool = parameter(
        True, meaning="Eq. 16-19 fitted to the spring force of each drive", comment="variables `fitted_…`"
    )
    critical: bool = parameter(
        False,
        meaning="velocity of the stage above which the pin of each drive no longer sticks",
        comment="by bisection: some thirty drives of each member",
    )
    tractions: bool = parameter(
        False, meaning="pressure and shear after initial contact", comment="default with stage `contact` alone: true"
    )
    tractions_at: tuple[int, ...] = parameter(
        (),
        meaning="events after which pressure, shear, slip and gap are kept",
        comment="0 is initial contact",
        need=f"a list of events, increasing from 0 to {MOST_EVENTS:.0e}",
    )
    subsurface: bool = parameter(
        False,
        meaning="displacements and stresses of all nodes inside the slab",
        comment="after those events, or initial contact",
    )
    observables: tuple[str, ...] = parameter(
        (),
        meaning="one's own numbers of each record or drive",
        comment="functions of Python files beside the campaign",
        need=REFERENCE,
    )

    def __post_init__(self) -> None:
        validate(self)
        events, need = self.tractions_at, declared(Outputs)["tractions_at"].need
        require("tractions_at", events, _is_increasing(events), need)
        # TOML has lists; a frozen value needs tuples, to be hashed and compared.
        object.__setattr__(self, "tractions_at", tuple(events))
        if self.observables != ():
            references = require_references(self.observables)
            object.__setattr__(self, "observables", references)


@dataclass(frozen=True, slots=True)
class EnsembleTable:
    """Starts that are computed of every case, and where each is."""

    members: int = parameter(
        USUAL_MEMBERS,
        meaning="independent starts of each case",
        comment="uniform within a node spacing; 1: the case alone",
        least=1,
        most=MOST_MEMBERS,
    )
    places: Places = parameter(
        "drawn", meaning="positions of members on a rough profile", comment="drawn at random, or all at the given one"
    )

    def __post_init__(self) -> None:
        validate(self)


@dataclass(frozen=True, slots=True)
class TargetTable:
    """Required error of the means of some variables, instead of a number of members."""

    within: float = parameter(
        meaning="largest relative error of each mean in `of`",
        comment="twice its ±, and the change by effects left out",
        above=0.0,
        below=1.0,
    )
    of: tuple[str, ...] = parameter(
        (),
        meaning="variables whose error is required",
        comment="default: the main variables of the last stage",
        need=f"a list, each one of {', '.join(KNOWABLE)}",
    )
    most: int = parameter(MOST_TO_TARGET, meaning="largest number of members", least=FEWEST, most=MOST_MEMBERS)

    def __post_init__(self) -> None:
        validate(self)
        of: Any = self.of
        need = declared(TargetTable)["of"].need
        require("of", of, isinstance(of, list | tuple), need)
        for name in of:
            require("of", name, isinstance(name, str) and name in KNOWABLE, need)
        object.__setattr__(self, "of", tuple(of))

    def variables(self, last: Stage, to_and_fro: bool = False) -> tuple[str, ...]:
        """Variables of the target, if this is the last stage. to_and_fro: whether the stage of all drives has a stroke."""
        if self.of:
            return self.of
        # A stage to and fro may turn before the pin slides steadily: its loop has an energy in any case.
        of_drives = ("loop_energy",) if to_and_fro else ("static_friction", "kinetic_friction")
        usual = {"contact": ("contact_half_width",), "slip": ("plateau_mean",)}
        return usual.get(last, of_drives)


@dataclass(frozen=True, slots=True)
class CampaignKeys:
    """Keys of a campaign file outside of its tables."""

    title: str = parameter(meaning="title of the campaign, in one line", need="a text")
    stages: tuple[Stage, ...] = parameter(
        ("contact", "slip"),
        meaning="stages computed: initial contact, friction records, drives",
        comment="with drives, all three",
        need=" or ".join(quote_toml(list(STAGES[:count])) for count in range(1, len(STAGES) + 1)),
    )
    design: Design = parameter(
        "product",
        meaning="how the values of all axes make cases",
        comment="every combination, position by position, or points that fill ranges",
        need='"product", "zip", "sobol" or "latin_hypercube"',
    )
    points: int = parameter(64, meaning="cases of a design that fills ranges", least=1, most=MOST_CASES)
    design_seed: int = parameter(1, meaning="seed of a design that fills ranges", least=0, most=MOST_WHOLE)
    table: str = parameter(
        "",
        meaning="CSV file with a line of parameters for each case, instead of [axes]",
        need="the path of a CSV file, seen from the campaign file",
    )


YOUNG_MODULUS: Final = dataclasses.replace(
    declared(Scales)["shear_modulus"],
    meaning="Young's modulus E of the slab",
    comment="instead of the shear modulus, G = E/(2(1 + ν))",
    symbol="E",
)
SECONDS_KEY: Final = "seconds"
"""Key of [limits] that limits no case, but how long a task may take."""
TASK_SECONDS: Final = Parameter(
    "time after which a task is taken to hang",
    unit="s",
    comment="decides no result; without it the estimate of its cost does",
    least=0.1,
    below=math.inf,
    need="a number of seconds from 0.1 on",
)
MORE_KEYS: Final[Mapping[tuple[str, str], Parameter]] = {
    ("scales", YOUNG): YOUNG_MODULUS,
    ("limits", SECONDS_KEY): TASK_SECONDS,
}
"""Table and key -> declaration of a key that is no field of the values that its table makes."""
OTHERS: Final = {"limits": (SECONDS_KEY,)}
"""Table -> its keys that are no parameters of a case."""
AXES: Final = "drive_axes"
TOP_LEVEL: Final[dict[str, tuple[type, str]]] = {
    **{
        name: (kind, stated.need or stated.describe_range(name, whole=True))
        for (name, stated), kind in zip(declared(CampaignKeys).items(), (str, list, str, int, int, str), strict=True)
    },
    "axes": (dict, "a table [axes]"),
    **{name: (dict, f"a table [{name}]") for name in (*TABLES, "scales", "outputs", "ensemble", "target", "about")},
    "drives": (list, "tables [[drives]]"),
    AXES: (dict, f"a table [{AXES}]"),
}
"""Key outside of all tables, or table -> type and need of its content."""
KEYS_OF_FILES: Final = frozenset((*TOP_LEVEL, "name", *itertools.chain(*OTHERS.values())))
"""Keys that a campaign has beside the parameters of its cases, their ensembles, drives and outputs."""


@dataclass(frozen=True, slots=True)
class Manifest:
    """A checked campaign. Parameters are listed by field name, their values have the declared type."""

    path: Path
    text: str
    """Text of the campaign file."""
    files: Mapping[str, str]
    """Key that names a file, of `FILE_KEYS` -> the file's text."""
    sha256: str
    """SHA-256 of the text of the campaign file followed by the texts of the files in `FILE_KEYS`."""
    title: str
    stages: tuple[Stage, ...]
    design: Design
    axes: Mapping[str, tuple[Value, ...]]
    """Parameter -> its values; with `zip` and `table` the i-th values of all axes are one case."""
    tables: Mapping[str, Mapping[str, Value]]
    """Table of parameters -> parameter -> its value."""
    task_seconds: float | None
    """Seconds after which a task is taken to hang; None if the estimate of its cost decides."""
    scales: Scales
    drives: tuple[CampaignDrive, ...]
    """Table by table, each at every point of the drive axes, the last axis fastest."""
    outputs: Outputs
    ensemble: Ensemble = ALONE
    """Number of starts of every case."""
    drive_axes: Mapping[str, tuple[Value, ...]] = field(default_factory=dict)
    """Parameter of a drive -> its values."""
    about: About = field(default_factory=About)
    """Authors of the campaign."""
    drives_left_out: tuple[str, ...] = ()
    """Names of the file's drives where the stages leave out `dynamics`; `drives` is empty then."""
    observables: tuple[Observable, ...] = ()
    """One's own numbers."""

    @property
    def name(self) -> str:
        """The campaign's short name: its file name without the ending."""
        return self.path.stem

    @property
    def case_count(self) -> int:
        """Number of cases."""
        lengths = [len(values) for values in self.axes.values()]
        # A product of no axes is one case, of the tables alone. All other designs have axes of equal length; where they
        # have not, that is refused, and the shortest is what can be counted.
        if self.design == "product":
            return math.prod(lengths)
        return min(lengths, default=0)

    @property
    def paths(self) -> bool:
        """True if its cases follow a path of pin and load."""
        keys = (*self.axes, *self.tables.get("path", ()))
        return not declared(LoadPath).keys().isdisjoint(keys)

    @property
    def stated_scales(self) -> Scales | None:
        """Scales that its file gives; None if it gives none."""
        return self.scales if "scales" in from_toml(self.text) else None

    def case_values(self, name: str) -> tuple[Value, ...]:
        """Values of a parameter of cases: the values on its axis, else the common value of all cases."""
        if name in self.axes:
            return self.axes[name]
        default = Case.of({}).flat[name]
        return (self.fixed.get(name, default),)

    @property
    def fixed(self) -> dict[str, Value]:
        """Parameters from the tables, by field name: equal for all cases."""
        values: dict[str, Value] = {}
        for table in self.tables.values():
            values |= table
        return values


def _is_increasing(value: Any) -> bool:
    """True for a list of increasing whole numbers from 0 to the most events of a record."""
    if not isinstance(value, list | tuple) or not all(map(_is_whole, value)):
        return False
    # Both ends are checked as neighbours: the first event is above -1, the last below one more than a record can have.
    bounded = [-1, *value, MOST_EVENTS + 1]
    return all(before < after for before, after in itertools.pairwise(bounded))


# Entered here, not declared beside OTHER_TABLES: messages need the keys of all tables, and are made below this file.
OTHER_TABLES.update(
    {
        "scales": (*field_names(Scales), YOUNG),
        "ensemble": field_names(EnsembleTable),
        "target": field_names(TargetTable),
        "outputs": field_names(Outputs),
        "drives": tuple(drive_parameters()),
    }
)
