"""A contact set's forces come out the same by a border around another set's factors as by its own system, solved densely."""

import numpy as np
import pytest

from nanoslip.solver.contact import normal as of_sets
from nanoslip.solver.contact.normal import ContactSystem
from nanoslip.solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from nanoslip.solver.outcome import SingularOperator, TooFarApart
from nanoslip.solver.slab import Slab

N, LOAD = 33, 1e-3
RANDOM = np.random.default_rng(3)
HEIGHTS = 1e-3 * RANDOM.standard_normal(N)
BASE = np.abs(np.arange(N) - 16) <= 8
SETS = {
    "the same": BASE,
    "fewer": BASE & (np.arange(N) % 5 != 0),
    "more": np.abs(np.arange(N) - 16) <= 10,
    "some gone, some come": np.abs(np.arange(N) - 13) <= 8,
    "all others": ~BASE,
}


def dense_forces(
    compliance: SurfaceCompliance, contact: np.ndarray, slope: np.ndarray | None, held: bool
) -> tuple[np.ndarray, float]:
    """[A 1; 1ᵀ 0] [f; approach] = [heights; -W] for this set alone; forces (2n,)."""
    nodes = np.flatnonzero(contact)
    moving = nodes + N
    entries = np.concatenate((nodes, moving)) if held else moving
    block = compliance.matrix[np.ix_(entries, entries)].copy()
    if slope is not None:
        block -= slope[nodes, None] * compliance.matrix[np.ix_(nodes, entries)]
    ones = (entries >= N).astype(float)
    system = np.block([[block, ones[:, None]], [ones[None], np.zeros((1, 1))]])
    right = np.concatenate((np.where(entries >= N, HEIGHTS[entries % N], 0.0), [-LOAD]))
    solved, forces = np.linalg.solve(system, right), np.zeros(2 * N)
    forces[entries] = solved[:-1]
    return forces, float(solved[-1])


@pytest.mark.parametrize("scheme", ["galerkin", "biquadratic"])
@pytest.mark.parametrize("kind", ["stuck", "free", "on slopes"])
def test_sets_one_after_the_other_have_the_forces_of_their_own_systems(scheme: str, kind: str) -> None:
    compliance = surface_compliance(Slab(N, scheme=scheme))
    slope, held = (0.1 * RANDOM.standard_normal(N) if kind == "on slopes" else None), kind == "stuck"
    system = ContactSystem(compliance, BASE, slope, held)
    for contact in (*SETS.values(), *SETS.values()):
        forces, approach = system.forces(contact, HEIGHTS, LOAD)
        expected, expected_approach = dense_forces(compliance, contact, slope, held)
        # 3e-13 of the largest force seen: rounding times a condition of some hundreds.
        np.testing.assert_allclose(forces, expected, atol=1e-11 * np.abs(expected).max())
        assert approach == pytest.approx(expected_approach, rel=1e-10)
        assert not forces[N:][~contact].any()
        # To the rounding of forces far above the load, as these heights ask for.
        assert forces[N:].sum() == pytest.approx(-LOAD, abs=1e-13 * np.abs(forces).sum())


@pytest.mark.parametrize("contact", SETS.values(), ids=SETS)
@pytest.mark.parametrize("scheme", ["galerkin", "biquadratic"])
def test_kept_answers_are_the_forces_of_the_set_and_what_the_compliance_makes_of_them(
    scheme: str, contact: np.ndarray
) -> None:
    compliance = surface_compliance(Slab(N, scheme=scheme))
    forces, approach, moved = (
        ContactSystem(compliance, contact, None, held=True).keep().answered(contact, HEIGHTS, LOAD)
    )
    expected, expected_approach = dense_forces(compliance, contact, None, held=True)
    np.testing.assert_allclose(forces, expected, atol=1e-11 * np.abs(expected).max())
    assert approach == pytest.approx(expected_approach, rel=1e-10)
    np.testing.assert_allclose(moved, compliance.matrix @ expected, atol=1e-11 * np.abs(moved).max())


def test_heights_far_above_what_the_load_displaces_cost_no_digits_of_it() -> None:
    """Only differences of heights matter: a millionth of the load's own scale is asked for, and the sum is the load."""
    system = ContactSystem(surface_compliance(Slab(N)), BASE, None, held=True)
    tiny = 1e-12
    forces, approach = system.forces(BASE, np.full(N, 0.3), tiny)
    assert forces[N:].sum() == pytest.approx(-tiny, rel=1e-12)
    assert approach == pytest.approx(0.3, rel=1e-10)


def test_a_set_is_near_while_a_border_is_cheaper_than_new_factors(monkeypatch: pytest.MonkeyPatch) -> None:
    system = ContactSystem(surface_compliance(Slab(N)), BASE, None, held=False)
    one_less = BASE & (np.arange(N) != 16)
    assert system.is_of(BASE)
    assert system.is_near(BASE)
    assert not system.is_of(one_less)
    assert not system.is_near(one_less)  # so few nodes are factorized anew
    monkeypatch.setattr(of_sets, "FEW", 4)
    assert system.is_near(one_less)
    assert not system.is_near(~BASE)


def test_a_singular_compliance_and_heights_that_are_no_numbers_are_named() -> None:
    slab = Slab(N)
    with pytest.raises(SingularOperator, match="17 nodes"):
        ContactSystem(SurfaceCompliance(np.zeros((2 * N, 2 * N)), slab), BASE, None, held=False)
    system = ContactSystem(surface_compliance(slab), BASE, None, held=False)
    with pytest.raises(TooFarApart, match="no numbers"):
        system.forces(BASE, np.full(N, np.nan), LOAD)
