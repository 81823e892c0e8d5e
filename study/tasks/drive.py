"""The motion of the driven pin over a case's friction records, and the numbers that are measured in it."""

import math
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
from nanoslip.solver.ensemble import ALONE, Ensemble, LeftOut, SpacingChange
from nanoslip.solver.last import cache_last
from nanoslip.solver.outcome import Ending, InvalidInput, Outcome, SolverError
from nanoslip.solver.parameter import quantities
from nanoslip.solver.sliding.plateau import Plateau, plateau_of, repeats
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.study.canonical import CanonicalText, canonical_text
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.tasks.compliance import compliance_needs, task_compliance
from nanoslip.study.tasks.compute import add_value, compute_members, largest_change
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
    has_several_members,
    has_target,
    list_marks,
    output,
    own_ensemble,
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
    of_drives, text = own_ensemble("drive", ensemble)
    marks = list_marks(scalars=scalars_only, unfitted=not fitted, critical=critical)
    key = task_key("drive", record.key, drive_text(drive), text, *marks)
    needs: tuple[str, ...] = (record.key,)
    # A target may need members that have no record yet; a contact that remembers is slid by its own drive.
    if of_drives.within is not None or drive.memory:
        needs = (record.key, *compliance_needs(case.slab))
    return Task(
        key,
        "drive",
        case.slab,
        case,
        drive,
        ensemble=of_drives,
        needs=needs,
        scalars_only=scalars_only,
        fitted=fitted,
        critical=critical,
    )


# A campaign has few drives and many cases.
@lru_cache(maxsize=4096)
def drive_text(drive: Drive) -> CanonicalText:
    """Canonical text of a drive, for keys."""
    settings = {item.name: getattr(drive, item.name) for item in fields(drive)}
    # A stage in one direction has no cycles: their default must not name its results.
    if drive.stage_stroke is None:
        settings = {name: value for name, value in settings.items() if name not in OF_A_STROKE}
    text = canonical_text({"type": type(drive).__name__, **settings})
    return CanonicalText(text)


def _tasks(case: Case, manifest: Manifest) -> tuple[Wanted, ...]:
    outputs = manifest.outputs
    bare = not (outputs.trajectory or outputs.phases)
    make_task = partial(drive_task, scalars_only=bare, fitted=outputs.fit, critical=outputs.critical)
    tasks = []
    for label, drive in dimensionless_drives(manifest):
        task = make_task(case, drive, manifest.ensemble)
        tasks.append(Wanted(task, label))
    return tuple(tasks)


@cache_last
def dimensionless_drives(manifest: Manifest) -> tuple[tuple[str, Drive], ...]:
    """Label and numbers of the campaign's drives."""
    pulls = [(pull.label, pull.drive) for pull in manifest.drives if pull.drive]
    return tuple((label, drive.dimensionless(manifest.scales)) for label, drive in pulls)


def reciprocates(manifest: Manifest) -> bool:
    """True if the stage of a drive goes to and fro."""
    drives = [pull.drive.in_si for pull in manifest.drives if pull.drive is not None]
    return any(drive.stage_stroke is not None for drive in drives)


def goes_one_way(manifest: Manifest) -> bool:
    """True if the stage of a drive keeps its direction; as it does where all drives are refused."""
    drives = [pull.drive.in_si for pull in manifest.drives if pull.drive is not None]
    return not drives or any(drive.stage_stroke is None for drive in drives)


def _has_legs(manifest: Manifest) -> bool:
    """True if a dataset has the legs of stages."""
    return reciprocates(manifest) and manifest.outputs.trajectory


def _estimate(task: Task) -> Estimate:
    case, drive = task_case(task), task_drive(task)
    numbers = 6.0 * drive.output_times
    # Twice the columns of the motion with those of the fit, beside the record.
    memory = FLOAT * (2.0 * numbers + 16.0 * estimate_sizes(case).events)
    seconds = drive_seconds(drive, case, task.fitted, task.critical)
    return Estimate(task.ensemble.likely * seconds, memory, numbers)


