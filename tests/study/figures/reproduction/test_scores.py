"""A ranking puts first what gives the paper's numbers, and misses are in standard deviations."""

import numpy as np
import pytest
import xarray as xr
from choices import CAP, NEAR, NUMBERS, Scored, independent_numbers, ranking

from tests.study.figures.shipped_small import small


def like_the_paper(support: str) -> xr.Dataset:
    """The small campaign with one support whose starts scatter closely about all of the paper's numbers."""
    data = small("figures/choices").copy(deep=True)
    noise = np.array([-1e-6, 1e-6])
    for name, half, quarter in (
        ("plateau_mean", 0.28, 0.14),
        ("slips", 1952, np.nan),
        ("releases", 44, np.nan),
        ("touches", 4, np.nan),
        ("final_displacement", 0.9e-3, 1.3e-3),
        ("fitted_static_friction", 0.282, np.nan),
        ("fitted_later_static_friction", 0.272, np.nan),
        ("fitted_kinetic_friction", 0.267, np.nan),
        ("macroscopic_slips", 2, 1),
        ("resticks", 2, 1),
    ):
        for friction, value in ((0.5, half), (0.25, quarter)):
            place = {
                "intrinsic_friction": friction,
                "support": support,
                "slip_order": "simultaneous",
                "residual_shear": 0.0,
            }
            data[name].loc[place] = value + noise
    return data


def test_the_combination_that_gives_the_paper_s_numbers_comes_first() -> None:
    for support in ("bonded", "right_side"):
        best = ranking(like_the_paper(support))[0]
        assert best.choices["support"] == support
        assert best.choices["slip_order"] == "simultaneous"
        assert best.reproduced == len(best.misses)
        assert best.score < 0.1


def test_every_combination_is_ranked_once() -> None:
    found = ranking(small("figures/choices"))
    assert len({str(each.choices) for each in found}) == len(found) == 2 * 2 * 2
    keys = [(-each.reproduced, each.score) for each in found]
    assert keys == sorted(keys)


def test_one_wild_miss_does_not_decide() -> None:
    assert Scored({}, (0.0, 1e9)).score == pytest.approx(CAP / np.sqrt(2.0))
    assert Scored({}, (NEAR, 1e9)).reproduced == 1


def test_numbers_of_the_paper_are_worth_fewer_than_they_are() -> None:
    """μ_k is the plateau's mean: one of the numbers at least says nothing new."""
    over_choices, over_starts = independent_numbers(small("figures/choices"))
    assert 1.0 <= over_choices < len(NUMBERS) - 1
    assert 1.0 <= over_starts < len(NUMBERS) - 1
