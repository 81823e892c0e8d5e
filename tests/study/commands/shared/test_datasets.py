"""What stands below a table of cases is of what the table shows."""

import numpy as np
import pytest
import xarray as xr

from study.commands.shared.datasets import print_summary
from study.dataset.access.fewer_teeth import EXPLAINED
from tests.study.figures.sweep.cases import regimes


def driven() -> xr.Dataset:
    """Three drives, the first of them without teeth, with numbers that need their room."""
    found = regimes(["radius"], ["teeth"])
    endings = {"drive_outcome": found["outcome"].copy(), "drive_message": found["message"].copy()}
    numbers = ("radius", np.array([0.12345, 0.23456, 0.34567]))
    return found.assign({**endings, "static_friction": numbers, "kinetic_friction": numbers})


@pytest.mark.parametrize(("width", "shown"), [(120, True), (36, False)])
def test_a_sign_is_explained_where_it_is_shown(width: int, shown: bool, monkeypatch, capsys) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    print_summary(driven())
    said = " ".join(capsys.readouterr().out.split())
    assert ("slides*" in said, EXPLAINED in said) == (shown, shown)


def test_what_was_chosen_for_an_accuracy_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    print_summary(driven().assign_attrs(numerics_chosen='{"n_x": 65, "scheme": "galerkin"}'))
    assert "chosen: n_x = 65, scheme = galerkin\n" in capsys.readouterr().out
