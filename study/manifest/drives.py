"""How a campaign pulls the pin: SI at this edge, the solver's units beyond it."""

from dataclasses import dataclass, fields

from solver.case import Drive, Integrator, ProfileShape, Scales, as_float
from solver.outcome import InvalidInput, quoted

_DRIVE_FIELDS = tuple(item.name for item in fields(Drive))


@dataclass(frozen=True, slots=True)
class NamedDrive:
    """One way to pull the pin, in SI: mass (kg), stiffness (N/m), velocity (m/s), times (s); the paper's by default."""

    name: str
    pin_mass: float = 0.5
    spring_stiffness: float = 2e5
    damping_ratio: float = 0.1
    stage_velocity: float = 2e-3
    duration: float = 0.2
    integrator: Integrator = "exact"
    profile: ProfileShape = "sawtooth"
    time_step: float | None = None
    samples: int = 2000
    surface_compliance: bool = True
    reverse_motion: bool = True
    step_limit: int = 20_000_000

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise InvalidInput(f"name = {quoted(self.name)}: needs a name")
        mass = as_float("pin_mass", self.pin_mass)
        if not 1e-30 <= mass <= 1e30:
            raise InvalidInput(f"pin_mass = {mass!r}: needs 1e-30 ≤ pin_mass ≤ 1e30")
        object.__setattr__(self, "pin_mass", mass)
        # The ranges of a drive hold in any units.
        in_range = Drive(**{name: getattr(self, name) for name in _DRIVE_FIELDS})
        for name in _DRIVE_FIELDS:
            object.__setattr__(self, name, getattr(in_range, name))
        if self.integrator != "rk4" and self.time_step is not None:
            raise InvalidInput(f'time_step = {self.time_step!r}: needs integrator = "rk4", the one that takes steps')

    def dimensionless(self, scales: Scales) -> Drive:
        """The same drive in the solver's units."""
        time = scales.time(self.pin_mass)
        return Drive(
            spring_stiffness=self.spring_stiffness / scales.stiffness,
            damping_ratio=self.damping_ratio,
            stage_velocity=self.stage_velocity * time / scales.slab_width,
            duration=self.duration / time,
            integrator=self.integrator,
            profile=self.profile,
            time_step=None if self.time_step is None else self.time_step / time,
            samples=self.samples,
            surface_compliance=self.surface_compliance,
            reverse_motion=self.reverse_motion,
            step_limit=self.step_limit,
        )
