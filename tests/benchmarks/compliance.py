"""Surface compliance: by nested dissection at the surface alone, against a sparse factorization of the whole stiffness."""

import itertools
import resource
import subprocess
import sys
from functools import partial
from unittest.mock import patch

import numpy as np
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

from nanoslip.solver import Slab, surface_compliance
from nanoslip.solver.elasticity import condensation as dissection
from nanoslip.solver.elasticity.condensation import Eliminated, definitely_eliminated
from nanoslip.solver.elasticity.grid_scheme import GridScheme, stiffness
from nanoslip.solver.slab import SCHEMES
from tests.benchmarks.table import Row, best, seconds, verdict

Dense = NDArray[np.float64]

LIMITS = {129: 0.05, 1025: 3.0}
"""Seconds asked for, per n_x."""
FINEST, FINEST_GIGABYTES = 4097, 6.0
NEAR = 1.5
"""Times what the arithmetic alone takes at the rate of a large matrix product: asked for of the finest slab."""


def sparse_compliance(slab: Slab) -> NDArray[np.float64]:
    """The same matrix, (2n, 2n): the whole stiffness factorized, and solved for a unit force on each surface node."""
    k = stiffness(slab)
    free = np.flatnonzero(~k.fixed)
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
        table += [
            Row(
                f"compliance, {scheme}, n_x = {n_x}",
                seconds(ours),
                f"{seconds(peer)} (scipy splu, same right sides)",
                f"{ours / peer:.2f}",
                verdict(f"≤ {limit:g} s", ours <= limit),
            ),
            Row(
                f"compliance, {scheme}, n_x = {n_x}: largest difference",
                f"{error:.1e} of the largest entry",
                "scipy splu",
                "",
                verdict("≤ 1e-9", error <= 1e-9),
            ),
        ]
    return [*table, *_finest_rows()]


def _finest_rows() -> list[Row]:
    """The finest slab in a process of its own, whose peak memory is then its alone."""
    module = [sys.executable, "-m", __name__, str(FINEST)]
    output = subprocess.run(module, check=True, capture_output=True, text=True).stdout
    duration, gigabytes, operations, rate, touching = map(float, output.split())
    arithmetic = operations / rate
    return [
        Row(
            f"compliance, n_x = {FINEST}: {operations / 1e9:.0f} Gflop as run",
            seconds(duration),
            f"{seconds(arithmetic)} at the rate of a matrix product, {rate / 1e9:.0f} Gflop/s; the result's memory touched "
            f"once: {seconds(touching)} more",
            f"{duration / arithmetic:.1f}",
            verdict(f"≤ {NEAR:g} × arithmetic", duration <= NEAR * arithmetic),
        ),
        Row(
            f"compliance, n_x = {FINEST}: peak memory of the process",
            f"{gigabytes:.2f} GB",
            f"limit {FINEST_GIGABYTES:g} GB (the matrix alone: {(2 * FINEST) ** 2 * 8 / 1e9:.2f} GB)",
            f"{gigabytes / FINEST_GIGABYTES:.2f}",
            verdict(f"≤ {FINEST_GIGABYTES:g} GB", gigabytes <= FINEST_GIGABYTES),
        ),
    ]


def _measure(n_x: int) -> None:
    """Print processor seconds and peak memory in GB of one compliance; its operations, their rate in a matrix product, and
    the seconds of writing a matrix of its size for the first time."""
    slab = Slab(n_x=n_x)
    duration = best(lambda: surface_compliance(slab), repeats=3)
    gigabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9
    square = np.ones((2000, 2000))
    rate = 2.0 * len(square) ** 3 / best(lambda: square @ square)
    touching = best(lambda: np.ones((2 * n_x, 2 * n_x)))
    print(duration, gigabytes, _operations(slab), rate, touching)


def _operations(slab: Slab) -> float:
    """Additions and multiplications of dense matrices: products and roots of every cut, halves of symmetric ones."""
    counted: list[float] = []

    def counting(stiffness: Dense, cut: int, follows: Dense) -> Eliminated:
        others = len(stiffness) - cut + len(follows)
        counted.append(cut * others**2 + cut**2 * others + cut**3 / 3)
        return definitely_eliminated(stiffness, cut, follows)

    with patch.object(dissection, "definitely_eliminated", counting):
        surface_compliance(slab)
    return float(sum(counted))


if __name__ == "__main__":
    _measure(int(sys.argv[1]))
