"""Compliances whose entries are rounded otherwise: what another processor, library or order of sums would make of them."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, Final

import numpy as np
import pytest

from nanoslip.solver.arrays import Dense, Vector
from nanoslip.solver.elasticity.compliance import SurfaceCompliance
from nanoslip.solver.elasticity.schemes.endless import Convolution, EndlessScheme, SurfaceConvolution
from nanoslip.solver.elasticity.schemes.planar import PlaneConvolution
from nanoslip.solver.slab import SCHEMES, Slab

UNIT: Final = 2e-16
"""Relative standard deviation of an entry: about the distance of two floats, so that most entries move by one or none."""


def blurred(matrix: Dense, seed: int = 0) -> Dense:
    """A matrix whose entries are rounded otherwise, read-only; a symmetric one stays symmetric."""
    found = matrix * (1.0 + UNIT * np.random.default_rng(seed).standard_normal(matrix.shape))
    if np.array_equal(matrix, matrix.T):
        found = (found + found.T) / 2.0
    found.setflags(write=False)
    return found


def blurred_compliance(compliance: SurfaceCompliance, seed: int = 0) -> SurfaceCompliance:
    """A compliance whose entries are rounded otherwise."""
    return SurfaceCompliance(blurred(compliance.matrix, seed), compliance.slab)


def blurred_convolution(convolution: SurfaceConvolution, seed: int = 0) -> SurfaceConvolution:
    """A compliance of nodes that are all alike, as `blurred`; of nodes in a row, alike at one offset however many there are."""
    if isinstance(convolution, Convolution):
        halves = dict[str, Vector]()
        for number, name in enumerate(("along_x", "along_z", "across")):
            half = getattr(convolution, name)
            halves[name] = half * (1.0 + UNIT * np.random.default_rng((seed, number)).standard_normal(half.shape))
        return replace(convolution, **halves)
    assert isinstance(convolution, PlaneConvolution)
    noise = np.random.default_rng(seed).standard_normal(convolution.by_offset.shape[2:])
    even = noise + noise[::-1] + noise[:, ::-1] + noise[::-1, ::-1]  # its terms have as many signs as the table
    return PlaneConvolution(convolution.by_offset * (1.0 + UNIT * even / 2.0))


@contextmanager
def rounding_otherwise() -> Iterator[None]:
    """While entered, every scheme's compliance is rounded otherwise, each slab's always in the same way."""
    with pytest.MonkeyPatch.context() as patch:
        for kind in {kind for scheme in SCHEMES.values() for kind in scheme.__mro__}:
            if "matrix" in vars(kind) and not issubclass(kind, EndlessScheme):
                patch.setattr(kind, "matrix", _rounded(vars(kind)["matrix"], blurred))
            if "convolution" in vars(kind) and not getattr(vars(kind)["convolution"], "__isabstractmethod__", False):
                patch.setattr(kind, "convolution", _rounded(vars(kind)["convolution"], blurred_convolution))
        yield


def _rounded(method: Callable[[Any, Slab], Any], rounding: Callable[[Any], Any]) -> Callable[[Any, Slab], Any]:
    return lambda scheme, slab: rounding(method(scheme, slab))
