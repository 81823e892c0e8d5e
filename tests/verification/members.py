"""How often ± holds of ensembles that get members until they know enough, after one such look, after two, and at given sizes.

Sixteen starts of a case are four ensembles of four, two of eight and one of sixteen, each spread evenly: four ways to begin with
four members and to double them. What ± is to cover is the mean over all starts and four node spacings, as in
tests/verification/calibration. `python -m tests.verification.members` measures the table, tests/verification/members.md.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from solver.elasticity.compliance import surface_compliance
from solver.outcome import SolverError
from solver.sliding.plateau import plateau_of
from solver.sliding.sampling import ensemble_uncertainty
from tests.verification.calibration import cut, drawn, records
from tests.verification.random_cases import Verdict, measure, verdict

STARTS = 16
LENGTHS = (0.1, 0.3, 1.0)
"""Of the members' records, in node spacings."""
LONGEST = 4.0
TARGETS = {"1%": 0.01, "0.3%": 0.003, "0.1%": 0.001}
LOOKS = {"one look": 1, "two looks": 2}
"""That have to be content in a row."""
SIZES = (4, 8, 16)
MOST_EVENTS = 60_000
"""Cases with more in a record are left out: they would take minutes each."""

Numbers = NDArray[np.float64]


def verdicts(number: int) -> Iterator[Verdict]:
    """Every uncertainty that ensembles of the case of this number state; nothing of a case that does not go so far."""
    case = replace(drawn(number), max_events=MOST_EVENTS)
    try:
        runs = records(case, surface_compliance(case.slab), STARTS)
    except SolverError:
        return
    if not runs:
        return
    truth = float(np.nanmean([plateau_of(run).mean for run in runs]))
    for length in LENGTHS:
        plateaus = [plateau_of(cut(run, length)) for run in runs]
        table = np.array([(each.mean, each.uncertainty) for each in plateaus])
        for size in SIZES:
            for begin in range(STARTS // size):
                yield verdict(
                    "plateau", f"{size} starts of {length:g}", number, *known(table, begin, size, length), truth
                )
        for (label, target), (words, looks) in ((a, b) for a in TARGETS.items() for b in LOOKS.items()):
            for begin in range(STARTS // SIZES[0]):
                found = ended(table, begin, length, target, looks)
                yield verdict("plateau", f"starts of {length:g} until {label}, {words}", number, *found, truth)


def known(table: Numbers, begin: int, size: int, length: float) -> tuple[float, float]:
    """Mean and uncertainty of so many members. table: (STARTS, 2), plateaus and what they state."""
    step = STARTS // size
    members = table[begin % step :: step]
    here = np.isfinite(members[:, 0])
    mean = float(members[here, 0].mean()) if here.any() else math.nan
    return mean, ensemble_uncertainty(members[:, 0], members[:, 1], length)


def ended(table: Numbers, begin: int, length: float, target: float, looks: int) -> tuple[float, float]:
    """The same of the ensemble that began with these four and ended at its target; NaN where it did not get there."""
    content = 0
    for size in SIZES:
        mean, stated = known(table, begin, size, length)
        content = content + 1 if stated <= target * abs(mean) else 0
        if content == looks:
            return mean, stated
    return math.nan, math.nan


if __name__ == "__main__":
    told = f"not stated is what did not get to its target with {SIZES[-1]} members."
    measure(verdicts, 55, Path(__file__).with_suffix(".md"), f"mixed cases, {STARTS} starts each; {told}")
