"""What limits the accuracy of a case's numbers, and what half of each limit would cost."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from solver.case import Case
from solver.sliding.sampling import Sampling
from study.discretization.front import Front
from study.plan.cost.seconds import compliance_seconds, record_seconds, touch_seconds
from study.plan.cost.sliding import contact_nodes, expected_displacement, expected_peak_scatter, sampling_over
from study.plan.influence.decision import Decision, Tolerance


@dataclass(frozen=True, slots=True)
class Limit:
    """One reason why numbers of a case are not exact."""

    what: str
    of: str
    """The numbers that it limits."""
    size: float
    """Relative error, or standard error; NaN where it is not known."""
    half: str
    """What halves it; empty where nothing does."""
    costs: float
    """By how much the time of the case grows then; NaN where nothing halves it."""


def limits_of(decision: Decision, tolerance: Tolerance, front: Front) -> list[Limit]:
    """All of them, the largest first."""
    found = [_grid(decision.case, front, tolerance.slides)]
    if tolerance.slides:
        found.append(_length(decision.case))
    if ONE_EVENT & set(tolerance.asked_for):
        found.append(_start(decision.case))
    if decision.case.heterogeneity.spread:
        found.append(_draw(decision.case))
    found += _left_out(decision, tolerance)
    return sorted(found, key=lambda each: -each.size if math.isfinite(each.size) else 0.0)


def _grid(case: Case, front: Front, slides: bool) -> Limit:
    """The error of the grid, and the fastest measured grid that has half of it."""
    error = front.expected_error(case)
    of = "contact, approach, stiffness"
    contacts = front.comparable(case)
    better = [
        row
        for row in front.like(case.slab)
        if row.slab.scheme.name == case.slab.scheme.name and front.worst_error(row.slab, contacts) <= 0.5 * error
    ]
    if not better:
        return Limit("grid", of, error, "", math.nan)
    best = min(better, key=lambda row: row.seconds)
    finer = replace(case, slab=best.slab)
    costs = _seconds(finer, slides) / _seconds(case, slides)
    return Limit(
        "grid", of, error, f"n_x = {best.slab.n_x}, {best.slab.scheme} (another surface for what slips)", costs
    )


def _length(case: Case) -> Limit:
    """What the record's length leaves open of its plateau, and the length that leaves half of it open."""
    spacings = expected_displacement(case) / case.slab.spacing
    size = _left_open(case, spacings)
    longer = next((each for each in spacings * LONGER if _left_open(case, each) <= 0.5 * size), None)
    of = "plateau, kinetic friction"
    if longer is None:
        return Limit("length of the record", of, size, "", math.nan)
    grown = replace(case.whole, max_events=None, max_displacement=None, max_spacings=float(longer))
    costs = record_seconds(grown) / record_seconds(case)
    return Limit("length of the record", of, size, f"spacings = {longer:.2g}", costs)


def _left_open(case: Case, spacings: float) -> float:
    """Relative standard error of a plateau over so many node spacings, whatever the nodes' μ_i are."""
    return replace(sampling_over(case, spacings), spread=0.0).expected_of_mean_force


LONGER: Final = np.geomspace(1.0, 100.0, 400)
"""Lengths of a record that are looked at, over its own."""


ONE_EVENT: Final = {"static_friction", "peak_friction"}
"""Numbers that are one event of each start of the pin: no longer record knows them better."""


def _start(case: Case) -> Limit:
    """By how much such a number differs between starts, which an ensemble averages."""
    return Limit("start of the pin", "static and peak friction", expected_peak_scatter(case), "4 × the members", 4.0)


def _draw(case: Case) -> Limit:
    """What one draw of the nodes' μ_i leaves open, which an ensemble averages."""
    sampling = Sampling(
        expected_displacement(case) / case.slab.spacing, contact_nodes(case), spread=case.heterogeneity.spread
    )
    return Limit("draw of the nodes' μ_i", "plateau, friction", sampling.disorder, "4 × the members", 4.0)


def _left_out(decision: Decision, tolerance: Tolerance) -> Iterator[Limit]:
    """What effects that are left out change, and what it costs to keep the one that matters most."""
    for label in decision.of_drives or ("",):
        changes = decision.influence(label)[tolerance.columns]
        if not changes.any():
            continue
        worst = max(
            (each for each in (*decision.of_case, *decision.of_drives.get(label, ())) if each.left_out),
            key=lambda each: float(np.max(each.influence[tolerance.columns])),
        )
        costs = (decision.seconds + worst.saves) / decision.seconds
        what = f"effects left out{f' of {label}' if label else ''}"
        of = ", ".join(tolerance.asked_for)
        yield Limit(what, of, float(np.max(changes)), f'keep = ["{worst.effect}"]', costs)


def _seconds(case: Case, slides: bool) -> float:
    return compliance_seconds(case, slides) + (record_seconds(case) if slides else touch_seconds(case))
