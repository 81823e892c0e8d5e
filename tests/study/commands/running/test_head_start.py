"""A head start changes nothing but when tasks are computed; what cannot be computed says the same as without."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from study.commands.running import head_start
from study.execution import executor
from study.plan import memory
from study.plan.plan import Planning
from study.plan.tasks import run_task
from study.results import runs
from tests.conftest import SMALL, Main, longer
from tests.study.execution.defects import crashing_at
from tests.study.results.results import until_written, written

PROGRAM = Path(__file__).with_name("head_start_program.py")
TASKS = 13
"""Of the small campaign."""


@pytest.fixture
def early(monkeypatch: pytest.MonkeyPatch) -> None:
    """A head start for the small campaign, a case at a time."""
    monkeypatch.setattr(head_start, "LARGE", 4)
    monkeypatch.setattr(head_start, "AT_ONCE", 1)


@pytest.mark.usefixtures("early")
@pytest.mark.parametrize(
    "changes",
    [
        "",
        "[outputs]\nrecords = false\ntrajectory = false\n",
        "MEMBERS",
    ],
    ids=["plain", "intermediate records", "ensemble"],
)
def test_the_dataset_is_the_same_and_some_of_it_was_computed_early(main: Main, campaign: Path, changes: str) -> None:
    target = SMALL.replace("ensemble.members = 1", "target.within = 0.9")
    campaign.write_text(target if changes == "MEMBERS" else SMALL + changes)
    out, apart = campaign.parent / "out", campaign.parent / "apart"
    code, _, said = main("run", campaign, "--out", out, "--serial")
    assert code == 0
    assert "computing begins while cases are planned" in said
    with pytest.MonkeyPatch.context() as none:
        none.setattr(head_start, "LARGE", 10**9)
        assert main("run", campaign, "--out", apart, "--serial")[0] == 0
    assert (out / "results.nc").read_bytes() == (apart / "results.nc").read_bytes()
    assert written(out) == written(apart)
    (run,), (other,) = runs.read(out), runs.read(apart)
    assert (run.done, run.failed, run.hosts) == (other.done, 0, other.hosts)
    assert f"{run.done} of {run.done} tasks done" not in said  # some were done before


def test_small_campaigns_have_none(main: Main, campaign: Path) -> None:
    said = main("run", campaign, "--out", campaign.parent / "out", "--serial")[2]
    assert "computing begins" not in said


@pytest.mark.usefixtures("early")
def test_what_is_there_leaves_a_run_as_it_was(main: Main, campaign: Path, finished: Path) -> None:
    campaign.write_text(SMALL.replace("[50.0, 100.0]", "[50.0, 100.0, 200.0]"))
    code, _, said = main("run", campaign, "--out", finished, "--serial")
    assert (code, "computing begins" in said) == (0, False)


@pytest.mark.usefixtures("early")
def test_two_cases_that_are_the_same_are_said_before_anything_is_computed(main: Main, campaign: Path) -> None:
    campaign.write_text(SMALL.replace("[50.0, 100.0]", "[50.0, 100.0, 50.0]"))
    out = campaign.parent / "out"
    code, _, said = main("run", campaign, "--out", out, "--serial")
    assert code == 2
    assert "cases 1 and 3 are the same: " in said
    assert not out.exists()


@pytest.mark.usefixtures("early")
def test_a_case_that_fits_no_machine_is_refused_in_the_same_words(
    main: Main, campaign: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is the last one: nothing is known of it when the first ones are computed, which are kept."""
    campaign.write_text(SMALL.replace("n_x = 17", "").replace("[axes]", "[axes]\nn_x = [17, 257]"))
    monkeypatch.setattr(memory, "machine_memory", lambda: 2.05e8)
    monkeypatch.setattr(head_start, "machine_memory", lambda: 2.05e8)
    out, refused = campaign.parent / "out", []
    for large in (10**9, 4):
        monkeypatch.setattr(head_start, "LARGE", large)
        code, _, said = main("run", campaign, "--out", out, "--serial")
        refused.append((code, said[said.index("Error: ") :]))
    assert refused[0] == refused[1]
    assert refused[0][0] == 2
    assert len(written(out)) > 0


