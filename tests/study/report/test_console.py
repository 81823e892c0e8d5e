"""Sentences and tables fit every width: numbers, paths and words to be typed stay whole, what is left out is named."""

import io
import pty
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import rich.console
from rich.cells import cell_len

from nanoslip.study.report import console
from nanoslip.study.report.console import (
    WIDE,
    Table,
    note,
    print_entries,
    print_error,
    print_sentences,
    print_table,
    whole,
)

PROSE = "The drives of four cases did not slip, as the spring that pulls them is too soft for the time they have. " * 2
TYPED = "nanoslip run campaigns/a question of mine.toml --recompute-foreign"
WIDTHS = (40, 60, 80, 120)
ADVICE = "the pin is pulled with F/W = 0.201 in the end, it slips at 0.298 to 0.331: raise the drive's duration or stage_velocity"
HEADER = ("μ_i", "R/L_x", "plateau F/W", "μ_s", "μ_k", "peak F/W", "K/(G·L_y)", "events", "outcome")
ENDINGS = (
    "completed",
    "completed [few_nodes, near_ends]",
    f"no_slip [few_nodes]: {ADVICE}",
    "2 completed; 1 no_slip: stop",
)
Printed = Callable[..., list[str]]


@pytest.fixture
def printed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Printed:
    """The lines that a call prints on a terminal so wide, or in a pipe."""

    def lines(width: int | None, call: Callable[..., None], *given: Any) -> list[str]:
        monkeypatch.delenv("COLUMNS", raising=False)
        if width:
            monkeypatch.setenv("COLUMNS", str(width))
        call(*given)
        return "".join(capsys.readouterr()).splitlines()

    return lines


def test_a_terminal_of_no_size_is_as_wide_as_a_file(monkeypatch: pytest.MonkeyPatch) -> None:
    """Open MPI gives its ranks such terminals, and writes what they print to a log."""
    monkeypatch.delenv("COLUMNS", raising=False)
    launcher, rank = pty.openpty()
    with open(launcher, "rb", 0) as log, open(rank, "w") as terminal:
        monkeypatch.setattr(sys, "stderr", terminal)
        console.print_sentences(["word " * 60], stderr=True)
        assert log.read(4096).strip() == b" ".join([b"word"] * 60)


@pytest.mark.parametrize("stderr", [False, True])
def test_a_sentence_is_as_wide_as_columns_says_and_one_line_without(printed: Printed, stderr: bool) -> None:
    lines = printed(60, note, PROSE, stderr)
    assert 50 < max(map(cell_len, lines)) <= 60
    assert " ".join(line.strip() for line in lines) == PROSE.strip()
    assert printed(None, note, PROSE, stderr) == [PROSE.strip()]


@pytest.mark.parametrize("width", [30, 60, 80, 120])
@pytest.mark.parametrize("typed", [TYPED, "nanoslip collect"])
def test_what_is_to_be_typed_is_on_one_line(printed: Printed, width: int, typed: str) -> None:
    lines = printed(width, note, f"{PROSE}; {whole(typed) if typed == TYPED else typed} computes them again")
    assert any(typed in line for line in lines)


def test_each_problem_of_an_error_begins_a_line(printed: Printed) -> None:
    lines = printed(60, print_error, f"a.toml: {PROSE}\nb.toml: {PROSE}")
    assert [line[:7] for line in lines if not line.startswith("    ")] == ["Error: ", "b.toml:"]
    assert max(map(cell_len, lines)) <= 60


@pytest.mark.parametrize(
    ("terminal", "patience", "shown"), [(True, 0.0, True), (True, 60.0, False), (False, 0.0, False)]
)
def test_a_terminal_shows_how_far_it_is_where_that_takes_long_and_nobody_else_does(
    monkeypatch: pytest.MonkeyPatch, terminal: bool, patience: float, shown: bool
) -> None:
    screen = io.StringIO()
    out = rich.console.Console(file=screen, force_terminal=terminal, width=80)
    monkeypatch.setattr(console, "console", lambda stderr: out)
    monkeypatch.setattr(console, "PATIENCE", patience)
    with console.counting("{} cases planned") as heard:
        for number in range(1, 2501):
            heard(number)
    assert ("2500 cases planned" in screen.getvalue()) == shown == bool(screen.getvalue())


