"""The queue hands out what is needed first, the ledger tries again what may end otherwise, ranks get what keeps them busy."""

import itertools
import random
import time

import pytest

from nanoslip.solver.outcome import COMPLETED, LONGEST_MESSAGE, Ending, Outcome
from nanoslip.study.run.dispatch import (
    LONGEST_TRACE,
    LOOKAHEAD,
    REFILL,
    STRANDED,
    CannotGoOnError,
    Dispatcher,
    Done,
    Ledger,
    RunTally,
    TaskQueue,
    Watch,
    Worker,
    attempt,
)
from tests.study.run.made_up import DIAMOND, Diary, Work

ENDS = {"put_back": "waiting", "put_last": "waiting", "abandon": "given up", "finish": "finished"}
"""What is done to a task that was taken -> what it is then."""


@pytest.mark.parametrize("seed", range(20))
def test_the_next_task_is_the_first_of_all_that_are_ready_whatever_came_back_was_finished_or_given_up(seed):
    choose = random.Random(seed)
    needs = [choose.sample(range(number), min(number, choose.randrange(3))) for number in range(60)]
    tasks = [Work(str(number), ("elsewhere", *map(str, needed))) for number, needed in enumerate(needs)]
    order = random.Random(seed).sample(tasks, len(tasks))
    places = {task.key: place for place, task in enumerate(order)}
    queue, state = TaskQueue(order), dict.fromkeys(places, "waiting")

    def those(word):
        return [task for task in tasks if state[task.key] == word]

    def ready():
        return [
            task for task in those("waiting") if {state.get(need, "finished") for need in task.needs} == {"finished"}
        ]

    while ready() or those("taken"):
        assert (queue.ready, len(queue)) == (len(ready()), len(those("waiting")))
        if ready() and choose.random() < 0.6:
            task = queue.take()
            assert task is min(ready(), key=lambda each: places[each.key])
            state[task.key] = "taken"
        elif those("taken"):
            task, (what,) = choose.choice(those("taken")), choose.choices(list(ENDS), (3.0, 1.0, 0.3, 8.0))
            came = getattr(queue, what)(task.key)
            state[task.key] = ENDS[what]
            if what == "put_last":
                places[task.key] = 1 + max(places.values())
            elif what == "finish":
                assert came is task
                with pytest.raises(KeyError):
                    queue.finish(task.key)
            elif what == "abandon":
                lost = {task.key}
                for each in tasks:  # each behind what it needs
                    lost |= {each.key} if lost.intersection(each.needs) else set()
                lost = {key for key in lost if state[key] != "given up"}
                assert sorted(each.key for each in came) == sorted(lost - {task.key})
                state.update(dict.fromkeys(lost, "given up"))


def next_of(ledger):
    ((task, _),) = ledger.take(1, 0.0, at_least_one=True)
    return task


def test_the_time_a_task_will_take_is_learnt_from_its_kind():
    ledger = Ledger([Work("a", cost=1.0), Work("b", cost=3.0)], Watch())
    assert ledger.estimate_seconds(Work("c", kind="another")) == float("inf")
    ledger.enter(Done(next_of(ledger).key, COMPLETED, seconds=2.0))
    assert ledger.estimate_seconds(Work("b", cost=3.0)) == 6.0


@pytest.mark.parametrize(("again", "attempts"), [(False, 1), (True, 2)])
def test_what_may_end_differently_is_tried_once_more_behind_all_others(again, attempts):
    diary, order = Diary(), []
    ledger = Ledger(DIAMOND, diary)
    while ledger.queue.ready:
        order.append(next_of(ledger).key)
        crashed = Done("a", Outcome(Ending.CRASHED, "why"), 1.0, again=again)
        ledger.enter(crashed if order[-1] == "a" else Done(order[-1], COMPLETED, 1.0))
    assert order == ["a", "e", "a"][: attempts + 1]
    assert [(key, final) for key, _, final in diary.attempts] == [("a", False), ("a", True)][-attempts:]
    assert diary.reported["a"].ending is Ending.CRASHED
    assert {key for key, outcome in diary.reported.items() if outcome.ending is Ending.NEEDS_FAILED} == set("bcd")
    assert ledger.tally(False) == RunTally(done=1, crashed=4)


def failing(error):
    def execute(_):
        raise error

    return execute


REFUSED = failing(CannotGoOnError("the disk is full"))


def test_where_nothing_can_be_kept_any_more_no_task_has_failed():
    diary = Diary()
    ledger = Ledger(DIAMOND, diary)
    for _ in range(2):
        assert not ledger.halt
        ledger.enter(attempt(REFUSED, next_of(ledger), Worker(0, "here")))
    assert (ledger.tally(False), diary.attempts) == (RunTally(halt="the disk is full"), [])
    assert len(ledger.queue) == len(DIAMOND)


