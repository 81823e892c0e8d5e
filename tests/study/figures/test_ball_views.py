"""A contact on a plane of nodes is drawn along one row, beside Hertz's ball."""

from pathlib import Path

import numpy as np
import pytest

import nanoslip
from nanoslip.study.dataset.access import Accessor
from nanoslip.study.figures.views import half_plane

BALL = """title = "x"
stages = ["contact"]
constants = {radius = 50, normal_load = 5e-4, intrinsic_friction = 0.0}
numerics = {n_x = 33, scheme = "half_space"}
ensemble = {members = 1}
outputs = {tractions = true}
"""


def test_a_ball_is_drawn_along_its_row_of_the_largest_pressure_beside_hertz(tmp_path: Path) -> None:
    (tmp_path / "ball.toml").write_text(BALL)
    found = nanoslip.run(tmp_path / "ball.toml", out=tmp_path / "out")
    row, whole = Accessor(found).row(), Accessor(found).contact()
    assert (row.sizes["contact_node"], whole.sizes["contact_node"]) == (33, 33 * 33)
    assert np.ptp(row["y"].values) == 0.0
    assert row["pressure"].values.max() == whole["pressure"].values.max()
    hertz = half_plane(row, row["x"].values)
    assert hertz.max() == pytest.approx(row["pressure"].values.max(), rel=0.02)
