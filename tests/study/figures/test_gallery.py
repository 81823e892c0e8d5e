"""Figures are files: the formats asked for, a page with a table beside them, and a short gallery of all."""

from pathlib import Path

import pytest
from gallery import INDEX, write_indexes

from nanoslip.study import shipped
from nanoslip.study.figures.gallery import figure_paths, list_shipped_figures, place, script_figures
from nanoslip.study.results.store import StoreError
from tests.study.figures.shipped_small import small

FIGURES = list_shipped_figures()


@pytest.mark.slow
def test_a_figure_is_its_pictures_and_its_table(tmp_path: Path) -> None:
    figure = FIGURES["fig8"]
    written = figure_paths(figure, small(figure.campaign), tmp_path / "new", ("svg", "png"))
    names = ["fig8.svg", "fig8.png", "fig8.md"]
    assert [path.relative_to(tmp_path).as_posix() for path in written] == [f"new/figures/{name}" for name in names]
    text = written[tmp_path / "new" / "figures" / "fig8.md"].decode()
    assert text.startswith(f"# {figure.title}\n")
    assert "(fig8.png)" in text
    assert "figures/resolution" in text


def test_what_is_committed_is_page_and_picture_of_every_figure_and_each_gallery_as_its_script_writes_it(
    tmp_path: Path,
) -> None:
    campaigns = shipped.folder("campaigns")
    for name, figure in FIGURES.items():
        page = place(figure, campaigns) / f"{name}.md"
        assert page.with_suffix(".png").exists()
        assert page.read_text("utf-8").startswith(f"# {figure.title}\n\n![{figure.title}]({name}.png)\n")
    for page in campaigns.rglob("*.md"):
        (copy := tmp_path / page.relative_to(campaigns)).parent.mkdir(exist_ok=True)
        copy.write_text(page.read_text("utf-8") if page.name != INDEX else "", "utf-8")
    for written in write_indexes(tmp_path):
        text = (campaigns / written.relative_to(tmp_path)).read_text("utf-8")
        assert written.read_text("utf-8") == text
        shown = {name for name in FIGURES if f"]({name}.md)\n" in text}
        assert shown == {name for name, figure in FIGURES.items() if place(figure, tmp_path) == written.parent}


def test_a_script_beside_a_campaign_has_its_figures_and_may_import_neighbours_of_its_own_folder(tmp_path: Path) -> None:
    for folder in ("one", "other"):  # shipped figures have such a neighbour, too
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "paper.py").write_text(f"TITLE = {folder!r}\n")
        (tmp_path / folder / "mine.py").write_text(
            "from paper import TITLE\nfrom nanoslip.study.figures.shared import CampaignFigure\n"
            "OWN = CampaignFigure('own', TITLE, '', None, None)\n"
        )
        (figure,) = script_figures(tmp_path / folder / "mine.toml")
        assert (figure.name, figure.title, figure.campaign) == ("own", folder, "mine")
    assert script_figures(tmp_path / "other.toml") == ()


@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("x =", "cannot be run: SyntaxError"),
        ("import no_such_neighbour", "cannot be run: ModuleNotFoundError"),
        ("OWN = 'fig5'", "needs"),
        ("", "needs"),
    ],
)
def test_a_script_that_is_none_is_named_with_what_is_wrong(tmp_path: Path, script: str, said: str) -> None:
    (tmp_path / "mine.py").write_text(script)
    with pytest.raises(StoreError, match=f"mine.py: {said}"):
        script_figures(tmp_path / "mine.toml")
