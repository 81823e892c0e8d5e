"""Runs of a campaign by command: here, in shards and in batch jobs."""

import json
import os
from dataclasses import replace

import pytest
import xarray as xr

import nanoslip as nanoslip_here
from nanoslip.study.commands import datasets
from nanoslip.study.origin import here
from nanoslip.study.results import attempts, entry, files
from nanoslip.study.results.store import Store, StoreError
from nanoslip.study.run import executor
from nanoslip.study.run.child import ChildProcess
from nanoslip.study.tasks.compute import run_task
from tests.conftest import PARTLY_REFUSED, ROOT, SMALL
from tests.study.results.results import written
from tests.study.run.defects import crashing_at

# A run computes what is not finished and keeps what it can; its state is counted and its dataset collected at any time.


def content(out):
    """Bytes and times of all files."""
    return {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in out.rglob("*") if path.is_file()}


@pytest.mark.slow
def test_a_finished_campaign_is_shown_again_and_nothing_is_computed_collected_or_written(run, ask, out, monkeypatch):
    code, said, errors = run()
    assert (code, f"dataset: {out / 'results.nc'}" in said, "13 of 13 tasks done" in errors) == (0, True, True)
    before = content(out)
    monkeypatch.setattr(datasets, "collect", None)  # would be called in vain
    monkeypatch.setattr(ChildProcess, "load", None)  # so would what imports all that computes
    for again in run(), ask("run", "-j", "1"):
        assert (*again[:2], "4 cases, 0 tasks left" in again[2]) == (0, said, True), again
    assert content(out) == before


@pytest.mark.slow
@pytest.mark.parametrize("lost", ["results.nc", "results/dataset.json", "results/*.log"])
def test_what_is_lost_is_made_again(run, finished, lost):
    before = (finished / "results.nc").read_bytes()
    for path in finished.glob(lost):
        path.unlink()
    assert run()[0] == 0
    assert (finished / "results.nc").read_bytes() == before


@pytest.mark.slow
def test_files_of_others_among_the_results_stay_and_results_of_another_format_are_refused(run, ask, out):
    results = out / "results"
    results.mkdir(parents=True)
    (results / "notes.log").write_text("what I did on Monday")
    assert run()[0] == 0
    assert (results / "notes.log").read_text() == "what I did on Monday"
    for path in (next(results.glob("0*.log")), next(results.glob(f"*{entry.ENDING}"))):
        ours = path.read_bytes()
        newer = b"nslip 2\n" + bytes(len(ours))
        path.write_bytes(newer)
        for code, _, errors in (run(), ask("collect"), ask("status")):
            assert (code, errors.count(f"{path.name}: has format 2")) == (2, 1)
        assert path.read_bytes() == newer
        path.write_bytes(ours)
    assert run()[0] == 0


@pytest.mark.slow
def test_results_of_other_software_are_named_and_computed_again_when_asked(run, ask, campaign, finished):
    assert not [command for command in ("plan", "status") if "other software's" in ask(command)[1]]
    before, store = (finished / "results.nc").read_bytes(), Store(finished)
    changed = sorted(store.finished())[::3]
    for key in changed:
        other = replace(store.read(key), origins=(replace(here(), source_hash="0ther", source_commit="c0ffee"),))
        store.write(other, shared=entry.result_path(store.folder, key).exists())
    kept, count = written(finished), len(changed)
    for command in ("plan", "status"):
        code, said, _ = ask(command)
        assert code == 0
        assert f"{count} of nanoslip" in said
        assert "commit c0ffee" in said
        assert f"nanoslip run {campaign} --out {finished} --recompute-foreign" in said
    for _ in range(2):  # the first run collects what has changed
        code, said, errors = run()
        assert (code, "0 tasks to do" in errors, "source 0ther" in errors) == (0, True, True)
        assert f"{count} finished results" in errors
        assert "different software: " in said
    with xr.open_dataset(finished / "results.nc") as found:
        assert "of nanoslip" in found.attrs["mixed_software"]
    assert "different software: " in ask("collect")[1]
    code, said, errors = run("--recompute-foreign")
    assert (code, "different software" in said) == (0, False)
    assert f"{count} results of other" in errors
    assert (finished / "results.nc").read_bytes() == before
    assert (written(finished) - kept).keys() <= set(changed)  # nothing else was computed again


