"""How well a compliance can be turned round: its condition, whether it is an elastic body's, and what to do if not."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from solver.elasticity.compliance import SurfaceCompliance
from solver.outcome import Ending, Outcome

Dense = NDArray[np.float64]

ILL_CONDITIONED = 1e-9
"""Reciprocal condition below which forces have too few digits left for the laws of contact (1e-10 of the load)."""

_OPERATORS_FAULT = (
    Ending.CONTACT_NOT_CONVERGED,
    Ending.SLIP_UNBOUNDED,
    Ending.CASCADE_LIMIT,
    Ending.SINGULAR_OPERATOR,
    Ending.OVERSHOT,
    Ending.ENERGY_CREATED,
)
"""Endings that an operator which is not positive definite can cause."""


@dataclass(frozen=True, slots=True)
class Conditioning:
    """What the numbers of a compliance say of it.

    reciprocal_condition: in the 1-norm, estimated; digits beyond its size are lost in forces. positive_definite: whether
    every set of forces does positive work; only then is contact without friction unique. asymmetry: largest
    |c_ij - c_ji| over the largest |c_ij|; 0 where the operator is reciprocal.
    """

    reciprocal_condition: float
    positive_definite: bool
    asymmetry: float


def conditioning(matrix: Dense) -> Conditioning:
    """Condition, definiteness and reciprocity of a square compliance, at the cost of two factorizations."""
    norm = float(np.abs(matrix).sum(axis=0).max())
    factors, _, info = la.lapack.dgetrf(matrix)
    reciprocal = 0.0 if info else float(la.lapack.dgecon(factors, norm)[0])
    _, failed = la.lapack.dpotrf(matrix + matrix.T)
    asymmetry = float(np.abs(matrix - matrix.T).max() / np.abs(matrix).max())
    return Conditioning(reciprocal, not failed, asymmetry)


def explained(outcome: Outcome, compliance: SurfaceCompliance, contact: NDArray[np.bool_]) -> Outcome:
    """The outcome, and where the operator of the nodes in contact (n,) may be why it is bad, that it is, and what to do."""
    if outcome.ending not in _OPERATORS_FAULT or not contact.any():
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
