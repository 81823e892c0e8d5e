"""Fronts: measured grids that no other one beats, and the error that they let expect."""

import math
from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, Heterogeneity
from nanoslip.solver.slab import Slab
from nanoslip.study.plan.grids import (
    Front,
    MeasuredGrid,
    as_text,
    discretized,
    load_front,
    pareto_front,
)


def contact(half_width: float, slab: Slab | None = None, **others: object) -> Case:
    """A case whose contact has this half-width on a half-plane."""
    slab = slab or Slab(n_x=17)
    radius = math.pi * half_width**2 / (2e-3 * (1 - slab.poisson))
    return Case(radius=radius, normal_load=1e-3, slab=slab, **others)  # type: ignore[arg-type]


def front(contacts: dict[float, float], slab: Slab | None = None) -> Front:
    """A front of one discretization: half-width of the contact -> error."""
    row = MeasuredGrid(slab or Slab(n_x=17), 1.0, tuple(contacts.values()))
    return Front("here.json", {"processor": "an abacus"}, tuple(contacts), (row,))


def test_equal_points_count_once_and_unknown_ones_never():
    assert pareto_front([1.0, 1.0, 0.5, math.nan], [0.1, 0.1, math.nan, 0.0]).tolist() == [True, False, False, False]
    assert pareto_front([], []).tolist() == []


def test_along_the_front_error_falls_with_time_and_every_other_point_is_beaten():
    rng = np.random.default_rng(5)
    time, error = rng.uniform(size=(2, 200))
    on_front = pareto_front(time, error)
    order = np.argsort(time[on_front])
    assert np.all(np.diff(error[on_front][order]) < 0.0)
    for t, e in zip(time[~on_front], error[~on_front], strict=True):
        assert np.any((time[on_front] <= t) & (error[on_front] <= e))


def test_the_expected_error_is_the_worst_of_the_contacts_about_as_wide():
    found = front({0.1: 0.5, 0.2: 0.01, 0.21: 0.02, 0.3: 0.7})
    assert found.expected_error(contact(0.2)) == 0.02  # 0.21 is within a quarter of 0.2, 0.1 and 0.3 are not


@pytest.mark.parametrize(
    "case",
    [
        contact(0.05),
        contact(0.45),
        contact(0.2, Slab(n_x=33)),
        contact(0.2, Slab(n_x=17, poisson=0.2)),
        contact(0.2, pin="flat_punch"),
        contact(0.2, heterogeneity=Heterogeneity(roughness=((-0.1, 0.0), (0.1, 1e-6)))),
    ],
    ids=["narrower", "wider", "another grid", "another slab", "another pin", "a rough pin"],
)
def test_nothing_is_expected_where_nothing_was_measured(case):
    found = front({0.1: 0.1, 0.2: 0.1, 0.4: 0.1})
    assert math.isfinite(found.expected_error(contact(0.2)))
    assert math.isnan(found.expected_error(case))


def test_nothing_is_expected_between_contacts_that_are_far_apart():
    found = front({0.05: 0.1, 0.4: 0.1})
    assert math.isnan(found.expected_error(contact(0.15)))


def test_a_file_gives_back_what_was_written(tmp_path):
    rows = (
        MeasuredGrid(Slab(n_x=17), 1.0, (0.1, 0.2)),
        MeasuredGrid(Slab(n_x=33, support="frictionless"), 0.25, (1e-17, 0.3)),
    )
    path = tmp_path / "mine.json"
    path.write_text(as_text({"processor": "Zähler"}, (0.1, 0.4), rows), "utf-8")
    found = load_front(path)
    assert (found.name, found.machine["processor"], found.contacts, found.rows) == (
        "mine.json",
        "Zähler",
        (0.1, 0.4),
        rows,
    )


def test_the_shipped_front_knows_the_papers_case_and_gets_better_with_nodes():
    """Not monotone: contacts are made of whole nodes. But four times the nodes are better."""
    shipped, case = load_front(), Case()
    errors = [
        shipped.expected_error(replace(case, slab=discretized(case.slab, {"n_x": n_x, "scheme": "galerkin"})))
        for n_x in (33, 129, 513)
    ]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] > 0.0
