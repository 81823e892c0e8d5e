"""Contact without shear on a half-plane, which needs no matrix, beside Tamaas, its matrix, and Hertz."""

import math
import tracemalloc
from dataclasses import replace

import numpy as np

from nanoslip.solver.case import Case, Effects, Heterogeneity
from nanoslip.solver.contact.closed_forms import hertz
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.elasticity.compliance import normal_compliance, surface_compliance
from nanoslip.solver.simulate import contact_state
from nanoslip.solver.slab import Slab
from tests.benchmarks.table import Row, best, seconds, verdict
from tests.benchmarks.tamaas_peer import tamaas_solve

DENSE, FINE, FINEST = 1025, 16_385, 100_001
MOST_SECONDS, MOST_TIMES, MOST_BYTES = 0.1, 2.0, 1e8
EFFECTS = {"without coupling": Effects(coupling=False), "without friction": Effects(friction=False)}


def rows() -> list[Row]:
    """Time of contacts of 1025 to 100 001 nodes, and what the largest takes of memory and is off."""
    return [
        *(_beside_the_matrix(name) for name in EFFECTS),
        *(_beside_tamaas(name) for name in EFFECTS),
        _rough(),
        _time_of_the_finest(),
        _memory(),
        _error(),
    ]


def _case(n_x: int, effects: str = "without coupling") -> Case:
    return Case(slab=Slab(n_x=n_x, scheme="half_plane"), effects=EFFECTS[effects])


def _beside_the_matrix(effects: str) -> Row:
    case = _case(DENSE, effects)
    dense, convolved = surface_compliance(case.slab), normal_compliance(case.slab)
    ours, peer = best(lambda: initial_contact(case, convolved)), best(lambda: initial_contact(case, dense))
    what = f"contact on a half-plane {effects}, n_x = {DENSE}"
    return Row(what, seconds(ours), f"{seconds(peer)} (from its matrix, at hand)", f"{ours / peer:.2f}", "")


def _beside_tamaas(effects: str) -> Row:
    case = _case(FINE, effects)
    ours = best(lambda: contact_state(case))
    solve = tamaas_solve(case)
    peer = best(solve) if solve else math.nan
    met = ours <= MOST_SECONDS and not ours > MOST_TIMES * peer
    return Row(
        f"contact on a half-plane {effects}, n_x = {FINE}",
        seconds(ours),
        f"{seconds(peer)} (tamaas, Polonsky-Keer, periodic)" if solve else "tamaas: not installed",
        f"{ours / peer:.3f}" if solve else "",
        verdict(f"≤ {MOST_SECONDS} s, ≤ {MOST_TIMES:g} × tamaas", met),
    )


def _rough() -> Row:
    heights = 1e-5 * np.random.default_rng(3).standard_normal(2000)
    points = tuple(zip(np.linspace(-0.6, 0.6, 2000).tolist(), heights.tolist(), strict=True))
    case = replace(_case(FINE), heterogeneity=Heterogeneity(roughness=points))
    contact = contact_state(case).contact
    spots = int((contact[1:] & ~contact[:-1]).sum() + contact[0])
    time = seconds(best(lambda: contact_state(case)))
    return Row(f"the same without coupling, rough: {contact.sum()} nodes in {spots} spots", time, "", "", "")


def _time_of_the_finest() -> Row:
    case = _case(FINEST)
    return Row(f"the same without coupling, n_x = {FINEST}", seconds(best(lambda: contact_state(case))), "", "", "")


def _memory() -> Row:
    tracemalloc.start()
    contact_state(_case(FINEST))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    matrix = 32.0 * FINEST**2
    what = f"memory of its arrays, n_x = {FINEST}"
    return Row(
        what, f"{peak / 1e6:.3g} MB", f"{matrix / 1e9:.3g} GB (the matrix)", "", verdict("megabytes", peak < MOST_BYTES)
    )


def _error() -> Row:
    case = _case(FINEST)
    state = contact_state(case)
    error = _from_hertz(case, state)
    return Row(
        f"largest pressure, n_x = {FINEST}: how far from Hertz", f"{error:.1e}", "second order: 1e-8 at most", "", ""
    )


def _from_hertz(case: Case, state: ContactState) -> float:
    theory = hertz(case.normal_load, case.radius, case.slab.poisson)
    return abs(float(state.pressure.max()) / theory.peak_pressure - 1.0)
