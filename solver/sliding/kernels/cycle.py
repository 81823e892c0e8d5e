"""A search for cycles of events, compiled."""

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.compiled import declare_kernel


@declare_kernel(entry=True)
def cycle(node: NDArray[np.int32], before: Floats, after: Floats) -> int:
    """Number of events after which the last of these repeat themselves; 0 where they do not (see `repeat_length`)."""
    last, fallen = len(node) - 1, 0.0
    for period in range(1, len(node) // 3 + 1):
        # The scale of equality is the largest drop within one period.
        fallen = max(fallen, abs(before[last - period + 1] - after[last - period + 1]))
        now = last
        while (
            # Two repetitions and what they repeat: three times over.
            now > last - 2 * period
            and node[now] == node[now - period]
            and abs(after[now] - after[now - period]) <= 1e-3 * fallen
        ):
            now -= 1
        # The shortest period is found first; its multiples repeat as well.
        if now == last - 2 * period:
            return period
    return 0
