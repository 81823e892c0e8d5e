"""Compute a task: the only bridge into the solver.

A task computes all members of its case; the solver's values become the scalars and arrays of a result here, and back.
"""

import math
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.state import contact_summary
from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.duration import measure_motion
from nanoslip.solver.dynamics.regime import CriticalVelocity, StickSlipCount, count_sticks
from nanoslip.solver.dynamics.result import DynamicsResult, ending_parameter, no_legs
from nanoslip.solver.dynamics.stick_slip import fit_stick_slip
from nanoslip.solver.effects import SPARED, LeftOut, SpacingChange
from nanoslip.solver.elasticity.compliance import Compliance, SurfaceCompliance, stiffness_of_node, surface_compliance
from nanoslip.solver.elasticity.fields import InteriorFields
from nanoslip.solver.ensemble import Ensemble, fewest_members, mean_of, omission_error
from nanoslip.solver.last import cache_last
from nanoslip.solver.outcome import COMPLETED, Ending, Outcome, SolverError
from nanoslip.solver.parameter import SHARED_ERROR, Quantity, quantities
from nanoslip.solver.progress import part_of_progress
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.coarsening import double_spacing
from nanoslip.solver.sliding.interface import Portion
from nanoslip.solver.sliding.plateau import (
    Plateau,
    event_drift_error,
    extreme_error,
    plateau_error,
    plateau_of,
    repeats,
    stress_error,
)
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.sizes import event_distributions
from nanoslip.solver.sliding.slide import slide_to_state, states_at
from nanoslip.solver.sliding.slider import portion, slider
from nanoslip.solver.sliding.statistics import collective, event_statistics, node_error
from nanoslip.solver.sliding.validity import Validity, contact_half_width, contact_validity, record_validity
from nanoslip.study.origin import computing_origin, stemming
from nanoslip.study.plan import kinds
from nanoslip.study.plan.task import Inputs, Task, TaskResult, task_case, task_drive

PartOfResult = TypeVar("PartOfResult")


