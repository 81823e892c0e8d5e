"""Result of a drive: trajectory, slips found by the integrator, and loops and legs of a stage that goes to and fro."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.drive import Drive
from nanoslip.solver.outcome import Outcome
from nanoslip.solver.parameter import ENERGY, OVER_LOAD, Quantity, quantity
from nanoslip.solver.view import Curve, OneLine, Picture, describe_outcome

BINS: Final = 256
"""Stretches of time over which the friction force is averaged."""


def sample_column(meaning: str, name: str, units: str = "1", **more: Any) -> Any:
    """Declare a column over the output times. name: the part after `sample_`."""
    return quantity(meaning, f"sample_{name}", units, along="sample", **more)


def slip_phase(meaning: str, name: str, units: str = "1", **more: Any) -> Any:
    """Declare a column over the macroscopic slips. name: the part after `slip_phase_`."""
    return quantity(meaning, f"slip_phase_{name}", units, along="slip_phase", **more)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class DynamicsResult(OneLine):
    """The motion of a driven pin. Lengths in L_x, forces in G·L_x·L_y, time in √(m/(G·L_y)), energy in G·L_x²·L_y.

    A slip is uninterrupted motion faster than `stick_velocity`, the velocity of a stuck pin; it is macroscopic if longer than
    `presliding_length` and not within that length of the start. Beyond the end of a failed run numbers are NaN. Only the first
    six arrays depend on the number of samples.
    """

    time: Floats = quantity(
        "time since the stage started", "", "s", per="time", along="sample", coordinate=True, symbol="t"
    )
    """(n + 1,) evenly spaced times from 0 to the end of the drive."""
    position: Floats = sample_column("position of the pin", "position", "m", per="length", symbol="x")
    """(n + 1,) x."""
    stage: Floats = sample_column("position of the stage", "stage", "m", per="length")
    """(n + 1,) Vt; of a stage that goes to and fro, from the middle of its way."""
    velocity: Floats = sample_column("velocity of the pin", "velocity", "m s-1", per="velocity")
    """(n + 1,) dx/dt."""
    spring_force: Floats = sample_column(
        "spring force over load", "spring_force", per="normal_load", symbol="k(Vt - x)/W"
    )
    """(n + 1,) k times stage less pin, k(Vt - x)."""
    friction_force: Floats = sample_column(
        "friction force over load", "friction", **OVER_LOAD, comment="on the pin, Eq. 13"
    )
    """(n + 1,) F of Eq. 13."""
    slip_time: Floats = slip_phase("start of macroscopic slip", "start", "s", per="time")
    """(s,) t_slip."""
    slip_position: Floats = slip_phase("position where the slip starts", "position", "m", per="length")
    """(s,) x_stick."""
    slip_force: Floats = slip_phase(
        "static friction of the slip",
        "force",
        per="normal_load",
        symbol="μ_s",
        comment="force of spring and damper over load",
    )
    """(s,) the largest force of spring and damper until the pin is as fast as the stage."""
    restick_time: Floats = slip_phase("time at which the pin sticks again", "end", "s", per="time")
    """(s,) NaN if the slip lasts to the end of the run."""
    restick_position: Floats = slip_phase("position where the pin sticks again", "end_position", "m", per="length")
    """(s,) NaN likewise."""
    micro_slips: int = quantity("slips shorter than presliding_length")
    micro_travel: float = quantity("total length of the micro slips", "", "m", per="length")
    binned_force: Floats
    """(256,) mean friction force in equal stretches of time: that of spring and damper, less by the change of momentum."""
    spring_force_range: float
    """Largest less least spring force in the second half of the time, in G·L_x·L_y."""
    friction_work: float = quantity("work against friction", **ENERGY)
    """∫F dx: work against friction, including the energy still stored in the elastic contact."""
    stick_velocity: float = quantity(
        "velocity of a stuck pin",
        "",
        "m s-1",
        per="velocity",
        comment="velocity of a stuck pin dragged by the stage; also without surface compliance that of the compliant contact",
    )
    """Velocity kV/(k + K). A rigid contact sticks at rest, but uses it, too: K then only distinguishes slip from stick."""
    settling_time: float = quantity(
        "settling time of the motion",
        "",
        "s",
        per="time",
        comment="natural period of the pin on its spring, or c/k where that is longer and the damper does not drag the pin "
        "over all friction",
    )
    presliding_length: float = quantity("stretch of the contact before sliding", "", "m", per="length")
    """Mean steady friction over K."""
    end_time: float = quantity("time at which the drive ended", "", "s", per="time")
    """Duration of the drive, or the time when its last slip ended."""
    steps: int = quantity("segments or time steps of the integrator")
    outcome: Outcome
    """Outcome of the run."""
    forgotten_from: float = 0.0
    """Earliest time at which the start no longer decides the regime; a given duration is never asked."""

    def _facts(self) -> Iterator[str]:
        yield f"{len(self.time)} samples to t = {self.end_time:.4g}"
        yield f"{len(self.slip_time)} slips"
        yield f"{self.micro_slips} micro slips"
        yield describe_outcome(self.outcome)

    def picture(self, normal_load: float) -> Picture:
        """Spring force and friction force over time, as shares of the load, for `nanoslip.solver.view.draw_picture`."""
        forces = {"friction": self.friction_force, "spring": self.spring_force}
        curves = (Curve(self.time, force / normal_load, name) for name, force in forces.items())
        return Picture("time t, in √(m/(G·L_y))", "force over load", tuple(curves))


def raising(key: str) -> str:
    """Advice to raise the parameter that ended a drive; empty of the duration, which `Outcome.longer` stands for."""
    return "" if key == "duration" else f": raise {key}"


def ending_parameter(result: DynamicsResult, drive: Drive) -> str:
    """Parameter that ended a drive: `max_slips`, `duration`, or `step_limit` (no duration, and twice the time exceeds it)."""
    ended = int(np.count_nonzero(np.isfinite(result.restick_time)))
    if drive.max_slips is not None and ended >= drive.max_slips:
        return "max_slips"
    return "step_limit" if drive.duration is None and 2 * result.steps > drive.step_limit else "duration"


# A drive whose stage goes to and fro. A leg is the way of the stage from one turn to the next: the first one begins in the
# middle, and two more are one cycle.

LegWord = Literal["partial_slip", "micro_slip", "slides", "stick_slip"]
LEG_WORDS: Final[Mapping[LegWord, str]] = {
    "partial_slip": "the pin slides by less than presliding_length, or not at all",
    "micro_slip": "it follows the stage in slips shorter than that",
    "slides": "it slides once",
    "stick_slip": "it slides and sticks again and again",
}
"""Word of a leg -> its meaning."""
_MEANINGS: Final = "; ".join(f"{word}: {meaning}" for word, meaning in LEG_WORDS.items())


def _energy(meaning: str, comment: str) -> Any:
    """Declare an energy of a cycle."""
    return quantity(
        meaning, ensemble=True, shared="repetition", comment=f"{comment}; mean over all cycles but the first", **ENERGY
    )


def _length(meaning: str, comment: str) -> Any:
    """Declare a length of a stroke."""
    si = Quantity("", meaning, "m", "length")
    return quantity(meaning, ensemble=True, shared="repetition", comment=comment, si=si, measure="L_x")


@dataclass(frozen=True, slots=True)
class StageLoops:
    """Numbers of the cycles of a stage but for the first; energies in G·L_x²·L_y, forces over W, lengths in L_x."""

    loop_energy: float = _energy("area of the loop of spring force", "over the place of the stage")
    stage_energy: float = _energy("work of the stage in a cycle", "through spring and damper")
    contact_energy: float = _energy("energy lost in the contact in a cycle", "work of the pin against friction")
    damper_energy: float = _energy(
        "energy lost in the damper in a cycle",
        "work of the stage minus work against friction and the energy stored in pin and spring",
    )
    midstroke_friction: float = quantity(
        "friction at mid-stroke over load",
        ensemble=True,
        shared="repetition",
        per="normal_load",
        symbol="F/W",
        comment="mean over the middle eighth of the time of a leg; NaN if the pin does not slide by then: "
        "sliding_stroke is needed",
    )
    turn_static_friction: float = quantity(
        "static friction after a turn",
        ensemble=True,
        shared="repetition",
        per="normal_load",
        symbol="μ_s",
        comment="force of spring and damper in the first macroscopic slip of a leg, mean over the legs that have one",
    )
    friction_offset: float = quantity(
        "mean friction force of a cycle over load",
        ensemble=True,
        shared="repetition",
        per="normal_load",
        comment="0 of a symmetric loop",
    )
    pin_stroke: float = _length("stroke of the pin", "end to end, mean over legs")
    sliding_stroke: float = _length(
        "stage stroke that slides at mid-stroke",
        "the shortest one, 4F(1/k + 1/K), with the friction force F of the plateau",
    )
    stage_closure: float = quantity(
        "gap between the last two loops",
        ensemble=True,
        shared="repetition",
        per="normal_load",
        comment="largest difference of the spring force at one place of the stage, over load; 0 of a loop that closes",
    )
    turn_delay: float = quantity(
        "delay of the pin's turn",
        ensemble=True,
        shared="repetition",
        comment="from the stage's turn to the pin's, as a share of a leg's time",
    )
    leg_regime: LegWord = quantity("motion of the pin on most legs", comment=_MEANINGS, words=tuple(get_args(LegWord)))


def stage_column(meaning: str, name: str, units: str = "1", **more: Any) -> Any:
    """Declare a column over the legs of a stage. name: the part after `stage_leg_`."""
    return quantity(meaning, f"stage_leg_{name}", units, along="stage_leg", **more)


@dataclass(frozen=True, slots=True, eq=False)
class StageLegs:
    """Numbers of each leg of a stage, (legs,), the first of which begins in the middle; forces against its direction."""

    direction: NDArray[np.int8] = stage_column("direction of the leg", "direction", dtype=np.int8)
    begin: Floats = stage_column("time at its begin", "begin", "s", per="time")
    static_force: Floats = stage_column(
        "static friction after the turn",
        "static_friction",
        per="normal_load",
        symbol="μ_s",
        comment="NaN without macroscopic slip, and beyond twice the contact's largest force, which is inertia",
    )
    middle_force: Floats = stage_column(
        "friction at mid-stroke over load", "midstroke_friction", per="normal_load", symbol="F/W"
    )
    spring_work: Floats = stage_column("area under the spring force", "loop_energy", **ENERGY)
    stage_work: Floats = stage_column("work of the stage", "stage_energy", **ENERGY)
    friction_work: Floats = stage_column("work against friction", "contact_energy", **ENERGY)
    stored: Floats = stage_column("energy that spring and pin gain", "stored_energy", **ENERGY)
    slips: NDArray[np.int64] = stage_column("macroscopic slips", "slips", dtype=np.int64)
    regime: NDArray[np.int8] = stage_column(
        "motion of the pin", "regime", "", codes=tuple(get_args(LegWord)), dtype=np.int8, comment=_MEANINGS
    )


def no_legs() -> StageLegs:
    """The columns of a drive in one direction."""
    floats, counts = np.empty(0), np.empty(0, np.int64)
    codes = np.empty(0, np.int8)
    return StageLegs(codes, floats, floats, floats, floats, floats, floats, floats, counts, codes)
