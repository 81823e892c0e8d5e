"""How a campaign pulls the pin: SI at this edge, the solver's units beyond it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Self

from solver.drive import Drive, Scales, parameters_of_a_drive, si_defaults
from solver.outcome import InvalidInput, quoted
from solver.parameter import Parameter, check, declared, parameter


@dataclass(frozen=True, slots=True)
class NamedDrive:
    """One way to pull the pin: its name, the pin's mass, and a drive in SI (N/m, m/s, s); the paper's by default."""

    name: str
    pin_mass: float = parameter(0.5, meaning="mass of the pin", symbol="m", unit="kg", least=1e-30, most=1e30)
    in_si: Drive = field(default_factory=lambda: Drive.of(si_defaults()))
    """Its values are in SI; the ranges of a drive hold in any units."""

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise InvalidInput(f"name = {quoted(self.name)}: needs a name")
        check(self)

    @classmethod
    def of(cls, name: str, **entries: Any) -> Self:
        """The drive with these entries of a table [[drives]]. Raises InvalidInput."""
        own = {key: entries.pop(key) for key in declared(cls) if key in entries}
        return cls(name, **own, in_si=Drive.of({**si_defaults(), **entries}))

    @property
    def flat(self) -> dict[str, Any]:
        """Every entry of its table but the name; None for the settings of integrators that it does not use."""
        return {"pin_mass": self.pin_mass, **self.in_si.flat}

    def dimensionless(self, scales: Scales) -> Drive:
        """The same drive in the solver's units."""
        return self.in_si.scaled(scales, self.pin_mass)


def drive_parameters() -> Mapping[str, Parameter]:
    """Every entry of a table [[drives]] but the name."""
    return {**declared(NamedDrive), **parameters_of_a_drive()}
