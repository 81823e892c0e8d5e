"""Compute a task: all members of its case, whose values become the scalars and arrays of a result here, and back."""

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.effects import SpacingChange
from nanoslip.solver.ensemble import Ensemble, fewest_members, mean_of, omission_error
from nanoslip.solver.outcome import COMPLETED, Ending, Outcome, SolverError
from nanoslip.solver.parameter import SHARED_ERROR, Quantity, quantities
from nanoslip.solver.progress import part_of_progress
from nanoslip.solver.sliding.coarsening import double_spacing
from nanoslip.solver.sliding.plateau import event_drift_error, extreme_error, plateau_error, stress_error
from nanoslip.solver.sliding.statistics import node_error
from nanoslip.study.origin import computing_origin, stemming
from nanoslip.study.tasks.kind import (
    KINDS,
    Kind,
    Member,
    Part,
    PartOfResult,
    column_length_name,
    member_column,
    result_quantities,
)
from nanoslip.study.tasks.task import Task, TaskResult, task_case

if TYPE_CHECKING:
    from nanoslip.solver.elasticity.compliance import Compliance


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
    kind = KINDS[task.kind]
    computed = kind.compute(task, inputs)
    scalars, arrays = member_numbers(kind, computed.members, scalars_only=task.scalars_only)
    kept = {} if task.scalars_only else {**computed.arrays, **arrays}
    scalars |= computed.scalars
    ended = tuple([member.outcome for member in computed.members])
    outcome = joint_outcome(ended)
    return TaskResult(task.key, task.kind, outcome, scalars, kept, () if {outcome} == {*ended} else ended)


def compute_members(
    task: Task,
    compute: Callable[[Case, int], Member],
    there: int | None = None,
    spent: Callable[[], float] = lambda: 0.0,
    coarse: Callable[[Case, "Compliance"], Member] | None = None,
) -> tuple[Member, ...]:
    """Compute the members of a task, or as many as its target needs. compute: one, from its case and number.

    A member that the physics refuses has that outcome and no values. there: number of members whose inputs exist; all
    of them are computed, and further ones only for a target. spent: relative error by what members leave out, which
    the target includes. coarse: computes a member on twice the node spacing; its change counts in the target, too.
    """
    kind, ensemble, found = KINDS[task.kind], task.ensemble, list[Member]()
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
                spacing = SpacingChange(spacing_change(task, found, coarse))
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


def spacing_change(task: Task, own: Sequence[Member], compute: Callable[[Case, "Compliance"], Member]) -> float:
    """Largest relative change of a target's numbers by twice the node spacing, from means over as many members; NaN if unknown.

    compute: a member's result on the coarser grid, from its case and compliance.
    """
    from nanoslip.solver.elasticity.compliance import surface_compliance  # noqa: PLC0415

    kind, case, members = KINDS[task.kind], double_spacing(task_case(task)), list[Member]()
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


def largest_change(kind: Kind, ensemble: Ensemble, without: Sequence[Member], whole: Sequence[Member]) -> float:
    """`omission_error` what members leave out, of the observable of an ensemble's target in which it is largest."""
    each = (_target_values(kind, ensemble, members) for members in (without, whole))
    return max(omission_error(fewer, all_of_it) for (fewer, *_), (all_of_it, *_) in zip(*each, strict=True))


def _target_values(kind: Kind, ensemble: Ensemble, members: Sequence[Member]) -> list[tuple[list[float | int], float]]:
    """Values of the members, and the error that they share, of each number of this kind in an ensemble's target."""
    scalars, nothing = _scalars(kind, members), [math.nan] * len(members)
    chosen = (key for key, each in result_quantities(kind).items() if each.name in ensemble.of)
    return [(scalars.get(key, nothing), scalars.get(f"{key}{SHARED_ERROR}", [0.0])[0]) for key in chosen]


def member_numbers(
    kind: Kind, members: Sequence[Member], *, scalars_only: bool = False
) -> tuple[dict[str, list[float | int]], dict[str, NDArray[Any]]]:
    """Scalars of all members, NaN where one has none, and arrays (see `Kind.all_members`) of the values of a kind's parts."""
    scalars = _scalars(kind, members)
    if scalars_only and len(members) < 2:
        return scalars, {}
    arrays = _arrays(kind, members[0]) if members else {}
    if kind.all_members and len(members) > 1:
        each = [arrays, *(_arrays(kind, member) for member in members[1:])]
        for sample in dict.fromkeys(item.sample for item in kind.ragged):
            columns = [name for name in result_quantities(kind, sample) if any(name in one for one in each)]
            for name in columns[:1]:
                scalars[column_length_name(sample)] = [len(one[name]) if name in one else 0 for one in each]
            for name in () if scalars_only else columns:
                arrays[name] = np.concatenate([one[name] for one in each if name in one])
    elif len(members) > 1 and not members[0].outcome.usable:  # an ensemble is usable without its first member
        arrays = {}
    return scalars, {} if scalars_only else arrays


def _scalars(kind: Kind, members: Sequence[Member]) -> dict[str, list[float | int]]:
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
            kept = {key for key, each in result_quantities(kind).items() if each.name in member.only}
            for key in found.keys() - kept:
                found[key][number] = math.nan
    for key, each in _sharing(kind):
        if key in found:
            found[f"{key}{SHARED_ERROR}"] = [_shared_member_error(key, each, members, found[key])] * len(members)
    return found


_NO_SCALARS: Final = (np.ndarray, Outcome)
"""Types of values that are no scalars of a result."""


@lru_cache(maxsize=64)
def _sharing(kind: Kind) -> list[tuple[str, Quantity]]:
    """Quantities of a kind whose means have an error that all members share."""
    return [(key, each) for key, each in result_quantities(kind).items() if each.shared]


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


def _arrays(kind: Kind, member: Member) -> dict[str, NDArray[Any]]:
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
def _held(part: Part) -> tuple[tuple[str, str, tuple[str, ...]], ...]:
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
            held[name] = member_column(result, name, described[name].along if name in described else "", member)
        elif name in result.scalars:
            held[name] = result.scalars[name][member]
    there = {item.name: held[name] for item in fields(make) if (name := f"{prefix}{item.name}") in held}
    return make(**there)  # type: ignore[no-any-return]  # a number that came later has its default
