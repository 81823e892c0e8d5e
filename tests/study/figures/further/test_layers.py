"""Layers of all heights: the table is what its script writes, and neither ν nor height changes the plateau much."""

import csv

import numpy as np
import pytest
from layers import COLUMNS, POISSON, of_scheme, rows, value

from nanoslip.study import shipped
from tests.study.figures.shipped_small import small


def test_the_table_is_what_its_script_writes() -> None:
    path = shipped.campaigns()["figures/layers"].with_suffix(".csv")
    header, *written = csv.reader(path.read_text("utf-8").splitlines())
    assert tuple(header) == COLUMNS
    for text, (scheme, *numbers) in zip(written[::7], list(rows())[::7], strict=True):
        assert text[0] == scheme
        np.testing.assert_allclose(np.array(text[1:], float), numbers, rtol=1e-3)


def test_plateaus_hardly_depend_on_the_layer_and_stiffness_falls_with_its_height() -> None:
    data = small("figures/layers")
    for poisson in POISSON["strip"]:
        plateau, _ = value(of_scheme(data, "strip", poisson), "plateau_ratio")
        stiffness, _ = value(of_scheme(data, "strip", poisson), "surface_stiffness")
        thicker = plateau[1:]  # the thinnest is lower than nodes are apart at n_x = 33
        assert np.all((thicker > 0.5) & (thicker < 0.65))  # of 13 nodes; 0.507 to 0.538 at n_x = 129
        assert np.all(np.diff(stiffness) < 0.0)
        assert stiffness[0] == pytest.approx(20.0, rel=0.2)  # 2a/L_z of a thin film that is sheared alone
