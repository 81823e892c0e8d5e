"""The surface compliance of a slab (Eq. 11), displacements of its nodes per nodal force, and how sound it is."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.elasticity.schemes.endless import Convolution, convolution_of
from nanoslip.solver.outcome import Ending, Outcome
from nanoslip.solver.slab import Slab, surface_x
from nanoslip.solver.view import OneLine

Dense = NDArray[np.float64]


class Compliance(OneLine, ABC):
    """Displacements of a slab's surface per nodal force, stored as a matrix or, where all nodes are alike, as a convolution."""

    __slots__ = ()
    slab: Slab

    @abstractmethod
    def under_itself(self) -> NDArray[np.float64]:
        """w of every surface node per normal force on it, (n,), in 1/G per unit depth."""

    @abstractmethod
    def as_matrix(self) -> "SurfaceCompliance":
        """The same as a matrix, which takes 32 n² bytes. Raises InvalidInput."""

    @property
    def x(self) -> NDArray[np.float64]:
        """Positions of the surface nodes in L_x, centred on the slab's middle, shape (n,), read-only."""
        return surface_x(self.slab.n_x)

    @property
    def widths(self) -> NDArray[np.float64]:
        """Length of surface that belongs to each node, in L_x, shape (n,), read-only: nodal force = traction × width.

        It is the width of a node's control volume, which equals the integral of its hat function. The end nodes have half
        of it, except on a half-plane, whose surface continues beyond them, and on a chain, whose blocks are all alike.
        """
        return _widths(self.slab.n_x, self.slab.scheme.equal_widths)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SurfaceCompliance(Compliance):
    """Surface compliance of a slab: displacements of the surface nodes per nodal force.

    matrix: shape (2n, 2n), in 1/G per unit depth, read-only; [u; w] = matrix @ [f_x; f_z], nodes left to right,
    x to the right, z upwards (out of the slab).
    """

    matrix: Dense
    slab: Slab

    def __post_init__(self) -> None:
        shape = (2 * self.slab.n_x, 2 * self.slab.n_x)
        if self.matrix.shape != shape:
            raise ValueError(f"matrix.shape = {self.matrix.shape}: a slab of n_x = {self.slab.n_x} needs {shape}")

    @property
    def lasting(self) -> bool:
        """Whether what is computed of it may be kept with it: nobody changes a matrix that is read-only."""
        return not self.matrix.flags.writeable

    def under_itself(self) -> NDArray[np.float64]:
        return self.matrix.diagonal()[self.slab.n_x :]

    def as_matrix(self) -> "SurfaceCompliance":
        return self

    def _facts(self) -> Iterator[str]:
        yield f"{self.slab.n_x} surface nodes"
        yield f"scheme {self.slab.scheme.name}"
        yield f"u under a force at the middle {self.matrix[self.slab.n_x // 2, self.slab.n_x // 2]:.4g}"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class NormalCompliance(Compliance):
    """The compliance under normal forces alone of a surface without ends, as a convolution: n numbers, no matrix."""

    convolution: Convolution
    slab: Slab

    def under_itself(self) -> NDArray[np.float64]:
        return np.full(self.slab.n_x, self.convolution.along_z[0])

    def as_matrix(self) -> SurfaceCompliance:
        return surface_compliance(self.slab)

    def _facts(self) -> Iterator[str]:
        yield f"{self.slab.n_x} surface nodes"
        yield f"scheme {self.slab.scheme.name}"
        yield f"w under a force {self.convolution.along_z[0]:.4g}"


@lru_cache(maxsize=4)  # asked for every contact, and few campaigns have more grids at a time
def _widths(n_x: int, equal: bool) -> NDArray[np.float64]:
    widths = np.full(n_x, 1.0 / (n_x - 1))
    if not equal:
        widths[[0, -1]] /= 2
    widths.setflags(write=False)
    return widths


def uncoupled(compliance: SurfaceCompliance) -> SurfaceCompliance:
    """The same compliance with zero coupling blocks (Goodman's approximation).

    Normal forces then cause no u, and tangential forces no w.
    """
    n = compliance.slab.n_x
    matrix = np.zeros_like(compliance.matrix, subok=False)
    matrix[:n, :n], matrix[n:, n:] = compliance.matrix[:n, :n], compliance.matrix[n:, n:]
    matrix.setflags(write=False)
    return SurfaceCompliance(matrix, compliance.slab)


