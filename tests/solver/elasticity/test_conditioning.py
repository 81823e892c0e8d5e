"""What a compliance's numbers say of it: condition, definiteness, reciprocity, and the advice that follows."""

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects
from nanoslip.solver.elasticity.compliance import SurfaceCompliance, conditioning, explained, surface_compliance
from nanoslip.solver.outcome import COMPLETED, Ending, Outcome
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.slide import slide
from tests.physics import coupled_half_plane, half_plane

SLAB = Slab(33, scheme="biquadratic")


def _with_eigenvalues(smallest: float) -> SurfaceCompliance:
    """A reciprocal operator whose smallest eigenvalue is a given share of its largest."""
    values, vectors = np.linalg.eigh(half_plane(SLAB).matrix)
    values[0] = smallest * values[-1]
    return SurfaceCompliance((vectors * values) @ vectors.T, SLAB)


def test_tiny_pivots_are_seen_in_the_reciprocal_condition() -> None:
    # The estimate is in another norm: within a factor of the size.
    assert 1e-16 < conditioning(_with_eigenvalues(1e-14).matrix).reciprocal_condition < 1e-12
    assert conditioning(half_plane(SLAB).matrix).reciprocal_condition > 1e-4


@pytest.mark.parametrize("operator", [half_plane, coupled_half_plane])
def test_reciprocal_operators_are_known_as_such(operator: object) -> None:
    found = conditioning(operator(SLAB).matrix)  # type: ignore[operator]
    assert found.asymmetry == 0.0
    assert found.positive_definite


def test_a_negative_eigenvalue_is_found() -> None:
    assert conditioning(_with_eigenvalues(1e-6).matrix).positive_definite
    assert not conditioning(_with_eigenvalues(-1e-6).matrix).positive_definite


def test_the_stencil_of_the_paper_is_not_reciprocal() -> None:
    assert conditioning(surface_compliance(SLAB).matrix).asymmetry > 1e-3


def test_only_a_bad_end_on_a_bad_operator_is_explained() -> None:
    everywhere = np.ones(33, dtype=np.bool_)
    bad = Outcome(Ending.SLIP_UNBOUNDED, "no slip")
    broken, sound = _with_eigenvalues(-0.1), half_plane(SLAB)
    assert explained(COMPLETED, broken, everywhere) is COMPLETED
    assert explained(bad, sound, everywhere) is bad
    assert explained(bad, broken, ~everywhere) is bad
    assert "ill-conditioned" in explained(bad, _with_eigenvalues(1e-12), everywhere).message
    message = explained(bad, broken, everywhere).message
    assert message.startswith("no slip; the biquadratic operator of the 33 nodes in contact is not positive definite")
    assert "galerkin" in message


@pytest.mark.parametrize("sway", [4e15, 1e17])
@pytest.mark.parametrize("effects", [Effects(), Effects(pin_translation=False, coupling=False)], ids=["full", "frozen"])
def test_a_contact_singular_to_rounding_is_named(effects: Effects, sway: float) -> None:
    """A sway of so much beside a local compliance of 1: hardly a digit of the latter is left, and then none; no library is to
    say so instead."""
    slab = Slab(33)
    matrix = half_plane(slab).matrix.copy()
    matrix[:33, :33] += sway
    case = Case(slab=slab, effects=effects, max_events=3)
    outcome = slide(case, SurfaceCompliance(matrix, slab)).outcome
    assert outcome.ending is Ending.SINGULAR_OPERATOR
    assert "aspect_ratio nearer 1" in outcome.message


def test_a_pillar_is_not_sent_to_the_scheme_that_it_has() -> None:
    """What rounding takes from `galerkin` no scheme brings back."""
    slab = Slab(33, 1e4)
    broken = SurfaceCompliance(-np.eye(66), slab)
    message = explained(Outcome(Ending.SLIP_UNBOUNDED, "no slip"), broken, np.ones(33, dtype=np.bool_)).message
    assert "not positive definite" in message
    assert "use the scheme" not in message
    assert "aspect_ratio nearer 1" in message
