"""With a head start ranks compute while cases are planned, and the dataset is the same, byte for byte."""

import subprocess
import sys

import pytest

from tests.conftest import launcher, longer
from tests.study.commands.running import head_start_program
from tests.study.results.results import written

pytestmark = pytest.mark.mpi


def test_a_head_start_on_two_ranks_gives_the_same_dataset(nanoslip, environment, tmp_path):
    campaign, whole, out = (tmp_path / name for name in ("long.toml", "whole", "out"))
    campaign.write_text(longer(radii=10, events=200))
    assert nanoslip("run", campaign, "--out", whole, "--serial").returncode == 0
    words = [*launcher(2), sys.executable, head_start_program.__file__, "run", str(campaign), "--out", str(out)]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("computing begins while cases are planned, 2 ranks") == 1
    assert f"{len(written(whole))} tasks left" not in done.stderr
    assert (out / "results.nc").read_bytes() == (whole / "results.nc").read_bytes()
