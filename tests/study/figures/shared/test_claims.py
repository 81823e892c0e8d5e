"""A claim says mean, scatter and range of starts, and whether the paper's number is among them."""

import numpy as np

from nanoslip.study.figures.shared import Claim, Stated, compared, over_starts, table

STATED = Stated("slips", 1952, "3.2.1", 0.5)


def test_over_starts_gives_mean_deviation_and_range_and_leaves_out_what_is_missing() -> None:
    assert over_starts(np.array([1.0, 3.0, np.nan]), 3) == "2.0 (s.d. 1.4, 1 to 3)"
    assert over_starts(np.array([2.0, 2.0])) == "2 from every start"
    assert over_starts(np.array([0.002]), scale=1e3) == "2"
    assert over_starts(np.array([np.nan])) == "none"


def test_a_number_is_within_the_range_or_so_many_deviations_off() -> None:
    assert compared(STATED, np.array([1900.0, 1952.4, 1940.0])).remark == "within the range of starts"
    assert compared(STATED, np.array([1900.0, 1902.0])).remark.startswith("36 standard deviations off")
    assert compared(STATED, np.array([0.0, 0.0]), "none can").remark == "differs; none can"
    assert compared(STATED, np.array([1952.0])).remark == "agrees"


def test_a_table_is_markdown_whose_bars_are_escaped() -> None:
    lines = table([Claim("|F|", "1 (§1)", "2")]).splitlines()
    assert lines[0] == "|  | paper | found | remark |"
    assert lines[2] == "| \\|F\\| | 1 (§1) | 2 |  |"
