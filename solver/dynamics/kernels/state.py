"""What the kernels of Eq. 12-14 work on: the drive, the teeth of F̃, the pin, slips, and what a run records.

Units make the pin's mass 1: x'' = D - F with the driving force D = k(Vt - x) + c(V - x'). The friction force F carries
the history: the relaxation point is x_R = x - F/K at all times (Eq. 14), so F is kept instead. Within one tooth of the
limit F̃, F is linear in x with slope K (stuck: elastic contact), with F̃'s own (following the limit), or with minus F̃'s
(following -F̃ on the way back), and the motion is that of a damped linear oscillator.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SlipRow = tuple[float, float, float, float, float]
"""A row of `Run.slips`."""


class Motion(NamedTuple):
    """Eq. 12 as its kernels see it; `stick_velocity` is kV/(k + K), at which the stage drags a stuck pin along."""

    spring: float
    damping: float
    stage: float
    surface_stiffness: float
    """K; infinite for a rigid contact."""
    stick_velocity: float
    presliding: float
    """Mean F̃ over K: only a longer slip is macroscopic."""
    duration: float
    instant: float
    """Time after a segment's start within which an extremum of the velocity is ignored: a phase of 1e-8 of the fastest
    motion, which changes the velocity by the square of that. It is rounding."""
    most_slips: int
    """The run ends where the last of so many macroscopic slips ends."""
    recorded: float
    """Time over which samples and impulse are spread; the spring force's range is that of its second half."""


class Teeth(NamedTuple):
    """The limit F̃: see nanoslip.solver.dynamics.friction_limit.FrictionLimit."""

    edges: Floats
    force: Floats
    slope: Floats
    periodic_from: int


class Pin(NamedTuple):
    """State at one instant; friction_force is F of Eq. 13."""

    time: float
    position: float
    velocity: float
    friction_force: float


class Slip(NamedTuple):
    """A stretch of motion faster than the stick velocity, while it lasts, and the sum of those too short to be macroscopic."""

    sliding: bool
    climbing: bool
    """Not yet as fast as the stage."""
    time: float
    position: float
    peak: float
    micro_slips: int
    micro_travel: float


class Run(NamedTuple):
    """What every method delivers."""

    reached: float
    """Time up to which it came."""
    steps: int
    samples: Floats
    """(n + 1, 3): position, velocity, friction force at evenly spaced times."""
    impulse: Floats
    """(b + 1,): time integral of the driving force up to the edges of equal stretches of time."""
    slips: Floats
    """(s, 5): time and position of slip, largest driving force, time and position of re-stick."""
    micro_slips: int
    micro_travel: float
    friction_work: float
    least_spring_force: float
    largest_spring_force: float
    """In the second half of the time recorded."""


class Record(NamedTuple):
    """What a run fills while it goes on: see `Run`."""

    samples: Floats
    impulse: Floats
    duration: float
    spring_range: Floats
    """(2,): least and largest spring force since `half`; infinite, the wrong way round, before."""
    half: float


class Tally(NamedTuple):
    """What a run adds up while it goes on; sums up to the last edge or other end of a segment."""

    steps: int
    resisted: float
    """∫F dt."""
    work: float
    """∫F dx."""
    row: int
    edge: int
    """The first row of `samples` and entry of `impulse` still to be written."""
