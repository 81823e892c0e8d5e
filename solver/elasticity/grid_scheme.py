"""Schemes with a grid: their surface compliance, and mixed boundary value problems on it (§2.1.4)."""

import math
from abc import abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import scipy

from nanoslip.solver.arrays import Floats, Vector
from nanoslip.solver.elasticity.condensation import condense_surface
from nanoslip.solver.elasticity.grid import Grid, Stiffness
from nanoslip.solver.outcome import InvalidInput, SingularOperator
from nanoslip.solver.slab import SCHEMES, Scheme, Slab


class GridScheme(Scheme):
    """A scheme that discretizes the whole slab by rows of nodes."""

    tallest: ClassVar[float] = math.inf
    """Height in L_x up to which a slab has a grid from top to bottom; a taller one is condensed as a column (schemes.column)."""

    @abstractmethod
    def grid(self, slab: Slab) -> Grid:
        """The grid of nodes of a slab."""

    @abstractmethod
    def stiffness(self, slab: Slab) -> Stiffness:
        """The matrices of Eq. 11."""

    def resolves(self, slab: Slab, half_width: float) -> bool:
        # The uppermost elements resist dilatation more than their displacements can obey. So a node that gives way hands its
        # neighbours more than it held, and the next but one less than nothing: of its shear each neighbour takes 0.47, 0.56,
        # 0.63, 0.66 at ν = 1/3, 0.45, 0.48, 0.49 on any grid, on a half-plane 0.44.
        return slab.poisson <= LARGEST_POISSON

    def lateral_stiffness(self, slab: Slab, nodes: float) -> float:
        soft, height, width = 1.0 - slab.poisson, slab.aspect_ratio, nodes * slab.spacing
        # Held at its side, a slab is a rod of half its length, no higher than that, with the modulus 2/(1-ν) of plane strain.
        if slab.support == "right_side":
            return 4.0 * min(height, 0.5) / soft
        # Else it is Timoshenko's cantilever. Its sheared width grows under the contact by 45 degrees up to the slab's. The
        # contact keeps its top from turning by as much of it as it covers: free it bends by h³/3EI = 2 (1-ν) h³, with the
        # modulus of plane strain and I = 1/12; with a top that keeps its direction by a quarter of that.
        shear = 1.2 * height / min(width + height, 1.0)
        bending = 0.5 * soft * height**3 * (4.0 - 3.0 * width)
        # Held at one node alone, it gives way there, too.
        at_the_node = soft if slab.support == "frictionless" else 0.0
        return 1.0 / (shear + bending + at_the_node)

    def matrix(self, slab: Slab) -> Floats:
        return condense_surface(self.stiffness(slab))


LARGEST_POISSON = 0.38
"""Largest Poisson's ratio without volumetric locking. Beyond it plateaus exceed the plateaus of a half-plane's nodes
by 1.9, 3.6, 5, 7, 13, 25 and 30 % at ν = 0.39, 0.41, 0.42, 0.43, 0.45, 0.475 and 0.49. That holds on slabs half and
twice as high as wide, under loads of 5e-4 and 2e-3, and with both grids alike. Pressures on films are wrong by more
than 5 % from some ν beyond it on."""


def grid_scheme(slab: Slab) -> GridScheme:
    """The slab's scheme. Raises InvalidInput if that has no grid."""
    if isinstance(slab.scheme, GridScheme):
        return slab.scheme
    having = ", ".join(name for name, kind in SCHEMES.items() if issubclass(kind, GridScheme))
    raise InvalidInput("scheme", slab.scheme.name, f"one that has a grid: {having}")


def trunk(slab: Slab) -> Slab:
    """The slab whose grid is used for `slab`: the slab itself, or one as tall as its scheme allows where it is taller."""
    scheme = slab.scheme
    if isinstance(scheme, GridScheme) and slab.aspect_ratio > scheme.tallest:
        return replace(slab, aspect_ratio=scheme.tallest)
    return slab


