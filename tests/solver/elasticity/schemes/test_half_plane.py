"""The half-plane in closed form: reciprocal, the same everywhere, and the integral of Flamant's line forces.

It has no rows of nodes to be halved: any odd n_x does, and a convolution gives the displacements that its matrix gives.
"""

import numpy as np
import pytest
from scipy.integrate import quad

from nanoslip.solver.case import Case
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.slab import FEWEST_NODES, MOST_NODES, Slab
from nanoslip.solver.sliding.slide import slide_to_state
from tests.physics import assert_contact_laws


def flamant(x: float, z: float, poisson: float) -> np.ndarray:
    """[[u, w] under f_x = 1, [u, w] under f_z = 1]: a line force at the origin of z ≤ 0, but for a rigid motion.

    From Kolosov's potentials φ = -F/2π ln ζ, ψ = F̄/2π ln ζ, 2(u + iw) = κφ - ζ φ'̄ - ψ̄, not from the polar form that
    the scheme quotes.
    """
    zeta = x + 1j * z
    fields = []
    for force in (1.0, 1.0j):
        potential, slope = -force / (2 * np.pi) * np.log(zeta), -force / (2 * np.pi * zeta)
        other = np.conj(force) / (2 * np.pi) * np.log(zeta)
        moved = ((3 - 4 * poisson) * potential - zeta * np.conj(slope) - np.conj(other)) / 2
        fields.append([moved.real, moved.imag])
    return np.array(fields)


def relative(distance: float, depth: float, poisson: float) -> np.ndarray:
    """Displacements at a distance from the force relative to the depth below it, the surface not tilted on the whole."""
    below = flamant(0.0, -depth, poisson)
    right, left = (flamant(x, -1e-300, poisson) - below for x in (abs(distance), -abs(distance)))
    even, odd = (right + left) / 2, (right - left) / 2
    return np.where(np.eye(2, dtype=bool), even, np.sign(distance) * odd)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
@pytest.mark.parametrize("depth", [0.8, 3.0])
def test_entries_are_flamants_integral_over_a_hat(poisson: float, depth: float) -> None:
    slab = Slab(n_x=9, aspect_ratio=depth, poisson=poisson, scheme="half_plane")
    n, h = slab.n_x, slab.spacing
    matrix = surface_compliance(slab).matrix
    for i, j in ((4, 4), (4, 3), (0, 8), (7, 2), (1, 0)):
        for row in range(2):
            for column in range(2):
                distance = (i - j) * h

                def along(s: float, distance: float = distance, row: int = row, column: int = column) -> float:
                    return float((1 - abs(s) / h) / h * relative(distance - s, depth, poisson)[column, row])

                expected = sum(quad(along, a, b, epsabs=1e-12)[0] for a, b in ((-h, 0.0), (0.0, h)))
                # The quadrature's own error next to the logarithm.
                assert matrix[row * n + i, column * n + j] == pytest.approx(expected, abs=1e-9)


def test_far_entries_are_those_of_a_force_at_a_point_but_for_what_a_hat_adds() -> None:
    """The mean of ln(k + s) under a hat, whose s² and s⁴ have the means 1/6 and 1/15, is below ln k - 1/(12k²) by 1/(60k⁴) and
    more, and less than 1/(50k⁴) (k ≥ 2).

    To some roundings of a logarithm, also where k² ln k has lost them all.
    """
    slab = Slab(n_x=1_000_001, poisson=0.0, scheme="half_plane")
    k = np.arange(2.0, slab.n_x)
    mean = -np.pi * (surface_compliance(slab).convolution.along_z[2:] + 1 / (2 * np.pi)) - np.log(slab.spacing)
    below = np.log(k) - 1 / (12 * k**2) - mean
    assert (below <= 1 / (50 * k**4) + 1e-14).all()
    assert (below >= 1 / (60 * k**4) - 1e-14).all()


@pytest.mark.parametrize("poisson", [0.0, 1 / 3, 0.4999])
def test_reciprocal_definite_and_the_same_everywhere(poisson: float) -> None:
    slab = Slab(n_x=65, poisson=poisson, scheme="half_plane")
    compliance = surface_compliance(slab)
    np.testing.assert_array_equal(compliance.matrix, compliance.matrix.T)
    assert np.linalg.eigvalsh(compliance.matrix)[0] > 0.0
    for block in compliance.matrix.reshape(2, 65, 2, 65).transpose(0, 2, 1, 3).reshape(4, 65, 65):
        np.testing.assert_array_equal(block[1:, 1:], block[:-1, :-1])
    np.testing.assert_array_equal(compliance.widths, slab.spacing)  # hats are whole at the ends too


