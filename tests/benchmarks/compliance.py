"""Surface compliance: by nested dissection at the surface alone, against a sparse factorization of the whole stiffness."""

import itertools
from functools import partial
from unittest.mock import patch

import numpy as np
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

from nanoslip import Slab, surface_compliance
from nanoslip.solver.elasticity import condensation as dissection
from nanoslip.solver.elasticity.condensation import Eliminated, eliminate_definite
from nanoslip.solver.elasticity.grid_scheme import GridScheme, stiffness
from nanoslip.solver.slab import SCHEMES
from tests.benchmarks.apart import alone
from tests.benchmarks.table import Row, at_most, best, peak_memory, seconds, verdict, versus

Dense = NDArray[np.float64]

LIMITS = {129: 0.05, 1025: 3.0}
"""Seconds asked for, per n_x."""
FINEST, FINEST_GIGABYTES = 4097, 6.0
NEAR = 1.5
"""Times what the arithmetic alone takes at the rate of a large matrix product: asked for of the finest slab."""


def sparse_compliance(slab: Slab) -> NDArray[np.float64]:
    """The same matrix, (2n, 2n): the whole stiffness factorized, and solved for a unit force on each surface node."""
    k = stiffness(slab)
    free = np.flatnonzero(~k.fixed.ravel())
    surface = np.concatenate((np.arange(slab.n_x), k.grid.nodes + np.arange(slab.n_x)))
    place = np.searchsorted(free, surface)
    forces = np.zeros((len(free), 2 * slab.n_x))
    forces[place, np.arange(2 * slab.n_x)] = 1.0
    return np.asarray(sla.splu(k.matrix[free][:, free].tocsc()).solve(forces)[place])


def rows() -> list[Row]:
    """Time against the limit and the peer, agreement with the peer, and time and memory of the finest slab."""
    table = []
    with_grid = [name for name, kind in SCHEMES.items() if issubclass(kind, GridScheme)]
    for scheme, (n_x, limit) in itertools.product(with_grid, LIMITS.items()):
        slab, repeats = Slab(n_x=n_x, scheme=scheme), 10 if n_x < 1000 else 2
        ours = best(partial(surface_compliance, slab), repeats)
        peer = best(partial(sparse_compliance, slab), repeats)
        theirs = sparse_compliance(slab)
        error = np.abs(surface_compliance(slab).matrix - theirs).max() / np.abs(theirs).max()
        what = f"compliance, {scheme}, n_x = {n_x}"
        off, near = f"{error:.1e} of the largest entry", verdict("≤ 1e-9", error <= 1e-9)
        table += [
            versus(what, ours, peer, "scipy splu", at_most(ours, limit)),
            Row(f"{what}: largest difference", off, "scipy splu", target=near),
        ]
    return [*table, *_finest_rows()]


def _finest_rows() -> list[Row]:
    """The finest slab in a process of its own, whose peak memory is then its alone."""
    duration, gigabytes, operations, rate, touching = alone(_measure, FINEST)
    arithmetic, limit = operations / rate, FINEST_GIGABYTES
    name = f"matrix product, {rate / 1e9:.0f} Gflop/s; touching its memory: {seconds(touching)} more"
    target = verdict(f"≤ {NEAR:g} × arithmetic", duration <= NEAR * arithmetic)
    what, whole = f"compliance, n_x = {FINEST}", f"the matrix alone: {(2 * FINEST) ** 2 * 8 / 1e9:.2f} GB"
    least = verdict(f"≤ {limit:g} GB", gigabytes <= limit)
    return [
        versus(f"{what}: {operations / 1e9:.0f} Gflop as run", duration, arithmetic, name, target),
        Row(
            f"{what}: peak memory", f"{gigabytes:.2f} GB", f"{limit:g} GB ({whole})", f"{gigabytes / limit:.2f}", least
        ),
    ]


def _measure(n_x: int) -> tuple[float, ...]:
    """Processor seconds and peak memory in GB of one compliance; its operations, their rate in a matrix product, and
    the seconds of writing a matrix of its size for the first time."""
    slab = Slab(n_x=n_x)
    duration = best(lambda: surface_compliance(slab), repeats=3)
    gigabytes = peak_memory() / 1e9
    square = np.ones((2000, 2000))
    rate = 2.0 * len(square) ** 3 / best(lambda: square @ square)
    touching = best(lambda: np.ones((2 * n_x, 2 * n_x)))
    return duration, gigabytes, _operations(slab), rate, touching


def _operations(slab: Slab) -> float:
    """Additions and multiplications of dense matrices: products and roots of every cut, halves of symmetric ones."""
    counted: list[float] = []

    def counting(stiffness: Dense, cut: int, follows: Dense) -> Eliminated:
        others = len(stiffness) - cut + len(follows)
        counted.append(cut * others**2 + cut**2 * others + cut**3 / 3)
        return eliminate_definite(stiffness, cut, follows)

    with patch.object(dissection, "eliminate_definite", counting):
        surface_compliance(slab)
    return float(sum(counted))
