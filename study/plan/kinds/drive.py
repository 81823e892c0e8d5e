"""The motion of the driven pin over a case's friction record, and what is measured in it."""

from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from typing import Final

from nanoslip.solver.case import Case
from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.coefficients import FrictionCoefficients, measured
from nanoslip.solver.dynamics.integrators import DynamicsResult
from nanoslip.solver.dynamics.regime import StickSlipCount, count_sticks
from nanoslip.solver.dynamics.stick_slip import StickSlipFit, fit_stick_slip
from nanoslip.solver.effects import SPARED, LeftOut
from nanoslip.solver.ensemble import ALONE, Ensemble
from nanoslip.solver.last import of_the_last
from nanoslip.solver.outcome import SolverError
from nanoslip.solver.parameter import quantities
from nanoslip.solver.sliding.plateau import Plateau
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.study.canonical import CanonicalText, canonical_text
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.plan.cost import drive_seconds, events_of
from nanoslip.study.plan.kinds.compliance import compliance_needs
from nanoslip.study.plan.kinds.kind import (
    MEMBER,
    Computed,
    Estimate,
    Kind,
    Member,
    Part,
    Ragged,
    Wanted,
    case_of,
    compliance_in,
    computed_members,
    disk_of,
    drive_of,
    largest_change,
    own_ensemble,
    scalars_only_mark,
    several,
)
from nanoslip.study.plan.kinds.record import Recorded, computed_record, record_task, records_in
from nanoslip.study.plan.task import Inputs, Task, task_key

NAME = "drive"


def drive_task(
    case: Case, drive: Drive, ensemble: Ensemble = ALONE, *, scalars_only: bool = False, fitted: bool = True
) -> Task:
    """The motion of the pin over the friction records of a case's members.

    fitted: whether Eq. 16-19 are fitted to its spring force. Members that its target needs beyond those records are slid too.
    """
    record = record_task(case, ensemble)
    own, text = _own(ensemble)
    marks = (*scalars_only_mark(scalars_only), *(() if fitted else ("unfitted",)))
    key = task_key(NAME, record.key, _text(drive), text, *marks)
    more = compliance_needs(case.slab) if own.within is not None else ()
    needs = (record.key, *more)
    return Task(key, NAME, case.slab, case, drive, ensemble=own, needs=needs, scalars_only=scalars_only, fitted=fitted)


@lru_cache(maxsize=4096)  # a campaign has few drives and many cases
def _text(drive: Drive) -> CanonicalText:
    settings = {item.name: getattr(drive, item.name) for item in fields(drive)}
    return CanonicalText(canonical_text({"type": type(drive).__name__, **settings}))


@lru_cache(maxsize=64)  # of all cases
def _own(ensemble: Ensemble) -> tuple[Ensemble, CanonicalText]:
    return own_ensemble(DRIVE, ensemble)


def _needed(manifest: Manifest) -> bool:
    return "dynamics" in manifest.stages


def _trajectory(manifest: Manifest) -> bool:
    return manifest.outputs.trajectory


def _phases(manifest: Manifest) -> bool:
    return manifest.outputs.phases


def _fitted(manifest: Manifest) -> bool:
    return manifest.outputs.fit


def _aimed(manifest: Manifest) -> bool:
    return manifest.ensemble.within is not None


def _tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    bare = not (_trajectory(manifest) or _phases(manifest))
    fitted = _fitted(manifest)
    return tuple(
        Wanted(drive_task(case, drive, manifest.ensemble, scalars_only=bare, fitted=fitted), label)
        for label, drive in _dimensionless(manifest)
    )


@of_the_last
def _dimensionless(manifest: Manifest) -> tuple[tuple[str, Drive], ...]:
    """Label and numbers of the campaign's drives."""
    return tuple((each.label, each.drive.dimensionless(manifest.scales)) for each in manifest.drives if each.drive)


