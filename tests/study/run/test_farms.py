"""Farms hand tasks to agents and children; an executor reads what tasks of one slab need once."""

import math
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import ExitStack
from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import Mock

import pytest

from nanoslip.solver.outcome import COMPLETED, Ending, Outcome
from nanoslip.study import origin, processor
from nanoslip.study.results import entry as own
from nanoslip.study.results.store import Store
from nanoslip.study.run import executor as executor_module, farm as farm_module
from nanoslip.study.run.child import Agent, FarmError
from nanoslip.study.run.dispatch import REPORT, Done, RunTally
from nanoslip.study.run.executor import executor
from nanoslip.study.run.farm import Farm, MPIFarm, ProcessFarm, SerialFarm, open_farm
from nanoslip.study.run.journal import Journal, long_task_keys
from nanoslip.study.run.launch import WARNING, Interruption, Program, end_of_time, launcher_rank
from nanoslip.study.tasks.compliance import compliance_task
from nanoslip.study.tasks.contact import contact_task
from tests.conftest import longer
from tests.study.plan.running import CASE
from tests.study.results.results import until_written, written
from tests.study.run import faults
from tests.study.run.made_up import DIAMOND, Diary, Work

# Whoever computes, every task is computed once, after its needs; no run becomes lone ones; a signal leaves nobody behind.

NOTHING = Program("builtins", "callable")
PATIENCE = 120.0
"""Seconds after which a run is taken to hang; each takes a few."""


# A farm of one process.


def test_a_crash_is_told_and_costs_only_what_needs_it(capsys):
    diary = Diary(crash="b")
    with SerialFarm(lambda: diary.execute) as farm:
        assert farm.run(DIAMOND, diary) == RunTally(done=3, crashed=2)
    assert diary.executed == ["a", "b", "c", "e"]
    crashed = Outcome(
        Ending.CRASHED, "ZeroDivisionError: a defect", cause="ZeroDivisionError"
    )  # the same on every machine
    needs_it = Outcome(Ending.NEEDS_FAILED, "task b crashed")
    assert diary.reported == dict.fromkeys("ace", COMPLETED) | {"b": crashed, "d": needs_it}
    said = capsys.readouterr().err
    assert all(words in said for words in ("rank 0 on ", "task b crashed", "Traceback"))


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGUSR1])
def test_after_a_signal_the_running_task_is_finished_and_no_other_begun(number):
    diary, before = Diary(), signal.getsignal(number)

    def execute(task):
        os.kill(os.getpid(), number)
        assert arrived.wait(5.0)
        return diary.execute(task)

    with SerialFarm(lambda: execute, grace=60.0) as farm:
        arrived = farm.interruption._requested
        assert farm.run(DIAMOND, diary) == RunTally(done=1, interrupted=True)
    assert list(diary.reported) == ["a"]
    assert signal.getsignal(number) is before
    assert not any(isinstance(thread, threading.Timer) for thread in threading.enumerate())


def test_a_signal_that_finds_all_work_done_interrupted_nothing():
    with SerialFarm(lambda: Diary().execute) as farm:
        farm.interruption.request()
        assert farm.run((), Diary()) == RunTally()


def test_a_task_that_outlasts_the_grace_is_left_with_code_99(environment):
    program = (
        "import os, signal, time\n"
        "from nanoslip.study.run.launch import Interruption\n"
        "with Interruption(grace=0.1):\n"
        "    os.kill(os.getpid(), signal.SIGTERM)\n"
        "    time.sleep(30)\n"
    )
    words = [sys.executable, "-c", program]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=20, check=False)
    assert (done.returncode, done.stderr.count("run again")) == (99, 1)


# Ranks, however they are reached.


class MadeUpRanks(Farm):
    """Ranks that compute one task each between two looks at their news; only the first one is near."""

    def __init__(self, size, seconds=0.01):
        super().__init__(size, size, Interruption(grace=1.0))
        self.computed = []
        self._seconds = seconds
        self._waiting = [[] for _ in range(size)]
        self._returned = []

    def load(self, tasks):
        raise NotImplementedError

    def give(self, rank, tasks):
        self._waiting[rank].extend(tasks)

    def take_back(self, rank):
        returned = tuple(task.key for task in self._waiting[rank][1:])
        del self._waiting[rank][1:]
        if rank == 0:
            return returned
        self._returned.append((rank, (), returned))
        return ()

    def news(self):
        found, self._returned = self._returned, []
        for rank, tasks in enumerate(self._waiting):
            if tasks:
                key = tasks.pop(0).key
                self.computed.append(key)
                found.append((rank, [Done(key, COMPLETED, self._seconds)], ()))
        return found


