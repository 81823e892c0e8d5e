"""The shipped campaign of two hundred mixed scenes, within its tolerance, against the same with every effect on.

Both are computed by one process. The promise is about means over starts, and these are single records and drives: two numbers
agree where they differ by no more than the tolerance and twice their combined uncertainties.
"""

import re
import time
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import xarray as xr

import nanoslip
from study.manifest.reader import load_manifest
from study.plan.influence.scene import ASKED_FOR
from study.plan.plan import make_plan
from study.shipped import campaign_file
from tests.benchmarks.table import Row, seconds, verdict

CAMPAIGN = campaign_file(Path("mixed/mixed"))
WITHIN = re.compile(r"^within = .*\n", re.MULTILINE)


def rows() -> list[Row]:
    """What is saved, beside what was expected to be, and how often the promise is kept."""
    manifest = load_manifest(CAMPAIGN)
    assert manifest.tolerated is not None
    expected = [
        sum(task.cost for task in make_plan(each).tasks) for each in (replace(manifest, tolerated=None), manifest)
    ]
    with TemporaryDirectory() as folder:
        nanoslip.run("smoke", out=Path(folder) / "warm", progress=False)  # kernels are loaded, libraries imported
        (whole, on), (reduced, found) = (_computed(Path(folder), every) for every in (True, False))
    rows = [
        Row(
            f"{len(manifest.axes['radius'])} mixed scenes, each driven {len(manifest.drives)} times, within "
            f"{manifest.tolerated.within:g}: processor time",
            seconds(reduced),
            f"{seconds(whole)} (everything on; estimates: {seconds(expected[1])} and {seconds(expected[0])})",
            f"1/{whole / reduced:.1f}",
            verdict("≥ 3 × cheaper", whole >= 3.0 * reduced),
        )
    ]
    for name in ASKED_FOR["dynamics"]:
        kept, number = _kept(on[name], found[name], _errors(on, found, name), manifest.tolerated.within)
        rows.append(
            Row(
                f"the same: {name} within the tolerance and twice the uncertainty",
                f"{kept} of {number}",
                "everything on",
                f"{kept / number:.3f}",
                verdict("≥ 0.95", kept >= 0.95 * number),
            )
        )
    return rows


def _computed(folder: Path, every: bool) -> tuple[float, xr.Dataset]:
    """Processor seconds and dataset of the campaign, with every effect or within its tolerance."""
    copy = folder / ("every" if every else "within")
    copy.mkdir()
    for path in CAMPAIGN.parent.iterdir():
        text = path.read_text("utf-8")
        (copy / path.name).write_text(WITHIN.sub("", text) if every else text, "utf-8")
    begun = time.process_time()
    found = nanoslip.run(copy / CAMPAIGN.name, out=copy / "results", progress=False)
    return time.process_time() - begun, found.load()


def _errors(on: xr.Dataset, found: xr.Dataset, name: str) -> np.ndarray:
    stated = on[name].attrs.get("ancillary_variables", "").split()
    error = next((each for each in stated if each in on), None)
    assert error is not None
    return np.hypot(on[error].values, found[error].values)


def _kept(on: xr.DataArray, found: xr.DataArray, errors: np.ndarray, within: float) -> tuple[int, int]:
    """Numbers that agree, and how many there are: those that everything on yields."""
    known = np.isfinite(on.values)
    agree = np.abs(found.values - on.values) <= within * np.abs(on.values) + 2.0 * errors
    return int((agree & known).sum()), int(known.sum())
