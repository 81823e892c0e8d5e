"""What is left of a front is the Schur complement, and all of its inverse that the surface sees is found; by either way."""

import numpy as np
import pytest

from nanoslip.solver.elasticity.condensation import Eliminated, definitely_eliminated, eliminated
from nanoslip.solver.outcome import SingularOperator

COUNT, FRONT, SURFACE = 5, 9, 4


def drawn(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A well-conditioned stiffness without symmetry, what a surface follows of it, and the forces that it bears."""
    numbers = np.random.default_rng(seed)
    stiffness = numbers.uniform(-1.0, 1.0, (FRONT, FRONT)) + FRONT * np.eye(FRONT)
    return stiffness, numbers.uniform(size=(SURFACE, FRONT)), numbers.uniform(size=(FRONT, SURFACE))


def hold_it_to_the_inverse(found: Eliminated, stiffness: np.ndarray, follows: np.ndarray, bears: np.ndarray) -> None:
    """With the other fields held, and with them free: what is solved later from what is left is the solution of the whole."""
    inverse = np.linalg.inv(stiffness)
    np.testing.assert_allclose(np.linalg.inv(found.stiffness), inverse[COUNT:, COUNT:], rtol=1e-12)
    later = found.follows @ np.linalg.inv(found.stiffness) @ found.bears
    np.testing.assert_allclose(found.grown[0] @ found.grown[1] + later, follows @ inverse @ bears, rtol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_the_whole_is_solved_when_the_rest_is(seed: int) -> None:
    stiffness, follows, bears = drawn(seed)
    hold_it_to_the_inverse(eliminated(stiffness, COUNT, follows, bears), stiffness, follows, bears)


@pytest.mark.parametrize("seed", range(5))
def test_half_the_work_is_enough_where_the_stiffness_is_symmetric_and_definite(seed: int) -> None:
    drawn_stiffness, follows, _ = drawn(seed)
    stiffness = drawn_stiffness @ drawn_stiffness.T
    found = definitely_eliminated(stiffness, COUNT, follows)
    hold_it_to_the_inverse(found, stiffness, follows, follows.T)
    assert found.reciprocal_condition == pytest.approx(
        eliminated(stiffness, COUNT, follows, follows.T).reciprocal_condition, rel=0.5
    )  # either is an estimate


@pytest.mark.parametrize("pivot", [0.0, 1e-17, -1.0], ids=["none", "rounding alone", "negative"])
def test_what_no_spring_holds_is_refused_by_name(pivot: float) -> None:
    stiffness = np.diag([1.0, 1.0, pivot, 1.0])
    with pytest.raises(SingularOperator, match="singular"):
        definitely_eliminated(stiffness, 3, np.ones((2, 4)))
    if pivot >= 0.0:
        with pytest.raises(SingularOperator, match="singular"):
            eliminated(stiffness, 3, np.ones((2, 4)), np.ones((4, 2)))
