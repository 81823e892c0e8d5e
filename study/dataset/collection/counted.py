"""Texts of an ensemble: what all members say, else how many say what; and the same in few letters, for tables."""

import re
from collections import Counter
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, Final

import numpy as np
import xarray as xr

LONGEST: Final = 30
"""Characters of a counted text in a table; of a longer one the most frequent text is told, and how many say something else."""
_PARTS: Final = re.compile(r"; (?=\d+ )")
_COUNT: Final = re.compile(r"(\d+) ")


def counted(values: Sequence[Any]) -> str:
    """The text that all members have, else every text with the number of members that have it, the most frequent first."""
    counts = Counter(str(value) for value in values)
    if len(counts) == 1:
        return next(iter(counts))
    return "; ".join(f"{count} {text}" for text, count in counts.most_common() if text)


def is_counted(text: str) -> bool:
    """Whether a text begins with a number of members."""
    return _COUNT.match(text) is not None


def _parts(text: str) -> list[tuple[int, str]]:
    """Of a counted text: how many members say what."""
    return [(int(number), said) for number, _, said in (part.partition(" ") for part in _PARTS.split(text))]


def commonest(text: str) -> tuple[str, float]:
    """The text that most members have, and their share of those that have any; all of it of a text that is not counted."""
    if not is_counted(text):
        return text, 1.0
    parts = _parts(text)
    return parts[0][1], parts[0][0] / sum(number for number, _ in parts)


def joined(text: str) -> str:
    """A counted text in which texts that differ in numbers alone are one, the first of them, with the members of all."""
    if not is_counted(text):
        return text
    kinds: dict[str, list[tuple[int, str]]] = {}
    for number, said in _parts(text):
        kinds.setdefault(without_numbers(said), []).append((number, said))
    found = [
        f"{sum(number for number, _ in each)} {each[0][1]}{' (numbers differ)' if len(each) > 1 else ''}"
        for each in sorted(kinds.values(), key=lambda each: -sum(number for number, _ in each))
    ]
    return "; ".join(found)


@lru_cache(maxsize=1024)  # of a million messages few are different
def without_numbers(message: str) -> str:
    """A message without its numbers: what those have in common that differ in nothing else."""
    return re.sub(r"\d[\d.e+-]*", "#", message)


def shortened(text: str) -> str:
    """A counted text in at most `LONGEST` characters where its first words allow it; any other text as it is."""
    first, *others = _PARTS.split(text)
    if len(text) <= LONGEST or not others or not is_counted(first):
        return text
    numbers = [int(found[1]) for each in others if (found := _COUNT.match(each))]
    return f"{first}; {sum(numbers)} others"


def in_short(dataset: xr.Dataset) -> xr.Dataset:
    """A dataset whose counted texts are short, for a table."""
    texts = {str(name): each for name, each in dataset.data_vars.items() if each.dtype.kind == "O"}
    return dataset.assign({name: each.copy(data=_each_shortened(each.values)) for name, each in texts.items()})


def _each_shortened(values: Any) -> Any:
    found = np.empty(values.shape, dtype=object)
    found.ravel()[:] = [shortened(value) if isinstance(value, str) else value for value in values.ravel().tolist()]
    return found
