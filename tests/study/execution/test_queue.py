"""The queue hands out what is needed first, each task once, and forgets what can never be done."""

from study.execution.queue import TaskQueue
from tests.study.execution.made_up import DIAMOND


def test_the_queue_hands_out_needs_first_and_otherwise_in_the_order_given():
    queue = TaskQueue(DIAMOND)
    assert [queue.take().key, queue.take().key] == ["a", "e"]
    assert queue.first() is None
    queue.finish("a")
    assert [queue.take().key, queue.take().key] == ["b", "c"]
    queue.finish("c")
    assert queue.first() is None
    queue.finish("b")
    assert queue.take().key == "d"
    assert len(queue) == 0


def test_what_is_set_aside_stays_in_the_queue_and_is_not_handed_out():
    queue = TaskQueue(DIAMOND)
    queue.set_aside()
    assert (queue.take().key, queue.first(), queue.ready) == ("e", None, 0)
    assert (queue.aside, len(queue)) == (1, 4)  # it and the three that need it


def test_the_queue_gives_up_all_that_waits_for_a_task_given_up():
    queue = TaskQueue(DIAMOND)
    queue.take()
    assert {task.key for task in queue.abandon("a")} == {"b", "c", "d"}
    assert queue.take().key == "e"
    assert len(queue) == 0


def test_a_task_that_is_put_back_keeps_its_place_and_one_that_is_put_last_loses_it():
    queue = TaskQueue(DIAMOND)
    first, second = queue.take(), queue.take()
    assert (first.key, second.key, len(queue)) == ("a", "e", 3)
    queue.put_last(first)
    queue.put_back(second)
    assert [queue.take().key, queue.take().key] == ["e", "a"]
    queue.finish("a")
    assert [queue.take().key, queue.take().key, len(queue)] == ["b", "c", 1]


def test_a_task_counts_as_finished_once():
    queue = TaskQueue(DIAMOND)
    queue.take()
    for _ in range(2):
        queue.finish("a")
    assert [queue.take().key, queue.take().key] == ["b", "c"]
    for _ in range(2):
        queue.finish("b")
    assert queue.take().key == "e"
    assert queue.first() is None  # d needs c, too


def test_what_is_given_up_does_not_come_back_by_what_else_it_needs():
    queue = TaskQueue(DIAMOND)
    queue.take()
    queue.finish("a")
    assert [queue.take().key, queue.take().key] == ["b", "c"]
    assert [task.key for task in queue.abandon("b")] == ["d"]
    queue.finish("c")
    assert queue.take().key == "e"
    assert (queue.first(), len(queue)) == (None, 0)
