"""The verdict counts kept and broken promises, adds up times, and says why the worst scenes are so bad."""

import math

import pytest

from study.accuracy.influence.judgement import EVERYTHING, NOTHING, PROMISED, THUMB, named
from study.accuracy.influence.picture import draw
from study.accuracy.influence.verdict import WORST, as_markdown, change, kept, ways
from study.plan.influence.omissions import OMISSIONS
from tests.study.accuracy.influence.made_up import made_up

TRIALS = (
    [made_up(seed, 0.004, ("coupling",)) for seed in range(6)]
    + [made_up(6, 0.02, ("coupling", "teeth"))]
    + [made_up(7, 0.02, ("coupling",), scatter=0.01)]
    + [made_up(8, 0.02, ("coupling",), known=False)]
    + [made_up(9, 0.0, ())]
    + [made_up(10, math.nan, ("coupling",))]
)
"""Six that keep the promise of 1 %, three that break it, one with nothing left out, one that yields nothing."""


def cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip("|").split("|")]


def rows() -> dict[str, list[str]]:
    return {cells(line)[0]: cells(line)[1:] for line in as_markdown(TRIALS).splitlines() if line.startswith("| ")}


def test_promises_are_counted_where_something_is_left_out_and_known() -> None:
    assert kept(TRIALS, named(0.01), 0.01) == (6, 9)
    assert kept(TRIALS, named(0.003), 0.003) == (0, 9)
    assert kept(TRIALS, named(0.03), 0.03) == (9, 9)


def test_every_way_has_its_row_with_counts_and_times() -> None:
    """11 scenes: 88 s with everything on, 22 s within tolerances, 11 s with everything off."""
    found = rows()
    assert set(ways()) <= set(found)
    assert found[EVERYTHING][0] == "0 of 11"
    assert found[named(0.01)][:2] == ["10 of 11", "3 of 9 (33.3%)"]
    assert found[NOTHING][0] == "11 of 11"
    assert [found[way][-2:] for way in (EVERYTHING, named(0.01), NOTHING)] == [
        ["88 s", "1.0 × cheaper"],
        ["22 s", "4.0 × cheaper"],
        ["11 s", "8.0 × cheaper"],
    ]
    assert found[THUMB][1] == ""
    assert float(found[named(0.01)][2]) == 0.004


def test_effects_are_counted_in_the_scenes_that_have_them() -> None:
    found = rows()
    for name, omission in OMISSIONS.items():
        having = [trial for trial in TRIALS if omission.there(trial.scene)]
        out = sum(name in trial.tried[named(PROMISED)].left_out for trial in having)
        assert found[name] == [str(out), str(len(having))]
    assert found["coupling"] == ["10", "11"]


def test_the_worst_scenes_come_first_each_with_its_reason() -> None:
    found = as_markdown(TRIALS).split("The worst")[1]
    listed = [cells(line) for line in found.splitlines() if line.startswith("| ") and line[2].isdigit()]
    assert [int(row[0]) for row in listed[:3]] == [6, 7, 8]
    assert len(listed) == min(WORST, 9)
    reasons = [row[-1] for row in listed]
    assert reasons[0] == "rarer than one scene in twenty"
    assert reasons[1].startswith("within two standard errors (0.01) ")
    assert reasons[2] == "not settled"
    assert set(reasons[3:]) == {"kept"}


def test_every_row_has_as_many_cells_as_its_header() -> None:
    for part in as_markdown(TRIALS).split("\n\n"):
        lines = [line for line in part.splitlines() if line.startswith("|")]
        assert len({line.count("|") for line in lines}) <= 1, part


@pytest.mark.parametrize("trials", [TRIALS[-1:], TRIALS[-2:-1]], ids=["nothing known", "nothing left out"])
def test_scenes_of_which_nothing_can_be_said_are_a_table_all_the_same(trials) -> None:
    text = as_markdown(trials)
    assert "nan" not in text.replace("nanoslip", "")
    assert math.isnan(change(TRIALS[-1], named(0.01)))
    assert all(way in text for way in ways())
    assert draw(trials).startswith(b"\x89PNG")


def test_a_judgement_begins_with_its_title() -> None:
    assert as_markdown(TRIALS).startswith("# What is left out, and what that changes\n\nWritten by ")
