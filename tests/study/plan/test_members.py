"""A task computes the members of a case: a prefix of more of them, as many as a target takes, and some without the others."""

import itertools
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from nanoslip.solver.case import Case, Heterogeneity
from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics import duration
from nanoslip.solver.effects import SPARED
from nanoslip.solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from nanoslip.solver.ensemble import Ensemble, mean_of, omission_error
from nanoslip.solver.outcome import COMPLETED, Ending, InvalidInput, Outcome
from nanoslip.solver.parameter import SHARED_ERROR, quantity
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding import slide as sliding
from nanoslip.solver.sliding.coarsening import double_spacing
from nanoslip.solver.sliding.plateau import Plateau
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.slide import slide
from nanoslip.study.manifest.manifest import KNOWABLE
from nanoslip.study.tasks import compute
from nanoslip.study.tasks.compliance import compliance_task
from nanoslip.study.tasks.compute import error_of_starts, joint_outcome, member_numbers, run_task, whole_again
from nanoslip.study.tasks.drive import KIND as DRIVES, PAIRS, drive_task
from nanoslip.study.tasks.kind import KINDS, Member, Part, uncertain_names
from nanoslip.study.tasks.record import KIND as RECORD, compute_record, record_scalars_task, record_task
from nanoslip.study.tasks.statistics import statistics_task
from nanoslip.study.tasks.task import TaskResult
from tests.study.plan.running import DRIVE, run

CASE = Case(radius=50.0, slab=Slab(17), max_events=None, max_presliding=4.0)
FOUR = Ensemble(4)
COLUMNS = ("displacement", "force_before", "force_after", "kind", "slips", "node_slips")


def records(ensemble: Ensemble, case: Case = CASE) -> TaskResult:
    return run(compliance_task(case.slab), record_task(case, ensemble))


REFUSED = Outcome(Ending.INVALID, "why", cause="why")


def refuse(monkeypatch: pytest.MonkeyPatch, *numbers: int) -> None:
    """Make the physics refuse the members of these numbers."""
    slide_to_state = sliding.slide_to_state
    refused = [FOUR.case(CASE, number) for number in numbers]

    def slid(case: Case, *others: Any) -> Any:
        if case in refused:
            raise InvalidInput(REFUSED.message)
        return slide_to_state(case, *others)

    monkeypatch.setattr(sliding, "slide_to_state", slid)


@pytest.mark.parametrize("spread", [0.0, 0.2])
def test_each_member_comes_back_as_its_own_case_slides(spread):
    case = replace(CASE, heterogeneity=Heterogeneity(spread=spread))
    result = records(Ensemble(3), case)
    for number in range(3):
        again = whole_again(FrictionRecord, result, number)
        alone = slide(Ensemble(3).case(case, number), surface_compliance(case.slab))
        for name in COLUMNS:
            np.testing.assert_array_equal(getattr(again, name), getattr(alone, name))
    assert len({whole_again(FrictionRecord, result, number).final_force for number in range(3)}) == 3


@pytest.mark.parametrize("n_x", [17, 65, 129])
def test_what_is_kept_of_one_members_contact_changes_no_bit_of_anothers(n_x):
    """Systems, answers and tableaus are kept with a compliance that nobody can change, and of no other."""
    case = Case(slab=Slab(n_x), max_events=60)
    kept = surface_compliance(case.slab)
    nothing_kept = SurfaceCompliance(kept.matrix.copy(), kept.slab)
    for whole in (False, True):
        together, alone = (
            member_numbers(
                RECORD,
                [compute_record(FOUR.case(case, number), compliance, FOUR, {}) for number in range(4)],
                scalars_only=not whole,
            )
            for compliance in (kept, nothing_kept)
        )
        np.testing.assert_equal(together, alone)
        assert bool(together[1]) == whole


SHARED = f"plateau_mean{SHARED_ERROR}"


