"""Validity flags of a campaign's cases in words: one line for each flag, on the terminal and in the report."""

import functools
import math
import operator
from collections.abc import Callable, Sequence

from nanoslip.solver.case import Case
from nanoslip.solver.sliding.validity import FLAGS, expected_flags, mask_of
from nanoslip.study.manifest.parameters import Value, in_words
from nanoslip.study.plan.outlook import Outlook
from nanoslip.study.plan.plan import Plan
from nanoslip.study.plan.task import TaskResult

_OF_CONTACTS = ("contact", "record")
"""Kinds of task whose results have flags."""


def flag_lines(masks: Sequence[int], words: Callable[[int], str]) -> list[str]:
    """For each flag that any case has: number of cases, the first one, meaning and advice.

    masks: the flags of every case, as bits. words: a case's number -> what tells it from the others, empty for a single case.
    """
    lines = []
    for flag in FLAGS:
        having = [number for number, mask in enumerate(masks) if mask & flag.mask]
        if having:
            first = words(having[0])
            where = f"{len(having)} of {len(masks)} cases" + (f", first {first}" if first else "")
            lines.append(f"{flag.name}: {where}: {flag.meaning}; {flag.advice}")
    return lines


def flags_of(case: Case, result: TaskResult) -> int | None:
    """The flags that any member's contact or record has, as bits; where no contact was reached, those to be expected of it.

    None for other kinds of results.
    """
    if result.kind not in _OF_CONTACTS:
        return None
    reached = [
        int(flags)
        for flags, width in zip(
            *(result.scalars.get(name, ()) for name in ("validity_flags", "contact_half_width")), strict=True
        )
        if not math.isnan(width)
    ]
    return functools.reduce(operator.or_, reached) if reached else mask_of(expected_flags(case))


def expected_lines(plan: Plan, outlook: Outlook) -> list[str]:
    """What is to be expected of a plan's cases before anything is computed; nothing of refused ones."""
    varying = [name for name, values in plan.manifest.axes.items() if len(values) > 1]

    def words(number: int) -> str:
        point = plan.cases[number].parameters
        return in_words(", ".join(f"{name} = {_short(point[name])}" for name in varying if name in point))

    return flag_lines(outlook.masks, words)


def _short(value: Value) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
