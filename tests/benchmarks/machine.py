"""The machine on which a table was measured: its processor, and the libraries and kernels of linear algebra."""

import scipy.linalg

from nanoslip.study import origin
from tests.benchmarks.table import Row


def rows() -> list[Row]:
    """Processor and linear algebra."""
    scipy.linalg.inv([[1.0]])  # loads its library
    return [Row("processor of this table", origin.model(), origin.blas())]
