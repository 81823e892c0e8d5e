"""Choice of the few runs that are drawn of many, spread over the values of every axis."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray


def spread(places: Sequence[Mapping[str, Any]], most: int) -> list[int]:
    """Positions of at most so many places, rising: each axis is divided into parts, and all its parts are shown alike.

    places: the coordinates of each, the same ones for all. They are taken one by one: a place costs 2^m for each one taken
    before that it shares m parts with, so that single axes and pairs of them are balanced; of equals the one nearest to the
    middles of its parts.
    """
    if len(places) <= most:
        return list(range(len(places)))
    parts, off = _parts(places, most)
    cost, taken = np.zeros(len(places)), np.zeros(len(places), np.bool_)
    for _ in range(most):
        best = np.lexsort((off, cost, taken))[0]
        taken[best] = True
        cost += 2.0 ** (parts == parts[:, best, None]).sum(axis=0)
    return [int(position) for position in np.flatnonzero(taken)]


def _parts(places: Sequence[Mapping[str, Any]], most: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """(axes, places) the part of its axis that each place is in, and (places,) how far it is from the middles of its parts.

    An axis has as many parts as values, at most `most`. Places without coordinates lie along one axis, in their order.
    """
    columns = [[place[name] for place in places] for name in places[0]] or [list(range(len(places)))]
    parts, off = [], np.zeros(len(places))
    for values in columns:
        order = {value: rank for rank, value in enumerate(_in_order(values))}
        share = (np.array([order[value] for value in values]) + 0.5) / len(order) * min(len(order), most)
        parts.append(share.astype(np.int64))
        off += np.abs(share % 1.0 - 0.5)
    return np.stack(parts), off


def _in_order(values: Sequence[Any]) -> list[Any]:
    """Each value once: numbers by size, words as they come."""
    found = list(dict.fromkeys(values))
    return found if any(isinstance(value, str) for value in found) else sorted(found)
