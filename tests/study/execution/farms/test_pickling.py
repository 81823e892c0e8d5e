"""What is pickled fast comes back as pickle would have brought it."""

import pickle
from dataclasses import dataclass
from typing import Any

import pytest

from nanoslip.solver.case import Case
from nanoslip.solver.drive import Drive
from nanoslip.solver.outcome import COMPLETED, Ending, Outcome
from nanoslip.solver.slab import Slab
from nanoslip.study.plan.task import Task
from nanoslip.study.run.dispatch import Done
from nanoslip.study.run.mail import dumps, loads, news_of
from tests.study.execution.made_up import Work


@dataclass(frozen=True, slots=True)
class Nothing:
    """Has no field."""


@dataclass(frozen=True, slots=True)
class Own:
    """Says itself how it is pickled."""

    value: int

    def __reduce__(self) -> tuple[Any, ...]:
        return Own, (self.value + 1,)


@dataclass(frozen=True)
class Half:
    """Has no slots."""

    first: int = 1


@dataclass(frozen=True, slots=True)
class Mixed(Half):
    second: int = 2


TASK = Task(
    "key",
    "drive",
    Slab(),
    Case(),
    Drive(0.1, 0.1, 1.0, 1.0),
    needs=("other",),
    limit=3.0,
    names=("radius",),
    values=(50.0,),
)
MESSAGES = [
    [TASK, TASK],
    [Done("key", COMPLETED, 0.5), Done("other", Outcome(Ending.CRASHED, "why"), 0.1, "rank 1", "trace", again=True)],
    news_of([Done("key", COMPLETED, 0.5, "rank 1")], ("a", "b")),
    (Nothing(), Own(1), Half(3), Mixed(4, 5), Work("a")),
    "ready",
]


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: type(message).__name__)
def test_messages_come_back_as_pickle_brings_them(message: object) -> None:
    assert loads(dumps(message)) == pickle.loads(pickle.dumps(message))


def test_what_is_one_object_stays_one() -> None:
    first, second = loads(dumps([TASK, TASK]))
    assert first is second


def test_limits_and_labels_that_do_not_make_a_task_another_one_come_along() -> None:
    (back,) = loads(dumps([TASK]))
    assert (back.limit, back.label) == (3.0, TASK.label)
