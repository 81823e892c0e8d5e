"""KEY=VALUE single out one case of a campaign; anything else says what there is."""

import pytest

from nanoslip.study.commands.datasets import assignments, chosen
from nanoslip.study.commands.words import Refusal
from nanoslip.study.manifest.cases import expand
from nanoslip.study.manifest.checker import ManifestError
from nanoslip.study.manifest.reader import parse_manifest
from tests.conftest import ROOT

CASES = expand(
    parse_manifest(
        ROOT / "toy.toml",
        'title = "a toy"\n[axes]\nradius = [50.0, 100.0]\nevents = [5, 10]\nslip_order = ["worst_first", "simultaneous"]\n',
        {},
    )
)


def test_a_case_is_found_by_the_words_of_its_campaign() -> None:
    found = chosen(CASES, {"events": "5", "radius": "1e2", "slip_order": "simultaneous"})
    assert (found.parameters["radius"], found.parameters["max_events"], found.parameters["slip_order"]) == (
        100.0,
        5,
        "simultaneous",
    )
    assert chosen(CASES[:1], {}) is CASES[0]


REFUSED = {
    "poisson=0.3": "poisson=0.3: these cases are told apart by intrinsic_friction, radius, aspect_ratio, n_x, events, slip_order",
    "radius=60": "radius=60: no such case; there are 50.0, 100.0",
    "radius=wide": "radius=wide: no such case",
    "radius=50": "radius=50: 4 cases are like that; say events = 5 or 10, slip_order = worst_first or simultaneous",
    "radius=50 events=7": "events=7: no such case; there are 5, 10",
}


@pytest.mark.parametrize("selection", REFUSED)
def test_anything_else_says_what_there_is(selection: str) -> None:
    with pytest.raises(ManifestError) as refused:
        chosen(CASES, assignments(selection.split()))
    assert REFUSED[selection] in str(refused.value)


def test_members_are_no_cases() -> None:
    text = 'title = "a toy"\naxes.radius = [50.0, 100.0]\nensemble.members = 8'
    cases = expand(parse_manifest(ROOT / "toy.toml", text, {}))
    assert chosen(cases, {"radius": "100"}) is cases[1]
    with pytest.raises(ManifestError, match=r"^no selection: 2 cases are like that; say radius = 50.0 or 100.0$"):
        chosen(cases, {})


def test_a_refusal_names_a_few_values_and_says_that_there_are_more() -> None:
    many = expand(parse_manifest(ROOT / "toy.toml", 'title = "a toy"\naxes.radius = [10, 20, 30, 40, 50]', {}))
    with pytest.raises(ManifestError, match=r"say radius = 10.0 or 20.0 or 30.0 or 40.0 or …$"):
        chosen(many, {})


def test_values_that_no_case_has_together_are_refused() -> None:
    zipped = [case for case in CASES if (case.parameters["radius"] == 50.0) == (case.parameters["max_events"] == 5)]
    with pytest.raises(ManifestError, match=r"^radius=50 events=10: no case is all of that$"):
        chosen(zipped, {"radius": "50", "events": "10"})


@pytest.mark.parametrize("word", ["radius", "radius=", "=50", ""])
def test_a_word_that_gives_no_key_a_value_is_refused(word: str) -> None:
    with pytest.raises(Refusal, match=rf"^{word}: needs key=value, as radius=50$"):
        assignments([word])
    with pytest.raises(Refusal, match="radius is given twice"):
        assignments(["radius=50", "radius=100"])


@pytest.mark.parametrize("word", ["true", "True"])
def test_an_effect_is_on_in_the_words_of_a_campaign_and_of_a_table(word: str) -> None:
    cases = expand(parse_manifest(ROOT / "x.toml", 'title = "x"\naxes.coupling = [false, true]\n', {}))
    assert chosen(cases, {"coupling": word}).parameters["coupling"] is True


@pytest.mark.parametrize(
    ("typed", "key"),
    [
        ("mu_i", "intrinsic_friction"),
        ("μ_i", "intrinsic_friction"),
        ("R", "radius"),
        ("R/L_x", "radius"),
        ("V_o", "stage_velocity"),
        ("events", "events"),
        ("max_events", "max_events"),
        ("nonsense", "nonsense"),
    ],
)
def test_a_parameter_may_be_given_by_the_symbol_that_heads_its_column(typed: str, key: str) -> None:
    assert assignments([f"{typed}=0.5"]) == {key: "0.5"}
