"""The time that is left is told within a factor of two from a tenth of the time on: recorded runs, replayed."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from nanoslip.study.run.progress import Forecast, Measured, duration, makespan, roughly

RECORDED: dict[str, list[list[Any]]] = json.loads(Path(__file__).with_name("timings.json").read_text("utf-8"))
"""Name of a run -> kind, estimated seconds and measured seconds of each task, in the order in which they were computed.

`mixture` has tasks of every kind on four grids; `map` is every tenth drive of campaigns/maps/stick_slip.toml. Both were
measured on a machine that did other things, too.
"""
FACTOR = 2.0
SHARE = 0.03
"""Of the whole run: an error smaller than that is none, however little is left."""


@dataclass(frozen=True)
class Work:
    key: str
    kind: str
    cost: float
    needs: tuple[str, ...] = ()
    label: str = ""


def tasks_of(rows: Sequence[Sequence[Any]]) -> list[Work]:
    return [Work(str(number), kind, estimated) for number, (kind, estimated, _) in enumerate(rows)]


@pytest.mark.parametrize("name", RECORDED)
@pytest.mark.parametrize("machine", [1.0, 5.0], ids=["this machine", "one five times slower"])
def test_the_time_left_is_right_within_a_factor_of_two_from_a_tenth_on(name: str, machine: float) -> None:
    rows = RECORDED[name]
    tasks, times = tasks_of(rows), [machine * row[2] for row in rows]
    forecast, elapsed, total = Forecast(tasks), 0.0, sum(times)
    looked, wrong = 0, []
    for task, seconds in zip(tasks, times, strict=True):
        forecast.learn([task], [seconds])
        elapsed += seconds
        left = total - elapsed
        if 0.1 * total < elapsed:
            looked += 1
            slack = SHARE * total
            if not left / FACTOR - slack < forecast.seconds < left * FACTOR + slack:
                wrong.append((elapsed / total, forecast.seconds / left))
    assert looked > 50
    assert not wrong


@pytest.mark.parametrize("name", RECORDED)
def test_estimates_alone_would_be_wrong_on_another_machine(name: str) -> None:
    """That the test above is not passed by doing nothing."""
    rows = RECORDED[name]
    assert 5.0 * sum(row[2] for row in rows) > FACTOR * sum(row[1] for row in rows)


def test_before_anything_is_known_the_estimate_is_told_and_ranks_share_it() -> None:
    tasks = [Work("a", "x", 3.0), Work("b", "y", 5.0)]
    assert Forecast(tasks).seconds == pytest.approx(8.0)
    assert Forecast(tasks, 4).seconds == pytest.approx(2.0)
    assert Forecast(tasks).share == 0.0
    assert Forecast([]).share == 1.0


def test_a_kind_is_scaled_by_its_own_tasks_and_others_by_all_until_they_have_some() -> None:
    tasks = [Work(f"{kind}{number}", kind, 1.0) for kind in "xy" for number in range(100)]
    forecast = Forecast(tasks)
    forecast.learn(tasks[:50], [10.0] * 50)
    assert forecast.seconds == pytest.approx(150.0 * 10.0)
    forecast.learn(tasks[100:150], [1.0] * 50)
    assert forecast.seconds == pytest.approx(50.0 * 10.0 + 50.0 * 1.0)
    forecast.learn([*tasks[50:100], *tasks[150:]], [1.0] * 100)
    assert forecast.seconds == pytest.approx(0.0, abs=1e-9)
    assert forecast.share == pytest.approx(1.0)


def test_many_ranks_take_as_long_as_the_longest_chain_and_one_takes_it_all() -> None:
    chain = [Work("0", "x", 1.0), *(Work(str(each), "x", 1.0, (str(each - 1),)) for each in range(1, 5))]
    rest = [Work(f"r{each}", "x", 1.0) for each in range(5)]
    assert makespan([*chain, *rest], 1) == 10.0
    assert makespan([*chain, *rest], 2) == 5.0
    assert makespan([*chain, *rest], 100) == 5.0
    assert makespan([], 3) == 0.0


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.0, "0 s"), (0.123, "0.12 s"), (42.0, "42 s"), (99.7, "0:01:40"), (3661.0, "1:01:01"), (1e6, "11.6 days")],
)
def test_durations_are_read_at_a_glance(seconds: float, words: str) -> None:
    assert duration(seconds) == words


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (0.0, "about 0 s"),
        (0.123, "about 0.1 s"),
        (94.0, "about 90 s"),
        (97.0, "about 2 min"),
        (5400.0, "about 90 min"),
        (1e4, "about 3 h"),
        (1e6, "about 10 days"),
    ],
)
def test_what_is_known_to_a_factor_of_three_has_one_digit(seconds: float, words: str) -> None:
    assert roughly(seconds) == words


def test_tasks_that_took_twice_as_long_as_predicted_double_what_is_expected_of_their_kind() -> None:
    tasks = [Work(f"{kind}{number}", kind, 1.0 + number) for kind in "xyz" for number in range(4)]
    measured = Measured()
    assert makespan(tasks, 1, measured.seconds) == sum(task.cost for task in tasks)
    measured.learn([task for task in tasks[:4] if task.kind == "x"], [2.0, 4.0, 6.0, 8.0])
    assert [measured.factor(kind) for kind in "xyz"] == [2.0, 2.0, 2.0]  # of the others nothing better is known
    measured.learn(tasks[4:5], [0.5])
    assert [measured.factor(kind) for kind in "xy"] == [2.0, 0.5]
    assert measured.factor("z") == pytest.approx(20.5 / 11.0)
    assert makespan(tasks[:8], 1, measured.seconds) == pytest.approx(25.0)
    assert makespan(tasks[:4], 100, measured.seconds) == pytest.approx(8.0)
    assert (measured.tasks("x"), measured.tasks("xy"), measured.tasks("xyz")) == (4, 5, 0)
    again = Measured(measured.as_data(), measured.as_data())  # of two runs
    assert again.factor("x") == measured.factor("x")
    assert again.tasks("xy") == 10


def test_a_run_that_goes_on_begins_with_what_the_earlier_ones_measured() -> None:
    tasks = [Work(f"{kind}{number}", kind, 1.0) for kind in "xy" for number in range(100)]
    forecast = Forecast(tasks, 1, Measured({"x": [10, 10.0, 20.0], "y": [1, 2.0, 1.0]}))
    assert forecast.seconds == pytest.approx(250.0)
    forecast.learn(tasks[:50], [2.0] * 50)
    assert forecast.seconds == pytest.approx(150.0)
