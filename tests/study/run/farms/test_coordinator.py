"""Whoever computes, and however it is reached: every task is computed once, and after a signal only what has been begun."""

import time
from collections.abc import Callable, Collection, Sequence

import pytest

from nanoslip.solver.outcome import COMPLETED, Outcome
from nanoslip.study.run.dispatch import Done, Tally
from nanoslip.study.run.farm import Coordinator
from nanoslip.study.run.launch import WARNING, Interruption
from nanoslip.study.run.mail import News
from tests.study.run.made_up import DIAMOND, Diary, Work


class MadeUpRanks(Coordinator):
    """Ranks that compute one task each between two looks at their news; only the first one is near."""

    def __init__(self, size: int, seconds: float = 0.01) -> None:
        self.size = size
        self.interruption = Interruption(grace=1.0)
        self.computed: list[str] = []
        self._seconds = seconds
        self._waiting: list[list[Work]] = [[] for _ in range(size)]
        self._returned: list[tuple[int, News]] = []

    def give(self, rank: int, tasks: list[Work]) -> None:
        self._waiting[rank].extend(tasks)

    def take_back(self, rank: int) -> tuple[str, ...]:
        returned = tuple(task.key for task in self._waiting[rank][1:])
        del self._waiting[rank][1:]
        if rank == 0:
            return returned
        self._returned.append((rank, News(returned=returned)))
        return ()

    def news(self) -> list[tuple[int, News]]:
        found, self._returned = self._returned, []
        for rank, tasks in enumerate(self._waiting):
            if tasks:
                key = tasks.pop(0).key
                self.computed.append(key)
                found.append((rank, News([Done(key, COMPLETED, self._seconds)])))
        return found


def coordinated(ranks: MadeUpRanks, tasks: tuple[Work, ...], stop_after: str = "") -> tuple[Tally, Diary]:
    diary = Diary()

    def report(tasks: Sequence[Work], outcome: Outcome, seconds: Collection[float]) -> None:
        diary.report(tasks, outcome, seconds)
        if stop_after in [task.key for task in tasks]:
            ranks.interruption.request()

    return ranks.run(tasks, report), diary


def test_every_task_is_computed_once_after_its_needs() -> None:
    ranks = MadeUpRanks(3)
    tally, diary = coordinated(ranks, DIAMOND)
    assert tally == Tally(done=5)
    assert sorted(ranks.computed) == sorted(diary.reported) == list("abcde")
    assert ranks.computed.index("a") < min(map(ranks.computed.index, "bc"))
    assert ranks.computed.index("d") > max(map(ranks.computed.index, "bc"))


def test_those_who_have_computed_write_their_results_out_once_when_they_are_asked() -> None:
    ranks = MadeUpRanks(3)
    coordinated(ranks, DIAMOND[:1])
    assert "settle" not in ranks.computed
    for _ in range(2):
        ranks.settle()
        assert ranks.computed.count("settle") == 1
    coordinated(ranks, DIAMOND)
    ranks.settle()
    assert ranks.computed.count("settle") > 2


@pytest.fixture
def job(monkeypatch: pytest.MonkeyPatch) -> Callable[[float], None]:
    """Let this process be part of a job that has so many seconds left for tasks."""

    def part_of_a_job(seconds: float) -> None:
        monkeypatch.setenv("SLURM_JOB_END_TIME", str(round(time.time() + seconds) + WARNING))

    return part_of_a_job


def test_what_would_outlast_the_job_is_left_and_shorter_tasks_are_done(job: Callable[[float], None]) -> None:
    job(1000.0)
    known, long = Work("known", cost=1.0), Work("long", ("known",), cost=5000.0)
    short = [Work(f"short {number}", ("known",), cost=1.0) for number in range(10)]
    ranks = MadeUpRanks(2, seconds=1.0)
    tally, diary = coordinated(ranks, (known, long, Work("after", ("long",)), *short))
    assert tally == Tally(done=11, interrupted=True, outlasting=1)
    assert not {"long", "after"} & set(diary.reported)


def test_a_task_longer_than_any_job_is_tried_by_a_run_that_has_nothing_else(job: Callable[[float], None]) -> None:
    job(1000.0)
    tally, _ = coordinated(MadeUpRanks(1, seconds=5000.0), (Work("long", cost=5000.0), Work("longer", cost=6000.0)))
    assert tally == Tally(
        done=1, interrupted=True, outlasting=1
    )  # from the first it is known how long the second takes


def test_without_the_end_of_a_job_all_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SLURM_JOB_END_TIME", raising=False)
    tally, _ = coordinated(MadeUpRanks(1, seconds=1e9), tuple(Work(str(number)) for number in range(5)))
    assert tally == Tally(done=5)


def test_after_a_signal_what_has_not_been_begun_comes_back() -> None:
    ranks = MadeUpRanks(2)
    tally, diary = coordinated(ranks, tuple(Work(str(number)) for number in range(100)), stop_after="10")
    assert tally.interrupted
    assert tally.done == len(diary.reported) == len(ranks.computed) < 30
