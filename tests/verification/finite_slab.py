"""An independent elastic slab for reference: quadratic finite elements of scikit-fem on a graded mesh."""

from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, Element, ElementQuad2, ElementVector, FacetBasis, LinearForm, MeshQuad, asm
from skfem.helpers import ddot, eye, sym_grad, trace

from nanoslip.solver.slab import Support

LARGEST = 0.03  # the largest element, in slab widths


def graded(start: float, stop: float, smallest: float, growth: float, both: bool = False) -> NDArray[np.float64]:
    """Points from start to stop, spacing `smallest` at start (and stop), growing by `growth` per interval up to LARGEST."""
    if both:
        left = graded(start, (start + stop) / 2, smallest, growth)
        return np.concatenate((left, (start + stop - left[::-1])[1:]))
    length, steps = abs(stop - start), [smallest]
    while sum(steps) < length:
        steps.append(min(steps[-1] * growth, LARGEST))
    return start + np.concatenate(([0.0], np.cumsum(steps))) / sum(steps) * (stop - start)


@cache
def elliptic_energies(
    half_width: float,
    poisson: float,
    aspect_ratio: float,
    support: Support,
    smallest: float = 1e-3,
    growth: float = 2.0,
    element: Element | None = None,
) -> NDArray[np.float64]:
    """Twice the energies of unit elliptic loads on the slab's middle, along x and along z, in 1/G per unit depth, shape (2,).

    The mesh is graded towards the load's edges and towards bottom and sides. `frictionless`: the energy along z alone.
    element: of each component, quadratic if not given.
    """
    right = np.concatenate(
        (graded(half_width, 0.0, smallest, growth)[::-1], graded(half_width, 0.5, smallest, growth, both=True)[1:])
    )
    x = np.concatenate((-right[::-1], right[1:]))
    mesh = MeshQuad.init_tensor(x, graded(-aspect_ratio, 0.0, smallest, growth, both=True))
    vector = ElementVector(element or ElementQuad2())
    basis = Basis(mesh, vector)
    top = FacetBasis(mesh, vector, facets=mesh.facets_satisfying(lambda p: np.isclose(p[1], 0.0)), intorder=40)

    @LinearForm
    def along_x(v, at):
        return 2 / (np.pi * half_width) * np.sqrt(np.maximum(1 - (at.x[0] / half_width) ** 2, 0.0)) * v[0]

    @LinearForm
    def along_z(v, at):
        return 2 / (np.pi * half_width) * np.sqrt(np.maximum(1 - (at.x[0] / half_width) ** 2, 0.0)) * v[1]

    bottom = basis.get_dofs(lambda p: np.isclose(p[1], -aspect_ratio))
    middle = basis.get_dofs(lambda p: np.isclose(p[1], -aspect_ratio) & np.isclose(p[0], 0.0)).all("u^1")
    held = bottom.all() if support == "bonded" else np.concatenate((bottom.all("u^2"), middle))
    free = np.setdiff1d(np.arange(basis.N), held)
    force = np.column_stack([asm(normal_load, top) for normal_load in (along_x, along_z)])[free]
    stiffness = asm(elasticity(poisson), basis)[free][:, free].tocsc()
    moved = splu(stiffness, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.01, options={"SymmetricMode": True}).solve(
        force
    )
    energies = np.einsum("ij,ij->j", force, moved)
    energies.setflags(write=False)
    return energies


def elasticity(poisson: float) -> BilinearForm:
    """Virtual work of the stresses in plane strain, shear modulus 1."""
    lame = 2 * poisson / (1 - 2 * poisson)

    @BilinearForm
    def work(u, v, _):
        strain = sym_grad(u)
        return ddot(lame * eye(trace(strain), 2) + 2 * strain, sym_grad(v))

    return work
