"""A campaign with a tolerance: the same cases under the same names, each computed without what does not matter in it."""

from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from solver.elasticity.schemes.half_plane import HalfPlane
from study.manifest.manifest import Manifest
from study.manifest.problems import ManifestError
from study.manifest.reader import parse_manifest
from study.plan.influence.campaign import tolerance_of, yielded
from study.plan.influence.length import WHOLE_LENGTH
from study.plan.influence.omissions import OMISSIONS
from study.plan.influence.scene import ASKED_FOR, OBSERVABLES, OF_DRIVES
from study.plan.plan import Plan, make_plan
from tests.conftest import SMALL
from tests.study.plan.influence.made_up import GRAVE, SLIGHT, text

MINE = 'influences = "mine.json"\n'
WITHIN = f"[effects]\nwithin = 0.01\n{MINE}"
KEPT = f'keep = ["{WHOLE_LENGTH}"]\n'
LIVELY = SMALL.replace("n_x = 17", "n_x = 65").replace("events = 60", "events = 2000")
"""Long enough for what is left out to save time."""


def read(campaign: str, changes: Mapping[str, float] = SLIGHT) -> Manifest:
    return parse_manifest(Path("small.toml"), campaign, {"influences": text(changes)} if MINE in campaign else {})


def planned(campaign: str, changes: Mapping[str, float] = SLIGHT) -> Plan:
    return make_plan(read(campaign, changes))


def left_out(plan: Plan, drive: str = "") -> set[str]:
    """Effects that are left out of any case, or of a drive of any case."""
    return {name for decision in plan.decisions.values() for name in decision.left_out(drive)}


def keys(plan: Plan) -> set[str]:
    return {task.key for task in plan.tasks}


def test_without_a_tolerance_nothing_is_decided() -> None:
    plan = planned(LIVELY)
    assert (plan.tolerance, plan.decisions) == (None, {})
    assert tolerance_of(read(LIVELY)) is None


def test_where_everything_matters_the_tasks_are_those_without_a_tolerance() -> None:
    plan = planned(LIVELY + WITHIN + KEPT, GRAVE)
    assert keys(plan) == keys(planned(LIVELY))
    assert plan.cases == planned(LIVELY).cases
    assert all(decision.seconds == decision.seconds_of_all for decision in plan.decisions.values())


def test_the_tasks_are_those_of_a_campaign_that_leaves_the_same_out_itself() -> None:
    """What is left out by hand and by tolerance is one computation. Of a plateau, drives may change as they like."""
    tolerant = planned(
        LIVELY + WITHIN + KEPT + 'observables = ["plateau_mean"]\n', {"finite_slab": 0.004, "coupling": 0.004}
    )
    by_hand = LIVELY.replace("n_x = 65", 'n_x = 65\nscheme = "half_plane"') + "[effects]\ncoupling = false\n"
    by_hand = by_hand.replace("samples = 40\n", 'samples = 40\nsurface_compliance = false\nprofile = "mean"\n')
    assert left_out(tolerant) == {"finite_slab", "coupling"}
    assert left_out(tolerant, "slow") == left_out(tolerant, "fast") == {"surface_compliance", "teeth"}
    assert keys(tolerant) == keys(planned(by_hand))


def test_a_case_has_the_same_name_whatever_the_tolerance() -> None:
    names = [[case.case_id for case in planned(LIVELY + each).cases]
             for each in ("", WITHIN, WITHIN.replace("0.01", "0.3"))]  # fmt: skip
    assert names[0] == names[1] == names[2]


def test_cases_that_become_one_computation_share_tasks_and_stay_two_cases() -> None:
    """Slabs of two heights, on half-planes that have none."""
    campaign = LIVELY.replace("radius = [50.0, 100.0]", "aspect_ratio = [1.0, 0.5]")
    plan = planned(campaign.replace("[numerics]", "[constants]\nradius = 50.0\n[numerics]") + WITHIN)
    assert len(plan.cases) == len({case.case_id for case in plan.cases}) == 4
    assert len({case.case for case in plan.cases}) == 2
    records = {plan.case_tasks[case.case_id].record for case in plan.cases}
    assert len(records) == 2


def test_the_last_stage_decides_what_is_asked_for() -> None:
    for count, stage in ((3, "dynamics"), (2, "slip"), (1, "contact")):
        stages = ['["contact"', '"slip"', '"dynamics"]'][:count]
        campaign = SMALL.replace('["contact", "slip", "dynamics"]', ", ".join(stages).removesuffix("]") + "]")
        tolerance = tolerance_of(read(campaign + WITHIN))
        assert tolerance is not None
        assert tolerance.asked_for == ASKED_FOR[stage]
        assert tolerance.slides == (count > 1)


