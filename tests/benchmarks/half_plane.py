"""Contact without shear on a half-plane, which needs no matrix, beside Tamaas and Hertz."""

from dataclasses import replace

import numpy as np

from nanoslip.solver.case import Case, Effects, Heterogeneity
from nanoslip.solver.contact.closed_forms import hertz
from nanoslip.solver.simulate import contact_state
from nanoslip.solver.slab import Slab
from tests.benchmarks.table import Row, arrays_of, best, seconds, verdict
from tests.benchmarks.tamaas_peer import beside_tamaas

FINE, FINEST = 16_385, 100_001
MOST_SECONDS, MOST_TIMES, MOST_BYTES = 0.1, 2.0, 1e8
EFFECTS = {"without coupling": Effects(coupling=False), "without friction": Effects(friction=False)}


def rows() -> list[Row]:
    """Time of contacts of 16 385 and 100 001 nodes, and what the largest takes of memory and is off."""
    return [*(_beside_tamaas(name) for name in EFFECTS), _rough(), *_finest()]


def _case(n_x: int, effects: str = "without coupling") -> Case:
    return Case(slab=Slab(n_x=n_x, scheme="half_plane"), effects=EFFECTS[effects])


def _beside_tamaas(effects: str) -> Row:
    case, what = _case(FINE, effects), f"contact on a half-plane {effects}, n_x = {FINE}"
    return beside_tamaas(what, best(lambda: contact_state(case)), case, MOST_TIMES, MOST_SECONDS)


def _rough() -> Row:
    heights = 1e-5 * np.random.default_rng(3).standard_normal(2000)
    points = tuple(zip(np.linspace(-0.6, 0.6, 2000).tolist(), heights.tolist(), strict=True))
    case = replace(_case(FINE), heterogeneity=Heterogeneity(roughness=points))
    contact = contact_state(case).contact
    spots = int((contact[1:] & ~contact[:-1]).sum() + contact[0])
    what = f"the same without coupling, rough: {contact.sum()} nodes in {spots} spots"
    return Row(what, seconds(best(lambda: contact_state(case))))


def _finest() -> list[Row]:
    case, matrix = _case(FINEST), 32.0 * FINEST**2
    time, peak = seconds(best(lambda: contact_state(case))), arrays_of(lambda: contact_state(case))
    theory = hertz(case.normal_load, case.radius, case.slab.poisson)
    error = abs(float(contact_state(case).pressure.max()) / theory.peak_pressure - 1.0)
    few, matrix_takes = verdict("megabytes", peak < MOST_BYTES), f"{matrix / 1e9:.3g} GB (the matrix)"
    return [
        Row(f"the same without coupling, n_x = {FINEST}", time),
        Row(f"memory of its arrays, n_x = {FINEST}", f"{peak / 1e6:.3g} MB", matrix_takes, target=few),
        Row(f"largest pressure, n_x = {FINEST}: difference from Hertz", f"{error:.1e}", "second order: 1e-8 at most"),
    ]
