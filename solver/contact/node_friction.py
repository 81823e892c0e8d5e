"""μ_i of every surface node: one value for all, or drawn from a distribution by the case's own seed."""

import math
from collections.abc import Callable

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.case import Case, Distribution, Heterogeneity

Vector = NDArray[np.float64]


def node_friction(case: Case) -> NDArray[np.float64]:
    """μ_i of the case's surface nodes, shape (n,)."""
    mean, n = case.intrinsic_friction, case.slab.n_x
    return np.full(n, mean) if case.heterogeneity.spread == 0.0 else mean * _factors(case.heterogeneity, n)


def _factors(drawn: Heterogeneity, n: int) -> NDArray[np.float64]:
    """Independent random numbers with mean 1 and standard deviation `spread`, by inversion of uniform ones."""
    # Of numpy's streams only the raw one is promised to stay the same.
    raw = np.random.PCG64(drawn.seed).random_raw(n)
    uniform = (np.right_shift(raw, np.uint64(11)).astype(np.float64) + 0.5) * 2.0**-53
    return DISTRIBUTIONS[drawn.distribution](uniform, drawn.spread)


def _lognormal(uniform: Vector, spread: float) -> Vector:
    sigma = math.sqrt(math.log1p(spread**2))
    return np.asarray(np.exp(sigma * scipy.special.ndtri(uniform) - sigma**2 / 2.0))


DISTRIBUTIONS: dict[Distribution, Callable[[Vector, float], Vector]] = {
    "lognormal": _lognormal,
    "uniform": lambda uniform, spread: np.asarray(1.0 + math.sqrt(3.0) * spread * (2.0 * uniform - 1.0)),
    "normal": lambda uniform, spread: np.maximum(1.0 + spread * scipy.special.ndtri(uniform), 0.0),
}
"""Distribution -> its numbers of mean 1 and this standard deviation, from uniform ones in (0, 1)."""
