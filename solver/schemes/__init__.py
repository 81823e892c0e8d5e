"""Discretizations of the elastic slab, one per file, behind one door: a slab's grid, material and support -> stiffness."""

from solver.case import Slab
from solver.grid import binary_hierarchy
from solver.schemes.biquadratic import biquadratic
from solver.schemes.stiffness import Stiffness

SCHEMES = {"biquadratic": biquadratic}

__all__ = ["SCHEMES", "Stiffness", "stiffness"]


def stiffness(slab: Slab) -> Stiffness:
    """The matrices of Eq. 11 for `slab`, by the scheme that it names."""
    return SCHEMES[slab.scheme](binary_hierarchy(slab), slab.poisson, slab.support)
