"""Columns of a friction record in the making, which kernels fill."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.contact.kernels.state import Floats


class Events(NamedTuple):
    """Columns of a friction record in the making (see FrictionRecord), each of shape (capacity,)."""

    displacement: Floats
    force_before: Floats
    force_after: Floats
    stiffness: Floats
    dissipated: Floats
    kind: NDArray[np.int8]
    node: NDArray[np.int32]
    slips: NDArray[np.int64]
    releases: NDArray[np.int32]
    touches: NDArray[np.int32]
    contact_size: NDArray[np.int32]
