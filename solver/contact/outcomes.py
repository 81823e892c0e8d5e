"""What the kernels' reasons to stop mean to a user: the one place where a `Stop` becomes an `Outcome`."""

from solver.contact.kernels.enumerations import Stop
from solver.outcome import COMPLETED, Ending, Outcome

STEEP_PIN = Outcome(
    Ending.STEEP_PIN,
    "the pin is too steep where it touches, either above 45° (between nodes too) or so steep against intrinsic_friction that an "
    "event creates energy: raise radius or intrinsic_friction, lower normal_load, or use a smoother heterogeneity.roughness",
)
"""Down a flank of slope s the pressure does the work s·N per distance, which only a shear above s·N can make a loss."""
NOT_FINITE = Outcome(
    Ending.ROUNDING,
    "a force or displacement is no longer a number: use a load, a radius and an event_floor nearer those of the paper",
)

OUTCOME_OF_STOP = {
    Stop.DONE: COMPLETED,
    Stop.FULL: COMPLETED,
    Stop.SLIP_UNBOUNDED: Outcome(
        Ending.SLIP_UNBOUNDED,
        "no slip (at residual_shear 1: no motion) satisfies the friction law here: lower intrinsic_friction, or raise n_x",
    ),
    Stop.CASCADE_LIMIT: Outcome(
        Ending.CASCADE_LIMIT,
        "one event needed more slips than slip.cascade_limit: raise it, or lower slip.residual_shear where it is above 0",
    ),
    Stop.CONTACT_LOST: Outcome(
        Ending.CONTACT_LOST,
        "no node is left that can carry the load: the pin has left the slab; lower the displacement limit",
    ),
    Stop.EDGE_REACHED: Outcome(
        Ending.EDGE_REACHED,
        "the punch's edge has come upon the next node, where a sharp edge has no answer: "
        "lower the displacement limit, or raise n_x",
    ),
    Stop.CONTACT_CYCLE: Outcome(
        Ending.CONTACT_NOT_CONVERGED,
        "nodes touch and are released in turn, no contact set satisfies the constraints: "
        "use the other initial_contact, the scheme galerkin, or another n_x",
    ),
    Stop.INACCURATE: Outcome(
        Ending.SINGULAR_OPERATOR,
        "the compliance of the nodes in contact is so ill-conditioned that forces and displacements disagree by more than "
        "1e-10: use the scheme galerkin, or an aspect_ratio nearer 1",
    ),
    Stop.OVERSHOT: Outcome(
        Ending.OVERSHOT,
        "the smallest step pushed nodes beyond μ_i·pressure by more than 1e-4 of μ_i·W: lower slip.event_floor, or, where it "
        "is small, the radius or the displacement limit",
    ),
    Stop.STEEP: STEEP_PIN,
    Stop.NOT_FINITE: NOT_FINITE,
    Stop.NO_EVENT: Outcome(
        Ending.NO_EVENT,
        "no displacement triggers an event: the contact sticks; set limits.displacement, or lower intrinsic_friction",
    ),
}
"""Outcome of every stop at which a run ends."""
OUTCOME_OF_ENDING = {outcome.ending: outcome for outcome in OUTCOME_OF_STOP.values()}
"""The same by ending, for solvers that are not compiled."""
