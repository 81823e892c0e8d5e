"""Panels stand at the values that they show, and every regime has its own number, colour and count."""

import numpy as np
import xarray as xr
from tiles import codes, counted, panels, regime_legend, regime_tiles

from nanoslip.solver.dynamics.regime import REGIMES
from nanoslip.study.figures.shared import PAGE, column

WORDS = xr.DataArray([[*REGIMES], [REGIMES[1], REGIMES[1], "", REGIMES[0]]], dims=("velocity", "stiffness"))


def test_a_regime_is_a_number_and_none_is_nan() -> None:
    assert codes(WORDS)[0].tolist() == [0.0, 1.0, 2.0, 3.0]
    assert np.isnan(codes(WORDS)[1, 2])
    assert counted(WORDS) == "2 sticks, 3 stick-slip, 1 slides, 1 micro-slip"


def test_there_is_a_panel_for_each_pair_of_values() -> None:
    rows = xr.DataArray([0.5, 1.0, 2.0], dims="height", name="height")
    columns = xr.DataArray([50.0, 200.0], dims="radius", name="radius")
    with column(4.0, PAGE) as figure:
        seen = [here for _, here in panels(figure, rows, columns, ("h = {:g}", "R = {:g}"))]
    assert seen == [{"height": height, "radius": radius} for height in (0.5, 1.0, 2.0) for radius in (50.0, 200.0)]
    assert [axes.get_title() for axes in figure.axes[:2]] == ["R = 50", "R = 200"]
    assert [figure.axes[place].texts[0].get_text() for place in (1, 3, 5)] == ["h = 0.5", "h = 1", "h = 2"]


def test_tiles_lie_at_their_coordinates_whatever_the_order_of_dimensions() -> None:
    x, y = (xr.DataArray([1.0, 2.0, 4.0, 8.0], dims="stiffness"), xr.DataArray([10.0, 20.0], dims="velocity"))
    with column() as figure:
        axes = figure.add_subplot()
        regime_tiles(axes, x, y, WORDS.transpose("stiffness", "velocity"))
        regime_legend(figure)
    np.testing.assert_array_equal(np.ma.filled(axes.collections[0].get_array(), np.nan), codes(WORDS))
    assert [text.get_text() for text in figure.legends[0].texts] == [word.replace("_", "-") for word in REGIMES]
