"""Where nodes slip: shares of the dataset's slips, in the contact alone."""

import numpy as np
from chain import claims_of_nodes as claims
from chain import draw_of_nodes as draw

from tests.study.figures.shipped_small import small


def test_shares_of_a_case_sum_up_to_all_and_are_in_the_middle() -> None:
    (axes,) = draw(small("figures/chain")).axes
    assert len(axes.lines) == 5
    for line in axes.lines:
        share = np.asarray(line.get_ydata(), float)
        assert abs(share.sum() - 100.0) < 1e-9
        assert share[0] == share[-1] == 0.0


def test_the_table_counts_the_same_slips() -> None:
    dataset = small("figures/chain")
    for row in claims(dataset):
        assert 0.0 < float(row.found.split()[0]) < 100.0
        assert int(row.remark.split()[0]) > 1000
