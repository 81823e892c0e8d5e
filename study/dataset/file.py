"""The dataset as a file: its name, the attributes that say what it is, reading and writing it whole."""

from pathlib import Path
from typing import Final

import xarray as xr

from study.dataset.store import StoreError, written_whole

FILE: Final = "results.nc"
FORMAT: Final = "nanoslip_format"
VERSION: Final = 2
"""Attribute of a dataset, and its value: to be raised whenever a variable is added, renamed or given another meaning."""
CHOSEN: Final = "numerics_chosen"
"""Attribute of a dataset of a campaign that asks for an error: the numerics that it got, as JSON."""
MIXED: Final = "mixed_software"
"""Attribute of a dataset whose results are not all by the same software: names all of it, with counts."""
PENDING: Final = "pending"
"""The outcome of what is not computed yet."""


def write(dataset: xr.Dataset, path: Path) -> None:
    """Write the dataset as netCDF-4, whole or not at all. Raises StoreError."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with written_whole(path) as scratch:
            dataset.to_netcdf(scratch, engine="netcdf4", format="NETCDF4")
    except OSError as error:
        raise StoreError(f"{path}: cannot be written: {error.strerror or error}") from None


def read(path: Path) -> xr.Dataset:
    """Open a dataset; values are read when they are used, so close it (or use `with`). Raises StoreError."""
    try:
        return xr.open_dataset(path, engine="netcdf4")
    except OSError as error:
        raise StoreError(f"{path}: no dataset ({error.strerror or error}); run or collect the campaign first") from None
