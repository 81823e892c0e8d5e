"""How uncertain a number of a dataset is for the slab's grid, its whole nodes included."""

import numpy as np
import xarray as xr

from solver.quantity import GRID_ERROR
from study.dataset.variables import all_scalars


def grid_share(root: xr.Dataset, name: str) -> xr.DataArray:
    """Relative uncertainty of a number for the grid: of its elasticity, and of the whole nodes that the number is made of.

    NaN where either is not known. root: a dataset with `discretization_error`, whose ensembles may be means over members.
    """
    share, number = root[GRID_ERROR], all_scalars().get(name)
    if not (number and number.whole_nodes):
        return share
    nodes = root.get(number.whole_nodes, xr.DataArray(np.nan))
    squares: xr.DataArray = share**2 + nodes.astype(float) ** -2.0
    return squares**0.5
