"""The motion of the driven pin over a case's friction records, and what is measured in it."""

from contextlib import suppress
from dataclasses import fields, replace
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any, Final

from nanoslip.solver.case import Case
from nanoslip.solver.drive import OF_A_STROKE, Drive
from nanoslip.solver.dynamics.coefficients import FrictionCoefficients
from nanoslip.solver.dynamics.regime import CriticalVelocity, StickSlipCount, count_sticks
from nanoslip.solver.dynamics.result import DynamicsResult, StageLegs, StageLoops, ending_parameter, no_legs
from nanoslip.solver.dynamics.stick_slip import StickSlipFit, fit_stick_slip
from nanoslip.solver.effects import SPARED, LeftOut, SpacingChange
from nanoslip.solver.ensemble import ALONE, Ensemble
from nanoslip.solver.last import cache_last
from nanoslip.solver.outcome import Ending, InvalidInput, Outcome, SolverError
from nanoslip.solver.parameter import quantities
from nanoslip.solver.sliding.plateau import Plateau, plateau_of, repeats
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.study.canonical import CanonicalText, canonical_text
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.tasks.compliance import compliance_needs, task_compliance
from nanoslip.study.tasks.compute import compute_members, largest_change
from nanoslip.study.tasks.estimates import FLOAT, drive_seconds, estimate_sizes
from nanoslip.study.tasks.kind import (
    MEMBER,
    Computed,
    Estimate,
    Kind,
    Member,
    Part,
    Ragged,
    Wanted,
    has_target,
    list_marks,
    output,
    own_ensemble,
    several,
)
from nanoslip.study.tasks.miniature import NUMBERS, SMALL, compiling_shape
from nanoslip.study.tasks.record import Recorded, compute_record, member_records, record_task
from nanoslip.study.tasks.task import Inputs, Task, task_case, task_drive, task_key

if TYPE_CHECKING:
    from nanoslip.solver.elasticity.compliance import Compliance


def drive_task(
    case: Case,
    drive: Drive,
    ensemble: Ensemble = ALONE,
    *,
    scalars_only: bool = False,
    fitted: bool = True,
    critical: bool = False,
) -> Task:
    """The motion of the pin over the friction records of a case's members.

    fitted: whether Eq. 16-19 are fitted to its spring force. critical: whether its critical velocity is computed.
    Members that its target needs beyond those records are slid too.
    """
    record = record_task(case, ensemble)
    own, text = own_ensemble("drive", ensemble)
    marks = list_marks(scalars=scalars_only, unfitted=not fitted, critical=critical)
    key = task_key("drive", record.key, drive_text(drive), text, *marks)
    slides = own.within is not None or drive.memory
    needs = (record.key, *(compliance_needs(case.slab) if slides else ()))
    return Task(
        key,
        "drive",
        case.slab,
        case,
        drive,
        ensemble=own,
        needs=needs,
        scalars_only=scalars_only,
        fitted=fitted,
        critical=critical,
    )


@lru_cache(maxsize=4096)  # a campaign has few drives and many cases
def drive_text(drive: Drive) -> CanonicalText:
    """Canonical text of a drive, for keys."""
    settings = {item.name: getattr(drive, item.name) for item in fields(drive)}
    if drive.stage_stroke is None:  # a stage in one direction has no cycles
        settings = {name: value for name, value in settings.items() if name not in OF_A_STROKE}
    return CanonicalText(canonical_text({"type": type(drive).__name__, **settings}))


def _tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    outputs = manifest.outputs
    bare = not (outputs.trajectory or outputs.phases)
    task = partial(drive_task, scalars_only=bare, fitted=outputs.fit, critical=outputs.critical)
    return tuple(Wanted(task(case, drive, manifest.ensemble), label) for label, drive in dimensionless_drives(manifest))


@cache_last
def dimensionless_drives(manifest: Manifest) -> tuple[tuple[str, Drive], ...]:
    """Label and numbers of the campaign's drives."""
    return tuple((each.label, each.drive.dimensionless(manifest.scales)) for each in manifest.drives if each.drive)


def reciprocates(manifest: Manifest) -> bool:
    """True if the stage of a drive goes to and fro."""
    return any(each.drive is not None and each.drive.in_si.stage_stroke is not None for each in manifest.drives)


def goes_one_way(manifest: Manifest) -> bool:
    """True if the stage of a drive keeps its direction; as it does where all drives are refused."""
    drives = [each.drive.in_si for each in manifest.drives if each.drive is not None]
    return not drives or any(drive.stage_stroke is None for drive in drives)


