"""The ledger learns how long tasks take, and what has failed is tried again where that may help."""

import itertools
import time

import pytest

from nanoslip.solver.outcome import COMPLETED, LONGEST_MESSAGE, Ending, Outcome
from nanoslip.study.run.dispatch import LONGEST_TRACE, CannotGoOnError, Done, Ledger, Tally, attempt
from tests.study.run.made_up import DIAMOND, Diary, Work


def test_the_time_a_task_will_take_is_learnt_from_its_kind():
    ledger = Ledger([Work("a", cost=1.0), Work("b", cost=3.0)], lambda *_: None)
    other = Work("c", kind="another")
    assert ledger.expected(other) == float("inf")
    ledger.enter(Done(ledger.take().key, COMPLETED, seconds=2.0))
    assert ledger.expected(Work("b", cost=3.0)) == 6.0


def failing(ending: Ending, again: bool) -> Done:
    return Done("a", Outcome(ending, "why"), 1.0, again=again)


@pytest.mark.parametrize(("again", "attempts"), [(False, 1), (True, 2)])
def test_what_may_end_differently_is_tried_once_more_behind_all_others(again, attempts):
    diary, failed = Diary(), []
    ledger = Ledger(
        DIAMOND, diary.report, lambda task, done, final: failed.append((task.key, done.outcome.ending, final))
    )
    order = []
    while ledger.queue.ready:
        task = ledger.take()
        order.append(task.key)
        ledger.enter(failing(Ending.CRASHED, again) if task.key == "a" else Done(task.key, COMPLETED, 1.0))
    assert order == ["a", "e", "a"][: attempts + 1]
    ends = [("a", Ending.CRASHED, number == attempts) for number in range(1, attempts + 1)]
    assert failed[:attempts] == ends
    assert failed[attempts:] == []
    assert {key for key, outcome in diary.reported.items() if outcome.ending is Ending.NEEDS_FAILED} == set("bcd")
    assert ledger.tally(False) == Tally(done=1, crashed=4)


def refused(task: Work) -> Outcome:
    raise CannotGoOnError("the disk is full")


def test_where_nothing_can_be_kept_any_more_no_task_has_failed():
    ledger = Ledger(DIAMOND, Diary().report, lambda *_: pytest.fail("no attempt"))
    for _ in range(2):
        assert not ledger.halt
        ledger.enter(attempt(refused, ledger.take(), "here"))
    assert ledger.tally(False) == Tally(halt="the disk is full")
    assert len(ledger.queue) == len(DIAMOND)


def test_a_task_alone_whose_result_cannot_be_kept_has_failed():
    """It may have taken its process's files away: others are kept by another process, before it is tried again and after."""
    diary, failed = Diary(), []
    ledger = Ledger(DIAMOND, diary.report, lambda task, done, final: failed.append((task.key, done.passing, final)))
    while ledger.unfinished:
        task = ledger.take()
        ledger.enter(attempt(refused, task, "here") if task.key == "a" else Done(task.key, COMPLETED, 1.0))
    assert failed == [("a", True, True)]
    assert diary.reported["a"] == Outcome(Ending.CRASHED, "the disk is full")
    assert ledger.tally(False) == Tally(done=1, crashed=4)


@pytest.mark.parametrize(
    ("error", "harmed"),
    [
        (OSError(24, "Too many open files"), True),
        (MemoryError(), True),
        (CannotGoOnError("full"), True),
        (ValueError(), False),
    ],
)
def test_errors_of_the_machine_may_have_harmed_the_process(error: Exception, harmed: bool):
    def execute(task: Work) -> Outcome:
        raise error

    assert attempt(execute, Work("a"), "here").passing == harmed


def test_a_clock_that_a_task_moves_does_not_time_it(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(time, "perf_counter", itertools.count(0.0, -1e9).__next__)
    assert 0.0 <= attempt(lambda _: COMPLETED, Work("a"), "here").seconds < 60.0


def test_texts_of_an_exception_are_short_and_can_be_shown():
    """Terminals obey escapes, files in UTF-8 take no half letter, and each case of a dataset has room for the longest message."""

    def execute(task: Work) -> Outcome:
        raise ValueError("\x1b[31m half a letter \ud800 " + 2_000_000 * "x")

    done = attempt(execute, Work("a"), "here")
    assert done.outcome.message.startswith(r"ValueError: \x1b[31m half a letter \ud800 xxx")
    assert done.outcome.message.isprintable()
    assert len(done.outcome.message) == LONGEST_MESSAGE
    assert done.trace.replace("\n", "").isprintable()
    assert len(done.trace) == LONGEST_TRACE
    assert done.trace.startswith("Traceback")
