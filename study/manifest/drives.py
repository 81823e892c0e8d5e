"""The drives of a campaign, which are given in SI, and their conversion to the solver's units."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Self

from nanoslip.solver.drive import (
    PERIODS,
    TRAVEL,
    Drive,
    Scales,
    in_seconds,
    lasting,
    parameters_of_a_drive,
    si_defaults,
)
from nanoslip.solver.outcome import InvalidInput, Outcome, quoted
from nanoslip.solver.parameter import Parameter, check, declared, parameter
from nanoslip.study.manifest.columns import ONE_LINE, one_line
from nanoslip.study.manifest.parameters import Value


@dataclass(frozen=True, slots=True)
class NamedDrive:
    """One way to pull the pin: its name, the pin's mass, and a drive in SI (N/m, m/s, s); the paper's by default."""

    name: str
    pin_mass: float = parameter(0.5, meaning="mass of the pin", symbol="m", unit="kg", least=1e-30, most=1e30)
    duration_periods: float | None = parameter(
        None, meaning="duration in periods of the pin", comment="on its spring, 2π√(m/k)", least=1e-30, most=1e30
    )
    """In units of 2π√(m/k), where it was given so; `in_si` has it in s."""
    stage_travel: float | None = parameter(
        None, meaning="distance that the stage moves", unit="m", least=1e-30, most=1e30
    )
    """Where the duration was given so; `in_si` has that in s."""
    in_si: Drive = field(default_factory=lambda: Drive.of(si_defaults()))
    """The drive with its values in SI. The ranges of its parameters are the same as in the solver's units."""

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise InvalidInput(f"name = {quoted(self.name)}: needs a name")
        if not one_line(self.name):
            raise InvalidInput(f"name = {quoted(self.name)}: {ONE_LINE}")
        check(self)

    @classmethod
    def of(cls, name: str, **entries: Any) -> Self:
        """The drive from the entries of a table [[drives]]; the paper's values for the rest. Raises InvalidInput."""
        own = {key: entries.pop(key) for key in declared(cls) if key in entries}
        checked = cls(name, **own)
        length = {PERIODS: checked.duration_periods, TRAVEL: checked.stage_travel}
        entries = in_seconds({**entries, **length}, checked.pin_mass)
        return cls(name, **own, in_si=Drive.of({**si_defaults(), **entries}))

    @property
    def flat(self) -> dict[str, Any]:
        """Every parameter but the name, in SI, by name; None for what it does not use."""
        own = {name: getattr(self, name) for name in declared(type(self))}
        return own | self.in_si.flat

    def dimensionless(self, scales: Scales) -> Drive:
        """The same drive in the solver's units. Raises InvalidInput where a value is out of range in them."""
        length = lasting({PERIODS: self.duration_periods, TRAVEL: self.stage_travel})
        return self.in_si.scaled(scales, self.pin_mass, length)


@dataclass(frozen=True, slots=True)
class CampaignDrive:
    """A drive of a campaign: a table [[drives]] at one point of the drive axes."""

    name: str
    """Of its table."""
    point: Mapping[str, Value]
    """Its value on each drive axis; empty without axes."""
    settings: Mapping[str, Value | None]
    """Every entry of its table but the name, as given where there is no drive; None for what it does not use."""
    drive: NamedDrive | None
    """None where its values exclude each other."""
    outcome: Outcome
    """COMPLETED, or why there is no drive."""
    given: frozenset[str] = frozenset()
    """Parameters that the file itself gives, here or on an axis."""

    @property
    def label(self) -> str:
        """Its name and the values in which it differs from the campaign's other drives, in one line."""
        return " ".join([self.name, *(f"{name}={value}" for name, value in self.point.items())])


def drive_parameters() -> Mapping[str, Parameter]:
    """Every parameter that a table [[drives]] takes beside the name, with its declaration."""
    return {**declared(NamedDrive), **parameters_of_a_drive()}