def coordinated(ranks, tasks, stop_after=""):
    class Stopping(Diary):
        def ended(self, task, outcome, seconds):
            super().ended(task, outcome, seconds)
            if task.key == stop_after:
                ranks.interruption.request()

    diary = Stopping()
    return ranks.run(tasks, diary), diary


def test_those_who_have_computed_write_their_results_out_once_when_they_are_asked():
    ranks = MadeUpRanks(3)
    coordinated(ranks, DIAMOND[:1])
    assert "settle" not in ranks.computed
    for _ in range(2):
        ranks.settle()
        assert ranks.computed.count("settle") == 1
    coordinated(ranks, DIAMOND)
    ranks.settle()
    assert ranks.computed.count("settle") > 2


@pytest.mark.slow
@pytest.mark.parametrize("processes", [0, 1], ids=["this process", "another one"])
def test_a_run_hears_how_far_its_tasks_are(processes):
    """At most once in REPORT, and only of a task that takes longer."""
    program = Program("tests.study.run.made_up", "advancing")
    seen = []

    class Watching(Diary):
        def advanced(self, task, underway):
            seen.append((task.key, underway))

    diary = Watching()
    with ExitStack() as stack:
        if processes:
            agent = Agent(program, 0)
            stack.callback(agent.close)
            farm = ProcessFarm([agent])
        else:
            farm = SerialFarm(program.load)
        farm.run([Work("a", limit=PATIENCE)], diary)
    assert diary.reported["a"].ok
    assert {key for key, _ in seen} == {"a"}
    reports = [underway for _, underway in seen]
    assert all(0.0 < each.share <= 1.0 for each in reports)
    assert all(each.seconds >= REPORT * (number + 1) for number, each in enumerate(reports))
    assert all(each.processor < 0.5 * each.seconds for each in reports)  # it sleeps


def test_after_a_signal_what_has_not_been_begun_comes_back():
    ranks = MadeUpRanks(2)
    tally, diary = coordinated(ranks, [Work(str(number)) for number in range(100)], stop_after="10")
    assert tally.interrupted
    assert tally.done == len(diary.reported) == len(ranks.computed) < 30


@pytest.mark.parametrize(("told", "noted"), [(False, {"a", "e"}), (True, set())])
def test_what_is_in_hand_when_a_run_is_killed_is_noted_unless_it_was_told_to_stop(tmp_path, told, noted):
    class Dying(MadeUpRanks):
        def news(self):
            if told:
                self.interruption.request()
            raise GeneratorExit

    journal, ranks = Journal(tmp_path), Dying(2)
    ranks.interruption.at_request = journal.forget
    with pytest.raises(GeneratorExit):
        ranks.run(DIAMOND, journal)
    assert long_task_keys(tmp_path) == noted


@pytest.mark.parametrize("said", [None, "1700000000", "", "Unknown"])
def test_a_job_says_when_it_ends(said):
    known = {} if said is None else {"SLURM_JOB_END_TIME": said}
    assert end_of_time(known) == (1700000000.0 - WARNING if said == "1700000000" else math.inf)


@pytest.fixture
def job(monkeypatch):
    """This process is part of a job that has a thousand seconds left for tasks."""
    monkeypatch.setenv("SLURM_JOB_END_TIME", str(round(time.time() + 1000.0) + WARNING))


@pytest.mark.usefixtures("job")
def test_what_would_outlast_the_job_is_left_and_shorter_tasks_are_done():
    known, long = Work("known", cost=1.0), Work("long", ("known",), cost=5000.0)
    short = [Work(f"short {number}", ("known",), cost=1.0) for number in range(10)]
    tally, diary = coordinated(MadeUpRanks(2, seconds=1.0), (known, long, Work("after", ("long",)), *short))
    assert tally == RunTally(done=11, interrupted=True, outlasting=1)
    assert not {"long", "after"} & set(diary.reported)