@pytest.mark.parametrize("poisson", [-0.99, -0.5, 0.0, 1 / 3, 0.4999])
@pytest.mark.parametrize("n_x", [5, 17, 129])
def test_a_datum_is_refused_where_forces_would_do_negative_work(poisson: float, n_x: int) -> None:
    """The limit in closed form against eigenvalues: never accepted below them, and at most 0.12 spacings above."""

    def slab(depth: float) -> Slab:
        return Slab(n_x=n_x, aspect_ratio=depth, poisson=poisson, scheme="half_plane")

    def taken(depth: float) -> bool:
        try:
            surface_compliance(slab(depth))
        except InvalidInput:
            return False
        return True

    refused, accepted = 0.1, 2.0
    while accepted / refused > 1.0 + 1e-9:
        middle = np.sqrt(refused * accepted)
        refused, accepted = (refused, middle) if taken(middle) else (middle, accepted)
    matrix = surface_compliance(slab(accepted)).matrix
    assert np.linalg.eigvalsh(matrix)[0] > 0.0
    # Another datum adds the same to all displacements along their force.
    deeper = (1 - poisson) / np.pi * np.log(1.0 + 0.12 / (n_x - 1))
    nearer = matrix - deeper * np.kron(np.eye(2), np.ones((n_x, n_x)))
    assert np.linalg.eigvalsh(nearer)[0] < 0.0


@pytest.mark.parametrize("n_x", [FEWEST_NODES - 2, 6, 100_000, MOST_NODES + 2])
def test_other_numbers_of_nodes_are_refused_by_name(n_x: int) -> None:
    with pytest.raises(InvalidInput, match=rf"n_x = {n_x}: needs an odd number from 5 to 1048577"):
        Slab(n_x=n_x, scheme="half_plane")


def test_a_pin_slides_over_an_odd_number_of_nodes_as_over_any() -> None:
    case = Case(slab=Slab(n_x=71, scheme="half_plane"), max_events=50)
    compliance = surface_compliance(case.slab)
    record, end = slide_to_state(case, compliance)
    assert record.outcome.ok
    assert len(record.displacement) == 50
    assert_contact_laws(end, case, compliance)


@pytest.fixture(params=[(5, 1 / 3), (33, 0.0), (101, 0.49), (64 + 1, -0.5)], ids=str)
def slab(request: pytest.FixtureRequest) -> Slab:
    n_x, poisson = request.param
    return Slab(n_x=n_x, poisson=poisson, aspect_ratio=2.0, scheme="half_plane")


def test_displacements_are_those_of_the_matrix(slab: Slab) -> None:
    """Rounding of an FFT: some machine epsilons of the largest sum of displacements."""
    n, found = slab.n_x, surface_compliance(slab).convolution
    forces = np.random.default_rng(1).standard_normal(n)
    expected = slab.scheme.matrix(slab)[:, n:] @ forces
    rounding = 1e-14 * np.abs(found.along_z).max() * np.abs(forces).sum()
    np.testing.assert_allclose(found.u(forces), expected[:n], rtol=0.0, atol=rounding)
    np.testing.assert_allclose(found.w(forces), expected[n:], rtol=0.0, atol=rounding)


def test_forces_about_a_displacement_do_positive_work_on_it(slab: Slab) -> None:
    """What conjugate gradients ask of them: symmetric and positive definite on forces without a sum."""
    found, identity = surface_compliance(slab).convolution, np.eye(slab.n_x)
    matrix = np.array([found.forces_about(column) for column in identity])
    np.testing.assert_allclose(matrix, matrix.T, atol=1e-13 * np.abs(matrix).max())
    assert np.linalg.eigvalsh(matrix)[0] > 0.0


def test_on_the_whole_circle_the_forces_about_a_displacement_are_those_that_cause_it() -> None:
    """A wave that fits the circle of 2(n-1) nodes, far smaller there than its sum over all turns: to a share of its length."""
    slab = Slab(n_x=1025, scheme="half_plane")
    found, nodes = surface_compliance(slab).convolution, np.arange(slab.n_x)
    wave = np.cos(2 * np.pi * 256 * nodes / 2048) * np.sin(np.pi * nodes / 1024) ** 2
    inside = slice(256, -256)
    np.testing.assert_allclose(found.w(found.forces_about(wave))[inside], wave[inside], atol=2e-3)
