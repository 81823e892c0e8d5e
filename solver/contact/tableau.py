"""Principal pivot transform of the slab's compliance at the nodes in contact, with the load given and the approach unknown.

With v = w + approach and the load W, the slab obeys [u; v; -W] = B [f_x; f_z; approach], where B is the compliance bordered
by ones (ΣN = W, constraint of the load). Exchanging the contact's displacements and -W for their forces and the approach
gives the tableau that contact and sliding work with: prescribed values in, unknown values out.
"""

import warnings

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.outcome import SingularOperator

LINE = 8
"""Floats in a cache line of 64 bytes."""


def tableau(matrix: NDArray[np.float64], contact: NDArray[np.bool_]) -> NDArray[np.float64]:
    """The bordered compliance pivoted on `contact` (shape (n,)) and on the load: transposed, (2n + 1, 2n + 1)."""
    touching, free = np.flatnonzero(contact), np.flatnonzero(~contact)
    n, load = len(contact), [2 * len(contact)]
    pivoted, kept = np.concatenate((touching, touching + n, load)), np.concatenate((free, free + n))
    sorted_entries = _pivoted_first(matrix, pivoted, kept)
    places = np.concatenate((pivoted, kept)).argsort()
    return sorted_entries.take(places, 0).take(places, 1)


def _pivoted_first(
    matrix: NDArray[np.float64], pivoted: NDArray[np.int64], kept: NDArray[np.int64]
) -> NDArray[np.float64]:
    """The tableau with its pivoted entries before those that are kept."""
    first, then = _rows(matrix, pivoted, kept)
    # `take` along one axis after the other: several times as fast as a gather by lists of rows and columns.
    across = first.take(kept, 1)
    stiffness = _bordered_inverse(first.take(pivoted, 1), f"compliance of {len(pivoted) // 2} nodes")
    from_kept = then.take(pivoted, 1) @ stiffness
    count, entries = len(pivoted), len(pivoted) + len(kept)
    result = np.empty((entries, entries))
    result[:count, :count] = stiffness.T
    result[:count, count:] = from_kept.T
    result[count:, :count] = -(stiffness @ across).T
    result[count:, count:] = (then.take(kept, 1) - from_kept @ across).T
    return result


def _rows(
    matrix: NDArray[np.float64], pivoted: NDArray[np.int64], kept: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The rows of the bordered compliance that are pivoted, and those that are kept."""
    last = len(matrix)
    bordered = np.zeros((last + 1, last + 1))
    bordered[:last, :last] = matrix
    bordered[last // 2 : last, last] = bordered[last, last // 2 : last] = 1.0
    return bordered.take(pivoted, 0), bordered.take(kept, 0)


def in_lines(square: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same with every row padded to begin at a cache line: a row that straddles them takes a third longer to add."""
    entries = len(square)
    stride = -(-entries // LINE) * LINE
    room = np.zeros(entries * stride + LINE)
    first = -room.ctypes.data // room.itemsize % LINE
    padded = room[first : first + entries * stride].reshape(entries, stride)
    padded[:, :entries] = square
    return padded


def _bordered_inverse(system: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    """The inverse of a `name` with the load's row and column, which are the last: by Cholesky's factor where it has one."""
    block, border = system[:-1, :-1], system[:-1, -1]
    if not np.array_equal(block, block.T):
        return inverse(system, name)
    factor, failed = scipy.linalg.lapack.dpotrf(block.T)
    if failed or scipy.linalg.lapack.dpocon(factor, np.abs(block).sum(0).max())[0] < np.finfo(float).eps:
        return inverse(system, name)
    triangle = scipy.linalg.lapack.dpotri(factor, overwrite_c=1)[0]
    result = np.empty_like(system)
    whole = np.add(triangle, triangle.T, out=result[:-1, :-1])
    whole[np.diag_indices(len(whole))] /= 2.0
    alone = whole @ border
    share = float(border @ alone)
    whole -= np.outer(alone, alone / share)
    result[:-1, -1] = result[-1, :-1] = alone / share
    result[-1, -1] = -1.0 / share
    return result


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