@pytest.mark.usefixtures("job")
def test_a_task_longer_than_any_job_is_tried_by_a_run_that_has_nothing_else():
    """From the first it is known how long the second takes."""
    tally, _ = coordinated(MadeUpRanks(1, seconds=5000.0), (Work("long", cost=5000.0), Work("longer", cost=6000.0)))
    assert tally == RunTally(done=1, interrupted=True, outlasting=1)


def test_one_process_takes_back_what_would_outlast_the_job(monkeypatch):
    """The first task says how long the others take, which wait already: all that waits is taken back."""
    monkeypatch.setenv("SLURM_JOB_END_TIME", "1")
    diary = Diary()
    with SerialFarm(lambda: diary.execute) as farm:
        tally = farm.run([Work("first"), *(Work(str(number), ("first",)) for number in range(5))], diary)
    assert tally == RunTally(done=1, interrupted=True, outlasting=5)


@pytest.mark.parametrize("looks", [(5, 1, 9), (math.inf,)], ids=["taken", "taken by nobody"])
def test_a_rank_waits_until_all_that_it_sent_has_left_but_not_for_ever(monkeypatch, looks):
    """A message has left at so many looks at it."""
    monkeypatch.setattr(farm_module, "FLUSH", 0.05)
    left = dict(enumerate(looks))

    def look(message):
        left[message] -= 1
        return left[message] <= 0, None

    requests = iter([SimpleNamespace(test=lambda message=message: look(message)) for message in left])
    world = SimpleNamespace(
        Get_rank=lambda: 1, Get_size=lambda: 2, Abort=None, isend=lambda _message, dest: next(requests)
    )
    farm = MPIFarm(SimpleNamespace(COMM_WORLD=world), Agent(NOTHING, 0), Interruption(grace=1.0))
    for _ in looks:
        farm._send(0, "word")
    farm._flush()
    assert all(each <= 0 or each == math.inf for each in left.values())


def rank_of_two(rank, looks, agent):
    """A rank of two whose looks for messages find these, or nothing; and what it sends."""
    looks, found, sent = iter(looks), [], []

    def look(**_):
        found.extend(message for message in [next(looks)] if message is not None)
        return bool(found)

    taken = SimpleNamespace(test=lambda: (True, None))
    world = SimpleNamespace(
        Get_rank=lambda: rank,
        Get_size=lambda: 2,
        Abort=None,
        isend=lambda message, dest: (sent.append((dest, message)), taken)[1],
        iprobe=look,
        recv=lambda source: found.pop(),
    )
    status = SimpleNamespace(Get_source=lambda: 1 - rank)
    library = SimpleNamespace(COMM_WORLD=world, Status=lambda: status, ANY_SOURCE=-1, ANY_TAG=-1)
    return MPIFarm(library, agent, Interruption(grace=1.0)), sent


def test_a_signal_to_any_rank_stops_all_and_what_it_has_not_begun_comes_back():
    """Rank 1 is signalled, says so once and gives its tasks back; rank 0 then asks for no more."""
    agent = Agent(NOTHING, 1)
    agent._begun = Work("begun")  # so the others wait
    agent._ended = lambda _: None
    second, sent = rank_of_two(1, [[Work("a"), Work("b")], None, None, 7, None], agent)
    second.interruption.request()
    assert second.serve() == 7
    assert sent == [(0, farm_module.TOLD_TO_STOP), (0, ([], ("a", "b")))]
    first, _ = rank_of_two(0, [message for _, message in sent] + [None], Agent(NOTHING, 0))
    assert first.news() == [(1, [], ("a", "b"))]
    assert first.interruption.requested


# Processes, and who opens which farm.


@pytest.mark.slow
def test_every_task_is_computed_once_after_its_needs_by_all_processes(tmp_path):
    tasks = [Work(str(number), (str(number - 1),) if 0 < number < 10 else ()) for number in range(40)]
    tally, reported, _ = faults.computed(faults.program(tmp_path), tasks, 2)
    assert tally == RunTally(done=40)
    assert set(reported.values()) == {COMPLETED}
    assert len({path.read_text() for path in tmp_path.iterdir()}) == 2


@pytest.mark.parametrize(("serial", "ranks"), [(True, "1"), (False, "2")])
def test_processes_beside_serial_or_ranks_are_refused(monkeypatch, serial, ranks):
    monkeypatch.setenv("PMI_SIZE", ranks)
    with pytest.raises(FarmError, match="--jobs 3 with "):
        open_farm(NOTHING, serial=serial, jobs=3)