def test_a_task_alone_whose_result_cannot_be_kept_has_failed():
    """It may have taken its process's files away: others are kept by another process, before it is tried again and after."""
    diary = Diary()
    ledger = Ledger(DIAMOND, diary)
    while ledger.unfinished:
        task = next_of(ledger)
        ledger.enter(attempt(REFUSED, task, Worker(0, "here")) if task.key == "a" else Done(task.key, COMPLETED, 1.0))
    assert [(key, done.passing, final) for key, done, final in diary.attempts] == [("a", True, True)]
    assert diary.reported["a"] == Outcome(Ending.CRASHED, "the disk is full")
    assert ledger.tally(False) == RunTally(done=1, crashed=4)


@pytest.mark.parametrize("harm", [OSError(24, "Too many open files"), MemoryError(), CannotGoOnError("full"), None])
def test_errors_of_the_machine_may_have_harmed_the_process(harm):
    assert attempt(failing(harm or ValueError()), Work("a"), Worker(0, "here")).passing == (harm is not None)


def test_a_clock_that_a_task_moves_does_not_time_it(monkeypatch):
    monkeypatch.setattr(time, "perf_counter", itertools.count(0.0, -1e9).__next__)
    assert 0.0 <= attempt(lambda _: COMPLETED, Work("a"), Worker(0, "here")).seconds < 60.0


def test_texts_of_an_exception_are_short_and_can_be_shown():
    """Terminals obey escapes, files in UTF-8 take no half letter, and each case of a dataset has room for the longest message."""
    error = ValueError("\x1b[31m half a letter \ud800 " + 2_000_000 * "x")
    done = attempt(failing(error), Work("a"), Worker(0, "here"))
    assert done.outcome.message.startswith(r"ValueError: \x1b[31m half a letter \ud800 xxx")
    assert done.outcome.message.isprintable()
    assert len(done.outcome.message) == LONGEST_MESSAGE
    assert done.trace.replace("\n", "").isprintable()
    assert len(done.trace) == LONGEST_TRACE
    assert done.trace.startswith("Traceback")


class Harness:
    """A dispatcher whose ranks keep so many tasks until told to finish them."""

    def __init__(self, ranks, tasks, cost=0.01):
        self.parcels = []
        self.ledger = Ledger([Work(str(number), cost=cost) for number in range(tasks)], Watch())
        self.dispatcher = Dispatcher(ranks, self.ledger, self._note)

    def _note(self, rank, tasks):
        self.parcels.append((rank, [task.key for task in tasks]))

    def hand_out(self):
        self.parcels = []
        self.dispatcher.hand_out()
        return self.parcels

    def finish(self, rank, key, seconds):
        """What is handed out then."""
        self.dispatcher.take_back(rank, [key])
        self.ledger.enter(Done(key, COMPLETED, seconds))
        return self.hand_out()


def test_before_any_duration_is_known_each_rank_gets_one_task():
    harness = Harness(3, 10)
    assert harness.hand_out() == [(0, ["0"]), (1, ["1"]), (2, ["2"])]
    assert harness.hand_out() == []


def test_short_tasks_travel_together_and_no_further_ahead_than_agreed():
    harness = Harness(2, 100)
    harness.hand_out()
    ((rank, keys),) = harness.finish(1, "1", 0.01)  # rank 0 still has a task of unknown length
    assert rank == 1
    assert len(keys) == pytest.approx(LOOKAHEAD / 0.01, abs=1)


def test_long_tasks_are_kept_for_the_rank_that_is_free_first():
    harness = Harness(2, 4, cost=1.0)
    harness.hand_out()
    assert harness.finish(1, "1", 1.0) == [(1, ["2"])]
    assert harness.finish(0, "0", 1.0) == [(0, ["3"])]


def test_a_rank_that_has_almost_enough_is_not_sent_single_tasks():
    harness = Harness(1, 100)
    harness.hand_out()
    ((_, keys),) = harness.finish(0, "0", 0.01)
    sent = [len(more) for key in keys for _, more in harness.finish(0, key, 0.01)]
    assert min(sent) >= (1.0 - REFILL) * LOOKAHEAD / 0.01 - 1  # a task may be one too many by rounding


def test_what_waits_behind_a_task_that_hangs_is_handed_out_elsewhere(monkeypatch):
    now = [100.0]
    monkeypatch.setattr("nanoslip.study.run.dispatch.dispatch_time.monotonic", lambda: now[0])
    harness = Harness(2, 45)
    harness.hand_out()
    ((_, keys),) = harness.finish(0, "0", 0.01)
    assert harness.dispatcher.find_stranded() == []
    now[0] += STRANDED + 0.1
    assert [harness.dispatcher.find_stranded(), harness.dispatcher.find_stranded()] == [[0], []]
    harness.dispatcher.take_back(0, keys[1:])
    harness.ledger.give_back(keys[1:])
    ((rank, again),) = harness.finish(1, "1", 0.01)
    assert (rank, again[: len(keys) - 1]) == (1, keys[1:])
    assert {rank for rank, _ in harness.finish(0, keys[0], 0.01)} == {0}
