"""Tall slabs: what is left out of the middle is a bar, whose closed form meets the grid that goes all the way down."""

import tracemalloc
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.elasticity.grid_scheme import trunk
from nanoslip.solver.elasticity.schemes import Galerkin
from nanoslip.solver.elasticity.schemes.column import TALL, bar_forces, lengthening, resultants
from nanoslip.solver.slab import Slab, Support
from tests.benchmarks.compliance import sparse_compliance

SUPPORTS: tuple[Support, ...] = get_args(Support)
POISSON = (-0.9, 0.0, 0.4999)
every_support = pytest.mark.parametrize("support", SUPPORTS)


def off(slab: Slab) -> float:
    """How far the closed form and the whole grid are apart, tangential and normal displacements each beside their largest."""
    whole, n = sparse_compliance(slab), slab.n_x
    apart = np.abs(surface_compliance(slab).matrix - whole)
    return max(float(apart[rows].max() / np.abs(whole[rows]).max()) for rows in (slice(0, n), slice(n, None)))


@pytest.mark.everyday(4)
@pytest.mark.parametrize("height", [20.0, 50.0, 100.0])
@pytest.mark.parametrize(
    ("support", "n_x", "limit"),
    [("bonded", 33, 2.5e-4), ("frictionless", 33, 2.5e-4), ("right_side", 17, 3e-3), ("right_side", 33, 5e-4)],
)
def test_the_whole_grid_says_the_same(support: Support, n_x: int, limit: float, height: float) -> None:
    """To the grids' own errors: a parabola bends through rows up to a width thick instead of a cubic (1.7e-4 at 20 widths, 2e-5
    at 100); a held side leaves tangential displacements that are local, where the uppermost rows' thickness, which depends
    on the height, is seen (2e-3 at 17 nodes). Beyond, the whole grid loses its digits to rounding (1e-4 at 300, 1e-2 at 1000)."""
    assert off(Slab(n_x, height, support=support)) <= limit


@pytest.mark.everyday(1)
@pytest.mark.parametrize("support", ["bonded", "frictionless"])
@pytest.mark.parametrize("poisson", [0.0, 0.49])
def test_the_whole_grid_comes_closer_the_finer_its_middle(poisson: float, support: Support) -> None:
    """The error is of third order or more in the thickness of rows (11 to 12 times closer seen for 8), down to 1.5e-5.

    Without what shear does to a frictionless foot, 0.3 ν per width, 1e-4 would be left.
    """
    coarse, fine = (
        off(Slab(65, 2.5 * TALL, poisson, support, scheme=Galerkin(coarsest_row=row, bottom_row=65)))
        for row in (17, 33)
    )
    assert fine <= min(coarse / 8, 2e-5)


@pytest.mark.everyday(1)
@every_support
def test_a_column_costs_what_its_trunk_costs(support: Support) -> None:
    """Bytes in use at once; a grid from top to bottom took thirty times as many at height 300, and 90 GB at 10 000."""
    peaks = []
    for height in (TALL, 300.0, 1e4):
        tracemalloc.start()
        surface_compliance(Slab(17, height, support=support))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert max(peaks[1:]) <= 1.5 * peaks[0]


@pytest.mark.everyday(3)
@every_support
@pytest.mark.parametrize("poisson", POISSON)
def test_symmetric_and_positive_definite_at_every_height(poisson: float, support: Support) -> None:
    """At 10 000 widths the largest entries are 1e13 of the smallest eigenvalue, of which rounding leaves nothing sure."""
    for n_x in (5, 17):
        for height in (10.001, 30.0, 1e3, 1e4):
            matrix = surface_compliance(Slab(n_x, height, poisson, support)).matrix
            np.testing.assert_array_equal(matrix, matrix.T)
            assert np.linalg.eigvalsh(matrix)[0] > 0.0 or height == 1e4


