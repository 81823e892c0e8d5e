"""The drives of a campaign, which are given in SI, and their conversion to the solver's units."""

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
    """The drive with its values in SI. The ranges of its parameters are the same as in the solver's units."""

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise InvalidInput(f"name = {quoted(self.name)}: needs a name")
        check(self)

    @classmethod
    def of(cls, name: str, **entries: Any) -> Self:
        """The drive from the entries of a table [[drives]]; the paper's values for the rest. Raises InvalidInput."""
        own = {key: entries.pop(key) for key in declared(cls) if key in entries}
        return cls(name, **own, in_si=Drive.of({**si_defaults(), **entries}))

    @property
    def flat(self) -> dict[str, Any]:
        """Every parameter but the name, in SI, by name; None for the settings of integrators that it does not use."""
        return {"pin_mass": self.pin_mass, **self.in_si.flat}

    def dimensionless(self, scales: Scales) -> Drive:
        """The same drive in the solver's units. Raises InvalidInput where a value is out of range in them."""
        return self.in_si.scaled(scales, self.pin_mass)


def drive_parameters() -> Mapping[str, Parameter]:
    """Every parameter that a table [[drives]] takes beside the name, with its declaration."""
    return {**declared(NamedDrive), **parameters_of_a_drive()}
