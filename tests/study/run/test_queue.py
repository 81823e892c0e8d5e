"""The queue hands out what is needed first, each task once, and forgets what can never be done."""

import random

import pytest

from nanoslip.study.run.queue import TaskQueue
from tests.study.run.made_up import DIAMOND, Work


def test_the_queue_hands_out_needs_first_and_otherwise_in_the_order_given():
    queue = TaskQueue(DIAMOND)
    assert [queue.take().key, queue.take().key] == ["a", "e"]
    assert queue.ready == 0
    queue.finish("a")
    assert [queue.take().key, queue.take().key] == ["b", "c"]
    queue.finish("c")
    assert queue.ready == 0
    queue.finish("b")
    assert queue.take().key == "d"
    assert len(queue) == 0


def test_what_is_set_aside_stays_in_the_queue_and_is_not_handed_out():
    queue = TaskQueue(DIAMOND)
    queue.set_aside(queue.take().key)
    assert (queue.take().key, queue.ready) == ("e", 0)
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
    queue.put_last(first.key)
    queue.put_back(second.key)
    assert [queue.take().key, queue.take().key] == ["e", "a"]
    queue.finish("a")
    assert [queue.take().key, queue.take().key, len(queue)] == ["b", "c", 1]


def test_a_task_counts_as_finished_once():
    queue = TaskQueue(DIAMOND)
    queue.take()
    queue.finish("a")
    with pytest.raises(KeyError):
        queue.finish("a")
    assert [queue.take().key, queue.take().key] == ["b", "c"]
    queue.finish("b")
    with pytest.raises(KeyError):
        queue.finish("b")
    assert queue.take().key == "e"
    assert queue.ready == 0  # d needs c, too


def test_what_is_given_up_does_not_come_back_by_what_else_it_needs():
    queue = TaskQueue(DIAMOND)
    queue.take()
    queue.finish("a")
    assert [queue.take().key, queue.take().key] == ["b", "c"]
    assert [task.key for task in queue.abandon("b")] == ["d"]
    queue.finish("c")
    assert queue.take().key == "e"
    assert (queue.ready, len(queue)) == (0, 0)


@pytest.mark.parametrize("seed", range(20))
def test_the_next_task_is_the_first_of_all_that_are_ready_whatever_came_back_and_became_ready(seed):
    choose = random.Random(seed)
    tasks = [
        Work(str(place), tuple(map(str, choose.sample(range(place), min(place, choose.randrange(3))))))
        for place in range(60)
    ]
    choose.shuffle(tasks)
    place_of = {task.key: place for place, task in enumerate(tasks)}
    queue, finished, taken = TaskQueue(tasks), set(), set()
    while len(finished) < len(tasks):
        waiting = [task for task in tasks if task.key not in finished | taken]
        ready = [task for task in waiting if finished.issuperset(task.needs)]
        assert (queue.ready, len(queue)) == (len(ready), len(waiting))
        if ready and choose.random() < 0.6:
            task = queue.take()
            assert task is min(ready, key=lambda each: place_of[each.key])
            taken.add(task.key)
        elif taken:
            key = choose.choice(sorted(taken))
            taken.remove(key)
            if choose.random() < 0.3:
                queue.put_back(key)
            else:
                finished.add(queue.finish(key).key)