@every_support
@pytest.mark.parametrize("poisson", POISSON)
def test_a_taller_slab_is_softer_under_any_load(poisson: float, support: Support) -> None:
    """What is let in stores energy whatever passes through it: no eigenvalue of what it adds is below rounding."""
    for n_x in (5, 33):
        added = [lengthening(Slab(n_x, height, poisson, support)) for height in (11.0, 20.0, 100.0)]
        for less, more in zip([np.zeros((3, 3)), *added], added, strict=False):
            assert np.linalg.eigvalsh(more - less)[0] >= -1e-12 * np.abs(more).max()


def test_a_beam_bends_and_stretches() -> None:
    """Euler and Bernoulli: L³/(3E'I), L²/(2E'I), L/(E'I) and L/E'; foot and shear are a share of 1/L beside them."""
    height, poisson = 1e4, 0.3
    modulus = 2 / (1 - poisson)
    forces, matrix = bar_forces(33), surface_compliance(Slab(33, height, poisson)).matrix
    moved = forces.T @ matrix @ forces
    bent = 12 / modulus
    expected = np.array(
        [[height / modulus, 0.0, 0.0],
         [0.0, bent * height**3 / 3, -bent * height**2 / 2],
         [0.0, -bent * height**2 / 2, bent * height]]
    )  # fmt: skip
    np.testing.assert_allclose(moved, expected, rtol=1 / height, atol=1e-9 * bent * height)


@pytest.mark.parametrize("poisson", [-0.9, 0.0, 1 / 3, 0.49])
def test_a_frictionless_foot_is_in_closed_form(poisson: float) -> None:
    """There pure bending is exact to the bottom: the moment does not turn the foot, and the middle, which is held, is ahead of
    the mean under a parabola of shear by ν/(1-ν)·12/E'·1/40 = 0.15 ν. A width more adds a beam's bending, 6/5 and twice that.

    Of the foot's turn 3e-7 is left at ν = 0.49 of the surface's end of the grid, 1e-8 of it elsewhere of rounding.
    """
    slab = Slab(33, 11.0, poisson, "frictionless")
    bent = 6 * (1 - poisson)
    added = lengthening(slab)
    assert added[2, 2] == pytest.approx(bent, rel=1e-12)
    assert added[1, 2] == pytest.approx(-bent * (11.0**2 - 10.0**2) / 2, abs=2e-6)
    assert added[1, 1] - bent * (11.0**3 - 10.0**3) / 3 == pytest.approx(1.2 + 0.3 * poisson, abs=2e-5)


def test_a_held_side_takes_shear_and_moment() -> None:
    """Deeper than a few widths nothing moves sideways: 20 widths and 10 000 differ by a bar's stretch alone."""
    apart = np.subtract(*(surface_compliance(Slab(33, height, 0.3, "right_side")).matrix for height in (1e4, 20.0)))
    np.testing.assert_array_equal(apart[:33], 0.0)
    np.testing.assert_allclose(apart[33:, 33:], (1e4 - 20.0) * 0.35, rtol=1e-12)


@every_support
def test_up_to_ten_widths_a_slab_is_its_own_trunk(support: Support) -> None:
    """And beyond it starts where that ends."""
    slab = Slab(17, TALL, support=support)
    assert trunk(slab) == slab
    assert trunk(Slab(17, 1.0, support=support)).aspect_ratio == 1.0
    np.testing.assert_allclose(surface_compliance(slab).matrix, sparse_compliance(slab), rtol=0, atol=1e-9 * 4e3)
    matrix = surface_compliance(slab).matrix
    beyond = surface_compliance(replace(slab, aspect_ratio=TALL * (1 + 1e-12))).matrix
    np.testing.assert_allclose(beyond, matrix, rtol=0, atol=1e-11 * np.abs(matrix).max())


def test_the_other_schemes_are_never_columns() -> None:
    for scheme in ("biquadratic", "half_plane"):
        slab = Slab(17, 100.0, scheme=scheme)
        assert trunk(slab) == slab


def test_a_bars_forces_have_their_resultants() -> None:
    for n_x in (5, 17, 129):
        np.testing.assert_allclose(resultants(n_x) @ bar_forces(n_x), np.eye(3), atol=1e-14)