def run_task(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
    """Compute a task from the results it needs. Never raises for physics: a refusal is a result with its outcome.

    `OUT_OF_MEMORY` is of the machine, not of the task: such a result is not to be kept.
    """
    if task.needs and inputs[task.needs[0]].kind == task.kind:  # the scalars of a result that has more
        return replace(inputs[task.needs[0]], key=task.key, arrays={})
    used = stemming((computing_origin(),), *(inputs[key].origins for key in task.needs))
    return replace(_computed(task, inputs), origins=used)


def _computed(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
    needs = [inputs[key] for key in task.needs]
    for need in needs:
        if not need.outcome.usable:  # a record without a plateau is still a record
            message = f"its {need.kind} ended as {need.outcome.ending}: {need.outcome.message}"
            cause = need.outcome.cause and f"{need.kind} {need.outcome.ending} {need.outcome.cause}"
            return TaskResult(task.key, task.kind, Outcome(Ending.NEEDS_FAILED, message, cause=cause))
    try:
        return _result(task, inputs)
    except SolverError as error:
        return TaskResult(task.key, task.kind, error.outcome)
    except MemoryError as error:
        message = _NO_MEMORY.format(task.slab.n_x, error)
        return TaskResult(task.key, task.kind, Outcome(Ending.OUT_OF_MEMORY, message, cause="memory"))


_NO_MEMORY = "no memory left at n_x = {}: start fewer ranks on a machine, or use a smaller n_x or fewer events ({})"


def _result(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
    kind, computed = kinds.KINDS[task.kind], COMPUTE[task.kind](task, inputs)
    scalars, arrays = member_numbers(kind, computed.members, scalars_only=task.scalars_only)
    kept = {} if task.scalars_only else {**computed.arrays, **arrays}
    ended = tuple([member.outcome for member in computed.members])
    outcome = joint_outcome(ended)
    return TaskResult(task.key, task.kind, outcome, scalars, kept, () if {outcome} == {*ended} else ended)


@dataclass(frozen=True, slots=True)
class Member:
    """Result of a member: values of its kind's parts, in any order, and outcome."""

    values: tuple[object, ...] = ()
    outcome: Outcome = COMPLETED
    only: tuple[str, ...] | None = None
    """Known variables, if it was computed without an effect that changes others; None for all."""
    plateau: Plateau | None = None
    """Plateau of its record, which determines the error that members share."""
    halves: Mapping[str, float] = field(default_factory=dict)
    """Numbers that its record's length decides, as they are over the first half of it."""
    repetitions: Collection[str] = ()
    """Numbers that the repetition of its record decides, about as much as the surface."""
    node: float = 0.0
    """Change of its stiffness by one node more."""

    def part(self, kind: type[PartOfResult]) -> PartOfResult | None:
        """The value of a part; None if the member lacks it."""
        return next((each for each in self.values if type(each) is kind), None)


@dataclass(frozen=True, slots=True)
class Computed:
    """The result of a task before it is stored."""

    members: tuple[Member, ...] = ()
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    """Arrays that are in no part."""


def compute_members(
    kind: kinds.Kind,
    task: Task,
    compute: Callable[[Case, int], Member],
    there: int | None = None,
    spent: Callable[[], float] = lambda: 0.0,
    coarse: Callable[[Case, Compliance], Member] | None = None,
) -> tuple[Member, ...]:
    """Compute the members of a task, or as many as its target needs. compute: one, from its case and number.

    A member that the physics refuses has that outcome and no values. there: number of members whose inputs exist; all
    of them are computed, and further ones only for a target. spent: relative error by what members leave out, which
    the target includes. coarse: computes a member on twice the node spacing; its change counts in the target, too.
    """
    ensemble, found = task.ensemble, list[Member]()
    spacing: SpacingChange | None = None

    def tried(number: int) -> Member:
        try:
            return compute(ensemble.case(task_case(task), number), number)
        except SolverError as error:
            return Member((), error.outcome)

    for size in ensemble.sizes() if there is None else (there, *(size for size in ensemble.sizes() if size > there)):
        for number in range(len(found), size):
            with part_of_progress(number / size, (number + 1) / size):
                found.append(tried(number))
        if ensemble.within is not None:
            if coarse and not spacing:
                spacing = SpacingChange(spacing_change(kind, task, found, coarse))
            allowed = error_of_starts(ensemble.within - spent(), spacing.spacing_change if spacing else math.nan)
            target = replace(ensemble, within=allowed)
            if all(target.meets_target(*each) for each in _target_values(kind, target, found)):
                break
    if spacing:
        return tuple(replace(each, values=(*each.values, spacing)) if each.values else each for each in found)
    return tuple(found)


ENOUGH: Final = 0.1
"""Ratio of ± of starts to the change by the node spacing, where that decides: in squares it adds half a percent to the error."""


def error_of_starts(within: float, change: float) -> float:
    """Relative error (2 ±) that a target leaves to starts. change: relative change by the node spacing, NaN if unknown.

    Where the spacing alone misses the target, more starts than ENOUGH asks for would be computed in vain.
    """
    if math.isnan(change):
        return within
    return max(within - change, 2.0 * ENOUGH * change)


def spacing_change(
    kind: kinds.Kind, task: Task, own: Sequence[Member], compute: Callable[[Case, Compliance], Member]
) -> float:
    """Largest relative change of a target's numbers by twice the node spacing, from means over as many members; NaN if unknown.

    compute: a member's result on the coarser grid, from its case and compliance.
    """
    case, members = double_spacing(task_case(task)), list[Member]()
    if case is None:
        return math.nan
    compliance = surface_compliance(case.slab)
    for number in range(len(own)):
        try:
            with part_of_progress(1.0, 1.0):
                members.append(compute(task.ensemble.case(case, number), compliance))
        except SolverError as error:
            members.append(Member((), error.outcome))
    on_coarse = _target_values(kind, task.ensemble, members)
    on_fine = _target_values(kind, task.ensemble, own)
    changes = list[float]()
    for (coarse, _), (fine, _) in zip(on_coarse, on_fine, strict=True):
        mean = float(mean_of(np.array(fine, float)).mean)
        change = float(mean_of(np.array(coarse, float)).mean) - mean
        changes.append(abs(change / mean) if mean else math.nan)
    return max(filter(math.isfinite, changes), default=math.nan)


def largest_change(kind: kinds.Kind, ensemble: Ensemble, without: Sequence[Member], whole: Sequence[Member]) -> float:
    """`omission_error` what members leave out, of the observable of an ensemble's target in which it is largest."""
    each = (_target_values(kind, ensemble, members) for members in (without, whole))
    return max(omission_error(fewer, all_of_it) for (fewer, *_), (all_of_it, *_) in zip(*each, strict=True))


def _target_values(
    kind: kinds.Kind, ensemble: Ensemble, members: Sequence[Member]
) -> list[tuple[list[float | int], float]]:
    """Values of the members, and the error that they share, of each number of this kind in an ensemble's target."""
    scalars, nothing = _scalars(kind, members), [math.nan] * len(members)
    chosen = (key for key, each in kinds.result_quantities(kind).items() if each.name in ensemble.of)
    return [(scalars.get(key, nothing), scalars.get(f"{key}{SHARED_ERROR}", [0.0])[0]) for key in chosen]


def member_numbers(
    kind: kinds.Kind, members: Sequence[Member], *, scalars_only: bool = False
) -> tuple[dict[str, list[float | int]], dict[str, NDArray[Any]]]:
    """Scalars of all members, NaN where one has none, and arrays (see `Kind.all_members`) of the values of a kind's parts."""
    scalars = _scalars(kind, members)
    if scalars_only and len(members) < 2:
        return scalars, {}
    arrays = _arrays(kind, members[0]) if members else {}
    if kind.all_members and len(members) > 1:
        each = [arrays, *(_arrays(kind, member) for member in members[1:])]
        for sample in dict.fromkeys(item.sample for item in kind.ragged):
            columns = [name for name in kinds.result_quantities(kind, sample) if any(name in one for one in each)]
            for name in columns[:1]:
                scalars[kinds.column_length_name(sample)] = [len(one[name]) if name in one else 0 for one in each]
            for name in () if scalars_only else columns:
                arrays[name] = np.concatenate([one[name] for one in each if name in one])
    elif len(members) > 1 and not members[0].outcome.usable:  # an ensemble is usable without its first member
        arrays = {}
    return scalars, {} if scalars_only else arrays


def _scalars(kind: kinds.Kind, members: Sequence[Member]) -> dict[str, list[float | int]]:
    found: dict[str, list[float | int]] = {}
    for part in kind.parts:
        values: list[Any] = [member.part(part.type) for member in members]
        one = next((value for value in values if value is not None), None)
        for name, key, words in _held(part) if one is not None else ():
            if not isinstance(getattr(one, name), _NO_SCALARS):
                found[key] = [
                    math.nan if value is None else _encode_word(getattr(value, name), words) for value in values
                ]
    for number, member in enumerate(members):
        if member.only is not None:
            kept = {key for key, each in kinds.result_quantities(kind).items() if each.name in member.only}
            for key in found.keys() - kept:
                found[key][number] = math.nan
    for key, each in _sharing(kind):
        if key in found:
            found[f"{key}{SHARED_ERROR}"] = [_shared_member_error(key, each, members, found[key])] * len(members)
    return found


_NO_SCALARS: Final = (np.ndarray, Outcome)
"""Types of values that are no scalars of a result."""


@lru_cache(maxsize=64)
def _sharing(kind: kinds.Kind) -> list[tuple[str, Quantity]]:
    """Quantities of a kind whose means have an error that all members share."""
    return [(key, each) for key, each in kinds.result_quantities(kind).items() if each.shared]


def _shared_member_error(key: str, quantity: Quantity, members: Sequence[Member], values: Sequence[float]) -> float:
    """The error of a mean that all members share; NaN where fewer than two have a value, and where it is not known."""
    having = [(member, value) for member, value in zip(members, values, strict=True) if math.isfinite(value)]
    if len(having) < 2 or any(key in member.repetitions for member, _ in having):
        return math.nan
    if quantity.shared == "nodes":
        step = math.fsum(member.node for member, _ in having) / len(having)
        return node_error(np.array([value for _, value in having]), step)
    plateaus = [member.plateau for member, _ in having if member.plateau]
    if quantity.shared == "length":
        halves = [member.halves.get(key, math.nan) for member, _ in having]
        return extreme_error([value - half for (_, value), half in zip(having, halves, strict=True)])
    if quantity.shared == "repetition":
        return 0.0
    if quantity.shared == "events":
        return event_drift_error(plateaus) * abs(math.fsum(value for _, value in having)) / len(having)
    return (stress_error if quantity.shared == "stress" else plateau_error)(plateaus)


def _arrays(kind: kinds.Kind, member: Member) -> dict[str, NDArray[Any]]:
    found: dict[str, NDArray[Any]] = {}
    for part in kind.parts:
        value: Any = member.part(part.type)
        for name, key, _ in _held(part) if value is not None else ():
            if isinstance(one := getattr(value, name), np.ndarray):
                found[key] = one
    return found


def joint_outcome(members: Sequence[Outcome]) -> Outcome:
    """Outcome of an ensemble: the outcome of its members, or completed if enough members are, with the outcomes of
    all others."""
    if len({*members}) < 2:
        return members[0] if members else COMPLETED
    failed = Counter(each.ending for each in members if not each.ok)
    enough = len(members) - failed.total() >= fewest_members(len(members))
    ending = Ending.COMPLETED if enough else failed.most_common(1)[0][0]
    speaking = [each for each in members if each.message]
    first = {each.ending: each for each in reversed(speaking)}
    said = Counter(each.ending for each in speaking).most_common()
    # What a member that completed says is a remark: with its ending the others would read as failures.
    ends = {end: "" if end is Ending.COMPLETED else f" {end}" for end, _ in said}
    some = {
        end: "" if count == len(members) else f"{count} of {len(members)} members{ends[end]}: " for end, count in said
    }
    messages = [f"{words}{first[end].message}" for end, words in some.items()]
    kinds_of = [first[each].kind for each, _ in said]
    cause = "; ".join(kinds_of) if kinds_of != messages else ""
    return Outcome(ending, "; ".join(messages), any(each.longer for each in members), cause)


@lru_cache(maxsize=256)
def _held(part: kinds.Part) -> tuple[tuple[str, str, tuple[str, ...]], ...]:
    """List the numbers of a part that results hold: field, name in results, and the words that it encodes."""
    described = quantities(part.type, part.prefix)
    named = [(item.name, f"{part.prefix}{item.name}") for item in fields(part.type)]
    held = ((name, key, described.get(key)) for name, key in named if part.whole or key in described)
    return tuple((name, key, each.words if each else ()) for name, key, each in held)


def _encode_word(value: Any, words: tuple[str, ...]) -> Any:
    """Encode a text as its position among the words, None as NaN; a number stays."""
    return value if not words else math.nan if value is None else words.index(value)


def whole_again(kind: type[PartOfResult], result: TaskResult, member: int = 0, prefix: str = "") -> PartOfResult:
    """A member's value that `member_numbers` took apart: of a whole part with this prefix."""
    make: Any = kind
    described = quantities(make, prefix)
    held: dict[str, Any] = {f"{prefix}outcome": (result.members or (result.outcome,) * (member + 1))[member]}
    for item in fields(make):
        name = f"{prefix}{item.name}"
        if name in result.arrays:
            held[name] = kinds.member_column(result, name, described[name].along if name in described else "", member)
        elif name in result.scalars:
            held[name] = result.scalars[name][member]
    there = {item.name: held[name] for item in fields(make) if (name := f"{prefix}{item.name}") in held}
    return make(**there)  # type: ignore[no-any-return]  # a number that came later has its default


def task_compliance(task: Task, inputs: Inputs) -> Compliance:
    """The compliance that a task needs: an input, or computed here for a surface without ends, which needs no
    separate task."""
    stored = [inputs[key] for key in task.needs if inputs[key].kind == "compliance"]
    return result_compliance(stored[0], task.slab) if stored else surface_compliance(task.slab)


@lru_cache(maxsize=4)  # tasks that follow each other get the same one: the solver keeps what it computes of it
def result_compliance(result: TaskResult, slab: Slab) -> SurfaceCompliance:
    """The compliance that a result holds."""
    return SurfaceCompliance(result.arrays[kinds.MATRIX], slab)


# One function for each kind of task. Raises SolverError where the physics refuses.


def _compliance(task: Task, inputs: Inputs) -> Computed:
    return Computed(arrays={kinds.MATRIX: surface_compliance(task.slab).matrix})


def _contact(task: Task, inputs: Inputs) -> Computed:
    compliance = task_compliance(task, inputs)
    nodes = kinds.SurfaceNodes(np.zeros(len(compliance.x), np.int64), compliance.x)

    def compute(case: Case, number: int) -> Member:
        state = initial_contact(case, compliance)
        across = kinds.RowsOfContact(state.y) if state.rows > 1 else None
        return Member((contact_validity(case, state), state, contact_summary(state), nodes, across), state.outcome)

    return Computed(compute_members(kinds.CONTACT, task, compute))


Recorded = tuple[FrictionRecord, Plateau]
"""A member's record and its steady part."""


def _contacts(task: Task, inputs: Inputs) -> Computed:
    found = portion(task_case(task), task_compliance(task, inputs), *task.contacts, task.ensemble)
    return Computed((Member((found,), found.outcome),))


def _record(task: Task, inputs: Inputs) -> Computed:
    compliance = task_compliance(task, inputs)

    def compute(case: Case, number: int) -> Member:
        return compute_record(case, compliance, task.ensemble, inputs)

    def compute_coarse(case: Case, coarse: Compliance) -> Member:
        return compute_record(case, coarse, task.ensemble, {})

    alone = task_case(task).interface.contacts == 1  # else its contacts would be computed one after the other
    return Computed(compute_members(kinds.RECORD, task, compute, coarse=compute_coarse if alone else None))


def compute_record(case: Case, compliance: Compliance, places: Ensemble, inputs: Inputs) -> Member:
    """Record of a member, and all numbers that follow from it. inputs: computed batches of its contacts."""
    if case.interface.contacts > 1:
        tasks = list(kinds.member_batches(case, places))
        there = (whole_again(Portion, inputs[task.key]) if task.key in inputs else None for task in tasks)
        each = zip(there, tasks, strict=True)
        found = slider(case, (one or portion(case, compliance, *task.contacts, places) for one, task in each))
        plateau = plateau_of(found.record)
        together = collective(found.record, plateau, found.bound, found.lost)
        values: tuple[object, ...] = (found.validity, plateau, found.statistics, found.record, together)
        halves = numbers_of_half(found.record, plateau)
        return Member(values, plateau.outcome.adding(found.record.outcome), plateau=plateau, halves=halves)
    start = initial_contact(case, compliance)
    record, end = slide_to_state(case, compliance, start)
    plateau = plateau_of(record)
    valid = record_validity(case, start, record, end)
    across = kinds.RowsOfRecord(record.node_y) if case.slab.scheme.planar else None
    values = (valid, plateau, event_statistics(record), record, collective(record, plateau), across)
    node = stiffness_of_node(compliance, start.contact) if start.outcome.ok else 0.0
    outcome = plateau.outcome if record.outcome.ok else record.outcome
    return Member(values, outcome, plateau=plateau, node=node, halves=numbers_of_half(record, plateau))


def record_of_member(case: Case, compliance: Compliance, ensemble: Ensemble, number: int) -> FrictionRecord:
    """The record of a case's member, by the member's number. Raises SolverError if there is none."""
    return next(
        value
        for value in compute_record(ensemble.case(case, number), compliance, ensemble, {}).values
        if isinstance(value, FrictionRecord)
    )


def numbers_of_half(record: FrictionRecord, plateau: Plateau) -> dict[str, float]:
    """Numbers that the length of a record decides, over its first half. plateau: of all of it, over which peaks are stated."""
    half = record.first_half
    peak = half.highest_force / half.normal_load if half.final_displacement > 0.0 else math.nan
    excess, fluctuation = collective(half, plateau).static_excess, collective(half, plateau_of(half)).fluctuation
    return {"peak_friction": peak, "static_excess": excess, "fluctuation": fluctuation}


@cache_last  # records are pulled over by one drive after the other
def member_records(result: TaskResult) -> list[Recorded]:
    """The records of all members."""
    count = len(result.scalars["plateau_mean"])
    return [
        (whole_again(FrictionRecord, result, number), whole_again(Plateau, result, number, Plateau.PREFIX))
        for number in range(count)
    ]


def _path(task: Task, inputs: Inputs) -> Computed:
    from nanoslip.solver.sliding.path import follow, leg_numbers, loops_of, path_line  # noqa: PLC0415  few scenes have paths

    compliance = task_compliance(task, inputs)

    def compute(case: Case, number: int) -> Member:
        path = follow(case, compliance)
        valid = Validity(path.validity_flags, contact_half_width(path.start))
        numbers = (valid, loops_of(path), leg_numbers(path), path_line(path))
        if not path.start.outcome.ok:
            return Member((), path.outcome)
        return Member(numbers, path.outcome, node=stiffness_of_node(compliance, path.start.contact))

    return Computed(compute_members(kinds.PATH, task, compute))


def _statistics(task: Task, inputs: Inputs) -> Computed:
    return Computed((Member(event_distributions(member_records(inputs[task.needs[0]]))),))


def _states(task: Task, inputs: Inputs) -> Computed:
    compliance = task_compliance(task, inputs)
    states, outcome = states_at(task_case(task), compliance, task.events)
    if not states:
        return Computed((Member((), outcome),))
    beside: tuple[object, ...] = ()
    if states[0].rows > 1:
        beside = (kinds.RowsOfContact(np.concatenate([state.y for state in states])),)
    if task.subsurface:
        from nanoslip.solver.elasticity.interior import interior_fields  # noqa: PLC0415  few campaigns look inside

        parts = [interior_fields(task.slab, state.nodal_force) for state in states]
        events = np.repeat(task.events[: len(states)], [len(each.x) for each in parts])
        beside = (kinds.InteriorEvents(events), InteriorFields(**_columns(InteriorFields, parts)))
    event = np.repeat(task.events[: len(states)], len(states[0].x))
    surfaces = kinds.SurfaceStates(**_columns(kinds.SurfaceStates, states), event=event)
    return Computed((Member((surfaces, *beside), outcome),))


def _columns(kind: Any, parts: Sequence[Any]) -> dict[str, NDArray[Any]]:
    """Fields of a kind, joined over parts in their order."""
    names = [item.name for item in fields(kind) if hasattr(parts[0], item.name)]
    return {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}


class _Pulling:
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
            pulled = self.records[number]
        else:
            pulled = _slide_member(case, task_compliance(self.task, self.inputs), self.task.ensemble)
        found = self._pulled(case, pulled, self.drive)
        if number < PAIRS:
            self.whole.append(found)
        elif self.drive is not task_drive(self.task):
            return replace(
                found, only=(*self.task.ensemble.of, *quantities(LeftOut), *quantities(SpacingChange, "drive_"))
            )
        return found

    def coarse_member(self, case: Case, compliance: Compliance) -> Member:
        """The motion of a member on another grid, with all effects."""
        pulled = _slide_member(case, compliance, self.task.ensemble)
        return self._pulled(case, pulled, task_drive(self.task))

    def _leave_out(self) -> None:
        """First effect whose omission changes the first members' numbers by less than half of the target."""
        ensemble, everything = self.task.ensemble, self.drive
        for effect in SPARED if ensemble.of else ():
            if effect.there(everything):
                without = effect.without(everything)
                alone = task_case(self.task)  # what is spared is no effect of a contact that is pulled over itself
                fewer = [self._pulled(alone, pulled, without) for pulled in self.records[:PAIRS]]
                error = largest_change(kinds.DRIVE, ensemble, fewer, self.whole)
                if error <= 0.5 * (ensemble.within or 0.0):
                    self.drive, self.left_out = without, LeftOut(effect.name, error)
                    return

    def _pulled(self, case: Case, pulled: Recorded, drive: Drive) -> Member:
        record, plateau = pulled
        if not record.outcome.usable:
            return Member((), record.outcome)
        if drive.stage_stroke is not None:
            return self._pulled_to_and_fro(case, pulled, drive)
        try:
            over = None
            if drive.memory:
                from nanoslip.solver.driven.contact_drive import pulling  # noqa: PLC0415  few scenes call for it

                over = pulling(case, task_compliance(self.task, self.inputs), drive)
            motion, coefficients = measure_motion(record, plateau, drive, over)
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

    def _pulled_to_and_fro(self, case: Case, pulled: Recorded, drive: Drive) -> Member:
        """The motion of a stage that goes to and fro, by modules that other drives do without."""
        from nanoslip.solver.dynamics.to_and_fro import measure_strokes  # noqa: PLC0415

        record, plateau = pulled
        try:
            over = None
            if drive.memory:
                from nanoslip.solver.driven.contact_drive import legs_pulling  # noqa: PLC0415

                over = legs_pulling(case, task_compliance(self.task, self.inputs), drive)
            found = measure_strokes(record, plateau, drive, over)
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


def _drive(task: Task, inputs: Inputs) -> Computed:
    pulling = _Pulling(task, inputs)
    there = len(pulling.records)
    # Over a contact itself a drive reads the compliance of its own grid.
    alone = task_case(task).interface.contacts == 1 and not task_drive(task).memory
    coarse = pulling.coarse_member if alone else None
    found = compute_members(kinds.DRIVE, task, pulling.member, there, lambda: pulling.left_out.left_out_error, coarse)
    if task.ensemble.within is not None:
        found = tuple(replace(each, values=(*each.values, pulling.left_out)) if each.values else each for each in found)
    return Computed(found)


def _slide_member(case: Case, compliance: Compliance, ensemble: Ensemble) -> Recorded:
    """The record of a member that has none yet."""
    member = compute_record(case, compliance, ensemble, {})
    record, plateau = member.part(FrictionRecord), member.plateau
    assert record is not None
    assert plateau is not None
    return record, plateau


COMPUTE: Final[Mapping[str, Callable[[Task, Inputs], Computed]]] = {
    "compliance": _compliance,
    "contact": _contact,
    "contacts": _contacts,
    "record": _record,
    "path": _path,
    "statistics": _statistics,
    "states": _states,
    "drive": _drive,
}
"""Name of a kind -> function that computes its tasks."""
