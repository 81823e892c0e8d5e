"""The farm of one process computes every task once, after its needs, and tells what became of each."""

import os
import signal
import threading

import pytest

from nanoslip.solver.outcome import COMPLETED, Ending, Outcome
from nanoslip.study.run.dispatch import Tally
from nanoslip.study.run.farm import SerialFarm
from tests.study.run.made_up import DIAMOND, Diary, Work


def test_serial_farm_computes_each_task_once_after_its_needs():
    diary = Diary()
    with SerialFarm(lambda: diary.execute) as farm:
        tally = farm.run(DIAMOND, diary.report)
    assert tally == Tally(done=5)
    assert diary.executed == ["a", "b", "c", "d", "e"]
    assert set(diary.reported.values()) == {COMPLETED}


def test_a_crash_is_told_and_costs_only_what_needs_it(capsys):
    diary = Diary(crash="b")
    with SerialFarm(lambda: diary.execute) as farm:
        tally = farm.run(DIAMOND, diary.report)
    assert tally == Tally(done=3, crashed=2)
    assert diary.executed == ["a", "b", "c", "e"]
    assert diary.reported["b"].ending is Ending.CRASHED
    assert diary.reported["b"].message == "ZeroDivisionError: a defect"  # the same on every machine
    assert diary.reported["d"] == Outcome(Ending.NEEDS_FAILED, "task b crashed")
    said = capsys.readouterr().err
    assert "rank 0 on " in said
    assert "task b crashed" in said
    assert "Traceback" in said


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGUSR1])
def test_after_a_signal_the_running_task_is_finished_and_no_other_begun(number):
    diary, before = Diary(), signal.getsignal(number)

    def execute(task: Work) -> Outcome:
        os.kill(os.getpid(), number)
        assert arrived.wait(5.0)
        return diary.execute(task)

    with SerialFarm(lambda: execute, grace=60.0) as farm:
        arrived = farm.interruption._requested
        tally = farm.run(DIAMOND, diary.report)
    assert tally == Tally(done=1, interrupted=True)
    assert list(diary.reported) == ["a"]
    assert signal.getsignal(number) is before
    assert not any(isinstance(thread, threading.Timer) for thread in threading.enumerate())


def test_a_signal_that_finds_all_work_done_interrupted_nothing():
    with SerialFarm(lambda: Diary().execute) as farm:
        farm.interruption.request()
        assert farm.run((), Diary().report) == Tally()
