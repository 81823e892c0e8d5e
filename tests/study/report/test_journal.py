"""What runs took is one sentence; a table shows what differs between them, and what they have in common is said once."""

from dataclasses import replace

from nanoslip.study.report.page import MOST_RUNS, cost, run_table
from nanoslip.study.results.attempts import RUNS_FILE as FILE
from nanoslip.study.results.attempts import Run

ONE = Run(
    run="a",
    begun="2026-01-01T00:00:00+00:00",
    processes=1,
    command="nanoslip run a",
    solver="5017e2",
    processor="a processor",
    libraries={"numpy": "2.4.6"},
    ended="2026-01-01T00:01:00+00:00",
    done=4,
    failed=1,
    wall_seconds=60.0,
    core_seconds=100.0,
)
EIGHT = replace(ONE, run="b", processes=8, unit="ranks", hosts={"n1": 5, "n2": 3}, exit_code=99)
KILLED = replace(ONE, run="c", ended="", wall_seconds=0.0, core_seconds=0.0)


def test_the_cost_is_that_of_all_runs_or_unknown() -> None:
    assert cost([]).startswith("Not known")
    assert cost([KILLED]).startswith("Not known")
    assert cost([ONE, EIGHT]) == "2 min in 2 runs with up to 8 processes; 10 tasks took 3.33 min of one core."
    assert cost([ONE]) == "60 s in one run with one process; 5 tasks took 100 s of one core."
    assert cost([ONE, KILLED]).endswith("of one core. 1 more did not come to their end.")


def test_a_table_has_a_row_for_each_run_and_says_once_what_they_share() -> None:
    table, (said,) = run_table([ONE, EIGHT, KILLED])
    assert table.header == (
        "began (UTC)",
        "end",
        "took",
        "core time",
        "tasks",
        "failed",
        "processes",
        "hosts",
        "command",
    )
    assert table.rows[1] == (
        "2026-01-01 00:00:00", "interrupted", "60 s", "100 s", "4", "1", "8 ranks", "n1: 5, n2: 3", "nanoslip run a",
    )  # fmt: skip
    assert table.rows[2][2:6] == ("–",) * 4
    assert [row[1] for row in table.rows] == ["complete", "interrupted", "none: at work, or killed"]
    assert table.failed == {1, 2}
    assert said == "All: solver 5017e2; processor a processor; numpy 2.4.6."


def test_a_library_that_one_run_did_not_have_is_a_column() -> None:
    table, _ = run_table([ONE, replace(ONE, run="b", libraries={"numpy": "2.4.6", "scipy": "1.17"})])
    assert [row[table.header.index("scipy")] for row in table.rows] == ["–", "1.17"]


def test_of_many_runs_the_last_ones_are_shown_and_the_others_counted() -> None:
    table, said = run_table([replace(ONE, run=str(number), done=number) for number in range(MOST_RUNS + 5)])
    assert [row[4] for row in table.rows] == [str(number) for number in range(5, MOST_RUNS + 5)]
    assert said[-1] == f"5 earlier ones are in {FILE} beside the dataset."


def test_without_a_journal_there_is_no_row() -> None:
    assert run_table([])[0].rows == ()
