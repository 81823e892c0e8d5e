"""Forces of a given contact: those of a dense solve, at once where the contact is one piece, and with as much load as before."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from nanoslip.solver.contact import convolved as conjugate_gradients
from nanoslip.solver.contact.convolved import Pressed, pressed
from nanoslip.solver.elasticity.schemes.endless import convolution_of
from nanoslip.solver.slab import Slab

Nodes = NDArray[np.bool_]

SLAB = Slab(n_x=129, scheme="half_plane")
N = SLAB.n_x
CONVOLUTION = convolution_of(SLAB)
X = np.linspace(-0.5, 0.5, N)
PLACES = np.arange(N)
CONTACTS = {
    "one node": PLACES == 64,
    "a node at the end": PLACES == 0,
    "one piece": np.abs(X) < 0.3,
    "the whole surface": np.abs(X) < 1.0,
    "spots": np.random.default_rng(2).random(N) < 0.3,
}
HEIGHTS = X**2 / 2 + 1e-3 * np.random.default_rng(3).standard_normal(N)
LOAD = 0.02


def spread(contact: Nodes) -> NDArray[np.float64]:
    return np.where(contact, LOAD / contact.sum(), 0.0)


def of_matrix(contact: Nodes) -> tuple[NDArray[np.float64], float]:
    """Forces of the nodes in contact and the approach, from the bordered system."""
    nodes = np.flatnonzero(contact)
    block = SLAB.scheme.matrix(SLAB)[N:, N:][np.ix_(nodes, nodes)]
    border = np.ones((len(nodes), 1))
    system = np.block([[block, -border], [border.T, np.zeros((1, 1))]])
    solution = np.linalg.solve(system, np.append(-HEIGHTS[nodes], LOAD))
    return solution[:-1], float(solution[-1])


@pytest.mark.parametrize("contact", CONTACTS.values(), ids=list(CONTACTS))
def test_forces_and_approach_are_those_of_a_dense_solve(contact: Nodes) -> None:
    """To the precision asked for, times what the stiffest wave, of two spacings, makes of it: under 30."""
    found = pressed(CONVOLUTION, contact, HEIGHTS, spread(contact), 1e-14)
    force, approach = of_matrix(contact)
    np.testing.assert_allclose(found.normal_force[contact], force, rtol=0.0, atol=3e-13)
    assert not found.normal_force[~contact].any()
    assert found.normal_force.sum() == pytest.approx(LOAD, rel=1e-13)
    assert found.approach == pytest.approx(approach, abs=1e-13)
    np.testing.assert_allclose(found.v[contact], HEIGHTS[contact], rtol=0.0, atol=1e-13)


def test_the_surface_is_where_the_forces_press_it() -> None:
    found = pressed(CONVOLUTION, CONTACTS["spots"], HEIGHTS, spread(CONTACTS["spots"]), 1e-14)
    w = CONVOLUTION.w(-found.normal_force)
    np.testing.assert_allclose(found.v, found.approach + w, rtol=0.0, atol=1e-14)


def steps(monkeypatch: pytest.MonkeyPatch, n_x: int) -> int:
    """Convolutions that a contact over 0.6 of so many nodes takes, to 1e-13 of its heights."""
    convolution, x = convolution_of(Slab(n_x=n_x, scheme="half_plane")), np.linspace(-0.5, 0.5, n_x)
    contact, taken = np.abs(x) < 0.3, 0
    original = type(convolution).w

    def counted(self: Any, forces: NDArray[np.float64]) -> NDArray[np.float64]:
        nonlocal taken
        taken += 1
        return original(self, forces)

    monkeypatch.setattr(type(convolution), "w", counted)
    pressed(convolution, contact, x**2 / 2, np.where(contact, LOAD / contact.sum(), 0.0), 1e-13)
    monkeypatch.undo()
    return taken


def test_steps_do_not_grow_with_the_nodes(monkeypatch: pytest.MonkeyPatch) -> None:
    """From 129 to 16 385 nodes; plain conjugate gradients would need the root of that, 11 times as many."""
    few, many = (steps(monkeypatch, n_x) for n_x in (129, 16_385))
    assert few <= 20
    assert many <= 2 * few


def test_any_other_forces_with_the_same_load_have_more_energy() -> None:
    contact = CONTACTS["spots"]
    found = pressed(CONVOLUTION, contact, HEIGHTS, spread(contact), 1e-14)

    def energy(force: NDArray[np.float64]) -> float:
        return float(force @ CONVOLUTION.w(force) / 2 + HEIGHTS @ force)

    for seed in range(5):
        change = np.where(contact, np.random.default_rng(seed).standard_normal(N), 0.0)
        change -= np.where(contact, change.sum() / contact.sum(), 0.0)
        more = energy(found.normal_force + 1e-3 * change) - energy(found.normal_force)
        # Linear terms vanish: what is left is the energy of the change itself.
        assert more == pytest.approx(1e-6 * float(change @ CONVOLUTION.w(change)) / 2, rel=1e-6)


def test_rounding_ends_the_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """A precision that no sum reaches: the forces are as good as they get, and no step makes them worse."""
    monkeypatch.setattr(conjugate_gradients, "MOST_STEPS", 1000)
    found: Pressed = pressed(CONVOLUTION, CONTACTS["spots"], HEIGHTS, spread(CONTACTS["spots"]), 0.0)
    force, _ = of_matrix(CONTACTS["spots"])
    np.testing.assert_allclose(found.normal_force[CONTACTS["spots"]], force, rtol=0.0, atol=3e-13)
