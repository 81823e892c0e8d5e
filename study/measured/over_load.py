"""Friction over a normal load that changes while the pin slides: its slope, and the friction without a load."""

import math
from typing import Final

import numpy as np
import scipy

from nanoslip.solver.arrays import Floats
from nanoslip.solver.ensemble import jackknife
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
    low, high = np.quantile(contact, (0.1, 0.9))
    return bool(high > CHANGES_BY * low)


def friction_over_load(load: Floats, force: Floats) -> dict[str, Measured]:
    """Slope of friction (N) over load (N), friction at no load, and correlation; ± by leaving out groups of neighbours.

    Parts without sliding are left out: further from the line of Theil and Sen than others by ten robust standard deviations.
    """
    count = min(MOST_MEANS, len(load))
    loads, forces = _group_means(np.abs(load), count), _group_means(force, count)
    robust = scipy.stats.theilslopes(forces, loads)
    off = np.abs(forces - robust.intercept - robust.slope * loads)
    rounding = np.finfo(float).eps * float(np.abs(forces).max())
    slides = off <= NOISE * max(float(np.median(off)), rounding)
    loads, forces = loads[slides], forces[slides]
    line = scipy.stats.linregress(loads, forces)
    without = []
    for group in np.array_split(np.arange(len(loads)), GROUPS):
        kept = np.delete(np.arange(len(loads)), group)
        part = scipy.stats.linregress(loads[kept], forces[kept])
        without.append((part.slope, part.intercept))
    slopes, intercepts = np.array(without).T
    count = len(loads)
    return {
        "friction_slope": Measured(float(line.slope), float(jackknife(slopes)), count),
        "friction_intercept": Measured(float(line.intercept), float(jackknife(intercepts)), count, "N"),
        "load_correlation": Measured(float(line.rvalue), math.nan, 0),
    }


def _group_means(values: Floats, count: int) -> Floats:
    return np.array([group.mean() for group in np.array_split(values, count)])