@pytest.mark.usefixtures("early")
def test_what_crashes_early_has_failed_in_this_run(main: Main, campaign: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(executor, "run_task", crashing_at("record", 50.0))
    out = campaign.parent / "out"
    code, said, errors = main("run", campaign, "--out", out, "--serial", "--retry")
    assert (code, "crashed: 2 of 4 cases" in said) == (3, True)
    assert "6 tasks failed, or needed one that did" in errors  # two records and the two drives of each
    assert "failed before" not in errors
    assert (runs.read(out)[0].done, runs.read(out)[0].failed) == (TASKS - 6, 6)
    monkeypatch.setattr(executor, "run_task", run_task)
    code, _, errors = main("run", campaign, "--out", out, "--serial", "--retry")
    assert (code, "computing begins" in errors, "6 tasks left" in errors) == (0, False, True)


@pytest.mark.usefixtures("early")
def test_a_signal_ends_it_and_the_next_run_goes_on(main: Main, campaign: Path, finished: Path) -> None:
    out, left = campaign.parent / "out", [3]
    plan_on = Planning.go_on

    def told_to_stop(planning: Planning, cases: int) -> bool:
        left[0] -= 1
        if not left[0]:
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(0.5)  # until it is heard
        return plan_on(planning, cases)

    with pytest.MonkeyPatch.context() as once:
        once.setattr(Planning, "go_on", told_to_stop)
        code, _, said = main("run", campaign, "--out", out, "--serial")
    assert (code, said.count("interrupted: what is finished is kept")) == (99, 1)
    assert (runs.read(out)[0].exit_code, (out / "results.nc").exists()) == (99, False)
    assert main("run", campaign, "--out", out, "--serial")[0] == 0
    assert (out / "results.nc").read_bytes() == (finished / "results.nc").read_bytes()


@pytest.mark.usefixtures("early")
def test_long_tasks_and_what_needs_them_wait_for_the_plan(
    main: Main, campaign: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(head_start, "SHORT", 0.0)
    said = main("run", campaign, "--out", campaign.parent / "out", "--serial")[2]
    assert f"{TASKS} tasks left" in said


@pytest.fixture
def long(tmp_path: Path) -> Path:
    """Some tens of cases."""
    path = tmp_path / "long.toml"
    path.write_text(longer(radii=10, events=200))
    return path


def started(environment: dict[str, str], *words: object) -> "subprocess.Popen[str]":
    command = [sys.executable, str(PROGRAM), *map(str, words)]
    return subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True, start_new_session=True)


def test_it_is_the_same_in_two_processes_and_goes_on_when_it_was_killed(nanoslip, environment, long) -> None:
    whole, out, killed = (long.parent / name for name in ("whole", "out", "killed"))
    assert nanoslip("run", long, "--out", whole, "--serial").returncode == 0
    running = started(environment, "run", long, "--out", out, "--jobs", 2)
    said = running.communicate(timeout=120)[1]
    assert running.returncode == 0, said
    tasks = len(written(whole))
    assert f"{tasks} tasks left" not in said  # some were computed before
    assert (out / "results.nc").read_bytes() == (whole / "results.nc").read_bytes()

    running = started(environment, "run", long, "--out", killed, "--jobs", 2)
    until_written(killed, 5, running)
    os.killpg(running.pid, signal.SIGKILL)
    said = running.communicate(timeout=60)[1]
    assert (running.returncode, "tasks left" in said) == (-signal.SIGKILL, False)
    done = nanoslip("run", long, "--out", killed, "--jobs", 2)
    assert done.returncode == 0, done.stderr
    assert (killed / "results.nc").read_bytes() == (whole / "results.nc").read_bytes()
    assert json.loads((killed / "runs.jsonl").read_text().splitlines()[-1])["done"] < tasks