@pytest.fixture
def one_grid(monkeypatch):
    """No grid with twice the spacing: starts alone decide."""
    monkeypatch.setattr(compute, "double_spacing", lambda case: None)


@pytest.mark.usefixtures("one_grid")
def test_a_target_doubles_the_members_until_they_know_enough():
    names = ("plateau_mean",)
    found = {size: records(Ensemble(size)).scalars for size in (3, 6)}
    at = {size: mean_of(np.array(each["plateau_mean"]), each[SHARED][0]) for size, each in found.items()}
    reached = {size: float(2.0 * mean.uncertainty / mean.mean) for size, mean in at.items()}
    for asked, size in ((1.01 * reached[3], 3), (min(reached[3], reached[6]) * 1e-3, 12)):
        assert len(records(Ensemble(12, asked, names)).scalars["plateau_mean"]) == size
    if reached[6] < reached[3]:
        assert len(records(Ensemble(12, math.sqrt(reached[3] * reached[6]), names)).scalars["plateau_mean"]) == 6


@pytest.mark.parametrize(("within", "change"), [*itertools.product((0.01, 0.1), (0.0, 0.001, 0.009, 0.05, math.nan))])
def test_starts_and_spacing_together_are_within_the_target_or_the_spacing_alone_is_not(within, change):
    allowed = error_of_starts(within, change)
    if math.isnan(change):
        assert allowed == within
    elif allowed + change > within * (1.0 + 1e-12):
        # Then starts add in squares, at most, half a percent to what the spacing decides.
        assert math.hypot(change, 0.5 * allowed) <= 1.0051 * change
        assert (1.0 + 2.0 * compute.ENOUGH) * change > within
    assert allowed > 0.0


def coarse_records(ensemble: Ensemble) -> TaskResult:
    """Records of members on twice the node spacing, as a campaign on that grid computes them."""
    case = double_spacing(CASE)
    assert case is not None
    assert case.slab.spacing == 2.0 * CASE.slab.spacing
    return records(ensemble, case)


def test_members_are_not_multiplied_where_the_spacing_decides():
    """The change is that between means of as many members on either grid."""
    found = records(Ensemble(48, 1e-6, ("plateau_mean",))).scalars
    own, coarse = records(Ensemble(3)).scalars, coarse_records(Ensemble(3)).scalars
    (change,) = set(found["spacing_change"])
    fine = np.mean(own["plateau_mean"])
    assert change == pytest.approx(abs(np.mean(coarse["plateau_mean"]) - fine) / fine, rel=1e-12)
    assert change > 1e-3
    known = mean_of(np.array(found["plateau_mean"]), found[SHARED][0])
    enough = 2.0 * known.uncertainty / known.mean <= 2.0 * compute.ENOUGH * change
    assert enough == (len(found["plateau_mean"]) < 48)
    assert found["plateau_mean"][:3] == own["plateau_mean"]


def test_a_campaign_without_a_target_computes_one_grid_alone(monkeypatch):
    def refused(case: Case) -> None:
        raise AssertionError

    monkeypatch.setattr(compute, "double_spacing", refused)
    assert "spacing_change" not in records(Ensemble(3)).scalars


def test_the_change_of_a_drives_number_is_that_of_drives_over_records_on_twice_the_spacing():
    wanted = Ensemble(3, 1e-9, ("kinetic_friction",))
    found = run(compliance_task(CASE.slab), record_task(CASE, wanted), drive_task(CASE, DRIVE, wanted)).scalars
    coarse = double_spacing(CASE)
    assert coarse is not None
    own, other = (
        np.mean(
            run(
                compliance_task(case.slab), record_task(case, Ensemble(3)), drive_task(case, DRIVE, Ensemble(3))
            ).scalars["kinetic_friction"]
        )
        for case in (CASE, coarse)
    )
    np.testing.assert_allclose(found["drive_spacing_change"], abs(other - own) / own, rtol=1e-12)


