"""Condition number, definiteness and symmetry of a compliance matrix, and advice where they make a contact fail."""

from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from solver.elasticity.compliance import Compliance, SurfaceCompliance
from solver.outcome import Ending, Outcome

Dense = NDArray[np.float64]

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
