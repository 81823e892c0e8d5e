"""± means what it says: of sixteen mixed cases, how often the truth is within one and two of the stated uncertainties."""

import math
from dataclasses import replace

import numpy as np
import pytest

from solver.elasticity.compliance import surface_compliance
from solver.sliding.events import slide
from solver.sliding.plateau import BLOCKS, mean_uncertainty, plateau_of, teeth
from tests.verification.calibration import STARTS, drawn, verdicts
from tests.verification.random_cases import Verdict
from tests.verification.seen import seen

pytestmark = pytest.mark.slow

CASES = (2, 4, 6, 9, 10, 11, 18, 21, 22, 23, 24, 27, 30, 31, 32, 33)
"""The first sixteen that go as far as the truth needs within some two seconds; chosen by that alone."""
FEWEST, MOST_OF_ONE = {1.0: 5 / 16, 2.0: 10 / 16}, 15.5 / 16
"""What coverage chance allows at the least, and of one ± at the most.

Cases are independent, the eight starts of one are not: at worst all of a case hold, or none. Then the share that holds is a
binomial of 16 trials, with 0.68 for one and 0.9 for two standard errors (scatter estimated from few blocks has longer tails
than a Gaussian's 0.95): 5 of 16 or fewer have a probability of 0.3 %, 10 of 16 or fewer of 0.3 %, 16 of 16 of 0.2 %.
"""


@pytest.fixture(scope="module")
def measured() -> dict[int, list[Verdict]]:
    """All verdicts of every case."""
    return {number: list(verdicts(number)) for number in CASES}


def times(measured: dict[int, list[Verdict]], observable: str, source: str) -> list[np.ndarray]:
    """Of every case, how often the stated uncertainties would have to be taken to reach the truth; NaN where none was."""
    return [
        np.array([each.times for each in found if (each.observable, each.source) == (observable, source)])
        for found in measured.values()
    ]


def held(cases: list[np.ndarray], factor: float) -> float:
    """Share of uncertainties that hold when taken so often; cases count alike."""
    stated = [case[np.isfinite(case)] for case in cases]
    return float(np.mean([np.mean(case <= factor) for case in stated if len(case)]))


def test_chance_is_what_the_bounds_say() -> None:
    for probability, most in ((0.68, 5), (0.9, 10)):
        few = sum(math.comb(16, k) * probability**k * (1.0 - probability) ** (16 - k) for k in range(most + 1))
        assert few < 0.005
    assert 0.68**16 < 0.005


@pytest.mark.parametrize("source", ["0.3", "1", "4"])
@pytest.mark.parametrize("observable", ["plateau", "mean step", "mean drop", "μ_k"])
def test_single_records_state_uncertainties_that_hold(
    measured: dict[int, list[Verdict]], observable: str, source: str
) -> None:
    cases = times(measured, observable, source)
    assert all(len(case) == STARTS for case in cases)
    assert (
        sum(bool(np.isfinite(case).any()) for case in cases) >= 14
    )  # a plateau of 0.3 spacings may be refused everywhere
    one, two = held(cases, 1.0), held(cases, 2.0)
    line = seen(f"coverage of {observable} from {source} spacings", "0.68 and 0.95", f"{one:.2f} and {two:.2f}")
    assert FEWEST[1.0] < one < MOST_OF_ONE, line
    assert two > FEWEST[2.0], line


@pytest.mark.parametrize("source", ["8 starts of 0.3", "8 starts of 1"])
def test_ensembles_state_uncertainties_that_hold(measured: dict[int, list[Verdict]], source: str) -> None:
    """One verdict for each case: an ordinary binomial. An upper bound is left out, as 8 starts are a good part of the truth."""
    cases = times(measured, "plateau", source)
    one, two = held(cases, 1.0), held(cases, 2.0)
    line = seen(f"coverage of the plateau from {source} spacings", "0.68 and 0.95", f"{one:.2f} and {two:.2f}")
    assert one > FEWEST[1.0], line
    assert two > FEWEST[2.0], line


def test_blocks_alone_would_not_have_held(measured: dict[int, list[Verdict]]) -> None:
    """The standard error of blocks, for the same means of 0.3 spacings: this is what the bounds above are to tell apart."""
    before = []
    for number, known in zip(CASES, times(measured, "plateau", "0.3"), strict=True):
        case = replace(drawn(number), max_spacings=0.3)
        compliance = surface_compliance(case.slab)
        again = np.full(STARTS, math.nan)
        for member in range(STARTS):
            record = slide(replace(case, start=(member + 0.5) / STARTS), compliance)
            plateau = plateau_of(record)
            if plateau.outcome.ok:
                blocks = teeth(record).block_means(plateau.start, plateau.end, BLOCKS)
                again[member] = known[member] * plateau.uncertainty * record.normal_load / mean_uncertainty(blocks)
        assert np.array_equal(np.isfinite(again), np.isfinite(known))  # a cut record is a shorter one
        before.append(again)
    one, two = held(before, 1.0), held(before, 2.0)
    line = seen("coverage of block standard errors, 0.3 spacings", "far below", f"{one:.2f} and {two:.2f}")
    assert one < FEWEST[1.0], line
    assert two < FEWEST[2.0] / 2.0, line
