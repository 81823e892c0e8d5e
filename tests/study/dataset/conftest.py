"""Campaigns that tests of several files look at."""

import shutil
from collections.abc import Callable
from pathlib import Path

import netCDF4
import pytest
import xarray as xr

from nanoslip.study.dataset import file
from nanoslip.study.dataset.collect import collect
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.plan import Plan, make_plan
from nanoslip.study.results.store import Store
from tests.conftest import SMALL
from tests.study.dataset.campaigns import TABLE, Build, compute
from tests.study.dataset.verifying import Change, computed


@pytest.fixture(scope="session")
def build(tmp_path_factory: pytest.TempPathFactory) -> Build:
    """Compute a campaign from its text, once for each text."""
    known: dict[str, tuple[Plan, Store]] = {}

    def computed(text: str) -> tuple[Plan, Store]:
        if text not in known:
            folder = tmp_path_factory.mktemp("campaign")
            (folder / "campaign.toml").write_text(text)
            (folder / "cases.csv").write_text(TABLE)
            plan, store = make_plan(load_manifest(folder / "campaign.toml")), Store(folder)
            compute(plan, store)
            known[text] = plan, store
        return known[text]

    return computed


@pytest.fixture(scope="session")
def small(build: Build) -> tuple[Plan, Store, xr.Dataset]:
    plan, store = build(SMALL)
    path = store.folder.parent / file.FILE
    file.write(collect(plan, store), path)
    return plan, store, file.read(path)


@pytest.fixture(scope="session")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return computed(tmp_path_factory.mktemp("kept"), SMALL)


@pytest.fixture
def altered(kept: Path, tmp_path: Path) -> Callable[[Change], Path]:
    """A copy of the small campaign's dataset after a change."""

    def alter(change: Change) -> Path:
        path = tmp_path / "altered.nc"
        shutil.copy(kept, path)
        with netCDF4.Dataset(path, "a") as opened:
            opened.set_auto_mask(False)
            change(opened)
        return path

    return alter
