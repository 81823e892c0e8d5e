"""`nanoslip figure` lists, draws and refuses."""

from contextlib import nullcontext
from pathlib import Path

import pytest
import xarray as xr

from nanoslip.study.commands import cli as looking
from nanoslip.study.commands import look as command
from nanoslip.study.figures import shared as canvas
from nanoslip.study.figures.gallery import shipped_figures
from tests.conftest import Main
from tests.study.figures.shipped_small import small
from tests.study.figures.sweep.cases import product


def test_the_command_knows_the_formats_that_can_be_drawn() -> None:
    assert set(looking.FORMATS) == set(canvas.FORMATS)


def shipped(names: tuple[str, ...], form: str, into: Path, out: Path) -> None:
    """Draw shipped figures."""
    command.draw_figure(names, False, (form,), into, out, "", "", "", None, False)


def test_without_a_name_every_figure_is_listed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shipped((), "png", tmp_path, tmp_path)
    said = capsys.readouterr().out
    assert all(name in said and figure.title in said for name, figure in shipped_figures().items())
    assert not list(tmp_path.iterdir())


def test_named_figures_are_drawn_and_their_tables_shown(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked, data = [], small("figures/resolution").copy()

    def computed(campaign: Path, out: Path, progress: bool) -> object:
        asked.append((campaign.name, out, progress))
        return data

    monkeypatch.setattr(command.api, "run", computed)
    shipped(("fig8",), "svg", tmp_path / "into", tmp_path / "out")
    assert asked == [("resolution.toml", tmp_path / "out" / "figures" / "resolution", True)]
    assert sorted(path.name for path in (tmp_path / "into" / "figures").iterdir()) == [
        "README.md",
        "fig8.md",
        "fig8.svg",
    ]
    assert "exponent of mean step" in capsys.readouterr().out


def test_an_unknown_figure_is_refused_with_those_there_are(tmp_path: Path) -> None:
    with pytest.raises(Exception, match=r"fig12: no figure; there are .*fig5"):
        shipped(("fig12",), "png", tmp_path, tmp_path)


@pytest.fixture
def dataset(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> xr.Dataset:
    """A dataset that stands for the file results.nc."""
    made = product(intrinsic_friction=[0.25, 0.5], radius=[50.0, 100.0, 200.0])
    monkeypatch.setattr(command, "dataset_of", lambda source, out: nullcontext({tmp_path: made}[source]))
    return made


def test_a_number_of_a_campaign_is_drawn_over_the_axes_that_are_asked_for(
    main: Main, tmp_path: Path, dataset: xr.Dataset
) -> None:
    target = tmp_path / "folder" / "fig.svg"
    target.parent.mkdir()
    code, said, _ = main("figure", tmp_path, "--y", "plateau/mu_i", "--hue", "R/L_x", "-o", target, "--csv")
    assert code == 0
    assert "against μ_i, one colour for each R/L_x" in said
    assert target.read_text("utf-8").startswith("<?xml")
    lines = target.with_suffix(".csv").read_text("utf-8").splitlines()
    assert lines[0].startswith("intrinsic_friction,radius,plateau_mean/intrinsic_friction,")
    assert lines[1].startswith("0.25,50,0.5,")
    assert len(lines) == 1 + dataset.plateau_mean.size


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--y", "plateu"), "--y plateu: no variable of this dataset; nearest: plateau_mean"),
        (("--y", "plateau/foo"), "--y plateau/foo: foo: no variable of this dataset"),
        (("--y", "plateau/"), "--y plateau/: needs a variable, or a ratio of two as plateau/mu_i"),
        (
            ("--y", "plateau", "--x", "outcome"),
            "--x outcome: cases do not differ in it; they differ in intrinsic_friction (μ_i), radius (R/L_x)",
        ),
        (("--y", "plateau", "-o", "fig.jpg"), "fig.jpg: needs a name that ends in .pdf, .svg, .png"),
        (("other", "--y", "plateau"), "--y plateau: needs one campaign, or a dataset (results.nc)"),
        (("--x", "radius"), "need --y, the number that is drawn"),
        (("--y", "plateau", "--x", "radius", "--hue", "radius"), "radius: is x and hue: needs two axes"),
        (("--y", "outcome/plateau_mean"), "a ratio needs two numbers, and one of these is words"),
    ],
)
def test_what_cannot_be_drawn_is_refused_in_one_line(
    main: Main, tmp_path: Path, dataset: xr.Dataset, words: tuple[str, ...], message: str
) -> None:
    code, _, said = main("figure", tmp_path, *words)
    assert code == 2
    assert message in said
    assert not list(tmp_path.iterdir())


def test_a_campaign_that_was_not_run_is_told_so(main: Main, campaign: Path, tmp_path: Path) -> None:
    code, _, said = main("figure", campaign, "--y", "plateau", "--out", tmp_path / "out")
    assert code == 2
    assert f"no results of {campaign} there: nanoslip run {campaign} --out {tmp_path / 'out'} computes them" in said
