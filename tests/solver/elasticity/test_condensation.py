"""The slab's stiffness is condensed to its surface exactly, by parts and by halves of one parity."""

import numpy as np
import pytest
import scipy.sparse as sp

from nanoslip.solver.case import Case
from nanoslip.solver.elasticity import condensation as dissection
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.elasticity.condensation import (
    Eliminated,
    Fields,
    definitely_eliminated,
    eliminated,
    families,
    projected,
    surface_inverse,
)
from nanoslip.solver.elasticity.grid_scheme import stiffness
from nanoslip.solver.elasticity.schemes.biquadratic import Biquadratic
from nanoslip.solver.elasticity.schemes.galerkin import Galerkin
from nanoslip.solver.outcome import Ending, SingularOperator
from nanoslip.solver.simulate import contact_state
from nanoslip.solver.slab import Slab, Support
from tests.benchmarks.compliance import sparse_compliance
from tests.solver.elasticity.exact_stencil import exact_compliance

# The compliance of the surface has right digits whatever the slab's shape, or is refused.

HIGH, NARROW = 1e4, 0.4999
"""Cells 20 000 times as high as wide, ten thousand times as hard to press together as to shear."""


@pytest.mark.parametrize(
    ("support", "height", "poisson"),
    [("bonded", 1.0, 1 / 3), ("bonded", 1e3, NARROW), ("frictionless", 30.0, NARROW), ("right_side", HIGH, NARROW)],
)
def test_the_stencils_compliance_is_that_of_exact_arithmetic_or_refused(
    support: Support, height: float, poisson: float
) -> None:
    """High cells resist a row's motion as a whole by a small difference of large forces: at worst all of it is rounding."""
    slab = Slab(9, height, poisson, support, scheme="biquadratic")
    try:
        found = surface_compliance(slab).matrix
    except SingularOperator:
        assert height == HIGH or (height == 1e3 and poisson == NARROW)
        return
    expected = exact_compliance(slab)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-4 * np.abs(expected).max())


@pytest.mark.parametrize("poisson", [0.5 - 1e-10, 0.4999999])
def test_a_body_too_nearly_incompressible_is_refused_by_name(poisson: float) -> None:
    """What bends a column is a difference of pressures 1/(1-2ν) as large: at 0.5 - 1e-10 a tenth of its sway was rounding."""
    slab = Slab(33, 10.0, poisson, scheme=Galerkin(rows_per_level=1))
    with pytest.raises(SingularOperator, match=r"uncertain by .* use a poisson further from 0\.5"):
        surface_compliance(slab)


def test_a_contact_on_it_ends_with_the_same_advice() -> None:
    with pytest.raises(SingularOperator) as refused:
        contact_state(Case(slab=Slab(33, 10.0, 0.5 - 1e-10)))
    assert refused.value.ending is Ending.SINGULAR_OPERATOR


@pytest.mark.parametrize("scheme", ["galerkin", "biquadratic"])
@pytest.mark.parametrize("poisson", [-0.999999, 0.4999])
@pytest.mark.parametrize("height", [1e-4, 1.0, 10.0])
def test_every_other_poissons_ratio_is_computed(height: float, poisson: float, scheme: str) -> None:
    assert np.isfinite(surface_compliance(Slab(33, height, poisson, scheme=scheme)).matrix).all()


# Nested dissection gives the block of the inverse that a dense inverse has, however the fields lie and couple.


def grid_of_springs(across: int, down: int, seed: int) -> tuple[sp.csr_array, np.ndarray]:
    """A stiffness without symmetry, dominated by its diagonal, whose fields act on their nearest eight; and their places."""
    places = np.array([(column, -row) for row in range(down) for column in range(across)], dtype=float)
    near = np.abs(places[:, None] - places[None]).max(axis=2) <= 1.0
    values = np.random.default_rng(seed).uniform(-1.0, 1.0, near.shape) * near
    return sp.csr_array(values + np.diag(1.0 + np.abs(values).sum(axis=1))), places


