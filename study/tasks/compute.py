"""Compute a task: all members of its case, whose values become the scalars and arrays of a result here, and back."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.ensemble import Ensemble, SpacingChange, fewest_members, mean_of, omission_error
from nanoslip.solver.outcome import COMPLETED, Ending, Outcome, SolverError
from nanoslip.solver.parameter import SHARED_ERROR, Quantity, quantities
from nanoslip.solver.progress import part_of_progress
from nanoslip.solver.sliding.coarsening import double_spacing
from nanoslip.solver.sliding.plateau import (
    event_drift_error,
    extreme_error,
    plateau_error,
    repetition_error,
    stress_error,
)
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
    needs = [inputs[key] for key in task.needs]
    # A task that needs one of its own kind takes the scalars of a result that has more.
    if needs and needs[0].kind == task.kind:
        return replace(needs[0], key=task.key, arrays={})
    of_needs = (need.origins for need in needs)
    origins = stemming((computing_origin(),), *of_needs)
    return replace(_compute_or_refuse(task, inputs), origins=origins)


def _compute_or_refuse(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
    needs = [inputs[key] for key in task.needs]
    for need in needs:
        # Usable, not completed: a record without a plateau is still a record.
        if need.outcome.usable:
            continue
        message = f"its {need.kind} ended as {need.outcome.ending}: {need.outcome.message}"
        # Cases that failed for one cause are counted together, whatever numbers their messages have.
        cause = need.outcome.cause and f"{need.kind} {need.outcome.ending} {need.outcome.cause}"
        outcome = Outcome(Ending.NEEDS_FAILED, message, cause=cause)
        return TaskResult(task.key, task.kind, outcome)
    try:
        return _result(task, inputs)
    except SolverError as error:
        return TaskResult(task.key, task.kind, error.outcome)
    except MemoryError as error:
        message = _NO_MEMORY.format(task.slab.n_x, error)
        outcome = Outcome(Ending.OUT_OF_MEMORY, message, cause="memory")
        return TaskResult(task.key, task.kind, outcome)


_NO_MEMORY = "no memory left at n_x = {}: start fewer ranks on a machine, or use a smaller n_x or fewer events ({})"


def _result(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
    kind = KINDS[task.kind]
    computed = kind.compute(task, inputs)
    scalars, arrays = member_numbers(kind, computed.members, scalars_only=task.scalars_only)
    kept = {} if task.scalars_only else {**computed.arrays, **arrays}
    scalars |= computed.scalars
    outcomes = tuple([member.outcome for member in computed.members])
    outcome = joint_outcome(outcomes)
    # Members that all ended as their task did, as almost all do, need no outcomes of their own in a file.
    if {outcome} == {*outcomes}:
        outcomes = ()
    return TaskResult(task.key, task.kind, outcome, scalars, kept, outcomes)


def add_value(members: Iterable[Member], value: object) -> tuple[Member, ...]:
    """Add a value to each member that has any: a member without values has failed, and this would be its only one."""
    added = []
    for member in members:
        values = (*member.values, value) if member.values else ()
        added.append(replace(member, values=values))
    return tuple(added)


def compute_members(
    task: Task,
    compute: Callable[[Case, int], Member],
    available: int | None = None,
    spent: Callable[[], float] = lambda: 0.0,
    coarse: Callable[[Case, "Compliance"], Member] | None = None,
) -> tuple[Member, ...]:
    """Compute the members of a task, or as many as its target needs. compute: one, from its case and number.

    A member that the physics refuses has that outcome and no values. available: number of members whose inputs exist; all
    of them are computed, and further ones only for a target. spent: relative error by what members leave out, which
    the target includes. coarse: computes a member on twice the node spacing; its change counts in the target, too.
    """
    kind, ensemble = KINDS[task.kind], task.ensemble
    members = list[Member]()
    spacing: SpacingChange | None = None
    sizes = list(ensemble.sizes())
    if available is not None:
        sizes = [available, *(size for size in sizes if size > available)]
    for size in sizes:
        for number in range(len(members), size):
            with part_of_progress(number / size, (number + 1) / size):
                try:
                    case = ensemble.case(task_case(task), number)
                    members.append(compute(case, number))
                # One start that fails must not cost the others.
                except SolverError as error:
                    members.append(Member((), error.outcome))
        if ensemble.within is None:
            continue
        # The grid's share of the error does not fall with more starts: it is measured once, over the first ones.
        if coarse and not spacing:
            spacing = SpacingChange(spacing_change(task, members, coarse))
        change = spacing.spacing_change if spacing else math.nan
        allowed = error_of_starts(ensemble.within - spent(), change)
        target = replace(ensemble, within=allowed)
        if all(target.meets_target(values, shared) for values, shared in _target_values(kind, target, members)):
            break
    if not spacing:
        return tuple(members)
    return add_value(members, spacing)


ENOUGH: Final = 0.1
"""Ratio of ± of starts to the change by the node spacing, where that decides: in squares it adds half a percent to the error."""


def error_of_starts(within: float, change: float) -> float:
    """Relative error (2 ±) that a target leaves to starts. change: relative change by the node spacing, NaN if unknown.

    Where the spacing alone misses the target, more starts than ENOUGH asks for would be computed in vain.
    """
    if math.isnan(change):
        return within
    # The ± that is ENOUGH of the change is twice that as a relative error, as `within` is.
    return max(within - change, 2.0 * ENOUGH * change)


def spacing_change(
    task: Task, members_on_grid: Sequence[Member], compute: Callable[[Case, "Compliance"], Member]
) -> float:
    """Largest relative change of a target's numbers by twice the node spacing, from means over as many members; NaN if unknown.

    compute: a member's result on the coarser grid, from its case and compliance.
    """
    from nanoslip.solver.elasticity.compliance import surface_compliance  # noqa: PLC0415

    kind, case = KINDS[task.kind], double_spacing(task_case(task))
    members = list[Member]()
    if case is None:
        return math.nan
    compliance = surface_compliance(case.slab)
    for number in range(len(members_on_grid)):
        try:
            # At its end already: how long the coarse grid takes is no part of the progress.
            with part_of_progress(1.0, 1.0):
                members.append(compute(task.ensemble.case(case, number), compliance))
        except SolverError as error:
            members.append(Member((), error.outcome))
    on_coarse = _target_values(kind, task.ensemble, members)
    on_fine = _target_values(kind, task.ensemble, members_on_grid)
    changes = list[float]()
    for (coarse, _), (fine, _) in zip(on_coarse, on_fine, strict=True):
        fine_mean = float(mean_of(np.array(fine, float)).mean)
        coarse_mean = float(mean_of(np.array(coarse, float)).mean)
        change = coarse_mean - fine_mean
        changes.append(abs(change / fine_mean) if fine_mean else math.nan)
    return max(filter(math.isfinite, changes), default=math.nan)


def largest_change(kind: Kind, ensemble: Ensemble, without: Sequence[Member], whole: Sequence[Member]) -> float:
    """`omission_error` what members leave out, of the observable of an ensemble's target in which it is largest."""
    values_without = _target_values(kind, ensemble, without)
    values_with = _target_values(kind, ensemble, whole)
    errors = []
    for (fewer, _), (complete, _) in zip(values_without, values_with, strict=True):
        errors.append(omission_error(fewer, complete))
    return max(errors)


