"""A campaign with everything that a dataset can hold beside its scalars, computed once."""

from pathlib import Path

import pytest
import xarray as xr

from nanoslip.study.api import open_dataset, run

FULL = {
    "title": "Everything",
    "stages": ["contact", "slip", "dynamics"],
    "axes": {"intrinsic_friction": [0.25, 0.5], "radius": [50.0, 100.0]},
    "numerics": {"n_x": 17},
    "limits": {"events": 200},
    "ensemble": {"members": 1},
    "drives": [{"name": "slow", "stage_velocity": 1e-3, "samples": 40}, {"name": "fast", "samples": 40}],
    "outputs": {"tractions": True, "tractions_at": [3, 5], "subsurface": True},
}


@pytest.fixture(scope="session")
def full_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("full")
    run(FULL, folder).close()
    return folder


@pytest.fixture
def full(full_folder: Path) -> xr.Dataset:
    return open_dataset(full_folder)
