"""A layer without ends against its own waves, solved by four equations."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from skfem import ElementQuadP

from nanoslip.solver.case import Case, Effects
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.slab import Slab, Support
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.slide import slide_to_state
from tests.physics import assert_contact_laws
from tests.verification.finite_slab import elliptic_energies
from tests.verification.layer import wave_compliance

Dense = NDArray[np.float64]


def sampled(k: float, slab: Slab) -> Dense:
    """The same for forces cos(k x_j) on nodes under hats: all waves that the nodes cannot tell apart; a half-plane's if short."""
    h, nu = slab.spacing, slab.poisson
    waves = k + 2 * np.pi * np.arange(-5000, 5001) / h
    share, size, side = np.sinc(waves * h / 2 / np.pi) ** 2 / h, np.abs(waves), np.sign(waves)
    deep = np.array([[1 - nu, 0.5 - nu], [0.5 - nu, 1 - nu]])[:, :, None] / size
    near = np.flatnonzero(size * slab.aspect_ratio < 20.0)
    for i in near:
        deep[:, :, i] = wave_compliance(float(size[i]), slab.aspect_ratio, nu, slab.support)
    deep[[0, 1], [1, 0]] *= side
    return np.asarray((deep * share).sum(axis=-1))


@pytest.mark.parametrize(
    ("n_x", "height", "poisson"),
    [(129, 0.01, -0.9), (129, 0.01, 0.5), (257, 0.02, 0.49), (65, 0.002, 0.0), (65, 0.002, 1 / 3), (65, 0.002, 0.5)],
)
def test_entries_sum_to_the_layers_response_to_every_wave(n_x: int, height: float, poisson: float) -> None:
    """To a hundredth of the millionth that is promised: what 10001 aliases leave out is 1e-8 of the whole."""
    slab = Slab(n_x, height, poisson, scheme="strip")
    found, distance = surface_compliance(slab).convolution, np.arange(1, n_x) * slab.spacing
    for k in (0.3 / height, 1.0 / height, 2.5 / height):
        expected = sampled(k, slab)
        even = (half[0] + 2 * half[1:] @ np.cos(k * distance) for half in (found.along_x, found.along_z))
        odd = 2 * found.across[1:] @ np.sin(k * distance)
        tolerance = 2e-8 * np.abs(expected).max()
        np.testing.assert_allclose([*even, odd], [expected[0, 0], expected[1, 1], expected[0, 1]], atol=tolerance)


@pytest.mark.parametrize("poisson", [-0.5, 0.0, 0.3, 0.5])
def test_a_layer_that_rests_answers_pressure_as_its_waves_do(poisson: float) -> None:
    """Across it stays moved apart, by ν/2 of the force far off: what pressure takes of its height it gains in length."""
    slab = Slab(257, 0.02, poisson, "frictionless", scheme="strip")
    found, distance = surface_compliance(slab).convolution, np.arange(1, slab.n_x) * slab.spacing
    for k in (15.0, 50.0, 125.0):
        expected = sampled(k, slab)[1, 1]
        assert found.along_z[0] + 2 * found.along_z[1:] @ np.cos(k * distance) == pytest.approx(expected, rel=2e-7)
    np.testing.assert_allclose(found.across[150:], -poisson / 4, atol=1e-9)


def test_a_tall_layer_is_a_half_plane_as_the_square_of_distance_over_height() -> None:
    """Displacements relative to the node under the force; what the base adds is smooth there."""
    for poisson in (0.0, 1 / 3, 0.5):
        deep = surface_compliance(Slab(33, 1.0, poisson, scheme="half_plane")).convolution
        differences = []
        for height in (8.0, 16.0, 32.0):
            found = surface_compliance(Slab(33, height, poisson, scheme="strip")).convolution
            alike = ((found.along_x, deep.along_x), (found.along_z, deep.along_z))
            differences.append([np.abs((one - one[0]) - (other - other[0])).max() for one, other in alike])
        orders = np.log2(np.divide(differences[:-1], differences[1:]))
        np.testing.assert_allclose(orders, 2.0, atol=0.05)


