"""Every recipe runs as it stands on its page, in few lines, and leaves a picture with something in it."""

import runpy
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.conftest import ROOT

FOLDER = ROOT / "campaigns" / "recipes"
PAGES = runpy.run_path(str(FOLDER / "__main__.py"))
"""What writes the pages: `python campaigns/recipes`."""
RECIPES, executed, gallery, page, recipe = (
    PAGES[name] for name in ("RECIPES", "executed", "gallery", "page", "recipe")
)

MOST_LINES = 17


def printed(text: str) -> str:
    """What the page of a recipe says that it prints."""
    return text.partition("It prints:\n\n```\n")[2].partition("\n```")[0]


def test_every_script_is_in_the_gallery() -> None:
    assert sorted(RECIPES) == sorted(path.stem for path in FOLDER.glob("*.py") if path.stem != "__main__")
    assert (FOLDER / "README.md").read_text("utf-8") == gallery([recipe(name) for name in RECIPES])


@pytest.mark.parametrize("name", RECIPES)
def test_a_page_shows_its_script(name: str) -> None:
    found, text = recipe(name), (FOLDER / f"{name}.md").read_text("utf-8")
    assert text == page(found, printed(text))
    assert found.code in (FOLDER / f"{name}.py").read_text("utf-8")
    assert printed(text)


@pytest.mark.parametrize("name", RECIPES)
def test_a_script_is_short_and_asks_a_question(name: str) -> None:
    found = recipe(name)
    assert len([line for line in found.code.splitlines() if line]) <= MOST_LINES
    assert found.question.endswith("?")
    assert len(found.text.split()) > 20


def test_a_script_that_fails_says_why(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "wrong.py").write_text('import warnings\nwarnings.warn("this is old", stacklevel=1)\n')
    monkeypatch.setitem(executed.__globals__, "FOLDER", tmp_path)
    with pytest.raises(RuntimeError, match=r"recipe wrong: (.|\n)*this is old"):
        executed("wrong", tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("name", RECIPES)
def test_a_recipe_runs_and_leaves_its_picture_alone(name: str, tmp_path: Path) -> None:
    """Numbers may differ in their last digits from machine to machine; what lines they stand in may not."""
    said, before = (
        executed(name, tmp_path).splitlines(),
        printed((FOLDER / f"{name}.md").read_text("utf-8")).splitlines(),
    )
    assert [line.split("(")[0].split()[0] for line in said] == [line.split("(")[0].split()[0] for line in before]
    assert [path.name for path in tmp_path.iterdir()] == [f"{name}.png"]
    with Image.open(tmp_path / f"{name}.png") as picture:
        pixels = np.asarray(picture.convert("RGB")).reshape(-1, 3)
        assert min(picture.size) > 400
    assert len(np.unique(pixels, axis=0)) > 20  # more than a frame around nothing
    assert 0.01 < np.mean(np.any(pixels < 250, axis=1)) < 0.95
