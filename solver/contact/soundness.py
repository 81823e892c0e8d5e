"""Decide if a contact that was found is meaningful: why kernels stopped, the pin's slope, and the limit of double precision.

Only under a small slope is shear the force along the slab, and pressure the force across it.
"""

import math
import sys
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Vector
from nanoslip.solver.case import Case, limits_shear
from nanoslip.solver.contact.kernels.events import STEEPEST
from nanoslip.solver.contact.kernels.state import Stop
from nanoslip.solver.contact.pin import make_pin, surface_from_axis, surface_from_pin
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.outcome import COMPLETED, ROUNDED, Ending, Outcome

# Meaning of the kernels' reasons to stop: the one place where a `Stop` becomes an `Outcome`.

STEEP_PIN = Outcome(
    Ending.STEEP_PIN,
    "the pin is steeper than 45° where it touches (between nodes too), or, at residual_shear = 1, than intrinsic_friction: "
    "raise radius, lower normal_load, or use a smoother heterogeneity.roughness",
)
DOWNHILL = Outcome(
    Ending.STEEP_PIN,
    "the pin is steeper where it touches than (1 + residual_shear)/2 of a node's limit over its pressure (intrinsic_friction, if "
    "slip.strength is 0), so that events create energy: use "
    "effects.pin_translation = false, which keeps pressures constant (not with changing loads or memory); or raise radius or "
    "intrinsic_friction, or lower normal_load",
)
"""Down a flank of slope s the pressure does the work s·N per distance, which only a shear above s·N can make a loss. The mean
shear of a slip is (1 + r)/2 of its limit, r = residual_shear."""
NOT_FINITE = Outcome(
    Ending.ROUNDING,
    "a force or displacement is no longer a number: use a load, a radius and an event_floor nearer those of the paper",
)

PILLAR = 100.0
"""Ratio of height to width above which a slab sways under the pin so far that it bends away from under it. Of 64 contacts
of 300 to 10000 widths half were steep or slipped without end; all the same ones of 10 widths were computed."""
_OF_PILLARS = (Ending.STEEP_PIN, Ending.SLIP_UNBOUNDED, Ending.CONTACT_NOT_CONVERGED, Ending.OVERSHOT)

NEARLY_INCOMPRESSIBLE = 0.49
"""ν above which a node that slips shears its neighbours about as much as it gives way: slips without friction grow in number,
3e5 at 0.49, 8e6 at 0.499 and 8e7 at 0.4999 (n_x = 65, R/L_x = 200)."""

OUTCOME_OF_STOP = {
    Stop.DONE: COMPLETED,
    Stop.FULL: COMPLETED,
    Stop.SLIP_UNBOUNDED: Outcome(
        Ending.SLIP_UNBOUNDED,
        "no slip (at residual_shear 1: no motion) satisfies the friction law here: lower intrinsic_friction, or raise n_x; "
        "or intrinsic_friction = inf, with residual_shear below 1, for a contact that never slips",
    ),
    Stop.CASCADE_LIMIT: Outcome(Ending.CASCADE_LIMIT, "one event needed more slips than slip.cascade_limit: raise it"),
    Stop.CONTACT_LOST: Outcome(
        Ending.CONTACT_LOST,
        "no node is left that can carry the load: the pin has left the slab; lower the record's limits",
    ),
    Stop.EDGE_REACHED: Outcome(
        Ending.EDGE_REACHED,
        "the punch's edge has come upon the next node, where a sharp edge has no answer: "
        "lower the record's limits, or raise n_x",
    ),
    Stop.CONTACT_CYCLE: Outcome(
        Ending.CONTACT_NOT_CONVERGED,
        "nodes touch and are released in turn, no contact set satisfies the constraints: "
        "use another initial_contact, or another n_x",
    ),
    Stop.INACCURATE: Outcome(
        Ending.SINGULAR_OPERATOR,
        "the compliance of the nodes in contact is so ill-conditioned that forces and displacements disagree by more than "
        "1e-10: use an aspect_ratio nearer 1",
    ),
    Stop.OVERSHOT: Outcome(
        Ending.OVERSHOT,
        "the smallest step pushed nodes beyond their limits by more than 1e-4 of all these: lower slip.event_floor, or, where it "
        "is small, the radius or the record's limits",
    ),
    Stop.DOWNHILL: DOWNHILL,
    Stop.STEEP: STEEP_PIN,
    Stop.NOT_FINITE: NOT_FINITE,
    Stop.NO_EVENT: Outcome(
        Ending.NO_EVENT,
        "no displacement triggers an event: the contact sticks; set limits.displacement, or lower intrinsic_friction",
    ),
}
"""Outcome of every stop at which a run ends."""


