"""Numbers agree within twice their combined standard deviations; what states none is not judged but named."""

import math

import numpy as np
import pytest
import xarray as xr

from study.dataset.agreement.matching import matched
from study.dataset.agreement.verdicts import observed, unjudged
from study.dataset.comparison import Verdict

NAN = float("nan")


def made(
    plateau: float, error: float, *, outcome: str = "completed", events: float = 9.0, stiff: float = 0.5
) -> xr.Dataset:
    numbers = {
        "plateau_mean": ("radius", [plateau], {"ancillary_variables": "plateau_uncertainty"}),
        "plateau_uncertainty": ("radius", [error]),
        "surface_stiffness": ("radius", [stiff], {"ancillary_variables": "discretization_error"}),
        "discretization_error": ("radius", [0.01]),
        "events": ("radius", [events]),
        "outcome": ("radius", np.array([outcome], dtype=object)),
        "message": ("radius", np.array([f"why {events}"], dtype=object)),
    }
    return xr.Dataset(numbers, {"radius": [50.0]})


def verdicts(one: xr.Dataset, other: xr.Dataset) -> dict[str, tuple[Verdict | None, float]]:
    found = matched((one, other), "")
    return {each.name: (each.verdict, each.apart) for each in observed((one, other), "", found)}


@pytest.mark.parametrize(
    ("values", "errors", "verdict", "apart"),
    [
        ((0.3, 0.3), (0.01, 0.02), Verdict.IDENTICAL, 0.0),
        ((0.30, 0.35), (0.03, 0.04), Verdict.WITHIN, 1.0),  # hypot(3, 4) = 5
        ((0.30, 0.399), (0.03, 0.04), Verdict.WITHIN, 1.98),
        ((0.30, 0.401), (0.03, 0.04), Verdict.DIFFERENT, 2.02),
        ((0.30, 0.31), (0.01, NAN), Verdict.WITHIN, 1.0),  # one of both is known
        ((0.30, 0.33), (0.01, NAN), None, NAN),  # the other's may be large
        ((0.30, 0.31), (NAN, NAN), None, NAN),
        ((0.30, 0.30 + 1e-12), (NAN, NAN), Verdict.WITHIN, math.inf),  # rounding
        ((NAN, NAN), (NAN, NAN), Verdict.IDENTICAL, 0.0),
        ((0.30, NAN), (0.01, NAN), Verdict.DIFFERENT, math.inf),
    ],
)
def test_a_number_agrees_within_two_combined_standard_deviations(values, errors, verdict, apart) -> None:
    one, other = (made(value, error) for value, error in zip(values, errors, strict=True))
    found = verdicts(one, other)["plateau_mean"]
    assert found[0] is verdict
    assert found[1] == pytest.approx(apart, nan_ok=True)


def test_the_error_of_a_grid_is_a_share_of_the_number() -> None:
    found = verdicts(made(0.3, 0.1), made(0.3, 0.1, stiff=0.51))["surface_stiffness"]
    assert found == (Verdict.WITHIN, pytest.approx(0.01 / math.hypot(0.005, 0.0051)))


def test_words_agree_where_they_are_the_same_and_advice_is_not_compared() -> None:
    found = verdicts(made(0.3, 0.1), made(0.3, 0.1, outcome="no_plateau", events=8.0))
    assert found["outcome"] == (Verdict.DIFFERENT, math.inf)
    assert set(found) == {"outcome", "plateau_mean", "surface_stiffness"}


def test_numbers_without_an_uncertainty_are_named() -> None:
    pair = made(0.3, 0.1), made(0.3, 0.1, events=8.0)
    assert unjudged(pair, "", matched(pair, "")) == (["events"], [])
    assert unjudged((pair[0], pair[0]), "", matched((pair[0], pair[0]), "")) == ([], ["events"])


def test_a_number_is_judged_where_both_state_how_certain_it_is() -> None:
    """One peak of a record against the mean of many: what the first does not know of itself cannot be beyond."""
    pair = made(0.3, 0.1), made(0.4, 0.01)
    del pair[0].plateau_mean.attrs["ancillary_variables"]
    assert "plateau_mean" not in verdicts(*pair)
    assert "plateau_mean" in unjudged(pair, "", matched(pair, ""))[0]
