"""So many random cases, what each says of its uncertainties, and a table of how often these hold."""

import math
import sys
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.written_tables import show

FORMS = (".0%", ".0%", ".2%")


@dataclass(frozen=True)
class Verdict:
    """One stated uncertainty: of what, and how often it would have to be taken to reach the truth."""

    observable: str
    case: int
    error: float
    """|value - truth|, over the truth."""
    times: float
    """The same over the stated uncertainty; NaN where none was stated."""


def verdict(observable: str, number: int, value: float, stated: float, truth: float) -> Verdict:
    error = abs(value - truth)
    return Verdict(observable, number, error / abs(truth), error / stated if stated > 0.0 else math.nan)


def table(found: list[Verdict]) -> Iterator[list[object]]:
    """Coverage by observable: how often one and two ± hold, how large errors are, and how often no ± is stated."""
    groups: dict[str, list[Verdict]] = defaultdict(list)
    for verdict in found:
        groups[verdict.observable].append(verdict)
    yield ["of", "cases", "± holds", "2 ± holds", "median error", "not stated"]
    for observable, group in groups.items():
        times, errors = np.array([each.times for each in group]), np.array([each.error for each in group])
        stated = np.isfinite(times)
        one, two = coverage(times)
        missing = 1.0 - stated.mean()
        middle = np.median(errors[stated]) if stated.any() else math.nan
        pairs = zip((one, two, middle), FORMS, strict=True)
        shares = ("–" if math.isnan(share) else f"{share:{form}}" for share, form in pairs)
        yield [observable, len(group), *shares, f"{missing:.0%}"]


def coverage(times: np.ndarray) -> tuple[float, float]:
    """Share of stated uncertainties that hold once, and twice, as an average over what was stated."""
    stated = times[np.isfinite(times)]
    return (float(np.mean(stated <= 1.0)), float(np.mean(stated <= 2.0))) if len(stated) else (math.nan, math.nan)


def measure(verdicts: Callable[[int], Iterable[Verdict]], wanted: int, path: Path) -> None:
    """Measure cases until so many say something, print their table, and write it there.

    verdicts: of the case of a number; none where it is left out. wanted: unless the command line says how many.
    """
    wanted = int(sys.argv[1]) if len(sys.argv) > 1 else wanted
    found: list[Verdict] = []
    taken = number = 0
    while taken < wanted:
        new = list(verdicts(number))
        taken, number = taken + bool(new), number + 1
        found += new
        print(f"case {number - 1}: {'left out' if not new else taken}", file=sys.stderr, flush=True)
    show(table(found), path)
