"""Two datasets side by side: what counts as the same, which cases meet, which numbers agree, and which facts differ."""

import math

import numpy as np
import pytest
import xarray as xr

from nanoslip.solver.view import ROUNDING
from nanoslip.study.dataset.agreement import Verdict, are_identical, compare_values, find_verdict
from nanoslip.study.dataset.compare import (
    Matched,
    NotComparableError,
    differing,
    list_unjudged,
    match_rows,
    uncertain_numbers,
)

NAN = float("nan")
VALUES = np.array([1.0, -2.0, NAN, np.inf, 0.0])


def test_equal_values_have_the_same_bits_and_nan_is_nan():
    assert compare_values("x", VALUES, VALUES.copy()).verdict is Verdict.IDENTICAL
    assert are_identical(np.array(-np.nan), np.array(np.nan))
    assert are_identical(np.array(["a"], object), np.array(["a"], object))
    assert compare_values("none", np.array([]), np.array([])).verdict is Verdict.IDENTICAL


@pytest.mark.parametrize(
    ("place", "value", "verdict"),
    [
        *(
            (place, value, Verdict.ROUNDING)
            for place, value in ((0, np.nextafter(1.0, 2.0)), (4, -0.0), (1, -2.0 - 1.8 * ROUNDING))
        ),
        *((0, value, Verdict.DIFFERENT) for value in (1.0 + 2.1 * ROUNDING, NAN, np.inf)),
        *((place, value, Verdict.DIFFERENT) for place, value in ((2, 1.0), (3, -np.inf), (3, 1.0), (4, 1e-8))),
    ],
)
def test_rounding_is_named_and_more_is_different_and_named(place, value, verdict):
    changed = VALUES.copy()
    changed[place] = value
    found = compare_values("x", VALUES, changed)
    assert found.verdict is verdict
    assert verdict is Verdict.DIFFERENT or found.size <= ROUNDING
    assert str(found).startswith("x")


@pytest.mark.parametrize(
    ("kept", "again", "scale", "verdict"),
    [
        (np.array([1, 2]), np.array([1, 3]), None, Verdict.DIFFERENT),
        (np.array(10**15), np.array(10**15 + 1), None, Verdict.DIFFERENT),
        (np.array(["completed"], object), np.array(["crashed"], object), None, Verdict.DIFFERENT),
        (np.array([1.0]), np.array([1.0, 2.0]), None, Verdict.DIFFERENT),
        (np.array([1.0]), np.array(["a"], object), None, Verdict.DIFFERENT),
        (np.array([1e-12]), np.array([2e-12]), None, Verdict.DIFFERENT),
        (np.array([1e-12]), np.array([2e-12]), 1.0, Verdict.ROUNDING),
        (np.array([1e-12]), np.array([0.0]), None, Verdict.DIFFERENT),
    ],
)
def test_whole_numbers_texts_and_shapes_have_no_rounding_and_the_scale_is_the_variables(kept, again, scale, verdict):
    assert compare_values("x", kept, again, **({} if scale is None else {"scale": scale})).verdict is verdict


@pytest.mark.parametrize(
    ("errors", "verdict"),
    [
        (([0.1, 0.1], [0.0, 0.0]), Verdict.WITHIN),
        (([0.1, 0.01], [0.0, 0.0]), Verdict.DIFFERENT),
        (([0.1, NAN], [0.0, 0.0]), Verdict.NOT_JUDGED),
        (([NAN, 0.01], [NAN, 0.0]), Verdict.DIFFERENT),
    ],
)
def test_of_several_numbers_the_worst_decides_and_an_unknown_uncertainty_judges_nothing(errors, verdict):
    one, other = np.array([1.0, 2.0]), np.array([1.1, 2.1])
    assert find_verdict(one, other, 2.0, (np.array(errors[0]), np.array(errors[1])), 2.0) == (
        verdict,
        pytest.approx(0.05),
    )


def cases(radius: list[float], load: list[float] | float = 1e-3, outcome: str = "completed") -> xr.Dataset:
    """A dataset of cases over radius, and load where it is a list."""
    dims = ("radius", "normal_load")[: 1 + isinstance(load, list)]
    shape = (len(radius), np.size(load))[: len(dims)]
    return xr.Dataset(
        {"outcome": (dims, np.full(shape, outcome, dtype=object))},
        {"radius": radius, "normal_load": load, "case_id": (dims, np.full(shape, "x"))},
    )


LISTED = xr.Dataset(
    {"outcome": ("case", np.array(["completed"] * 2, dtype=object))},
    {"case": [0, 1], "radius": ("case", [100.0, 50.0]), "normal_load": ("case", [2e-3, 1e-3])},
)


