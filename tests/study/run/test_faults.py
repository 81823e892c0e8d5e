"""Whatever a task does to its process, the other tasks are computed, and what it did is on record, or left word of."""

import json
import math
import os
import signal
import threading
import time
from contextlib import suppress
from pathlib import Path

import pytest

from nanoslip.solver.outcome import Ending
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.origin import here
from nanoslip.study.plan.plan import make_plan
from nanoslip.study.results import files
from nanoslip.study.results.store import Store
from nanoslip.study.run import child as process
from nanoslip.study.run.campaign import KILLED, blame, tasks_to_do
from nanoslip.study.run.child import Agent, BrokenProgramError
from nanoslip.study.run.dispatch import RunTally
from nanoslip.study.run.executor import executor
from nanoslip.study.run.farm import ProcessFarm
from nanoslip.study.run.journal import BEGUN, LONG_TASK, Journal, long_task_keys
from nanoslip.study.run.launch import Program
from tests.conftest import SMALL
from tests.study.results.results import NO_FILES, written
from tests.study.run import faults
from tests.study.run.faults import FAULTS, computed
from tests.study.run.made_up import Work
from tests.study.run.matrix import PLACES

SOUND = tuple(Work(f"sound {number}") for number in range(19))


@pytest.mark.slow
@pytest.mark.parametrize(
    "place", [pytest.param(name, marks=pytest.mark.mpi) if "rank" in name else name for name in PLACES]
)
def test_every_fault_costs_its_own_task_wherever_it_is_met(tmp_path, place):
    names, run = PLACES[place]
    found = run(tmp_path)
    assert found.keys() == set(names)
    assert {name: each for name, each in found.items() if not FAULTS[name].matches(each.outcome)} == {}
    assert [name for name, each in found.items() if not each.sound] == []
    if "rank" in place:
        assert {each.where for each in found.values() if each.where} == {place.removesuffix(" of 2")}


def dying_after(out):
    """What computes tasks of a campaign, and ends its process when the result of a record is kept."""
    execute = executor(out)

    def run(task):
        outcome = execute(task)
        if task.kind == "record":
            os.kill(os.getpid(), signal.SIGKILL)
        return outcome

    return run


@pytest.mark.slow
def test_a_task_whose_process_dies_after_its_result_is_kept_is_done_and_not_computed_again(campaign, tmp_path):
    campaign.write_text(
        SMALL.replace("[0.25, 0.5]", "[0.5]").replace("[50.0, 100.0]", "[50.0]")
    )  # each costs a process
    plan, store = make_plan(load_manifest(campaign)), Store(tmp_path)
    store.prepare()
    journal, agents = Journal(tmp_path), [Agent(Program(__name__, "dying_after", tmp_path), 0)]
    agents[0].adopt(here())
    with ProcessFarm(agents) as farm:
        tally = farm.run(plan.tasks, journal)
    assert (tally.done, tally.crashed, journal.undone) == (len(plan.tasks), 0, set())
    assert written(tmp_path) == dict.fromkeys((task.key for task in plan.tasks), 1)


@pytest.mark.parametrize("hidden", ["results", "results/{}.result"])
def test_a_folder_or_need_that_a_network_file_system_shows_later_is_waited_for(campaign, tmp_path, monkeypatch, hidden):
    """A client remembers for half a minute that something was not there."""
    compliance, record, *_ = make_plan(load_manifest(campaign)).tasks
    Store(tmp_path).prepare()
    executor(tmp_path)(compliance)
    assert record.needs == (compliance.key,)
    path = tmp_path / hidden.format(compliance.key)
    elsewhere = path.rename(tmp_path / "elsewhere")
    monkeypatch.setattr(files, "LOOK", 0.01)
    with monkeypatch.context() as once:
        once.setattr(files, "VISIBLE", 0.05)
        with pytest.raises(FileNotFoundError, match="not there though"):
            executor(tmp_path)(record)
    threading.Timer(0.3, elsewhere.rename, [path]).start()
    assert executor(tmp_path)(record).usable


