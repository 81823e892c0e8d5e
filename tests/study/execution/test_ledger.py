"""The ledger learns how long tasks take, and what has failed is tried again where that may help."""

import pytest

from solver.outcome import COMPLETED, Ending, Outcome
from study.execution.ledger import CannotGoOnError, Done, Ledger, Tally, attempt
from tests.study.execution.made_up import DIAMOND, Diary, Work


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


def test_where_nothing_can_be_finished_any_more_no_task_has_failed():
    def execute(task: Work) -> Outcome:
        raise CannotGoOnError("the disk is full")

    ledger = Ledger(DIAMOND, Diary().report, lambda *_: pytest.fail("no attempt"))
    task = ledger.take()
    ledger.enter(attempt(execute, task, "here"))
    assert ledger.tally(False) == Tally(halt="the disk is full")
    assert ledger.queue.take() is task
