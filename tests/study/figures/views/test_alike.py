"""A number that differs has a figure; one that does not is said in a sentence, with the cases that have it."""

import numpy as np

from nanoslip.study.figures.points import points_of
from nanoslip.study.figures.view import differs, in_words
from tests.study.figures.cases import product

NAN = np.nan


def said(values: list[float]) -> tuple[bool, list[str]]:
    """Whether the plateaus of some radii differ, and what is said of them where they do not."""
    radii = [float(number) for number in range(1, len(values) + 1)]
    table = dict(zip(radii, values, strict=True))
    data = product(lambda radius: np.vectorize(table.get)(radius).astype(float), radius=radii)
    points = points_of(data, "plateau_mean")
    return differs(points), list(in_words([points]))


def test_what_differs_is_drawn() -> None:
    assert said([0.1, 0.2, 0.2])[0]
    assert not said([0.1, 0.1, NAN])[0]
    assert not said([0.1, 0.1 + 1e-12])[0]


def test_what_does_not_differ_is_said_with_the_cases_that_have_it() -> None:
    assert said([0.25]) == (False, ["F/W on the plateau: 0.250 ± 0.003."])
    assert said([0.25, 0.25])[1] == ["F/W on the plateau: 0.250 ± 0.003 in all cases."]
    assert said([0.25, NAN, 0.25])[1] == ["F/W on the plateau: 0.250 ± 0.003 in all cases that have it, 2 of 3."]
    assert said([NAN, 0.25, NAN])[1] == [
        "F/W on the plateau: 0.250 ± 0.003 at R/L_x = 2, the only one of 3 that has it."
    ]


def test_values_to_be_taken_with_care_are_said_to_be() -> None:
    """A contact of one node is as wide from every start: ± 0 says nothing of its grid, the flag does."""
    data = product(lambda radius: np.where(radius < 3.0, 0.25, NAN), radius=[1.0, 2.0, 3.0])
    for flags, care in (
        ([0, 0, 1], ""),
        ([1, 0, 1], "; 1 of them to be taken with care"),
        ([1, 1, 0], "; to be taken with care"),
    ):
        data["validity_flags"].values[:] = flags
        (text,) = in_words([points_of(data, "plateau_mean")])
        assert text == f"F/W on the plateau: 0.250 ± 0.003 in all cases that have it, 2 of 3{care}."


def test_what_no_case_has_is_named_together() -> None:
    data = product(lambda radius: NAN * radius, radius=[1.0, 2.0])
    data["peak_friction"] = data.plateau_mean
    points = [points_of(data, name) for name in ("plateau_mean", "peak_friction", "outcome")]
    assert not any(map(differs, points))
    assert list(in_words(points)) == [
        "How the case ended: no-plateau in all cases.",
        "Not known of any case: F/W on the plateau, largest F/W of the record.",
    ]