@pytest.mark.slow
def test_what_a_dead_process_computed_is_tried_again_behind_all_others(tmp_path):
    """What killed it may have been no fault of its own. An exception comes of the program: it is not tried again."""
    tasks = (Work("kill -9"), Work("exception"), *SOUND)
    _, reported, failed = computed(faults.program(tmp_path), tasks, 1)
    assert [key for key, _ in failed] == ["kill -9", "exception", "kill -9"]
    assert list(reported)[-1] == "kill -9"


KNOWN = Work("known", cost=1e-4)
"""Its duration is known before those of the others matter."""


def behind(known, *keys, limit=1.0):
    return [known, *(Work(key, (known.key,), known.cost, limit=limit) for key in keys)]


@pytest.mark.slow
@pytest.mark.parametrize("pair", [("kill -9", "os._exit(7)"), ("endless loop", "stopped")], ids=["dies", "hangs"])
def test_a_fault_costs_no_task_that_its_process_has_at_hand(tmp_path, pair):
    sound = [str(number) for number in range(100)]
    tasks = behind(KNOWN, *sound[:50], *pair, *sound[50:])
    tally, reported, failed = computed(faults.program(tmp_path), tasks, 1)
    assert tally == RunTally(done=101, crashed=2)
    assert {(key, done.outcome.ending) for key, done in failed} == {(each, FAULTS[each].ending) for each in pair}
    assert [key for key in reported if key in sound] == sound  # each once


@pytest.mark.slow
def test_tasks_behind_one_that_hangs_go_elsewhere(tmp_path):
    """They are handed out together, as they are short; what waits for long is computed by the other process."""
    tasks = behind(Work("first"), "endless loop", *map(str, range(60)), limit=6.0)
    tally, reported, _ = computed(faults.program(tmp_path), tasks, 2)
    assert tally == RunTally(done=61, crashed=1)
    assert list(reported)[-1] == "endless loop"  # all others ended before it was given up


def starting(folder):
    """What starts another process, leaves its number and ends."""

    def execute(_):
        if started := os.fork():
            (folder / str(started)).touch()
            os._exit(9)
        time.sleep(90.0)
        os._exit(0)

    return execute


def runs(number):
    """Whether the process of this number has not ended."""
    with suppress(OSError):
        return Path(f"/proc/{number}/cmdline").read_bytes() != b""
    return False


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/cmdline").exists(), reason="processes cannot be looked at here")
def test_what_a_task_has_started_ends_with_its_process(tmp_path):
    """It holds all that the process had open: a launcher would wait for it at the end of the run."""
    tally, *_ = computed(Program(__name__, "starting", tmp_path), (Work("starts another", limit=60.0),), 1)
    assert tally == RunTally(crashed=1)
    started = [path.name for path in tmp_path.iterdir()]
    assert len(started) == 2  # it was tried twice
    end = time.monotonic() + 10.0
    while any(runs(number) for number in started):
        assert time.monotonic() < end


@pytest.mark.slow
def test_time_in_which_both_processes_are_stopped_is_not_the_task_s(tmp_path, monkeypatch):
    """A suspended job is: its clock jumps between two looks at a child."""
    clock, jump = time.monotonic, 0.0
    monkeypatch.setattr(process.time, "monotonic", lambda: clock() + jump)
    child = process.ChildProcess()
    child.load(faults.program(tmp_path), 0)
    try:
        while not child.ready:
            child.receive()
        child.begin(Work("endless loop"))
        for _ in range(3):
            jump += 1000.0
            assert child.receive() is None
        assert 3.0 * process.LONGEST_LOOK <= child.seconds < 10.0
    finally:
        child.kill()


