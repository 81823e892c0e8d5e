"""No damage to a file changes a number, loses a result without a word, ends in a traceback or blocks: a few of many."""

import pytest

from tests.study.results.fuzz import finished, trials


@pytest.mark.slow
def test_no_damage_goes_unnoticed_and_only_what_was_damaged_is_computed_again(tmp_path):
    for each in trials(finished(tmp_path), count=8, cuts=1, seed=2):
        assert each.defects == []
        assert each.verdicts.total() >= 8
