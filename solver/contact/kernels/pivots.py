"""Pivots of a tableau: each exchanges a node's two inputs and responses. Rows of the tableau follow when they are
next read.

Row r of the stored tableau is the response to one input. Node k has the entries P = (p, q); R are its two rows, the
rows of P, and A = R[P] transposed is the block of the node's responses to the node's inputs. Once they are exchanged,
every other row is

    r + f R    with    f = -A⁻¹ r[P],    but f itself in the entries P:

f are the inputs at which the node's former responses are 0. Of nodes in a row each row follows one pivot after the other.

On a plane of nodes rows are long, and most pivots undo an earlier one: nodes at the rim touch and leave again. Pivots of
different nodes commute and two of the same node cancel, so that a row lacks those nodes alone that have changed sides an odd
number of times. Let P be the entries of all of these, and R their rows as they are now, after their pivots. Then the row is

    r - r[P] R    with 0 in place of r[P] in r:

with the tableau T from before the pivots, R is T[P, P]⁻¹ T[P, others] and T[P, P]⁻¹ in the entries P, and the row of others
is r - r[P] T[P, P]⁻¹ T[P, others], and -r[P] T[P, P]⁻¹ in the entries P. So the rows of the nodes that have changed sides lately,
the exchange, follow every pivot at once, and another row is read from memory once for all that it lacks.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.compiled import declare_kernel

Numbers = NDArray[np.int64]


class Pivots(NamedTuple):
    """Pivots that some rows may not have followed yet; they all do before there is no room for another."""

    rows: Floats
    """(m, 2, row length) the node's two rows before each of the last pivots; m = 0 on a plane of nodes."""
    inverses: Floats
    """(m, 4) A⁻¹, row by row."""
    nodes: Numbers
    """(m,) node of each pivot; on a plane the nodes of the exchange, each once, and -1 where there is room for another."""
    followed: Numbers
    """(N,) number of the last pivots that each row has followed; on a plane the nodes of the exchange, a bit each, that were on
    their other side when it last followed."""
    factors: Floats
    """(2, m, 2) factors of rows of the exchange that are added to two other rows."""
    sources: Numbers
    """(m,) the nodes of these rows."""


# 2 rows of 400 numbers for each of 16 pivots are 100 kB.
MOST_PIVOTS = 16
"""Pivots that rows of the tableau may follow later: their rows fit a processor's cache."""
EXCHANGE_SIZE = 32
"""Nodes of an exchange. At each pivot their rows follow, at each 32 further nodes those of all, some thousand: as much work."""


@declare_kernel()
def follow_one(tableau: Floats, pivots: Pivots, j: int, end: int, n: int) -> None:
    """Let row j follow the first `end` pivots, one after the other."""
    for k in range(pivots.followed[j], end):
        p, q = pivots.nodes[k], n + pivots.nodes[k]
        # f = -A⁻¹ r[P], the two inputs of the pivot's node that keep its former responses at 0.
        inverse, row = pivots.inverses[k], tableau[j]
        first = -(inverse[0] * row[p] + inverse[1] * row[q])
        second = -(inverse[2] * row[p] + inverse[3] * row[q])
        add_two(row, first, pivots.rows[k, 0], second, pivots.rows[k, 1])
        # The sum has run over these two columns too.
        row[p], row[q] = first, second
    pivots.followed[j] = end


@declare_kernel()
def add_two(total: Floats, first: float, row_1: Floats, second: float, row_2: Floats) -> None:
    """total += first·row_1 + second·row_2, in place and in one pass; all arrays of equal length."""
    for k in range(len(total)):
        total[k] += first * row_1[k] + second * row_2[k]


@declare_kernel(inline="always")
def find_place(nodes: Numbers, i: int) -> int:
    """Place of node i in the exchange, or else of the first that is free; their number if there is none."""
    for k in range(len(nodes)):
        if nodes[k] == i or nodes[k] < 0:
            return k
    return len(nodes)


@declare_kernel()
def follow_exchange(tableau: Floats, pivots: Pivots, j: int, exchange: int, n: int) -> None:
    """Let row j follow the exchange, given by a bit for each of its nodes that is on its other side."""
    count = _take_factors(tableau[j], pivots, pivots.followed[j] ^ exchange, pivots.factors[0], n)
    for k in range(count):
        node, factors = pivots.sources[k], pivots.factors[0, k]
        add_two(tableau[j], factors[0], tableau[node], factors[1], tableau[n + node])
    pivots.followed[j] = exchange


