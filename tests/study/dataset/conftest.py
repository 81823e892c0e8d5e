"""Campaigns that tests of several files look at."""

from pathlib import Path

import pytest
import xarray as xr

from nanoslip.study.api import open as open_dataset, run
from nanoslip.study.dataset import file
from nanoslip.study.dataset.collect import collect
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.plan import Plan, make_plan
from nanoslip.study.results.store import Store
from tests.conftest import SMALL
from tests.study.dataset.campaigns import FULL, TABLE, Build, compute


@pytest.fixture(scope="session")
def build(tmp_path_factory: pytest.TempPathFactory) -> Build:
    """Compute a campaign from its text, once for each text."""
    known: dict[str, tuple[Plan, Store]] = {}

    def computed(text: str) -> tuple[Plan, Store]:
        if text not in known:
            folder = tmp_path_factory.mktemp("campaign")
            (folder / "campaign.toml").write_text(text)
            (folder / "cases.csv").write_text(TABLE)
            known[text] = make_plan(load_manifest(folder / "campaign.toml")), Store(folder)
            compute(*known[text])
        return known[text]

    return computed


@pytest.fixture(scope="session")
def small(build: Build) -> tuple[Plan, Store, xr.Dataset]:
    plan, store = build(SMALL)
    path = store.folder.parent / file.FILE
    file.write_netcdf(collect(plan, store), path)
    return plan, store, file.open_dataset(path)


@pytest.fixture(scope="session")
def full_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("full")
    run(FULL, folder).close()
    return folder


@pytest.fixture(scope="session")
def full(full_folder: Path) -> xr.Dataset:
    """Opened once: not to be changed, nor loaded in place."""
    return open_dataset(full_folder)
