"""Drive of the pin (Eq. 12), and the scales that lead from dimensionless numbers back to SI.

An integrator is one file of `nanoslip.solver.dynamics`: a frozen type with its settings as fields, registered by its name.
"""

import dataclasses
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, Final, Literal, Self

from nanoslip.solver.case import Case, refuse_excluded
from nanoslip.solver.outcome import InvalidInput, quote_value
from nanoslip.solver.parameter import (
    MOST_WHOLE,
    Family,
    Parameter,
    as_float,
    declared,
    merge_parameters,
    parameter,
    refuse_unknown,
    require,
    validate,
)

ProfileShape = Literal["sawtooth", "coarse", "linear", "mean"]
StageMotion = Literal["triangle", "sine"]
"""Motion of a stage that goes to and fro: at constant velocity, or harmonic."""

MOST_SAMPLES = 10**7
"""Largest number of output times of a drive."""


class Integrator(ABC):
    """A method that integrates Eq. 12: a frozen dataclass of its settings."""

    name: ClassVar[str]
    rests: ClassVar[bool] = True
    """True if it holds a pin at rest exactly, as a contact without compliance needs."""

    @abstractmethod
    def fit(self, drive: "Drive") -> None:
        """Raise InvalidInput if these settings do not fit the drive."""

    def __str__(self) -> str:
        return self.name


INTEGRATORS: Family[Integrator] = Family("integrator")
"""Every integrator there is."""


FEWER_STEPS: Final = "raise step_limit, shorten the drive, slow the stage or soften the spring"
FEWER_RESTS: Final = "the pin comes to rest many times on each tooth: raise step_limit, pin_mass or stage_velocity"
"""Advice where a drive needs more segments than its step_limit."""


ANY_SIZE: Final[dict[str, Any]] = {"least": 1e-30, "most": 1e30}
"""Bounds of a number above 0 in any unit."""
SINE_PIECES: Final = 64
"""Pieces of constant velocity into which a quarter of a sine is cut: the energy of a cycle is right to 1e-4."""


@dataclass(frozen=True, slots=True)
class Scales:
    """Scales of the dimensionless numbers: slab width L_x (m), slab depth L_y (m), shear modulus G (Pa)."""

    slab_width: float = parameter(1e-3, meaning="slab width", symbol="L_x", unit="m", **ANY_SIZE)
    slab_depth: float = parameter(1e-2, meaning="slab depth", symbol="L_y", unit="m", **ANY_SIZE)
    shear_modulus: float = parameter(1e10, meaning="shear modulus", symbol="G", unit="Pa", **ANY_SIZE)

    def __post_init__(self) -> None:
        validate(self)

    @property
    def force(self) -> float:
        """G·L_x·L_y in N."""
        return self.shear_modulus * self.slab_width * self.slab_depth

    @property
    def stiffness(self) -> float:
        """G·L_y in N/m."""
        return self.shear_modulus * self.slab_depth

    def time(self, pin_mass: float) -> float:
        """√(m/(G·L_y)) in s for a pin of mass m (kg)."""
        # In this unit of time the mass in Eq. 12 is 1: m L_x/T² = G L_x L_y.
        return math.sqrt(pin_mass / self.stiffness)

    def units(self, pin_mass: float) -> dict[str, float]:
        """Factors to SI of lengths, stiffness, times and velocities, for a pin of mass m (kg)."""
        time = self.time(pin_mass)
        return {
            "length": self.slab_width,
            "stiffness": self.stiffness,
            "time": time,
            "velocity": self.slab_width / time,
        }