def test_a_grid_with_flags_that_the_case_has_not_is_no_measure_of_its_spacing():
    assert double_spacing(replace(CASE, slab=Slab(33), radius=100.0)) is None
    finer = double_spacing(replace(CASE, slab=Slab(129), radius=100.0))
    assert finer == replace(CASE, slab=Slab(65), radius=100.0)
    given = replace(Slab(129).scheme, bottom_row=65)
    kept = double_spacing(replace(CASE, slab=Slab(129, scheme=given), radius=100.0))
    assert kept is not None
    assert kept.slab.scheme == given


@pytest.mark.usefixtures("one_grid")
def test_a_target_of_a_drive_slides_the_members_that_its_record_lacks():
    """They are those that a record of so many would have."""
    wanted = Ensemble(6, 1e-9, ("kinetic_friction",))
    task = drive_task(CASE, DRIVE, wanted)
    record = record_task(CASE, wanted)
    assert record.ensemble == Ensemble(3)
    found = run(compliance_task(CASE.slab), record, task)
    whole = run(compliance_task(CASE.slab), record_task(CASE, Ensemble(6)), drive_task(CASE, DRIVE, Ensemble(6)))
    assert set(found.scalars["left_out"]) == {0}
    np.testing.assert_equal({name: found.scalars[name] for name in whole.scalars}, dict(whole.scalars))
    assert len(found.scalars["kinetic_friction"]) == 6


def test_an_effect_is_left_out_where_that_costs_at_most_half_of_the_target():
    def pulled(within):
        wanted = Ensemble(6, within, ("kinetic_friction",))
        return run(compliance_task(CASE.slab), record_task(CASE, wanted), drive_task(CASE, DRIVE, wanted)).scalars

    error = pulled(0.5)["left_out_error"][0]
    assert error > 0.0
    assert set(pulled(1.9 * error)["left_out"]) == {0}
    assert set(pulled(2.1 * error)["left_out"]) != {0}


def test_a_drive_is_over_each_members_own_record():
    found = run(compliance_task(CASE.slab), record_task(CASE, FOUR), drive_task(CASE, DRIVE, FOUR))
    for number in range(4):
        case = FOUR.case(CASE, number)
        alone = run(compliance_task(case.slab), record_task(case), drive_task(case, DRIVE))
        own = {name: [values[number]] for name, values in found.scalars.items() if not name.endswith(SHARED_ERROR)}
        np.testing.assert_equal(own, {name: alone.scalars[name] for name in own})


def test_members_without_a_number_share_no_error_of_it():
    """A drive that ends with its first slip has no μ_k; the records below it have plateaus."""
    short = replace(DRIVE, duration=None, max_slips=1)
    record = run(compliance_task(CASE.slab), record_task(CASE, FOUR))
    driven = run(compliance_task(CASE.slab), record_task(CASE, FOUR), drive_task(CASE, short, FOUR))
    assert math.isfinite(record.scalars[f"plateau_mean{SHARED_ERROR}"][0])
    assert np.isnan(driven.scalars[f"kinetic_friction{SHARED_ERROR}"]).all()


@pytest.mark.everyday(1)
@pytest.mark.parametrize("number", [0, 2])
def test_a_member_that_is_refused_leaves_the_others_as_they_are(monkeypatch, number):
    whole = records(FOUR)
    refuse(monkeypatch, number)
    task = record_task(CASE, FOUR)
    part = records(FOUR)
    assert part.outcome == Outcome(Ending.COMPLETED, "1 of 4 members invalid: why", cause="why")
    assert part.members.index(REFUSED) == number
    for other in set(range(4)) - {number}:
        for name in COLUMNS:
            here, there = (getattr(whole_again(FrictionRecord, each, other), name) for each in (part, whole))
            np.testing.assert_array_equal(here, there)
    assert math.isnan(part.scalars["plateau_mean"][number])
    driven, counted = (
        run_task(each, {task.key: part}) for each in (drive_task(CASE, DRIVE, FOUR), statistics_task(CASE, FOUR))
    )
    assert driven.members[number] == REFUSED
    assert {len(values) for values in driven.scalars.values()} == {4}
    assert counted.outcome.ok
    assert counted.scalars["step_variation_members"] == [3]
    scalars = record_scalars_task(task)
    assert run_task(scalars, {task.key: part}).members == part.members


