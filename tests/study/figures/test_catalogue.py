"""Every figure belongs to a shipped campaign, can be drawn of it, and says something in every row of its table."""

import numpy as np
import pytest

from nanoslip.study import shipped
from nanoslip.study.figures.gallery import shipped_figures
from nanoslip.study.figures.shared import COLUMN, PAGE
from tests.study.figures.shipped_small import SMALLER, small

FIGURES = shipped_figures()


def test_every_campaign_of_figures_has_a_figure_and_the_other_way_round() -> None:
    folders = ("figures/", "maps/", "interface/")
    campaigns = {name for name in shipped.campaigns() if name.startswith(folders) or name == "schemes"}
    assert {figure.campaign for figure in FIGURES.values()} == campaigns
    assert set(SMALLER) <= campaigns


@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_has_a_journal_s_width_and_data_in_all_axes(name: str) -> None:
    figure = FIGURES[name].draw(small(FIGURES[name].campaign))
    assert figure.get_figwidth() in (COLUMN, PAGE)
    for axes in (axes for axes in figure.axes if axes.get_visible()):
        assert axes.has_data()
        assert axes.get_xlabel() or len(figure.axes) > 1
        drawn = [np.asarray(line.get_ydata(), dtype=float) for line in axes.lines]
        drawn += [
            np.ma.filled(tiles.get_array(), np.nan) for tiles in axes.collections if tiles.get_array() is not None
        ]
        assert any(np.isfinite(values).any() for values in drawn)


@pytest.mark.parametrize("name", FIGURES)
def test_a_table_has_no_empty_row_and_no_number_that_is_none(name: str) -> None:
    claims = tuple(FIGURES[name].claims(small(FIGURES[name].campaign)))
    assert claims
    for claim in claims:
        assert claim.meaning
        assert claim.found not in ("", "none", "nan"), claim