@dataclass(frozen=True, slots=True)
class Drive:
    """Drive of the pin (Eq. 12), in units of L_x, G·L_y (stiffness), G·L_x·L_y (force) and √(m/(G·L_y)) (time): mass 1.

    damping_ratio: ζ = c/(2√(m·k)). integrator: the settings of an integrator, or its name. samples: evenly spaced
        output times after t = 0.
    duration: None continues until μ_s and μ_k are determined (`nanoslip.solver.dynamics.duration`). max_slips: ends
        the drive (completed) with this macroscopic slip. step_limit: segments (exact) or time steps (rk4) after which
        it fails.
    surface_compliance: without, K → ∞: the pin rests or slides against F̃(x) (Eq. 16-19), x_R = x. Needs `exact`.
    reverse_motion: without, a run whose pin would slip back against -F̃ ends as `reversed`.
    memory: the pin is pulled over its contact, event by event, instead of Eq. 13-15 over the friction record.
    stage_stroke: the stage starts in the middle of its way and goes to and fro, `stage_cycles` times from turn to turn and back.
    """

    spring_stiffness: float = parameter(
        meaning="stiffness of the coupling spring", symbol="k", unit="N m-1", scale="stiffness", si=2e5, **ANY_SIZE
    )
    damping_ratio: float = parameter(meaning="damping ratio", symbol="ζ", si=0.1, least=0.0, most=1e30)
    stage_velocity: float = parameter(
        meaning="velocity of the stage", symbol="V_o", unit="m s-1", scale="velocity", si=2e-3, least=0.0, most=1e30
    )
    duration: float | None = parameter(
        None,
        meaning="time for which the stage moves",
        comment='"auto", the default: to the first slip and as many cycles as μ_k needs; in a dataset NaN, beside end_time',
        unit="s",
        scale="time",
        **ANY_SIZE,
    )
    integrator: Any = parameter("exact", meaning="integrator of the dynamic stage")
    profile: ProfileShape = parameter(
        "sawtooth",
        meaning="friction profile between events",
        note="; a measured surface is `roughness = FILE`",
        comment="the record's teeth; at most 64 of them in a node spacing; lines between forces after events; the plateau's mean",
    )
    samples: int = parameter(2000, meaning="output times after the start", least=1, most=MOST_SAMPLES)
    surface_compliance: bool = parameter(
        True, meaning="the contact is compliant", comment="it yields with its stiffness K before it slips"
    )
    reverse_motion: bool = parameter(True, meaning="the pin may slip back")
    memory: bool = parameter(
        False,
        meaning="the pin is pulled over its contact",
        comment="the contact remembers its path; without memory friction is that of the record, "
        "and the pin moves back by Eq. 13-15",
    )
    step_limit: int = parameter(
        20_000_000,
        meaning="largest number of segments or time steps",
        comment="a drive that needs more has the outcome step_limit",
        least=1,
        most=MOST_WHOLE,
    )
    max_slips: int | None = parameter(None, meaning="macroscopic slips that end a drive", least=1, most=MOST_WHOLE)
    stage_stroke: float | None = parameter(
        None,
        meaning="stroke of a stage that goes to and fro",
        comment="end to end; it lasts stage_cycles, stage_velocity is its velocity or, of a sine, its largest; "
        "`stroke` of [path] is that of the pin",
        unit="m",
        scale="length",
        **ANY_SIZE,
    )
    stage_motion: StageMotion = parameter(
        "triangle", meaning="motion of a stage that goes to and fro", comment="at constant velocity, or harmonic"
    )
    stage_cycles: int = parameter(
        6,
        meaning="cycles of a stage that goes to and fro",
        comment="the first is left out of means",
        least=2,
        most=10**5,
    )

    def __post_init__(self) -> None:
        validate(self)
        settings: Any = self.integrator
        if not isinstance(settings, Integrator):
            settings = INTEGRATORS.find_member(settings)()
        object.__setattr__(self, "integrator", settings)
        settings.fit(self)
        if not self.surface_compliance and not settings.rests:
            having = " or ".join(f'"{name}"' for name, kind in INTEGRATORS.items() if kind.rests)
            need = f"integrator = {having}, as a step of {settings} has no rest"
            raise InvalidInput("surface_compliance", False, need)
        for key in other_than_a_contact(self) if self.memory else ():
            raise InvalidInput("memory", True, f"{key} = {quote_value(OVER_A_CONTACT[key])}", {key: getattr(self, key)})
        if self.stage_stroke is not None:
            _require_legs(self)

    @classmethod
    def of(cls, parameters: Mapping[str, Any]) -> Self:
        """Build the drive from parameters by name, including its integrator's. Raises InvalidInput, for unknown
        names too."""
        refuse_unknown(parameters, parameters_of_a_drive(), "a drive")
        numbers = {name: parameters[name] for name in declared(cls) if name in parameters}
        return cls(**{**numbers, "integrator": INTEGRATORS.member(parameters, "exact")})

    @classmethod
    def from_si(cls, scales: Scales | None = None, pin_mass: float = 0.5, **parameters: Any) -> Self:
        """The drive of a pin of this mass (kg), from values in SI: N/m, m/s, s; the paper's values if not given.

        duration_periods: duration in periods of the pin on its spring. stage_travel: duration by the stage's distance
        (m). Raises InvalidInput for values out of range, and for unknown names.
        """
        refuse_without_stroke(parameters)
        in_si = cls.of({**si_defaults(), **convert_to_seconds(parameters, pin_mass)})
        return in_si.convert_units(scales or Scales(), pin_mass, only_length(parameters))

    @property
    def stroke_duration(self) -> float:
        """Time of the stage from one turn to the next, in the drive's unit; 0 without a stroke."""
        if self.stage_stroke is None:
            return 0.0
        # The largest velocity of a sine is π/2 times its mean.
        longer = math.pi / 2.0 if self.stage_motion == "sine" else 1.0
        return longer * self.stage_stroke / self.stage_velocity

    @property
    def cycles_duration(self) -> float:
        """Time of all cycles, and of the way from the middle to the first turn."""
        return (0.5 + 2.0 * self.stage_cycles) * self.stroke_duration

    @property
    def output_times(self) -> int:
        """Number of output times after the start: `samples`, or as many more as fall on every turn of the stage."""
        if self.stage_stroke is None:
            return self.samples
        return (4 * self.stage_cycles + 1) * self.samples_to_middle

    @property
    def samples_to_middle(self) -> int:
        """Output times between a turn of the stage and the middle of its way; of a sine they fall on its pieces, too."""
        # A sixteenth of a leg is told apart.
        least = max(math.ceil(self.samples / (4 * self.stage_cycles + 1)), 16)
        return SINE_PIECES * math.ceil(least / SINE_PIECES) if self.stage_motion == "sine" else least

    @property
    def flat(self) -> dict[str, Any]:
        """Every parameter of the drive, its integrator by name and that one's settings beside it; None for other
        integrators."""
        numbers = {name: getattr(self, name) for name in declared(type(self))}
        return numbers | INTEGRATORS.flat(self.integrator)

    def convert_units(self, scales: Scales, pin_mass: float, length: tuple[str, float] | None = None) -> Self:
        """A drive given in SI in the solver's units. Raises InvalidInput if a value is out of range in them.

        length: which of the `DURATIONS` was given, and its value, which messages show; None without any.
        """
        time, units = scales.time(pin_mass), scales.units(pin_mass)
        values = self.flat
        for name, stated in parameters_of_a_drive().items():
            if stated.scale and values[name] is not None:
                dimensionless = _FROM_SI[stated.scale](values[name], scales, time)
                key, typed = length if length and name == "duration" else (name, values[name])
                si_per_unit = typed / values[name] * units[stated.scale] if values[name] else 1.0
                values[name] = _check_range(
                    key, typed, dimensionless, stated, si_per_unit, " with this pin_mass and these scales"
                )
        return self.of(values)


