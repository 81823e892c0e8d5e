"""Counted texts say how many members say what; short ones lose words, and no member."""

import numpy as np
import pytest
import xarray as xr

from nanoslip.study.dataset.variables import LONGEST, commonest, counted, in_short, is_counted, joined, shortened


def test_what_all_members_say_is_not_counted() -> None:
    assert counted(["slides"] * 3) == "slides"
    assert counted(["slides", "sticks", "slides"]) == "2 slides; 1 sticks"
    assert [is_counted(text) for text in ("slides", "2 slides; 1 sticks", "0.2.0 of today")] == [False, True, False]


@pytest.mark.parametrize("members", [8, 10_000])
def test_a_shortened_text_fits_its_cell_and_counts_every_member(members: int) -> None:
    texts = ["completed", "no_plateau", "steep_pin", "no_slip"]
    whole = counted([texts[int(place**0.5) % 4] for place in range(members)])
    short = shortened(whole)
    assert len(short) <= LONGEST < len(whole)
    assert whole.startswith(short.partition(";")[0])
    assert sum(int(word) for word in short.split() if word.isdigit()) == members


def test_sentences_of_members_that_hold_semicolons_lose_none() -> None:
    sentence = "the force still rises; raise limits.events"
    short = shortened(counted([sentence] * 3 + ["needs 3; or 4"] * 2 + ["stop", "too small"]))
    assert short == f"3 {sentence}; 4 others"


@pytest.mark.parametrize(
    "text", ["slides", "3 no_plateau; 5 completed", "one; two; three and some more words than a cell"]
)
def test_other_texts_stay_as_they_are(text: str) -> None:
    assert shortened(text) == text


def test_texts_of_a_dataset_are_short_and_its_numbers_as_they_were() -> None:
    long = "13 stick_slip; 2 sticks; 1 slides"
    data = xr.Dataset({"regime": ("case", np.array([long, "slides"], dtype=object)), "events": ("case", [1.0, 2.0])})
    found = in_short(data)
    assert found["regime"].values.tolist() == ["13 stick_slip; 3 others", "slides"]
    assert data["regime"].values.tolist() == [long, "slides"]
    xr.testing.assert_identical(found["events"], data["events"])


def test_the_commonest_text_has_its_share_of_the_members_that_say_something() -> None:
    assert commonest("slides") == ("slides", 1.0)
    assert commonest(counted(["slides", "sticks", "slides", ""])) == ("slides", 2 / 3)


def test_texts_that_differ_in_numbers_alone_are_told_once_with_the_members_of_all() -> None:
    falls = [f"the force falls by {share}%; raise limits.events" for share in (2.3, 4.0, 1e-05)]
    assert joined(counted([*falls, falls[0], "no slip"])) == f"4 {falls[0]} (numbers differ); 1 no slip"
    assert joined(counted(["no slip"] * 2 + ["stop"])) == "2 no slip; 1 stop"
    assert joined("2.3% too little") == "2.3% too little"
