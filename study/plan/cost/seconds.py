"""Seconds of each kind of computation, to a factor of three: its steps, counted, times their rates."""

import math
from collections.abc import Sequence

from nanoslip.solver.case import Case
from nanoslip.solver.contact.convolved import needs_no_matrix
from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.stick_slip import MOST_SAMPLES, MOST_SLIPS
from nanoslip.solver.slab import Slab
from nanoslip.study.plan.cost import rates
from nanoslip.study.plan.cost.counts import (
    contact_nodes,
    coulomb_steps,
    events_of,
    grid_nodes,
    hertz_nodes,
    lateral_stiffness,
    pulled,
    slips_of,
    tableau_entries,
    teeth_of,
    touches_in_spots,
    without_shear,
)


def compliance_seconds(case: Case, slides: bool) -> float:
    """Seconds of the compliance of a case's slab; none where nothing reads its matrix."""
    return 0.0 if needs_no_matrix(case) and not slides else condensation_seconds(case.slab)


def condensation_seconds(slab: Slab) -> float:
    """Seconds of `surface_compliance`."""
    return rates.NODE * grid_nodes(slab) + rates.ENTRY * slab.n_x**2


def touch_seconds(case: Case) -> float:
    """Seconds of initial contact that nothing follows."""
    if not needs_no_matrix(case):
        return contact_seconds(case)
    n_x = case.slab.n_x
    rounds = 0.5 * math.cbrt(n_x) if touches_in_spots(case) else 1.0  # conjugate gradients, over those of one spot
    return rates.CONTACT + rates.CONVOLUTION * n_x * math.log2(n_x) * rounds


def contact_seconds(case: Case) -> float:
    """Seconds of initial contact, found from the matrix of the slab's compliance."""
    nodes = math.sqrt(hertz_nodes(case) * contact_nodes(case))
    unknowns = nodes if without_shear(case) else 2.0 * nodes
    updates = nodes if case.slip_rule.residual_shear == 1.0 else 0.0  # nodes come to slide one by one
    return _solution_seconds(unknowns) + rates.ENTRY * (unknowns**2 + updates * nodes**2)


def record_seconds(case: Case) -> float:
    """Seconds of a case's friction record, initial contact included."""
    return contact_seconds(case) + _slide_seconds(case, events_of(case))


def statistics_seconds() -> float:
    """Seconds of the distributions of the sizes of a record's events."""
    return rates.STATISTICS


def states_seconds(case: Case, events: Sequence[int], subsurface: bool) -> float:
    """Seconds of the contacts after some events of a record, and of the inside of the slab there."""
    last = min(float(max(events, default=0)), events_of(case))
    inside = len(events) * rates.NODE * grid_nodes(case.slab) if subsurface else 0.0
    return inside + (contact_seconds(case) + _slide_seconds(case, last) if last else touch_seconds(case))


def drive_seconds(drive: Drive, case: Case, fitted: bool = True) -> float:
    """Seconds of motion and fit. A drive that ends after some slips is followed twice: to spread its samples over that."""
    way, slips = pulled(drive, case)
    passes = 1.0 if drive.max_slips is None else 2.0
    fit = rates.FIT * min(drive.samples, MOST_SAMPLES) * slips if fitted and slips < MOST_SLIPS else 0.0
    return rates.STEP * drive.samples + passes * _motion_seconds(drive, case, way) + fit


def _slide_seconds(case: Case, events: float) -> float:
    if case.slip_rule.residual_shear == 1.0:
        return coulomb_steps(case, events) * _solution_seconds(2.0 * contact_nodes(case))
    row = tableau_entries(case) if case.effects.pin_translation else contact_nodes(case)
    return rates.ENTRY * row**2 + rates.SLIP * row * slips_of(case, events) + rates.EVENT * events


def _solution_seconds(unknowns: float) -> float:
    return rates.CONTACT + rates.SOLVE * unknowns**3


def _motion_seconds(drive: Drive, case: Case, way: float) -> float:
    teeth = teeth_of(drive, case, way)
    step: float | None = getattr(drive.integrator, "time_step", None)
    if step is not None:
        steps = drive.duration / step
        looks = 1.0 + math.log2(1.0 + teeth / steps)  # for the tooth that a step ends on
        return rates.STEP * steps * looks if steps <= drive.step_limit else 0.0  # else refused
    yields = teeth and drive.surface_compliance
    ringing = rates.RINGING * math.sqrt(lateral_stiffness(case)) * way / drive.stage_velocity if yields else 0.0
    return rates.STEP * min(teeth, drive.step_limit) + ringing
