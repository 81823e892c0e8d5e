"""What a drive did: the trajectory at evenly spaced times, and the slips that the integrator itself found."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.outcome import Outcome

BINS: Final = 256
"""Stretches of time over which the driving force is averaged."""


@dataclass(frozen=True, slots=True, eq=False)
class DynamicsResult:
    """The motion of a driven pin. Lengths in L_x, forces in G·L_x·L_y, time in √(m/(G·L_y)), energy in G·L_x²·L_y.

    Only the first five arrays depend on the number of samples asked for. A slip is an uninterrupted stretch of motion
    faster than `creep_velocity`, with which the stage drags a stuck pin along; it is macroscopic if it is longer than
    `presliding_length`. What a run that ended badly did not reach is NaN.
    """

    time: NDArray[np.float64]
    """(n + 1,) evenly spaced times from 0 to the drive's duration."""
    position: NDArray[np.float64]
    """(n + 1,) x."""
    velocity: NDArray[np.float64]
    """(n + 1,) dx/dt."""
    spring_force: NDArray[np.float64]
    """(n + 1,) k(Vt - x)."""
    friction: NDArray[np.float64]
    """(n + 1,) F of Eq. 13."""
    slip_time: NDArray[np.float64]
    """(s,) when each macroscopic slip starts (t_slip)."""
    slip_position: NDArray[np.float64]
    """(s,) where it starts (x_stick)."""
    slip_force: NDArray[np.float64]
    """(s,) its static friction: the largest force of spring and damper until the pin is as fast as the stage."""
    restick_time: NDArray[np.float64]
    """(s,) when it ends; NaN if it lasts to the end of the run."""
    restick_position: NDArray[np.float64]
    """(s,) where it ends; NaN likewise."""
    micro_slips: int
    """Number of slips that ended before the presliding length."""
    micro_travel: float
    """Their total length."""
    binned_force: NDArray[np.float64]
    """(256,) mean driving force in equal stretches of time."""
    friction_work: float
    """∫F dx: what friction took, the energy still stored in the elastic contact included."""
    creep_velocity: float
    """kV/(k + K)."""
    settling_time: float
    """A natural period of the pin on its spring, or the damper's time constant c/k where that is longer."""
    presliding_length: float
    """Mean steady friction over K: how far the contact stretches before it slides."""
    steps: int
    """Segments or time steps computed."""
    outcome: Outcome
    """How the run ended."""
