"""Miniatures run every kernel that a campaign needs: each comes to its end."""

from dataclasses import dataclass
from typing import Any, Literal

import pytest

from nanoslip.solver.case import PARTS, Case, SlipRule
from nanoslip.solver.outcome import Ending
from nanoslip.solver.parameter import check, choices_of, declared, parameter
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.kinds import compliance_task, record_task
from nanoslip.study.plan.plan import make_plan
from nanoslip.study.run.compute import run_task, whole_again
from nanoslip.study.run.warm_up import made_up_record, miniatures, warm_ups
from tests.conftest import ROOT, SMALL


@pytest.mark.parametrize("campaign", ["smoke", "streator2022"])
def test_each_miniature_of_the_campaigns_in_the_repository_completes(campaign):
    tasks = make_plan(load_manifest(ROOT / "campaigns" / f"{campaign}.toml")).tasks
    made_up, kinds = made_up_record(), set()
    for part in warm_ups(tasks):
        results = {made_up.key: made_up}
        for small in part.tasks:
            results[small.key] = run_task(small, results)
            assert results[small.key].outcome.usable, results[small.key].outcome
            assert (
                small.drive is None or results[small.key].outcome.ending is not Ending.NO_PLATEAU
            )  # nothing integrated
        kinds |= {small.kind for small in part.tasks}
    assert kinds == {task.kind for task in tasks}


def test_a_made_up_record_has_the_types_of_one_that_was_computed():
    """Kernels are compiled for them."""
    case = Case.of({"n_x": 17, "radius": 50.0, "max_events": 60})
    compliance, computed = compliance_task(case.slab), record_task(case)
    found = run_task(computed, {compliance.key: run_task(compliance, {})})
    made_up = made_up_record()
    assert {name: array.dtype for name, array in made_up.arrays.items()} == {
        name: array.dtype for name, array in found.arrays.items()
    }
    assert found.scalars.keys() >= made_up.scalars.keys()
    assert whole_again(FrictionRecord, made_up).outcome.ok


def test_the_switches_of_each_case_are_kept(tmp_path):
    path = tmp_path / "switches.toml"
    orders, touches = 'slip_order = ["worst_first", "simultaneous"]', 'initial_contact = ["stick", "frictionless"]'
    axes = "\n".join(["[axes]", orders, touches, 'pin = ["parabola", "flat_punch"]'])
    path.write_text(SMALL.replace("[axes]", axes))
    cases = [small.case for small in miniatures(make_plan(load_manifest(path)).tasks) if small.kind == "record"]
    assert len({(case.pin, case.initial_contact, case.slip_rule.slip_order) for case in cases}) == 8


@dataclass(frozen=True, slots=True)
class TwoWays(SlipRule):
    """A slip rule with a choice and a switch more."""

    way: Literal["left", "right"] = parameter("left", table="slip", meaning="which way a node slips")
    eager: bool = parameter(False, table="slip", meaning="whether nodes slip early")

    def __post_init__(self) -> None:
        check(self)


def other_choices() -> list[tuple[str, Any]]:
    """Every word and every switch that a case can be given beside its defaults, those of its slab apart."""
    found = []
    for kind in (Case, *PARTS.values()):
        types = {item.name: item.type for item in kind.__dataclass_fields__.values()}
        for name in declared(kind):
            words = choices_of(types[name]) or ((True, False) if types[name] is bool else ())
            default = kind.__dataclass_fields__[name].default
            found += [(name, word) for word in words if word != default]
    return found


def test_every_choice_that_is_declared_is_kept(monkeypatch):
    """The choices decide which kernels run; one that somebody adds is kept without a word in the warm-up."""
    monkeypatch.setitem(PARTS, "slip_rule", TwoWays)
    choices = other_choices()
    assert {"pin", "initial_contact", "slip_order", "friction", "distribution", "way", "eager"} <= dict(choices).keys()
    for name, word in choices:
        (small,) = [task.case for task in miniatures([record_task(Case.of({name: word}))]) if task.kind == "record"]
        assert small.flat == Case.of({"n_x": 17, "radius": 50.0, "max_events": 60, name: word}).flat


def test_a_rough_pin_stays_rough_and_a_large_case_becomes_small():
    case = Case.of({"n_x": 1025, "normal_load": 0.1, "roughness": ((0.0, 0.0), (0.01, 1e-6), (0.02, 0.0))})
    (small,) = [task.case for task in miniatures([record_task(case)]) if task.kind == "record"]
    assert len(small.heterogeneity.roughness) == 2
    assert (small.slab.n_x, small.normal_load) == (17, 1e-3)


def test_drives_that_differ_in_numbers_alone_are_one_miniature(tmp_path):
    """Thousands of them would take longer than the run."""
    path = tmp_path / "axes.toml"
    numbers = "[drive_axes]\nspring_stiffness = [1e4, 1e5, 1e6]\npin_mass = [0.1, 1.0]\n"
    path.write_text(SMALL.replace("[[drives]]", f"{numbers}surface_compliance = [true, false]\n[[drives]]", 1))
    small = [task.drive for task in miniatures(make_plan(load_manifest(path)).tasks) if task.drive]
    assert sorted(drive.surface_compliance for drive in small) == [False, True]


def test_a_drive_of_few_steps_is_as_short_as_they_allow(tmp_path):
    """A step of its integrator must fit into it."""
    path = tmp_path / "steps.toml"
    few = 'integrator = "rk4"\nduration = 1e-2\ntime_step = 3e-3\n'
    path.write_text(SMALL.replace('name = "slow"\n', f'name = "slow"\n{few}'))
    small = [task.drive for task in miniatures(make_plan(load_manifest(path)).tasks) if task.drive]
    assert sorted(drive.integrator.name for drive in small) == ["exact", "rk4"]
