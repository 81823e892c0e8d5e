"""Drives computed on the mean friction profile or over coarse teeth, as a tolerance allows: their regime may be another one."""

import re
from typing import Final

import numpy as np
import xarray as xr

from study.dataset.variables import DRIVE, LEFT_OUT

REGIME: Final = "regime"
SIGN: Final = "*"
"""Beside a regime with fewer teeth than the record has, in tables and figures."""
EXPLAINED: Final = "regime with teeth or fine_teeth left out, all teeth may give another"
_TEETH: Final = np.vectorize(lambda text: bool(re.search(r"\b(fine_)?teeth\b", text)), otypes=[bool])
"""Whether a text names the teeth or fine ones: whether a pin locks in, sticks or slides on depends on each of them."""


def with_fewer_teeth(dataset: xr.Dataset) -> xr.DataArray:
    """Where teeth, or fine ones, were left out of a drive or of any member of an ensemble; False without dimensions where
    nothing was."""
    name = LEFT_OUT[DRIVE].name
    if name not in dataset:
        return xr.DataArray(False)
    texts = dataset[name]
    return xr.DataArray(_TEETH(texts.values.astype(str)), dims=texts.dims)


def starred(dataset: xr.Dataset) -> list[str]:
    """The regime of every drive that has one, with a sign where teeth were left out."""
    regimes = dataset[REGIME]
    signed = xr.zeros_like(regimes, dtype=bool) | with_fewer_teeth(dataset)
    pairs = zip(regimes.values.ravel().tolist(), signed.values.ravel().tolist(), strict=True)
    return [f"{word}{SIGN if sign else ''}" for word, sign in pairs if word]


def footnote(dataset: xr.Dataset) -> str:
    """What the sign means; empty where no regime has it."""
    signed = with_fewer_teeth(dataset)
    if REGIME not in dataset or not signed.any():
        return ""
    of = f" ({int(signed.sum())} of {signed.size} drives)" if signed.size > 1 else ""
    return f"{SIGN}: {EXPLAINED}{of}"
