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


def test_the_queue_gives_up_all_that_waits_for_a_task_given_up():
    queue = TaskQueue(DIAMOND)
    queue.take()
    assert {task.key for task in queue.abandon("a")} == {"b", "c", "d"}
    assert queue.take().key == "e"
    assert len(queue) == 0
