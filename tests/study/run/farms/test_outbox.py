"""Ends of short tasks travel together, but none waits long, and no rank waits for tasks because of them."""

from nanoslip.solver.outcome import COMPLETED
from nanoslip.study.run.dispatch import Done
from nanoslip.study.run.mail import Outbox


def ended(*keys: str) -> list[Done]:
    return [Done(key, COMPLETED, 0.5, "rank 1 on host") for key in keys]


def test_ends_go_out_once_no_task_waits() -> None:
    outbox = Outbox(patience=10.0)
    assert outbox.take(ended("a"), waiting=2, now=0.0) == []
    assert outbox.take(ended("b"), waiting=1, now=0.1) == []
    assert outbox.take(ended("c"), waiting=0, now=0.2) == ended("a", "b", "c")
    assert outbox.take([], waiting=0, now=0.2) == []


def test_ends_wait_no_longer_than_agreed() -> None:
    outbox = Outbox(patience=1.0)
    assert outbox.take(ended("a"), waiting=100, now=5.0) == []
    assert outbox.take(ended("b"), waiting=100, now=5.95) == []
    assert outbox.take([], waiting=100, now=6.0) == ended("a", "b")
    assert outbox.take([], waiting=100, now=6.1) == []
    assert outbox.take(ended("c"), waiting=100, now=6.5) == []
    assert outbox.take([], waiting=100, now=7.5) == ended("c")
