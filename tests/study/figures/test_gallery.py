"""Figures are files: the formats asked for, a table beside them, and a page of all."""

from pathlib import Path

import pytest

from study import shipped
from study.dataset.store import StoreError
from study.figures.catalogue import FIGURES
from study.figures.gallery import INDEX, campaigns_of, place, write, write_indexes
from tests.study.figures.shipped_small import small


def test_a_figure_is_its_pictures_and_its_table(tmp_path: Path) -> None:
    figure = FIGURES["fig8"]
    written = write(figure, small(figure.campaign), tmp_path / "new", ("svg", "png"))
    names = ["fig8.svg", "fig8.png", "fig8.md"]
    assert [path.relative_to(tmp_path).as_posix() for path in written] == [f"new/figures/{name}" for name in names]
    text = written[-1].read_text("utf-8")
    assert text.startswith(f"## {figure.title}\n")
    assert "(fig8.png)" in text
    assert "figures/resolution" in text


def test_the_page_of_a_folder_has_every_figure_that_was_drawn_there_in_order(tmp_path: Path) -> None:
    for name, figure in FIGURES.items():
        place(figure, tmp_path).mkdir(exist_ok=True)
        (place(figure, tmp_path) / f"{name}.md").write_text(f"## {name}\n", "utf-8")
    (tmp_path / "figures" / "fig7.md").unlink()
    assert sorted(write_indexes(tmp_path)) == [tmp_path / "figures" / INDEX, tmp_path / "maps" / INDEX]
    for folder in ("figures", "maps"):
        text = (tmp_path / folder / INDEX).read_text("utf-8")
        here = [name for name, figure in FIGURES.items() if figure.campaign.startswith(folder) and name != "fig7"]
        assert [line[3:] for line in text.splitlines() if line.startswith("## ")] == here


def test_a_table_lies_beside_its_campaign() -> None:
    """What is committed: every figure's page and picture in the folder of its campaign, and on that folder's page."""
    for name, figure in FIGURES.items():
        folder = place(figure, shipped.folder("campaigns"))
        page = (folder / f"{name}.md").read_text("utf-8")
        assert (folder / f"{name}.png").exists()
        assert folder.name == "campaigns" or page in (folder / INDEX).read_text("utf-8")


def test_figures_of_one_campaign_are_drawn_together() -> None:
    assert {name: len(found) for name, found in campaigns_of(["fig7", "fig9", "fig6"]).items()} == {
        "figures/records": 2,
        "figures/drive": 1,
    }


def test_a_folder_that_cannot_be_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", "utf-8")
    with pytest.raises(StoreError, match="cannot be written"):
        write(FIGURES["fig8"], small("figures/resolution"), tmp_path / "file", ("png",))
