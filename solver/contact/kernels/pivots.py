"""Pivots of a tableau: each exchanges a node's two inputs and responses. Rows of the tableau follow when they are
next read.

Row r of the stored tableau is the response to one input. Node k has the entries P = (p, q); R are its two rows, the
rows of P, and A = R[P] transposed is the block of the node's responses to the node's inputs. Once they are exchanged,
every other row is

    r + f R    with    f = -A⁻¹ r[P],    but f itself in the entries P:

f are the inputs at which the node's former responses are 0. A row that follows the pivots 1 … m adds
f_1 R_1 … f_m R_m. The entries in the columns of these m nodes decide all f, one after the other; they are few, and
are followed first. All other entries then take up several pivots in one pass, so that a long row is read from memory
once.

Pivots of different nodes commute, and two pivots of the same node cancel. A row that has followed neither pivot of
such a pair may skip both if all pivots between them are pairs of the same kind.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.compiled import declare_kernel

Numbers = NDArray[np.int64]


class Pivots(NamedTuple):
    """The last m pivots, which some rows may not have followed yet; they all do before there is no room for another."""

    rows: Floats
    """(m, 2, row length) the node's two rows before each pivot."""
    inverses: Floats
    """(m, 4) A⁻¹, row by row."""
    nodes: Numbers
    """(m,)"""
    followed: Numbers
    """(N,) number of these pivots that each row has followed."""
    meetings: Floats
    """(m, 5, m) entries of each pivot's rows in the columns of all pivots: of the first row in p and in q, of the second row;
    last 1, or 0 for a pivot of the same node, whose entries are replaced."""
    twins: Numbers
    """(m,) the pivot that cancels each pivot, or that it cancels; -1 without."""
    entries: Floats
    """(2, 2, m) of two rows in the columns p and q of all pivots."""
    factors: Floats
    """(2, m, 2) f of two rows for each pivot."""
    chosen: Numbers
    """(m,) pivots that two rows do not skip."""


# 2 rows of 400 numbers for each of 16 pivots are 100 kB.
MOST_PIVOTS = 16
"""Pivots that rows of the tableau may follow later: their rows fit a processor's cache."""


@declare_kernel(inline="always")
def note_meetings(pivots: Pivots, k: int, n: int) -> None:
    """Note how pivot k and earlier pivots change each other's columns, and which of them it cancels. n: number of
    nodes."""
    node, meetings = pivots.nodes[k], pivots.meetings
    for e in range(k + 1):
        same = pivots.nodes[e] == node
        for one, other in ((k, e), (e, k)):
            p, kept = pivots.nodes[other], 0.0 if same else 1.0
            # A pivot of the same node puts f itself in place of the entry: 0 times the entry, 1 times one factor
            # of two.
            meetings[one, 0, other] = 1.0 if same else pivots.rows[one, 0, p]
            meetings[one, 1, other] = kept * pivots.rows[one, 0, n + p]
            meetings[one, 2, other] = kept * pivots.rows[one, 1, p]
            meetings[one, 3, other] = 1.0 if same else pivots.rows[one, 1, n + p]
            meetings[one, 4, other] = kept
    # Pairs that cancel lie one in the other: back over all of them that are closed.
    last = k - 1
    while last >= 0 and pivots.twins[last] >= 0:
        last = pivots.twins[last] - 1
    pivots.twins[k] = -1
    if last >= 0 and pivots.nodes[last] == node:
        pivots.twins[k], pivots.twins[last] = last, k


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


@declare_kernel()
def follow_two(tableau: Floats, pivots: Pivots, i: int, end: int, n: int) -> None:
    """Let both rows of node i follow the first `end` pivots, several in one pass over both."""
    begin, j = pivots.followed[i], n + i
    _find_factors(tableau[i], pivots, begin, end, n, pivots.entries[0], pivots.factors[0])
    _find_factors(tableau[j], pivots, begin, end, n, pivots.entries[1], pivots.factors[1])
    chosen, count = pivots.chosen, 0
    for k in range(begin, end):
        # Two pivots of a pair that both lie in this stretch cancel, and are skipped (see above).
        if pivots.twins[k] < begin:
            chosen[count] = k
            count += 1
    some = 0
    while some + 4 <= count:
        _add_four(tableau, i, j, pivots.factors, pivots.rows, chosen, some)
        some += 4
    while some < count:
        _add_one(tableau, i, j, pivots.factors, pivots.rows, chosen[some])
        some += 1
    for k in range(begin, end):
        p, q = pivots.nodes[k], n + pivots.nodes[k]
        tableau[i, p] = pivots.entries[0, 0, k]
        tableau[i, q] = pivots.entries[0, 1, k]
        tableau[j, p] = pivots.entries[1, 0, k]
        tableau[j, q] = pivots.entries[1, 1, k]
    pivots.followed[i], pivots.followed[j] = end, end


