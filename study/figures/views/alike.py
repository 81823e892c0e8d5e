"""Numbers that need no figure, told in one sentence: the same in all cases, known of one case only, or of none."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from nanoslip.solver.view import with_error
from nanoslip.study.figures.points import Points, words

ROUNDING: Final = 1e-9
"""Share of a number by which others may differ from it and be the same."""


def differs(points: Points) -> bool:
    """Whether a figure has something to show: two values that are not the same but for rounding."""
    values = points.values[points.there]
    if not points.axes or not len(values):
        return False
    if points.text:
        return len(set(values.tolist())) > 1
    return bool(np.ptp(values) > ROUNDING * np.abs(values).max())


def in_words(found: Sequence[Points]) -> Iterator[str]:
    """A sentence for each of several numbers that do not differ, and one that names all those that no case has."""
    for points in found:
        if points.there.any():
            yield f"{sentence(points.label)}: {_value(points)}{_where(points)}{_care(points)}."
    unknown = [points.label for points in found if not points.there.any()]
    if unknown:
        yield f"Not known of any case: {', '.join(unknown)}."


def sentence(text: str) -> str:
    """A text that begins with a capital letter."""
    return text[0].upper() + text[1:]


def _value(points: Points) -> str:
    first = int(np.flatnonzero(points.there)[0])
    value = points.values[first]
    if points.text:
        return str(value).replace("_", "-")
    return with_error(float(value), float(points.errors[first])) if points.stated else f"{value:.5g}"


def _care(points: Points) -> str:
    """Which of the values are to be taken with care, as hollow points are in a figure."""
    flagged, known = int((points.flagged & points.there).sum()), int(points.there.sum())
    which = "" if flagged == known else f"{flagged} of them "
    return f"; {which}to be taken with care" if flagged else ""


def _where(points: Points) -> str:
    """Of which cases a value is that all of them share that have any."""
    known, count = int(points.there.sum()), len(points.values)
    if count == 1:
        return ""
    if known == count:
        return " in all cases"
    if known > 1:
        return f" in all cases that have it, {known} of {count}"
    place = {name: values[points.there].tolist()[0] for name, values in points.axes.items()}
    return f" at {words(place)}, the only one of {count} that has it" if place else ""
