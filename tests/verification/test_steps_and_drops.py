"""± of mean step and mean drop per event: twice it reaches the mean of the other starts, also where a few large events carry the
mean, where the record ends amid a node spacing, and where the pin has hardly begun to slide."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from solver.case import Case, Effects, Heterogeneity
from solver.elasticity.compliance import surface_compliance
from solver.slab import Slab
from solver.sliding.record import FrictionRecord
from solver.sliding.sampling import ensemble_uncertainty
from solver.sliding.statistics import EventStatistics, event_statistics
from tests.verification.calibration import cut, records
from tests.verification.seen import seen

ON_A_HIGH_SLAB = Case(
    intrinsic_friction=0.67,
    radius=30.44,
    slab=Slab(65, 2.0, 0.16, scheme="galerkin"),
    max_events=50_000,
    max_spacings=4.0,
)
"""Slides only after a third of a node spacing: all drops until then are small, whatever the start."""
WITHOUT_COUPLING = tuple(
    Case(
        intrinsic_friction, radius, 1e-3, Slab(65), effects=Effects(coupling=False), max_events=50_000, max_spacings=4.0
    )
    for intrinsic_friction, radius in ((0.3, 20.0), (0.5, 10.0), (0.5, 40.0), (0.8, 20.0), (0.8, 80.0), (0.6, 60.0))
)
ROUGH = tuple(
    replace(
        case,
        effects=Effects(),
        heterogeneity=Heterogeneity(
            roughness=tuple((xi, 2e-5 * math.sin(900.0 * xi)) for xi in np.linspace(-0.1, 0.1, 25))
        ),
    )
    for case in WITHOUT_COUPLING
)
MEANS = "mean_step", "mean_drop"


@cache
def runs(case: Case) -> list[FrictionRecord]:
    found = records(case, surface_compliance(case.slab))
    assert found
    return found


@cache
def known(case: Case, spacings: float) -> list[EventStatistics]:
    return [event_statistics(cut(run, spacings)) for run in runs(case)]


def times(case: Case, spacings: float, name: str) -> np.ndarray:
    """Distance to the mean of the other starts, over ±; NaN where none is stated."""
    best = np.array([getattr(each, name) for each in known(case, 4.0)])
    values, stated = (
        np.array([getattr(each, part) for each in known(case, spacings)]) for part in (name, name + "_uncertainty")
    )
    others = (best.sum() - best) / (len(best) - 1)
    return np.abs(values - others) / stated


@pytest.mark.parametrize("name", MEANS)
@pytest.mark.parametrize("spacings", [1.0, 1.5, 2.0])
def test_twice_it_holds_where_small_events_come_by_the_hundred(spacings: float, name: str) -> None:
    """Twelve hard cases: it held in 68 % at one and a half spacings and in 61 % at two, when all was thought to repeat with
    the nodes. Eight starts of a case are no independent tries: 0.86, 0.91 and 0.82 seen at the least."""
    found = np.concatenate([times(case, spacings, name) for case in (*WITHOUT_COUPLING, *ROUGH)])
    stated = found[np.isfinite(found)]
    held = float(np.mean(stated <= 2.0))
    line = seen(f"{name} of {spacings:g} spacings", "0.95", f"{held:.2f} of {len(stated)}")
    assert len(stated) > 0.9 * len(found), line
    assert held > 0.8, line


@pytest.mark.parametrize("name", MEANS)
@pytest.mark.parametrize("spacings", [0.15, 0.3, 0.5, 1.0, 2.0])
def test_a_pin_that_has_hardly_begun_to_slide_states_none_or_one_that_holds(spacings: float, name: str) -> None:
    """All starts alike have dropped next to nothing while the force rose: their ensemble would agree on too little."""
    found = times(ON_A_HIGH_SLAB, spacings, name)
    assert np.sum(found > 2.0) <= 1
    members = known(ON_A_HIGH_SLAB, spacings)
    values, stated = (np.array([getattr(each, part) for each in members]) for part in (name, name + "_uncertainty"))
    mean = float(np.average(values, weights=[each.events for each in members]))
    truth = float(np.mean([getattr(each, name) for each in known(ON_A_HIGH_SLAB, 4.0)]))
    assert not abs(mean - truth) > 2.0 * ensemble_uncertainty(values, stated, spacings)
