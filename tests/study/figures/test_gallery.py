"""Figures are files: the formats asked for, a page with a table beside them, and a short gallery of all."""

from pathlib import Path

import pytest
from gallery import INDEX, write_indexes

from nanoslip.study import shipped
from nanoslip.study.figures.gallery import figures_of, files_of, place, shipped_figures
from nanoslip.study.results.store import StoreError
from tests.study.figures.shipped_small import small

FIGURES = shipped_figures()

FOLDERS = ("figures", "interface", "maps")


def test_a_figure_is_its_pictures_and_its_table(tmp_path: Path) -> None:
    figure = FIGURES["fig8"]
    written = files_of(figure, small(figure.campaign), tmp_path / "new", ("svg", "png"))
    names = ["fig8.svg", "fig8.png", "fig8.md"]
    assert [path.relative_to(tmp_path).as_posix() for path in written] == [f"new/figures/{name}" for name in names]
    text = written[tmp_path / "new" / "figures" / "fig8.md"].decode()
    assert text.startswith(f"# {figure.title}\n")
    assert "(fig8.png)" in text
    assert "figures/resolution" in text


def test_a_gallery_shows_every_figure_that_was_drawn_there_in_order_and_leads_to_its_page(tmp_path: Path) -> None:
    for name, figure in FIGURES.items():
        place(figure, tmp_path).mkdir(exist_ok=True)
        (place(figure, tmp_path) / f"{name}.md").write_text(f"# {name}\n\n| a table |\n", "utf-8")
    (tmp_path / "figures" / "fig7.md").unlink()
    assert sorted(write_indexes(tmp_path)) == [tmp_path / name / INDEX for name in FOLDERS]
    for folder in FOLDERS:
        text = (tmp_path / folder / INDEX).read_text("utf-8")
        here = [figure for figure in FIGURES.values() if figure.campaign.startswith(folder) and figure.name != "fig7"]
        titles = [f"## [{figure.title}]({figure.name}.md)" for figure in here]
        assert [line for line in text.splitlines() if line.startswith("## ")] == titles
        for figure in here:
            assert f"[![{figure.title}]({figure.name}.png)]({figure.name}.md)\n" in text
        assert "a table" not in text


def test_a_page_lies_beside_its_campaign_and_in_its_gallery() -> None:
    """What is committed: page and picture of every figure, and each gallery as it would be written."""
    campaigns = shipped.folder("campaigns")
    for name, figure in FIGURES.items():
        folder = place(figure, campaigns)
        page = (folder / f"{name}.md").read_text("utf-8")
        assert (folder / f"{name}.png").exists()
        assert page.startswith(f"# {figure.title}\n\n![{figure.title}]({name}.png)\n")
        if folder != campaigns:
            gallery = (folder / INDEX).read_text("utf-8")
            assert f"## [{figure.title}]({name}.md)\n" in gallery
            assert len(gallery.splitlines()) < 120


def test_a_script_beside_a_campaign_has_its_figures_and_may_import_its_neighbours(tmp_path: Path) -> None:
    (tmp_path / "neighbour_of_mine.py").write_text("TITLE = 'Mine'\n")
    (tmp_path / "mine.py").write_text(
        "from neighbour_of_mine import TITLE\nfrom nanoslip.study.figures.shared import CampaignFigure\n"
        "FIGURES = (CampaignFigure('own', TITLE, 'What is seen.', None, None),)\n"
    )
    (figure,) = figures_of(tmp_path / "mine.toml")
    assert (figure.name, figure.title, figure.campaign) == ("own", "Mine", "mine")
    assert figures_of(tmp_path / "other.toml") == ()


def test_neighbours_of_one_name_in_two_folders_are_two(tmp_path: Path) -> None:
    for folder in ("one", "other"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "paper.py").write_text(
            f"TITLE = {folder!r}\n"
        )  # shipped figures have such a neighbour, too
        (tmp_path / folder / "mine.py").write_text(
            "from paper import TITLE\nfrom nanoslip.study.figures.shared import CampaignFigure\n"
            "FIGURES = (CampaignFigure('own', TITLE, '', None, None),)\n"
        )
        assert figures_of(tmp_path / folder / "mine.toml")[0].title == folder


@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("x =", "cannot be run: SyntaxError"),
        ("import no_such_neighbour", "cannot be run: ModuleNotFoundError"),
        ("FIGURES = 3", "FIGURES: needs"),
        ("FIGURES = ('fig5',)", "FIGURES: needs"),
        ("", "FIGURES: needs"),
    ],
)
def test_a_script_that_is_none_is_named_with_what_is_wrong(tmp_path: Path, script: str, said: str) -> None:
    (tmp_path / "mine.py").write_text(script)
    with pytest.raises(StoreError, match=f"mine.py: {said}"):
        figures_of(tmp_path / "mine.toml")
