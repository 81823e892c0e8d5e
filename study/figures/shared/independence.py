"""Effective number of independent values among several correlated ones."""

import numpy as np
from numpy.typing import NDArray
from scipy import stats

Floats = NDArray[np.float64]


def effective_number(samples: Floats) -> float:
    """Effective number of independent columns of (samples, n) numbers: n²/Σ r², r their rank correlations.

    It is n where no column knows of another, and 1 where all rank alike. Samples with a NaN, and columns that never vary,
    do not count. It is NaN where fewer than two samples are left, or no column.
    """
    whole = samples[np.isfinite(samples).all(axis=1)]
    varied = whole[:, np.ptp(whole, axis=0) > 0.0] if len(whole) > 1 else whole[:, :0]
    if not varied.shape[1]:
        return float("nan")
    correlation = np.atleast_2d(np.corrcoef(stats.rankdata(varied, axis=0), rowvar=False))
    return float(len(correlation) ** 2 / np.sum(correlation**2))
