"""Static and kinetic friction from nanoscale slip: a rigid curved pin on an elastic plane-strain slab.

A slab of width L_x rests on a rigid plane. Its surface carries nodes; a pin (parabola of radius R, or flat punch) is
pressed onto them with a load W and then moved sideways by δ_p. Nodes in contact stick to the pin until their shear
reaches μ_i times their pressure; then they slip until `residual` of it is left, and others may follow in a cascade.
Between such events everything is linear, so the pin moves from event to event: F(δ_p) is the friction record. Its
steady part, repeated for ever, is the friction limit of a pin that a moving stage pulls through a spring and a damper:
the spring force shows static friction, kinetic friction and stick-slip. All is dimensionless: lengths in L_x, stresses
in G, forces in G·L_x·L_y; `Scales` leads back to SI.

    from solver import Case, Slab, friction_record, plateau_of
    record = friction_record(Case(intrinsic_friction=0.5, radius=200.0, slab=Slab(n_x=129, scheme="biquadratic")))
    print(plateau_of(record).mean)

paper             module
----------------  ------------------------------------------------------------
§2.1.2            grid (the binary hierarchy), support (Figure 1)
Eq. 8-10          interpolation
Eq. 1-7, 11       schemes/ (biquadratic: the paper's stencil, galerkin: finite elements on grading's rows, half_plane)
§2.1.4            boundary_value (the mixed problem), compliance (condensation)
§2.1.1            pin, tableau, contact (first touch), sliding (events), coulomb (residual 1)
§3.2.1            plateau (steady part of a record), observables (event statistics)
§2.2.2, Eq. 13-15 profile (sawtooth, periodic extension, relaxation point)
Eq. 12, §2.2.3    dynamics/ (rk4: the paper's, exact: from crossing to crossing, rigid: the same as K → ∞)
§3.3              observables (μ_s, μ_k), regime (stick, slip or both in turn)
§3.1, Eq. 16-19   analytic (flat punch, Hertz, Cattaneo-Mindlin, sliding with coupling, stick-slip)
"""

from solver.boundary_value import NodalFields, blank, solve_mixed
from solver.case import Case, Drive, Scales, Slab, SlipRule
from solver.compliance import SurfaceCompliance, slab_compliance, surface_compliance
from solver.contact import ContactState, mirrored
from solver.dynamics import DynamicsResult
from solver.laboratory import DriveResult, contact_state, drive_result, friction_record
from solver.observables import FrictionCoefficients, event_statistics
from solver.outcome import Ending, InvalidInput, Outcome, SingularOperator, SolverError
from solver.plateau import Plateau, plateau_of
from solver.schemes import Stiffness, stiffness
from solver.sliding import FrictionRecord

__all__ = [
    "Case",
    "ContactState",
    "Drive",
    "DriveResult",
    "DynamicsResult",
    "Ending",
    "FrictionCoefficients",
    "FrictionRecord",
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
    "slab_compliance",
    "solve_mixed",
    "stiffness",
    "surface_compliance",
]
