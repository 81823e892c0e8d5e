"""Tables fit every width: numbers stay whole, what is left out is named, an outcome stays beside its case."""

import re

import numpy as np
import pytest
from rich.cells import cell_len

from nanoslip.study.report.console import (
    LEAST_ROOM,
    WIDE,
    Table,
    console,
    print_sentences,
    print_table,
    table_lines,
    wrapped,
)

WIDTHS = (40, 60, 80, 120)
ADVICE = "the pin is pulled with F/W = 0.201 in the end, it slips at 0.298 to 0.331: raise the drive's duration or stage_velocity"
HEADER = ("μ_i", "R/L_x", "plateau F/W", "μ_s", "μ_k", "peak F/W", "K/(G·L_y)", "events", "outcome")
ENDINGS = (
    "completed",
    "completed [few_nodes, near_ends]",
    f"no_slip [few_nodes]: {ADVICE}",
    "2 completed; 1 no_slip: stop",
)


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


@pytest.mark.parametrize("width", WIDTHS)
def test_numbers_of_shown_columns_are_whole_and_columns_left_out_are_named(width: int) -> None:
    table = cases()
    lines = [line.text for line in table_lines(table, width)]
    said = "\n".join(lines)
    named = " ".join(lines).partition("not shown, for lack of width:")[2]
    gone = [title for title in HEADER if title in " ".join(named.split())]
    assert gone == list(HEADER[8 - len(gone) : 8])  # from the right, never the last
    for row in table.rows:
        (line,) = (line for line in lines if line.split()[:2] == list(row[:2]))
        for title, cell in zip(HEADER[2:-1], row[2:-1], strict=True):
            assert cell in line if title not in gone else cell in ("–", "0") or cell not in said
        assert row[-1].split()[0].rstrip(":") in line.split()
    assert all(cell_len(line) <= width for line in lines)


def test_outcomes_that_count_members_are_words_and_no_wider_than_the_terminal() -> None:
    """Where every member count begins a cell the column was taken for numbers, and its header stood at the end of the longest."""
    endings = ["9000 completed; 500 no_plateau; 300 steep_pin; 200 no_slip", "6000 completed; 4000 no_plateau"]
    table = Table(("μ_i", "outcome"), tuple((f"0.{number}", each) for number, each in enumerate(endings)))
    lines = [line.text for line in table_lines(table, 40)]
    assert max(map(cell_len, lines)) <= 40
    assert lines[0].split() == ["μ_i", "outcome"]
    assert lines[0].index("outcome") == lines[2].index("9000")


def test_a_wider_table_shows_no_less_and_in_the_end_all() -> None:
    gone = []
    for width in range(40, 200):
        said = " ".join(line.text for line in table_lines(cases(), width)).partition("not shown")[2]
        gone.append(sum(title in " ".join(said.split()) for title in HEADER))
    assert gone == sorted(gone, reverse=True)
    assert gone[0] > 3
    assert not any("not shown" in line.text for line in table_lines(cases(), 200))


@pytest.mark.parametrize("width", WIDTHS)
def test_a_message_stands_whole_below_its_row(width: int) -> None:
    texts = [line.text for line in table_lines(cases(), width)]
    start = next(number for number, text in enumerate(texts) if "no_slip" in text)
    below = []
    for text in texts[start + 1 :]:
        if not text.startswith("    "):
            break
        below.append(text.strip())
    assert " ".join(below).endswith(ADVICE)


def test_failed_rows_and_their_messages_are_marked_and_no_others() -> None:
    marked = [line.text for line in table_lines(cases(), 80) if line.sort == "failed"]
    assert "no_slip" in marked[0]
    assert " ".join(" ".join(marked[1:]).split()).endswith(ADVICE)
    assert sum(line.sort == "header" for line in table_lines(cases(), 200)) == 2


def test_labels_that_are_too_wide_become_lines_with_their_titles() -> None:
    table = Table(("claim", "paper", "found", "remark"), (("plateau " * 9, "0.28 ± 0.01", "0.2618 ± 0.0003", ""),), 3)
    texts = [line.text for line in table_lines(table, 60)]
    assert "    paper: 0.28 ± 0.01" in texts
    assert "    found: 0.2618 ± 0.0003" in texts
    assert not any("remark" in text for text in texts)
    assert all(cell_len(text) <= 60 for text in texts)


