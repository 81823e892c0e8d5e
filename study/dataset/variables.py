"""Name, meaning and unit of every variable of a dataset.

Those of results are declared where the solver makes them (nanoslip.solver.parameter) and follow from the parts of the kinds of
task; here are the few that belong to the dataset itself. Lengths are in L_x, stiffness in G·L_y, forces over the load W; what a
drive yields over time is in SI, as the drive is.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from typing import Final

import numpy as np

from nanoslip.solver.case import Case, parameters_of_a_case
from nanoslip.solver.drive import Scales
from nanoslip.solver.parameter import GRID_ERROR, Quantity, quantities
from nanoslip.solver.sliding.sizes import EventSizes
from nanoslip.solver.sliding.validity import Validity
from nanoslip.study.manifest.manifest import NamedDrive, drive_parameters
from nanoslip.study.origin import Origin
from nanoslip.study.plan.kinds.kind import Ragged, declared
from nanoslip.study.plan.tasks import KINDS


def scalars(kind: str) -> Mapping[str, Quantity]:
    """Scalar of a kind's results -> the variable over the cases (and drives)."""
    return declared(KINDS[kind])


@cache  # asked for every number of a figure
def all_scalars() -> Mapping[str, Quantity]:
    """Name -> the variable over the cases (and drives), of the scalars of all kinds."""
    return {each.name: each for kind in KINDS for each in scalars(kind).values()}


def companions(kind: str) -> Mapping[str, Quantity]:
    """Scalar of a kind's results -> a second variable that gives it in SI or over μ_i, where there is one."""
    return {key: each.si for key, each in scalars(kind).items() if each.si}


@dataclass(frozen=True, slots=True)
class Series:
    """Columns of one kind's results: CF contiguous ragged arrays over `sample`, a run of it for each instance of a group."""

    kind: str
    ragged: Ragged
    columns: Mapping[str, Quantity]

    @property
    def sample(self) -> str:
        """The dimension of the values."""
        return self.ragged.sample

    @property
    def count(self) -> Quantity:
        """Over the instances: the length of each run."""
        return Quantity(self.ragged.count, f"values of each {self.ragged.instance}")


@dataclass(frozen=True, slots=True)
class Group:
    """A group of a dataset: runs of one or several series. Its name is that of the dimension of its instances."""

    name: str
    series: tuple[Series, ...]

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds of task whose results it holds, in the order of their stages."""
        return tuple(dict.fromkeys(each.kind for each in self.series))

    @property
    def driven(self) -> bool:
        """Whether its instances belong to cases and drives."""
        return DRIVE in self.kinds

    @property
    def samples(self) -> dict[str, tuple[Series, ...]]:
        """Sample dimension -> the series over it."""
        names = dict.fromkeys(each.sample for each in self.series)
        return {name: tuple(each for each in self.series if each.sample == name) for name in names}

    @property
    def columns(self) -> dict[str, Quantity]:
        """Every variable over a sample dimension, once, by name."""
        return {quantity.name: quantity for each in self.series for quantity in each.columns.values()}

    @property
    def id(self) -> Quantity:
        """Over the cases: which instance is theirs."""
        comment = f"along {self.name} in the group {self.name}; empty where the case has none"
        return Quantity(f"{self.name}_id", f"name of its {self.name}", "", comment=comment)

    @property
    def label(self) -> Quantity:
        """Over the instances: their names."""
        return Quantity(self.name, f"name of the {self.name}", "", comment="content hash of what decides it")

    @property
    def owners(self) -> tuple[Quantity, ...]:
        """Over the instances: the case of each, and of drives the drive; the first one of those that share it."""
        return (CASE_ID, DRIVE_NAME) if self.driven else (CASE_ID,)


DRIVE: Final = "drive"
"""The kind of task whose results lie over the drives too."""
CASE_ID: Final = Quantity("case_id", "content hash of the case's parameters", "")
DRIVE_NAME: Final = Quantity("drive", "name of the drive", "")


def all_groups() -> dict[str, Group]:
    """Every group of runs that a dataset can have, by name."""
    found = [
        Series(kind.name, ragged, declared(kind, ragged.sample)) for kind in KINDS.values() for ragged in kind.ragged
    ]
    names = sorted({each.ragged.instance for each in found}, key=_ORDER.index)
    return {name: Group(name, tuple(each for each in found if each.ragged.instance == name)) for name in names}


_ORDER: Final = ("ensemble", "drive_ensemble", "record", "event_sizes", "trajectory", "contact", "interior")


DISCRETIZATION_ERROR = Quantity(
    GRID_ERROR,
    "relative error of the grid",
    comment="expected of stiffness, approach, contact half-width and pressure: what the slab's grid costs; "
    "measured by nanoslip accuracy on the front that the attribute discretization_front names; NaN where that has "
    "no such discretization of such a slab, no contact as narrow or as wide, where the pin is rough or a flat punch (its "
    "pressure is singular), and with a half_plane or the support frictionless (a point's, which gives way without limit)",
)
"""Of a case, from the measured front."""
EVENT_DROP: Final = quantities(EventSizes)["drop"]
"""What `.record` and `.events` have beside the columns of the file."""
VALIDITY = quantities(Validity)["validity_flags"]
ADVICE = Quantity("advice", "what to do about validity_flags", "", comment="empty where there is none")
OUTCOMES = {
    "": (
        Quantity("outcome", "how the case ended", ""),
        Quantity("message", "why the case ended so", "", comment="and what to do about it"),
    ),
    DRIVE: (
        Quantity("drive_outcome", "how the dynamic stage ended", ""),
        Quantity("drive_message", "why the dynamic stage ended so", "", comment="and what to do about it"),
    ),
}
"""Kind of task ("": all before the drives) -> the variables that say how it ended."""

MEMBERS: Final = Quantity(
    "members", "members computed", comment="independent starts of the case: means are over those that have a value"
)
DRIVE_MEMBERS: Final = Quantity("drive_members", "members that were driven", comment="as members")

_BY_NAME: Final = "name of the entry in the group software; empty until computed"
COMPUTED_BY = {
    "": Quantity("computed_by", "software that computed the case", "", comment=_BY_NAME),
    DRIVE: Quantity("drive_computed_by", "software of the dynamic stage", "", comment=_BY_NAME),
}
"""As `OUTCOMES`: the variables that say which software a result stems from, its inputs' included."""

SOFTWARE: Final = (
    Quantity("software", "name of the software", "", comment="a hash of what is known of it"),
    Quantity("software_results", "results that stem from the software", comment="those of a case and of its drives"),
    *(Quantity(f"software_{item.name}", f"{item.name} of the software", "") for item in fields(Origin)),
)
"""The software that computed the results: its name, how many results, and every fact of it."""


def parameters() -> dict[str, Quantity]:
    """The coordinates of a dataset by name: every parameter of cases and drives but files."""
    stated = {**parameters_of_a_case(), **drive_parameters()}
    return {
        name: Quantity(name, each.meaning, each.unit, symbol=each.symbol, comment=each.comment)
        for name, each in stated.items()
        if each.axis
    }


def factors(case: Case, scales: Scales, drive: NamedDrive | None) -> dict[str, float]:
    """`Quantity.per` -> what a value in the solver's units is multiplied with: shares of W or μ_i, or SI."""
    friction = case.intrinsic_friction
    return {
        "": 1.0,
        "normal_load": 1.0 / case.normal_load,
        "intrinsic_friction": 1.0 / friction if 0.0 < friction < np.inf else np.nan,
        **scales.units(drive.pin_mass if drive else 1.0),
    }
