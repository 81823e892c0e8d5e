"""Discretizations of the elastic slab, one per file: their settings, and the stiffness or compliance that follows.

A file that defines a scheme registers it; importing this folder makes all of them known.
"""

from nanoslip.solver.elasticity.schemes.biquadratic import Biquadratic
from nanoslip.solver.elasticity.schemes.chain import Chain
from nanoslip.solver.elasticity.schemes.galerkin import Galerkin
from nanoslip.solver.elasticity.schemes.half_plane import HalfPlane
from nanoslip.solver.elasticity.schemes.half_space import HalfSpace
from nanoslip.solver.elasticity.schemes.layer import Layer
from nanoslip.solver.elasticity.schemes.strip import Strip

__all__ = ["Biquadratic", "Chain", "Galerkin", "HalfPlane", "HalfSpace", "Layer", "Strip"]