def test_slurm_tasks_of_a_batch_script_do_not_mean_that_a_launcher_was_used(monkeypatch):
    for name in ("PMI_SIZE", "OMPI_COMM_WORLD_SIZE", "SLURM_STEP_NUM_TASKS"):
        monkeypatch.delenv(name, raising=False)
    for name in ("PMI_RANK", "OMPI_COMM_WORLD_RANK", "PMIX_RANK"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("SLURM_NTASKS", "8")
    monkeypatch.setenv("SLURM_PROCID", "3")
    assert launcher_rank() == 0
    monkeypatch.setitem(sys.modules, "mpi4py", None)  # importing it fails
    with open_farm(NOTHING) as farm:
        assert isinstance(farm, ProcessFarm)
    monkeypatch.setenv("OMPI_COMM_WORLD_SIZE", "2")
    with pytest.raises(FarmError, match="2 processes were started"):
        open_farm(NOTHING)
    assert isinstance(open_farm(NOTHING, serial=True), SerialFarm)


@pytest.mark.slow
def test_n_processes_that_see_only_themselves_are_refused_by_one_message(nanoslip, campaign, tmp_path):
    first = nanoslip("run", campaign, OMPI_COMM_WORLD_SIZE="4", OMPI_COMM_WORLD_RANK="0")
    second = nanoslip("run", campaign, SLURM_STEP_NUM_TASKS="4", SLURM_PROCID="1")
    assert (first.returncode, second.returncode, second.stderr) == (2, 2, "")
    assert first.stderr.startswith("Error: 4 processes were started")
    assert "Traceback" not in first.stderr
    assert not (tmp_path / "results").exists()


@pytest.mark.slow
def test_without_mpi_processes_compute_the_dataset_of_one_and_ranks_are_refused_by_one_message(
    nanoslip, environment, campaign, tmp_path
):
    """Whether mpi4py is not installed or finds no library."""
    hidden = "import sys; sys.modules['mpi4py'] = None; import nanoslip; nanoslip.main()"

    def run(*words, **changes):
        command = [sys.executable, "-c", hidden, "run", campaign, "--out", tmp_path / "two", *words]
        return subprocess.run(command, env=environment | changes, capture_output=True, text=True, check=False)

    first, last = (run(PMI_SIZE="3", PMI_RANK=rank) for rank in "02")
    assert (first.returncode, last.returncode, last.stderr) == (2, 2, "")
    message = " ".join(first.stderr.split())
    assert message.startswith("Error: 3 processes were started")
    assert message.count("Error") == 1
    assert not (tmp_path / "two").exists()
    done = run("-j", "2")
    assert done.returncode == 0, done.stderr
    assert "13 tasks left, 2 processes" in done.stderr
    missing = {"MPI4PY_LIBMPI": "/no/such/library"}
    assert nanoslip("run", campaign, "--out", tmp_path / "one", "-j", 1, **missing).returncode == 0
    one, two = ((tmp_path / out / "results.nc").read_bytes() for out in ("one", "two"))
    assert one == two
    several = nanoslip("run", campaign, **missing, OMPI_COMM_WORLD_SIZE="2")
    assert several.returncode == 2
    assert several.stderr.startswith("Error: 2 processes were started")


def test_no_more_processes_start_than_there_are_tasks():
    """`-j 1000` of a small campaign does not keep a machine busy with imports."""
    agents = [Mock(Agent) for _ in range(6)]
    ProcessFarm(agents).load(2)
    assert [agent.load.call_count for agent in agents] == [1, 1, 0, 0, 0, 0]


@pytest.mark.slow
@pytest.mark.mpi
@pytest.mark.parametrize(("rank", "messages"), [(0, 1), (1, 0)])
def test_a_start_of_mpi_that_hangs_is_given_up_with_one_message_and_code_99(environment, rank, messages):
    """A launcher that never answers, as MPICH hears it."""
    program = (
        "from nanoslip.study.run import farm; from nanoslip.study.run.launch import Program; "
        "farm.LONGEST_START = 0.5; farm.open_farm(Program('builtins', 'callable'))"
    )
    ours, theirs = socket.socketpair()
    with ours, theirs:
        mute = {"PMI_FD": str(theirs.fileno()), "PMI_RANK": str(rank), "PMI_SIZE": "2"}
        words, pipes = [sys.executable, "-c", program], {"pass_fds": [theirs.fileno()], "capture_output": True}
        done = subprocess.run(words, env=environment | mute, **pipes, text=True, timeout=60.0, check=False)
    if "each sees only itself" in done.stderr:
        pytest.skip("not MPICH: it asks nobody at that place")
    assert (done.returncode, done.stderr.count("within 0.5 s")) == (99, messages), done.stderr
    assert "Traceback" not in done.stderr


def test_a_run_whose_job_ends_before_its_tasks_would_ends_as_if_interrupted(main, campaign, tmp_path, monkeypatch):
    monkeypatch.setenv("SLURM_JOB_END_TIME", "1")
    code, _, errors = main("run", campaign, "--out", tmp_path / "out", "--serial")
    assert code == 99
    # The first record, and the first of its two drives, say how long the three others and the second would take.
    said = "interrupted: 4 tasks left would outlast this job; what is finished is kept; run again to continue"
    assert said in errors
    assert not (tmp_path / "out" / "results.nc").exists()


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL], ids=["Ctrl-C", "killed"])
def test_a_signal_ends_all_processes_and_the_next_run_goes_on(environment, tmp_path, number):
    """Ctrl-C reaches every process of the terminal; only the first decides. After its death none stays behind."""
    campaign, out = tmp_path / "long.toml", tmp_path / "out"
    campaign.write_text(longer(radii=40, events=6000))
    words = [sys.executable, "-m", "nanoslip", "run", str(campaign), "--out", str(out), "-j", "2"]
    running = subprocess.Popen(words, env=environment, stderr=subprocess.PIPE, text=True, start_new_session=True)
    until_written(out, 4, running)
    if number == signal.SIGINT:
        os.killpg(running.pid, number)
    else:
        running.kill()
    _, said = running.communicate(timeout=PATIENCE)  # all that held standard error have ended
    assert running.returncode == (99 if number == signal.SIGINT else -signal.SIGKILL)
    assert "Traceback" not in said
    assert (out / "begun.txt").exists() == (number == signal.SIGKILL)
    assert 4 <= len(written(out)) < 3 * 80
    assert not (out / "results.nc").exists()


