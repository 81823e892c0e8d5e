"""Measured influences: what they lead to expect, what they say nothing of, and their file."""

import json
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from solver.case import Case
from study.manifest.problems import ManifestError
from study.manifest.reader import load_manifest
from study.plan.influence.omissions import OMISSIONS, Omission
from study.plan.influence.scene import OBSERVABLES, Group, Scene
from study.plan.influence.table import ALIKE, LARGEST, LEAST, Measured, as_text, load_influences, measured_of
from study.plan.plan import make_plan
from tests.study.plan.influence.made_up import SLIGHT, text

LOAD = Group("load", "W", lambda scene: scene.case.normal_load)
RADIUS = Group("radius", "R", lambda scene: scene.case.radius)


def governed_by(*groups: Group) -> Omission:
    return replace(OMISSIONS["coupling"], groups=groups)


def at(load: float, radius: float = 1.0) -> Scene:
    return Scene(Case(normal_load=load, radius=radius))


def drawn(count: int, draw: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Scenes that are alike in all but chance: a power law of two groups, and a factor that is half or twice of it."""
    places = np.column_stack([draw.uniform(-8.0, -2.0, count), draw.uniform(0.0, 4.0, count)])
    law = -4.0 + 0.3 * (places[:, 0] + 5.0) - 0.2 * places[:, 1]
    return places, np.exp(law + 0.5 * draw.standard_normal(count))


def test_of_new_scenes_one_in_twenty_has_more_than_is_expected() -> None:
    """ALIKE + 1 scenes that are drawn alike are equally likely to have the most.

    4000 new ones in 40 sets of measured ones: one standard deviation of the share is 0.005 between sets. The nearest scenes
    are not drawn quite as the new one is, so it is given four.
    """
    draw = np.random.default_rng(11)
    more = []
    for _ in range(40):
        places, influences = drawn(150, draw)
        measured, omission = Measured(places, influences[:, None]), governed_by(LOAD, RADIUS)
        for place, influence in zip(*drawn(100, draw), strict=True):
            (expected,) = measured.expected(omission, at(*np.exp(place)))
            if not math.isnan(expected):
                more.append(influence > expected)
    assert len(more) > 3000
    assert np.mean(more) == pytest.approx(1.0 / (ALIKE + 1), abs=0.02)


def test_a_law_without_chance_is_found_again() -> None:
    places = np.random.default_rng(2).uniform(-6.0, -1.0, (50, 1))
    measured = Measured(places, 0.1 * np.exp(0.7 * places))
    for load in (0.005, 0.02, 0.3):
        assert measured.expected(governed_by(LOAD), at(load))[0] == pytest.approx(0.1 * load**0.7, rel=1e-6)


def influence_of_load(safe: int) -> Callable[[float], float]:
    """What is expected at a load where it was measured from 1e-4 to 1e-2, and is 0.1·√load."""
    places = np.linspace(math.log(1e-4), math.log(1e-2), 40)[:, None]
    measured, omission = Measured(places, 0.1 * np.exp(0.5 * places)), governed_by(replace(LOAD, safe=safe))
    return lambda load: float(measured.expected(omission, at(load))[0])


@pytest.mark.parametrize(("safe", "beyond", "unknown"), [(-1, 1e-6, 1e-1), (1, 1e-1, 1e-6)])
def test_outside_what_was_measured_nothing_is_known_but_on_the_safe_side_where_its_end_counts(
    safe: int, beyond: float, unknown: float
) -> None:
    expected = influence_of_load(safe)
    end = 1e-4 * 1.000001 if safe < 0 else 1e-2 / 1.000001
    assert expected(beyond) == pytest.approx(expected(end), rel=1e-3)
    assert math.isnan(expected(unknown))


@pytest.mark.parametrize("load", [1e-6, 1e-1])
def test_without_a_safe_side_nothing_is_known_outside(load: float) -> None:
    assert math.isnan(influence_of_load(0)(load))


def test_a_group_that_is_no_number_is_like_nothing() -> None:
    nowhere = Group("nothing", "0", lambda _: 0.0, safe=1)
    measured = Measured(np.zeros((30, 1)), np.ones((30, 1)))
    assert math.isnan(measured.expected(governed_by(nowhere), at(1e-3))[0])
    broken = replace(nowhere, of=lambda _: math.nan, logarithmic=False, safe=-1)
    assert math.isnan(measured.expected(governed_by(broken), at(1e-3))[0])


@pytest.mark.parametrize("known", [0, 1, ALIKE - 1])
def test_of_too_few_scenes_nothing_is_expected(known: int) -> None:
    influences = np.full((40, 1), math.nan)
    influences[:known] = 0.1
    measured = Measured(np.linspace(-8.0, -2.0, 40)[:, None], influences)
    assert math.isnan(measured.expected(governed_by(LOAD), at(1e-2))[0])
    assert math.isnan(Measured(np.zeros((0, 1)), np.zeros((0, 1))).expected(governed_by(LOAD), at(1e-2))[0])


def test_no_expectation_is_larger_than_the_largest_influence_nor_is_nothing_more_than_nothing() -> None:
    places = np.linspace(-8.0, -2.0, 40)[:, None]
    for influence in (0.0, LARGEST, LEAST / 10.0):
        (found,) = Measured(places, np.full((40, 1), influence)).expected(governed_by(LOAD), at(1e-2))
        assert found == pytest.approx(influence, rel=1e-9)


def test_observables_are_expected_each_for_itself() -> None:
    places = np.linspace(-8.0, -2.0, 40)[:, None]
    influences = np.column_stack([np.full(40, 0.1), np.full(40, math.nan), np.full(40, 0.3)])
    assert Measured(places, influences).expected(governed_by(LOAD), at(1e-2)).tolist() == pytest.approx(
        [0.1, math.nan, 0.3], nan_ok=True
    )


def test_a_file_gives_back_what_was_written_to_three_digits(tmp_path: Path) -> None:
    draw = np.random.default_rng(3)
    effects = {}
    for name, omission in OMISSIONS.items():
        rows = [
            (draw.normal(size=len(omission.groups)), draw.uniform(size=len(omission.observables))) for _ in range(5)
        ]
        rows[2][1][0] = math.nan
        effects[name] = measured_of(rows, omission)
    path = tmp_path / "mine.json"
    path.write_text(as_text({"scenes": "5 made-up ones: μ"}, effects), "utf-8")
    found = load_influences(path)
    assert (found.name, found.about) == ("mine.json", {"scenes": "5 made-up ones: μ"})
    for name, measured in effects.items():
        np.testing.assert_allclose(found.effects[name].places, measured.places, rtol=5e-3)
        np.testing.assert_allclose(found.effects[name].influences, measured.influences, rtol=5e-3)
    assert as_text(found.about, found.effects) == path.read_text("utf-8")


def test_an_effect_that_no_scene_had_is_kept_as_none(tmp_path: Path) -> None:
    path = tmp_path / "none.json"
    path.write_text(as_text({}, {"spread": measured_of([], OMISSIONS["spread"])}), "utf-8")
    found = load_influences(path)
    for name in ("spread", "coupling"):  # of the other, the file says nothing at all
        assert np.isnan(found.expected(OMISSIONS[name], Scene(Case()))).all()


def test_files_differ_by_their_hash() -> None:
    one, other = (load_influences(Path("a.json"), text({"coupling": change})) for change in (0.1, 0.2))
    assert str(one) != str(other)
    assert str(one).startswith("a.json, sha256 ")


def rows(effect: str, change: Callable[[list[float | None]], object]) -> str:
    found = json.loads(text(SLIGHT))
    found["effects"][effect][1] = change(found["effects"][effect][1])
    return json.dumps(found)


DAMAGED = {
    "nothing": "",
    "no JSON": "{'about'",
    "a list": "[]",
    "no effects": '{"about": {}}',
    "effects in a list": '{"about": {}, "effects": [1]}',
    "effects null": '{"about": {}, "effects": null}',
    "about numbers": '{"about": {"scenes": 3}, "effects": {}}',
    "about a text": '{"about": "me", "effects": {}}',
    "rows of text": '{"about": {}, "effects": {"coupling": "nothing"}}',
    "rows null": '{"about": {}, "effects": {"coupling": null}}',
    "an unknown effect": '{"about": {}, "effects": {"colour": []}}',
    "nested deeply": "[" * 100_000,
    "a column less": rows("coupling", lambda row: row[:-1]),
    "a row of text": rows("coupling", lambda _: "row"),
    "negative": rows("coupling", lambda row: [*row[:-1], -0.1]),
    "no group": rows("coupling", lambda row: [None, *row[1:]]),
    "an infinite group": rows("coupling", lambda row: [math.inf, *row[1:]]),
    "a group of text": rows("coupling", lambda row: ["1.0", *row[1:]]),
    "a truth": rows("coupling", lambda row: [True, *row[1:]]),
}


def refusals_of(influences: Path) -> Iterator[str]:
    """What a file of influences is refused with, from Python and through a campaign beside it."""
    campaign = influences.with_name("mine.toml")
    campaign.write_text(f'title = "x"\n[effects]\nwithin = 0.01\ninfluences = "{influences.name}"\n', "utf-8")
    for refused in (lambda: load_influences(influences), lambda: make_plan(load_manifest(campaign))):
        with pytest.raises(ManifestError) as error:
            refused()
        (line,) = error.value.lines
        assert "\n" not in line
        yield line


@pytest.mark.parametrize("content", DAMAGED.values(), ids=DAMAGED)
def test_a_damaged_file_is_one_line_that_names_it(tmp_path: Path, content: str) -> None:
    """From Python, and through a campaign."""
    path = tmp_path / "mine.json"
    path.write_text(content, "utf-8")
    for line in refusals_of(path):
        assert line.startswith(f"{path}: no influences that nanoslip effects wrote: ")


@pytest.mark.parametrize("kind", ["missing", "folder", "bytes"])
def test_what_cannot_be_read_is_one_line_that_names_it(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "mine.json"
    if kind == "folder":
        path.mkdir()
    elif kind == "bytes":
        path.write_bytes(b"\xff\xfe\x00")
    for line in refusals_of(path):
        assert str(path) in line


def test_the_shipped_influences_know_all_effects_in_scenes_enough() -> None:
    shipped = load_influences()
    assert set(shipped.effects) == set(OMISSIONS)
    assert "scenes" in shipped.about
    for name, measured in shipped.effects.items():
        assert len(measured.places) > ALIKE, name
        assert measured.influences.shape[1] == len(OMISSIONS[name].observables)
        known = measured.influences[~np.isnan(measured.influences)]
        assert (known >= 0.0).all()
        assert (known <= LARGEST).all()
    assert len(OBSERVABLES) == shipped.effects["coupling"].influences.shape[1]


def test_on_the_measured_scenes_themselves_few_influences_are_larger_than_expected() -> None:
    """Each of them is among the scenes that are most like itself, so only what the law cuts off at LARGEST can be more."""
    for name, measured in load_influences().effects.items():
        groups = tuple(
            Group(str(column), "", lambda scene, column=column: scene[column], logarithmic=False)  # type: ignore[misc]
            for column in range(measured.places.shape[1])
        )
        omission = replace(OMISSIONS[name], groups=groups)
        for place, influences in zip(measured.places, measured.influences, strict=True):
            expected = measured.expected(omission, tuple(place))  # type: ignore[arg-type]
            known = ~np.isnan(influences) & ~np.isnan(expected)
            assert (influences[known] <= expected[known] * (1.0 + 1e-9) + 1e-12).all()