@declare_kernel(inline="always")
def _find_factors(row: Floats, pivots: Pivots, begin: int, end: int, n: int, entries: Floats, factors: Floats) -> None:
    """Set f of a row for each pivot from `begin` on that it does not skip, (m, 2), and its entries in their columns, (2, m)."""
    for e in range(begin, end):
        node = pivots.nodes[e]
        entries[0, e], entries[1, e] = row[node], row[n + node]
    for k in range(begin, end):
        if pivots.twins[k] >= begin:
            continue
        inverse = pivots.inverses[k]
        first = -(inverse[0] * entries[0, k] + inverse[1] * entries[1, k])
        second = -(inverse[2] * entries[0, k] + inverse[3] * entries[1, k])
        factors[k, 0], factors[k, 1] = first, second
        _follow_in_columns(first, second, pivots.meetings[k], entries, begin, end)


@declare_kernel()
def _follow_in_columns(first: float, second: float, meeting: Floats, entries: Floats, begin: int, end: int) -> None:
    """Let the entries of a row in the columns of pivots, (2, m), follow one of these."""
    for e in range(begin, end):
        change_p = first * meeting[0, e] + second * meeting[2, e]
        change_q = first * meeting[1, e] + second * meeting[3, e]
        entries[0, e] = meeting[4, e] * entries[0, e] + change_p
        entries[1, e] = meeting[4, e] * entries[1, e] + change_q


@declare_kernel()
def _add_four(tableau: Floats, i: int, j: int, factors: Floats, rows: Floats, chosen: Numbers, some: int) -> None:
    """Add f R of four pivots to two rows of the tableau."""
    k0, k1 = chosen[some], chosen[some + 1]
    k2, k3 = chosen[some + 2], chosen[some + 3]
    a0, a1 = factors[0, k0, 0], factors[0, k0, 1]
    a2, a3 = factors[0, k1, 0], factors[0, k1, 1]
    a4, a5 = factors[0, k2, 0], factors[0, k2, 1]
    a6, a7 = factors[0, k3, 0], factors[0, k3, 1]
    b0, b1 = factors[1, k0, 0], factors[1, k0, 1]
    b2, b3 = factors[1, k1, 0], factors[1, k1, 1]
    b4, b5 = factors[1, k2, 0], factors[1, k2, 1]
    b6, b7 = factors[1, k3, 0], factors[1, k3, 1]
    for c in range(tableau.shape[1]):
        r0, r1 = rows[k0, 0, c], rows[k0, 1, c]
        r2, r3 = rows[k1, 0, c], rows[k1, 1, c]
        r4, r5 = rows[k2, 0, c], rows[k2, 1, c]
        r6, r7 = rows[k3, 0, c], rows[k3, 1, c]
        # Summed from left to right as written, by any processor: another order would have other bits.
        tableau[i, c] += a0 * r0 + a1 * r1 + a2 * r2 + a3 * r3 + a4 * r4 + a5 * r5 + a6 * r6 + a7 * r7
        tableau[j, c] += b0 * r0 + b1 * r1 + b2 * r2 + b3 * r3 + b4 * r4 + b5 * r5 + b6 * r6 + b7 * r7


@declare_kernel()
def _add_one(tableau: Floats, i: int, j: int, factors: Floats, rows: Floats, k: int) -> None:
    """Add f R of a pivot to two rows of the tableau."""
    a0, a1 = factors[0, k, 0], factors[0, k, 1]
    b0, b1 = factors[1, k, 0], factors[1, k, 1]
    for c in range(tableau.shape[1]):
        r0, r1 = rows[k, 0, c], rows[k, 1, c]
        tableau[i, c] += a0 * r0 + a1 * r1
        tableau[j, c] += b0 * r0 + b1 * r1