class Pulling:
    """A drive of a case: the first members with all effects, the others without unneeded ones."""

    def __init__(self, task: Task, inputs: Inputs) -> None:
        self.task, self.inputs, self.drive = task, inputs, task_drive(task)
        self.records = member_records(inputs[task.needs[0]])
        self.whole: list[Member] = []
        self.left_out = LeftOut("nothing", 0.0)

    def member(self, case: Case, number: int) -> Member:
        """The motion of a member, and the numbers measured in it."""
        # Effects are left out only for a target, which states an error that the omission counts in.
        if self.task.ensemble.within is not None and number == PAIRS:
            self._leave_out()
        if number < len(self.records):
            recorded = self.records[number]
        else:
            compliance = task_compliance(self.task, self.inputs)
            recorded = _slide_member(case, compliance, self.task.ensemble)
        member = self._pull(case, recorded, self.drive)
        if number < PAIRS:
            self.whole.append(member)
        elif self.drive is not task_drive(self.task):
            # Only the target's numbers are known to change by little; all others of such a member are left out.
            about_target = (*quantities(LeftOut), *quantities(SpacingChange, "drive_"))
            return replace(member, only=(*self.task.ensemble.of, *about_target))
        return member

    def coarse_member(self, case: Case, compliance: "Compliance") -> Member:
        """The motion of a member on another grid, with all effects."""
        recorded = _slide_member(case, compliance, self.task.ensemble)
        return self._pull(case, recorded, task_drive(self.task))

    def motion(self, number: int) -> DynamicsResult | None:
        """The motion over a member's record with all effects; None if it has none, or one that ended too early."""
        case = self.task.ensemble.case(task_case(self.task), number)
        drive = task_drive(self.task)
        member = self._pull(case, self.records[number], drive)
        return member.part(DynamicsResult) if member.outcome.usable else None

    def _leave_out(self) -> None:
        """First effect whose omission changes the first members' numbers by less than half of the target."""
        ensemble, everything = self.task.ensemble, self.drive
        if not ensemble.of:
            return
        # Without a target no effect is left out.
        from nanoslip.solver.effects import SPARED  # noqa: PLC0415

        # What is spared is no effect of a contact that is pulled over itself: any member's case serves.
        case = task_case(self.task)
        records = self.records[:PAIRS]
        for effect in SPARED:
            if not effect.there(everything):
                continue
            without = effect.without(everything)
            fewer = [self._pull(case, recorded, without) for recorded in records]
            error = largest_change(KIND, ensemble, fewer, self.whole)
            # Half of the target stays for the starts.
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
                # Few scenes call for it.
                from nanoslip.solver.driven.contact_drive import pull_of_contact  # noqa: PLC0415

                compliance = task_compliance(self.task, self.inputs)
                pull = pull_of_contact(case, compliance, drive)
            motion, coefficients = measure_motion(record, plateau, drive, pull)
        except SolverError as error:
            return Member((), error.outcome)
        fit = fit_stick_slip(motion, drive, record.normal_load) if self.task.fitted else None
        count = count_sticks(motion, drive)
        # Over its contact a pin repeats no record.
        goes_beyond = pull is None and motion.position[-1] > plateau.end
        repetitions = repetition_numbers(goes_beyond, count, plateau)
        critical = _critical(record, plateau, drive) if self.task.critical else None
        # A single start has no ±, and that of a short record is not known.
        is_repeated = goes_beyond and repeats(plateau) and self.task.ensemble.members > 1
        halves = dict[str, float]()
        if critical or is_repeated:
            # How far a number depends on the length of a record is its shared error.
            half = record.first_half
            steady = plateau_of(half)
            if critical and steady.outcome.ok:
                halves["critical_velocity"] = _critical(half, steady, drive).critical_velocity
            if is_repeated:
                halves |= _repeated_numbers(half, steady, replace(drive, duration=motion.end_time))
        # A longer drive would settle, unless it ended for another reason than its duration.
        longer = bool(count.unsettled) and ending_parameter(motion, drive) == "duration"
        remark = Outcome(Ending.COMPLETED, count.unsettled, longer)
        outcome = coefficients.outcome.adding(remark)
        values = (coefficients, fit, count, critical, motion, no_legs())
        return Member(values, outcome, plateau=plateau, halves=halves, repetitions=repetitions)

    def _pull_to_and_fro(self, case: Case, recorded: Recorded, drive: Drive) -> Member:
        """The motion of a stage that goes to and fro, by modules that other drives do without."""
        from nanoslip.solver.dynamics.to_and_fro import measure_strokes  # noqa: PLC0415

        record, plateau = recorded
        try:
            pull = None
            if drive.memory:
                from nanoslip.solver.driven.contact_drive import legs_pull_of_contact  # noqa: PLC0415

                compliance = task_compliance(self.task, self.inputs)
                pull = legs_pull_of_contact(case, compliance, drive)
            strokes = measure_strokes(record, plateau, drive, pull)
        except SolverError as error:
            return Member((), error.outcome)
        halves = dict[str, float]()
        # Over its contact a pin repeats no record, and a single start has no ±.
        if pull is None and self.task.ensemble.members > 1:
            halves = _loops_over(record.first_half, drive)
        values = (strokes.motion, strokes.loops, strokes.legs)
        return Member(values, strokes.outcome, plateau=plateau, halves=halves)