@pytest.mark.parametrize(
    ("line", "table", "effect"),
    [
        ("coupling = true\n", "[effects]\n", "coupling"),
        ("pin_translation = true\n", "[effects]\n", "pin_translation"),
        ("coupling = [true, false]\n", "[axes]\n", "coupling"),
        ('scheme = "galerkin"\n', "[numerics]\n", "finite_slab"),
        ("subsurface = true\n", "[outputs]\n", "finite_slab"),
    ],
)
def test_what_the_file_itself_asks_for_is_kept(line: str, table: str, effect: str) -> None:
    campaign = LIVELY + WITHIN + ("" if table in LIVELY + WITHIN else table)
    assert effect in left_out(planned(LIVELY + WITHIN))
    plan = planned(campaign.replace(table, table + line))
    assert effect not in left_out(plan)
    assert effect in {name for name in OMISSIONS if name in plan.tolerance.kept}  # type: ignore[union-attr]


def test_an_effect_that_the_file_switches_off_is_off_and_not_counted() -> None:
    plan = planned(LIVELY + WITHIN + "coupling = false\n")
    assert not any(case.case.effects.coupling for case in plan.cases if case.case)
    assert all("coupling" not in {each.effect for each in found.of_case} for found in plan.decisions.values())


@pytest.mark.parametrize("name", OMISSIONS)
def test_an_effect_on_the_list_is_kept(name: str) -> None:
    plan = planned(LIVELY + WITHIN + f'keep = ["{name}"]\n')
    for drive in ("", "slow", "fast"):
        assert name not in left_out(plan, drive)


@pytest.mark.parametrize(
    ("line", "effect"),
    [
        ("surface_compliance = true\n", "surface_compliance"),
        ("reverse_motion = true\n", "reverse_motion"),
        ('profile = "sawtooth"\n', "teeth"),
    ],
)
def test_what_a_drives_table_asks_for_is_kept_of_that_drive_alone(line: str, effect: str) -> None:
    campaign = LIVELY.replace('name = "slow"\n', f'name = "slow"\n{line}')
    plan = planned(campaign + WITHIN)
    reasons = {
        label: {choice.reason for found in plan.decisions.values() for choice in found.of_drives[label]
                if choice.effect == effect}
        for label in ("slow", "fast")
    }  # fmt: skip
    assert reasons["slow"] == {"kept by the file"}
    assert "kept by the file" not in reasons["fast"]


def test_what_an_axis_of_drives_asks_for_is_kept_of_all() -> None:
    plan = planned(LIVELY + WITHIN + "[drive_axes]\nsurface_compliance = [true, false]\n")
    assert len(plan.manifest.drives) == 4
    for drive in plan.manifest.drives:
        assert "surface_compliance" not in left_out(plan, drive.label)


def test_drives_are_pulled_without_what_does_not_matter_and_keep_their_names() -> None:
    plan = planned(LIVELY + WITHIN)
    for case in plan.cases:
        found = plan.decisions[case.case_id]
        for label, key in plan.case_tasks[case.case_id].drives.items():
            drive = next(task.drive for task in plan.tasks if task.key == key)
            assert drive is not None
            assert drive.surface_compliance == ("surface_compliance" not in found.left_out(label))
            assert (drive.profile == "sawtooth") == ("teeth" not in found.left_out(label))
            assert (drive.damping_ratio > 0.0) == ("damping" not in found.left_out(label))
    assert left_out(plan, "slow")
    assert {drive.label for drive in plan.manifest.drives} == {"slow", "fast"}
    assert all(each.drive.in_si.surface_compliance for each in plan.manifest.drives if each.drive)


def test_members_of_an_ensemble_are_all_the_same_model() -> None:
    """Decided from measured influences, whose groups would differ from start to start no more than by rounding."""
    ensemble = LIVELY + "[effects]\nwithin = 0.05\n[heterogeneity]\nspread = 0.01\n[ensemble]\nmembers = 5\n"
    plan = planned(ensemble)
    assert len(plan.cases) == 20
    models: dict[tuple[object, ...], set[tuple[object, ...]]] = {}
    for case in plan.cases:
        assert case.case is not None
        point = case.parameters["intrinsic_friction"], case.parameters["radius"]
        found = plan.decisions[case.case_id]
        models.setdefault(point, set()).add((found.left_out(), found.left_out("slow"), found.left_out("fast")))
    assert all(len(each) == 1 for each in models.values())
    assert len({case.case.start for case in plan.cases if case.case}) == 5