def _has_legs(manifest: Manifest) -> bool:
    """True if a dataset has the legs of stages."""
    return reciprocates(manifest) and manifest.outputs.trajectory


def _estimate(task: Task) -> Estimate:
    case, drive = task_case(task), task_drive(task)
    numbers = 6.0 * drive.output_times  # twice that with the fit's columns, beside the record
    memory = FLOAT * (2.0 * numbers + 16.0 * estimate_sizes(case).events)
    return Estimate(task.ensemble.likely * drive_seconds(drive, case, task.fitted, task.critical), memory, numbers)


class Pulling:
    """A drive of a case: the first members with all effects, the others without unneeded ones."""

    def __init__(self, task: Task, inputs: Inputs) -> None:
        self.task, self.inputs, self.drive = task, inputs, task_drive(task)
        self.records = member_records(inputs[task.needs[0]])
        self.whole: list[Member] = []
        self.left_out = LeftOut("nothing", 0.0)

    def member(self, case: Case, number: int) -> Member:
        """The motion of a member, and the numbers measured in it."""
        if self.task.ensemble.within is not None and number == PAIRS:
            self._leave_out()
        if number < len(self.records):
            recorded = self.records[number]
        else:
            recorded = _slide_member(case, task_compliance(self.task, self.inputs), self.task.ensemble)
        found = self._pull(case, recorded, self.drive)
        if number < PAIRS:
            self.whole.append(found)
        elif self.drive is not task_drive(self.task):
            return replace(
                found, only=(*self.task.ensemble.of, *quantities(LeftOut), *quantities(SpacingChange, "drive_"))
            )
        return found

    def coarse_member(self, case: Case, compliance: "Compliance") -> Member:
        """The motion of a member on another grid, with all effects."""
        recorded = _slide_member(case, compliance, self.task.ensemble)
        return self._pull(case, recorded, task_drive(self.task))

    def motion(self, number: int) -> DynamicsResult | None:
        """The motion over a member's record with all effects; None if it has none, or one that ended too early."""
        case = self.task.ensemble.case(task_case(self.task), number)
        found = self._pull(case, self.records[number], task_drive(self.task))
        return found.part(DynamicsResult) if found.outcome.usable else None

    def _leave_out(self) -> None:
        """First effect whose omission changes the first members' numbers by less than half of the target."""
        ensemble, everything = self.task.ensemble, self.drive
        for effect in SPARED if ensemble.of else ():
            if effect.there(everything):
                without = effect.without(everything)
                alone = task_case(self.task)  # what is spared is no effect of a contact that is pulled over itself
                fewer = [self._pull(alone, recorded, without) for recorded in self.records[:PAIRS]]
                error = largest_change(KIND, ensemble, fewer, self.whole)
                if error <= 0.5 * (ensemble.within or 0.0):
                    self.drive, self.left_out = without, LeftOut(effect.name, error)
                    return

    def _pull(self, case: Case, recorded: Recorded, drive: Drive) -> Member:
        from nanoslip.solver.dynamics.duration import measure_motion  # noqa: PLC0415

        record, plateau = recorded
        if not record.outcome.usable:
            return Member((), record.outcome)
        if drive.stage_stroke is not None:
            return self._pull_to_and_fro(case, recorded, drive)
        try:
            pull = None
            if drive.memory:
                from nanoslip.solver.driven.contact_drive import pull_of_contact  # noqa: PLC0415  few scenes call for it

                pull = pull_of_contact(case, task_compliance(self.task, self.inputs), drive)
            motion, coefficients = measure_motion(record, plateau, drive, pull)
        except SolverError as error:
            return Member((), error.outcome)
        fit = fit_stick_slip(motion, drive, record.normal_load) if self.task.fitted else None
        count = count_sticks(motion, drive)
        critical, halves = None, dict[str, float]()
        if self.task.critical:
            critical = _critical(record, plateau, drive)
            half = record.first_half
            steady = plateau_of(half)
            if steady.outcome.ok:
                halves = {"critical_velocity": _critical(half, steady, drive).critical_velocity}
        longer = bool(count.unsettled) and ending_parameter(motion, drive) == "duration"
        outcome = coefficients.outcome.adding(Outcome(Ending.COMPLETED, count.unsettled, longer))
        values = (coefficients, fit, count, critical, motion, no_legs())
        repetitions = repetition_numbers(motion, count, plateau)
        return Member(values, outcome, plateau=plateau, halves=halves, repetitions=repetitions)

    def _pull_to_and_fro(self, case: Case, recorded: Recorded, drive: Drive) -> Member:
        """The motion of a stage that goes to and fro, by modules that other drives do without."""
        from nanoslip.solver.dynamics.to_and_fro import measure_strokes  # noqa: PLC0415

        record, plateau = recorded
        try:
            pull = None
            if drive.memory:
                from nanoslip.solver.driven.contact_drive import legs_pull_of_contact  # noqa: PLC0415

                pull = legs_pull_of_contact(case, task_compliance(self.task, self.inputs), drive)
            found = measure_strokes(record, plateau, drive, pull)
        except SolverError as error:
            return Member((), error.outcome)
        return Member((found.motion, found.loops, found.legs), found.outcome, plateau=plateau)


