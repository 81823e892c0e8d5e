"""The numbers of a record's events are those of its sizes, each declared for datasets."""

import math
from dataclasses import fields, replace

import pytest

from solver.case import Case
from solver.elasticity.compliance import surface_compliance
from solver.quantity import quantities
from solver.slab import Slab
from solver.sliding.distributions.events import DISCRETE, event_sizes, rank_correlation
from solver.sliding.distributions.record import EventDistributions, event_distributions
from solver.sliding.distributions.size_distribution import size_distribution
from solver.sliding.events import slide
from solver.sliding.plateau import Plateau, plateau_of
from tests.synthetic import noisy_record, record_from


def test_every_number_is_declared_and_every_uncertainty_is_one() -> None:
    known = quantities(EventDistributions)
    assert list(known) == [item.name for item in fields(EventDistributions)]
    for each in known.values():
        assert not each.uncertainty or each.uncertainty in known
    assert {f"{size}_exponent" for size in DISCRETE} <= set(known)


def test_they_are_those_of_the_steady_part() -> None:
    case = Case(slab=Slab(33), radius=50.0, max_events=1500)
    record = slide(case, surface_compliance(case.slab))
    plateau = plateau_of(record)
    assert plateau.outcome.ok
    found = event_distributions(record, plateau, draws=5)
    sizes = event_sizes(record, plateau.start)
    assert 100 < found.sized_events == len(sizes.slips) < 1500
    slips = size_distribution(sizes.slips, discrete=True, draws=5)
    assert (found.slips_exponent, found.slips_cutoff) == (slips.exponent, slips.cutoff)
    assert found.slips_preferred == slips.preferred
    drop = size_distribution(sizes.drop, discrete=False, draws=5)
    assert (found.drop_exponent, found.drop_goodness) == (drop.exponent, drop.goodness)
    assert found.drop_step_correlation == rank_correlation(sizes.drop, sizes.step)


def test_a_record_without_a_steady_part_counts_as_a_whole() -> None:
    record = noisy_record(events=200)
    nowhere: Plateau = replace(plateau_of(record), start=math.nan)
    assert event_distributions(record, nowhere, draws=0).sized_events == 200


def test_equal_steps_vary_by_nothing_and_few_events_say_nothing() -> None:
    record = record_from([1e-6] * 5, [1e-8] * 5, initial_force=1e-6)
    found = event_distributions(record, plateau_of(record), draws=0)
    assert found.step_variation == pytest.approx(0.0, abs=1e-9)
    assert math.isnan(found.step_correlation)
    assert found.slips_preferred is None
