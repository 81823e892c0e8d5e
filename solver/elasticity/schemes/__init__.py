"""Discretizations of the elastic slab, one per file, behind two doors.

`stiffness`: the schemes that have a grid, from its grid, material and support. `half_plane`: closed form, the surface's
compliance straight away. `solver.elasticity.compliance.slab_compliance` takes any of them.
"""

from solver.case import Slab
from solver.elasticity.grading import graded_hierarchy
from solver.elasticity.grid import binary_hierarchy
from solver.elasticity.schemes.biquadratic import biquadratic
from solver.elasticity.schemes.galerkin import galerkin
from solver.elasticity.schemes.half_plane import half_plane
from solver.elasticity.schemes.stiffness import Stiffness
from solver.outcome import InvalidInput

SCHEMES = {"biquadratic": (binary_hierarchy, biquadratic), "galerkin": (graded_hierarchy, galerkin)}
"""Scheme with a grid -> how its grid and its stiffness are made."""

__all__ = ["SCHEMES", "Stiffness", "half_plane", "stiffness"]


def stiffness(slab: Slab) -> Stiffness:
    """The matrices of Eq. 11 for `slab`, by the scheme that it names. Raises InvalidInput where that has no grid."""
    if slab.scheme not in SCHEMES:
        raise InvalidInput(f"scheme = {slab.scheme!r}: needs one that has a grid: {', '.join(SCHEMES)}")
    grid_of, scheme = SCHEMES[slab.scheme]
    return scheme(grid_of(slab), slab.poisson, slab.support)
