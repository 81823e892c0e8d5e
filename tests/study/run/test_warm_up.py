"""Kernels are compiled once before a run, on miniatures that run every kernel which the campaign needs."""

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import pytest

from nanoslip.solver.case import PARTS, Case, SlipRule
from nanoslip.solver.layout import Plane
from nanoslip.solver.outcome import Ending
from nanoslip.solver.parameter import declared, field_choices, parameter, validate
from nanoslip.study.manifest.reader import load_manifest, parse_manifest
from nanoslip.study.plan.plan import make_plan
from nanoslip.study.run import executor
from nanoslip.study.run.executor import WarmUp, miniatures
from nanoslip.study.tasks.compute import run_task
from nanoslip.study.tasks.miniature import NUMBERS, make_record
from nanoslip.study.tasks.record import record_task
from tests.conftest import ROOT, SMALL


def planned(campaign):
    return make_plan(load_manifest(ROOT / "campaigns" / f"{campaign}.toml")).tasks


def small(text):
    """Miniatures of a campaign."""
    return miniatures(make_plan(parse_manifest(Path("mine.toml"), text, {})).tasks)


def miniature(case):
    (found,) = [task.case for task in miniatures([record_task(case)]) if task.kind == "record"]
    return found


@pytest.mark.parametrize("campaign", ["smoke", "streator2022"])
def test_each_miniature_of_the_campaigns_in_the_repository_completes(campaign):
    """Those of drives need none of the others; compiling that hangs is ended."""
    every = planned(campaign)
    for tasks in (every, [task for task in every if task.drive]):
        results = {}
        for task in miniatures(tasks):
            needs = {key: make_record(key) if task.drive else results[key] for key in task.needs}
            outcome = results.setdefault(task.key, run_task(task, needs)).outcome
            assert outcome.usable, outcome
            assert not task.drive or outcome.ending is not Ending.NO_PLATEAU  # nothing integrated
        assert {each.kind for each in results.values()} == {task.kind for task in tasks}
    assert WarmUp(()).limit < 3600.0


def test_a_warm_up_runs_every_miniature(monkeypatch):
    """Else each process of the run compiles what is missing."""
    ran = []
    monkeypatch.setattr(executor, "run_task", lambda task, needs: ran.append(task) or run_task(task, needs))
    tasks = miniatures(planned("smoke"))
    assert WarmUp(tasks).run().ok
    assert sorted(task.key for task in ran) == sorted(task.key for task in tasks)


@dataclass(frozen=True, slots=True)
class TwoWays(SlipRule):
    """A slip rule with a choice and a switch more."""

    way: Literal["left", "right"] = parameter("left", table="slip", meaning="which way a node slips")
    eager: bool = parameter(False, table="slip", meaning="whether nodes slip early")

    def __post_init__(self):
        validate(self)


def other_choices():
    """Every word and every switch that a case can be given beside its defaults, those of its slab apart."""
    for kind in (Case, *PARTS.values()):
        for name in declared(kind):
            item = kind.__dataclass_fields__[name]
            words = field_choices(item.type) or ((True, False) if item.type is bool else ())
            yield from ((name, word) for word in words if word != item.default)


def test_every_choice_that_is_declared_is_kept(monkeypatch):
    """The choices decide which kernels run; one that somebody adds is kept without a word in the warm-up."""
    monkeypatch.setitem(PARTS, "slip_rule", TwoWays)
    choices = list(other_choices())
    assert {"pin", "initial_contact", "slip_order", "friction", "distribution", "way", "eager"} <= dict(choices).keys()
    for name, word in choices:
        kept = miniature(Case.of({name: word}))
        assert kept.flat == Case.of({**NUMBERS, name: word}).flat


def test_the_switches_of_each_case_are_kept_together():
    orders, touches = 'slip_order = ["worst_first", "simultaneous"]', 'initial_contact = ["stick", "frictionless"]'
    axes = "\n".join(["[axes]", orders, touches, 'pin = ["parabola", "flat_punch"]'])
    cases = [task.case for task in small(SMALL.replace("[axes]", axes)) if task.kind == "record"]
    assert len({(case.pin, case.initial_contact, case.slip_rule.slip_order) for case in cases}) == 8


