"""Numbers agree within twice their combined standard deviations; what states none is not judged but named."""

import math

import numpy as np
import pytest
import xarray as xr

from nanoslip.study.dataset.compare import Verdict
from nanoslip.study.dataset.verify import matched, observed, unjudged

NAN = float("nan")


def made(
    plateau: float, error: float, *, outcome: str = "completed", events: float = 9.0, stiff: float = 0.5
) -> xr.Dataset:
    numbers = {
        "plateau_mean": ("radius", [plateau]),
        "plateau_mean_uncertainty": ("radius", [error]),
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


def test_words_agree_where_they_are_the_same_and_advice_is_not_compared() -> None:
    found = verdicts(made(0.3, 0.1), made(0.3, 0.1, outcome="no_plateau", events=8.0))
    assert found["outcome"] == (Verdict.DIFFERENT, math.inf)
    assert set(found) == {"outcome", "plateau_mean"}


def ensemble(outcome: str, used: int, plateau: float = 0.3) -> xr.Dataset:
    """One case whose members have been joined: words that differ between them are counted."""
    return made(plateau, 0.1, outcome=outcome).assign(members=("radius", [used]))


@pytest.mark.parametrize(
    ("one", "other", "known"),
    [
        (("completed", 4), ("completed", 4), True),
        (("2 completed; 1 no_plateau", 3), ("3 completed; 1 no_plateau", 4), False),  # counts of samples
        (("completed", 16), ("15 completed; 1 no_plateau", 16), False),
        (("completed", 3), ("no_plateau", 4), False),  # by chance 2 times in 35, were both as likely
        (("completed", 4), ("no_plateau", 4), True),  # 2 times in 70
    ],
)
def test_words_of_members_contradict_where_all_of_one_ensemble_differ_from_all_of_the_other(one, other, known) -> None:
    found = verdicts(ensemble(*one), ensemble(*other))["outcome"]
    if not known:
        assert found == (None, pytest.approx(NAN, nan_ok=True))
    elif one == other:
        assert found == (Verdict.IDENTICAL, 0.0)
    else:
        assert found == (Verdict.DIFFERENT, math.inf)


def test_words_of_one_case_and_of_an_ensemble_are_not_judged() -> None:
    assert verdicts(made(0.3, 0.1), ensemble("2 completed; 1 no_plateau", 3))["outcome"][0] is None
    assert verdicts(ensemble("2 completed; 1 no_plateau", 3), made(0.3, 0.1))["outcome"][0] is None


def test_a_number_that_only_one_of_two_ensembles_knows_is_not_judged() -> None:
    found = verdicts(ensemble("completed", 4), ensemble("completed", 4, plateau=NAN))["plateau_mean"]
    assert found == (None, pytest.approx(NAN, nan_ok=True))


def test_numbers_without_an_uncertainty_are_named() -> None:
    pair = made(0.3, 0.1), made(0.3, 0.1, events=8.0)
    assert unjudged(pair, "", matched(pair, "")) == (["events"], ["surface_stiffness"])
    assert unjudged((pair[0], pair[0]), "", matched((pair[0], pair[0]), "")) == ([], ["surface_stiffness", "events"])


def test_a_number_is_judged_where_both_state_how_certain_it_is() -> None:
    """One peak of a record against the mean of many: what the first does not know of itself cannot be beyond."""
    pair = made(0.3, 0.1), made(0.4, 0.01)
    pair = pair[0].drop_vars("plateau_mean_uncertainty"), pair[1]
    assert "plateau_mean" not in verdicts(*pair)
    assert "plateau_mean" in unjudged(pair, "", matched(pair, ""))[0]


def test_numbers_of_ensembles_that_state_no_scatter_contradict_each_other() -> None:
    pair = ensemble("completed", 2), ensemble("completed", 2, plateau=0.4)
    for each in pair:
        each["plateau_mean_uncertainty"][:] = 0.0
    assert verdicts(*pair)["plateau_mean"] == (Verdict.DIFFERENT, math.inf)