def test_every_case_keeps_its_own_start_and_nodes() -> None:
    ensemble = LIVELY + "[heterogeneity]\nspread = 0.01\n[ensemble]\nmembers = 3\n"
    for on, off in zip(planned(ensemble).cases, planned(ensemble + WITHIN + 'keep = ["spread"]\n').cases, strict=True):
        assert on.case is not None
        assert off.case is not None
        assert (on.case.start, on.case.heterogeneity) == (off.case.start, off.case.heterogeneity)


def test_cases_share_their_slabs_compliance_on_average() -> None:
    for axes, count in (
        ("radius = [50.0, 100.0]\nintrinsic_friction = [0.2, 0.3, 0.4]\n", 6),
        ("radius = [50.0, 100.0]\nn_x = [17, 33, 65]\n", 2),
        ("n_x = [17, 33]\n", 1),
    ):
        found = tolerance_of(read(f'title = "x"\n[axes]\n{axes}{WITHIN}'))
        assert found is not None
        assert found.cases_on_a_slab == count
    paired = 'title = "x"\ndesign = "zip"\n[axes]\nradius = [50.0, 60.0, 70.0, 80.0]\nn_x = [17, 17, 33, 33]\n'
    found = tolerance_of(read(paired + "[ensemble]\nmembers = 3\n" + WITHIN))
    assert found is not None
    assert found.cases_on_a_slab == 6


def test_a_refused_case_is_refused_as_before() -> None:
    refused = SMALL.replace("radius = [50.0, 100.0]", "coarsest_row = [5, 17]\nn_x = [9, 17]").replace("n_x = 17", "")
    plain, tolerant = planned(refused), planned(refused + WITHIN)
    assert [case.outcome for case in tolerant.cases] == [case.outcome for case in plain.cases]
    assert any(case.case is None for case in plain.cases)
    assert set(tolerant.decisions) == {case.case_id for case in plain.cases if case.case}


def test_a_chosen_grid_is_no_wish_for_a_finite_slab() -> None:
    """`accuracy` chooses numerics; that is not the file asking for a scheme."""
    # Contacts alone, where a compliance is not paid for by a record anyway.
    campaign = 'title = "x"\nstages = ["contact"]\naccuracy = 0.004\n[axes]\nradius = [100.0, 200.0]\n'
    assert "finite_slab" in left_out(planned(campaign + WITHIN))
    assert any(isinstance(case.case.slab.scheme, HalfPlane) for case in planned(campaign + WITHIN).cases if case.case)


NEEDS = {
    'observables = ["colour"]\n': 'effects.observables = "colour": needs one of contact_half_width',
    'observables = ["plateau_mean", "event_drop"]\n': 'effects.observables = "event_drop": needs one of ',
    'keep = ["slab"]\n': 'effects.keep = "slab": needs one of finite_slab, coupling',
}


@pytest.mark.parametrize(("line", "said"), NEEDS.items(), ids=NEEDS)
def test_a_word_that_is_not_known_is_one_line_with_those_that_are(line: str, said: str) -> None:
    with pytest.raises(ManifestError) as error:
        planned(SMALL + WITHIN + line)
    (found,) = error.value.lines
    assert found.startswith(f"small.toml: {said}")


@pytest.mark.parametrize(("stages", "name"), [(1, "plateau_mean"), (1, "kinetic_friction"), (2, "static_friction")])
def test_nothing_is_asked_for_of_a_stage_that_is_missing(stages: int, name: str) -> None:
    campaign = f'title = "x"\nstages = {str(["contact", "slip"][:stages]).replace(chr(39), chr(34))}\n'
    with pytest.raises(ManifestError, match=f'effects.observables = "{name}": needs one of contact_half_width'):
        planned(campaign + WITHIN + f'observables = ["{name}"]\n')


def test_every_mistake_has_its_line() -> None:
    with pytest.raises(ManifestError) as error:
        planned(SMALL + WITHIN + 'keep = ["slab", "colour"]\nobservables = ["one", "two"]\n')
    assert len(error.value.lines) == 4


