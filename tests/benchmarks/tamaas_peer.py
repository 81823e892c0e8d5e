"""Tamaas as a peer: the same pin and load on a periodic half-plane. The same work, not the same answer."""

from collections.abc import Callable

import numpy as np

from nanoslip.solver.case import Case
from tests.benchmarks.table import Row, best, seconds, verdict, versus


def beside_tamaas(what: str, ours: float, case: Case, most: float, limit: float = np.inf) -> Row:
    """A row of a contact that took so long: at most so many times tamaas, where it is there, and so many seconds."""
    solve, asked = tamaas_solve(case), "" if limit == np.inf else f"≤ {limit} s, "
    if not solve:
        return Row(what, seconds(ours), "tamaas: not installed", target=asked and verdict(asked[:-2], ours <= limit))
    peer = best(solve)
    target = verdict(f"{asked}≤ {most:g} × tamaas", ours <= min(limit, most * peer))
    return versus(what, ours, peer, "tamaas, Polonsky-Keer, periodic", target, ratio=f"{ours / peer:.3g}")


def tamaas_solve(case: Case) -> Callable[[], object] | None:
    """The same pin and load on tamaas's periodic half-plane of one slab width, to 1e-12; None where it is missing."""
    try:
        import tamaas  # type: ignore[import-untyped,import-not-found,unused-ignore]
    except ImportError:
        return None
    points = case.slab.n_x - 1
    x = (np.arange(points) + 0.5) / points - 0.5
    surface = -(x**2) / (2.0 * case.radius)

    tamaas.set_log_level(tamaas.LogLevel.error)

    def solve() -> object:
        model = tamaas.ModelFactory.createModel(tamaas.model_type.basic_1d, [1.0], [points])
        model.nu, model.E = case.slab.poisson, 2.0 * (1.0 + case.slab.poisson)
        solver = tamaas.PolonskyKeerRey(model, surface, 1e-12)
        solver.setDumpFrequency(1_000_000)
        return solver.solve(case.normal_load)

    return solve