def test_a_child_that_is_killed_before_it_computes_is_replaced(tmp_path, monkeypatch):
    load, killed = process.ChildProcess.load, []

    def doomed(child, program, number):
        load(child, program, number)
        if len(killed) < 2:
            killed.append(child)
            child._process.kill()

    monkeypatch.setattr(process.ChildProcess, "load", doomed)
    tally, _, failed = computed(faults.program(tmp_path), SOUND, 1)
    assert (tally, failed, len(killed)) == (RunTally(done=19), [], 2)


class Unknown(str):
    """Is written as something that nobody can read."""

    def __reduce__(self):
        return (exec, ("raise RuntimeError",))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("module", "task"),
    [("no_such_module", SOUND[0]), (faults.__name__, Work("strange", kind=Unknown("any")))],
    ids=["a program that does not start", "a task that it does not know"],
)
def test_what_the_program_cannot_begin_is_no_fault_of_a_task(tmp_path, module, task):
    with pytest.raises(BrokenProgramError, match="does not begin"):
        computed(Program(module, "executor", tmp_path), [task], 1)


# A run that is killed as a whole leaves word of the long tasks that it was at; one that ends otherwise does not.

ENDLESS = (Work("long"), math.inf)


def test_long_tasks_are_noted_and_those_of_which_nothing_is_known_until_a_run_ends_by_itself(tmp_path):
    journal = Journal(tmp_path)
    journal.begun([(Work("short"), 0.5 * LONG_TASK), (Work("unknown"), 2.0 * LONG_TASK), ENDLESS])
    assert long_task_keys(tmp_path) == {"long", "unknown"}
    journal.forget()
    journal.begun([ENDLESS])
    assert (long_task_keys(tmp_path), list(tmp_path.iterdir())) == (frozenset(), [])


@NO_FILES
def test_what_is_no_file_and_a_disk_that_takes_nothing_do_not_stop_a_run(tmp_path, no_file):
    no_file(tmp_path / BEGUN)
    for folder in (tmp_path, tmp_path / "nowhere"):
        assert long_task_keys(folder) == frozenset()
        journal = Journal(folder)
        journal.begun([ENDLESS])
        journal.forget()


def test_nothing_is_written_through_a_link(tmp_path):
    (tmp_path / "foreign").write_text("precious")
    (tmp_path / BEGUN).symlink_to(tmp_path / "foreign")
    Journal(tmp_path).begun([ENDLESS])
    assert (tmp_path / "foreign").read_text() == "precious"


def test_what_a_killed_run_was_at_comes_last_and_is_given_up_at_the_second_time(campaign, tmp_path):
    plan, store = make_plan(load_manifest(campaign)), Store(tmp_path)
    record = next(task for task in plan.tasks if task.kind == "record")
    for given_up in (False, True):
        Journal(tmp_path).begun([(Work(record.key), math.inf)])
        blame(plan, store, Journal(tmp_path), tmp_path)  # the next run does, when it begins
        work = tasks_to_do(plan, store.failures(), {})
        assert (work.tasks[-1] == record, record in work.given_up) == (not given_up, given_up)
    assert store.failures()[record.key].outcome.message.startswith(KILLED)
    assert tasks_to_do(plan, store.failures(), {}, retry=True).given_up == ()


def test_a_task_that_was_at_hand_by_accident_is_computed_and_forgiven(main, campaign, tmp_path):
    record = next(task for task in make_plan(load_manifest(campaign)).tasks if task.kind == "record")
    Journal(tmp_path).begun([(record, math.inf)])
    assert main("run", campaign, "--out", tmp_path, "--serial")[0] == 0
    lines = [json.loads(line) for line in (tmp_path / "attempts.jsonl").read_text().splitlines()]
    ends = [(record.key, ending) for ending in (Ending.CRASHED, Ending.COMPLETED)]
    assert [(line["task"], line["ending"]) for line in lines] == ends
    assert not (tmp_path / "begun.txt").exists()
    assert Store(tmp_path).failures() == {}
