"""`nanoslip figure` lists, draws and refuses."""

from pathlib import Path

import pytest

from study.commands import cli
from study.commands import figure as command
from study.figures.catalogue import FIGURES
from study.figures.shared import canvas
from tests.study.figures.shipped_small import small


def test_the_command_knows_the_formats_that_can_be_drawn() -> None:
    assert set(cli.FORMATS) == set(canvas.FORMATS)


def test_without_a_name_every_figure_is_listed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command.work((), False, ("png",), tmp_path, tmp_path)
    said = capsys.readouterr().out
    assert all(name in said and figure.title in said for name, figure in FIGURES.items())
    assert not list(tmp_path.iterdir())


def test_named_figures_are_drawn_and_their_tables_shown(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked, data = [], small("figures/resolution").copy()

    def computed(campaign: Path, out: Path, progress: bool) -> object:
        asked.append((campaign.name, out, progress))
        return data

    monkeypatch.setattr(command.api, "run", computed)
    command.work(("fig8",), False, ("svg",), tmp_path / "into", tmp_path / "out")
    assert asked == [("resolution.toml", tmp_path / "out" / "figures" / "resolution", True)]
    assert sorted(path.name for path in (tmp_path / "into" / "figures").iterdir()) == [
        "README.md",
        "fig8.md",
        "fig8.svg",
    ]
    assert "exponent of mean step" in capsys.readouterr().out


def test_an_unknown_figure_is_refused_with_those_there_are(tmp_path: Path) -> None:
    with pytest.raises(Exception, match=f"fig12: no figure; there are {', '.join(FIGURES)}"):
        command.work(("fig12",), False, ("png",), tmp_path, tmp_path)
