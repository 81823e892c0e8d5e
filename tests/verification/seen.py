"""What a verification test says of itself: law, source, errors seen and their order; `pytest -rP tests/verification` shows it."""

from collections.abc import Sequence

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