DROPPED = SMALL + "records = false\ntrajectory = false\n"


def test_records_that_nobody_wants_are_gone_after_the_run(run, campaign, out):
    campaign.write_text(DROPPED)
    assert run()[0] == 0
    assert len(written(out)) == 1 + 4 + 8  # the compliance, scalars of records and of drives
    assert sum(path.stat().st_size for path in (out / "results").glob("*.log")) < 5_000 * 12
    code, said, progress = run()
    assert (code, "0 tasks to do" in progress) == (0, True)
    # One slow stage never gets the pin to slip, another so late that its mean force says nothing yet.
    # Each drive is in a row, and each failure once more with its advice.
    assert [said.count(ending) for ending in ("completed", "no_slip", "no_plateau")] == [6, 2, 2]
    assert [said.count(f"{ending}: 1 of 8 drives") for ending in ("no_slip", "no_plateau")] == [1, 1]


@pytest.mark.slow
def test_a_task_that_crashes_is_an_outcome_and_exit_code_3_until_it_is_tried_again(run, ask, out, monkeypatch):
    monkeypatch.setattr(executor, "run_task", crashing_at("record", 100.0))
    code, said, errors = run()
    assert (code, "RuntimeError: a defect" in errors) == (3, True)
    assert "6 tasks failed" in errors  # two records and the two drives of each
    assert [said.count(word) for word in ("completed", "no_slip", "crashed: 2 of 4 cases")] == [3, 2, 1]
    first = (out / "results.nc").read_bytes()
    monkeypatch.setattr(executor, "run_task", run_task)
    code, said, errors = run()
    assert (code, "6 tasks failed before" in errors) == (3, True)
    assert (out / "results.nc").read_bytes() == first
    assert "6 tasks are" in ask("status")[1]
    code, said, errors = run("--retry")
    assert (code, "6 tasks left" in errors) == (0, True)
    assert [said.count(word) for word in ("completed", "no_slip", "crashed")] == [6, 2, 0]


@pytest.mark.slow
def test_what_was_tried_again_with_success_and_dropped_has_not_failed(run, campaign, monkeypatch):
    """Drives that are added later are computed, from a record that is computed for them once more."""
    campaign.write_text(DROPPED)
    with monkeypatch.context() as once:
        once.setattr(executor, "run_task", crashing_at("record", 100.0))
        code, said, _ = run()
    assert (code, "crashed: 2 of 4 cases" in said) == (3, True)  # of which the scalars alone are kept
    assert run("--retry")[0] == 0
    campaign.write_text(DROPPED + '[[drives]]\nname = "third"\nstage_velocity = 5e-3\nsamples = 40\n')
    code, said, errors = run()
    assert (code, "failed before" in errors, "pending" in said) == (0, False, False)


def without(patch, kind, error=None):
    """Let results of a kind be lost when they are written, without a word or with an error."""
    write = Store.write

    def lossy(store, result, shared=False):
        if result.kind != kind:
            write(store, result, shared)
        elif error is not None:
            raise error

    patch.setattr(Store, "write", lossy)


@pytest.mark.slow
def test_a_drive_that_is_not_computed_is_never_completed(run, ask, monkeypatch):
    """Its record failed, was computed in the next run, and that was interrupted before the drive."""
    with monkeypatch.context() as once:
        once.setattr(executor, "run_task", crashing_at("record", 100.0))
        assert run()[0] == 3
    counted = json.loads(ask("status", "--json")[1])
    assert counted["tasks"]["drive"].items() >= {"all": 8, "finished": 4, "left": 0, "given_up": 4}.items()
    assert (counted["finished"], counted["drives"].get("crashed")) == (False, 4)  # as their cases
    with monkeypatch.context() as once:
        without(once, "drive", StoreError("no space"))
        assert run("--retry")[0] == 2
    counted = json.loads(ask("status", "--json")[1])
    drives = counted["tasks"]["drive"]
    assert counted["drives"]["pending"] == drives["left"] > 0
    # of the record that was not reached
    assert counted["drives"]["crashed"] == drives["given_up"] == 4 - drives["left"]
    assert run("--retry")[0] == 0