NOTHING_UNDER_PUNCH: Final = Outcome(Ending.CONTACT_LOST, "no node lies under the punch: raise half_width, or n_x")


def advise(case: Case, outcome: Outcome) -> Outcome:
    """The outcome of a case's run, with advice for this case added to the general advice."""
    # A punch that is narrower than the distance between nodes passes between two of them: it has not left the slab.
    is_narrow = case.pin == "flat_punch" and 2.0 * case.half_width < case.slab.spacing
    if outcome == OUTCOME_OF_STOP[Stop.CONTACT_LOST] and is_narrow:
        return NOTHING_UNDER_PUNCH
    if outcome.message == OUTCOME_OF_STOP[Stop.CASCADE_LIMIT].message:
        return replace(outcome, message=_cascade_advice(case, outcome.message))
    with_others = outcome in (OUTCOME_OF_STOP[Stop.CONTACT_CYCLE], OUTCOME_OF_STOP[Stop.INACCURATE])
    if with_others and not case.slab.scheme.reciprocal:
        return replace(outcome, message=f"{outcome.message}, or the scheme galerkin")
    return outcome


def energy_created(case: Case) -> Outcome:
    """The outcome of a record whose events created energy, with the causes that the case may have and what to do about each."""
    causes = []
    if case.slip_rule.slip_order != "worst_first":
        causes.append('slips of many nodes at once overshoot: use slip.slip_order = "worst_first"')
    if not case.slab.scheme.reciprocal:
        causes.append("the operator is not an elastic body's: use the scheme galerkin")
    if case.heterogeneity.roughness:
        causes.append("the pin is rougher than its nodes can follow: use a smoother heterogeneity.roughness")
    if not causes:
        causes.append(
            "use a poisson further from 0.5, an aspect_ratio nearer 1, another n_x, or a lower slip.event_floor"
        )
    return Outcome(
        Ending.ENERGY_CREATED, f"events created energy, more than a millionth of the work: {'; or '.join(causes)}"
    )


def advise_on_pillars(case: Case, outcome: Outcome) -> Outcome:
    """The outcome, of a slab that may sway with the advice to lower it, unless that is the advice against rounding, too."""
    if outcome.ending in _OF_PILLARS and case.slab.aspect_ratio > PILLAR and outcome.cause != ROUNDED:
        return replace(outcome, message=f"{outcome.message}, or use an aspect_ratio nearer 1")
    return outcome


def _cascade_advice(case: Case, message: str) -> str:
    """Advice against endless slips. Without friction they continue until no shear is left, which takes forever on a nearly
    incompressible slab at any limit."""
    rule, others = case.slip_rule, []
    if 0.0 < rule.residual_shear < 1.0:
        others.append("lower slip.residual_shear")
    if not limits_shear(case) and case.initial_contact != "frictionless":
        others.append('use initial_contact = "frictionless", the contact of a pin without friction')
    if case.intrinsic_friction > 1.0:
        others.append("lower intrinsic_friction")
    if case.slab.poisson > NEARLY_INCOMPRESSIBLE:
        others.append("lower poisson")
    return ", or ".join((message, *others))


COARSEST_HEIGHTS = 1e-4
"""Rounding of the pin's heights, as a share of what the load displaces, beyond which it decides: measured,
forces change by 1.4 times that share of the load when every height changes by a rounding."""


def soundness(
    case: Case, softness: Vector, contact: NDArray[np.bool_], u: Vector, displacement: float, first_node: int = 0
) -> Outcome:
    """COMPLETED where a contact of these nodes, (n,), with displacements u (n,) means something, else why not.

    softness: how far each node gives way under a unit force on itself alone, (n,).
    """
    xi = surface_from_pin(case, first_node) + u - displacement
    outermost = float(surface_from_axis(case, u - displacement, first_node)[contact].max(initial=0.0))
    if not math.isfinite(outermost):
        return NOT_FINITE
    share = rounding_share(case, softness, contact, outermost)
    if not share <= COARSEST_HEIGHTS:
        # Would the heights be known well enough where the nodes came down? Then it is the way that spoils them.
        at_rest = float(surface_from_axis(case, np.zeros_like(u), first_node)[contact].max())
        pressed = rounding_share(case, softness, contact, at_rest) <= COARSEST_HEIGHTS
        return _heights_unknown(share, "carried" if pressed else "heights")
    return COMPLETED if _steepest(case, contact, xi, outermost) <= STEEPEST else STEEP_PIN


