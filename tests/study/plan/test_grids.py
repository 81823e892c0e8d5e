"""Fronts: measured grids that no other one beats; an accuracy is kept by the cheapest of them, or refused with the reason."""

import math
from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, Heterogeneity
from nanoslip.solver.slab import Slab
from nanoslip.study.manifest.problems import ManifestError
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.grids import (
    Front,
    Measured,
    UnreachableError,
    as_text,
    cheapest,
    discretized,
    load_front,
    pareto_front,
)
from nanoslip.study.plan.plan import make_plan


def contact(half_width: float, slab: Slab | None = None, **others: object) -> Case:
    """A case whose contact has this half-width on a half-plane."""
    slab = slab or Slab(n_x=17)
    radius = math.pi * half_width**2 / (2e-3 * (1 - slab.poisson))
    return Case(radius=radius, normal_load=1e-3, slab=slab, **others)  # type: ignore[arg-type]


def front(contacts: dict[float, float], slab: Slab | None = None) -> Front:
    """A front of one discretization: half-width of the contact -> error."""
    row = Measured(slab or Slab(n_x=17), 1.0, tuple(contacts.values()))
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
    rows = (Measured(Slab(n_x=17), 1.0, (0.1, 0.2)), Measured(Slab(n_x=33, support="frictionless"), 0.25, (1e-17, 0.3)))
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


WIDE, NARROW = Case(radius=200.0), Case(radius=20.0)  # half-widths 0.29 and 0.09


CONTACTS = (0.05, 0.085, 0.1, 0.2, 0.29, 0.4)


def grid(n_x: int, wide: float, narrow: float, seconds: float) -> Measured:
    """A Galerkin grid's errors with narrow contacts and with wide ones."""
    return Measured(Slab(n_x=n_x, scheme="galerkin"), seconds, (narrow, narrow, narrow, wide, wide, wide))


ROWS = (
    grid(17, 0.1, 0.3, 1.0),
    grid(33, 0.05, 0.1, 2.0),
    grid(65, 0.04, 0.05, 9.0),  # beaten by the next one
    grid(129, 0.01, 0.04, 8.0),
    Measured(Slab(n_x=9, scheme="biquadratic"), 0.1, (1e-6,) * 6),
)
FRONT = Front("here.json", {}, CONTACTS, ROWS)


@pytest.mark.parametrize(("accuracy", "n_x"), [(0.2, 17), (0.1, 17), (0.09, 33), (0.045, 129), (0.01, 129)])
def test_the_cheapest_that_is_good_enough_is_chosen(accuracy, n_x):
    assert cheapest(FRONT, [WIDE], accuracy).n_x == n_x


def test_it_is_good_enough_for_the_most_demanding_case():
    assert cheapest(FRONT, [WIDE, NARROW], 0.1).n_x == 33


def test_what_is_out_of_reach_is_refused_with_the_best_there_is():
    with pytest.raises(UnreachableError, match=r"0\.04 or more.*n_x = 129, scheme = galerkin"):
        cheapest(FRONT, [NARROW, WIDE], 0.03)


@pytest.fixture
def campaign(tmp_path):
    """A campaign that asks for an error, and its front beside it."""
    (tmp_path / "here.json").write_text(as_text({}, CONTACTS, ROWS))
    path = tmp_path / "mine.toml"
    path.write_text('title = "-"\naccuracy = 0.1\nfront = "here.json"\n[axes]\nradius = [20.0, 200.0]\n')
    return path


def test_a_plan_has_the_grid_that_was_chosen(campaign):
    plan = make_plan(load_manifest(campaign))
    assert {case.case.slab.n_x for case in plan.cases if case.case} == {33}
    assert plan.manifest.tables["numerics"]["n_x"] == 33
    assert plan.manifest.accuracy == 0.1


def test_the_command_says_which_grid_was_chosen(main, campaign):
    code, said, _ = main("plan", campaign)
    assert code == 0
    assert (
        "accuracy = 0.1: n_x = 33, scheme = galerkin, rows_per_level = 2, coarsest_row = 17, bottom_row = 33\n" in said
    )


def test_a_campaign_whose_cases_are_all_refused_says_why_though_there_is_no_grid_to_choose(main, campaign):
    """Its plan was an IndexError."""
    campaign.write_text(campaign.read_text() + "[constants]\nintrinsic_friction = inf\n[slip]\nresidual_shear = 1.0\n")
    code, said, _ = main("plan", campaign)
    assert code == 0
    assert "2 cases of 8 members, 2 of them refused" in said
    assert "needs a finite μ_i, as it slides at μ_i·pressure (and 1 more)" in said
    assert "accuracy" not in said


def test_a_front_that_is_not_there_is_missed_before_anything_is_computed(campaign):
    campaign.write_text(campaign.read_text().replace("accuracy = 0.1\n", "").replace("here.json", "there.json"))
    with pytest.raises(ManifestError, match=r"there\.json: cannot be read"):
        make_plan(load_manifest(campaign))


def test_a_plan_out_of_reach_names_file_and_value(campaign):
    campaign.write_text(campaign.read_text().replace("0.1", "0.001"))
    with pytest.raises(ManifestError, match=r"mine\.toml: accuracy = 0\.001: needs 0\.04 or more"):
        make_plan(load_manifest(campaign))


@pytest.mark.parametrize(
    ("more", "where"),
    [
        ("[numerics]\nn_x = 33", r"numerics\.n_x: needs to be left out beside accuracy = 0\.1"),
        ('[numerics]\nscheme = "biquadratic"', r"numerics\.scheme: needs to be left out"),
        ("n_x = [17, 33]", r"axes\.n_x\[0\]: needs to be left out"),
    ],
)
def test_a_grid_beside_it_is_refused_by_name(campaign, more, where):
    campaign.write_text(campaign.read_text() + more)
    with pytest.raises(ManifestError, match=where):
        load_manifest(campaign)


@pytest.mark.parametrize("wrong", ["0", "1.0", "-0.1", "true", '"fine"', "nan"])
def test_no_relative_error_is_refused(campaign, wrong):
    campaign.write_text(campaign.read_text().replace("accuracy = 0.1", f"accuracy = {wrong}"))
    with pytest.raises(ManifestError, match=r"needs a relative error, 0 < accuracy < 1"):
        load_manifest(campaign)


def test_support_is_no_matter_of_accuracy(campaign):
    campaign.write_text(campaign.read_text() + '[numerics]\nsupport = "bonded"\n')
    assert len(make_plan(load_manifest(campaign)).cases) == 2


@pytest.mark.parametrize(
    ("axes", "said"),
    [
        (
            "radius = [50, 200, 1000, 2000]",
            r"radius = 1000.0, .* \(and 1 more\): Hertz's a/L_x = 0\.651, .* 0\.04 to 0\.42$",
        ),
        ("pin = ['parabola', 'flat_punch']", "pin = flat_punch: pin = flat_punch$"),
        ("poisson = [0.3, 0.41]", "it lacks the case .*poisson = 0.41: aspect_ratio = 1.0, poisson = 0.41, support"),
    ],
)
def test_the_case_that_the_front_lacks_is_named_with_what_is_lacking(tmp_path, axes, said):
    path = tmp_path / "mine.toml"
    path.write_text(f'title = "x"\naccuracy = 0.01\n[axes]\n{axes}\n')
    with pytest.raises(ManifestError, match=said):
        make_plan(load_manifest(path))
