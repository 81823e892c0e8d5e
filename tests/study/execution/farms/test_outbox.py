"""News of short tasks travel together, but none waits long, and no rank waits for tasks because of them."""

from nanoslip.solver.outcome import COMPLETED, Ending, Outcome
from nanoslip.study.run.dispatch import Done
from nanoslip.study.run.mail import News, Outbox, news_of


def ended(*keys: str) -> list[Done]:
    return [Done(key, COMPLETED, 0.5, "rank 1 on host") for key in keys]


def told(*keys: str) -> News:
    return News({Ending.COMPLETED: dict.fromkeys(keys, 0.5)}, where="rank 1 on host")


def test_news_go_out_once_as_many_tasks_have_ended_as_wait() -> None:
    outbox = Outbox(patience=10.0)
    outbox.add(ended("a"), (), now=0.0)
    assert outbox.due(waiting=3, now=0.0) is None
    outbox.add(ended("b"), (), now=0.1)
    assert outbox.due(waiting=2, now=0.1) == told("a", "b")
    assert outbox.due(waiting=0, now=0.1) is None


def test_news_wait_no_longer_than_agreed() -> None:
    outbox = Outbox(patience=1.0)
    outbox.add(ended("a"), (), now=5.0)
    outbox.add(ended("b"), (), now=5.9)
    assert outbox.due(waiting=100, now=5.95) is None
    assert outbox.due(waiting=100, now=6.0) == told("a", "b")
    outbox.add(ended("c"), (), now=6.5)
    assert outbox.due(waiting=100, now=7.0) is None


def test_a_rank_without_further_tasks_tells_at_once() -> None:
    outbox = Outbox(patience=10.0)
    outbox.add(ended("a"), (), now=0.0)
    assert outbox.due(waiting=0, now=0.0) == told("a")


def test_what_a_rank_gives_back_goes_out_at_once_as_nothing_waits_any_more() -> None:
    outbox = Outbox(patience=10.0)
    outbox.add([], ("a", "b"), now=0.0)
    assert outbox.due(waiting=0, now=0.0) == News({}, returned=("a", "b"))


def test_of_what_failed_all_is_told_and_of_the_rest_how_it_ended_and_how_long_it_took() -> None:
    refused = Done("b", Outcome(Ending.NO_PLATEAU, "0.2 is too little"), 0.25, "rank 1 on host")
    failed = Done("c", Outcome(Ending.CRASHED, "why"), 0.1, "rank 1 on host", "trace", again=True)
    assert news_of([*ended("a"), refused, failed]) == News(
        {Ending.COMPLETED: {"a": 0.5}, Ending.NO_PLATEAU: {"b": 0.25}}, (failed,), where="rank 1 on host"
    )