@pytest.mark.parametrize("height", [0.01, 1.0])
def test_many_nodes_take_the_memory_that_a_contact_is_planned_with(height: float) -> None:
    """40 numbers for each node; all waves at all nodes would be 300 to 1500."""
    slab = Slab(30_001, height, 0.5, scheme="strip")
    tracemalloc.start()
    try:
        surface_compliance(slab)
        assert tracemalloc.get_traced_memory()[1] < 8 * 40 * slab.n_x
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(("height", "poisson"), [(1e-3, -0.9), (1e-3, 0.5), (0.1, 1 / 3), (1.0, -0.9), (1.0, 0.5)])
def test_reciprocal_and_positive_definite_to_many_nodes(height: float, poisson: float) -> None:
    matrix = surface_compliance(Slab(1025, height, poisson, scheme="strip")).matrix
    np.testing.assert_array_equal(matrix, matrix.T)
    np.linalg.cholesky(matrix)


def elliptic(half_width: float, slab: Slab) -> Dense:
    """Twice the energies of unit elliptic loads along x and along z, (2,), to second order in the spacing and without it."""

    def energies(slab: Slab) -> Dense:
        theta = (np.arange(40_000) + 0.5) / 40_000 * np.pi
        place, share = half_width * np.cos(theta), 2.0 * np.sin(theta) ** 2 / 40_000
        near, along = np.divmod((place + 0.5) / slab.spacing, 1.0)
        force = np.bincount(near.astype(int), share * (1.0 - along), slab.n_x)
        force += np.bincount(near.astype(int) + 1, share * along, slab.n_x)
        compliance, none = surface_compliance(slab), np.zeros(slab.n_x)
        moved = (compliance.displacements(np.array(forces)) for forces in ((force, none), (none, force)))
        return np.array([float(force @ uw[axis]) for axis, uw in enumerate(moved)])

    finer = energies(replace(slab, n_x=2 * slab.n_x - 1))
    return np.asarray(finer + (finer - energies(slab)) / 3.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("support", "poisson", "height", "within"), [("bonded", 0.49, 1 / 16, 5e-5), ("frictionless", 0.49, 1 / 8, 5e-6)]
)
def test_energies_of_loads_are_those_of_finite_elements_of_fourth_degree(
    support: Support, poisson: float, height: float, within: float
) -> None:
    """scikit-fem, p = 4, on slabs 8 to 20 times as wide as high: 8 times as wide, a bonded one's ends still take 0.4 %."""
    half_width = height / 3.0
    expected = elliptic_energies(half_width, poisson, height, support, height / 20.0, 3.0, ElementQuadP(4))
    found, along = elliptic(half_width, Slab(513, height, poisson, support, scheme="strip")), support == "frictionless"
    np.testing.assert_allclose(found[along:], expected[along:], rtol=within)


@pytest.mark.parametrize("support", ["bonded", "frictionless"])
def test_contact_without_a_matrix_is_that_of_the_matrix(support: Support) -> None:
    slab = Slab(129, 0.3, 0.5, support, scheme="strip")
    case = Case(slab=slab, effects=Effects(friction=False))
    endless = surface_compliance(slab)
    one, other = initial_contact(case, endless), initial_contact(case, SurfaceCompliance(endless.matrix, slab))
    assert one.outcome.ok
    np.testing.assert_array_equal(one.contact, other.contact)
    np.testing.assert_allclose(one.pressure, other.pressure, atol=1e-8 * other.pressure.max())
    np.testing.assert_allclose(one.u, other.u, atol=1e-9 * case.normal_load)


def test_an_incompressible_layer_slides_as_the_half_plane_does() -> None:
    """Plateaus over six spacings, of a layer 4 times as high as the contact's slab is wide: 1 % asked for, 0.2 % seen."""
    plateaus = []
    for scheme, height in (("strip", 4.0), ("half_plane", 1.0)):
        slab = Slab(129, height, 0.5, scheme=scheme)
        case = Case(slab=slab, normal_load=5e-4, max_events=None, max_spacings=6.0)
        compliance = surface_compliance(slab)
        record, end = slide_to_state(case, compliance)
        assert_contact_laws(end, case, compliance)
        plateaus.append(plateau_of(record).mean)
    assert plateaus[0] == pytest.approx(plateaus[1], rel=0.01)


def test_what_no_layer_can_do_is_refused_by_name() -> None:
    with pytest.raises(InvalidInput, match=r"support = 'right_side'.* bonded or frictionless"):
        Slab(support="right_side", scheme="strip")
    with pytest.raises(InvalidInput, match="friction = false"):
        Case(slab=Slab(support="frictionless", scheme="strip"))
