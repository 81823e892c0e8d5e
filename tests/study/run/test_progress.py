"""The time that is left is told within a factor of two from a tenth of the time on; the bar says what is being done."""

import io
import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
import rich.console

from nanoslip.solver.outcome import COMPLETED
from nanoslip.study.run.dispatch import MeasuredTimes, Underway
from nanoslip.study.run.progress import SILENCE, Progress, TerminalProgress, TimeForecast, duration, makespan, roughly
from nanoslip.study.tasks.compliance import compliance_task
from nanoslip.study.tasks.record import record_task
from tests.study.plan.running import CASE
from tests.study.run.made_up import Work

RECORDED = json.loads(Path(__file__).with_name("timings.json").read_text("utf-8"))
"""Name of a run -> kind, estimated seconds and measured seconds of each task, in the order in which they were computed.

`mixture` has tasks of every kind on four grids; `map` is every tenth drive of campaigns/maps/stick_slip.toml. Both were
measured on a machine that did other things, too.
"""
FACTOR = 2.0
SHARE = 0.03
"""Of the whole run: an error smaller than that is none, however little is left."""


def tasks_of(kinds, number, cost=1.0):
    """So many tasks of each kind, one kind behind the other."""
    return [Work(f"{kind}{each}", cost=cost, kind=kind) for kind in kinds for each in range(number)]


def learn(forecast, tasks, seconds):
    for task in tasks:
        forecast.learn(task, seconds)


@pytest.mark.parametrize("name", RECORDED)
@pytest.mark.parametrize("machine", [1.0, 5.0], ids=["this machine", "one five times slower"])
def test_the_time_left_is_right_within_a_factor_of_two_from_a_tenth_on(name, machine):
    """Estimates alone would be wrong on the slower one: nobody passes by doing nothing."""
    kinds, estimated, measured = zip(*RECORDED[name], strict=True)
    assert 5.0 * sum(measured) > FACTOR * sum(estimated)
    tasks = [Work(str(number), cost=cost, kind=kinds[number]) for number, cost in enumerate(estimated)]
    forecast, elapsed, total = TimeForecast(tasks), 0.0, machine * sum(measured)
    looked, wrong = 0, []
    for task, seconds in zip(tasks, measured, strict=True):
        forecast.learn(task, machine * seconds)
        elapsed += machine * seconds
        left, slack = total - elapsed, SHARE * total
        if 0.1 * total < elapsed:
            looked += 1
            if not left / FACTOR - slack < forecast.seconds < left * FACTOR + slack:
                wrong.append((elapsed / total, forecast.seconds / left))
    assert looked > 50
    assert not wrong


def test_before_anything_is_known_the_estimate_is_told_and_ranks_share_it():
    tasks = [Work("a", cost=3.0, kind="x"), Work("b", cost=5.0, kind="y")]
    assert TimeForecast(tasks).seconds == pytest.approx(8.0)
    assert TimeForecast(tasks, 4).seconds == pytest.approx(2.0)
    assert (TimeForecast(tasks).share, TimeForecast([]).share) == (0.0, 1.0)


def test_a_kind_is_scaled_by_its_own_tasks_and_others_by_all_until_they_have_some():
    tasks = tasks_of("xy", 100)
    forecast = TimeForecast(tasks)
    learn(forecast, tasks[:50], 10.0)
    assert forecast.seconds == pytest.approx(150.0 * 10.0)
    learn(forecast, tasks[100:150], 1.0)
    assert forecast.seconds == pytest.approx(50.0 * 10.0 + 50.0 * 1.0)
    learn(forecast, [*tasks[50:100], *tasks[150:]], 1.0)
    assert forecast.seconds == pytest.approx(0.0, abs=1e-9)
    assert forecast.share == pytest.approx(1.0)


def test_a_run_that_goes_on_begins_with_what_the_earlier_ones_measured():
    tasks = tasks_of("xy", 100)
    forecast = TimeForecast(tasks, 1, MeasuredTimes({"x": [10, 10.0, 20.0], "y": [1, 2.0, 1.0]}))
    assert forecast.seconds == pytest.approx(250.0)
    learn(forecast, tasks[:50], 2.0)
    assert forecast.seconds == pytest.approx(150.0)


def test_many_ranks_take_as_long_as_the_longest_chain_and_one_takes_it_all():
    chain = [Work(str(each), (str(each - 1),) if each else (), 1.0) for each in range(5)]
    tasks = [*chain, *tasks_of("r", 5)]
    assert [makespan(tasks, ranks) for ranks in (1, 2, 100)] == [10.0, 5.0, 5.0]
    assert makespan([], 3) == 0.0


