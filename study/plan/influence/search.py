"""The cheapest choice within a tolerance: which effects go, and how short record and drives are.

All sets of effects of the case are tried with all lengths of its record; each drive then takes what is cheapest for it.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from study.plan.influence.choice import LEAST_SAVING, Option, Part
from study.plan.influence.length import COUNTS


class Asked(NamedTuple):
    """What is asked for, to which change."""

    within: float
    columns: Sequence[int]
    """Places among the observables."""
    of_record: Sequence[bool]
    """Of each whether the error by a record's length is one of it."""
    of_drive: Sequence[bool]
    """The same of a drive's length."""


class Found(NamedTuple):
    """What is cheapest."""

    seconds: float
    of_case: tuple[str, ...]
    """Effects that are left out."""
    of_drives: Mapping[str, tuple[str, ...]]
    errors: Mapping[str, float | None]
    """By their lengths, of the record, "", and of the drives; None of whole lengths."""


def cheapest(record: Part, drives: Mapping[str, Part], asked: Asked) -> Found:
    """The choice that takes the fewest seconds."""
    of_drives = {label: part.options(asked.columns, asked.within) for label, part in drives.items()}
    best = Found(math.inf, (), {}, {})
    for option in record.options(asked.columns, asked.within):
        for error, share in ((None, 1.0), *record.shorter.items()):
            seconds = option.seconds * share
            if seconds >= best.seconds or not _fits(option.changes, (error or 0.0, 0.0), asked):
                continue
            chosen: dict[str, tuple[str, ...]] = {}
            errors = {"": error}
            for label, part in drives.items():
                mine = _of_drive(part, of_drives[label], option.changes, error or 0.0, asked)
                seconds += mine[0]
                chosen[label], errors[label] = mine[1:]
            if seconds < best.seconds:
                best = Found(seconds, option.effects, chosen, errors)
    return best


def _of_drive(
    part: Part, options: list[Option], before: Sequence[float], error: float, asked: Asked
) -> tuple[float, tuple[str, ...], float | None]:
    """Seconds, effects left out and error by its length of a drive's cheapest choice.

    options: the cheapest first. before: changes by what is left out of the case. error: by its record's length.
    """
    best: tuple[float, tuple[str, ...], float | None] = math.inf, (), None
    worth, least = LEAST_SAVING * part.seconds, min(part.shorter.values(), default=1.0)
    for option in options:
        if option.seconds * least >= best[0]:
            break
        changes = [one + other for one, other in zip(option.changes, before, strict=True)]
        # Without teeth there is little left to save.
        lengths = part.shorter.items() if option.seconds * (1.0 - least) > worth else ()
        for own, share in ((None, 1.0), *lengths):
            if option.seconds * share < best[0] and _fits(changes, (error, own or 0.0), asked):
                best = option.seconds * share, option.effects, own
    return best


def _fits(changes: Sequence[float], errors: tuple[float, float], asked: Asked) -> bool:
    """Whether changes, and errors by the lengths of record and drive, stay within the tolerance together."""
    of_record, of_drive = COUNTS * errors[0], COUNTS * errors[1]
    sizes = zip(changes, asked.of_record, asked.of_drive, strict=True)
    return all(math.hypot(change, of_record * one, of_drive * other) <= asked.within for change, one, other in sizes)
