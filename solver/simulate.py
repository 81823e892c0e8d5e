"""One function each for the results of a case: its contact state, its friction record, and the motion of its driven pin."""

import math
import warnings
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from nanoslip.solver.case import Case
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.drive import Drive, Scales
from nanoslip.solver.dynamics.coefficients import FrictionCoefficients
from nanoslip.solver.dynamics.duration import measure_motion
from nanoslip.solver.dynamics.integrators import Pull, disproportion
from nanoslip.solver.dynamics.result import DynamicsResult
from nanoslip.solver.elasticity.compliance import Compliance, surface_compliance
from nanoslip.solver.outcome import Outcome
from nanoslip.solver.parameter import require
from nanoslip.solver.sliding.path import Path, follow
from nanoslip.solver.sliding.plateau import Plateau, plateau_of
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.slide import slide
from nanoslip.solver.sliding.slider import interface
from nanoslip.solver.view import Curve, Labelled, Picture, Viewed, as_dataset, label_numbers

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, slots=True, repr=False)
class DriveResult(Viewed):
    """A driven pin: the record it slides over and its plateau, the motion, and the friction coefficients read off it."""

    record: FrictionRecord
    plateau: Plateau
    motion: DynamicsResult
    coefficients: FrictionCoefficients

    @property
    def outcome(self) -> Outcome:
        """Outcome of the drive, or the reason why it has no coefficients."""
        return self.coefficients.outcome

    def to_xarray(self, scales: Scales | None = None, pin_mass: float = 0.5) -> "xr.Dataset":
        """The motion over `sample`, its slips over `slip_phase`, coefficients and plateau, as a campaign's dataset names them.

        scales, pin_mass (kg): lead to m, s and m/s, as in that dataset. Without scales the numbers are in the solver's units, as
        `long_name` states.
        """
        units = scales.units(pin_mass) if scales else {}
        return as_dataset(self._label_values(), self._factors() | units, self.outcome)

    def _facts(self) -> Iterable[str]:
        *numbers, ended = self.coefficients._facts()
        return *numbers, f"{len(self.motion.slip_time)} slips", ended

    def _label_values(self) -> Iterator[Labelled]:
        return chain(
            label_numbers(self.motion), label_numbers(self.coefficients), label_numbers(self.plateau, Plateau.PREFIX)
        )

    def _factors(self) -> dict[str, float]:
        return {"normal_load": 1.0 / self.record.normal_load}

    def _picture(self) -> Picture:
        """Plot of forces over time, with static and kinetic friction if known."""
        picture, end = self.motion.picture(self.record.normal_load), self.motion.end_time
        levels = {"μ_s": self.coefficients.static_friction, "μ_k": self.coefficients.kinetic_friction}
        finite_levels = {name: level for name, level in levels.items() if math.isfinite(level)}
        ends = np.array([0.0, end])
        lines = (Curve(ends, np.full(2, level), name, "--") for name, level in finite_levels.items())
        return picture._replace(curves=(*picture.curves, *lines))


def _require_case(case: object) -> None:
    """Raise InvalidInput unless the argument is a case."""
    require("case", case, isinstance(case, Case), "a Case, as Case(radius=50); nanoslip.run takes a campaign as a dict")


def contact_state(case: Case, compliance: Compliance | None = None) -> ContactState:
    """The contact of `case` at initial contact. A compliance at hand is used, else computed from the case's slab."""
    _require_case(case)
    return initial_contact(case, compliance or surface_compliance(case.slab))


def friction_record(case: Case, compliance: Compliance | None = None) -> FrictionRecord:
    """The friction record of `case`, from initial contact to its limits; for several contacts, the sum of their
    records.

    A case without limits ends after 2000 events, as in the paper. A campaign's records without limits
    are eight presliding lengths long instead: `Case(max_events=100_000, max_presliding=8.0)`. Raises SolverError if
    any contact fails, as there is no sum then.
    """
    _require_case(case)
    compliance = compliance or surface_compliance(case.slab)
    return interface(case, compliance).record if case.interface.contacts > 1 else slide(case, compliance)


def friction_path(case: Case, compliance: Compliance | None = None) -> Path:
    """The contact of `case` along its path, leg by leg: `Case(path=LoadPath(amplitude=0.5))`."""
    _require_case(case)
    return follow(case, compliance or surface_compliance(case.slab))


def drive_result(case: Case, drive: Drive, record: FrictionRecord | None = None) -> DriveResult:
    """Pull the pin of `case` by `drive` over its friction record, which is computed if missing.

    Raises NoPlateauError if the record has no steady part to continue. Warns of a drive out of all proportion to the contact, for
    example with values in SI; `Drive.from_si` takes those.
    """
    record = record or friction_record(case)
    plateau = plateau_of(record)
    if wrong := disproportion(drive, record.initial_stiffness, plateau.mean * record.normal_load):
        warnings.warn(wrong, stacklevel=2)
    return DriveResult(record, plateau, *measure_motion(record, plateau, drive, contact_pull(case, drive)))


def contact_pull(case: Case, drive: Drive, compliance: Compliance | None = None) -> Pull | None:
    """The way to pull the pin of `case` over its contact itself; None for a drive without `memory`."""
    if not drive.memory:
        return None
    from nanoslip.solver.driven.contact_drive import pull_of_contact  # noqa: PLC0415  only where a scene calls for it

    return pull_of_contact(case, compliance or surface_compliance(case.slab), drive)