# What tasks of one slab need is read once; what cannot be read is no input, and is looked for again.

SLAB = compliance_task(CASE.slab)
CONTACTS = [contact_task(replace(CASE, normal_load=factor * CASE.normal_load)) for factor in (1.0, 0.9, 0.8)]


@pytest.fixture
def store(tmp_path):
    store = Store(tmp_path)
    store.prepare()
    return store


def test_an_input_is_read_once_for_tasks_that_follow_each_other(tmp_path, store, monkeypatch):
    reads, plain = [], Store.read
    monkeypatch.setattr(Store, "read", lambda store, key: (reads.append(key), plain(store, key))[1])
    execute = executor(tmp_path)
    assert all(execute(task).ok for task in (SLAB, *CONTACTS))
    assert reads == [SLAB.key]


def test_a_task_that_leaves_no_file_to_open_changes_nothing_of_what_results_state(tmp_path, store, monkeypatch):
    origin.arithmetic.cache_clear()
    origin.computing_origin.cache_clear()
    execute = executor(tmp_path)
    monkeypatch.setattr(processor, "instructions", list)  # as where the system's file cannot be read
    execute(SLAB)
    (stated,) = store.read(SLAB.key).origins
    assert stated == replace(origin.here(), **origin.arithmetic())
    assert stated.processor_features != origin.features()


def test_a_damaged_input_is_an_error_of_the_machine_until_it_is_whole_again(tmp_path, store):
    execute, path = executor(tmp_path), own.result_path(store.folder, SLAB.key)
    execute(SLAB)
    whole = path.read_bytes()
    path.write_bytes(whole[:-1])
    with pytest.raises(OSError, match=SLAB.key):
        execute(CONTACTS[0])
    path.write_bytes(whole)
    assert execute(CONTACTS[0]).ok


def test_a_result_of_another_key_is_a_defect_and_kept_nowhere(tmp_path, store, monkeypatch):
    compute = executor_module.run_task
    monkeypatch.setattr(executor_module, "run_task", lambda *words: replace(compute(*words), key=20 * "0"))
    with pytest.raises(ValueError, match=f"a defect: what came of task {SLAB.key}"):
        executor(tmp_path)(SLAB)
    assert store.finished() == set()
