"""Every variable of a dataset is explained, one or all of them."""

import pytest

from nanoslip.study.dataset.variables import rows


def test_all_variables_are_listed_with_unit_and_meaning(main):
    code, said, _ = main("describe")
    assert code == 0
    for one in rows():
        assert one.name in said
    line = next(line for line in said.splitlines() if line.split()[:1] == ["sample_velocity"])
    assert line.split(maxsplit=3)[1:3] == ["m", "s-1"]


@pytest.mark.parametrize("words", [("mean_step", "in L_x", "mean_step_uncertainty"), ("radius", "R/L_x"), ("outcome",)])
def test_one_variable_is_explained(main, words):
    code, said, _ = main("describe", words[0])
    assert code == 0
    assert all(word in said for word in words)


def test_an_unknown_variable_is_one_clear_message_with_similar_names(main):
    code, _, said = main("describe", "mean_stp")
    assert (code, len(said.splitlines())) == (2, 1)
    assert "mean_stp" in said
    assert "mean_step" in said