def cases(seed: int = 0) -> Table:
    """Twenty cases as `scalar_table` shows them, each number different from all others."""
    draw = np.random.default_rng(seed)
    rows = [
        (
            f"{draw.random():.2g}",
            str(draw.integers(1, 10**6)),
            *(f"{draw.random():.4g} ± {draw.random() / 100:.1g}" for _ in range(3)),
            f"{draw.random():.5g}",
            "–",
            str(draw.integers(10**5)),
            ENDINGS[number % len(ENDINGS)],
        )
        for number in range(20)
    ]
    return Table(HEADER, tuple(rows), 2, frozenset({2}))


def texts(table: Table, width: int) -> list[str]:
    """The lines of a table: none is wider."""
    out = rich.console.Console(file=io.StringIO(), width=width)
    with out.capture() as found:
        out.print(table, soft_wrap=True)
    lines = [line.rstrip() for line in found.get().splitlines()]
    assert max(map(cell_len, lines)) <= width
    return lines


@pytest.mark.parametrize("width", WIDTHS)
def test_numbers_of_shown_columns_are_whole_and_columns_left_out_are_named(width: int) -> None:
    lines, table = texts(cases(), width), cases()
    said = "\n".join(lines)
    named = " ".join(" ".join(lines).partition("not shown, for lack of width:")[2].split())
    gone = [title for title in HEADER if title in named]
    assert gone == list(HEADER[8 - len(gone) : 8])  # from the right, never the last
    variables = replace(table, names=HEADER[2:-1])
    assert variables.shown_names(width) == HEADER[2 : 8 - len(gone)]
    for row in table.rows:
        (line,) = (line for line in lines if line.split()[:2] == list(row[:2]))
        for title, cell in zip(HEADER[2:-1], row[2:-1], strict=True):
            assert cell in line if title not in gone else cell in ("–", "0") or cell not in said
        assert row[-1].split()[0].rstrip(":") in line.split()


def test_outcomes_that_count_members_are_words_and_no_wider_than_the_terminal() -> None:
    """Where every member count begins a cell the column was taken for numbers, and its header stood at the end of the longest."""
    endings = ["9000 completed; 500 no_plateau; 300 steep_pin; 200 no_slip", "6000 completed; 4000 no_plateau"]
    lines = texts(Table(("μ_i", "outcome"), tuple((f"0.{number}", each) for number, each in enumerate(endings))), 40)
    assert lines[0].split() == ["μ_i", "outcome"]
    assert lines[0].index("outcome") == lines[2].index("9000")


def test_a_wider_table_shows_no_less_and_in_the_end_all() -> None:
    gone = []
    for width in (40, 60, 70, 80, 90, 100, 120, 160):
        said = " ".join(" ".join(texts(cases(), width)).partition("not shown")[2].split())
        gone.append(sum(title in said for title in HEADER))
    assert gone == sorted(gone, reverse=True)
    assert gone[0] > 3
    assert not any("not shown" in line for line in texts(cases(), 200))


def test_labels_that_are_too_wide_become_lines_with_their_titles() -> None:
    row = ("plateau" * 7, "0.28 ± 0.01", "0.2618 ± 0.0003", "")
    lines = texts(Table(("claim", "paper", "found", "remark"), (row,), 3), 60)
    assert "    paper: 0.28 ± 0.01" in lines
    assert "    found: 0.2618 ± 0.0003" in lines
    assert not any("remark" in text for text in lines)


def test_cells_are_folded_between_words_before_a_table_becomes_lines() -> None:
    """A number stays with its ±, a size with its unit; the sentence stands below."""
    row = ("200 (200 mm)", "0.1838 ± 0.0003 (0.166 + 0.0174)", "completed")
    lines = texts(Table(("R/L_x", "μ_s", "outcome"), (row, row), 1, asked=1), 29)
    assert lines[2:5] == ["     200   0.1838 ± 0.0003", "(200 mm)  (0.166 + 0.0174)", "    completed"]


