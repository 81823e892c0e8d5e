"""The numbers that Streator (2022) states, each with its section: what figures and choices are compared with."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from nanoslip.study.figures.shared import Claim, start_statistics


@dataclass(frozen=True, slots=True)
class Stated:
    """A number of the paper, in the unit of `meaning`."""

    meaning: str
    value: float
    section: str
    doubt: float
    """Half a unit of the last digit, or how exactly its words are meant."""
    text: str = ""
    """Text in the paper, if it is not the number alone."""

    def __str__(self) -> str:
        return f"{self.text or f'{self.value:g}'} (§{self.section})"


PLATEAU_SHARE: Final = Stated("plateau F/W over μ_i", 0.56, "3.2.1", 0.01, "about 56 %")
PLATEAU: Final = Stated("plateau F/W", 0.28, "3.2.1", 0.005, "around 0.28")
SLIPS: Final = Stated("events triggered by a slip", 1952, "3.2.1", 0.5)
RELEASES: Final = Stated("events triggered by a release", 44, "3.2.1", 0.5)
TOUCHES: Final = Stated("events triggered by a touch", 4, "3.2.1", 0.5)
DISPLACEMENT_HALF: Final = Stated("total δ_p/L_x, μ_i = 0.5", 0.9e-3, "3.2.2", 0.05e-3, "about 0.9e-3")
DISPLACEMENT_QUARTER: Final = Stated("total δ_p/L_x, μ_i = 0.25", 1.3e-3, "3.2.2", 0.05e-3, "about 1.3e-3")
STEP: Final = Stated("mean step per event, nm", 1.0, "3.2.2", 0.0, "below 1 nm")
STATIC: Final = Stated("μ_s up to 89 ms", 0.282, "3.3", 0.0005)
LATER_STATIC: Final = Stated("μ_s after 89 ms", 0.272, "3.3", 0.0005)
KINETIC: Final = Stated("μ_k", 0.267, "3.3", 0.0005)
LATER_SLIP: Final = Stated("time of the second slip, ms", 89, "3.3", 0.5)
FIRST_SLIP: Final = Stated("macroscopic slip, ms", 70, "3.3", 2.5, "about 70")
STICK_PHASES: Final = Stated("stick phases, μ_i = 0.5", 2, "3.3", 0.0, "two")
STICK_PHASES_QUARTER: Final = Stated("stick phases, μ_i = 0.25", 1, "3.3", 0.0, "one")
RESTICKS: Final = Stated("re-sticks in the velocity, μ_i = 0.5", 2, "3.3", 0.0, "two")
RINGING: Final = Stated("first vibration dies out, ms", 15, "3.3", 2.5, "about 15")
DAMPER: Final = Stated("damper's force on a pin at rest, N", 0.13, "3.3", 0.005)
FINAL_VELOCITY: Final = Stated("velocity in the end, mm/s", 2, "3.3", 0.0)


def compared(
    stated: Stated, values: NDArray[np.float64], why: str = "", meaning: str = "", digits: int = 4, scale: float = 1.0
) -> Claim:
    """The claim that a number of the paper is what starts give: its remark begins with whether it lies in their range.

    values: (m,) one for each start; scale: into the unit of the paper's number.
    """
    found = scale * values[np.isfinite(values)]
    remark = "; ".join(part for part in (_verdict(stated, found), why) if part)
    return Claim(meaning or stated.meaning, str(stated), start_statistics(found, digits), remark)


def _verdict(stated: Stated, found: NDArray[np.float64]) -> str:
    """State if a number lies within the range of starts, else its distance from their mean in percent."""
    if not len(found):
        return ""
    if found.min() - stated.doubt <= stated.value <= found.max() + stated.doubt:
        return "within the range of starts" if len(found) > 1 else "agrees"
    mean = float(found.mean())
    return (
        f"the paper's is {100.0 * abs(stated.value / mean - 1.0):.2g} % {'higher' if stated.value > mean else 'lower'}"
        if mean
        else "differs"
    )