def surface_compliance(slab: Slab) -> SurfaceCompliance:
    """The surface compliance of `slab`, exactly symmetric where its scheme is reciprocal.

    Raises SingularOperator where a block cannot be inverted, InvalidInput where the scheme does not fit the slab.
    """
    matrix = slab.scheme.matrix(slab)
    matrix.setflags(write=False)
    return SurfaceCompliance(matrix, slab)


def normal_compliance(slab: Slab) -> NormalCompliance:
    """The compliance of a slab whose surface has no ends, under normal forces. Raises InvalidInput for others."""
    return NormalCompliance(convolution_of(slab), slab)


# Condition number, definiteness and symmetry of a compliance matrix, and advice where they make a contact fail.

ILL_CONDITIONED = 1e-9
"""Reciprocal condition number below which forces are too inexact for the contact conditions, which hold to 1e-10 of the load."""

_OPERATORS_FAULT = (
    Ending.CONTACT_NOT_CONVERGED,
    Ending.SLIP_UNBOUNDED,
    Ending.CASCADE_LIMIT,
    Ending.SINGULAR_OPERATOR,
    Ending.OVERSHOT,
    Ending.ENERGY_CREATED,
)
"""Endings that a compliance which is not positive definite can cause."""


@dataclass(frozen=True, slots=True)
class Conditioning:
    """Condition number, definiteness and symmetry of a compliance matrix.

    reciprocal_condition: estimate in the 1-norm, from 0 to 1. Relative errors of forces are about machine precision over it.
    positive_definite: whether all forces do positive work; only then is frictionless contact unique.
    asymmetry: largest |c_ij - c_ji| over the largest |c_ij|; 0 where the operator is reciprocal.
    """

    reciprocal_condition: float
    positive_definite: bool
    asymmetry: float


def conditioning(matrix: Dense) -> Conditioning:
    """Condition number, definiteness and symmetry of a compliance, shape (n, n). Costs two factorizations."""
    norm = float(np.abs(matrix).sum(axis=0).max())
    factors, _, info = scipy.linalg.lapack.dgetrf(matrix)
    reciprocal = 0.0 if info else float(scipy.linalg.lapack.dgecon(factors, norm)[0])
    _, failed = scipy.linalg.lapack.dpotrf(matrix + matrix.T)
    asymmetry = float(np.abs(matrix - matrix.T).max() / np.abs(matrix).max())
    return Conditioning(reciprocal, not failed, asymmetry)


def explained(outcome: Outcome, compliance: Compliance, contact: NDArray[np.bool_]) -> Outcome:
    """Add a cause and advice to the message of a bad outcome, where the compliance of the nodes in contact may be the cause.

    contact: mask of the surface nodes in contact, shape (n,). Other outcomes are returned unchanged, as is every one of a
    compliance without a matrix, which is a closed form: positive definite, its condition number about n.
    """
    if outcome.ending not in _OPERATORS_FAULT or not contact.any() or not isinstance(compliance, SurfaceCompliance):
        return outcome
    nodes = np.flatnonzero(np.concatenate((contact, contact)))
    found = conditioning(compliance.matrix[np.ix_(nodes, nodes)])
    operator = f"; the {compliance.slab.scheme} operator of the {int(contact.sum())} nodes in contact"
    figures = f"(asymmetry {found.asymmetry:.1e}, reciprocal condition {found.reciprocal_condition:.1e})"
    if not found.positive_definite and not compliance.slab.scheme.reciprocal:
        why = f"is not positive definite {figures}: use the scheme galerkin, or a poisson further from 0.5"
    elif not found.positive_definite:  # it is, but for rounding
        why = f"is not positive definite {figures}: use a poisson further from 0.5, or an aspect_ratio nearer 1"
    elif found.reciprocal_condition < ILL_CONDITIONED:
        why = f"is ill-conditioned {figures}: use a poisson further from 0.5, or an aspect_ratio nearer 1"
    else:
        return outcome
    return replace(outcome, message=f"{outcome.message}{operator} {why}")