def test_decisions_do_not_depend_on_what_was_decided_before() -> None:
    plan = planned(LIVELY + WITHIN)
    backwards = planned(LIVELY.replace("[0.25, 0.5]", "[0.5, 0.25]").replace("[50.0, 100.0]", "[100.0, 50.0]") + WITHIN)
    assert keys(plan) == keys(backwards)


@pytest.mark.parametrize(
    ("stages", "outputs", "missing"),
    [
        (("contact",), "", set(OBSERVABLES) - {"contact_half_width", "maximum_pressure", "approach"}),
        (("contact", "slip"), "", {"maximum_pressure", "approach", *OF_DRIVES}),
        (("contact", "slip"), "[outputs]\ntractions = true\n", set(OF_DRIVES)),
        (("contact", "slip", "dynamics"), "[outputs]\ntractions = true\n", set()),
    ],
)
def test_what_can_be_asked_for_is_what_the_dataset_has(
    stages: tuple[str, ...], outputs: str, missing: set[str]
) -> None:
    """A contact that slides is seen in its tractions alone."""
    listed = ", ".join(f'"{stage}"' for stage in stages)
    manifest = read(SMALL.replace('"contact", "slip", "dynamics"', listed) + outputs)
    assert yielded(manifest) == tuple(name for name in OBSERVABLES if name not in missing)


def errors(plan: Plan) -> dict[str, set[float | None]]:
    """Errors by their lengths of all records, "", and of the drives of each label."""
    found: dict[str, set[float | None]] = {}
    for decision in plan.decisions.values():
        for label, length in decision.lengths.items():
            found.setdefault(label, set()).add(length.error)
    return found


LONG = LIVELY.replace("events = 2000\n", "")
"""Two node spacings."""


def test_what_a_tolerance_leaves_is_spent_on_the_lengths_of_record_and_drives() -> None:
    """The cases and drives of the plan are those that end at these errors."""
    plan = planned(LONG + WITHIN, GRAVE)
    found = errors(plan)
    assert None not in found[""]
    for case in plan.cases:
        assert case.case is not None
        assert case.case.target_length_error == plan.decisions[case.case_id].length_error()
    driven = {(task.case, task.drive.length_error) for task in plan.tasks if task.drive}
    wanted = {
        (case.case, plan.decisions[case.case_id].length_error(label))
        for case in plan.cases
        for label in ("slow", "fast")
    }
    assert driven == wanted


@pytest.mark.parametrize(
    ("changed", "whole"),
    [
        (lambda campaign: campaign + KEPT, {"", "slow", "fast"}),
        (lambda campaign: campaign + 'observables = ["plateau_mean", "static_friction"]\n', {"", "slow", "fast"}),
        (lambda campaign: campaign + 'observables = ["plateau_mean"]\n', {"slow", "fast"}),
        (lambda campaign: campaign + 'observables = ["contact_half_width"]\n', {"", "slow", "fast"}),
        (lambda campaign: campaign + "[outputs]\nstatistics = true\n", {"", "slow", "fast"}),
        (lambda campaign: campaign + "[outputs]\ntractions_at = [0, 9]\n", {"", "slow", "fast"}),
        (lambda campaign: campaign + "[ensemble]\nuncertainty = 0.01\n", {"", "slow", "fast"}),
        (lambda campaign: campaign + "[limits]\nuncertainty = 0.01\n", {""}),
        (lambda campaign: campaign + "[limits]\nlength_error = 0.01\n", {""}),
        (lambda campaign: campaign.replace('name = "slow"\n', 'name = "slow"\nuncertainty = 0.02\n'), {"slow"}),
        (lambda campaign: campaign.replace('name = "slow"\n', 'name = "slow"\nlength_error = 0.02\n'), {"slow"}),
        (lambda campaign: campaign + "[slip]\nresidual_shear = 0.5\n", {"", "slow", "fast"}),
    ],
    ids=[
        "kept", "static friction", "plateau alone", "contact alone", "statistics", "states", "an ensemble grows", "uncertainty",
        "length error", "uncertainty of a drive", "length error of a drive", "unlike all that was measured",
    ],
)  # fmt: skip
def test_a_length_that_the_file_needs_or_sets_itself_stays(changed: Callable[[str], str], whole: set[str]) -> None:
    campaign = LONG.replace("[outputs]\nrecords = true\n", "").replace("[limits]\n", "")
    plan = planned(changed(campaign + WITHIN), GRAVE)
    for label, found in errors(plan).items():
        if label in whole:
            assert found == {None}, label
    assert all(decision.lengths[label].reason for decision in plan.decisions.values() for label in whole)
