"""The surface compliance of a slab (Eq. 11), displacements of its nodes per nodal force, and how sound it is."""

import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Final

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.arrays import Dense, Floats, Indices, Vector
from nanoslip.solver.elasticity.schemes.endless import EndlessScheme, SurfaceConvolution
from nanoslip.solver.outcome import INDEFINITE, ROUNDED, Ending, Outcome, SingularOperator
from nanoslip.solver.slab import Slab
from nanoslip.solver.view import OneLine

Entries = Callable[[Indices, Indices], Dense]
"""A matrix in these rows and columns, (rows, columns), a copy."""


class Compliance(OneLine, ABC):
    """Displacements of a slab's n surface nodes per nodal force, in 1/G per unit depth.

    Entries are numbered as in [u; w] and [f_x; f_z], nodes left to right: x to the right, z upwards (out of the slab).
    """

    __slots__ = ()
    slab: Slab

    @property
    @abstractmethod
    def matrix(self) -> Dense:
        """[u; w] = matrix @ [f_x; f_z], (2n, 2n)."""

    @property
    def lasting(self) -> bool:
        """True if derived results may be cached with it: it is immutable."""
        return True

    @abstractmethod
    def own_displacement(self) -> Vector:
        """w of every surface node per normal force on it, (n,)."""

    @abstractmethod
    def window(self, nodes: Indices) -> Dense:
        """The matrix of these nodes alone, neighbours in a row, a copy."""

    @abstractmethod
    def entries(self, rows: Indices, columns: Indices) -> Dense:
        """The matrix in these rows and columns, (rows, columns), a copy."""

    @abstractmethod
    def displacements(self, forces: Dense, coupled: bool = True) -> Dense:
        """[u; w] of all surface nodes, (2, n), under nodal forces [f_x; f_z], (2, n); coupled: as in `decouple` if not."""

    @abstractmethod
    def decouple(self) -> "Compliance":
        """Drop the coupling (Goodman's approximation): normal forces cause no u, and tangential forces no w."""

    @property
    def x(self) -> Vector:
        """Positions of the surface nodes in L_x, centred on the slab's middle, shape (n,), read-only."""
        return self.slab.layout.x()

    @property
    def y(self) -> Vector:
        """Positions of the surface nodes across the drag in L_x, (n,), from the middle row; 0 in plane strain."""
        return self.slab.layout.y

    @property
    def widths(self) -> Vector:
        """Length of surface that belongs to each node, in L_x, shape (n,), read-only: nodal force = traction × width. Of a plane
        of nodes it is their area, in L_x².

        It is the width of a node's control volume, which equals the integral of its hat function. The end nodes have half
        of it, except on a half-plane, whose surface continues beyond them, and on a chain, whose blocks are all alike.
        """
        return self.slab.layout.areas

    def _facts(self) -> Iterator[str]:
        middle = np.array([self.slab.nodes // 2])
        yield f"{self.slab.nodes} surface nodes"
        yield f"scheme {self.slab.scheme.name}"
        yield f"u under a force at the middle {self.entries(middle, middle).item():.4g}"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SurfaceCompliance(Compliance):
    """A compliance that is stored as a matrix, (2n, 2n), read-only."""

    matrix: Dense = field()  # it has no default, though the base has a property of that name
    slab: Slab = field()

    def __post_init__(self) -> None:
        shape = (2 * self.slab.n_x, 2 * self.slab.n_x)
        if self.matrix.shape != shape:
            raise ValueError(f"matrix.shape = {self.matrix.shape}: a slab of n_x = {self.slab.n_x} needs {shape}")

    @property
    def lasting(self) -> bool:
        return not self.matrix.flags.writeable

    def own_displacement(self) -> Vector:
        return self.matrix.diagonal()[self.slab.n_x :]

    def window(self, nodes: Indices) -> Dense:
        # Blocks are copied as pieces in a row: much faster than by lists of rows and columns.
        n, some = self.slab.n_x, slice(nodes[0], nodes[-1] + 1)
        blocks = self.matrix.reshape(2, n, 2, n)[:, some, :, some]
        return np.array(blocks, order="C").reshape(2 * len(nodes), 2 * len(nodes))

    def entries(self, rows: Indices, columns: Indices) -> Dense:
        return take_entries(self.matrix, rows, columns)

    def displacements(self, forces: Dense, coupled: bool = True) -> Dense:
        n, displaced = self.slab.n_x, np.zeros(forces.size)
        for along in (0, 1):
            nodes = forces[along].nonzero()[0]
            if not len(nodes):  # only what is loaded, and what moves, is read
                continue
            loaded, first = slice(nodes[0], nodes[-1] + 1), along * n
            moved = slice(None) if coupled else slice(first, first + n)
            by_forces = self.matrix[moved, first : first + n][:, loaded]
            displaced[moved] += by_forces @ forces[along, loaded]
        return displaced.reshape(2, n)

    def decouple(self) -> "SurfaceCompliance":
        n = self.slab.n_x
        matrix = np.zeros_like(self.matrix, subok=False)
        for half in (slice(n), slice(n, None)):
            matrix[half, half] = self.matrix[half, half]
        matrix.setflags(write=False)
        return SurfaceCompliance(matrix, self.slab)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class EndlessCompliance(Compliance):
    """The compliance of a surface without ends, whose nodes are all alike: a number for each offset and pair of directions."""

    convolution: SurfaceConvolution
    slab: Slab

    @property
    def matrix(self) -> Dense:
        return self.window(np.arange(self.slab.nodes))

    def own_displacement(self) -> Vector:
        return np.full(self.slab.nodes, self.convolution.own_displacement)

    def window(self, nodes: Indices) -> Dense:
        return self.convolution.window(nodes)

    def entries(self, rows: Indices, columns: Indices) -> Dense:
        return self.convolution.entries(rows, columns)

    def displacements(self, forces: Dense, coupled: bool = True) -> Dense:
        return (self.convolution if coupled else self.convolution.decouple()).displacements(forces)

    def decouple(self) -> "EndlessCompliance":
        return EndlessCompliance(self.convolution.decouple(), self.slab)


FEW_NODES: Final = 129
"""Largest set of nodes that is factorized anew at every change: that takes no longer than a bordered update."""
KEPT: Final = 32
"""Number of sets of few nodes whose systems and tableaus are cached, as members and other cases meet the same ones. At most
50 MB."""


def stiffness_of_node(compliance: Compliance, contact: NDArray[np.bool_]) -> float:
    """Change of K by one node more at either end of the contact, pressures held (bordered inverse), in G·L_y; 0 without room."""
    few = compliance.slab.nodes <= FEW_NODES and compliance.lasting
    return (_stiffness_of_node_before if few else _stiffness_of_node)(compliance, contact.tobytes())


def _stiffness_of_node(compliance: Compliance, in_contact: bytes) -> float:
    contact = np.frombuffer(in_contact, np.bool_)
    nodes = contact.nonzero()[0]
    neighbours = np.array([nodes[0] - 1, nodes[-1] + 1], dtype=np.intp)
    added = neighbours[(neighbours >= 0) & (neighbours < len(contact))]
    if not len(added):
        return 0.0
    beside = compliance.entries(nodes, added)
    ones_and_beside = np.column_stack((np.ones(len(nodes)), beside))
    solved = np.linalg.solve(compliance.entries(nodes, nodes), ones_and_beside)
    # K = 1ᵀ C⁻¹ 1. With a node more, whose compliances with the others are c and with itself c_0, the bordered
    # inverse adds (1 - cᵀ C⁻¹ 1)²/(c_0 - cᵀ C⁻¹ c).
    own_compliance = compliance.entries(added, added).diagonal()
    complement = own_compliance - np.einsum("ij,ij->j", beside, solved[:, 1:])
    missing = 1.0 - beside.T @ solved[:, 0]
    return float(np.mean(missing**2 / complement))


_stiffness_of_node_before = lru_cache(maxsize=KEPT)(_stiffness_of_node)


def take_entries(matrix: Dense, rows: Indices, columns: Indices) -> Dense:
    """The matrix in these rows and columns: much faster by `take`, along the shorter list first, than by both at once."""
    if len(rows) <= len(columns):
        return matrix.take(rows, 0).take(columns, 1)
    return matrix.take(columns, 1).take(rows, 0)


def border_matrix(compliance: Entries, entries: Indices, nodes: int) -> Dense:
    """The compliance in these m entries, of a surface with this number of nodes, with a row and a column of approach
    and load, (m + 1, m + 1)."""
    result = np.zeros((len(entries) + 1, len(entries) + 1))
    for rows in portions(len(entries)):
        result[:-1][rows, :-1] = compliance(entries[rows], entries)
    result[:-1, -1] = result[-1, :-1] = entries >= nodes
    return result


def contact_stiffness_matrix(compliance: Compliance, nodes: Indices) -> Dense:
    """Forces and approach per u, v and -load at these nodes, (2m + 1, 2m + 1). Raises SingularOperator."""
    # Inverse of [C e; eᵀ 0], e being 1 at normal entries: given u and v = w + approach, forces that bear the load.
    count = compliance.slab.nodes
    system = border_matrix(compliance.entries, np.concatenate((nodes, nodes + count)), count)
    return invert_bordered(system, f"compliance of {len(nodes)} nodes")


def add_node(compliance: Compliance, stiffness: Dense, nodes: Indices, node: int) -> Dense:
    """Update a `contact_stiffness_matrix` by one more node (bordered inverse). nodes: with `node`, which is added."""
    count, place = compliance.slab.nodes, int(np.searchsorted(nodes, node))
    others, new = np.delete(nodes, place), np.array([node, node + count])
    loaded_entries = np.concatenate((others, others + count))
    loaded = np.array([[0.0, 1.0]])
    beside = np.hstack((compliance.entries(new, loaded_entries), loaded.T))
    reached = stiffness @ np.vstack((compliance.entries(loaded_entries, new), loaded))
    # Schur complement: how far the node gives way while all others are held.
    complement_inverse = np.linalg.inv(compliance.entries(new, new) - beside @ reached)
    # Inverse by blocks, with S the old inverse, B the new rows, R = S Bᵀ and D the Schur complement's inverse:
    # [S + R D B S, -R D; -D B S, D].
    entries = np.arange(len(stiffness) + 2)
    added = np.array([place, len(nodes) + place])
    old = np.delete(entries, added)
    share = complement_inverse @ (beside @ stiffness)
    extended = np.empty((len(entries), len(entries)))
    extended[np.ix_(old, old)] = stiffness + reached @ share
    extended[np.ix_(old, added)] = -reached @ complement_inverse
    extended[np.ix_(added, old)] = -share
    extended[np.ix_(added, added)] = complement_inverse
    return extended


def remove_node(stiffness: Dense, place: int) -> Dense:
    """Update a `contact_stiffness_matrix` by one node less. place: of the removed node among the nodes before."""
    gone = np.array([place, len(stiffness) // 2 + place])
    old = np.delete(np.arange(len(stiffness)), gone)
    # Its forces are set to 0: what held it is shared out among the others.
    # By blocks of the old inverse S, o the nodes that stay and g the one that goes: S_oo - S_og S_gg⁻¹
    # S_go.
    beside = take_entries(stiffness, gone, old)
    shared = np.linalg.solve(take_entries(stiffness, gone, gone), beside)
    return take_entries(stiffness, old, old) - take_entries(stiffness, old, gone) @ shared


def invert_bordered(system: Dense, name: str, room: Dense | None = None) -> Dense:
    """The inverse of a `name` with the load's row and column, which are the last: by Cholesky's factor where it has one, in the
    place of the system, as large ones fill the memory. room: for as many numbers, overwritten."""
    block, border = system[:-1, :-1], system[:-1, -1]
    # To the last bit: the factor reads one triangle, and would invert another matrix.
    if not np.array_equal(block, block.T):
        return inverse(system, name)
    # The factor takes a copy: the system is needed as it is if it has none.
    place = np.empty(block.size) if room is None else room.reshape(-1)[: block.size]
    place.reshape(block.shape)[:] = block
    some = portions(len(block))
    factor, failed = scipy.linalg.lapack.dpotrf(place.reshape(block.shape).T, overwrite_a=1)
    norm = max(float(np.abs(block[rows]).sum(1).max()) for rows in some)
    if failed or scipy.linalg.lapack.dpocon(factor, norm)[0] < np.finfo(float).eps:
        return inverse(system, name)
    # One triangle of the inverse, the other is 0: in the sum below the diagonal counts twice.
    triangle = scipy.linalg.lapack.dpotri(factor, overwrite_c=1)[0]
    np.add(triangle, triangle.T, out=block)
    block[np.diag_indices(len(block))] /= 2.0
    # The border by elimination: equal heights cause the forces `alone`, which bear the load together.
    # [A 1; 1ᵀ 0]⁻¹ = [A⁻¹ - a aᵀ/s, a/s; aᵀ/s, -1/s] with a = A⁻¹ 1 and s = 1ᵀ a.
    alone = block @ border
    share = float(border @ alone)
    for rows in some:
        block[rows] -= np.outer(alone[rows], alone / share)
    system[:-1, -1] = system[-1, :-1] = alone / share
    system[-1, -1] = -1.0 / share
    return system


def portions(rows: int) -> list[slice]:
    """Slices of a matrix's rows, so that no second matrix is needed at once."""
    return [slice(first, first + 256) for first in range(0, rows, 256)]


def inverse(block: Floats, name: str) -> Floats:
    """block⁻¹ of a `name`; SingularOperator if not a digit of it is sure."""
    try:
        with warnings.catch_warnings():
            # One whose reciprocal condition is below machine precision.
            warnings.simplefilter("error", scipy.linalg.LinAlgWarning)
            return np.asarray(scipy.linalg.inv(block))
    except (scipy.linalg.LinAlgError, scipy.linalg.LinAlgWarning, ValueError) as error:
        raise SingularOperator(
            f"the {name} in contact is singular to rounding: use another scheme or n_x, or an aspect_ratio nearer 1"
        ) from error


def surface_compliance(slab: Slab) -> Compliance:
    """The surface compliance of `slab`, exactly symmetric where its scheme is reciprocal.

    Raises SingularOperator if a block cannot be inverted, InvalidInput if the scheme does not fit the slab.
    """
    if isinstance(slab.scheme, EndlessScheme):
        return EndlessCompliance(_convolution(slab.scheme, slab), slab)
    matrix = slab.scheme.matrix(slab)
    matrix.setflags(write=False)
    return SurfaceCompliance(matrix, slab)


@lru_cache(maxsize=4)  # asked by every task on it
def _convolution(scheme: EndlessScheme, slab: Slab) -> SurfaceConvolution:
    return scheme.convolution(slab)


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

    reciprocal_condition: estimate in the 1-norm; relative errors of forces are about machine precision over it.
    positive_definite: only then is frictionless contact unique. asymmetry: largest |c_ij - c_ji| over the largest |c_ij|.
    """

    reciprocal_condition: float
    positive_definite: bool
    asymmetry: float


def conditioning(matrix: Dense) -> Conditioning:
    """Condition number, definiteness and symmetry of a compliance, shape (n, n). Costs two factorizations."""
    norm = float(np.abs(matrix).sum(axis=0).max())
    factors, _, info = scipy.linalg.lapack.dgetrf(matrix)
    reciprocal = 0.0 if info else float(scipy.linalg.lapack.dgecon(factors, norm)[0])
    # Energy depends on the symmetric part alone.
    _, failed = scipy.linalg.lapack.dpotrf(matrix + matrix.T)
    asymmetry = float(np.abs(matrix - matrix.T).max() / np.abs(matrix).max())
    return Conditioning(reciprocal, not failed, asymmetry)


def explain_outcome(outcome: Outcome, compliance: Compliance, contact: NDArray[np.bool_]) -> Outcome:
    """Add a cause and advice to the message of a bad outcome, where the compliance of the nodes in contact may be the cause.

    contact: mask of the surface nodes in contact, shape (n,). Other outcomes are returned unchanged, as is every one of a
    surface without ends, which is a closed form: positive definite, its condition number about n.
    """
    if outcome.ending not in _OPERATORS_FAULT or not contact.any() or not isinstance(compliance, SurfaceCompliance):
        return outcome
    nodes = np.flatnonzero(np.concatenate((contact, contact)))
    condition = conditioning(compliance.entries(nodes, nodes))
    operator = f"; the {compliance.slab.scheme} operator of the {int(contact.sum())} nodes in contact"
    figures = f"(asymmetry {condition.asymmetry:.1e}, reciprocal condition {condition.reciprocal_condition:.1e})"
    if condition.positive_definite and condition.reciprocal_condition >= ILL_CONDITIONED:
        return outcome
    fault = "is ill-conditioned" if condition.positive_definite else "is not positive definite"
    cause, advice = ROUNDED, "use a poisson further from 0.5, or an aspect_ratio nearer 1"
    if not (condition.positive_definite or compliance.slab.scheme.reciprocal):  # a reciprocal one is, but for rounding
        cause, advice = INDEFINITE, "use the scheme galerkin, or a poisson further from 0.5"
    return replace(outcome, message=f"{outcome.message}{operator} {fault} {figures}: {advice}", cause=cause)