def test_tasks_that_took_twice_as_long_as_predicted_double_what_is_expected_of_their_kind():
    tasks = [Work(f"{kind}{number}", cost=1.0 + number, kind=kind) for kind in "xyz" for number in range(4)]
    measured = MeasuredTimes()
    assert makespan(tasks, 1, measured.seconds) == sum(task.cost for task in tasks)
    for task in tasks[:4]:
        measured.learn(task, 2.0 * task.cost)
    assert [measured.factor(kind) for kind in "xyz"] == [2.0, 2.0, 2.0]  # of the others nothing better is known
    measured.learn(tasks[4], 0.5)
    assert [measured.factor(kind) for kind in "xy"] == [2.0, 0.5]
    assert measured.factor("z") == pytest.approx(20.5 / 11.0)
    assert makespan(tasks[:8], 1, measured.seconds) == pytest.approx(25.0)
    assert makespan(tasks[:4], 100, measured.seconds) == pytest.approx(8.0)
    assert (measured.tasks("x"), measured.tasks("xy"), measured.tasks("xyz")) == (4, 5, 0)
    again = MeasuredTimes(measured.as_data(), measured.as_data())  # of two runs
    assert (again.factor("x"), again.tasks("xy")) == (measured.factor("x"), 10)


@pytest.mark.parametrize(
    ("seconds", "at_a_glance", "to_a_factor_of_three"),
    [
        (0.0, "0 s", "about 0 s"),
        (0.123, "0.12 s", "about 0.1 s"),
        (42.0, "42 s", "about 40 s"),
        (94.0, "94 s", "about 90 s"),
        (97.0, "97 s", "about 2 min"),
        (99.7, "0:01:40", "about 2 min"),
        (3661.0, "1:01:01", "about 60 min"),
        (5400.0, "1:30:00", "about 90 min"),
        (1e4, "2:46:40", "about 3 h"),
        (1e6, "11.6 days", "about 10 days"),
    ],
)
def test_durations_have_as_many_digits_as_are_known(seconds, at_a_glance, to_a_factor_of_three):
    assert (duration(seconds), roughly(seconds)) == (at_a_glance, to_a_factor_of_three)


TASKS = [
    replace(compliance_task(CASE.slab), names=("n_x",), values=(33,)),
    replace(record_task(CASE), names=("intrinsic_friction", "radius"), values=(0.5, 50.0)),
]


def bar_of(tasks, width):
    """What a terminal shows, state by state, without its control sequences."""
    screen = io.StringIO()
    console = rich.console.Console(file=screen, width=width, force_terminal=True, color_system=None)
    with TerminalProgress(tasks, console) as progress:
        for task in tasks:
            progress.ended(task, COMPLETED, 0.01)
            progress._bar.refresh()  # it redraws ten times a second by itself
    return [state.strip() for state in re.split(r"\x1b\[[0-9?]+[A-Za-z]|[\r\n]", screen.getvalue()) if state.strip()]


def test_a_task_is_named_whole_or_by_its_kind_and_in_the_end_it_is_said_how_long_all_took():
    assert any(state.endswith("record intrinsic_friction=0.5 radius=50") for state in bar_of(TASKS, 160))
    states = bar_of(TASKS, 80)
    assert any(state.endswith("left record") for state in states)
    assert all("compl" not in state for state in states)  # the kind has no room either
    assert re.fullmatch(r"2 of 2 tasks ━+ +in [\d.e-]+ s", states[-1])
    assert all(len(state) <= 60 for state in bar_of(TASKS, 60))


def test_the_bar_never_goes_back():
    """Tasks that take longer and longer raise the estimate of those that are left, and so lower the share of the work done."""
    tasks, screen = tasks_of("xy", 3), io.StringIO()
    console = rich.console.Console(file=screen, width=80, force_terminal=True)
    shares, estimates = [], TimeForecast(tasks)
    falls = []
    with TerminalProgress(tasks, console) as progress:
        for task, seconds in zip(tasks, (1.0, 1.0, 1.0, 30.0, 60.0, 60.0), strict=True):
            progress.ended(task, COMPLETED, seconds)
            estimates.learn(task, seconds)
            shares.append(progress._bar.tasks[0].completed)
            falls.append(estimates.share)
    assert shares == sorted(shares)
    assert falls != sorted(falls)
    assert shares[-1] == 1.0


def test_a_task_goes_on_at_its_own_rate_and_others_of_its_kind_at_the_same():
    """A quarter in 30 s: three quarters of it and all of another take 90 s and 120 s, whatever was estimated."""
    tasks = tasks_of("x", 2)
    forecast = TimeForecast(tasks)
    forecast.advance(tasks[0], Underway(tasks[0].key, 0.25, 30.0, 30.0))
    assert forecast.seconds == pytest.approx(90.0 + 120.0)
    assert forecast.share == pytest.approx(30.0 / 240.0)
    forecast.learn(tasks[0], 120.0)
    assert forecast.underway == []
    assert forecast.seconds == pytest.approx(120.0)


