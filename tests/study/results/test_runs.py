"""A folder's journal has a line for each begin and each end of a run, and is read back; it stands in the way of nothing."""

import json
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from nanoslip.study.results import attempts as runs
from nanoslip.study.results.attempts import Run

ONE = Run("a1", "2026-01-01T00:00:00+00:00", 4, hosts={"here": 4}, libraries={"numpy": "2"})


def test_runs_are_read_back_as_they_were_written_the_last_line_of_each_and_the_first_to_begin_first(
    tmp_path: Path,
) -> None:
    assert runs.read(tmp_path) == []
    other = replace(ONE, run="b2", begun="2025-12-31T00:00:00+00:00")
    ended = replace(ONE, ended="2026-01-01T00:01:00+00:00", done=3, wall_seconds=60.0)
    runs.add_run(tmp_path, ONE)
    assert runs.read(tmp_path) == [ONE]  # at work, or killed
    runs.add_run(tmp_path, other, ended)
    assert runs.read(tmp_path) == [other, ended]


def line(**changes: object) -> str:
    return json.dumps(asdict(ONE) | changes)


@pytest.mark.parametrize(
    "text",
    [
        "now,many",
        line()[:40],  # cut short
        line(processes=10**20),
        line(processes=True),
        line(wall_seconds=float("inf")),
        line(core_seconds=float("nan")),
        line(done=-1),
        line(hosts={"here": "many"}),
        line(libraries={"numpy": 2}),
        line(kinds={"record": [1, 1.0]}),
        line(kinds={"record": [1, 1.0, -1.0]}),
        line(kinds={"record": [1, 1.0, 1e308]}),
        line(kinds={"record": [1, 10**400, 1.0]}),
        line(done=10**400),
        line(kinds={"record": "many"}),
        line(begun=None),
        "[]",
        "{}",
        "[" * 100_000,
        "\0\0\0",
    ],
)
def test_lines_that_no_run_wrote_are_passed_over_and_the_next_run_begins_its_own(tmp_path: Path, text: str) -> None:
    (tmp_path / runs.RUNS_FILE).write_text(text)
    assert runs.read(tmp_path) == []
    assert runs.add_run(tmp_path, ONE) == ""
    assert runs.read(tmp_path) == [ONE]


def test_a_line_of_another_version_says_what_it_has_in_common(tmp_path: Path) -> None:
    (tmp_path / runs.RUNS_FILE).write_text(json.dumps({"run": "a", "begun": "b", "processes": 2, "later": 1}) + "\n")
    assert runs.read(tmp_path) == [Run("a", "b", 2)]


def test_what_cannot_be_written_is_said_and_nothing_else(tmp_path: Path) -> None:
    (tmp_path / runs.RUNS_FILE).mkdir()
    assert "runs.jsonl: cannot be written" in runs.add_run(tmp_path, ONE)
    assert runs.read(tmp_path) == []
