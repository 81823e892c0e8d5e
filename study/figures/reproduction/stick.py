"""What a pin does while it is stuck (§3.3): bursts of vibration that small slips set off, and the decay of the first one.

The pin at x meets F = K(x - x_R), and each slip moves the relaxation point x_R forward at once. So x - F/K is a staircase
between whose steps nothing slips.
"""

from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.study.figures.reproduction.drive import load_of, run_of

Floats = NDArray[np.float64]
LEAST_DROP = 1e-4
"""Fall of F/W at once that counts as the start of a burst: a twentieth of the first vibration of the paper's drive."""
WINDOW = 2e-3
"""Stretch of time over which a vibration's strength is taken, in s: about three periods of the stuck pin."""
RINGING = 20e-3
"""Time over which the first vibration is followed, in s."""


@dataclass(frozen=True, slots=True, eq=False)
class Stick:
    """The first stick phase of one drive."""

    end: float
    """Start of the first macroscopic slip, in s; the drive's duration where there is none."""
    bursts: Floats
    """Times at which the friction force falls at once by `LEAST_DROP` or more, in s."""
    decay_time: float
    """Time in which the first vibration falls to 1/e, in s."""


def stick_of(dataset: xr.Dataset, begin: float, intrinsic_friction: float = 0.5) -> Stick:
    """Read the first stick phase off a trajectory; its samples need to resolve the vibration of the stuck pin."""
    run = run_of(dataset, intrinsic_friction, begin)
    time, force = run["time"].values, run["sample_friction"].values
    case = dataset.sel(intrinsic_friction=intrinsic_friction, start=begin)
    stretch = force * load_of(dataset) / float(case["surface_stiffness_si"].squeeze())
    drops = np.diff(run["sample_position"].values - stretch) / stretch.max() * force.max()
    starts = run["slip_phase_start"].values
    end = float(starts[0]) if len(starts) else float(time[-1])
    bursts = time[1:][(drops >= LEAST_DROP) & (time[1:] < end)]
    return Stick(end, bursts, decay_time(time, force))


def decay_time(time: Floats, force: Floats) -> float:
    """1/e time of the vibration of a force about its rise at a drive's start: a line through the logarithms of its strength.

    time, force: (n,) from the start on, at least `RINGING` long.
    """
    count = int(np.searchsorted(time, WINDOW))
    windows = [slice(begin, begin + count) for begin in range(0, int(np.searchsorted(time, RINGING)), count)]
    strength = [_strength(time[window], force[window]) for window in windows]
    middles = [float(time[window].mean()) for window in windows]
    return -1.0 / float(np.polyfit(middles, np.log(strength), 1)[0])


def _strength(time: Floats, force: Floats) -> float:
    """Root mean square of a force about its line."""
    return float(np.std(force - np.polyval(np.polyfit(time, force, 1), time)))
