"""Multiples of a tableau's rows added to a vector: where nearly all the time of sliding goes."""

from nanoslip.solver.compiled import compiled
from nanoslip.solver.contact.kernels.state import Floats


@compiled(fastmath={"contract"})
def add(total: Floats, factor: float, row: Floats) -> None:
    """total += factor·row, in place; both of one length."""
    for k in range(len(total)):
        total[k] += factor * row[k]


@compiled()
def move_along(total: Floats, step: float, rate: Floats) -> None:
    """total += step·rate, in place, the product rounded: what is linear in the step, on its way to the next event."""
    for k in range(len(total)):
        total[k] += step * rate[k]


@compiled(fastmath={"contract"})
def add_two(total: Floats, first: float, row_1: Floats, second: float, row_2: Floats) -> None:
    """total += first·row_1 + second·row_2, in place and in one pass; all of one length."""
    for k in range(len(total)):
        total[k] += first * row_1[k] + second * row_2[k]


@compiled(fastmath={"contract"})
def add_two_rows(total: Floats, rows: Floats, i: int, first: float, j: int, second: float) -> None:
    """total += first·rows[i] + second·rows[j], in place. rows: a matrix with as many columns as total has elements."""
    for k in range(len(total)):
        total[k] += first * rows[i, k] + second * rows[j, k]