def _target_values(kind: Kind, ensemble: Ensemble, members: Sequence[Member]) -> list[tuple[list[float | int], float]]:
    """Values of the members, and the error that they share, of each number of this kind in an ensemble's target."""
    scalars = _scalars(kind, members)
    no_values = [math.nan] * len(members)
    pairs = []
    for key, stated in result_quantities(kind).items():
        if stated.name in ensemble.of:
            # The shared error is one number, which each member's scalars repeat.
            shared = scalars.get(f"{key}{SHARED_ERROR}", [0.0])[0]
            pairs.append((scalars.get(key, no_values), shared))
    return pairs


def member_numbers(
    kind: Kind, members: Sequence[Member], *, scalars_only: bool = False
) -> tuple[dict[str, list[float | int]], dict[str, NDArray[Any]]]:
    """Scalars of all members, NaN where one has none, and arrays (see `Kind.all_members`) of the values of a kind's parts."""
    scalars = _scalars(kind, members)
    if scalars_only and len(members) < 2:
        return scalars, {}
    arrays = _arrays(kind, members[0]) if members else {}
    if kind.all_members and len(members) > 1:
        of_members = [arrays, *(_arrays(kind, member) for member in members[1:])]
        for sample in dict.fromkeys(item.sample for item in kind.ragged):
            columns = [name for name in result_quantities(kind, sample) if any(name in one for one in of_members)]
            # All columns along a dimension are as long as each other: the first one gives the lengths of all.
            for name in columns[:1]:
                scalars[column_length_name(sample)] = [len(one[name]) if name in one else 0 for one in of_members]
            if scalars_only:
                continue
            # `arrays` is the first of them: each column is replaced only once it has been read.
            for name in columns:
                parts = [one[name] for one in of_members if name in one]
                arrays[name] = np.concatenate(parts)
    # An ensemble is usable without its first member, whose arrays are those of a failure then.
    elif len(members) > 1 and not members[0].outcome.usable:
        arrays = {}
    return scalars, {} if scalars_only else arrays