def test_results_that_do_not_appear_are_named_and_exit_code_99(run, campaign, out, monkeypatch):
    """As where a node has lost what it had written."""
    with monkeypatch.context() as once:
        once.setattr(files, "VISIBLE", 0.1)
        without(once, "drive")
        code, _, errors = run()
        said = "not there though they were computed: 8 of 13 results, first that of drive"
        assert (code, errors.count(said)) == (99, 1)
        with pytest.raises(StoreError, match="8 of 8 results"):
            nanoslip_here.run(campaign, out)
    assert run()[0] == 0


def test_results_that_appear_later_are_waited_for(run, monkeypatch):
    """Clients of a network file system may show a folder as it was."""
    looks, metas = [], Store.metas

    def shown_later(store):
        looks.append(store)
        return metas(store) if len(looks) > 2 else {}

    monkeypatch.setattr(files, "LOOK", 0.01)
    monkeypatch.setattr(Store, "metas", shown_later)
    assert run()[0] == 0
    assert len(looks) > 2


@pytest.mark.slow
def test_a_dataset_in_which_a_case_is_pending_is_not_exit_code_0(run, monkeypatch):
    """Whatever has become of its result."""
    find = Store.find
    with monkeypatch.context() as once:
        once.setattr(Store, "find", lambda *of: found if (found := find(*of)) and found.kind != "drive" else None)
        for _ in range(2):
            code, _, errors = run()
            assert (code, errors.count("8 outcomes pending")) == (99, 1)
    assert run()[0] == 0


def test_a_run_without_numbas_compiler_is_refused_and_no_task_fails(run, out, monkeypatch):
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    code, _, errors = run()
    assert (code, errors.count("NUMBA_DISABLE_JIT"), out.exists()) == (2, 1, False)


def test_a_full_disk_is_one_message_and_exit_code_2(run, out, monkeypatch):
    with monkeypatch.context() as once:
        without(once, "record", StoreError("results: cannot write it: No space left on device"))
        code, _, errors = run()
    assert (code, "Traceback" in errors) == (2, False)
    assert errors.count("No space left") == 1
    assert not (out / "results.nc").exists()
    assert not (out / "attempts.jsonl").exists()  # no fault of any task
    assert run()[0] == 0


# The state of a campaign, counted from its files alone.


@pytest.mark.slow
def test_outcomes_are_counted_as_the_dataset_has_them_refused_cases_among_them(run, ask, campaign, out):
    campaign.write_text(PARTLY_REFUSED)
    assert "4 of them refused" in ask("plan")[1]
    assert json.loads(ask("status", "--json")[1])["cases"] == {"pending": 12, "invalid": 4}
    code, said, _ = run()
    assert (code, "invalid: 4 of 16 cases" in said) == (0, True)
    assert ": rows = 5: " in said
    found = json.loads(ask("status", "--json")[1])
    assert (found["finished"], sum(found["cases"].values()), sum(found["drives"].values())) == (True, 16, 32)
    with nanoslip_here.open(out) as data:
        for key, name in (("cases", "outcome"), ("drives", "drive_outcome")):
            words = data[name].values.ravel().tolist()
            assert found[key] == {word: words.count(word) for word in set(words)}
    rows = {line.split()[0]: line.split()[1:] for line in ask("status")[1].splitlines() if line.strip()}
    assert rows["invalid"] == ["4", "8"]


def colours(patch, columns):
    """Make this a terminal with colours, of so many columns."""
    for name, value in (("FORCE_COLOR", "1"), ("TERM", "xterm"), ("COLUMNS", columns)):
        patch.setenv(name, value)
    patch.delenv("NO_COLOR", raising=False)


# Collecting.


