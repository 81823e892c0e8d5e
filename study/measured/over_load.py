"""Friction over a normal load that changes while the pin slides, or from file to file: its slope, and friction at no load."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
import scipy

from nanoslip.solver.arrays import Floats
from nanoslip.solver.dynamics.coefficients import LARGEST_CHANGE
from nanoslip.solver.ensemble import jackknife, student
from nanoslip.study.measured.means import Measured
from nanoslip.study.measured.recording import NOISE

CHANGES_BY: Final = 2.0
"""Ratio of loads, above which friction is no coefficient times the load: an intercept of 10 % then shows as 5 %."""
GROUPS: Final = 8
"""Groups of neighbouring means, of which each is left out once for ±: as many as parts of a steady mean."""
MOST_MEANS: Final = 64
"""Means of force and load along the trace, eight in each group."""


def has_changing_load(load: Floats) -> bool:
    """True if the load, where there is one, differs by more than twice between its lowest and its highest tenth."""
    load = np.abs(load)
    contact = load[load > np.median(load) / 2.0]
    # Tenths, as the first and last samples may be those of a contact that comes and goes.
    low, high = np.quantile(contact, (0.1, 0.9))
    return bool(high > CHANGES_BY * low)


def friction_over_load(load: Floats, force: Floats) -> dict[str, Measured]:
    """Slope of friction (N) over load (N), friction at no load, and correlation; ± by leaving out groups of neighbours.

    Parts without sliding are left out: further from the line of Theil and Sen than others by ten robust standard deviations.
    """
    count = min(MOST_MEANS, len(load))
    loads = _group_means(np.abs(load), count)
    forces = _group_means(force, count)
    # Theil and Sen's line is that of most pairs: parts at rest do not bend it.
    robust = scipy.stats.theilslopes(forces, loads)
    off = np.abs(forces - robust.intercept - robust.slope * loads)
    largest = float(np.abs(forces).max())
    rounding = np.finfo(float).eps * largest
    slides = off <= NOISE * max(float(np.median(off)), rounding)
    loads, forces = loads[slides], forces[slides]
    line = scipy.stats.linregress(loads, forces)
    without = []
    for group in np.array_split(np.arange(len(loads)), GROUPS):
        kept = np.delete(np.arange(len(loads)), group)
        part = scipy.stats.linregress(loads[kept], forces[kept])
        without.append((part.slope, part.intercept, part.rvalue))
    slopes, intercepts, correlations = np.array(without).T
    count = len(loads)
    slope = Measured(float(line.slope), float(jackknife(slopes)), count)
    intercept = Measured(float(line.intercept), float(jackknife(intercepts)), count, "N")
    return {
        "friction_slope": slope,
        "friction_intercept": intercept,
        "load_correlation": Measured(float(line.rvalue), float(jackknife(correlations)), count),
    }


def has_different_loads(loads: Sequence[float]) -> bool:
    """True if loads of several files are known, and differ by more than what counts as steady."""
    if len(loads) < 2:
        return False
    return bool(np.ptp(loads) > LARGEST_CHANGE * max(loads))


def friction_of_files(loads: Sequence[float], forces: Sequence[Measured]) -> dict[str, Measured]:
    """Line through the friction of several files (N) over their loads (N): slope, friction at no load, and correlation.

    ± is the scatter of files about the line, 68 % of Student's t; of two files it follows from their own ±.
    """
    values = [force.value for force in forces]
    line = scipy.stats.linregress(loads, values)
    count = len(loads)
    if count > 2:
        # Of m files a line leaves m - 2 degrees of freedom, as many as the mean of m - 1.
        quantile = float(student(count - 1))
        slope_error = quantile * float(line.stderr)
        intercept_error = quantile * float(line.intercept_stderr)
    else:
        # Slope (F_2 - F_1)/(W_2 - W_1), intercept (W_2 F_1 - W_1 F_2)/(W_2 - W_1), the errors of both forces independent.
        first, second = (force.uncertainty for force in forces)
        apart = abs(loads[1] - loads[0])
        slope_error = math.hypot(first, second) / apart
        weighted = loads[1] * first, loads[0] * second
        intercept_error = math.hypot(*weighted) / apart
    slope = Measured(float(line.slope), float(slope_error), count)
    intercept = Measured(float(line.intercept), float(intercept_error), count, "N")
    return {
        "friction_slope": slope,
        "friction_intercept": intercept,
        "load_correlation": Measured(float(line.rvalue), math.nan, count),
    }


def _group_means(values: Floats, count: int) -> Floats:
    means = [group.mean() for group in np.array_split(values, count)]
    return np.array(means)
