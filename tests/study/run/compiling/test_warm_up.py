"""Kernels are compiled once before a run, side by side, and whoever waits for that reads why."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.plan import make_plan
from nanoslip.study.run.warm_up import warm_ups
from tests.conftest import ROOT, Command

pytestmark = pytest.mark.slow

COMPILE = """
from pathlib import Path
from nanoslip.study.run.warm_up import warm_ups
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.plan import make_plan
warm_ups(make_plan(load_manifest(Path("campaigns/smoke.toml"))).tasks)[{}].run()
"""
SAID = "compiling kernels of contact and sliding, once"


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[Path, str]]:
    """What each part of the smoke campaign's kernels leaves on a disk of its own, and what it says meanwhile."""
    tasks, found = make_plan(load_manifest(ROOT / "campaigns" / "smoke.toml")).tasks, []
    for place in range(len(warm_ups(tasks))):
        kept = tmp_path_factory.mktemp("kept")
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(kept)}
        words = [sys.executable, "-c", COMPILE.format(place)]
        done = subprocess.run(words, env=environment, cwd=ROOT, check=True, stderr=subprocess.PIPE, text=True)
        found.append((kept, done.stderr))
    return found


def test_contact_and_drives_are_compiled_side_by_side_and_have_no_kernel_in_common(
    compiled: list[tuple[Path, str]],
) -> None:
    """Two processes would compile it twice."""
    contact, driven = ({path.name.partition("-")[0] for path in kept.rglob("*.nbi")} for kept, _ in compiled)
    assert "events.resolve" in contact
    assert "steps.integrate_exactly" in driven
    assert not contact & driven


def test_that_kernels_are_compiled_is_said_once_and_not_when_they_are_kept(
    compiled: list[tuple[Path, str]], nanoslip: Command, campaign: Path
) -> None:
    """Whoever waits for a first run reads why. The run has one kernel to compile that comes last, then none."""
    kept, said = compiled[0]
    assert said.count(SAID) == 1
    campaign.write_text('title = "One contact"\nstages = ["contact"]\nnumerics.n_x = 17\n')
    for path in kept.rglob("events.answer_violations-*"):
        path.unlink()
    runs = [
        nanoslip("run", campaign, "--out", campaign.parent / out, NUMBA_CACHE_DIR=str(kept)).stderr
        for out in ("first", "second")
    ]
    assert [each.count(SAID) for each in runs] == [1, 0]
