"""A starter is written where it is asked for, never over anything, and computes as it stands."""

import tomllib

import pytest

import nanoslip
from nanoslip.study.shipped import starters

SMALLER = {"numerics": {"n_x": 17}, "limits": {"events": 150}, "ensemble": {"members": 2}}
"""Values that make a starter quick: tables that it has are changed."""


def test_the_starters_are_listed_by_name_and_title(main):
    code, said, _ = main("new")
    assert code == 0
    assert [line.split()[0] for line in said.splitlines()[:-1]] == list(starters())
    assert {"paper", "sweep", "regimes", "roughness"} <= set(starters())


@pytest.mark.parametrize("name", starters())
def test_a_starter_is_commented_fine_and_computes(main, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    assert main("new", name, "mine/first.toml")[0] == 0
    assert main("check", "mine/first.toml")[0] == 0
    text = (tmp_path / "mine" / "first.toml").read_text("utf-8")
    assert text.startswith("# ")
    assert text.count("#") > len(text.splitlines()) / 5
    assert max(map(len, text.splitlines())) <= 130
    content = tomllib.loads(text)
    for table in SMALLER.keys() & content.keys():
        content[table] |= SMALLER[table]
    content.setdefault("ensemble", SMALLER["ensemble"])
    monkeypatch.chdir(tmp_path / "mine")
    found = nanoslip.run(content)
    assert set(found.outcome.values.ravel().tolist()) <= {"completed", "no_plateau"}


def test_without_a_file_a_starter_is_written_here_under_its_name(main, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, said, _ = main("new", "roughness")
    assert (code, sorted(path.name for path in tmp_path.iterdir())) == (0, ["roughness.csv", "roughness.toml"])
    assert "nanoslip run roughness.toml" in said


@pytest.mark.parametrize("there", ["mine.toml", "roughness.csv"])
def test_nothing_is_overwritten(main, tmp_path, there):
    (tmp_path / there).write_text("mine")
    code, _, said = main("new", "roughness", tmp_path / "mine.toml")
    assert code == 2
    assert said == f"Error: {tmp_path / there}: there already, and is not overwritten: needs another name\n"
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {there: "mine"}


def test_what_cannot_be_written_is_one_clear_message(main, campaign):
    for words, wanted in ((("swep",), "no starter; there are contact, "), (("sweep", campaign / "x.toml"), "written")):
        code, _, said = main("new", *words)
        assert (code, len(said.splitlines())) == (2, 1)
        assert wanted in said
