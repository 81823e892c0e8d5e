"""Of all that can be left out within the tolerance, the cheapest: never more, nothing that is kept, nothing that is not known."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from solver.case import Case, SlipRule
from solver.drive import Drive
from solver.slab import Slab
from study.accuracy.influence.scenes import random_scene
from study.plan.influence.choice import BEATEN, Choice
from study.plan.influence.decision import Decision, Tolerance, decide
from study.plan.influence.length import WHOLE_LENGTH
from study.plan.influence.omissions import OF_THE_CASE, OF_THE_DRIVE, OMISSIONS
from study.plan.influence.scene import ASKED_FOR, OBSERVABLES, Scene
from study.plan.influence.table import load_influences
from tests.study.plan.influence.made_up import GRAVE, SLIGHT, influences

SCENES = [random_scene(seed) for seed in range(24)]
TOLERANCES = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3)


def tolerance(within: float, changes: Mapping[str, float] = SLIGHT, **others: object) -> Tolerance:
    """Of effects alone: lengths are whole, unless others say what is kept."""
    whole = frozenset({WHOLE_LENGTH})
    made = Tolerance(within, ASKED_FOR["dynamics"], whole, influences(changes), True, False, 1.0)
    return replace(made, **others)  # type: ignore[arg-type]


def drives_of(scene: Scene) -> dict[str, Drive]:
    """Two drives: the scene's own, and a softer one."""
    assert scene.drive is not None
    return {"own": scene.drive, "soft": replace(scene.drive, spring_stiffness=scene.drive.spring_stiffness / 10.0)}


def decided(scene: Scene, wanted: Tolerance, kept: frozenset[str] = frozenset()) -> Decision:
    drives = drives_of(scene)
    return decide(scene.case, drives, dict.fromkeys(drives, kept), wanted)


def of_chance(seed: int) -> dict[str, float]:
    """Influences from a third of a thousandth to a third."""
    draw = np.random.default_rng(seed)
    return {name: float(10.0 ** draw.uniform(-3.5, -0.5)) for name in OMISSIONS}


def all_choices(decision: Decision) -> list[Choice]:
    return [*decision.of_case, *itertools.chain(*decision.of_drives.values())]


def cheapest(decision: Decision, wanted: Tolerance, seconds: list[float]) -> float:
    """Seconds of the cheapest set of effects, tried one set after the other. seconds: of the case and each drive with all."""
    best = math.inf
    parts = (decision.of_case, *decision.of_drives.values())
    possible = [[each for each in part if each.reason in ("", BEATEN, f"goes with {each.part_of}")] for part in parts]
    for of_case in subsets(possible[0]):
        total = seconds[0] * cost(of_case, seconds[0])
        for number, part in enumerate(possible[1:], 1):
            fitting = [
                cost(of_drive, seconds[number])
                for of_drive in subsets(part)
                if np.all(sum_of((*of_case, *of_drive))[wanted.columns] <= wanted.within * (1.0 + 1e-12))
            ]
            total += seconds[number] * min(fitting, default=math.inf)
        best = min(best, total)
    return best


def subsets(choices: list[Choice]) -> list[tuple[Choice, ...]]:
    sets = (each for size in range(len(choices) + 1) for each in itertools.combinations(choices, size))
    return [each for each in sets if not {one.part_of for one in each} & {one.effect for one in each}]


def cost(chosen: tuple[Choice, ...], seconds: float) -> float:
    return math.prod(1.0 - each.saves / seconds for each in chosen)


def sum_of(chosen: tuple[Choice, ...]) -> np.ndarray:
    return sum((each.influence for each in chosen), np.zeros(len(OBSERVABLES)))


@pytest.mark.parametrize("seed", range(24))
def test_what_is_left_out_stays_within_the_tolerance_and_is_the_cheapest_that_does(seed: int) -> None:
    """Against all sets of effects, tried one by one, but those that have an effect beside what it goes with."""
    scene, changes = SCENES[seed], of_chance(seed)
    for within in TOLERANCES:
        wanted = tolerance(within, changes)
        decision = decided(scene, wanted)
        alone = decide(scene.case, {}, {}, wanted)
        drives = drives_of(scene).items()
        each = [decide(scene.case, {label: drive}, {label: frozenset()}, wanted) for label, drive in drives]
        whole = alone.seconds_of_all
        seconds = [whole, *(one.seconds_of_all - whole for one in each)]
        for label in decision.of_drives:
            assert (decision.influence(label)[wanted.columns] <= within * (1.0 + 1e-12)).all()
        assert (decision.influence()[wanted.columns] <= within * (1.0 + 1e-12)).all()
        assert decision.seconds == pytest.approx(cheapest(decision, wanted, seconds), rel=1e-9)
        assert decision.seconds <= decision.seconds_of_all