_ADVICE: Final = {
    "carried": "nodes are carried so far along the pin: lower intrinsic_friction, or the record's limits",
    "heights": "raise normal_load, or use a larger radius or lower heights in heterogeneity.roughness",
    "missed": "use a smoother heterogeneity.roughness",
}
"""Cause of unknown heights -> what to do about it."""


def _heights_unknown(share: float, cause: str) -> Outcome:
    """The outcome of a contact whose heights are known to this share of what the load displaces."""
    sentence = f"heights of the pin are known to {share:.0e} of what the load displaces"
    return Outcome(Ending.ROUNDING, f"{sentence}, {COARSEST_HEIGHTS:g} is needed: {_ADVICE[cause]}", cause=cause)


def accuracy_of_heights(case: Case, softness: Vector, state: ContactState) -> Outcome:
    """COMPLETED if nodes in contact lie on the pin, else ROUNDING: over a spike the rounding of a node's place is a height.

    Both to COARSEST_HEIGHTS of what the load would displace a node. softness: as of `soundness`.
    """
    if not state.contact.any():
        return COMPLETED
    xi = surface_from_pin(case, state.first_node) + state.u - state.displacement
    lift = make_pin(case).unbounded_height(xi) - state.w - state.approach
    missed = np.abs(lift[state.contact]).max()
    softest = float(np.abs(softness[state.contact]).max())
    share = float(missed) / (case.normal_load * softest)
    return COMPLETED if share <= COARSEST_HEIGHTS else _heights_unknown(share, "missed")


def _steepest(case: Case, contact: NDArray[np.bool_], xi: Vector, outermost: float) -> float:
    """Largest |slope| of the pin under a contact of nodes at ξ, (n,): at each node, and at each height between the outermost two
    of a row. No node stands on a wall between two nodes, yet the pin drags it over them."""
    pin, rows = make_pin(case), case.slab.rows
    if not pin.rough or not contact.any():  # a smooth pin is steepest at the outermost
        return pin.curvature * outermost
    touching = contact.reshape(-1, rows)
    largest = [np.abs(pin.slope(xi)[contact]).max(), steepest_across(case, contact, xi)]
    for row in np.flatnonzero(touching.any(axis=0)):
        places = xi[row::rows][touching[:, row]]
        left, right = places.min(keepdims=True), places.max(keepdims=True)
        largest.append(pin.steepest(left, right, int(row)))
    return float(max(largest))


def steepest_across(case: Case, contact: NDArray[np.bool_], xi: Vector) -> float:
    """Largest |slope| of the pin across the drag under a contact of nodes at ξ, (n,); 0 in plane strain.

    Slopes between neighbouring rows of nodes, anywhere between the outermost nodes of both: the pin drags each row
    over different heights.
    """
    pin, rows = make_pin(case), case.slab.rows
    touching, places = contact.reshape(-1, rows), xi.reshape(-1, rows)
    # A row without contact reaches from ∞ to -∞: it has nothing in common with its neighbours.
    first = np.where(touching, places, np.inf).min(0)
    last = np.where(touching, places, -np.inf).max(0)
    left = np.maximum(first[1:], first[:-1])
    right = np.minimum(last[1:], last[:-1])
    rises = np.broadcast_to(pin.rises, (rows, len(pin.knots)))
    heights = np.broadcast_to(pin.across, len(xi))
    largest = 0.0
    for row in np.flatnonzero(left <= right):
        inside = pin.knots[(pin.knots > left[row]) & (pin.knots < right[row])]
        between = np.concatenate((left[row : row + 1], inside, right[row : row + 1]))
        one = np.interp(between, pin.knots, rises[row]) + heights[row]
        other = np.interp(between, pin.knots, rises[row + 1]) + heights[row + 1]
        steepest = float(np.abs(other - one).max()) / case.slab.spacing
        largest = max(largest, steepest)
    return largest


def rounding_share(case: Case, softness: Vector, contact: NDArray[np.bool_], outermost: float) -> float:
    """Rounding of the pin's heights up to |ξ| = outermost, of the nodes of `contact`, over what the load would displace one of
    them; 0 without contact.

    A rough pin's height is a sum of larger ones, parabola and profile, and any point of the profile may be the next to touch.
    """
    if not contact.any():
        return 0.0
    pin = make_pin(case)
    highest = pin.curvature * (outermost * outermost) / 2 + float(np.abs(pin.rises).max())
    displaced = case.normal_load * float(np.abs(softness[contact]).max())
    return sys.float_info.epsilon * highest / displaced
