"""A tree of datasets as a netCDF-4 file, one variable after the other, with the attributes that xarray gives them.

xarray itself would make the characters of all texts before it writes the first.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import netCDF4
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.study.dataset.texts import are_texts, blocks, characters, longest

SMALLEST_COMPRESSED: Final = 512
"""Values from which a variable is compressed: below, the chunks that it then has take more than they save."""
_COMPRESSED: Final = {"zlib": True, "complevel": 1, "shuffle": True}
"""Level 9 saves 1 % more than level 1 (measured in README.md)."""


def write_tree(tree: xr.DataTree, path: Path) -> None:
    """Write the file. Raises OSError, RuntimeError where the disk refuses."""
    with netCDF4.Dataset(path, "w", format="NETCDF4") as file:
        for node in tree.subtree:
            _write_group(node.to_dataset(inherit=False), file.createGroup(node.path) if node.path != "/" else file)


def _write_group(dataset: xr.Dataset, group: netCDF4.Dataset) -> None:
    variables, attributes = xr.conventions.encode_dataset_coordinates(dataset)
    group.setncatts(attributes)
    for name, variable in variables.items():
        # Coordinates have no missing values (CF 2.5.1).
        variable.encoding = {"_FillValue": None} if name in dataset.coords else {}
        (_write_texts if are_texts(variable) else _write_numbers)(name, variable, group)


def _write_texts(name: str, variable: xr.Variable, group: netCDF4.Dataset) -> None:
    """Texts as characters: netCDF 4.10 breaks down where a file with strings in groups is open twice and closed once."""
    texts: NDArray[Any] = np.asarray(variable.values)
    length = longest(texts)
    target = _declare(name, "S1", {**variable.sizes, f"string{length}": length}, group, texts.size)
    target.setncatts({**variable.attrs, "_Encoding": "utf-8"})
    for *block, letters in _chunks(target):
        piece: Any = (*block, ...)  # the dots: a single text is an array, too
        target[*block, letters] = characters(texts[piece], letters)
        _let_go(target)


def _write_numbers(name: str, variable: xr.Variable, group: netCDF4.Dataset) -> None:
    encoded = xr.conventions.encode_cf_variable(variable, name=name)
    missing = encoded.attrs.pop("_FillValue", None)
    target = _declare(name, encoded.dtype, encoded.sizes, group, encoded.size, missing)
    target.setncatts(encoded.attrs)
    target.set_auto_maskandscale(False)  # they are what is to be written
    for block in _chunks(target):
        target[block] = encoded.values[block]
        _let_go(target)


def _declare(
    name: str, kind: Any, sizes: Mapping[Any, int], group: netCDF4.Dataset, values: int, missing: Any = None
) -> "netCDF4.Variable[Any]":
    """A variable of this type along these dimensions. values: how many. missing: what stands for none."""
    for dimension, size in sizes.items():
        if not _has(group, dimension):
            group.createDimension(dimension, size)
    compressed: Any = _COMPRESSED if values >= SMALLEST_COMPRESSED else {}
    return group.createVariable(name, kind, tuple(sizes), fill_value=missing, **compressed)


def _has(group: netCDF4.Dataset | None, dimension: str) -> bool:
    """Whether a group has a dimension, or one that it is in."""
    return group is not None and (dimension in group.dimensions or _has(group.parent, dimension))


def _chunks(target: "netCDF4.Variable[Any]") -> Iterator[tuple[slice, ...]]:
    """Where each chunk of a variable lies: written whole, it is compressed once. One of small variables."""
    found = target.chunking()
    return blocks(target.shape, target.shape if isinstance(found, str) else found)


def _let_go(target: "netCDF4.Variable[Any]") -> None:
    """Have what was written of a variable leave the memory: else chunks of all variables stay until the file is closed."""
    if target.chunking() != "contiguous":
        target.set_var_chunk_cache(size=0)
