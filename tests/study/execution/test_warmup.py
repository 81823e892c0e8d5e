"""The warm-up runs every kernel that a campaign needs: each miniature of its tasks comes to its end."""

import pytest

from study.execution.warmup import miniatures
from study.manifest.reader import load_manifest
from study.plan.plan import make_plan
from study.plan.tasks import run_task
from tests.conftest import ROOT, SMALL


@pytest.mark.parametrize("campaign", ["smoke", "streator2022"])
def test_each_miniature_of_the_campaigns_in_the_repository_completes(campaign):
    tasks = make_plan(load_manifest(ROOT / "campaigns" / f"{campaign}.toml")).tasks
    results = {}
    for small in miniatures(tasks):
        results[small.key] = run_task(small, results)
        assert results[small.key].outcome.usable, results[small.key].outcome
    assert {result.kind for result in results.values()} == {task.kind for task in tasks}


def test_the_switches_of_each_case_are_kept(tmp_path):
    path = tmp_path / "switches.toml"
    orders, touches = 'slip_order = ["worst_first", "simultaneous"]', 'initial_contact = ["stick", "frictionless"]'
    axes = "\n".join(["[axes]", orders, touches, 'pin = ["parabola", "flat_punch"]'])
    path.write_text(SMALL.replace("[axes]", axes))
    cases = [small.case for small in miniatures(make_plan(load_manifest(path)).tasks) if small.kind == "record"]
    assert len({(case.pin, case.initial_contact, case.slip_rule.slip_order) for case in cases}) == 8


def test_drives_that_differ_in_numbers_alone_are_one_miniature(tmp_path):
    """Thousands of them would take longer than the run."""
    path = tmp_path / "axes.toml"
    numbers = "[drive_axes]\nspring_stiffness = [1e4, 1e5, 1e6]\npin_mass = [0.1, 1.0]\n"
    path.write_text(SMALL.replace("[[drives]]", f"{numbers}surface_compliance = [true, false]\n[[drives]]", 1))
    small = [task.drive for task in miniatures(make_plan(load_manifest(path)).tasks) if task.drive]
    assert sorted(drive.surface_compliance for drive in small) == [False, True]
