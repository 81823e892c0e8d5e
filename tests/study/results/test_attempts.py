"""Beside the results is on record what failed and who computed when; what no run wrote there means nothing, and stops nothing."""

import json
from dataclasses import asdict, replace

import pytest

from nanoslip.solver.outcome import Ending
from nanoslip.study.results import attempts
from nanoslip.study.results.attempts import ADVICE, FILE, RUNS_FILE, Attempt, RunRecord
from tests.study.results.results import flip

ONE = RunRecord("a1", "2026-01-01T00:00:00+00:00", 4, hosts={"here": 4}, libraries={"numpy": "2"})


def attempt(task, ending=Ending.CRASHED, final=True, passing=False, solver="this"):
    where, ended = "rank 0 on here", "2026-01-01T00:00:00+00:00"
    return Attempt(task, f"record {task}", ending.value, "why", final, passing, solver, where, ended)


def test_the_last_attempt_of_this_solver_counts_where_it_was_final(tmp_path):
    """What came well out of a later attempt, or is being tried again, has not failed."""
    assert attempts.final(tmp_path / "nowhere", "this") == {}
    given = [attempt("a", final=False), attempt("a"), attempt("b", final=False), attempt("c", solver="other")]
    given += [attempt("d"), attempt("d", Ending.COMPLETED, final=False), attempt("e"), attempt("e", final=False)]
    assert [attempts.add_attempt(tmp_path, each) for each in given] == [""] * 8
    assert attempts.lost(tmp_path) == ""
    assert attempts.final(tmp_path, "this") == {"a": given[1]}


@pytest.mark.parametrize("passing", [True, False])
def test_only_what_would_end_the_same_way_is_given_up_and_says_how_to_try_again(passing):
    """Another machine may have the memory."""
    found = attempt("a", passing=passing)
    assert found.given_up == (not passing)
    assert found.outcome.message.endswith(ADVICE) == found.given_up
    assert "here" not in found.outcome.message  # a dataset knows no host


FAILED = asdict(attempt("a"))


@pytest.mark.parametrize(
    "line",
    [
        *(b"nonsense", b"[]", b"{}", b"null", b"\xff\xfe", b"[" * 10**5, b'{"task": 1}', b"\n"),
        *(json.dumps(FAILED).encode(), attempts._line(FAILED | {"ending": "magic"}).encode()),
    ],
)
def test_lines_that_are_no_attempt_are_left_out_and_named(tmp_path, line):
    """What failed there counts as not tried."""
    attempts.add_attempt(tmp_path, attempt("good"))
    with (tmp_path / FILE).open("ab") as file:
        file.write(line)  # cut short: no end of line
    attempts.add_attempt(tmp_path, attempt("next"))
    assert attempts.final(tmp_path, "this").keys() == {"good", "next"}
    assert "(line 2)" in attempts.lost(tmp_path)


def test_no_bit_of_an_attempt_changes_without_being_named(tmp_path):
    """One that counts for another task, or another solver, would be forgotten; another word would stand in a dataset."""
    attempts.add_attempt(tmp_path, attempt("a"))
    path = tmp_path / FILE
    whole = path.read_bytes()
    for bit in range(0, 8 * (len(whole) - 1), 11):  # every place of a byte
        flip(path, bit)
        assert attempts.lost(tmp_path)
        assert attempts.final(tmp_path, "this") == {}
        path.write_bytes(whole)
    assert attempts.final(tmp_path, "this") == {"a": attempt("a")}


def test_runs_are_read_back_by_their_last_lines_the_first_to_begin_first(tmp_path):
    assert attempts.read_runs(tmp_path) == []
    other = replace(ONE, run="b2", begun="2025-12-31T00:00:00+00:00")
    ended = replace(ONE, ended="2026-01-01T00:01:00+00:00", done=3, wall_seconds=60.0)
    attempts.add_run(tmp_path, ONE)
    assert attempts.read_runs(tmp_path) == [ONE]  # at work, or killed
    attempts.add_run(tmp_path, other)
    attempts.add_run(tmp_path, ended)
    assert attempts.read_runs(tmp_path) == [other, ended]


@pytest.mark.parametrize("text", ["now,many", json.dumps(asdict(ONE)), "[]", "{}", "[" * 100_000, "\0\0\0"])
def test_lines_that_no_run_wrote_are_passed_over_and_the_next_run_begins_its_own(tmp_path, text):
    (tmp_path / RUNS_FILE).write_text(text)
    assert attempts.read_runs(tmp_path) == []
    assert attempts.add_run(tmp_path, ONE) == ""
    assert attempts.read_runs(tmp_path) == [ONE]


def test_a_line_of_another_version_says_what_it_has_in_common(tmp_path):
    (tmp_path / RUNS_FILE).write_text(attempts._line({"run": "a", "begun": "b", "processes": 2, "later": 1}) + "\n")
    assert attempts.read_runs(tmp_path) == [RunRecord("a", "b", 2)]
