"""The slab as an elastic body: waves of traction against a layer's exact solution, loads and a punch against an independent slab.

Between walls without friction, which are a wave's planes of symmetry, the slab is a layer: compared is the work of one wave of
traction on the displacements of another, tangential, normal, and each on the other. Bonded to its base the slab's corners are
singular (Williams 1952); without them, the base frictionless, their error is gone. About a force Flamant's logarithm holds.
"""

import numpy as np
import pytest

from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.elasticity.grid_scheme import NodalFields, blank, solve_mixed, stiffness
from nanoslip.solver.elasticity.schemes import Galerkin
from nanoslip.solver.slab import Slab
from nanoslip.study.accuracy.operators import nodal_forces
from tests.synthetic import grid_of
from tests.verification.finite_slab import elliptic_energies
from tests.verification.layer import wave_compliance
from tests.verification.seen import converges, listed, seen

FOURIER = "Fourier's solution of a layer, Papkovich-Neuber"
ENTRIES = {"tangential": (0, 0), "coupling": (0, 1), "normal": (1, 1)}


def worked(slab, waves):
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


@pytest.mark.parametrize("support", ["bonded", "frictionless"])
@pytest.mark.parametrize("waves", [1, 4])
@pytest.mark.parametrize("aspect_ratio", [0.25, 1.0])
def test_the_converging_scheme_converges(aspect_ratio, waves, support):
    """With spacing and grading both halved the works come closer at order 3 or more: a strip one spacing thick under a linear
    surface, whose strains are off by h, adds h²·h to the energy; quadratic elements below it add h⁴."""
    exact = wave_compliance(2 * np.pi * waves, aspect_ratio, 1 / 3, support)
    grids = {33: 2, 65: 4, 129: 8}
    schemes = (Slab(n, aspect_ratio, 1 / 3, support, scheme=Galerkin(rows_per_level=rows)) for n, rows in grids.items())
    errors = np.array([worked(slab, waves) / exact - 1 for slab in schemes])
    law = f"{waves} waves, slab of height {aspect_ratio}, {support}, rows per level {(*grids.values(),)}"
    named = {name: errors[:, i, j] for name, (i, j) in ENTRIES.items()}
    line, orders = converges(law, FOURIER, tuple(grids), named)
    assert np.abs(errors[-1]).max() <= (0.005 if waves == 4 else 0.001), line
    # The last of them may be tiny by a change of sign; the whole range tells the order.
    assert min(orders.values()) > 2.5, line
    np.testing.assert_allclose(errors[:, 0, 1], errors[:, 1, 0], rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("poisson", [1 / 3, 0.49])
def test_the_grading_alone_converges(poisson):
    """A surface fine enough not to matter: with rows per level doubled and the coarsest spacing halved, order 4 of the energy
    of quadratic elements; near ν = 0.5 no worse, so that there is no locking."""
    gradings = {9: 1, 17: 2, 33: 4}
    exact = wave_compliance(2 * np.pi, 1.0, poisson, "bonded")
    schemes = (Galerkin(rows_per_level=rows, coarsest_row=coarsest) for coarsest, rows in gradings.items())
    errors = np.array([worked(Slab(257, 1.0, poisson, scheme=scheme), 1) / exact - 1 for scheme in schemes])
    law = f"1 wave, slab of height 1, bonded, ν = {poisson:.2f}, n_x = 257, of the coarsest row, 1, 2 and 4 rows per level"
    named = {"tangential": errors[:, 0, 0], "normal": errors[:, 1, 1]}
    line, orders = converges(law, FOURIER, tuple(gradings), named)
    assert min(orders.values()) > 3.0, line
    assert np.abs(errors[1][[0, 1], [0, 1]]).max() <= 0.002, line


FINITE = "quadratic finite elements, scikit-fem"
PAST_A_THIRD = 0.49


def off_finite(slab):
    """Errors of the energies of `elliptic_energies` on our slab."""
    compliance, n = surface_compliance(slab), slab.n_x
    force = nodal_forces(compliance.x, 0.27)
    ours = [force @ block @ force for block in (compliance.matrix[:n, :n], compliance.matrix[n:, n:])]
    return ours / elliptic_energies(0.27, slab.poisson, slab.aspect_ratio, slab.support) - 1


@pytest.mark.slow
@pytest.mark.everyday(2)
@pytest.mark.parametrize(
    ("aspect_ratio", "poisson"),
    [
        (0.25, 1 / 3),
        (0.25, 0.0),
        (0.25, PAST_A_THIRD),
        (1.0, 0.0),
        (1.0, 1 / 3),
        (4.0, PAST_A_THIRD),
        (1.0, PAST_A_THIRD),
    ],
)
def test_the_default_grid_is_right_to_a_thousandth(aspect_ratio, poisson):
    """At ν = 0.49 and height 1 the corner leaves 0.13 %, although the bottom row is as fine as the surface: hence 0.0015."""
    slab = Slab(129, aspect_ratio, poisson)
    off, nodes = off_finite(slab), grid_of(slab).nodes / slab.n_x
    figures = f"tangential off by {listed(off[:1])}, normal {listed(off[1:])}; {nodes:.1f} nodes per surface node"
    line = seen(f"elliptic loads, a = 0.27 L_x, height {aspect_ratio}, ν = {poisson:.2f}, n_x = 129", FINITE, figures)
    assert np.abs(off).max() <= (0.0015 if poisson == PAST_A_THIRD and aspect_ratio == 1.0 else 0.001), line
    assert nodes <= 11, line


@pytest.mark.everyday(1)
@pytest.mark.parametrize("poisson", [PAST_A_THIRD, 0.4999])
def test_without_a_singular_corner_poisson_does_not_matter(poisson):
    """No locking: 2e-4 and less for all ν, ten times less than with the corner at 0.49."""
    off = off_finite(Slab(129, 1.0, poisson, "frictionless"))[1]
    law = f"elliptic pressure, frictionless base, ν = {poisson:.4f}, n_x = 129"
    line = seen(law, FINITE, f"normal off by {listed([off])}")
    assert abs(off) <= 3e-4, line


FLAMANT = "Flamant 1892; Johnson, Contact Mechanics, §2.2 and 2.3"
NEAR = 8  # nodes from the force: its hat is felt as a point there, to 0.14 % of what is compared


@pytest.mark.parametrize("poisson", [0.0, 1 / 3])
@pytest.mark.parametrize(
    # Seen: 1.3 and 0.8 %, from rows that get coarser with depth; 0.14 % and rounding; for the stencil, to put it on
    # record, 4 and 37 %.
    ("scheme", "fall_error", "step_error"),
    [("galerkin", 0.015, 0.015), ("half_plane", 0.002, 1e-12), ("biquadratic", 0.05, 0.5)],
)
def test_displacements_about_a_force(scheme, fall_error, step_error, poisson):
    """Along the force -(1 - ν)/π ln|x|, from 8 to 16 nodes; across it a step of (1 - 2ν)/2. The slab adds what is smooth:
    a tilt or strain near the force, which 2 f(x) - f(2x) is free of."""
    slab = Slab(n_x=513, poisson=poisson, scheme=scheme)
    matrix, n, middle = surface_compliance(slab).matrix, slab.n_x, slab.n_x // 2
    near, far = np.array([middle + NEAR, middle - NEAR]), np.array([middle + 2 * NEAR, middle - 2 * NEAR])
    fall = (1 - poisson) / np.pi * np.log(2)
    along = [(matrix[start + near, start + middle] - matrix[start + far, start + middle]).mean() for start in (0, n)]
    falls = [float(each) / fall - 1 for each in along]

    def step(rows, column):
        jump, double = (float(np.diff(matrix[rows + pair, column])[0]) for pair in (near, far))
        return (2 * jump - double) / (0.5 - poisson)

    # A drag dents ahead (right of it) and lifts behind; a pull pushes the surface apart.
    steps = [step(n, middle) - 1, -step(0, n + middle) - 1]
    figures = f"fall along it off by {listed(falls)} (tangential, normal), step across it by {listed(steps)}"
    line = seen(f"a force on a deep slab, {scheme}, ν = {poisson:.2f}", FLAMANT, figures)
    assert max(map(abs, falls)) <= fall_error, line
    assert max(map(abs, steps)) <= step_error, line


HALF_PLANE = "Johnson, Contact Mechanics, §2.8"


def pressed(n_x, scheme, half_width=0.25):
    """x, nodal pressure per load and stiffness (load per indentation) of the punch on our slab."""
    slab = surface_compliance(Slab(n_x=n_x, scheme=scheme))
    under = np.flatnonzero(np.abs(slab.x) <= half_width)
    force = np.linalg.solve(slab.matrix[np.ix_(under + n_x, under + n_x)], np.ones(len(under)))
    return slab.x[under], force / slab.widths[under] / force.sum(), float(force.sum())


@pytest.mark.parametrize(
    # Half-width, grids, how far beyond the last node the edge lies (in spacings, seen to 0.005), largest error of the share.
    ("scheme", "half_width", "grids", "beyond", "share_error"),
    [
        ("half_plane", 0.25, (33, 65, 129, 257), 0.3849, 0.006),
        ("galerkin", 1 / 64, (257, 513), 0.22, 0.002),
        pytest.param("galerkin", 1 / 64, (257, 513, 1025), 0.22, 0.0015, marks=pytest.mark.slow),
    ],
)
def test_a_small_punch_is_on_a_half_plane(scheme, half_width, grids, beyond, share_error):
    """The load's share left of every node's right end. The surface sinks past the last node under the punch: its edge lies
    a fixed part of a spacing beyond, so a punch's half-width is known to order 1 in h only. The second moment, a²/2, shows it."""
    edges, shares = [], []
    for n_x in grids:
        x, pressure, _ = pressed(n_x, scheme, half_width)
        h = 1 / (n_x - 1)
        share = np.cumsum(pressure * h)
        edges.append((np.sqrt(2 * (pressure @ x**2) * h) - x.max()) / h)
        edge = x.max() + edges[-1] * h
        exact = 0.5 + np.arcsin(np.clip((x + h / 2) / edge, -1.0, 1.0)) / np.pi
        shares.append(float(np.abs(share - exact).max()))
    law = f"flat punch, a = L_x/{1 / half_width:.0f}, {scheme}, edge {np.round(edges, 3)} spacings beyond the last node"
    line, orders = converges(law, HALF_PLANE, grids, {"load share": shares})
    assert edges[-1] == pytest.approx(beyond, abs=0.01), line
    assert shares[-1] <= share_error, line
    assert orders["load share"] > 0.3, line
