"""Texts of a variable as netCDF keeps them: characters along one dimension more, made and read a piece at a time.

Of millions of texts few are different, while each takes as many characters as the longest one.
"""

import itertools
from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

_DIFFERENT: Final = 4096
"""Texts that are remembered while others are read: where there are more, most are there once."""


def are_texts(variable: xr.Variable) -> bool:
    """Whether the values of a variable are texts."""
    return variable.dtype.kind in "OUT"


def longest(texts: NDArray[Any]) -> int:
    """Bytes of the longest one; 1 where all are empty, as a dimension has a length."""
    return max(1, max(map(len, map(str.encode, texts.flat)), default=0))


def characters(texts: NDArray[Any], letters: slice) -> NDArray[np.bytes_]:
    """These bytes of every text, in one dimension more."""
    count = letters.stop - letters.start
    found = np.fromiter((text.encode()[letters] for text in texts.flat), f"S{count}", texts.size)
    return found.view("S1").reshape(*texts.shape, count)


def read_texts(variable: xr.Variable) -> NDArray[Any]:
    """The texts of a variable whose values are still in its file: equal ones are one object."""
    found = np.empty(variable.shape, object)
    known: dict[str, str] = {}
    for block in blocks(variable.shape, variable.encoding.get("chunksizes") or variable.shape):
        piece = variable[block].values
        shared = np.fromiter((known.setdefault(text, text) for text in piece.flat), object, piece.size)
        place: Any = (*block, ...)  # the dots: a single text is an array, too
        found[place] = shared.reshape(piece.shape)
        if len(known) > _DIFFERENT:
            known.clear()
    return found


def blocks(shape: Sequence[int], chunks: Sequence[int]) -> Iterator[tuple[slice, ...]]:
    """Where each chunk lies in an array of this shape. Chunks may have more dimensions than it."""
    return itertools.product(*map(_cuts, shape, chunks))


def _cuts(length: int, chunk: int) -> list[slice]:
    return [slice(begin, min(begin + chunk, length)) for begin in range(0, length, max(chunk, 1))]
