"""Each ready task goes to the rank with the least estimated work, in one message per rank."""

from dataclasses import dataclass
from functools import partial

import pytest

from solver.outcome import COMPLETED
from study.execution.dispatch import LOOKAHEAD, Dispatcher
from study.execution.ledger import Done, Ledger


@dataclass(frozen=True)
class Work:
    key: str
    cost: float
    needs: tuple[str, ...] = ()
    kind: str = "any"
    label: str = ""


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
        self.ledger.enter(self.dispatcher.take_back(rank, key), Done(key, COMPLETED, seconds))


def test_before_any_duration_is_known_each_rank_gets_one_task():
    harness = Harness(3, [Work(str(number), 0.01) for number in range(10)])
    assert harness.hand_out() == [(0, ["0"]), (1, ["1"]), (2, ["2"])]
    assert harness.hand_out() == []


def test_short_tasks_travel_together_and_no_further_ahead_than_agreed():
    harness = Harness(2, [Work(str(number), 0.01) for number in range(100)])
    harness.hand_out()
    harness.finish(1, "1", 0.01)
    (rank, keys), *others = harness.hand_out()
    assert (rank, others) == (1, [])  # rank 0 still has a task of unknown length
    assert len(keys) == pytest.approx(LOOKAHEAD / 0.01, abs=1)


def test_long_tasks_are_kept_for_the_rank_that_is_free_first():
    harness = Harness(2, [Work(str(number), 1.0) for number in range(4)])
    harness.hand_out()
    harness.finish(1, "1", 1.0)
    assert harness.hand_out() == [(1, ["2"])]
    harness.finish(0, "0", 1.0)
    assert harness.hand_out() == [(0, ["3"])]


def test_what_a_rank_lets_fall_is_no_longer_its_load():
    harness = Harness(2, [Work("a", 1.0), Work("b", 1.0), Work("c", 1.0)])
    harness.hand_out()
    assert harness.dispatcher.busy
    harness.dispatcher.forget(1)
    harness.dispatcher.take_back(0, "a")
    assert not harness.dispatcher.busy
    assert harness.hand_out() == [(0, ["c"])]