_FROM_SI: Final[dict[str, Callable[[float, Scales, float], float]]] = {
    "stiffness": lambda value, scales, time: value / scales.stiffness,
    "velocity": lambda value, scales, time: value * time / scales.slab_width,
    "time": lambda value, scales, time: value / time,
    "length": lambda value, scales, time: value / scales.slab_width,
}
"""Scale of a parameter -> its value in the solver's units, from SI; time: their unit of time, in s."""


def _check_range(key: str, typed: float, value: float, stated: Parameter, si_per_unit: float, note: str) -> float:
    """Check `value`, which is `typed` in other units. Raises InvalidInput, in the key's units, if it is out of range.

    si_per_unit: the unit of `value` in that of the key.
    """
    if not stated.holds(value):
        least, most = max(stated.least, stated.least * si_per_unit), min(stated.most, stated.most * si_per_unit)
        bounds = dataclasses.replace(stated, least=least, most=most, note=note)
        require(key, typed, False, partial(bounds.describe_range, whole=False))
    return value


TO_AND_FRO: Final[dict[str, Any]] = {
    "duration": None,
    "max_slips": None,
    "integrator": "exact",
    "surface_compliance": True,
    "reverse_motion": True,
}
"""Settings of a drive whose stage goes to and fro: its cycles last as long as they do, and the pin turns with it."""


