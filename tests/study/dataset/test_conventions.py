"""What is written keeps the CF conventions, as their own checker says."""

import subprocess
import sys
from pathlib import Path

import netCDF4
import pytest
import xarray as xr

from nanoslip.study.api import run
from nanoslip.study.dataset import file
from nanoslip.study.dataset.file import carrying, groups_of
from tests.study.dataset.campaigns import FULL


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Root and groups, each a file of its own: the checker of groups knows of groups with a dimension `time` only."""
    found = run(FULL)
    folder = tmp_path_factory.mktemp("parts")
    facts = {name: found.attrs[name] for name in ("Conventions", "title", "history")}
    for name, part in {"root": found, **groups_of(found)}.items():
        whole = part if name == "root" else part.assign_attrs(facts)
        file.write(carrying(whole.copy(), {}), folder / f"{name}.nc")
    return sorted(folder.iterdir())


@pytest.mark.slow  # 8 s for the checker's own imports
def test_root_and_groups_pass_the_checker_of_cf_1_11(parts: list[Path]) -> None:
    """Its command: what it imports warns, and a warning is an error here."""
    words = [str(Path(sys.executable).with_name("compliance-checker")), "--test", "cf:1.11", *map(str, parts)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert len(parts) == 6
    assert done.stdout.count("All tests passed!") == len(parts), done.stdout + done.stderr
    assert done.returncode == 0
    assert "exceptions occurred" not in done.stdout + done.stderr


def test_coordinates_have_no_missing_values_and_texts_are_characters(parts: list[Path]) -> None:
    for path in parts:
        with xr.open_dataset(path) as read, netCDF4.Dataset(path) as written:
            for name, variable in read.variables.items():
                assert name not in read.coords or "_FillValue" not in written[str(name)].ncattrs(), name
                assert written[str(name)].dtype.kind in "fi" or written[str(name)].dtype == "S1", variable