def test_a_rough_pin_stays_rough_and_a_large_case_becomes_small():
    rough = ((0.0, 0.0), (0.01, 1e-6), (0.02, 0.0))
    kept = miniature(Case.of({"n_x": 1025, "normal_load": 0.1, "roughness": rough}))
    assert len(kept.heterogeneity.roughness) == 2
    assert (kept.slab.n_x, kept.normal_load) == (17, 1e-3)


def test_a_plane_of_nodes_stays_a_plane_but_a_small_one():
    """Nodes in a row have other kernels."""
    kept = miniature(Case.of({"n_x": 65, "scheme": "layer", "aspect_ratio": 2.0}))
    assert kept.slab.scheme.LAYOUT is Plane
    assert kept.slab.nodes < 300


def test_a_rough_ball_stays_rough_over_both_directions():
    """Else its kernels were compiled with its first task: a profile is refused on a plane."""
    image = tuple((x, y, 1e-6 * x) for x in (0.0, 0.01) for y in (0.0, 0.01))
    kept = miniature(Case.of({"n_x": 65, "scheme": "half_space", "roughness": image}))
    assert kept.slab.scheme.LAYOUT is Plane
    assert {len(point) for point in kept.heterogeneity.roughness} == {3}


def test_drives_that_differ_in_numbers_alone_are_one_miniature():
    """Thousands of them would take longer than the run."""
    numbers = "[drive_axes]\nspring_stiffness = [1e4, 1e5, 1e6]\npin_mass = [0.1, 1.0]\n"
    drives = [
        task.drive
        for task in small(SMALL.replace("[[drives]]", f"{numbers}surface_compliance = [true, false]\n[[drives]]", 1))
    ]
    assert sorted(drive.surface_compliance for drive in drives if drive) == [False, True]


def test_a_drive_of_few_steps_is_as_short_as_they_allow():
    """A step of its integrator must fit into it."""
    few = 'name = "slow"\nintegrator = "rk4"\nduration = 1e-2\ntime_step = 3e-3\n'
    drives = [task.drive for task in small(SMALL.replace('name = "slow"\nduration = 0.2\n', few)) if task.drive]
    assert sorted(drive.integrator.name for drive in drives) == ["exact", "rk4"]


COMPILE = """
import gc
from nanoslip.solver.compiled import Kernel
from nanoslip.study.run.executor import WarmUp, miniatures
from tests.study.run.test_warm_up import planned
WarmUp(miniatures(planned("smoke"))).run()
known = [each for each in gc.get_objects() if isinstance(each, Kernel) and "dispatcher" in vars(each)]
print(len([each for each in known if each.dispatcher.overloads]))
print(*(each.py_func.__name__ for each in known if any("Literal" in str(types) for types in each.dispatcher.overloads)))
"""
SAID = "compiling kernels, once"


@pytest.mark.slow
def test_that_kernels_are_compiled_is_said_once_and_not_when_they_are_kept(nanoslip, campaign, tmp_path):
    """Whoever waits for a first run reads why. The run has one kernel to compile that comes last, then none.

    None is compiled again for a number that is written out: a literal argument is a type of its own.
    """
    kept = tmp_path / "kept"
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(kept)}
    done = subprocess.run(
        [sys.executable, "-c", COMPILE], env=environment, cwd=ROOT, check=True, capture_output=True, text=True
    )
    compiled, of_written_numbers = done.stdout.splitlines()
    assert int(compiled) > 10
    assert not of_written_numbers
    assert done.stderr.count(SAID) == 1
    assert all(list(kept.rglob(f"{kernel}-*.nbi")) for kernel in ("events.resolve", "steps.integrate_exactly"))
    campaign.write_text('title = "One contact"\nstages = ["contact"]\nnumerics.n_x = 17\n')
    for path in kept.rglob("events.resolve*"):
        path.unlink()
    runs = [nanoslip("run", campaign, "--out", tmp_path / out, NUMBA_CACHE_DIR=str(kept)).stderr for out in "ab"]
    assert [each.count(SAID) for each in runs] == [1, 0]