def repetition_numbers(motion: DynamicsResult, count: StickSlipCount, plateau: Plateau) -> tuple[str, ...]:
    """The numbers of a drive that the repetition of its record decides, where it goes beyond the record's end.

    A pin that slides vibrates with the period of the repetition, however long the record is.
    """
    goes_beyond, long = motion.position[-1] > plateau.end, repeats(plateau)
    searched = () if long else ("critical_velocity",)  # its drives go as far as they need
    if not goes_beyond:
        return searched
    if not long:
        return (*searched, "time_stuck", "spring_force_amplitude", "stick_slip_period")
    return () if count.regime == "stick_slip" else ("spring_force_amplitude",)


def _critical(record: FrictionRecord, plateau: Plateau, drive: Drive) -> CriticalVelocity:
    """The critical velocity of a drive, by a module that other drives do without."""
    from nanoslip.solver.dynamics.critical import critical_velocity  # noqa: PLC0415

    return critical_velocity(record, plateau, drive)


PAIRS: Final = 2
"""Members that are pulled with everything and without an effect: the fewest whose changes have a ±."""


def _compute(task: Task, inputs: Inputs) -> Computed:
    pulling = Pulling(task, inputs)
    there = len(pulling.records)
    # Over a contact itself a drive reads the compliance of its own grid.
    alone = task_case(task).interface.contacts == 1 and not task_drive(task).memory
    coarse = pulling.coarse_member if alone else None
    found = compute_members(task, pulling.member, there, lambda: pulling.left_out.left_out_error, coarse)
    if task.ensemble.within is not None:
        found = tuple(replace(each, values=(*each.values, pulling.left_out)) if each.values else each for each in found)
    return Computed(found)


def _slide_member(case: Case, compliance: "Compliance", ensemble: Ensemble) -> Recorded:
    """The record of a member that has none yet."""
    member = compute_record(case, compliance, ensemble, {})
    record, plateau = member.part(FrictionRecord), member.plateau
    assert record is not None
    assert plateau is not None
    return record, plateau


def _miniature(task: Task) -> tuple[Task, ...]:
    """The drive over a hundredth of its duration, or all of it where that is less than a step of its integrator.

    It needs a record alone, which may be made up (`make_record`).
    """
    drive = task_drive(task)
    case = task_case(task) if drive.memory else SMALL
    small = Case.of({**NUMBERS, "slip_order": case.slip_rule.slip_order, **compiling_shape(case)})
    with suppress(InvalidInput):
        shorter: dict[str, Any] = {"duration": (drive.duration or 100.0) / 100}
        if drive.stage_stroke is not None:
            shorter = {"stage_stroke": drive.stage_stroke / 100}
        found = drive_task(small, replace(drive, **shorter, samples=2))
        return (replace(found, needs=found.needs[:1]),)
    return (drive_task(small, replace(drive, samples=2)),)


KIND: Final = Kind(
    "drive",
    needed=lambda manifest: "dynamics" in manifest.stages,
    tasks=_tasks,
    estimate=_estimate,
    compute=_compute,
    miniature=_miniature,
    parts=(
        Part(FrictionCoefficients, wanted=goes_one_way),
        Part(StickSlipFit, "fitted_", wanted=lambda manifest: manifest.outputs.fit and goes_one_way(manifest)),
        Part(StickSlipCount, wanted=goes_one_way),
        Part(CriticalVelocity, wanted=output("critical")),
        Part(DynamicsResult, whole=True),
        Part(StageLoops, wanted=reciprocates),
        Part(StageLegs, "stage_leg_", wanted=reciprocates),
        Part(LeftOut, wanted=has_target),
        Part(SpacingChange, "drive_", wanted=has_target),
    ),
    ragged=(
        Ragged("trajectory", "sample", "trajectory_row_size", output("trajectory")),
        Ragged("trajectory", "slip_phase", "phase_row_size", output("phases")),
        Ragged("trajectory", "stage_leg", "stage_leg_row_size", _has_legs),
        Ragged("drive_ensemble", MEMBER, "drive_member_row_size", several),
    ),
    driven=True,
)