def test_an_ensemble_of_which_no_member_is_possible_ends_as_they_do(monkeypatch):
    refuse(monkeypatch, *range(4))
    found = records(FOUR)
    assert (found.outcome, found.scalars, found.arrays, found.members) == (REFUSED, {}, {}, ())


LOST, SHORT = Outcome(Ending.CONTACT_LOST, "press harder"), Outcome(Ending.NO_PLATEAU, "raise it")
UNSETTLED = Outcome(Ending.COMPLETED, "another regime later", longer=True)


@pytest.mark.parametrize(
    ("members", "ending", "message"),
    [
        ([], Ending.COMPLETED, ""),
        ([SHORT], Ending.NO_PLATEAU, "raise it"),
        (4 * [SHORT], Ending.NO_PLATEAU, "raise it"),
        (3 * [COMPLETED] + [LOST], Ending.COMPLETED, "1 of 4 members contact_lost: press harder"),
        ([COMPLETED, UNSETTLED], Ending.COMPLETED, "1 of 2 members: another regime later"),
        (2 * [COMPLETED] + [LOST], Ending.CONTACT_LOST, "1 of 3 members contact_lost: press harder"),
        (3 * [COMPLETED] + 3 * [SHORT], Ending.COMPLETED, "3 of 6 members no_plateau: raise it"),
        (3 * [COMPLETED] + 3 * [SHORT] + [LOST], Ending.NO_PLATEAU,
         "3 of 7 members no_plateau: raise it; 1 of 7 members contact_lost: press harder"),
    ],
)  # fmt: skip
def test_an_ensemble_is_completed_where_its_means_are_known(members, ending, message):
    """By the rule of `mean_of`: half of the members, and three of as many."""
    found = joint_outcome(members)
    assert (found.ending, found.message) == (ending, message)
    assert found.longer == (UNSETTLED in members)
    if len(members) > 1:
        values = np.array([1.0 if each.ok else math.nan for each in members])
        assert (ending is Ending.COMPLETED) == bool(np.isfinite(mean_of(values).mean))


def test_the_arrays_of_a_first_member_that_is_not_usable_are_not_kept():
    """Of a drive that ran away they are NaN, and the others make its ensemble usable."""
    nothing = np.full(3, math.nan)
    ran_away, whole = (
        Member((Column(values),), outcome)
        for values, outcome in ((nothing, Outcome(Ending.UNSTABLE_STEP, "why")), (np.ones(3), COMPLETED))
    )
    kind = replace(DRIVES, parts=(Part(Column),))
    assert member_numbers(kind, (ran_away, whole))[1] == {}
    np.testing.assert_array_equal(member_numbers(kind, (whole, ran_away))[1]["position"], np.ones(3))
    np.testing.assert_array_equal(member_numbers(kind, (ran_away,))[1]["position"], nothing)


@dataclass(frozen=True)
class Column:
    position: np.ndarray = quantity("position", along="sample")


def test_of_no_members_there_are_no_numbers():
    assert member_numbers(RECORD, ()) == ({}, {})


@pytest.mark.parametrize(("name", "stage"), KNOWABLE.items())
def test_whatever_can_be_a_target_is_a_number_of_a_kind_of_its_stage(name, stage):
    kinds = {"contact": KINDS["contact"], "slip": RECORD, "dynamics": DRIVES}
    assert name in uncertain_names(kinds[stage])


PAPERS = Case(slab=Slab(33), max_events=None, max_presliding=4.0)
PULLED = Drive.from_si(duration=0.1)
KINETIC = Ensemble(6, 1e-4, ("plateau_mean", "kinetic_friction"))
"""So well that all members are needed."""


