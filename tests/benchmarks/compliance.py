"""Surface compliance: row by row in dense blocks, against a sparse factorization of the whole stiffness."""

import itertools
import resource
import subprocess
import sys
import time
from functools import partial

import numpy as np
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

from solver import Slab, surface_compliance
from solver.elasticity.grid_scheme import GridScheme, stiffness
from solver.slab import SCHEMES
from tests.benchmarks.table import Row, best, seconds, verdict

LIMITS = {129: 0.05, 1025: 3.0}
"""Seconds asked for, per n_x."""
FINEST, FINEST_SECONDS, FINEST_GIGABYTES = 4097, 90.0, 6.0


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
    duration, gigabytes = map(float, subprocess.run(module, check=True, capture_output=True, text=True).stdout.split())
    return [
        Row(
            f"compliance, n_x = {FINEST}",
            seconds(duration),
            f"limit {FINEST_SECONDS:g} s",
            f"{duration / FINEST_SECONDS:.2f}",
            verdict(f"≤ {FINEST_SECONDS:g} s", duration <= FINEST_SECONDS),
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
    """Print processor seconds and peak memory in GB of one compliance."""
    start = time.process_time()
    surface_compliance(Slab(n_x=n_x))
    duration = time.process_time() - start
    print(duration, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9)


if __name__ == "__main__":
    _measure(int(sys.argv[1]))