def test_a_table_without_rows_is_its_header() -> None:
    assert texts(Table(("case", "outcome"), ()), 80) == ["case  outcome", "─" * 13]


@pytest.mark.parametrize("width", [None, *WIDTHS])
def test_a_pipe_is_as_wide_as_columns_says_and_has_no_colours(printed: Printed, width: int | None) -> None:
    lines = printed(width, print_table, cases()) + printed(width, print_sentences, [ADVICE * 3])
    assert console.console().width == (width or WIDE)
    assert width is None or 0.9 * width < max(map(cell_len, lines)) <= width
    assert not any("\x1b" in line for line in lines)


def test_a_terminal_sees_a_row_that_failed_in_colour(monkeypatch: pytest.MonkeyPatch, printed: Printed) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    lines = printed(None, print_table, cases())
    red = [line for line in lines if "\x1b[31m" in line]
    assert "no_slip" in red[0]
    assert not any("completed" in line for line in red)
    assert lines.count(red[0]) == 1


def test_requested_columns_that_are_too_wide_together_are_tables_below_each_other() -> None:
    """Of 32 rows with four numbers every cell had a line: 349 lines."""
    numbers = tuple(f"0.{place}2345 ± 0.00012" for place in range(4))
    rows = tuple((f"{number}.25", "slow", *numbers, "completed") for number in range(32))
    table = Table(("μ_i", "drive", "μ_s", "μ_k", "V_c", "k_c", "outcome"), rows, 2, asked=4)
    lines = texts(table, 60)
    assert len(lines) < 4 * len(rows)
    assert all(sum(number in line for line in lines) == len(rows) for number in numbers)
    assert sum("completed" in line for line in lines) == len(rows)


def test_a_title_folds_between_its_words_no_narrower_than_its_numbers_and_never_inside_a_name() -> None:
    """n_x is one word; what fits above numbers as wide stays on one line."""
    row = ("65", "0.2739 ± 0.0003", "0.0025", "ok")
    lines = texts(Table(("n_x", "plateau F/W", "scatter of μ_s", "outcome"), (row,)), 41)
    assert lines[:3] == [" " * 22 + "scatter", "n_x      plateau F/W   of μ_s  outcome", "─" * 38]


@pytest.mark.parametrize(("width", "place"), [(80, 28), (44, 28), (40, 4)])
def test_a_sentence_is_wrapped_in_its_column_and_stands_below_its_row_where_that_is_narrow(
    width: int, place: int
) -> None:
    meaning = "length of the plateau, in node spacings"
    rows = (("plateau_spacings", "0.386843", meaning), ("events", "2000", "events of the record"))
    header, _, *lines = texts(Table(("quantity", "value", "meaning"), rows, 2), width)
    assert header.split() == ["quantity", "value", *(["meaning"] if place == 28 else [])]
    assert " ".join(" ".join(lines).split()) == f"plateau_spacings 0.386843 {meaning} events 2000 events of the record"
    assert all(line.startswith(" " * place) for line in lines if line.startswith(" "))


def test_outcomes_stand_below_their_rows_before_what_was_asked_for_is_left_out() -> None:
    rows = tuple((*("label" * 2 for _ in range(3)), f"{number}.5 ± 0.1", "7.25", "completed") for number in range(3))
    table = Table(("one", "two", "three", "μ_s", "events", "outcome"), rows, 3, asked=1)
    lines = texts(table, 47)
    assert lines[2:4] == ["  ".join(rows[0][:4]), "    completed"]
    assert "    μ_s: 1.5 ± 0.1" in texts(table, 40)
    assert texts(table, 60)[-1] == "not shown, for lack of width: events"
    assert texts(table, 120)[0].split() == list(table.header)


def test_no_text_that_is_printed_is_obeyed_by_a_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    hostile = "a\u202eb\x1b[31m\ud800 ±"
    print_table(Table((hostile, hostile), ((hostile, hostile),)))
    print_sentences([hostile])
    print_entries({"key": hostile})
    shown = capsys.readouterr().out
    assert all(line.isprintable() for line in shown.splitlines())
    assert shown.count("a\\u202eb\\x1b[31m\\ud800 ±") == 6
