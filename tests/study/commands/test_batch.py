"""Shards compute a campaign between them; merged, they are the same bytes as one run. Scripts hand them to a scheduler."""

import os

import pytest

import nanoslip
from nanoslip.study.results import attempts
from nanoslip.study.results.shard import Shard
from nanoslip.study.results.store import Lease
from nanoslip.study.run import executor
from tests.conftest import ROOT
from tests.study.run.defects import crashing, crashing_at


def dataset(out):
    return (out / "results.nc").read_bytes()


def test_merged_shards_are_the_same_bytes_as_one_run(main, run, ask, campaign, out, tmp_path):
    for number in (3, 1, 2):
        code, said, errors = run("--shard", f"{number}/3")
        assert (code, f"shard {number} of 3 is done; nanoslip merge {campaign} --out {out} brings" in said) == (0, True)
        assert f", shard {number} of 3: " in errors
    assert not (out / "results.nc").exists()
    assert ask("status", "--json")[1].count('"finished": true') == 1
    unmerged = f"counted with the results of 3 shards not merged yet; nanoslip merge {campaign} --out {out} brings"
    assert unmerged in ask("status")[1]
    code, said, errors = ask("merge")
    assert (code, f"dataset: {out / 'results.nc'}" in said, errors) == (0, True, "")
    assert sorted(path.name for path in out.iterdir()) == ["results", "results.nc", "runs.jsonl"]
    assert len(attempts.read(out)) == 3
    assert main("run", campaign, "--out", tmp_path / "alone", "--serial")[0] == 0
    assert dataset(out) == dataset(tmp_path / "alone")
    code, _, errors = run()
    assert (code, "0 tasks to do" in errors) == (0, True)


def test_a_shard_for_which_no_case_is_left_says_so_and_ends_well(run, ask, out):
    code, said, errors = run("--shard", "5/5")
    assert (code, said.startswith("shard 5 of 5 has nothing to do: "), errors) == (0, True, "")
    assert [run("--shard", f"{number}/5")[0] for number in (1, 2, 3, 4)] == [0, 0, 0, 0]
    code, said, errors = ask("merge")
    assert (code, f"dataset: {out / 'results.nc'}" in said, errors) == (0, True, "")


def test_what_a_shard_has_not_finished_is_left_and_another_run_of_it_or_of_all_computes_that_alone(
    main, run, ask, campaign, out, tmp_path
):
    assert run("--shard", "1/2")[0] == 0
    code, said, _ = ask("collect")
    assert (code, f"without 1 shard; nanoslip merge {campaign} --out {out} takes them in" in said) == (0, True)
    code, _, errors = ask("merge")
    assert (code, f"tasks left: nanoslip run {campaign} --out {out} computes them" in errors) == (99, True)
    assert '"finished": false' in ask("status", "--json")[1]
    code, _, errors = run("--shard", "1/2")
    assert (code, "0 tasks to do" in errors) == (0, True)  # it is merged
    assert run("--shard", "2/2")[0] == 0
    code, _, errors = run()  # takes in what shards have
    assert (code, "0 tasks to do" in errors) == (0, True)
    assert '"pending"' not in ask("status", "--json")[1]
    main("run", campaign, "--out", tmp_path / "alone", "--serial")
    assert dataset(out) == dataset(tmp_path / "alone")


def test_what_other_shards_have_not_computed_a_run_computes(run, ask):
    assert (run("--shard", "1/2")[0], ask("merge")[0]) == (0, 99)
    code, _, errors = run()
    assert (code, "4 cases, 0 tasks left" in errors) == (0, False)
    assert '"pending"' not in ask("status", "--json")[1]


def test_a_shard_of_which_tasks_failed_has_ended_without_them(run, monkeypatch):
    monkeypatch.setattr(executor, "run_task", crashing(lambda task: task.kind == "record"))
    for _ in ("now", "before"):
        code, said, _ = run("--shard", "1/1")
        assert (code, "shard 1 of 1 has ended without 12 tasks; nanoslip merge" in said) == (3, True)


def test_python_takes_in_what_shards_have_finished_too(run, campaign, out):
    run("--shard", "1/1")
    nanoslip.run(campaign, out).close()
    assert len(attempts.read(out)) == 1  # it had nothing to compute
    assert not (out / "shards").exists()


