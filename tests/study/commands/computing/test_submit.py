"""The batch script is written beside the results it will have."""

import os
from pathlib import Path

import pytest

from tests.conftest import ROOT, Main


def test_submit_writes_the_script_and_its_folder(main, campaign):
    out = campaign.parent / "out"
    code, said, _ = main("submit", campaign, "--out", out, "--site", ROOT / "slurm" / "site.toml")
    assert (code, said) == (0, f"{out / 'job.sh'}: sbatch it, or use --submit\n")
    assert f"nanoslip run {campaign} --out {out}" in (out / "job.sh").read_text()
    code, _, said = main("submit", campaign, "--out", out, "--site", campaign.parent / "none.toml")
    assert (code, len(said.splitlines())) == (2, 1)


def test_without_settings_those_that_come_with_nanoslip_are_used_and_named(main, campaign):
    out = campaign.parent / "out"
    code, said, _ = main("submit", campaign, "--out", out)
    assert code == 0
    assert said.startswith(f"settings: {ROOT / 'slurm' / 'site.toml'}; copy the file")
    assert "#SBATCH --ntasks=4" in (out / "job.sh").read_text()


def test_settings_without_a_template_beside_them_use_the_one_that_comes_with_nanoslip(main, campaign):
    site = campaign.with_name("mine.toml")
    site.write_text("tasks = 7\n")
    assert main("submit", campaign, "--out", campaign.parent, "--site", site)[0] == 0
    assert "#SBATCH --ntasks=7" in campaign.with_name("job.sh").read_text()


def test_an_array_has_no_more_jobs_than_a_run_takes_shards(main: Main, campaign: Path) -> None:
    code, _, said = main("submit", campaign, "--out", campaign.parent, "--shards", 1_000_000)
    assert (code, "1000000 is not in the range 1<=x<=999999" in said) == (2, True)
    assert not campaign.with_name("array.sh").exists()


def test_an_array_and_the_job_that_merges_are_handed_over_one_behind_the_other(
    main: Main, campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, programs = tmp_path / "out", tmp_path / "bin"
    programs.mkdir()
    sbatch = programs / "sbatch"
    sbatch.write_text(
        f'#!/bin/bash\necho "$@" >> {tmp_path}/asked\necho Submitted batch job 4$(wc -l < {tmp_path}/asked)\n'
    )
    sbatch.chmod(0o755)
    monkeypatch.setenv("PATH", f"{programs}:{os.environ['PATH']}")
    code, said, _ = main("submit", campaign, "--out", out, "--shards", "10")
    assert (code, f"{out / 'array.sh'}: sbatch it" in said, "afterany:NUMBER" in said) == (0, True, True)
    assert '--shard "$SLURM_ARRAY_TASK_ID/10"' in (out / "array.sh").read_text()
    assert main("submit", campaign, "--out", out, "--shards", "10", "--submit")[0] == 0
    asked = (tmp_path / "asked").read_text().splitlines()
    assert asked == [str(out / "array.sh"), f"--dependency=afterany:41 {out / 'merge.sh'}"]
