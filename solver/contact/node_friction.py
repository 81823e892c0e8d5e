"""μ_i of every surface node: one value for all, or drawn from a distribution by the case's own seed."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from solver.case import Case, Heterogeneity


def node_friction(case: Case) -> NDArray[np.float64]:
    """μ_i of the case's surface nodes, shape (n,)."""
    mean, n = case.intrinsic_friction, case.slab.n_x
    return np.full(n, mean) if case.heterogeneity.spread == 0.0 else mean * _factors(case.heterogeneity, n)


def _factors(drawn: Heterogeneity, n: int) -> NDArray[np.float64]:
    """Independent random numbers with mean 1 and standard deviation `spread`, by inversion of uniform ones."""
    # Of numpy's streams only the raw one is promised to stay the same.
    raw = np.random.PCG64(drawn.seed).random_raw(n)
    uniform = (np.right_shift(raw, np.uint64(11)).astype(np.float64) + 0.5) * 2.0**-53
    if drawn.distribution == "uniform":
        return np.asarray(1.0 + math.sqrt(3.0) * drawn.spread * (2.0 * uniform - 1.0))
    if drawn.distribution == "normal":
        return np.maximum(1.0 + drawn.spread * ndtri(uniform), 0.0)
    sigma = math.sqrt(math.log1p(drawn.spread**2))
    return np.exp(sigma * ndtri(uniform) - sigma**2 / 2.0)