def test_a_task_that_has_only_begun_says_nothing_of_its_rate():
    tasks = tasks_of("x", 2)
    forecast = TimeForecast(tasks)
    forecast.advance(tasks[0], Underway(tasks[0].key, 0.0, 30.0, 30.0))
    assert forecast.seconds == pytest.approx(2.0)


def test_the_bar_moves_within_a_task_and_names_it():
    screen = io.StringIO()
    console = rich.console.Console(file=screen, width=160, force_terminal=True, color_system=None)
    with TerminalProgress(TASKS, console) as progress:
        shares = []
        for share in (0.25, 0.5, 0.75):
            progress.advanced(TASKS[1], Underway(TASKS[1].key, share, 100.0 * share, 100.0 * share))
            shares.append(progress._bar.tasks[0].completed)
        assert progress._bar.tasks[0].description == TASKS[1].label
    assert 0.0 < shares[0] < shares[1] < shares[2] < 1.0


def lines_of(underway, ranks=1):
    """Lines of a log in which a task advances, and no time passes."""
    said = io.StringIO()
    with Progress(TASKS[1:], said, ranks) as progress:
        for each in underway:
            progress.advanced(TASKS[1], each)
        progress._show()
    return said.getvalue().splitlines()


def test_progress_of_a_task_writes_no_further_line_and_estimates_anew():
    key = TASKS[1].key
    few, many = (lines_of([Underway(key, 0.2, 20.0, 20.0)] * count) for count in (1, 100))
    assert len(few) == len(many)
    left, done = few[1].split(", ")[-2:]
    assert (left.split()[1], done.split()[0]) == ("80", "20%")


@pytest.mark.parametrize(("ranks", "word"), [(1, "this"), (4, "each")])
def test_a_process_that_gets_little_of_a_core_is_named(ranks, word):
    key = TASKS[1].key
    crowded, alone = (lines_of([Underway(key, 0.2, 50.0, seconds)], ranks)[1] for seconds in (3.0, 45.0))
    assert f"{word} process gets 6% of a core" in crowded
    assert "core" not in alone
    assert len(crowded) - len(alone) < 40


def test_a_crowded_bar_fits_on_a_narrow_terminal():
    screen = io.StringIO()
    console = rich.console.Console(file=screen, width=80, force_terminal=True, color_system=None)
    with TerminalProgress(tasks_of("x", 1000), console) as progress:
        progress.advanced(Work("x0", kind="x"), Underway("x0", 0.5, 50.0, 3.0))
        progress._bar.refresh()
        lines = re.split(r"\x1b\[[0-9?]+[A-Za-z]|[\r\n]", screen.getvalue())
    assert any("6% of a core" in line for line in lines)
    assert all("…" not in line for line in lines)


def test_nothing_to_do_is_no_bar_and_one_task_is_a_task():
    assert bar_of([], 80) == []
    said = io.StringIO()
    with Progress(TASKS[:1], said):
        pass
    assert said.getvalue().startswith("1 task to do\n0 of 1 task done")


def test_a_task_that_takes_longer_than_estimated_is_reported_while_it_runs(monkeypatch):
    """A light pin took 85 s after the first line."""
    monkeypatch.setattr("nanoslip.study.run.progress.SILENCE", 0.01)
    said = io.StringIO()
    with Progress(TASKS, said) as progress:
        progress.ended(TASKS[0], COMPLETED, 0.001)
        while said.getvalue().count("\n") < 2:
            pass
    assert re.search(r"^1 of 2 tasks, .*late, about [\d.e-]+ s left: record$", said.getvalue(), re.M)


def test_lines_of_a_long_run_are_as_many_as_its_time_has_quarters(monkeypatch):
    """A log of an hour has some thirty lines, not hundreds."""
    waits = []

    class Clock:
        now = 0.0

        def is_over(self, seconds):
            waits.append(seconds)
            self.now += seconds
            return self.now > 3600.0

    clock = Clock()
    progress = Progress(TASKS, io.StringIO())
    monkeypatch.setattr("nanoslip.study.run.progress.time.monotonic", lambda: clock.now)
    monkeypatch.setattr(progress._left, "wait", clock.is_over)
    progress._start = progress._last = 0.0
    progress._report()
    assert waits[0] == SILENCE
    assert waits == sorted(waits)
    assert 10 < len(waits) < 40
