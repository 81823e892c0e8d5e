"""The numbers of a record's events are those of its sizes, each declared for datasets."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from solver.case import Case
from solver.elasticity.compliance import surface_compliance
from solver.quantity import quantities
from solver.slab import Slab
from solver.sliding.distributions.events import DISCRETE, event_sizes, rank_correlation
from solver.sliding.distributions.goodness import power_law_sizes
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


def test_drops_of_a_power_law_have_its_scaling_range() -> None:
    """Falls from 1e-8 on, over the load of 1e-3, with τ = 1.8; their energies go as their squares: τ = 1.4."""
    rng = np.random.default_rng(11)
    drops = power_law_sizes(rng, 800, 1.8, 1e-8, False)
    drops = drops[drops < 1e-5]
    record = record_from(rng.exponential(1e-6, len(drops)), drops, initial_force=1e-4)
    found = event_distributions(record, plateau_of(record), draws=20)
    assert found.drop_scaling_decades > 1.5
    assert 1e-5 <= found.drop_scaling_first < found.drop_scaling_last <= 1e-2
    assert abs(found.drop_scaling_exponent - 1.8) < 3.0 * found.drop_scaling_exponent_uncertainty
    assert abs(found.energy_scaling_exponent - 1.4) < 3.0 * found.energy_scaling_exponent_uncertainty
    assert found.drop_scaling_goodness >= 0.1
    assert found.drop_scaling_events > 100


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
    assert (found.slips_scaling_events, found.slips_scaling_decades) == (0, 0.0)
    assert math.isnan(found.slips_scaling_exponent)
