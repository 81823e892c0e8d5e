"""How much effects matter is shown, measured or judged; what is measured is what campaigns read."""

from pathlib import Path

import pytest

from study.commands.judging import effects
from study.plan.influence.omissions import OMISSIONS
from study.plan.influence.table import load_influences
from tests.study.accuracy.influence.made_up import made_up
from tests.study.plan.influence.made_up import SLIGHT, text


def test_every_effect_is_shown_with_what_governs_it(main):
    code, said, errors = main("effects")
    assert (code, errors) == (0, "")
    assert load_influences().about["scenes"] in said
    for name, omission in OMISSIONS.items():
        assert f"\n{name} " in said
        assert omission.theory in " ".join(said.split())
        assert all(group.symbol in said for group in omission.groups)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--measure", "40", "--judge", "1"), "--measure and --judge: needs one of them at a time"),
        (("--save", "a.json"), "--save: needs --measure or --judge beside it"),
        (("--judge", "1", "--save", "a.png"), "--save a.png: needs the name of a text"),
        (("--measure", "39"), "39 is not in the range x>=40"),
        (("--judge", "0"), "0 is not in the range x>=1"),
        (("--judge", "1", "-j", "0"), "0 is not in the range x>=1"),
        (("--effect", "teeth"), "--effect: needs --measure beside it"),
        (("--measure", "40", "--effect", "tooth"), "--effect 'tooth': needs one of finite_slab, coupling"),
    ],
)
def test_options_that_exclude_each_other_are_refused(main, words, said):
    code, out, errors = main("effects", *words)
    assert (code, out) == (2, "")
    assert said in errors


@pytest.fixture
def at_once(monkeypatch):
    """Nothing is computed: influences are made up, and so are trials."""
    asked: list[tuple[int, int, tuple[str, ...]]] = []

    def measure(scenes: int, processes: int, heard, named: tuple[str, ...]) -> str:
        asked.append((scenes, processes, named))
        heard(scenes)
        return text(SLIGHT)

    monkeypatch.setattr(effects, "measure", measure)
    monkeypatch.setattr(
        effects, "spread_out", lambda _, seeds, *__: [made_up(seed, 0.004, ("teeth",)) for seed in seeds]
    )
    return asked


def test_what_is_measured_is_saved_and_read_by_campaigns(main, at_once, tmp_path):
    path = tmp_path / "deep" / "mine.json"
    code, said, _ = main("effects", "--measure", "50", "-j", "3", "--save", path)
    assert (code, at_once) == (0, [(50, 3, ())])
    assert said == f"written: {path}\n"
    assert set(load_influences(path).effects) == set(OMISSIONS)


def test_single_effects_are_measured_by_name(main, at_once):
    assert main("effects", "--measure", "40", "-j", "1", "--effect", "teeth", "--effect", "coupling")[0] == 0
    assert at_once == [(40, 1, ("teeth", "coupling"))]


def test_what_is_measured_goes_to_a_pipe(main, at_once):
    assert main("effects", "--measure", "40")[1] == text(SLIGHT)
    assert at_once


def test_a_judgement_is_a_page(main, at_once, tmp_path):
    path = tmp_path / "judged.md"
    assert main("effects", "--judge", "3", "--save", path)[0] == 0
    assert path.read_text("utf-8").startswith("# What is left out")
    assert path.with_suffix(".png").read_bytes().startswith(b"\x89PNG")
    assert main("effects", "--judge", "3")[1] == path.read_text("utf-8")
    assert at_once == []


def test_a_place_that_cannot_be_written_is_refused_before_anything_is_computed(main, at_once, tmp_path):
    (tmp_path / "file").write_text("")
    path = tmp_path / "file" / "mine.json"
    code, _, errors = main("effects", "--measure", "40", "--save", path)
    assert code == 2
    assert f"{path}: cannot be written: " in " ".join(errors.split())
    assert at_once == []
    assert Path(tmp_path / "file").read_text() == ""
