"""± keeps its promise: twice it holds as often as Student's t says, over cases from all over the map."""

from collections.abc import Iterator
from itertools import count, islice

import numpy as np
import pytest
import scipy.stats

from tests.verification.coverage import OBSERVABLES, Verdict, coverage, drawn, verdicts
from tests.verification.seen import seen

CASES = 16
CHANCE = 1e-3
"""Probability of a failure where ± is right."""
PROMISED = 0.945
"""Probability that means of 8 and of 24 draws alike differ by less than 2 ±, both ± combined, of 100,000 such pairs: not 95.4 %,
as twice a 68 % interval of Student's t is less than a 95 % one."""
IN_BURSTS = ("mean step", "mean drop")
"""What has no ± in records shorter than two spacings, as starts miss the same bursts of events."""


def cheap() -> Iterator[list[Verdict]]:
    """Verdicts of each case on a small grid that has results."""
    for number in count():
        if drawn(number).slab.n_x <= 65 and (found := list(verdicts(number))):
            yield found


@pytest.mark.slow
def test_twice_it_holds_within_what_chance_allows() -> None:
    """Observables of a case come of the same members, so at worst they hold or fail together: a case is one try of a binomial.

    Its share of successes is spread at least as widely as the share over all observables.
    """
    found = list(islice(cheap(), CASES))
    times = np.array([each.times for case in found for each in case])
    once, twice = coverage(times)
    least = float(scipy.stats.binom.ppf(CHANCE, CASES, PROMISED)) / CASES
    line = seen("± and 2 ± hold", f"{CASES} cases, {len(times)} numbers", f"{once:.0%}, {twice:.0%}; least {least:.0%}")
    assert {each.observable for case in found for each in case} == set(OBSERVABLES)
    stated = [each.times for case in found for each in case if each.observable not in IN_BURSTS]
    assert np.mean(np.isfinite(stated)) > 0.8  # what states nothing cannot be wrong
    assert twice >= least, line
