"""Report of a verification test on itself: law, source, errors seen and their order; `pytest -rP tests/verification` shows it."""

from collections.abc import Mapping, Sequence

import numpy as np


def seen(law: str, source: str, figures: str) -> str:
    """Print one line and return it, for the assertion's message."""
    line = f"{law} [{source}]: {figures}"
    print(line)
    return line


def observed_order(h: Sequence[float], errors: Sequence[float]) -> float:
    """Slope of log(error) over log(h), by least squares."""
    return float(np.polyfit(np.log(h), np.log(np.abs(errors)), 1)[0])


def listed(errors: Sequence[float]) -> str:
    """Errors in per cent, finest last."""
    return ", ".join(f"{100 * abs(error):.2g} %" for error in errors)


def converges(
    law: str, source: str, grids: Sequence[int], errors: Mapping[str, Sequence[float]]
) -> tuple[str, dict[str, float]]:
    """The line of what was seen on these grids, n_x or another count of nodes, and the order of each error in their spacing."""
    orders = {name: observed_order([1 / (n - 1) for n in grids], column) for name, column in errors.items()}
    figures = (f"{name} off by {listed(column)}, order {orders[name]:.1f}" for name, column in errors.items())
    return seen(law, source, f"nodes {grids}: {'; '.join(figures)}"), orders
