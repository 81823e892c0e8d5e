"""Waves of traction on the slab between walls without friction, which are a wave's planes of symmetry: a layer, exactly.

Compared is the work of one wave of traction on the displacements of another: tangential, normal, and each on the other.
"""

import numpy as np
import pytest
from numpy.typing import NDArray

from nanoslip.solver.elasticity.grid_scheme import NodalFields, blank, solve_mixed, stiffness
from nanoslip.solver.elasticity.schemes import Galerkin
from nanoslip.solver.slab import Slab, Support
from tests.verification.layer import wave_compliance
from tests.verification.seen import listed, observed_order, seen

SOURCE = "Fourier's solution of a layer, Papkovich-Neuber"
ENTRIES = {"tangential": (0, 0), "coupling": (0, 1), "normal": (1, 1)}


def worked(slab: Slab, waves: int) -> NDArray[np.float64]:
    """Twice the mean work of unit waves: in the layer, [U; V] per [τ; σ]. Nodal forces are the integrals of hats."""
    matrices = stiffness(slab)
    n, x, h = slab.n_x, np.linspace(0.0, 1.0, slab.n_x), slab.spacing
    k = 2 * np.pi * waves
    width = np.full(n, h)
    width[[0, -1]] /= 2
    # ∫ hat·cos kx, at the walls half of it; hats on steps, the stencil's, differ from that by h²k²/24.
    forces = np.array([np.sin(k * x), np.cos(k * x)]) * width * np.sinc(waves * h) ** 2
    walls = np.isin(matrices.grid.coordinates()[:, 0], (0.0, 1.0))
    work = np.empty((2, 2))
    for pulled in range(2):
        given = blank(matrices)
        f_x, f_z = given.f_x.copy(), given.f_z.copy()
        (f_x, f_z)[pulled][:n] += forces[pulled]
        f_x[walls] = np.nan
        moved = solve_mixed(matrices, NodalFields(np.where(walls, 0.0, given.u), given.w, f_x, f_z))
        work[:, pulled] = 2 * forces[0] @ moved.u[:n], 2 * forces[1] @ moved.w[:n]
    return work


@pytest.mark.parametrize("poisson", [0.0, 1 / 3])
def test_short_waves_see_a_half_plane(poisson: float) -> None:
    """The layer's own limit: (1 - ν)/k along the traction and (1 - 2ν)/(2k) across it."""
    k = 50.0
    np.testing.assert_allclose(
        k * wave_compliance(k, 1.0, poisson, "bonded"),
        [[1 - poisson, 0.5 - poisson], [0.5 - poisson, 1 - poisson]],
        rtol=1e-12,
    )


def test_long_waves_see_a_column() -> None:
    """Under kH → 0 the layer is pressed without lateral strain: H/(λ + 2) per unit traction; and sheared: H."""
    poisson, depth = 0.3, 0.01
    found = wave_compliance(0.1, depth, poisson, "bonded")
    np.testing.assert_allclose(np.diag(found), [depth, depth * (1 - 2 * poisson) / (2 - 2 * poisson)], rtol=1e-5)


@pytest.mark.parametrize("support", ["bonded", "frictionless"])
@pytest.mark.parametrize("waves", [1, 4])
@pytest.mark.parametrize("aspect_ratio", [0.25, 1.0])
def test_the_converging_scheme_converges(aspect_ratio: float, waves: int, support: Support) -> None:
    """With spacing and grading both halved the works come closer at order 3 or more: a strip one spacing thick under a linear
    surface, whose strains are off by h, adds h²·h to the energy; quadratic elements below it add h⁴."""
    poisson = 1 / 3
    exact = wave_compliance(2 * np.pi * waves, aspect_ratio, poisson, support)
    grids = [(33, 2), (65, 4), (129, 8)]
    errors = np.array(
        [
            worked(Slab(n_x, aspect_ratio, poisson, support, scheme=Galerkin(rows_per_level=rows)), waves) / exact - 1
            for n_x, rows in grids
        ]
    )
    h = [1 / (n_x - 1) for n_x, _ in grids]
    lines = []
    for name, (i, j) in ENTRIES.items():
        order = observed_order(h, errors[:, i, j])
        lines.append(f"{name} off by {listed(errors[:, i, j])}, order {order:.1f}")
    line = seen(
        f"{waves} waves, slab of height {aspect_ratio}, {support}", SOURCE,
        f"(n_x, rows per level) = {grids}: " + "; ".join(lines),
    )  # fmt: skip
    assert np.abs(errors[-1]).max() <= (0.005 if waves == 4 else 0.001), line
    for i, j in ENTRIES.values():
        # The last of them may be tiny by a change of sign; the whole range tells the order.
        assert observed_order(h, errors[:, i, j]) > 2.5, line
    np.testing.assert_allclose(errors[:, 0, 1], errors[:, 1, 0], rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("poisson", [1 / 3, 0.49])
def test_the_grading_alone_converges(poisson: float) -> None:
    """A surface fine enough not to matter: with rows per level doubled and the coarsest spacing halved, order 4 of the energy
    of quadratic elements; near ν = 0.5 no worse, so that there is no locking."""
    gradings = [(1, 9), (2, 17), (4, 33)]
    exact = wave_compliance(2 * np.pi, 1.0, poisson, "bonded")
    errors = np.array([
        worked(Slab(257, 1.0, poisson, scheme=Galerkin(rows_per_level=rows, coarsest_row=coarsest)), 1) / exact - 1
        for rows, coarsest in gradings
    ])  # fmt: skip
    h = [1 / (coarsest - 1) for _, coarsest in gradings]
    orders = {name: observed_order(h, errors[:, i, i]) for name, i in (("tangential", 0), ("normal", 1))}
    line = seen(
        f"1 wave, slab of height 1, bonded, ν = {poisson:.2f}, n_x = 257", SOURCE,
        f"(rows per level, coarsest row) = {gradings}: "
        + "; ".join(
            f"{name} off by {listed(errors[:, i, i])}, order {orders[name]:.1f}" for i, name in enumerate(orders)
        ),
    )  # fmt: skip
    assert min(orders.values()) > 3.0, line
    assert np.abs(errors[1][[0, 1], [0, 1]]).max() <= 0.002, line


def test_what_the_default_grading_leaves_and_the_paper_stencil() -> None:
    """Printed for the record: with the rows per level fixed, refining n_x leaves the grading's error; the stencil's errors
    stay whatever is refined, and grow as the slab gets flatter."""
    poisson = 1 / 3
    for aspect_ratio in (0.25, 1.0):
        exact = wave_compliance(2 * np.pi, aspect_ratio, poisson, "bonded")
        galerkin, stencil = (
            np.abs(worked(Slab(129, aspect_ratio, poisson, scheme=scheme), 1) / exact - 1)
            for scheme in ("galerkin", "biquadratic")
        )
        line = seen(
            f"1 wave, slab of height {aspect_ratio}, n_x = 129", SOURCE,
            "; ".join(
                f"{name} off by {listed([galerkin[at]])} (galerkin), {listed([stencil[at]])} (biquadratic)"
                for name, at in ENTRIES.items()
            ),
        )  # fmt: skip
        assert galerkin.max() <= 0.004, line
        assert stencil.max() > 0.03, line