def stiffness(slab: Slab) -> Stiffness:
    """The matrices of Eq. 11 for a slab, by its scheme. Raises InvalidInput if its scheme has no grid."""
    return grid_scheme(slab).stiffness(slab)


# Mixed boundary value problem of §2.1.4. At each node f_x or u is given, and f_z or w; Eq. 11 is solved for the others.


@dataclass(frozen=True, slots=True, eq=False)
class NodalFields:
    """Displacements and external forces of every node, each of shape (nodes,). NaN marks an unknown of the problem.

    u, w in L_x; f_x, f_z in G·L_x per unit depth.
    """

    u: Vector
    w: Vector
    f_x: Vector
    f_z: Vector


def blank(stiffness: Stiffness) -> NodalFields:
    """The problem without load: displacements of the support are zero, forces of all other nodes are zero."""
    fixed = stiffness.fixed
    return NodalFields(*np.where(fixed, 0.0, np.nan), *np.where(fixed, np.nan, 0.0))


def solve_mixed(stiffness: Stiffness, prescribed: NodalFields) -> NodalFields:
    """Solve Eq. 11 for the unknown displacements and forces, which are NaN in `prescribed`; returns all of them.

    The support is not added here: start from `blank` to keep it. Raises InvalidInput if both or neither of a pair is given at
    a node (naming node and pair), SingularOperator if the body can move as a rigid one.
    """
    nodes = stiffness.grid.nodes
    for name, displacement, force in (
        ("u and f_x", prescribed.u, prescribed.f_x),
        ("w and f_z", prescribed.w, prescribed.f_z),
    ):
        _check_pair(name, displacement, force, nodes)
    displacements = np.concatenate((prescribed.u, prescribed.w))
    forces = np.concatenate((prescribed.f_x, prescribed.f_z))
    unknown = np.isnan(displacements)
    k = stiffness.matrix
    if unknown.any():
        # Rows of the unknown displacements, K_uu d_u = f_u - K_ug d_g with d_g given.
        right = forces[unknown] - k[unknown][:, ~unknown] @ displacements[~unknown]
        displacements[unknown] = solve_sparse(k[unknown][:, unknown], right)
    # Given forces stay as given, without the rounding of the product.
    forces[~unknown] = (k @ displacements)[~unknown]
    return NodalFields(displacements[:nodes], displacements[nodes:], forces[:nodes], forces[nodes:])


def _check_pair(name: str, displacement: Vector, force: Vector, nodes: int) -> None:
    for array in (displacement, force):
        if array.shape != (nodes,):
            raise InvalidInput(f"shape of {name}", array.shape, f"one value per node, ({nodes},)")
    both = np.flatnonzero(~np.isnan(displacement) & ~np.isnan(force))
    if len(both):
        raise InvalidInput("node", int(both[0]), f"one of {name} and NaN for the other, has both: over-determined")
    neither = np.flatnonzero(np.isnan(displacement) & np.isnan(force))
    if len(neither):
        raise InvalidInput("node", int(neither[0]), f"one of {name}, has neither: under-determined")


def solve_sparse(matrix: object, right: Vector) -> Vector:
    """matrix⁻¹ right, (size,), of a sparse matrix. Raises SingularOperator if a rigid motion is free."""
    advice = "prescribe enough displacements to exclude rigid motion (two translations and a rotation)"
    try:
        factors = scipy.sparse.linalg.splu(matrix.tocsc())  # type: ignore[attr-defined]
    except RuntimeError as error:
        raise SingularOperator(f"under-determined: the mixed problem is singular: {advice}") from error
    solution = factors.solve(right)
    # A free rigid motion survives rounding as a huge answer, or as a pivot at rounding level.
    pivots = np.abs(factors.U.diagonal())
    if not np.all(np.isfinite(solution)) or pivots.min() < 1e-13 * pivots.max():
        raise SingularOperator(f"under-determined: the mixed problem is singular to rounding: {advice}")
    return np.asarray(solution)
