"""Eliminate some fields of a stiffness: the stiffness left for the others, and what is added to the surface's compliance.

With K of these fields (c), X of these and the others, F of the surface per displacement of either: of the others' stiffness S
remains S - Xᵀ K⁻¹ X, of what the surface follows F_b - F_c K⁻¹ X, and F_c K⁻¹ F_cᵀ is added to its compliance.
"""

from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from solver.outcome import SingularOperator

Dense = NDArray[np.float64]


class Eliminated(NamedTuple):
    """What is left of a front when its first fields are eliminated."""

    stiffness: Dense
    """Of the other fields."""
    follows: Dense
    """Displacements of the surface per displacement of these."""
    bears: Dense
    """Forces on these per force on the surface."""
    grown: tuple[Dense, Dense]
    """Two factors, whose product is added to the surface's compliance."""
    reciprocal_condition: float
    """Of the stiffness of what was eliminated."""


def eliminated(stiffness: Dense, count: int, follows: Dense, bears: Dense) -> Eliminated:
    """Eliminate the first `count` fields of a front. Raises SingularOperator."""
    norm = _norm(stiffness[:count, :count])
    factors, pivots, info = scipy.linalg.lapack.dgetrf(stiffness[:count, :count])
    reciprocal_condition = _checked(0.0 if info else scipy.linalg.lapack.dgecon(factors, norm)[0])
    right = np.concatenate((bears[:count], stiffness[:count, count:]), axis=1)
    solved = scipy.linalg.lapack.dgetrs(factors, pivots, right)[0]
    of_surface, of_others = solved[:, : bears.shape[1]], solved[:, bears.shape[1] :]
    return Eliminated(
        stiffness[count:, count:] - stiffness[count:, :count] @ of_others,
        follows[:, count:] - follows[:, :count] @ of_others,
        bears[count:] - stiffness[count:, :count] @ of_surface,
        (follows[:, :count], of_surface),
        reciprocal_condition,
    )


def definitely_eliminated(stiffness: Dense, count: int, follows: Dense) -> Eliminated:
    """The same of a front that is symmetric and positive definite, with half the arithmetic: K = L Lᵀ, and L⁻¹ is enough."""
    norm = _norm(stiffness[:count, :count])
    root, info = scipy.linalg.lapack.dpotrf(stiffness[:count, :count], lower=1)
    reciprocal_condition = _checked(0.0 if info else scipy.linalg.lapack.dpocon(root, norm, uplo="L")[0])
    # By columns, as BLAS has it: the result takes its place.
    right = np.concatenate((follows[:, :count], stiffness[count:, :count])).T
    solved = scipy.linalg.blas.dtrsm(1.0, root, right, lower=1, overwrite_b=1)
    of_surface, of_others = solved[:, : len(follows)], solved[:, len(follows) :]
    left = follows[:, count:] - of_surface.T @ of_others
    return Eliminated(
        stiffness[count:, count:] - of_others.T @ of_others,
        left,
        left.T,
        (of_surface.T, of_surface),
        reciprocal_condition,
    )


def _norm(square: Dense) -> float:
    return float(np.abs(square).sum(axis=0).max(initial=0.0))


def _checked(reciprocal_condition: float) -> float:
    """The reciprocal condition. Raises SingularOperator where it is below machine precision."""
    if reciprocal_condition < np.finfo(float).eps:
        raise SingularOperator(
            f"the slab's stiffness is singular (reciprocal condition {reciprocal_condition:.1e}): "
            "check that the support restrains it, and that poisson is not too close to 0.5"
        )
    return reciprocal_condition
