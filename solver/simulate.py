"""One call each from a case to what it yields: its contact state, its friction record, and what a drive makes of it."""

from dataclasses import dataclass

from solver.case import Case
from solver.contact.initial import initial_contact
from solver.contact.state import ContactState
from solver.drive import Drive
from solver.dynamics.coefficients import FrictionCoefficients, friction_coefficients
from solver.dynamics.friction_limit import friction_limit_of
from solver.dynamics.integrate import DynamicsResult, integrate
from solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from solver.sliding.events import slide
from solver.sliding.plateau import Plateau, plateau_of
from solver.sliding.record import FrictionRecord


@dataclass(frozen=True, slots=True)
class DriveResult:
    """A driven pin: the record it slides over and its plateau, the motion, and the friction coefficients read off it."""

    record: FrictionRecord
    plateau: Plateau
    motion: DynamicsResult
    coefficients: FrictionCoefficients


def contact_state(case: Case, compliance: SurfaceCompliance | None = None) -> ContactState:
    """The contact of `case` at initial contact. A compliance at hand is used, else computed from the case's slab."""
    return initial_contact(case, compliance or surface_compliance(case.slab))


def friction_record(case: Case, compliance: SurfaceCompliance | None = None) -> FrictionRecord:
    """The friction record of `case`, from initial contact to its limits."""
    return slide(case, compliance or surface_compliance(case.slab))


def drive_result(case: Case, drive: Drive, record: FrictionRecord | None = None) -> DriveResult:
    """The pin of `case` pulled as `drive` says over its friction record (computed if not at hand).

    Raises NoPlateauError where the record has no steady part that could be continued.
    """
    record = record or friction_record(case)
    plateau = plateau_of(record)
    motion = integrate(friction_limit_of(record, plateau, drive.profile), drive, record.initial_stiffness)
    return DriveResult(record, plateau, motion, friction_coefficients(motion, record, plateau))
