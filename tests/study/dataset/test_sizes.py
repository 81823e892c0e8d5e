"""A campaign in N and mm is answered in such units, one without units in units of its scales; both hold the same numbers."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import nanoslip
from nanoslip.study.dataset.table import author_coordinates
from nanoslip.study.dataset.units import is_given_in_si
from nanoslip.study.figures.answer import view_named
from nanoslip.study.figures.points import read_points
from nanoslip.study.report.summary import scalar_table

IN_SI: dict[str, Any] = {
    "title": "A ball in N and mm",
    "stages": ["contact"],
    "scales": {"slab_width": "1 mm", "young_modulus": "100 MPa"},
    "constants": {"radius": "5 mm", "poisson": 0.49},
    "numerics": {"n_x": 17, "scheme": "half_space"},
    "axes": {"normal_load": ["0.3 N", "0.5 N"]},
}


@pytest.fixture(scope="module")
def ball() -> xr.Dataset:
    return nanoslip.run(IN_SI)


def test_figures_have_one_unit_along_each_axis(ball: xr.Dataset) -> None:
    """The same figure by the variable and by its size in SI; its file has the units of its names, without prefixes."""
    micrometres = 1e3 * ball["contact_half_width"].values.ravel()
    for name in ("contact_half_width", "contact_half_width_si", "a"):
        view = view_named(ball, name, "normal_load", "", {})
        axes = view.draw().axes[0]
        np.testing.assert_allclose(
            axes.containers[0].lines[0].get_xydata(), [[300.0, micrometres[0]], [500.0, micrometres[1]]]
        )
        columns = view.columns()
        np.testing.assert_allclose(columns["normal_load_si"], [0.3, 0.5])
        np.testing.assert_allclose(columns["contact_half_width_si"], 1e-6 * micrometres)


def test_a_size_has_the_error_of_its_number(ball: xr.Dataset) -> None:
    known = ball.assign(contact_half_width_uncertainty=0.01 * ball["contact_half_width"])
    points = read_points(known, "contact_half_width_si")
    np.testing.assert_allclose(points.errors, 0.01 * points.values)


def test_pressures_take_the_load_of_their_own_case(ball: xr.Dataset) -> None:
    """The mean pressure of a contact in Pa is that of W over L_x² times a number without unit."""
    expected = ball["mean_pressure"].values.ravel() * np.array([0.3, 0.5]) / 1e-6
    np.testing.assert_allclose(read_points(ball, "mean_pressure_si").values, expected)


def test_tables_have_one_unit_in_each_column(ball: xr.Dataset) -> None:
    found = scalar_table(ball)
    rows = [dict(zip(found.header, row, strict=True)) for row in found.rows]
    assert [row["W (mN)"] for row in rows] == ["300", "500"]
    widths = [float(row["a (μm)"].partition(" ± ")[0]) for row in rows]
    np.testing.assert_allclose(widths, 1e3 * ball["contact_half_width"].values.ravel(), rtol=1e-3)


def test_a_campaign_without_units_stays_as_it_is(ball: xr.Dataset) -> None:
    loads = ball["normal_load"].values.tolist()
    bare = nanoslip.run({**IN_SI, "constants": {"radius": 5.0, "poisson": 0.49}, "axes": {"normal_load": loads}})
    assert is_given_in_si(ball)
    assert not is_given_in_si(bare)
    np.testing.assert_allclose(bare["contact_half_width"], ball["contact_half_width"])
    assert {"a/L_x"} <= set(scalar_table(bare).header)
    assert set(view_named(bare, "a", "", "", {}).columns()) >= {"normal_load", "contact_half_width"}


@pytest.mark.parametrize(
    "table", ["normal_load, radius\n0.3 N, 5 mm\n0.5 N, 5 mm\n", "radius; normal_load\n5 mm; 0.3 N\n5 mm; 0.5 N\n"]
)
def test_units_in_a_table_of_cases_count_as_those_of_axes(ball: xr.Dataset, tmp_path: Path, table: str) -> None:
    (tmp_path / "cases.csv").write_text(table, "utf-8")
    content = {**IN_SI, "table": str(tmp_path / "cases.csv"), "constants": {"poisson": 0.49}}
    del content["axes"]
    listed = nanoslip.run(content)
    assert is_given_in_si(listed)
    assert set(author_coordinates(listed)) == {"radius", "normal_load"}
    assert {"W (mN)", "a (μm)"} <= set(scalar_table(ball).header) & set(scalar_table(listed).header)
    assert listed.nanoslip.sel(normal_load="0.5 N")["case"].item() == 1
