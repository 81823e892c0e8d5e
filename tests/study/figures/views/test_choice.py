"""What is shown of many is spread over all axes, each value of an axis as often as the others."""

import itertools
from collections import Counter

import numpy as np
import pytest

from nanoslip.study.figures.view import spread

AXES = {"friction": [0.25, 0.5, 1.0], "radius": [50, 100, 200, 400], "aspect": [0.5, 1.0], "support": ["b", "r"]}
PRODUCT = [dict(zip(AXES, values, strict=True)) for values in itertools.product(*AXES.values())]


@pytest.mark.parametrize("count", [1, 6, 7, 100])
def test_along_one_axis_it_is_spread_evenly(count: int) -> None:
    found = spread([{"x": value} for value in range(count)], 6)
    assert found == sorted(set(found))
    assert len(found) == min(count, 6)
    steps = np.diff(found)
    assert count <= 6 or steps.max() - steps.min() <= 1


@pytest.mark.parametrize("most", [4, 6, 12, 24])
def test_every_value_of_every_axis_is_shown_as_often_as_the_others(most: int) -> None:
    chosen = [PRODUCT[position] for position in spread(PRODUCT, most)]
    for name, values in AXES.items():
        counts = Counter(place[name] for place in chosen)
        assert len(counts) == min(len(values), most), name
        assert max(counts.values()) - min(counts.values()) <= 1, name


def test_pairs_of_axes_are_mixed() -> None:
    """Of 12 pairs of friction and radius 8 are seen, where an even stride through all places would show 3 of them or 4."""
    chosen = [PRODUCT[position] for position in spread(PRODUCT, 12)]
    assert len({(place["friction"], place["radius"]) for place in chosen}) >= 8
    assert len({(place["aspect"], place["support"]) for place in chosen}) == 4


def test_places_without_coordinates_lie_in_their_order() -> None:
    assert spread([{}] * 9, 3) == [1, 4, 7]


def test_ten_thousand_places_take_no_time() -> None:
    many = [{"a": a, "b": b} for a in range(100) for b in range(100)]
    assert len({many[position]["a"] for position in spread(many, 24)}) == 24
