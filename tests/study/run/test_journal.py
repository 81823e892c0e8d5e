"""A run writes down who computes, where, when and with what, beside the dataset; the dataset has nothing of it."""

import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np

import nanoslip
from nanoslip.solver.outcome import COMPLETED, Ending, Outcome
from nanoslip.study.origin import here
from nanoslip.study.results import attempts as runs
from nanoslip.study.results.attempts import RunRecord
from nanoslip.study.run import executor, journal as journal_module
from nanoslip.study.run.dispatch import RunTally, Watch
from nanoslip.study.run.journal import Journal, read_task_times
from tests.study.run.defects import crashing
from tests.study.run.made_up import Work


def lines(out):
    return (out / runs.RUNS_FILE).read_text().splitlines()


def test_a_run_has_a_line_when_it_begins_and_one_when_it_has_ended(tmp_path):
    journal = Journal(tmp_path, "nanoslip run mine.toml")
    journal.end(0)
    assert runs.read_runs(tmp_path) == []  # it has computed nothing
    journal.begin(2, "ranks")
    (begun,) = runs.read_runs(tmp_path)
    assert (begun.ended, begun.processes, begun.unit, begun.command) == ("", 2, "ranks", "nanoslip run mine.toml")
    journal.computed(RunTally(3, 1, seconds=7.0, processor=5.0, hosts={"n2": 1, "n1": 1}))
    journal.end(3)
    (run,) = runs.read_runs(tmp_path)
    assert (run.run, run.done, run.failed, run.core_seconds, run.exit_code) == (begun.run, 3, 1, 7.0, 3)
    assert run.processor_seconds == 5.0
    assert begun.begun <= run.ended
    assert list(run.hosts) == ["n1", "n2"]
    assert len(lines(tmp_path)) == 2


def test_it_notes_what_tasks_with_a_result_took_and_says_so_at_ever_longer_intervals(tmp_path, monkeypatch):
    now, heard = [0.0], []
    monkeypatch.setattr(journal_module, "time", SimpleNamespace(monotonic=lambda: now[0]))
    journal = Journal(tmp_path, "nanoslip run mine.toml")
    journal.show(Watch(lambda task, outcome, seconds: heard.append(task.kind)))
    journal.begin(1, "process")
    for _ in range(1000):
        now[0] += 1.0
        journal.ended(Work("a", kind="record", cost=0.5), COMPLETED, 1.0)
    journal.ended(Work("b", kind="drive", cost=0.5), Outcome(Ending.CRASHED, "of no result"), 1.0)
    assert len(heard) == 1001
    assert len(lines(tmp_path)) <= 11  # log2 of the seconds, and its begin
    (run,) = runs.read_runs(tmp_path)
    assert run.ended == ""
    assert run.kinds["record"][0] >= 500
    assert read_task_times(tmp_path).factor("record") == 2.0
    journal.computed(RunTally(1000))
    journal.end(0)
    assert runs.read_runs(tmp_path)[0].kinds == {"record": [1000, 500.0, 1000.0]}


def test_what_other_software_took_is_not_compared_with_the_predictions_of_this(tmp_path):
    mine = RunRecord(
        "a", "b", 1, solver=here().solver, nanoslip=here().nanoslip_version, kinds={"record": [1, 1.0, 2.0]}
    )
    for run in (mine, replace(mine, run="c", nanoslip="0.1", kinds={"record": [1, 1.0, 100.0]})):
        runs.add_run(tmp_path, run)
    assert read_task_times(tmp_path, tmp_path).as_data() == {"record": [1, 1.0, 2.0]}


def test_it_names_software_machine_and_job(tmp_path, monkeypatch):
    for name, value in {"ARRAY_JOB_ID": "12", "ARRAY_TASK_ID": "3", "JOB_ID": "15", "STEP_NUM_TASKS": "2"}.items():
        monkeypatch.setenv(f"SLURM_{name}", value)
    monkeypatch.setattr(sys, "argv", ["/somewhere/nanoslip", "run", "my campaign.toml"])
    Journal(tmp_path).begin(1, "process")
    (run,) = runs.read_runs(tmp_path)
    assert run.command == "nanoslip run 'my campaign.toml'"
    assert (run.nanoslip, run.solver) == (here().nanoslip_version, here().solver)
    assert (run.launcher, run.slurm_job, run.mpi) == ("srun", "12_3", "")
    assert run.libraries["numpy"] == np.__version__
    assert all((run.user, run.host, run.python))
    assert sys.platform != "linux" or (run.processor and run.blas)


def test_a_campaign_has_its_dataset_where_its_journal_cannot_be_written(main, campaign, tmp_path):
    (tmp_path / runs.RUNS_FILE).mkdir()
    code, _, said = main("run", campaign, "--out", tmp_path, "--serial")
    assert (code, said.count("runs.jsonl: ")) == (0, 1)
    assert (tmp_path / "results.nc").is_file()


def test_a_run_that_computes_is_written_down_and_one_that_does_not_is_not(tmp_path):
    campaign = {"title": "Pressed", "stages": ["contact"], "numerics": {"n_x": 17}}
    for _ in range(2):
        nanoslip.run(campaign, tmp_path).close()
        (run,) = runs.read_runs(tmp_path)
    assert (run.processes, run.done, run.failed, run.exit_code) == (1, 2, 0, 0)  # a compliance and a contact
    assert run.hosts == {run.host: 1}
    assert 0.0 <= run.core_seconds <= run.wall_seconds
    assert 0.0 < run.processor_seconds <= run.core_seconds + 0.02  # two clocks, and their grain


def test_the_line_of_a_command_has_its_exit_code(main, campaign, tmp_path, monkeypatch):
    monkeypatch.setattr(executor, "run_task", crashing(lambda task: task.kind == "drive"))
    assert main("run", campaign, "--out", tmp_path, "--serial")[0] == 3
    (run,) = runs.read_runs(tmp_path)
    assert (run.exit_code, run.failed) == (3, 8)
