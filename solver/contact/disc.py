"""A disc of nodes on a plane, which is its own image along x and along y: its matrices fall into four parts.

The compliance of two nodes follows from their offset. Reversed along y it is the same; reversed along x too, if u, which points
along x, is reversed as well. So a matrix T of the disc does not change under its four reflections g: none, of x, of y, of both.
With σ_b(g) = -1 where b is a tangential entry and g reverses x (else 1), T[ga, gb] = σ_a(g) σ_b(g) T[a, b]: the rows of a quarter
of all entries are enough. For each of four characters χ, the signs that products of reflections allow, the sums

    e_b = Σ_g χ(g) σ_b(g) δ_gb / (2 √m_b),    m_b: number of reflections that leave b in its place,

of images of an entry b are orthonormal (or 0, for entries on an axis), and T connects none of different characters. T falls into
four parts,

    T_χ[a, b] = Σ_g χ(g) σ_b(g) T[a, gb] / √(m_a m_b),    T[a, gb] = σ_b(g) √(m_a m_b) Σ_χ χ(g) T_χ[a, b] / 4,

each of a quarter of its size: to invert them takes a sixteenth of the operations.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from nanoslip.solver.arrays import Dense, Floats, Indices, Nodes

CHARACTERS: Final = np.array(
    [[1.0, 1.0, 1.0, 1.0], [1.0, -1.0, 1.0, -1.0], [1.0, 1.0, -1.0, -1.0], [1.0, -1.0, -1.0, 1.0]]
)
"""Sign of each character (row) under each reflection (column): 0 none, 1 of x, 2 of y, 3 of both; g after h is g ^ h."""


def node_disc(n: int, nodes: float) -> Nodes:
    """The disc of about this number of nodes in the middle of n by n, a mask."""
    along = np.arange(n) - n // 2
    return np.asarray(along[:, None] ** 2 + along**2 <= nodes / math.pi)


def wider(nodes: Nodes, rings: int = 1) -> Nodes:
    """Nodes of a plane, (columns, rows), and their neighbours, also at corners, up to this number of rings."""
    for _ in range(rings):
        padded = np.pad(nodes, 1)
        # Along one direction, then the other: so corners are reached too.
        along = padded[:-2] | padded[1:-1] | padded[2:]
        nodes = along[:, :-2] | along[:, 1:-1] | along[:, 2:]
    return nodes


@dataclass(frozen=True, slots=True, eq=False)
class Quarter:
    """A quarter of the entries [u; w; load] of a disc's nodes, k in all, and their images under the four reflections."""

    images: Indices
    """(4, k) numbers of the entries."""
    signs: Floats
    """(4, k) σ."""

    @property
    def entries(self) -> Indices:
        """Numbers of the quarter's own entries, (k,)."""
        return np.asarray(self.images[0])

    @property
    def scale(self) -> Floats:
        """√m of each entry, (k,)."""
        return np.asarray(np.sqrt((self.images == self.entries).sum(axis=0)))

    def without_load(self) -> "Quarter":
        """The quarter of [u; w] alone."""
        return Quarter(self.images[:, :-1], self.signs[:, :-1])

    def members(self, character: Floats) -> Indices:
        """Places in the quarter of the entries whose sums over images are not 0 for a character (4,)."""
        fixed = self.images == self.entries
        return np.flatnonzero(character @ (fixed * self.signs) > 0.0)

    def parts(self, matrix: Callable[[Indices, Indices], Dense]) -> Dense:
        """The parts, (4, k, k), of a matrix that is given by its entries in rows and columns."""
        by_reflection = np.array([matrix(self.entries, image) for image in self.images])
        by_reflection *= self.signs[:, None]
        return np.tensordot(CHARACTERS, by_reflection, 1) / np.outer(self.scale, self.scale)

    def from_parts(self, parts: Dense) -> Dense:
        """Rows of the quarter, in the columns of each of its images, (k, 4, k), of the matrix with these parts (4, k, k)."""
        by_reflection = np.tensordot(CHARACTERS, parts, 1) * (np.outer(self.scale, self.scale) / 4.0)
        by_reflection *= self.signs[:, None]
        return np.ascontiguousarray(by_reflection.transpose(1, 0, 2))

    def vector_parts(self, rows: Dense) -> Dense:
        """The parts of vectors that are rows, (any, entries): their products with all e_b, (4, any, k)."""
        by_reflection = (self.signs * rows[:, self.images]).transpose(1, 0, 2)
        return np.tensordot(CHARACTERS, by_reflection, 1) / (2.0 * self.scale)

    def from_vector_parts(self, parts: Dense) -> Dense:
        """The vectors, (any, entries), that have these parts (4, any, k)."""
        by_reflection = np.tensordot(CHARACTERS, parts, 1) * (self.scale / 2.0)
        found = np.empty((parts.shape[1], self.images.max() + 1))
        found[:, self.images] = self.signs * by_reflection.transpose(1, 0, 2)
        return found


def quarter(nodes: Indices, n: int) -> Quarter:
    """The quarter of a disc of nodes in the middle of n by n, whose numbers rise."""
    places = np.array(divmod(nodes, n)) - n // 2
    x, y = places[:, (places >= 0).all(axis=0)]
    load, images, signs = np.array([2 * len(nodes)]), [], []
    for along, across in ((1, 1), (-1, 1), (1, -1), (-1, -1)):
        image = np.searchsorted(nodes, (along * x + n // 2) * n + across * y + n // 2)
        images.append(np.concatenate((image, image + len(nodes), load)))
        signs.append(np.concatenate((np.full(len(x), float(along)), np.ones(len(x) + 1))))
    return Quarter(np.array(images), np.array(signs))


class Disc(NamedTuple):
    """A disc of nodes anywhere on a plane."""

    nodes: Nodes
    """(n²,)"""
    quarter: Quarter


def nearest_disc(contact: Nodes, n: int) -> Disc | None:
    """The disc of about as many nodes as a contact on n by n, (n²,), around their mean place; None if it leaves the plane."""
    touching = np.flatnonzero(contact)
    mean_place = np.array(divmod(touching, n)).mean(axis=1)
    moved = np.rint(mean_place).astype(np.int64) - n // 2
    in_middle = np.flatnonzero(node_disc(n, len(touching)))
    places = np.array(divmod(in_middle, n)) + moved[:, None]
    if places.min() < 0 or places.max() >= n:
        return None
    nodes = np.zeros_like(contact)
    nodes[places[0] * n + places[1]] = True
    return Disc(nodes, quarter(in_middle, n))