def _scalars(kind: Kind, members: Sequence[Member]) -> dict[str, list[float | int]]:
    scalars: dict[str, list[float | int]] = {}
    for part in kind.parts:
        values: list[Any] = [member.part(part.type) for member in members]
        example = next((value for value in values if value is not None), None)
        # No member has it: the campaign did not request this part.
        if example is None:
            continue
        for name, key, words in _result_fields(part):
            if not isinstance(getattr(example, name), _NO_SCALARS):
                column = []
                for value in values:
                    column.append(math.nan if value is None else _encode_word(getattr(value, name), words))
                scalars[key] = column
    # A number that was computed without an effect that decides it is none, even where it looks like one.
    for number, member in enumerate(members):
        if member.only is not None:
            kept = {key for key, stated in result_quantities(kind).items() if stated.name in member.only}
            for key in scalars.keys() - kept:
                scalars[key][number] = math.nan
    # Shared errors come last: they count the members that still have a number.
    for key, stated in _sharing(kind):
        if key in scalars:
            error = _shared_member_error(key, stated, members, scalars[key])
            scalars[f"{key}{SHARED_ERROR}"] = [error] * len(members)
    return scalars


_NO_SCALARS: Final = (np.ndarray, Outcome)
"""Types of values that are no scalars of a result."""


@lru_cache(maxsize=64)
def _sharing(kind: Kind) -> list[tuple[str, Quantity]]:
    """Quantities of a kind whose means have an error that all members share."""
    return [(key, stated) for key, stated in result_quantities(kind).items() if stated.shared]


def _shared_member_error(key: str, quantity: Quantity, members: Sequence[Member], values: Sequence[float]) -> float:
    """The error of a mean that all members share; NaN where fewer than two have a value, and where it is not known."""
    having, finite = list[Member](), list[float]()
    for member, value in zip(members, values, strict=True):
        if math.isfinite(value):
            having.append(member)
            finite.append(value)
    if len(having) < 2 or any(key in member.repetitions for member in having):
        return math.nan
    if quantity.shared == "nodes":
        step = math.fsum(member.node for member in having) / len(having)
        return node_error(np.array(finite), step)
    plateaus = [member.plateau for member in having if member.plateau]
    if quantity.shared in ("length", "repetition"):
        # A drive that repeats nothing has no half: its numbers owe nothing to the length of the record.
        alone = finite if quantity.shared == "repetition" else [math.nan] * len(having)
        halves = [member.halves.get(key, default) for member, default in zip(having, alone, strict=True)]
        growth = [value - half for value, half in zip(finite, halves, strict=True)]
        return extreme_error(growth) if quantity.shared == "length" else repetition_error(growth)
    if quantity.shared == "events":
        return event_drift_error(plateaus) * abs(math.fsum(finite)) / len(finite)
    error = stress_error if quantity.shared == "stress" else plateau_error
    return error(plateaus)


