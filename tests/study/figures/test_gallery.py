"""Figures are files: the formats asked for, a table beside them, and a page of all."""

from pathlib import Path

import pytest

from study.dataset.store import StoreError
from study.figures.catalogue import FIGURES
from study.figures.gallery import INDEX, campaigns_of, write, write_index
from tests.study.figures.shipped_small import small


def test_a_figure_is_its_pictures_and_its_table(tmp_path: Path) -> None:
    figure = FIGURES["fig8"]
    written = write(figure, small(figure.campaign), tmp_path / "new", ("svg", "png"))
    assert [path.name for path in written] == ["fig8.svg", "fig8.png", "fig8.md"]
    text = written[-1].read_text("utf-8")
    assert text.startswith(f"## {figure.title}\n")
    assert "(fig8.png)" in text
    assert "figures/resolution" in text


def test_the_index_has_every_figure_in_order(tmp_path: Path) -> None:
    for name in FIGURES:
        (tmp_path / f"{name}.md").write_text(f"## {name}\n", "utf-8")
    text = write_index(tmp_path).read_text("utf-8")
    assert (tmp_path / INDEX).exists()
    places = [text.index(f"## {name}\n") for name in FIGURES]
    assert places == sorted(places)


def test_figures_of_one_campaign_are_drawn_together() -> None:
    assert {name: len(found) for name, found in campaigns_of(["fig7", "fig9", "fig6"]).items()} == {
        "figures/records": 2,
        "figures/drive": 1,
    }


def test_a_folder_that_cannot_be_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", "utf-8")
    with pytest.raises(StoreError, match="cannot be written"):
        write(FIGURES["fig8"], small("figures/resolution"), tmp_path / "file", ("png",))
