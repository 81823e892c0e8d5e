"""Means of measured values with their ±: of correlated values by means of a few batches, of a force from slip to slip."""

import math
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.dynamics.coefficients import steady_blocks, truncation
from nanoslip.solver.dynamics.result import BINS
from nanoslip.solver.ensemble import FEWEST, jackknife, mean_of


class Measured(NamedTuple):
    """Number of a trace: its mean over this number of cycles, and its ± (NaN if unknown)."""

    value: float
    uncertainty: float
    of: int
    unit: str = "1"


# Error of the mean of correlated values in a row, by means of a few batches (Schmeiser, Operations Research 30, 556, 1982).

VALUE_BATCHES: Final = 4
"""Batches of correlated values. Of 40 values that are correlated over 6, 2 ± then holds in 80 %, with 8 batches in 67 %."""
REJECTED: Final = 0.1
"""Share of rows of independent values that the test takes for correlated (Fishman, Management Science 24, 510, 1978)."""


def independent(values: Floats) -> Floats:
    """The values, or means of batches of neighbours if these are correlated. The mean of all ± the error of these is theirs."""
    if not has_correlation(values):
        return values
    batches = np.array_split(values, VALUE_BATCHES)
    return np.array([batch.mean() for batch in batches])


def has_correlation(values: Floats) -> bool:
    """True if neighbours are more alike than independent values are: von Neumann's ratio, one-sided."""
    count, off = len(values), values - values.mean()
    squares = float(off @ off)
    if count <= 2 * VALUE_BATCHES or squares == 0.0:
        return False
    # About the correlation of neighbours: for n independent values 0 ± √((n - 2)/(n² - 1)).
    differences = float(np.sum(np.diff(values) ** 2))
    alike = 1.0 - differences / (2.0 * squares)
    least = float(scipy.special.ndtri(1.0 - REJECTED))
    deviation = math.sqrt((count - 2.0) / (count**2 - 1.0))
    return alike > least * deviation


def mean_of_cycles(
    at: Floats, force: Floats, starts: Sequence[float], unit: str, together: NDArray[np.bool_]
) -> dict[str, Measured]:
    """The mean of the force from slip to slip; its ± from leaving out one cycle each.

    Over whole periods the stage's work is that of friction and damper, and a stuck pin does none: so it is μ_k, averaged over the
    way of the pin, and 2ζ/(ω r T) ∫y'² dt, which the damper takes.
    """
    kept = together.copy()
    kept[:1] &= len(starts) <= FEWEST  # the first slip is from rest
    if not kept.any():
        return {}
    impulse = np.interp(starts, at, _impulse(at, force))
    work = np.diff(impulse)[kept]
    lasts = np.diff(starts)[kept]
    # The mean is a ratio of sums: its error is that of the work of each cycle less the mean over its time.
    excess = work - work.sum() / lasts.sum() * lasts
    if len(lasts) > 1 and has_correlation(excess):
        work, lasts = _batch_sums(work), _batch_sums(lasts)
    without: Any = []
    if len(lasts) > 1:
        other_work, other_time = work.sum() - work, lasts.sum() - lasts
        without = other_work / other_time
    mean = float(work.sum() / lasts.sum())
    error = jackknife(without)
    return {"mean_force": Measured(mean, error, int(kept.sum()), unit)}


def _batch_sums(values: Floats) -> Floats:
    batches = np.array_split(values, VALUE_BATCHES)
    return np.array([batch.sum() for batch in batches])


def _impulse(at: Floats, force: Floats) -> Floats:
    """The force added up from the first sample to each."""
    heights = (force[1:] + force[:-1]) / 2.0
    parts = np.diff(at) * heights
    return np.concatenate(([0.0], np.cumsum(parts)))


def mean_with_error(values: Sequence[float] | Floats, unit: str) -> Measured:
    """The mean of these values and its ±; NaN of none."""
    if not len(values):
        return Measured(math.nan, math.nan, 0, unit)
    mean = float(np.mean(values))
    error = mean_of(independent(np.asarray(values, float))).uncertainty
    return Measured(mean, float(error), len(values), unit)


def steady_mean(at: Floats, force: Floats, unit: str) -> tuple[Measured, float, float]:
    """Mean of the force while it is steady, with the ± of eight parts; its start; and its relative change if it is not."""
    edges = np.linspace(at[0], at[-1], BINS + 1)
    impulse = np.interp(edges, at, _impulse(at, force))
    bins = np.diff(impulse) / np.diff(edges)
    blocks, complaint = steady_blocks(bins)
    means = blocks.reshape(8, -1).mean(axis=1)
    change = math.nan
    if complaint:
        places = np.linspace(-0.5, 0.5, 8)  # of a trace of length 1: the slope is the change along all of it
        slope, _ = np.polyfit(places, means, 1)
        change = float(slope / means.mean())
    return mean_with_error(means, unit), float(edges[truncation(bins)]), change
