"""Sentences are as wide as the terminal; paths, and words to be typed, stay whole; a program reads one line each."""

import io

import pytest
import rich.console
from rich.cells import cell_len

from nanoslip.study.report import console
from nanoslip.study.report.console import print_entries, print_error, say, whole

PROSE = "The drives of four cases did not slip, as the spring that pulls them is too soft for the time they have. " * 2
TYPED = "nanoslip run campaigns/a question of mine.toml --recompute-foreign"


@pytest.mark.parametrize("stderr", [False, True])
def test_a_sentence_is_as_wide_as_columns_says_and_one_line_without(
    stderr: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    say(PROSE, stderr)
    lines = capsys.readouterr()[stderr].splitlines()
    assert 50 < max(map(cell_len, lines)) <= 60
    assert " ".join(line.strip() for line in lines) == PROSE.strip()
    monkeypatch.delenv("COLUMNS")
    say(PROSE, stderr)
    assert capsys.readouterr()[stderr] == PROSE.strip() + "\n"


def test_what_is_to_be_typed_is_on_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for width in (30, 60, 80, 120):
        monkeypatch.setenv("COLUMNS", str(width))
        say(f"{PROSE}; {whole(TYPED)} computes them again")
        assert any(TYPED in line for line in capsys.readouterr().out.splitlines())
        say(f"{PROSE}; nanoslip collect does it again")
        assert any("nanoslip collect" in line for line in capsys.readouterr().out.splitlines())


def test_each_problem_of_an_error_begins_a_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    print_error(f"a.toml: {PROSE}\nb.toml: {PROSE}")
    lines = capsys.readouterr().err.splitlines()
    assert [line[:7] for line in lines if not line.startswith("    ")] == ["Error: ", "b.toml:"]
    assert max(map(cell_len, lines)) <= 60


def test_what_names_stand_for_is_in_one_column(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    print_entries({"sweep": PROSE, "friction_map": "short"})
    *lines, last = capsys.readouterr().out.splitlines()
    assert last == "friction_map  short"
    assert lines[0].startswith("sweep" + " " * 9 + "The")
    assert all(line.startswith(" " * 14) for line in lines[1:])


def shown_while_counting(monkeypatch: pytest.MonkeyPatch, terminal: bool, patience: float) -> str:
    """What stands on standard error after 2500 things."""
    screen = io.StringIO()
    out = rich.console.Console(file=screen, force_terminal=terminal, width=80)
    monkeypatch.setattr(console, "console", lambda stderr: out)
    monkeypatch.setattr(console, "PATIENCE", patience)
    with console.counting("{} cases planned") as heard:
        for number in range(1, 2501):
            heard(number)
    return screen.getvalue()


def test_a_terminal_shows_how_far_it_is_where_that_takes_long(monkeypatch: pytest.MonkeyPatch) -> None:
    assert "2500 cases planned" in shown_while_counting(monkeypatch, terminal=True, patience=0.0)


@pytest.mark.parametrize(("terminal", "patience"), [(True, 60.0), (False, 0.0)])
def test_no_count_is_shown_where_it_is_quick_or_nobody_looks(
    monkeypatch: pytest.MonkeyPatch, terminal: bool, patience: float
) -> None:
    assert shown_while_counting(monkeypatch, terminal, patience) == ""
