"""Static and kinetic friction from nanoscale slip: a rigid curved pin on an elastic plane-strain slab.

A slab of width L_x rests on a rigid plane. Its surface carries nodes; a pin (parabola of radius R, or flat punch) is
pressed onto them with a load W and then moved sideways by δ_p. Nodes in contact stick to the pin until their shear
reaches μ_i times their pressure; then they slip until `residual_shear` of it is left, and others may follow in a cascade.
Between such events everything is linear, so the pin moves from event to event: F(δ_p) is the friction record. Its
steady part, extended periodically, is the friction limit of a pin that a moving stage pulls through a spring and a damper:
the spring force shows static friction, kinetic friction and stick-slip. All is dimensionless: lengths in L_x, stresses
in G, forces in G·L_x·L_y; `Scales` leads back to SI.

    from nanoslip.solver import Case, Slab, friction_record, plateau_of
    record = friction_record(Case(intrinsic_friction=0.5, radius=200.0, slab=Slab(n_x=129, scheme="biquadratic")))
    print(plateau_of(record).mean)

paper             module
----------------  ------------------------------------------------------------
§2.1.2            elasticity.grid (the binary hierarchy), elasticity.support (Figure 1)
Eq. 8-10          elasticity.lagrange
Eq. 1-7, 11       elasticity.schemes (biquadratic: the paper's stencil; galerkin: finite elements; half_plane; chain)
§2.1.4            elasticity.boundary_value (the mixed problem), elasticity.compliance (condensation)
§2.1.1            contact.pin, contact.initial (initial contact), contact.coulomb (residual_shear 1)
§3.1              contact.closed_forms (flat punch, Hertz, Cattaneo-Mindlin, sliding with coupling)
§3.2              sliding.slide (from event to event), sliding.plateau, sliding.statistics
-                 sliding.slider (contacts of one slider, summed)
-                 sliding.distributions (sizes of events: power laws, their rivals, correlations)
§2.2.2, Eq. 13-15 dynamics.friction_limit (sawtooth, periodic extension, relaxation point)
Eq. 12, §2.2.3    dynamics.integrate (rk4: the paper's; exact: from crossing to crossing; rigid: the same as K → ∞)
§3.3              dynamics.coefficients (μ_s, μ_k), dynamics.regime (stick, slip or both in turn)
Eq. 16-19         dynamics.stick_slip (closed form, and its fit)
"""

import ast
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nanoslip.solver.case import Case, Effects, Heterogeneity, Interface, SlipRule
    from nanoslip.solver.contact.state import ContactState, mirrored
    from nanoslip.solver.drive import Drive, Scales
    from nanoslip.solver.dynamics.coefficients import FrictionCoefficients
    from nanoslip.solver.dynamics.integrators import RK4, Exact
    from nanoslip.solver.dynamics.result import DynamicsResult
    from nanoslip.solver.elasticity.compliance import SurfaceCompliance, surface_compliance
    from nanoslip.solver.elasticity.grid import Stiffness
    from nanoslip.solver.elasticity.grid_scheme import NodalFields, blank, solve_mixed, stiffness
    from nanoslip.solver.elasticity.schemes import Biquadratic, Chain, Galerkin, HalfPlane
    from nanoslip.solver.outcome import Ending, InvalidInput, Outcome, SingularOperator, SolverError
    from nanoslip.solver.simulate import DriveResult, contact_state, drive_result, friction_record
    from nanoslip.solver.slab import Slab
    from nanoslip.solver.sliding.plateau import Plateau, plateau_of
    from nanoslip.solver.sliding.record import FrictionRecord
    from nanoslip.solver.sliding.statistics import event_statistics

__all__ = [
    "RK4",
    "Biquadratic",
    "Case",
    "Chain",
    "ContactState",
    "Drive",
    "DriveResult",
    "DynamicsResult",
    "Effects",
    "Ending",
    "Exact",
    "FrictionCoefficients",
    "FrictionRecord",
    "Galerkin",
    "HalfPlane",
    "Heterogeneity",
    "Interface",
    "InvalidInput",
    "NodalFields",
    "Outcome",
    "Plateau",
    "Scales",
    "SingularOperator",
    "Slab",
    "SlipRule",
    "SolverError",
    "Stiffness",
    "SurfaceCompliance",
    "blank",
    "contact_state",
    "drive_result",
    "event_statistics",
    "friction_record",
    "mirrored",
    "plateau_of",
    "solve_mixed",
    "stiffness",
    "surface_compliance",
]


def __getattr__(name: str) -> Any:
    """A public name, imported when it is first used."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(import_module(_places()[name]), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


@cache
def _places() -> dict[str, str]:
    """Public name -> its module, read off the imports above, which nothing but a type checker runs."""
    imports = (
        node for node in ast.walk(ast.parse(Path(__file__).read_text("utf-8"))) if isinstance(node, ast.ImportFrom)
    )
    return {alias.name: str(node.module) for node in imports for alias in node.names}


for _family in ("nanoslip.solver.elasticity.schemes", "nanoslip.solver.dynamics.integrators"):
    import_module(_family)  # whose members register themselves: a scheme or an integrator is chosen by its name