def test_what_is_not_finished_is_collected_as_pending_into_a_folder_named_after_the_campaign(
    main, campaign, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    code, said, _ = main("collect", campaign)
    assert (code, said.count("pending")) == (0, 8)  # cases times drives
    with nanoslip_here.open("results/small/results.nc") as found:
        assert set(found["outcome"].values.ravel()) == {"pending"}


@pytest.mark.slow
def test_a_failure_that_all_cases_share_is_said_once_in_red_with_its_advice(run, ask, campaign, monkeypatch):
    campaign.write_text(SMALL + "[slip]\ncascade_limit = 1\n")
    assert run()[0] == 0
    colours(monkeypatch, "300")
    (line,) = (line for line in ask("collect")[1].splitlines() if "raise it" in line)
    assert line.startswith("\x1b[31mcascade_limit: 4 of 4 cases, first μ_i = 0.25, R/L_x = 50: ")


@pytest.mark.slow
def test_a_finished_dataset_is_not_replaced_by_one_of_a_changed_campaign_without_a_word(ask, campaign, finished):
    before = (finished / "results.nc").read_bytes()
    campaign.write_text(SMALL.replace("n_x = 17", "n_x = 9"))
    code, _, said = ask("collect")
    assert (code, (finished / "results.nc").read_bytes()) == (2, before)
    assert "4 finished cases" in said
    assert f"nanoslip collect {campaign} --out {finished} --replace writes" in said
    assert ask("collect", "--replace")[0] == 0
    with nanoslip_here.open(finished) as found:
        assert set(found["outcome"].values.ravel()) == {"pending"}


def test_a_changed_campaign_of_which_all_is_there_is_collected(ask, campaign, finished):
    """One value less of an axis leaves fewer cases, and loses none that are asked for."""
    campaign.write_text(SMALL.replace("intrinsic_friction = [0.25, 0.5]", "intrinsic_friction = [0.5]"))
    assert ask("collect")[0] == 0


# Shards compute a campaign between them; merged, they are the same bytes as one run. Scripts hand them to a scheduler.


def dataset(out):
    return (out / "results.nc").read_bytes()


@pytest.mark.slow
def test_merged_shards_are_the_same_bytes_as_one_run(run, ask, campaign, out, computed):
    for number in (3, 1, 2):
        code, said, errors = run("--shard", f"{number}/3")
        assert (code, f"nanoslip merge {campaign} --out {out}" in said) == (0, True)
        assert f", shard {number} of 3: " in errors
    assert not (out / "results.nc").exists()
    assert ask("status", "--json")[1].count('"finished": true') == 1
    unmerged = f"counted with the results of 3 shards not merged yet; nanoslip merge {campaign} --out {out} brings"
    assert unmerged in ask("status")[1]
    code, said, errors = ask("merge")
    assert (code, f"dataset: {out / 'results.nc'}" in said, errors) == (0, True, "")
    assert sorted(path.name for path in out.iterdir()) == ["results", "results.nc", "runs.jsonl"]
    assert len(attempts.read_runs(out)) == 3
    assert dataset(out) == dataset(computed)
    code, _, errors = run()
    assert (code, "0 tasks to do" in errors) == (0, True)


def test_a_shard_for_which_no_case_is_left_says_so_and_ends_well(run, ask, out):
    code, said, errors = run("--shard", "5/5")
    assert (code, said.startswith("shard 5 of 5 "), errors) == (0, True, "")
    assert [run("--shard", f"{number}/5")[0] for number in (1, 2, 3, 4)] == [0, 0, 0, 0]
    code, said, errors = ask("merge")
    assert (code, f"dataset: {out / 'results.nc'}" in said, errors) == (0, True, "")


@pytest.mark.slow
def test_what_a_shard_has_not_finished_is_left_and_another_run_of_it_or_of_all_computes_that_alone(
    run, ask, campaign, out, computed
):
    assert run("--shard", "1/2")[0] == 0
    code, said, _ = ask("collect")
    assert (code, f"nanoslip merge {campaign} --out {out}" in said) == (0, True)
    code, _, errors = ask("merge")
    assert (code, f"nanoslip run {campaign} --out {out}" in errors) == (99, True)
    assert '"finished": false' in ask("status", "--json")[1]
    code, _, errors = run("--shard", "1/2")
    assert (code, "0 tasks to do" in errors) == (0, True)  # it is merged
    assert run("--shard", "2/2")[0] == 0
    code, _, errors = run()  # takes in what shards have
    assert (code, "0 tasks to do" in errors) == (0, True)
    assert '"pending"' not in ask("status", "--json")[1]
    assert dataset(out) == dataset(computed)


@pytest.mark.slow
def test_a_failure_of_a_shard_is_one_of_the_campaign_and_not_tried_again(run, ask, monkeypatch):
    with monkeypatch.context() as once:
        once.setattr(executor, "run_task", crashing_at("record", 100.0))
        codes, said, _ = zip(*(run("--shard", f"{number}/2") for number in (1, 2)), strict=True)
    assert any("has ended without" in each for code, each in zip(codes, said, strict=True) if code == 3)
    code, said, errors = ask("merge")
    assert (code, "crashed: 2 of 4 cases" in said, "--retry tries again" in errors) == (3, True, True)
    for number in (1, 2):
        code, _, errors = run("--shard", f"{number}/2")
        assert (code, "0 tasks to do" in errors) == (codes[number - 1], True)
        run("--shard", f"{number}/2", "--retry")
    assert ask("merge")[0] == 0


def test_what_is_no_shard_is_one_line_and_exit_code_2(run):
    code, _, errors = run("--shard", "4/3")
    assert (code, "4/3: needs NUMBER/OF" in errors) == (2, True)


def test_where_there_is_no_shard_and_no_result_nothing_is_merged_and_no_folder_made(ask, campaign, out):
    """As where `--out` was forgotten: an empty dataset would pass for one of the shards."""
    code, said, errors = ask("merge")
    assert (code, said, out.exists()) == (2, "", False)
    assert f"results of {campaign}" in errors


# Scripts, beside the results they will have.


def test_submit_writes_the_script_and_its_folder(ask, campaign, out):
    code, said, _ = ask("submit", "--site", ROOT / "slurm" / "site.toml")
    assert (code, said.partition(":")[0], "--submit" in said) == (0, str(out / "job.sh"), True)
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


def test_more_ranks_than_have_work_are_reported_and_paths_are_plain(ask, main, campaign, out):
    site, inner = campaign.with_name("mine.toml"), campaign.parent / "inner"
    inner.mkdir()
    for tasks, reported in ((1, False), (500, True)):
        site.write_text(f"tasks = {tasks}\n")
        assert ("500" in ask("submit", "--site", site)[2]) == reported
    assert main("submit", inner / ".." / campaign.name, "--out", inner / ".." / "here")[0] == 0
    assert ".." not in (campaign.parent / "here" / "job.sh").read_text()
    assert ask("run", "--serial")[0] == 0
    site.write_text("tasks = 1\n")
    assert "finished" in ask("submit", "--site", site)[2]


def test_an_array_has_no_more_jobs_than_a_run_takes_shards(ask, out):
    code, _, said = ask("submit", "--shards", 1_000_000)
    assert (code, "1<=x<=999999" in said, out.exists()) == (2, True, False)


def test_an_array_and_the_job_that_merges_are_handed_over_one_behind_the_other(ask, out, tmp_path, monkeypatch):
    asked, sbatch = tmp_path / "asked", tmp_path / "bin" / "sbatch"
    sbatch.parent.mkdir()
    sbatch.write_text(f'#!/bin/bash\necho "$@" >> {asked}\necho "4$(wc -l < {asked});cluster"\n')
    sbatch.chmod(0o755)
    monkeypatch.setenv("PATH", f"{sbatch.parent}:{os.environ['PATH']}")
    code, said, _ = ask("submit", "--shards", "10")
    assert (code, f"{out / 'array.sh'}: sbatch it" in said, "afterany:NUMBER" in said) == (0, True, True)
    assert '--shard "$SLURM_ARRAY_TASK_ID/10"' in (out / "array.sh").read_text()
    assert ask("submit", "--shards", "10", "--submit")[0] == 0
    first, then = asked.read_text().splitlines()
    assert first == f"--parsable {out / 'array.sh'}"
    assert then == f"--parsable --dependency=afterany:41 {out / 'merge.sh'}"
