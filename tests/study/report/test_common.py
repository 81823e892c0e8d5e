"""What differs between rows stays in the table, what does not is said once; nothing is lost."""

from nanoslip.study.report.console import Table
from nanoslip.study.report.summary import plain, said_once

HEADER = ("k (N/m)", "regime", "plateau F/W", "μ_s", "μ_k", "outcome")


def test_a_column_that_never_changes_is_said_once() -> None:
    table = Table(
        HEADER,
        (
            ("1e5", "slides", "0.2739 ± 0.0003", "0.30", "–", "completed"),
            ("2e5", "slides", "0.2739 ± 0.0003", "0.31", "–", "completed"),
        ),
        1,
        frozenset({1}),
    )
    found, said = said_once(table)
    assert found == Table(
        ("k (N/m)", "μ_s", "outcome"), (("1e5", "0.30", "completed"), ("2e5", "0.31", "completed")), 1, frozenset({1})
    )
    assert said == ["In all rows: regime = slides, plateau F/W = 0.2739 ± 0.0003.", "Not known in any row: μ_k."]


def test_a_single_row_and_rows_that_differ_stay_as_they_are() -> None:
    one = Table(HEADER, (("1e5", "slides", "0.27", "0.30", "–", "completed"),))
    assert said_once(one) == (one, [])
    two = Table(("n_x", "μ_s", "outcome"), (("17", "0.3", "completed"), ("17", "–", "completed")))
    assert said_once(two) == (two, [])


def test_labels_and_endings_stay_where_they_are_alike() -> None:
    two = Table(("n_x", "drive", "events", "outcome"), (("17", "a", "5", "done"), ("17", "b", "5", "done")), 2)
    assert said_once(two) == (
        Table(("n_x", "drive", "outcome"), (("17", "a", "done"), ("17", "b", "done")), 2),
        ["In all rows: events = 5."],
    )


def test_a_large_whole_number_is_written_whole_and_others_in_their_digits() -> None:
    assert plain(199880.0, 5) == "199\N{NO-BREAK SPACE}880"
    assert [plain(value, 5) for value in (2000.0, 0.123456, 275649123.5, 1e30)] == [
        "2000",
        "0.12346",
        "2.7565e+08",
        "1e+30",
    ]
