"""Which nodes a contact set exchanges next (block principal pivoting: Kostreva; Júdice and Pires).

All wrong nodes at once, those that pull and those inside the pin. When their number has not fallen for PATIENCE rounds, only the
one furthest right (Murty's rule, which cannot cycle on a positive definite operator), until fewer are wrong than ever before.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Nodes = NDArray[np.bool_]

PATIENCE = 10
"""Rounds in which a contact set may not improve before its wrong nodes are exchanged one at a time."""


class Exchanged(NamedTuple):
    """The set to try next."""

    contact: Nodes
    all_at_once: bool
    """Whether every wrong node changed sides."""
    again: bool
    """Whether one node at a time led back to a set that it had left before."""


class Exchange:
    """The search for a contact set among surface nodes at x, (n,), as the pin sees them; it keeps one node at least."""

    def __init__(self, x: NDArray[np.float64]) -> None:
        self._lowest = int(np.argmin(np.abs(x)))
        self._fewest, self._patience = len(x) + 1, PATIENCE
        self._left: set[bytes] = set()

    def exchanged(self, contact: Nodes, wrong: Nodes) -> Exchanged:
        """What follows a contact, (n,), some nodes of which are wrong, (n,)."""
        count = int(wrong.sum())
        if count < self._fewest:
            self._fewest, self._patience = count, PATIENCE
            self._left.clear()
        self._patience -= 1
        if self._patience >= 0:
            return Exchanged(self._kept(contact ^ wrong), all_at_once=True, again=False)
        known = contact.tobytes()
        again = known in self._left
        self._left.add(known)
        following = contact.copy()
        following[np.flatnonzero(wrong)[-1]] ^= True
        return Exchanged(self._kept(following), all_at_once=False, again=again)

    def _kept(self, contact: Nodes) -> Nodes:
        if not contact.any():
            contact[self._lowest] = True
        return contact