def places_of(found: Matched) -> tuple[tuple[int, int], ...]:
    """Positions of the shared rows in either dataset."""
    return tuple(zip(*(rows.numbers.tolist() for rows in found.both), strict=True))


@pytest.mark.parametrize(
    ("one", "other", "axes", "rows", "only"),
    [
        (cases([50.0, 100.0, 200.0]), cases([200.0, 50.0]), ("radius",), ((0, 1), (2, 0)), (({"radius": 100.0},), ())),
        (cases([50.0], [1e-3, 2e-3]), cases([50.0], 2e-3), ("normal_load",), ((1, 0),), (({"normal_load": 1e-3},), ())),
        (cases([50.0], 1e-3), cases([50.0], 2e-3), (), ((0, 0),), ((), ())),
    ],
    ids=["of the same axes, whatever their order", "an axis and a constant", "a constant that differs is no axis"],
)
def test_cases_meet_by_the_parameters_that_vary_in_either_dataset(one, other, axes, rows, only) -> None:
    found = match_rows((one, other), "")
    assert (places_of(found), found.only) == (rows, only)
    coordinates = [{name: one[name].values[place[0]] for name in axes} for place in rows]
    assert list(found.labels) == coordinates


def test_lists_of_cases_meet_products_and_cases_that_nothing_tells_apart_are_refused() -> None:
    assert places_of(match_rows((cases([50.0, 100.0], [1e-3, 2e-3]), LISTED), "")) == ((0, 1), (3, 0))
    twice = cases([50.0, 60.0]).drop_vars("radius").rename(radius="case")
    with pytest.raises(NotComparableError, match="any parameter"):
        match_rows((twice, twice), "")


@pytest.mark.parametrize("outcome", ["pending", "timed_out", "out_of_memory", "crashed", "needs_failed"])
def test_what_is_not_computed_in_either_is_counted_and_left_out(outcome: str) -> None:
    found = match_rows((cases([50.0]), cases([50.0], outcome=outcome)), "")
    assert (places_of(found), found.pending, found.only) == ((), 1, ((), ()))


def numbers(
    plateau: float, error: float, outcome: str = "completed", events: float = 9.0, used: int | None = None
) -> xr.Dataset:
    """One case; used: how many members have been joined to it."""
    found = xr.Dataset(
        {
            "plateau_mean": ("radius", [plateau]),
            "plateau_mean_uncertainty": ("radius", [error]),
            "surface_stiffness": ("radius", [0.5]),
            "events": ("radius", [events]),
            "outcome": ("radius", np.array([outcome], dtype=object)),
            "message": ("radius", np.array([f"why {events}"], dtype=object)),
        },
        {"radius": [50.0]},
    )
    return found if used is None else found.assign(members=("radius", [used]))


def judged(one: xr.Dataset, other: xr.Dataset) -> dict[str, tuple[Verdict, float]]:
    found = match_rows((one, other), "")
    return {each.name: (each.verdict, each.apart) for each in uncertain_numbers(found)}


@pytest.mark.parametrize(
    ("values", "errors", "verdict", "apart"),
    [
        ((0.3, 0.3), (0.01, 0.02), Verdict.IDENTICAL, 0.0),
        ((0.30, 0.35), (0.03, 0.04), Verdict.WITHIN, 1.0),  # hypot(3, 4) = 5
        ((0.30, 0.399), (0.03, 0.04), Verdict.WITHIN, 1.98),
        ((0.30, 0.401), (0.03, 0.04), Verdict.DIFFERENT, 2.02),
        ((0.30, 0.31), (0.01, NAN), Verdict.WITHIN, 1.0),  # one of both is known
        ((0.30, 0.33), (0.01, NAN), Verdict.NOT_JUDGED, NAN),  # the other's may be large
        ((0.30, 0.31), (NAN, NAN), Verdict.NOT_JUDGED, NAN),
        ((0.30, 0.30 + 1e-12), (NAN, NAN), Verdict.ROUNDING, 0.0),
        ((NAN, NAN), (NAN, NAN), Verdict.IDENTICAL, 0.0),
        ((0.30, NAN), (0.01, NAN), Verdict.DIFFERENT, math.inf),
    ],
)
def test_a_number_agrees_within_two_combined_standard_deviations(values, errors, verdict, apart) -> None:
    found = judged(*(numbers(value, error) for value, error in zip(values, errors, strict=True)))["plateau_mean"]
    assert found == (verdict, pytest.approx(apart, nan_ok=True))


def test_words_agree_where_they_are_the_same_and_advice_is_not_compared() -> None:
    found = judged(numbers(0.3, 0.1), numbers(0.3, 0.1, "no_plateau", events=8.0))
    assert found["outcome"] == (Verdict.DIFFERENT, math.inf)
    assert set(found) == {"outcome", "plateau_mean"}


