"""Each ready task goes to the rank with the least estimated work, in one message per rank."""

from functools import partial

import pytest

from nanoslip.solver.outcome import COMPLETED
from nanoslip.study.run.dispatch import LOOKAHEAD, REFILL, STRANDED, Dispatcher, Done, Ledger
from tests.study.run.made_up import Work


class Harness:
    """A dispatcher whose ranks keep their tasks until told to finish them."""

    def __init__(self, ranks: int, tasks: list[Work]) -> None:
        self.parcels: list[tuple[int, list[str]]] = []
        self.ledger: Ledger[Work] = Ledger(tasks, lambda *_: None)
        self.dispatcher = Dispatcher([partial(self._note, rank) for rank in range(ranks)])

    def _note(self, rank: int, tasks: list[Work]) -> None:
        self.parcels.append((rank, [task.key for task in tasks]))

    def hand_out(self) -> list[tuple[int, list[str]]]:
        self.parcels = []
        self.dispatcher.hand_out(self.ledger)
        return self.parcels

    def finish(self, rank: int, key: str, seconds: float) -> None:
        self.dispatcher.take_back(rank, [key])
        self.ledger.enter(Done(key, COMPLETED, seconds))


def test_before_any_duration_is_known_each_rank_gets_one_task():
    harness = Harness(3, [Work(str(number)) for number in range(10)])
    assert harness.hand_out() == [(0, ["0"]), (1, ["1"]), (2, ["2"])]
    assert harness.hand_out() == []


def test_short_tasks_travel_together_and_no_further_ahead_than_agreed():
    harness = Harness(2, [Work(str(number)) for number in range(100)])
    harness.hand_out()
    harness.finish(1, "1", 0.01)
    (rank, keys), *others = harness.hand_out()
    assert (rank, others) == (1, [])  # rank 0 still has a task of unknown length
    assert len(keys) == pytest.approx(LOOKAHEAD / 0.01, abs=1)


def test_long_tasks_are_kept_for_the_rank_that_is_free_first():
    harness = Harness(2, [Work(str(number), cost=1.0) for number in range(4)])
    harness.hand_out()
    harness.finish(1, "1", 1.0)
    assert harness.hand_out() == [(1, ["2"])]
    harness.finish(0, "0", 1.0)
    assert harness.hand_out() == [(0, ["3"])]


def test_a_rank_that_has_almost_enough_is_not_sent_single_tasks():
    harness = Harness(1, [Work(str(number)) for number in range(100)])
    harness.hand_out()
    harness.finish(0, "0", 0.01)
    ((_, keys),) = harness.hand_out()
    sent = []
    for key in keys:
        harness.finish(0, key, 0.01)
        sent += [len(more) for _, more in harness.hand_out()]
    assert min(sent) >= (1.0 - REFILL) * LOOKAHEAD / 0.01 - 1  # a task may be one too many by rounding


def test_what_waits_behind_a_task_that_hangs_is_handed_out_elsewhere(monkeypatch):
    now = [100.0]
    monkeypatch.setattr("nanoslip.study.run.dispatch.dispatch_time.monotonic", lambda: now[0])
    harness = Harness(2, [Work(str(number)) for number in range(45)])
    harness.hand_out()
    harness.finish(0, "0", 0.01)
    ((_, keys),) = harness.hand_out()
    assert harness.dispatcher.stranded() == []
    now[0] += STRANDED + 0.1
    assert harness.dispatcher.stranded() == [0]
    assert harness.dispatcher.stranded() == []
    harness.dispatcher.take_back(0, keys[1:])
    harness.ledger.give_back(keys[1:])
    harness.finish(1, "1", 0.01)
    ((rank, again),) = harness.hand_out()
    assert (rank, again[: len(keys) - 1]) == (1, keys[1:])
    harness.finish(0, keys[0], 0.01)
    assert {rank for rank, _ in harness.hand_out()} == {0}
