"""Kernels are compiled once before a run, side by side, and whoever waits for that reads why."""

import os
import subprocess
import sys

import pytest

from study.execution.compiling.warm_up import warm_ups
from study.manifest.reader import load_manifest
from study.plan.plan import make_plan
from tests.conftest import ROOT

COMPILE = """
from pathlib import Path
from study.execution.compiling.warm_up import warm_ups
from study.manifest.reader import load_manifest
from study.plan.plan import make_plan
warm_ups(make_plan(load_manifest(Path("campaigns/smoke.toml"))).tasks)[{}].run()
"""


@pytest.mark.slow
def test_contact_and_drives_are_compiled_side_by_side_and_have_no_kernel_in_common(tmp_path):
    """Two processes would compile it twice."""
    tasks = make_plan(load_manifest(ROOT / "campaigns" / "smoke.toml")).tasks
    compiled = []
    for place in range(len(warm_ups(tasks))):
        kept = tmp_path / str(place)
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(kept)}
        subprocess.run([sys.executable, "-c", COMPILE.format(place)], env=environment, cwd=ROOT, check=True)
        compiled.append({path.name.partition("-")[0] for path in kept.rglob("*.nbi")})
    contact, driven = compiled
    assert "cascade.resolve" in contact
    assert "event_driven.integrate_exactly" in driven
    assert not contact & driven


@pytest.mark.slow
def test_that_kernels_are_compiled_is_said_once_and_not_when_they_are_kept(nanoslip, campaign, tmp_path):
    """Whoever waits for a first run reads why."""
    campaign.write_text('title = "One contact"\nstages = ["contact"]\nnumerics.n_x = 17\n')
    kept = {"NUMBA_CACHE_DIR": str(tmp_path / "kept")}
    said = [nanoslip("run", campaign, "--out", tmp_path / out, **kept).stderr for out in ("first", "second")]
    assert [each.count("compiling kernels of contact and sliding, once") for each in said] == [1, 0]