def _require_legs(drive: Drive) -> None:
    """Raise InvalidInput unless a stage that has a stroke goes to and fro, and the pin may follow it."""
    require("stage_velocity", drive.stage_velocity, drive.stage_velocity > 0.0, "stage_velocity > 0 with stage_stroke")
    for key, needed in TO_AND_FRO.items():
        value = getattr(drive, key)
        if str(value) != str(needed):
            need = "to be left out" if needed is None else f"{key} = {quote_value(needed)}"
            raise InvalidInput(key, str(value) if key == "integrator" else value, f"{need} beside stage_stroke")


OVER_A_CONTACT: Final[dict[str, Any]] = {
    "integrator": "exact",
    "profile": "sawtooth",
    "surface_compliance": True,
    "reverse_motion": True,
}
"""Settings of a drive with memory: the contact itself has teeth and compliance, and slips back when the pin goes
back."""


def other_than_a_contact(drive: Drive) -> list[str]:
    """List the settings of a drive that only a pin over a record can have."""
    return [key for key, value in OVER_A_CONTACT.items() if str(getattr(drive, key)) != str(value)]


def refuse_with_memory(case: Case) -> None:
    """Raise InvalidInput if the contact of a case cannot be followed while its pin is pulled (`Drive.memory`)."""
    contacts, rule = case.interface.contacts, case.slip_rule
    excluded = {
        "contacts": (contacts > 1, contacts, "a single contact"),
        "pin_translation": (not case.effects.pin_translation, False, "a pin that moves over the surface"),
        "residual_shear": (rule.residual_shear == 1.0, 1.0, "slips that drop stress, residual_shear < 1"),
        "limited_shear": (rule.limited_shear == "forward", "forward", "shear limited both ways"),
    }
    refuse_excluded("memory", True, excluded)


PERIODS: Final = "duration_periods"
TRAVEL: Final = "stage_travel"
AUTO: Final = "auto"
"""Word in campaigns for a drive that lasts until its numbers are determined."""
DURATIONS: Final = ("duration", PERIODS, TRAVEL)
"""Keys that give the duration of a drive."""
FREQUENCY: Final = "stage_frequency"
"""Key that gives the velocity of a stage with a stroke by its cycles in a second."""


def _velocity_of_cycles(parameters: Mapping[str, Any]) -> float:
    """The velocity of a stage that goes to and fro with this frequency. Raises InvalidInput."""
    frequency, velocity = parameters[FREQUENCY], parameters.get("stage_velocity")
    if velocity is not None:
        raise InvalidInput(FREQUENCY, frequency, f"to be left out beside stage_velocity = {quote_value(velocity)}")
    # A cycle is the stroke there and back. As in `stroke_duration`, a sine is π/2 times as fast in its
    # middle as on average.
    way = 2.0 * as_float("stage_stroke", parameters["stage_stroke"])
    longer = math.pi / 2.0 if parameters.get("stage_motion") == "sine" else 1.0
    return longer * way * as_float(FREQUENCY, frequency)


OF_A_STROKE: Final = ("stage_stroke", "stage_motion", "stage_cycles")
"""Parameters of a stage that goes to and fro."""


def refuse_without_stroke(parameters: Mapping[str, Any]) -> None:
    """Raise InvalidInput for parameters that only a stage with a stroke has."""
    for key in (FREQUENCY, *OF_A_STROKE[1:]):
        if parameters.get(key) is not None and parameters.get("stage_stroke") is None:
            raise InvalidInput(key, parameters[key], "stage_stroke beside it")


def natural_period(spring_stiffness: float, pin_mass: float) -> float:
    """2π√(m/k): the period of the pin on its spring, without friction and damper."""
    return 2.0 * math.pi * math.sqrt(pin_mass / spring_stiffness)


def only_length(parameters: Mapping[str, Any]) -> tuple[str, Any] | None:
    """Find which of the `DURATIONS` these parameters give, and its value; None if none is given. Raises InvalidInput
    for two."""
    lengths = [(name, parameters[name]) for name in DURATIONS if parameters.get(name) is not None]
    for other, value in lengths[1:]:
        require(other, value, False, f"to be left out beside {lengths[0][0]} = {quote_value(lengths[0][1])}")
    stroke = parameters.get("stage_stroke")
    if lengths and lengths[0][1] != AUTO and stroke is not None:
        require(
            *lengths[0],
            False,
            f"to be left out beside stage_stroke = {quote_value(stroke)}: stage_cycles end the drive",
        )
    return lengths[0] if lengths else None


