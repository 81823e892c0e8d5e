"""What failed is on record beside the results; the record of other software, and lines cut short, mean nothing."""

from pathlib import Path

import pytest

from nanoslip.solver.outcome import Ending
from nanoslip.study.results import attempts
from nanoslip.study.results.attempts import ADVICE, FILE, Attempt
from tests.study.results.results import NO_FILES, flip


def attempt(
    task: str, ending: Ending = Ending.CRASHED, final: bool = True, passing: bool = False, solver: str = "this"
) -> Attempt:
    where, ended = "rank 0 on here", "2026-01-01T00:00:00+00:00"
    return Attempt(task, f"record {task}", ending.value, "why", final, passing, solver, where, ended)


def test_the_last_attempt_of_this_solver_counts_where_it_was_final(tmp_path: Path) -> None:
    """What came well out of a later attempt, or is being tried again, has not failed."""
    well = attempt("d", Ending.COMPLETED, final=False)
    given = [attempt("a", final=False), attempt("a"), attempt("b", final=False), attempt("c", solver="other")]
    given += [attempt("d"), well, attempt("e"), attempt("e", final=False)]
    assert [attempts.add(tmp_path, each) for each in given] == [""] * 8
    assert attempts.final(tmp_path, "this") == {"a": given[1]}
    assert attempts.final(tmp_path / "nowhere", "this") == {}


@pytest.mark.parametrize("passing", [True, False])
def test_only_what_would_end_the_same_way_is_given_up_and_says_how_to_try_again(passing: bool) -> None:
    """Another machine may have the memory."""
    found = attempt("a", passing=passing)
    assert found.given_up == (not passing)
    assert found.outcome.message.endswith(ADVICE) == found.given_up
    assert "here" not in found.outcome.message  # a dataset knows no host


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b"nonsense",
        b"[]",
        b"{}",
        b"null",
        b"\xff\xfe",
        b"[" * 10**5,
        b'{"task": 1}',
        b'{"task": "a", "label": "", "ending": "magic", "message": "", "final": true, "passing": false, "solver": '
        b'"this", "where": "", "ended": "", "trace": ""}',
        b'{"task": "a", "label": "", "ending": "crashed", "message": 3, "final": true, "passing": false, "solver": '
        b'"this", "where": "", "ended": "", "trace": ""}',
    ],
)
def test_lines_that_no_run_wrote_are_left_out(tmp_path: Path, line: bytes) -> None:
    attempts.add(tmp_path, attempt("good"))
    with (tmp_path / FILE).open("ab") as file:
        file.write(line)  # cut short: no end of line
    attempts.add(tmp_path, attempt("next"))
    assert attempts.final(tmp_path, "this").keys() == {"good", "next"}


def test_a_file_that_cannot_be_written_is_said_and_stops_nothing(tmp_path: Path) -> None:
    (tmp_path / FILE).mkdir()
    assert "cannot be written" in attempts.add(tmp_path, attempt("a"))
    assert attempts.final(tmp_path, "this") == {}


def test_no_bit_of_an_attempt_changes_without_being_named(tmp_path: Path) -> None:
    """One that counts for another task, or another solver, would be forgotten; another word would stand in a dataset."""
    attempts.add(tmp_path, attempt("a"))
    path = tmp_path / FILE
    whole = path.read_bytes()
    for bit in range(8 * (len(whole) - 1)):
        flip(path, bit)
        assert attempts.lost(tmp_path)
        assert attempts.final(tmp_path, "this") == {}
        path.write_bytes(whole)
    assert attempts.final(tmp_path, "this") == {"a": attempt("a")}


@pytest.mark.parametrize("text", ["nonsense\n", "\n"])
def test_lines_that_are_no_attempt_are_named(tmp_path: Path, text: str) -> None:
    """What failed there counts as not tried."""
    assert attempts.lost(tmp_path) == ""
    attempts.add(tmp_path, attempt("good"))
    assert attempts.lost(tmp_path) == ""
    with (tmp_path / FILE).open("a") as file:
        file.write(text)
    assert attempts.lost(tmp_path).startswith(f"{tmp_path / FILE}: 1 line is none that a run wrote (line 2)")


@NO_FILES
def test_what_is_no_file_is_named(tmp_path: Path, no_file) -> None:
    no_file(tmp_path / FILE)
    assert attempts.lost(tmp_path).startswith(f"{tmp_path / FILE}: no regular file")
    assert attempts.final(tmp_path, "this") == {}