@pytest.mark.parametrize("seed", range(24))
def test_a_larger_tolerance_never_costs_more_time(seed: int) -> None:
    for known in (influences(of_chance(seed)), load_influences()):
        found = [decided(SCENES[seed], tolerance(within, influences=known)).seconds for within in TOLERANCES]
        assert all(after <= before * (1.0 + 1e-12) for before, after in itertools.pairwise(found))


def test_nothing_is_left_out_that_matters_and_nothing_that_saves_nothing() -> None:
    for scene in SCENES:
        for choice in all_choices(decided(scene, tolerance(0.1, GRAVE))):
            assert (choice.left_out, choice.reason) == (False, "matters")
        for choice in all_choices(decided(scene, tolerance(0.1))):
            assert choice.left_out == (choice.reason == "")
            assert choice.reason in ("", "saves nothing", "goes with teeth")
            assert not (choice.left_out and choice.saves <= 0.0)


@pytest.mark.parametrize("name", OMISSIONS)
def test_a_kept_effect_stays(name: str) -> None:
    for scene in SCENES:
        for choice in all_choices(decided(scene, tolerance(0.5, kept=frozenset({name, WHOLE_LENGTH})))):
            kept = name in (choice.effect, choice.part_of)
            assert (choice.reason == "kept by the file") == kept
            assert not (choice.left_out and kept)


@pytest.mark.parametrize("name", [each.name for each in OF_THE_DRIVE])
def test_a_drive_keeps_what_its_own_table_asks_for_and_others_do_not(name: str) -> None:
    scene = SCENES[0]
    drives = drives_of(scene)
    found = decide(scene.case, drives, {"own": frozenset({name}), "soft": frozenset()}, tolerance(0.5))
    reasons = {label: next(each.reason for each in of if each.effect == name) for label, of in found.of_drives.items()}
    assert reasons["own"] == "kept by the file" != reasons["soft"]


@pytest.mark.parametrize("name", OMISSIONS)
def test_an_effect_of_which_nothing_is_known_stays(name: str) -> None:
    known = {other: change for other, change in SLIGHT.items() if other != name}
    for scene in SCENES:
        for choice in all_choices(decided(scene, tolerance(0.5, known))):
            if choice.effect == name:
                assert choice.reason == "influence not known, no scenes like this one were measured"
                assert np.isnan(choice.influence).any()


def test_what_is_not_asked_for_may_change_however_much() -> None:
    known = load_influences()
    contact = [OBSERVABLES.index(name) for name in ASKED_FOR["contact"]]
    for scene in SCENES:
        decision = decide(scene.case, {}, {}, tolerance(0.05, influences=known, asked_for=ASKED_FOR["contact"]))
        assert (decision.influence()[contact] <= 0.05).all()


UNLIKE = [
    ("pin = flat_punch", Case(pin="flat_punch", slab=Slab(65))),
    ("another slip rule than the default", Case(slip_rule=SlipRule(residual_shear=0.5), slab=Slab(65))),
    # Which without pin_translation is no case at all.
    ("another slip rule than the default", Case(slip_rule=SlipRule(residual_shear=1.0), slab=Slab(65))),
    ("initial_contact = gradual", Case(initial_contact="gradual", slab=Slab(65))),
    ("scheme = chain", Case(slab=Slab(65, scheme="chain"))),
    ("scheme = biquadratic", Case(slab=Slab(65, scheme="biquadratic"))),
]


@pytest.mark.parametrize(("reason", "case"), UNLIKE)
def test_a_case_unlike_the_measured_ones_is_computed_in_full_and_says_why(reason: str, case: Case) -> None:
    drive = SCENES[0].drive
    assert drive is not None
    for known in (influences(SLIGHT), load_influences()):
        found = decide(case, {"a": drive}, {"a": frozenset()}, tolerance(0.9, influences=known))
        assert found.case == case
        assert found.seconds == found.seconds_of_all
        for choice in all_choices(found):
            assert (choice.left_out, choice.reason) == (False, f"influence not known with {reason}")


def test_the_case_is_the_one_without_what_is_left_out() -> None:
    for scene in SCENES:
        decision = decided(scene, tolerance(0.5))
        expected = scene
        for omission in OF_THE_CASE:
            if omission.name in decision.left_out():
                expected = omission.left_out(expected)
        assert decision.case == expected.case


def test_of_contacts_alone_no_time_of_a_record_is_saved() -> None:
    for scene in SCENES:
        found = decide(scene.case, {}, {}, tolerance(0.5, slides=False))
        assert "pin_translation" not in found.left_out()
        assert found.seconds_of_all < decide(scene.case, {}, {}, tolerance(0.5)).seconds_of_all


def test_a_compliance_that_many_cases_share_is_hardly_worth_leaving_out() -> None:
    for scene in SCENES:
        alone, shared = (decide(scene.case, {}, {}, tolerance(0.5, cases_on_a_slab=count)) for count in (1.0, 1e6))
        saved = [
            next(each.saves for each in found.of_case if each.effect == "finite_slab") for found in (alone, shared)
        ]
        assert saved[1] < saved[0]