def repetition_numbers(goes_beyond: bool, count: StickSlipCount, plateau: Plateau) -> tuple[str, ...]:
    """The numbers of a drive that the repetition of its record decides. goes_beyond: true if it goes beyond the record's end.

    A pin that slides vibrates with the period of the repetition, however long the record is.
    """
    is_long = repeats(plateau)
    # The drives of a search for the critical velocity go as far as they need, also where this one does not.
    searched = () if is_long else ("critical_velocity",)
    if not goes_beyond:
        return searched
    if not is_long:
        return (*searched, *REPEATED)
    # Of a long record only the vibration of a pin that slides has the period of the repetition.
    return () if count.regime == "stick_slip" else ("spring_force_amplitude",)


def _critical(record: FrictionRecord, plateau: Plateau, drive: Drive) -> CriticalVelocity:
    """The critical velocity of a drive, by a module that other drives do without."""
    from nanoslip.solver.dynamics.critical import critical_velocity  # noqa: PLC0415

    return critical_velocity(record, plateau, drive)


REPEATED: Final = ("time_stuck", "spring_force_amplitude", "stick_slip_period")
"""Numbers of a drive that follow from its record as it is repeated."""


def _repeated_numbers(record: FrictionRecord, plateau: Plateau, drive: Drive) -> dict[str, float]:
    """The numbers of a drive that follow from the repetition of a record, NaN if that has no steady part."""
    from nanoslip.solver.dynamics.duration import measure_motion  # noqa: PLC0415

    try:
        motion, _ = measure_motion(record, plateau, drive)
    except SolverError:
        return dict.fromkeys(REPEATED, math.nan)
    count = count_sticks(motion, drive)
    return {name: getattr(count, name) for name in REPEATED}


def _loops_over(record: FrictionRecord, drive: Drive) -> dict[str, float]:
    """The numbers of the cycles of a stage over a record that it repeats, NaN if that has no steady part."""
    from nanoslip.solver.dynamics.to_and_fro import measure_strokes  # noqa: PLC0415

    names = [name for name, stated in quantities(StageLoops).items() if stated.shared]
    try:
        loops = measure_strokes(record, plateau_of(record), drive).loops
    except SolverError:
        return dict.fromkeys(names, math.nan)
    return {name: getattr(loops, name) for name in names}


PAIRS: Final = 2
"""Members that are pulled with everything and without an effect: the fewest whose changes have a ±."""


def _compute(task: Task, inputs: Inputs) -> Computed:
    pulling = Pulling(task, inputs)
    record_count = len(pulling.records)
    # Over a contact itself a drive reads the compliance of its own grid.
    is_single = task_case(task).interface.contacts == 1 and not task_drive(task).memory
    coarse = pulling.coarse_member if is_single else None
    members = compute_members(task, pulling.member, record_count, lambda: pulling.left_out.left_out_error, coarse)
    # What was left out is decided among members, so that their values get it last.
    if task.ensemble.within is not None:
        members = add_value(members, pulling.left_out)
    return Computed(members)


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
    shape = compiling_shape(case)
    small = Case.of({**NUMBERS, "slip_order": case.slip_rule.slip_order, **shape})
    with suppress(InvalidInput):
        shorter: dict[str, Any] = {"duration": (drive.duration or 100.0) / 100}
        # A stroke lasts as long as its cycles take: it has no duration to shorten.
        if drive.stage_stroke is not None:
            shorter = {"stage_stroke": drive.stage_stroke / 100}
        shortened = drive_task(small, replace(drive, **shorter, samples=2))
        # Without a compliance, which a contact that remembers then computes by itself.
        return (replace(shortened, needs=shortened.needs[:1]),)
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
        Ragged("drive_ensemble", MEMBER, "drive_member_row_size", has_several_members),
    ),
    driven=True,
)
