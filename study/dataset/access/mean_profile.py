"""Drives computed on the mean friction profile, as a tolerance allows: their regime may differ from that over the sawtooth."""

import re
from typing import Final

import numpy as np
import xarray as xr

from study.dataset.variables import DRIVE, LEFT_OUT

REGIME: Final = "regime"
SIGN: Final = "*"
"""Beside a regime of the mean profile, in tables and figures."""
EXPLAINED: Final = "regime on the mean profile, as the teeth were left out"
_TEETH: Final = np.vectorize(lambda text: bool(re.search(r"\bteeth\b", text)), otypes=[bool])
"""Whether a text names the teeth, not `fine_teeth` alone: coarse ones stop a pin where it would stop."""


def on_mean_profile(dataset: xr.Dataset) -> xr.DataArray:
    """Where the teeth were left out of a drive, of an ensemble's of any member; False without dimensions where nothing was."""
    name = LEFT_OUT[DRIVE].name
    if name not in dataset:
        return xr.DataArray(False)
    texts = dataset[name]
    return xr.DataArray(_TEETH(texts.values.astype(str)), dims=texts.dims)


def starred(dataset: xr.Dataset) -> list[str]:
    """The regime of every drive that has one, with a sign where it is that of the mean profile."""
    regimes = dataset[REGIME]
    signed = xr.zeros_like(regimes, dtype=bool) | on_mean_profile(dataset)
    pairs = zip(regimes.values.ravel().tolist(), signed.values.ravel().tolist(), strict=True)
    return [f"{word}{SIGN if sign else ''}" for word, sign in pairs if word]


def footnote(dataset: xr.Dataset) -> str:
    """What the sign means; empty where no regime has it."""
    signed = on_mean_profile(dataset)
    if REGIME not in dataset or not signed.any():
        return ""
    of = f" ({int(signed.sum())} of {signed.size} drives)" if signed.size > 1 else ""
    return f"{SIGN}: {EXPLAINED}{of}"
