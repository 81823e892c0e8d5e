"""Arrays by their content, for annotations; shapes are in docstrings."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
"""Numbers, of any shape."""
Vector = Floats
"""Numbers in a row, (n,)."""
Dense = Floats
"""Matrix without a pattern of zeros, (m, n)."""
Indices = NDArray[np.int64]
"""Places in a vector."""
Window = Indices
"""Numbers of the surface nodes that are followed, rising: neighbours in a row, or a patch of a plane."""
Nodes = NDArray[np.bool_]
"""Mask of nodes, (n,)."""
