"""The cheapest choice within a tolerance: which effects of a case and its drives go, and how short record and drives are.

All sets of effects of the case are tried with all lengths of its record; each drive then takes what is cheapest for it.
"""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from study.plan.influence.length import COUNTS

Vector = NDArray[np.float64]

LEAST_SAVING: Final = 0.01
"""Share of the time of a case or drive that leaving an effect out, or a shorter length, has to save."""
BEATEN: Final = "others save more within the tolerance"
"""Why something stays that alone could go."""


class Choice(NamedTuple):
    """What was decided of one effect of a case or drive."""

    effect: str
    left_out: bool
    influence: Vector
    """(OBSERVABLES,): expected relative change without it; 0 of what it cannot change, NaN where that is not known."""
    saves: float
    """Seconds, of the case or drive alone, if nothing else is left out."""
    reason: str
    """Why it is not left out; empty where it is."""
    part_of: str = ""
    """The effect that it goes with."""


class Length(NamedTuple):
    """What was decided of the length of a record or drive."""

    error: float | None
    """Relative standard error by its length up to which it is computed; None: to its whole length."""
    saves: float
    """Seconds, if nothing is left out."""
    reason: str
    """Why it is computed to its whole length; empty where it is not."""


class Option(NamedTuple):
    """Effects that can be left out together."""

    seconds: float
    changes: tuple[float, ...]
    """By which they are expected to change what is asked for."""
    effects: tuple[str, ...]


class Part(NamedTuple):
    """The case without its drives, or one drive: what could be left out of it, and its time with everything."""

    seconds: float
    choices: tuple[Choice, ...]
    shorter: Mapping[float, float]
    """Error by its length that it could end at, the largest first -> the share of its time that is left then."""
    stays: str
    """Why it is computed to its whole length; empty where it may be shorter."""

    def options(self, columns: Sequence[int], within: float) -> list[Option]:
        """Every set of effects whose changes stay within the tolerance, the cheapest first. columns: of what is asked for.

        What goes with another effect is no option beside it.
        """
        possible = [
            (each, tuple(each.influence[columns].tolist()), 1.0 - each.saves / self.seconds)
            for each in self.choices
            if not each.reason
        ]
        return sorted(self._together(possible, len(columns), within), key=lambda option: option.seconds)

    def _together(
        self, possible: list[tuple[Choice, tuple[float, ...], float]], observables: int, within: float
    ) -> Iterator[Option]:
        for size in range(len(possible) + 1):
            for chosen in itertools.combinations(possible, size):
                effects = tuple([each[0].effect for each in chosen])
                if any(each[0].part_of in effects for each in chosen):
                    continue
                changes = tuple([sum([each[1][place] for each in chosen]) for place in range(observables)])
                if all(change <= within for change in changes):
                    yield Option(self.seconds * math.prod([each[2] for each in chosen]), changes, effects)

    def taken(self, effects: tuple[str, ...]) -> tuple[Choice, ...]:
        """The choices, with these effects left out."""
        found = []
        for each in self.choices:
            left_out = each.effect in effects
            beaten = f"goes with {each.part_of}" if each.part_of in effects else BEATEN
            found.append(each._replace(left_out=left_out, reason=each.reason or ("" if left_out else beaten)))
        return tuple(found)

    def length(self, error: float | None) -> Length:
        """The length, with this error."""
        if error is not None:
            return Length(error, self.seconds * (1.0 - self.shorter[error]), "")
        if self.stays or not self.shorter:
            return Length(None, 0.0, self.stays or "saves nothing")
        return Length(None, self.seconds * (1.0 - min(self.shorter.values())), BEATEN)


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
