"""News of short tasks travel together, but none waits long, and no rank waits for tasks because of them."""

from study.execution.farms.outbox import Outbox


def test_news_go_out_once_as_many_tasks_have_ended_as_wait() -> None:
    outbox: Outbox[str] = Outbox(patience=10.0)
    outbox.add(["a"], now=0.0)
    assert outbox.due(waiting=3, now=0.0) == []
    outbox.add(["b"], now=0.1)
    assert outbox.due(waiting=2, now=0.1) == ["a", "b"]
    assert outbox.due(waiting=0, now=0.1) == []


def test_news_wait_no_longer_than_agreed() -> None:
    outbox: Outbox[str] = Outbox(patience=1.0)
    outbox.add(["a"], now=5.0)
    outbox.add(["b"], now=5.9)
    assert outbox.due(waiting=100, now=5.95) == []
    assert outbox.due(waiting=100, now=6.0) == ["a", "b"]
    outbox.add(["c"], now=6.5)
    assert outbox.due(waiting=100, now=7.0) == []


def test_a_rank_without_further_tasks_tells_at_once() -> None:
    outbox: Outbox[str] = Outbox(patience=10.0)
    outbox.add(["a"], now=0.0)
    assert outbox.due(waiting=0, now=0.0) == ["a"]
