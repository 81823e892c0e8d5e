"""Principal pivot transform of the slab's compliance at the nodes in contact, with the load given and the approach unknown.

With v = w + approach and the load W, the slab obeys [u; v; -W] = B [f_x; f_z; approach], where B is the compliance bordered
by ones (ΣN = W, constraint of the load). Exchanging the contact's displacements and -W for their forces and the approach
gives the tableau that contact and sliding work with: prescribed values in, unknown values out.
"""

import warnings

import numpy as np
import scipy
from numpy.typing import NDArray

from solver.outcome import SingularOperator

LINE = 8
"""Floats in a cache line of 64 bytes."""


def tableau(matrix: NDArray[np.float64], contact: NDArray[np.bool_]) -> NDArray[np.float64]:
    """The bordered compliance pivoted on `contact` (shape (n,)) and on the load: transposed, (2n + 1, 2n + 1)."""
    n = len(contact)
    bordered = np.zeros((2 * n + 1, 2 * n + 1))
    bordered[: 2 * n, : 2 * n] = matrix
    bordered[n : 2 * n, 2 * n] = bordered[2 * n, n : 2 * n] = 1.0
    pivoted = np.flatnonzero(np.concatenate((contact, contact, [True])))
    kept = np.flatnonzero(np.concatenate((~contact, ~contact, [False])))
    stiffness = inverse(bordered[np.ix_(pivoted, pivoted)], f"compliance of {int(contact.sum())} nodes")
    from_kept = bordered[np.ix_(kept, pivoted)] @ stiffness
    result = np.empty_like(bordered)
    result[np.ix_(pivoted, pivoted)] = stiffness.T
    result[np.ix_(pivoted, kept)] = from_kept.T
    result[np.ix_(kept, pivoted)] = -(stiffness @ bordered[np.ix_(pivoted, kept)]).T
    result[np.ix_(kept, kept)] = (bordered[np.ix_(kept, kept)] - from_kept @ bordered[np.ix_(pivoted, kept)]).T
    return result


def in_lines(square: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same with every row padded to begin at a cache line: a row that straddles them takes a third longer to add."""
    entries = len(square)
    stride = -(-entries // LINE) * LINE
    room = np.zeros(entries * stride + LINE)
    first = -room.ctypes.data // room.itemsize % LINE
    padded = room[first : first + entries * stride].reshape(entries, stride)
    padded[:, :entries] = square
    return padded


def inverse(block: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    """block⁻¹ of a `name`; SingularOperator where not a digit of it is sure."""
    try:
        with warnings.catch_warnings():
            # One whose reciprocal condition is below machine precision.
            warnings.simplefilter("error", scipy.linalg.LinAlgWarning)
            return np.asarray(scipy.linalg.inv(block))
    except (scipy.linalg.LinAlgError, scipy.linalg.LinAlgWarning, ValueError) as error:
        raise SingularOperator(
            f"the {name} in contact is singular to rounding: use another scheme or n_x, or an aspect_ratio nearer 1"
        ) from error