def pulled(ensemble: Ensemble, drive: Drive = PULLED) -> TaskResult:
    return run(compliance_task(PAPERS.slab), record_task(PAPERS, ensemble), drive_task(PAPERS, drive, ensemble))


@pytest.fixture(scope="module")
def whole():
    return pulled(Ensemble(6))


@pytest.fixture(scope="module")
def spared():
    return pulled(replace(KINETIC, within=0.03))


@pytest.fixture(scope="module")
def plain():
    return pulled(Ensemble(6), replace(PULLED, profile="mean"))


def test_members_beyond_the_first_two_are_pulled_without_teeth_where_that_is_allowed(whole, spared, plain):
    """The first two are kept as they are, and their change is what is stated."""
    count = len(spared.scalars["kinetic_friction"])
    assert count > PAIRS
    expected = whole.scalars["kinetic_friction"][:PAIRS] + plain.scalars["kinetic_friction"][PAIRS:count]
    assert spared.scalars["kinetic_friction"] == expected
    assert {SPARED[int(word) - 1].name for word in spared.scalars["left_out"]} == {"teeth"}
    stated = omission_error(plain.scalars["kinetic_friction"][:PAIRS], whole.scalars["kinetic_friction"][:PAIRS])
    assert set(spared.scalars["left_out_error"]) == {stated}
    assert 0.0 < stated < 0.015


def test_the_answer_is_within_what_was_asked_for(whole, spared):
    """Of the mean over all six with teeth, as far as these know it."""
    known = mean_of(np.array(whole.scalars["kinetic_friction"]))
    found = mean_of(np.array(spared.scalars["kinetic_friction"]))
    assert 2.0 * found.uncertainty / found.mean + spared.scalars["left_out_error"][0] <= 0.03
    assert abs(found.mean - known.mean) <= 0.03 * known.mean + 2.0 * known.uncertainty


def test_what_was_not_asked_for_is_known_of_the_first_two_alone(spared):
    for name in ("static_friction", "time_stuck", "regime", "macroscopic_slips"):
        known = np.isfinite(spared.scalars[name])
        assert known.tolist() == [True] * PAIRS + [False] * (len(known) - PAIRS)


def test_teeth_stay_where_the_numbers_asked_for_depend_on_them():
    """Static friction does: without teeth it is the plateau, some 8 % less. Every member then knows everything."""
    found = pulled(Ensemble(4, 1e-6, ("plateau_mean", "static_friction")))
    assert set(found.scalars["left_out"]) == {0}
    assert set(found.scalars["left_out_error"]) == {0.0}
    assert np.isfinite(found.scalars["regime"]).all()


def test_nothing_is_left_out_by_campaigns_that_ask_for_members(whole):
    assert "left_out" not in whole.scalars
    assert np.isfinite(whole.scalars["static_friction"]).all()


@pytest.mark.parametrize("refused", [0, 1])
def test_a_first_member_that_is_refused_leaves_nothing_out(monkeypatch, refused):
    """Then no change is known; the others are computed whole."""
    measured = duration.measure_motion

    def failing(record: FrictionRecord, plateau: Plateau, drive: Drive, over: object = None) -> Any:
        if plateau.mean == plateaus[refused]:
            raise InvalidInput("why")
        return measured(record, plateau, drive)

    ensemble = Ensemble(4, 1e-6, ("plateau_mean", "kinetic_friction"))
    plateaus = run(compliance_task(PAPERS.slab), record_task(PAPERS, ensemble)).scalars["plateau_mean"]
    monkeypatch.setattr(duration, "measure_motion", failing)
    found = pulled(ensemble)
    assert np.isnan(found.scalars["kinetic_friction"]).tolist() == [number == refused for number in range(4)]
    assert {value for value in found.scalars["left_out"] if not np.isnan(value)} == {0}