@pytest.mark.parametrize("smallest", [1, 7, 10_000], ids=["many cuts", "some cuts", "no cut"])
@pytest.mark.parametrize(("across", "down"), [(12, 5), (4, 15), (60, 1), (1, 60)])
def test_the_surface_of_the_inverse_is_found(
    across: int, down: int, smallest: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dissection, "SMALLEST", smallest)
    matrix, places = grid_of_springs(across, down, seed=across)
    shuffled = np.random.default_rng(1).permutation(len(places))
    matrix, places = sp.csr_array(matrix[shuffled][:, shuffled]), places[shuffled]
    surface = np.flatnonzero(places[:, 1] == 0.0)
    surface = surface[np.argsort(places[surface, 0])]
    expected = np.linalg.inv(matrix.toarray())[np.ix_(surface, surface)]
    # Diagonally dominant: nothing grows beyond rounding.
    found, _ = surface_inverse(matrix, places, surface)
    np.testing.assert_allclose(found, expected, atol=1e-14)

    both_ways = sp.csr_array(matrix + matrix.T)  # as dominant, and so definite
    expected = np.linalg.inv(both_ways.toarray())[np.ix_(surface, surface)]
    found, _ = surface_inverse(both_ways, places, surface, symmetric=True)
    np.testing.assert_allclose(found, expected, atol=1e-14)
    assert np.array_equal(found, found.T)


@pytest.mark.parametrize(
    "slab",
    [
        Slab(65),
        Slab(65, 0.01),
        Slab(65, support="right_side"),
        Slab(65, support="frictionless", poisson=0.0),
        Slab(65, 3.0, scheme="biquadratic"),
        Slab(33, scheme=Biquadratic(first_spacing="doubling")),
        Slab(17, scheme=Galerkin(rows_per_level=64, coarsest_row=5)),
    ],
    ids=lambda slab: f"{slab.n_x}-{slab.aspect_ratio}-{slab.support}-{slab.scheme}",
)
def test_a_slab_has_the_compliance_that_its_whole_stiffness_has(slab: Slab) -> None:
    expected = sparse_compliance(slab)
    # 3e-13 seen, the rounding of either way.
    np.testing.assert_allclose(surface_compliance(slab).matrix, expected, atol=2e-12 * np.abs(expected).max())


# What is left of a front is the Schur complement, and all of its inverse that the surface sees is found; by either way.

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


# Even and odd fields: together all displacements that are not restrained, each family deaf to forces of the other.


def basis(fields: Fields) -> np.ndarray:
    """Displacements of every field, (2·nodes, count)."""
    found = np.zeros((len(fields.number), fields.count))
    member = fields.number >= 0
    found[member, fields.number[member]] = fields.weight[member]
    return found


@pytest.mark.parametrize(("support", "count"), [("bonded", 2), ("frictionless", 2), ("right_side", 1)])
def test_the_families_span_all_free_displacements(support: Support, count: int) -> None:
    k = stiffness(Slab(n_x=17, support=support))
    found = families(k)
    assert len(found) == count
    everything = np.hstack([basis(fields) for fields in found])
    np.testing.assert_allclose(everything.T @ everything, np.eye(everything.shape[1]), atol=1e-15)
    np.testing.assert_allclose(everything @ everything.T, np.diag((~k.fixed).astype(float)), atol=1e-15)


def test_the_stiffness_does_not_mix_them() -> None:
    k = stiffness(Slab(n_x=17, poisson=0.2))
    even, odd = (sp.csr_array(basis(fields)) for fields in families(k))
    largest = abs(k.matrix).max()
    for one, other in ((even, odd), (odd, even)):
        assert abs(one.T @ k.matrix @ other).max() <= 1e-14 * largest


def test_a_field_stands_where_its_left_node_does() -> None:
    k = stiffness(Slab(n_x=17))
    x = np.tile(k.grid.coordinates()[:, 0], 2)
    for fields in families(k):
        assert len(fields.first_entries) == fields.count
        np.testing.assert_array_equal(fields.number[fields.first_entries], np.arange(fields.count))
        assert x[fields.first_entries].max() <= 0.5


@pytest.mark.parametrize("scheme", ["galerkin", "biquadratic"])
def test_the_projected_stiffness_is_that_between_fields(scheme: str) -> None:
    k = stiffness(Slab(n_x=17, scheme=scheme))
    for fields in families(k):
        between = basis(fields)
        expected = between.T @ k.matrix.toarray() @ between
        # Sums of at most four entries, rounded.
        np.testing.assert_allclose(projected(k.matrix, fields).toarray(), expected, atol=1e-15 * np.abs(expected).max())


# Rows of nodes as unknowns: the same stiffness, for which a row's translation is one number.