def _arrays(kind: Kind, member: Member) -> dict[str, NDArray[Any]]:
    arrays: dict[str, NDArray[Any]] = {}
    for part in kind.parts:
        value: Any = member.part(part.type)
        if value is None:
            continue
        for name, key, _ in _result_fields(part):
            content = getattr(value, name)
            if isinstance(content, np.ndarray):
                arrays[key] = content
    return arrays


def joint_outcome(members: Sequence[Outcome]) -> Outcome:
    """Outcome of an ensemble: the outcome of its members, or completed if enough members are, with the outcomes of
    all others."""
    if len({*members}) < 2:
        return members[0] if members else COMPLETED
    failed = Counter(outcome.ending for outcome in members if not outcome.ok)
    enough = len(members) - failed.total() >= fewest_members(len(members))
    ending = Ending.COMPLETED if enough else failed.most_common(1)[0][0]
    speaking = [outcome for outcome in members if outcome.message]
    # Reversed, so that the first message of each ending is the one that stays.
    first = {outcome.ending: outcome for outcome in reversed(speaking)}
    counts = Counter(outcome.ending for outcome in speaking).most_common()
    messages, causes = [], []
    for end, count in counts:
        # What a member that completed says is a remark: with its ending the others would read as failures.
        ended = "" if end is Ending.COMPLETED else f" {end}"
        share = "" if count == len(members) else f"{count} of {len(members)} members{ended}: "
        messages.append(f"{share}{first[end].message}")
        causes.append(first[end].kind)
    # A cause groups cases whose messages differ in numbers: one that is the message itself says nothing more.
    cause = "; ".join(causes) if causes != messages else ""
    longer = any(outcome.longer for outcome in members)
    return Outcome(ending, "; ".join(messages), longer, cause)


@lru_cache(maxsize=256)
def _result_fields(part: Part) -> tuple[tuple[str, str, tuple[str, ...]], ...]:
    """List the numbers of a part that results hold: field, name in results, and the words that it encodes."""
    described = quantities(part.type, part.prefix)
    numbers = []
    for item in fields(part.type):
        key = f"{part.prefix}{item.name}"
        if key in described:
            numbers.append((item.name, key, described[key].words))
        # What another task reads is held, even where it is no quantity of a dataset.
        elif part.whole:
            numbers.append((item.name, key, ()))
    return tuple(numbers)


def _encode_word(value: Any, words: tuple[str, ...]) -> Any:
    """Encode a text as its position among the words, None as NaN; a number stays."""
    if not words:
        return value
    return math.nan if value is None else words.index(value)


def whole_again(kind: type[PartOfResult], result: TaskResult, member: int = 0, prefix: str = "") -> PartOfResult:
    """A member's value that `member_numbers` took apart: of a whole part with this prefix."""
    make: Any = kind
    described = quantities(make, prefix)
    # Members that ended as their task did have no outcomes of their own.
    outcome = result.members[member] if result.members else result.outcome
    values: dict[str, Any] = {}
    for item in fields(make):
        name = f"{prefix}{item.name}"
        if name in result.arrays:
            sample = described[name].along if name in described else ""
            values[item.name] = member_column(result, name, sample, member)
        elif name in result.scalars:
            values[item.name] = result.scalars[name][member]
        elif item.name == "outcome":
            values[item.name] = outcome
    # A number that a later version declares is missing here, and takes its default.
    return make(**values)  # type: ignore[no-any-return]