def test_a_shard_at_work_is_named_and_the_others_are_merged(run, ask, out):
    for number in (1, 2):
        run("--shard", f"{number}/2")
    with Lease(Shard(2, 2).folder(out)):
        code, _, errors = ask("merge")
    assert (code, errors.count("a run is at work there")) == (99, 1)
    assert ask("merge")[0] == 0


def test_a_failure_of_a_shard_is_one_of_the_campaign_and_not_tried_again(run, ask, monkeypatch):
    with monkeypatch.context() as once:
        once.setattr(executor, "run_task", crashing_at("record", 100.0))
        codes = [run("--shard", f"{number}/2")[0] for number in (1, 2)]
    assert 3 in codes
    code, said, errors = ask("merge")
    assert (code, "crashed: 2 of 4 cases" in said, "--retry tries again" in errors) == (3, True, True)
    for number in (1, 2):
        code, _, errors = run("--shard", f"{number}/2")
        assert (code, "0 tasks to do" in errors) == (codes[number - 1], True)
        run("--shard", f"{number}/2", "--retry")
    assert ask("merge")[0] == 0


def test_what_is_no_shard_is_one_line_and_exit_code_2(run):
    code, _, errors = run("--shard", "4/3")
    assert (code, "4/3: needs NUMBER/OF, as 1/10 to 10/10" in errors) == (2, True)


def test_where_there_is_no_shard_and_no_result_nothing_is_merged_and_no_folder_made(ask, campaign, out):
    """As where `--out` was forgotten: an empty dataset would pass for one of the shards."""
    code, said, errors = ask("merge")
    assert (code, said, out.exists()) == (2, "", False)
    assert f"{out}: no shards and no results of {campaign} there" in errors


# Scripts, beside the results they will have.


def test_submit_writes_the_script_and_its_folder(ask, campaign, out):
    code, said, _ = ask("submit", "--site", ROOT / "slurm" / "site.toml")
    assert (code, said) == (0, f"{out / 'job.sh'}: sbatch it, or use --submit\n")
    assert f"nanoslip run {campaign} --out {out}" in (out / "job.sh").read_text()
    code, _, said = ask("submit", "--site", campaign.parent / "none.toml")
    assert (code, len(said.splitlines())) == (2, 1)


@pytest.mark.parametrize("own", [True, False])
def test_settings_or_a_template_that_are_not_given_are_those_that_come_with_nanoslip(ask, campaign, out, own):
    site = campaign.with_name("mine.toml")
    site.write_text("tasks = 7\n")
    code, said, _ = ask("submit", *(("--site", site) if own else ()))
    assert (code, said.startswith(f"settings: {ROOT / 'slurm' / 'site.toml'}; copy the file")) == (0, not own)
    assert f"#SBATCH --ntasks={7 if own else 4}\n" in (out / "job.sh").read_text()


def test_an_array_has_no_more_jobs_than_a_run_takes_shards(ask, out):
    code, _, said = ask("submit", "--shards", 1_000_000)
    assert (code, "1000000 is not in the range 1<=x<=999999" in said, out.exists()) == (2, True, False)


def test_an_array_and_the_job_that_merges_are_handed_over_one_behind_the_other(ask, out, tmp_path, monkeypatch):
    asked, sbatch = tmp_path / "asked", tmp_path / "bin" / "sbatch"
    sbatch.parent.mkdir()
    sbatch.write_text(f'#!/bin/bash\necho "$@" >> {asked}\necho Submitted batch job 4$(wc -l < {asked})\n')
    sbatch.chmod(0o755)
    monkeypatch.setenv("PATH", f"{sbatch.parent}:{os.environ['PATH']}")
    code, said, _ = ask("submit", "--shards", "10")
    assert (code, f"{out / 'array.sh'}: sbatch it" in said, "afterany:NUMBER" in said) == (0, True, True)
    assert '--shard "$SLURM_ARRAY_TASK_ID/10"' in (out / "array.sh").read_text()
    assert ask("submit", "--shards", "10", "--submit")[0] == 0
    assert asked.read_text().splitlines() == [str(out / "array.sh"), f"--dependency=afterany:41 {out / 'merge.sh'}"]
