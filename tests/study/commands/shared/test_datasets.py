"""What stands below a table of cases is of what the table shows."""

import numpy as np
import pytest
import xarray as xr

from nanoslip.study.commands.datasets import print_summary
from tests.study.figures.sweep.cases import regimes


def driven() -> xr.Dataset:
    """Three drives."""
    found = regimes(["radius"])
    endings = {"drive_outcome": found["outcome"].copy(), "drive_message": found["message"].copy()}
    numbers = ("radius", np.array([0.12345, 0.23456, 0.34567]))
    return found.assign({**endings, "static_friction": numbers, "kinetic_friction": numbers})


def test_what_was_chosen_for_an_accuracy_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    print_summary(driven().assign_attrs(numerics_chosen='{"n_x": 65, "scheme": "galerkin"}'))
    assert "chosen: n_x = 65, scheme = galerkin\n" in capsys.readouterr().out