def test_a_table_without_rows_is_its_header() -> None:
    assert [line.text for line in table_lines(Table(("case", "outcome"), ()), 80)] == ["case  outcome", "─" * 13]


def test_sentences_break_between_words_and_never_inside_a_number() -> None:
    lines = wrapped("first μ_i = 0.25, 0.3240 ± 0.008 of W " * 4, 20, first="")
    assert all(cell_len(line) <= 20 for line in lines)
    assert sum(bool(re.search(r"μ_i = 0\.25", line)) for line in lines) == 4
    assert sum("0.3240 ± 0.008" in line for line in lines) == 4


def test_a_pipe_is_as_wide_as_columns_says(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    assert console().width == WIDE
    for width in WIDTHS:
        monkeypatch.setenv("COLUMNS", str(width))
        assert console().width == width
        print_table(cases())
        print_sentences([ADVICE * 3])
        lines = capsys.readouterr().out.splitlines()
        assert 0.9 * width < max(map(cell_len, lines)) <= width


def test_only_a_terminal_sees_colours(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    print_table(cases())
    assert "\x1b" not in capsys.readouterr().out
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    print_table(cases())
    assert "\x1b[31m" in capsys.readouterr().out


def test_a_title_folds_between_its_words_no_narrower_than_its_numbers_and_never_inside_a_name() -> None:
    """n_x is one word; what fits above numbers as wide stays on one line."""
    row = ("65", "0.2739 ± 0.0003", "0.0025", "ok")
    table = Table(("n_x", "plateau F/W", "scatter of μ_s", "outcome"), (row,))
    lines = [line.text for line in table_lines(table, 41)]
    assert lines[:3] == [
        "                      scatter",
        "n_x      plateau F/W   of μ_s  outcome",
        "─" * 38,
    ]


@pytest.mark.parametrize("width", [50, 60, 80])
def test_prose_is_folded_in_its_column_and_below_its_row_where_that_is_narrow(width: int) -> None:
    meaning = "length of the plateau, in node spacings"
    rows = (("plateau_spacings", "0.386843", meaning), ("events", "2000", "events of the record"))
    header, _, *lines = (
        line.text for line in table_lines(Table(("quantity", "value", "meaning"), rows, 2, prose=True), width)
    )
    column = header.index("meaning")
    assert all(cell_len(line) <= width for line in lines)
    assert " ".join(" ".join(lines).split()).startswith(f"plateau_spacings 0.386843 {meaning} events 2000")
    indent = column if width - column >= LEAST_ROOM else 4
    assert all(line.startswith(" " * indent) for line in lines if line.startswith(" ") and len(line.split()) < 6)


def test_a_sentence_that_begins_like_infinity_is_no_number() -> None:
    rows = (("a", "influence not known"), ("b", "matters"))
    lines = [line.text for line in table_lines(Table(("effect", "why"), rows, prose=True), 40)]
    assert len({line.index(cell[1][:3]) for line, cell in zip(lines[2:], rows, strict=True)}) == 1


@pytest.mark.parametrize("width", [46, 50])
def test_rows_are_numbered_before_what_was_asked_for_is_left_out(width: int) -> None:
    """Three long labels leave no room for a number: they stand in a table above, row for row."""
    rows = tuple((*("label" * 2 for _ in range(3)), f"{number}.5 ± 0.1", "7.25", "completed") for number in range(3))
    table = Table(("one", "two", "three", "μ_s", "events", "outcome"), rows, 3, asked=1)
    lines = [line.text for line in table_lines(table, width)]
    assert "not shown" not in " ".join(lines)
    assert sum(line.split()[:2] == ["2", "label" * 2] for line in lines) == 1
    assert sum(line.split() == ["2", "1.5", "±", "0.1", "7.25", "completed"] for line in lines) == 1
    assert all(cell_len(line) <= width for line in lines)
    whole = [line.text for line in table_lines(table, 120)]
    assert whole[0].split() == list(table.header)