@declare_kernel()
def follow_exchange_of_node(tableau: Floats, pivots: Pivots, i: int, exchange: int, n: int) -> None:
    """Let both rows of node i follow the exchange as `follow_exchange` does, several in one pass over both."""
    j, factors, sources = n + i, pivots.factors, pivots.sources
    difference = pivots.followed[i] ^ exchange
    count = _take_factors(tableau[i], pivots, difference, factors[0], n)
    _take_factors(tableau[j], pivots, difference, factors[1], n)
    some = 0
    while some + 4 <= count:
        _add_four(tableau, i, j, factors, sources, some, n)
        some += 4
    if some + 2 <= count:
        _add_pair(tableau, i, j, factors, sources, some, n)
        some += 2
    if some < count:
        _add_one(tableau, i, j, factors, sources, some, n)
    pivots.followed[i], pivots.followed[j] = exchange, exchange


@declare_kernel()
def _take_factors(row: Floats, pivots: Pivots, difference: int, factors: Floats, n: int) -> int:
    """Take the entries in the columns of the nodes that a row lacks, a bit each, out of it: less them are its factors, (m, 2).
    Notes these nodes as sources and returns their number."""
    count = 0
    for k in range(len(pivots.nodes)):
        if (difference >> k) & 1:
            p, q = pivots.nodes[k], n + pivots.nodes[k]
            factors[count, 0], factors[count, 1] = -row[p], -row[q]
            row[p], row[q] = 0.0, 0.0
            pivots.sources[count] = pivots.nodes[k]
            count += 1
    return count


@declare_kernel()
def _add_four(tableau: Floats, i: int, j: int, factors: Floats, nodes: Numbers, some: int, n: int) -> None:
    """Add multiples of the rows of four nodes, from number `some` on, to two rows of the tableau."""
    k0, k1 = nodes[some], nodes[some + 1]
    k2, k3 = nodes[some + 2], nodes[some + 3]
    a0, a1 = factors[0, some, 0], factors[0, some, 1]
    a2, a3 = factors[0, some + 1, 0], factors[0, some + 1, 1]
    a4, a5 = factors[0, some + 2, 0], factors[0, some + 2, 1]
    a6, a7 = factors[0, some + 3, 0], factors[0, some + 3, 1]
    b0, b1 = factors[1, some, 0], factors[1, some, 1]
    b2, b3 = factors[1, some + 1, 0], factors[1, some + 1, 1]
    b4, b5 = factors[1, some + 2, 0], factors[1, some + 2, 1]
    b6, b7 = factors[1, some + 3, 0], factors[1, some + 3, 1]
    for c in range(tableau.shape[1]):
        r0, r1 = tableau[k0, c], tableau[n + k0, c]
        r2, r3 = tableau[k1, c], tableau[n + k1, c]
        r4, r5 = tableau[k2, c], tableau[n + k2, c]
        r6, r7 = tableau[k3, c], tableau[n + k3, c]
        # Summed from left to right as written, by any processor: another order would have other bits.
        tableau[i, c] += a0 * r0 + a1 * r1 + a2 * r2 + a3 * r3 + a4 * r4 + a5 * r5 + a6 * r6 + a7 * r7
        tableau[j, c] += b0 * r0 + b1 * r1 + b2 * r2 + b3 * r3 + b4 * r4 + b5 * r5 + b6 * r6 + b7 * r7


@declare_kernel()
def _add_pair(tableau: Floats, i: int, j: int, factors: Floats, nodes: Numbers, some: int, n: int) -> None:
    """Add multiples of the rows of two nodes to two rows of the tableau."""
    k0, k1 = nodes[some], nodes[some + 1]
    a0, a1 = factors[0, some, 0], factors[0, some, 1]
    a2, a3 = factors[0, some + 1, 0], factors[0, some + 1, 1]
    b0, b1 = factors[1, some, 0], factors[1, some, 1]
    b2, b3 = factors[1, some + 1, 0], factors[1, some + 1, 1]
    for c in range(tableau.shape[1]):
        r0, r1 = tableau[k0, c], tableau[n + k0, c]
        r2, r3 = tableau[k1, c], tableau[n + k1, c]
        tableau[i, c] += a0 * r0 + a1 * r1 + a2 * r2 + a3 * r3
        tableau[j, c] += b0 * r0 + b1 * r1 + b2 * r2 + b3 * r3


@declare_kernel()
def _add_one(tableau: Floats, i: int, j: int, factors: Floats, nodes: Numbers, some: int, n: int) -> None:
    """Add multiples of the rows of a node to two rows of the tableau."""
    k = nodes[some]
    a0, a1 = factors[0, some, 0], factors[0, some, 1]
    b0, b1 = factors[1, some, 0], factors[1, some, 1]
    for c in range(tableau.shape[1]):
        r0, r1 = tableau[k, c], tableau[n + k, c]
        tableau[i, c] += a0 * r0 + a1 * r1
        tableau[j, c] += b0 * r0 + b1 * r1
