"""The numbers that Streator (2022) states, each with its section: what figures and choices are compared with."""

from typing import Final

from nanoslip.study.figures.shared import Stated

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
