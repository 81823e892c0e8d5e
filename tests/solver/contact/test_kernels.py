"""The search for the worst offender, bit for bit: the largest shear ratio, and of mirror twins the one further right; and
numbers that are none, which no comparison sees."""

import numpy as np
import pytest
from numpy.typing import NDArray

from solver.case import Case
from solver.contact import kernels
from solver.contact.kernels import _look
from solver.contact.state import ENDINGS
from solver.contact.tableau import Core, core_of, steadied
from solver.elasticity.compliance import surface_compliance
from solver.outcome import Ending
from solver.slab import Slab

NODES = 45
TOLERANCE = 1e-15


def look(shear: NDArray[np.float64], pressure: NDArray[np.float64], limits: NDArray[np.float64]) -> tuple[int, float]:
    worst, tension = _look(shear, -pressure, limits, np.isfinite(limits), TOLERANCE)
    return int(worst), float(tension)


@pytest.mark.parametrize("seed", range(20))
def test_the_worst_offender_is_the_node_with_the_largest_ratio(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shear, pressure, limits = rng.normal(size=NODES), rng.uniform(0.1, 1.0, NODES), rng.uniform(0.1, 1.0, NODES)
    limits[rng.random(NODES) < 0.3] = np.nan  # free or stuck for ever
    ratio = np.nan_to_num(np.abs(shear) / (limits * pressure))
    assert look(shear, pressure, limits) == (int(np.argmax(ratio)), 0.0)
    assert look(shear * 0.99 / ratio.max(), pressure, limits) == (-1, 0.0)
    pressure[np.flatnonzero(np.isfinite(limits))[3]] = -2.0
    assert look(shear, pressure, limits)[1] == 2.0


@pytest.mark.parametrize("seed", range(20))
def test_rounding_does_not_decide_between_mirror_twins(seed: int) -> None:
    # Ratios over all magnitudes, so that some lie on the edge of a cut; a few ulps more or less on the left twin.
    rng = np.random.default_rng(seed)
    for ratio in (*(1.0 + 10.0 ** rng.uniform(-6, 2, 200)), *(1.0 + rng.integers(1, 2**20, 200) * 2.0**-37)):
        shear = np.full(NODES, 0.5)
        left, right = sorted(rng.choice(NODES, 2, replace=False))
        shear[right] = ratio
        shear[left] = -ratio * (1.0 + rng.integers(-4, 5) * np.finfo(float).eps)
        assert look(shear, np.ones(NODES), np.ones(NODES))[0] == right


def one_node() -> Core:
    slab = Slab(n_x=9)
    contact = np.arange(9) == 4
    core = core_of(Case(slab=slab), surface_compliance(slab), contact, np.zeros(9), np.zeros(9), whole=True)
    kernels.aim_displacement(core.state)
    return core


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("entry", [1, 4, 13, 18])
def test_what_is_no_number_is_drift_and_ends_a_cascade(entry: int, value: float) -> None:
    """In a free node's displacement, a contact node's shear and pressure, and the approach."""
    core = one_node()
    assert kernels.drift(core.state) < kernels.DRIFT_LIMIT
    core.state.response[entry] = value
    assert not kernels.drift(core.state) <= kernels.DRIFT_LIMIT
    status = kernels.resolve(core.state, core.rules, kernels.NOTHING, -1, 1.0)
    assert not ENDINGS[status].ok  # an infinite shear slips, an infinite tension is released: neither gets far
    if np.isnan(value):
        assert ENDINGS[status].ending is Ending.ROUNDING


def test_inputs_that_are_no_numbers_cannot_be_mended() -> None:
    core = one_node()
    core.state.inputs[4] = np.nan
    kernels.refresh(core.state)
    assert ENDINGS[steadied(core, kernels.DONE)].ending is Ending.ROUNDING


def test_a_contact_that_bears_nothing_is_drift() -> None:
    """The largest displacement is what drift is compared with: there is none."""
    core = one_node()
    core.state.response[:] = 0.0
    assert kernels.drift(core.state) == np.inf
