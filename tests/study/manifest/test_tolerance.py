"""What may be left out stands in [effects]: a tolerance, and beside it what it holds for; all else there are effects."""

from pathlib import Path

import pytest

from study.manifest.manifest import Tolerated
from study.manifest.problems import ManifestError
from study.manifest.reader import load_manifest, parse_manifest

FILE = Path("mine.toml")


def problems(effects: str) -> tuple[str, ...]:
    with pytest.raises(ManifestError) as error:
        parse_manifest(FILE, f'title = "x"\n[effects]\n{effects}', {"influences": ""})
    assert all(line.startswith("mine.toml: ") and "\n" not in line for line in error.value.lines)
    return tuple(line.removeprefix("mine.toml: ") for line in error.value.lines)


def test_without_a_tolerance_there_is_none() -> None:
    for effects in ("", "[effects]\n", "[effects]\ncoupling = false\n"):
        assert parse_manifest(FILE, 'title = "x"\n' + effects, {}).tolerated is None


def test_a_tolerance_is_no_effect_and_effects_stay_beside_it() -> None:
    found = parse_manifest(FILE, 'title = "x"\n[effects]\nwithin = 0.02\ncoupling = false\n', {})
    assert found.tolerated == Tolerated(0.02)
    assert found.effects == {"coupling": False}


def test_all_of_it_is_read(tmp_path: Path) -> None:
    (tmp_path / "far.json").write_text("{}")
    (tmp_path / "mine.toml").write_text(
        'title = "x"\n[effects]\nwithin = 0.02\nobservables = ["plateau_mean"]\nkeep = ["coupling"]\n'
        'influences = "far.json"\n'
    )
    found = load_manifest(tmp_path / "mine.toml").tolerated
    assert found == Tolerated(0.02, ("plateau_mean",), ("coupling",), tmp_path / "far.json", "{}")


NEEDS = "needs a relative change, 0 < within < 1"


@pytest.mark.parametrize("value", ["2", "1", "1.0", "0", "0.0", "-0.1", "true", "false", '"a"', "nan", "inf", "[0.1]"])
def test_a_tolerance_is_a_share(value: str) -> None:
    (line,) = problems(f"within = {value}\n")
    assert line.startswith("effects.within = ")
    assert line.endswith(f": {NEEDS}")


@pytest.mark.parametrize("key", ["observables", "keep"])
@pytest.mark.parametrize("value", ["[]", '"plateau_mean"', "[1]", "true", '[["a"]]', "{}"])
def test_observables_and_effects_are_lists_of_words(key: str, value: str) -> None:
    (line,) = problems(f"within = 0.1\n{key} = {value}\n")
    assert line.startswith(f"effects.{key} = ")
    assert ": needs a list of " in line


@pytest.mark.parametrize("value", ["1", "true", "[]", '["a.json"]'])
def test_influences_are_a_path(value: str) -> None:
    (line,) = problems(f"within = 0.1\ninfluences = {value}\n")
    assert line.startswith("effects.influences = ")
    assert "needs the path" in line


@pytest.mark.parametrize("line", ['observables = ["plateau_mean"]', 'keep = ["coupling"]', 'influences = "a.json"'])
def test_what_a_tolerance_holds_for_needs_one(line: str) -> None:
    key = line.split(maxsplit=1)[0]
    assert problems(line) == (f"effects.{key}: needs within = 0.01, or another tolerance, beside it",)


def test_a_word_much_like_it_is_advised() -> None:
    assert problems("withing = 0.01\n") == ("effects.withing = 0.01: unknown; did you mean within?",)
    (line,) = problems("colour = 0.01\n")
    assert line.endswith("needs one of friction, coupling, pin_translation, within, observables, keep, influences")


def test_a_text_that_is_missing_is_named() -> None:
    with pytest.raises(ManifestError, match="influences: the text of its file is missing"):
        parse_manifest(FILE, 'title = "x"\n[effects]\nwithin = 0.1\ninfluences = "a.json"\n', {})


@pytest.mark.parametrize("content", ["effects = 3\n", 'effects = "all"\n', "[[effects]]\nwithin = 0.1\n"])
def test_effects_are_a_table(content: str) -> None:
    with pytest.raises(ManifestError, match="effects") as error:
        parse_manifest(FILE, f'title = "x"\n{content}', {})
    assert len(error.value.lines) == 1


def test_a_tolerance_is_no_axis() -> None:
    with pytest.raises(ManifestError, match=r"axes\.within"):
        parse_manifest(FILE, 'title = "x"\n[axes]\nwithin = [0.1, 0.2]\n', {})


def test_a_file_that_is_not_there_is_named_beside_a_wrong_tolerance(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text('title = "x"\neffects = {within = 1, influences = "nothing.json"}\n')
    with pytest.raises(ManifestError) as raised:
        load_manifest(path)
    assert ["within" in line or "nothing.json" in line for line in raised.value.lines] == [True, True]