@dataclass(slots=True)
class _Pulling:
    """A drive of a case: the first members with everything, the others without what the first ones do not need."""

    task: Task
    inputs: Inputs
    records: list[Recorded]
    whole: list[Member] = field(default_factory=list)
    drive: Drive = field(init=False)
    left_out: LeftOut = field(default=LeftOut("nothing", 0.0), init=False)

    def __post_init__(self) -> None:
        self.drive = drive_of(self.task)

    def member(self, case: Case, number: int) -> Member:
        """The motion of a member and what is measured in it."""
        if self.task.ensemble.within is not None and number == PAIRS:
            self._leave_out()
        pulled = self.records[number] if number < len(self.records) else _slid(case, self.task, self.inputs)
        found = self._pulled(pulled, self.drive)
        if number < PAIRS:
            self.whole.append(found)
        elif self.drive is not drive_of(self.task):
            return replace(found, only=(*self.task.ensemble.of, *quantities(LeftOut)))
        return found

    def _leave_out(self) -> None:
        """Find the first effect without which the first members' numbers change by less than half of what the target allows."""
        ensemble, everything = self.task.ensemble, self.drive
        for effect in SPARED if ensemble.of else ():
            if effect.there(everything):
                without = effect.without(everything)
                fewer = [self._pulled(pulled, without) for pulled in self.records[:PAIRS]]
                error = largest_change(DRIVE, ensemble, fewer, self.whole)
                if error <= 0.5 * (ensemble.within or 0.0):
                    self.drive, self.left_out = without, LeftOut(effect.name, error)
                    return

    def _pulled(self, pulled: Recorded, drive: Drive) -> Member:
        record, plateau = pulled
        if not record.outcome.usable:
            return Member((), record.outcome)
        try:
            motion, coefficients = measured(record, plateau, drive)
        except SolverError as error:
            return Member((), error.outcome)
        fit = fit_stick_slip(motion, drive, record.normal_load) if self.task.fitted else None
        count = count_sticks(motion, drive)
        return Member((coefficients, fit, count, motion), coefficients.outcome.adding(count.unsettled))


PAIRS: Final = 2
"""Members that are pulled with everything and without an effect: the fewest whose changes have a ±."""


def _run(task: Task, inputs: Inputs) -> Computed:
    pulling = _Pulling(task, inputs, list(records_in(inputs[task.needs[0]])))
    there = len(pulling.records)
    found = computed_members(DRIVE, task, pulling.member, there, lambda: pulling.left_out.left_out_error)
    if task.ensemble.within is not None:
        found = tuple(replace(each, values=(*each.values, pulling.left_out)) if each.values else each for each in found)
    return Computed(found)


def _slid(case: Case, task: Task, inputs: Inputs) -> Recorded:
    """The record of a member that has none yet."""
    _, plateau, _, record = computed_record(case, compliance_in(inputs[task.needs[1]], task.slab)).values
    assert isinstance(record, FrictionRecord)
    assert isinstance(plateau, Plateau)
    return record, plateau


def _estimate(task: Task) -> Estimate:
    case, drive = case_of(task), drive_of(task)
    arrays = 0.0 if task.scalars_only else _ARRAYS + _PER_SAMPLE * drive.samples
    memory = 8.0 * (2.0 * _PER_SAMPLE * drive.samples + _PER_EVENT * events_of(case))  # the fit's columns, too
    members = task.ensemble.likely
    return Estimate(members * drive_seconds(drive, case, task.fitted), memory, disk_of(24 * members, arrays))


_ARRAYS = 550.0  # numbers' worth of its binned force, its slips, and the names of its arrays
_PER_SAMPLE = 5.0
_PER_EVENT = 16.0  # numbers of the record that it is pulled over


DRIVE = Kind(
    NAME,
    _needed,
    _tasks,
    _run,
    _estimate,
    (
        Part(FrictionCoefficients),
        Part(StickSlipFit, "fitted_", wanted=_fitted),
        Part(StickSlipCount),
        Part(DynamicsResult, whole=True),
        Part(LeftOut, wanted=_aimed),
    ),
    (
        Ragged("trajectory", "sample", "trajectory_row_size", _trajectory),
        Ragged("trajectory", "slip_phase", "phase_row_size", _phases),
        Ragged("drive_ensemble", MEMBER, "drive_member_row_size", several),
    ),
)