def pulled(sticks: int, slides: int) -> xr.Dataset:
    """One drive of an ensemble in these regimes; of a single start without counts."""
    used, word = sticks + slides, "sticks" if sticks >= slides else "slides"
    counts = {"regime_sticks_members": sticks, "regime_slides_members": slides, "members": used} if used > 1 else {}
    texts = {"drive_outcome": "completed", "regime": word}
    found = {name: ("radius", np.array([text], dtype=object)) for name, text in texts.items()}
    return xr.Dataset(found | {name: ("radius", [count]) for name, count in counts.items()}, {"radius": [50.0]})


@pytest.mark.parametrize(
    ("one", "other", "verdict"),
    [
        ((4, 0), (4, 0), Verdict.IDENTICAL),
        ((2, 1), (3, 1), Verdict.NOT_JUDGED),  # counts of samples
        ((16, 0), (15, 1), Verdict.NOT_JUDGED),
        ((3, 0), (0, 4), Verdict.NOT_JUDGED),  # by chance 2 times in 35, were both as likely
        ((4, 0), (0, 4), Verdict.DIFFERENT),  # 2 times in 70
        ((1, 0), (2, 1), Verdict.NOT_JUDGED),
        ((2, 1), (1, 0), Verdict.NOT_JUDGED),
        ((1, 0), (0, 1), Verdict.DIFFERENT),  # two single starts
    ],
)
def test_words_of_members_contradict_where_all_of_one_ensemble_differ_from_all_of_the_other(
    one, other, verdict
) -> None:
    pair = pulled(*one), pulled(*other)
    (found,) = (each for each in uncertain_numbers(match_rows(pair, "drive")) if each.name == "regime")
    apart = {Verdict.NOT_JUDGED: NAN, Verdict.IDENTICAL: 0.0, Verdict.DIFFERENT: math.inf}[verdict]
    assert (found.verdict, found.apart) == (verdict, pytest.approx(apart, nan_ok=True))


def test_a_number_that_only_one_of_two_ensembles_knows_is_not_judged_and_two_without_scatter_contradict() -> None:
    found = judged(numbers(0.3, 0.1, used=4), numbers(NAN, 0.1, used=4))["plateau_mean"]
    assert found == (Verdict.NOT_JUDGED, pytest.approx(NAN, nan_ok=True))
    assert judged(numbers(0.3, 0.0, used=2), numbers(0.4, 0.0, used=2))["plateau_mean"] == (Verdict.DIFFERENT, math.inf)


def test_a_number_is_judged_where_both_state_how_certain_it_is_and_others_are_named() -> None:
    """One peak of a record against the mean of many: what the first does not know of itself cannot be beyond."""
    one, other = numbers(0.3, 0.1), numbers(0.3, 0.1, events=8.0)
    assert list_unjudged(match_rows((one, other), "")) == (["events"], ["surface_stiffness"])
    assert list_unjudged(match_rows((one, one), "")) == ([], ["surface_stiffness", "events"])
    pair = one.drop_vars("plateau_mean_uncertainty"), numbers(0.4, 0.01)
    assert "plateau_mean" not in judged(*pair)
    assert "plateau_mean" in list_unjudged(match_rows(pair, ""))[0]


def facts(radius: list[float], manifest: str, **attributes: object) -> xr.Dataset:
    return xr.Dataset(coords={"radius": radius}, attrs={"manifest": f'title = "{radius}"\n{manifest}', **attributes})


def test_facts_that_differ_are_told_once_parameters_keys_files_scales_and_software() -> None:
    one = facts([50.0], "[outputs]\nrecords = true\n[constants]\nradius = 50\n", slab_width=1e-3, source_hash="a")
    more = {"slab_width": 2e-3, "source_hash": "b", "manifest_table": "radius\n50\n60\n"}
    found = differing((one, facts([50.0, 60.0], "[ensemble]\nmembers = 2\n", **more)))
    assert found.pop("manifest_table")[0] == "–"
    assert found == {
        "radius": ("50.0", "50.0, 60.0"),
        "outputs.records": ("true", "–"),
        "ensemble.members": ("–", "2"),
        "slab_width": ("0.001", "0.002"),
        "source_hash": ("a", "b"),
    }
    assert differing((one, one)) == {}


@pytest.mark.parametrize(
    ("name", "values", "said"),
    [
        ("friction", ([True], [True, False]), ("true", "true, false")),
        ("radius", ([0.1 + 0.2], [0.3]), ("0.30000000000000004", "0.3")),
    ],
    ids=["switches as campaigns have them", "the last digit"],
)
def test_values_that_differ_are_told_whole(name, values, said) -> None:
    assert [*differing(tuple(xr.Dataset(coords={name: each}) for each in values)).values()] == [said]
