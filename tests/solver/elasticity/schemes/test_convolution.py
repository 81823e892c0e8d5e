"""A convolution says what the matrix of the same surface says: displacements under normal forces, by another way."""

import numpy as np
import pytest

from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.slab import Slab


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