def convert_to_seconds(parameters: Mapping[str, Any], pin_mass: float) -> dict[str, Any]:
    """Parameters of a drive in SI with `duration` in s, also where they give it by one of the other `DURATIONS`.

    pin_mass: in kg. Raises InvalidInput if two are given, for a stage that never gets as far, and for values out of range.
    """
    key, stated_length = only_length(parameters) or ("duration", None)
    in_seconds = {name: value for name, value in parameters.items() if name not in (PERIODS, TRAVEL, FREQUENCY)}
    if parameters.get(FREQUENCY) is not None and parameters.get("stage_stroke") is not None:
        in_seconds["stage_velocity"] = _velocity_of_cycles(parameters)
    if key == "duration":
        return {name: None if name == "duration" and value == AUTO else value for name, value in in_seconds.items()}
    # Stiffness and stage velocity alone decide how many seconds a period or a way takes.
    value = as_float(key, stated_length)
    motion: dict[str, Any] = {
        name: in_seconds[name] for name in ("spring_stiffness", "stage_velocity") if name in in_seconds
    }
    drive = Drive.of({**si_defaults(), **motion})
    if key == PERIODS:
        period = natural_period(drive.spring_stiffness, as_float("pin_mass", pin_mass))
        duration, unit, others = value * period, 1.0 / period, "pin_mass and spring_stiffness"
    else:
        unit, others = drive.stage_velocity, "stage_velocity"
        require("stage_velocity", unit, unit > 0.0, f"stage_velocity > 0 with {TRAVEL}")
        duration = value / unit
    stated = declared(Drive)["duration"]
    return {**in_seconds, "duration": _check_range(key, value, duration, stated, unit, f" with this {others}")}


def parameters_of_a_drive() -> Mapping[str, Parameter]:
    """Every parameter of a drive by name, including the parameters of all integrators."""
    return merge_parameters(Drive, *INTEGRATORS.values())


def si_defaults() -> dict[str, Any]:
    """The paper's drive in SI, by parameter."""
    defaults = {item.name: item.default for item in dataclasses.fields(Drive)}
    stated_defaults = {name: stated.si for name, stated in declared(Drive).items()}
    return {name: defaults[name] if value is None else value for name, value in stated_defaults.items()}


# Times that a drive needs.

CYCLES: Final = 4
"""Cycles of stick-slip, or periods of a pin that slides, after the first slip: twice the periods that μ_k needs at the least."""


def estimate_duration(drive: Drive, peak: float, mean: float, surface_stiffness: float, way: float) -> float:
    """The time that a drive needs, in its unit. peak, mean: friction forces in G·L_x·L_y. surface_stiffness: K in G·L_y.

    way: of the friction record, after which the friction repeats, in L_x.
    """
    k, stage = drive.spring_stiffness, drive.stage_velocity
    settling = settling_time(drive, peak)
    if stage == 0.0:
        return CYCLES * settling
    if settling < lag_time(drive):
        return CYCLES * (settling + way / stage)
    # Until the first slip the stage stretches spring and contact in a row.
    first = peak * (1.0 / k + 1.0 / surface_stiffness) / stage
    # The first slip in the first half. A slip ends as far below the mean as it began above: the stage pulls back both.
    return 2.0 * first + CYCLES * (settling + 2.0 * (peak - mean) / (k * stage))


def lag_time(drive: Drive) -> float:
    """Relaxation time c/k: within it an overdamped sliding pin reaches its final lag behind the stage."""
    return 2.0 * drive.damping_ratio / math.sqrt(drive.spring_stiffness)


def settling_time(drive: Drive, peak: float) -> float:
    """The pin's period, or c/k where that is longer: in it the driving force of a sliding pin becomes the friction force.

    A pin that its damper drags moves with the stage at once, however long its spring still stretches.
    """
    period, lag = 2.0 * math.pi / math.sqrt(drive.spring_stiffness), lag_time(drive)
    dragged = lag > period and peak <= drive.spring_stiffness * lag * drive.stage_velocity
    return period if dragged else max(period, lag)
