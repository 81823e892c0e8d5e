"""The shipped campaign of two hundred mixed scenes, within its tolerance, against the same with every effect on.

Both are computed by one process. Two numbers agree where they differ by no more than the tolerance, whatever their uncertainties
are: what is left out and shorter records and drives are to stay within it together.
"""

import re
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

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
TOLERANCES = (0.01, 0.03, 0.1)
AIM = 0.01
"""The tolerance that a target was set for."""


def rows() -> list[Row]:
    """For each tolerance what is saved, beside what was expected to be, and how often the promise is kept."""
    with TemporaryDirectory() as folder:
        nanoslip.run("smoke", out=Path(folder) / "warm", progress=False)  # kernels are loaded, libraries imported
        whole = _computed(Path(folder), None)
        return [row for within in TOLERANCES for row in _rows(within, whole, _computed(Path(folder), within))]


class _Computed(NamedTuple):
    """The campaign as it came out."""

    estimate: float
    """Core seconds, of the plan."""
    seconds: float
    """Processor time."""
    dataset: xr.Dataset


def _rows(within: float, whole: _Computed, found: _Computed) -> Iterator[Row]:
    estimates = f"estimates: {seconds(found.estimate)} and {seconds(whole.estimate)}"
    yield Row(
        f"200 mixed scenes, each driven 4 times, within {within:g}: processor time",
        seconds(found.seconds),
        f"{seconds(whole.seconds)} (everything on; {estimates})",
        f"1/{whole.seconds / found.seconds:.1f}",
        verdict("≥ 3 × cheaper", whole.seconds >= 3.0 * found.seconds) if within == AIM else "",
    )
    for name in ASKED_FOR["dynamics"]:
        on, off = whole.dataset[name], found.dataset[name]
        kept, number = _kept(on, off, within)
        yield Row(
            f"the same: {name} within the tolerance",
            f"{kept} of {number}",
            "everything on",
            f"{kept / number:.3f}",
            verdict("≥ 0.95", kept >= 0.95 * number),
        )


def _computed(folder: Path, within: float | None) -> _Computed:
    """The campaign within a tolerance; None: with every effect."""
    copy = folder / f"within_{within}"
    copy.mkdir()
    for path in CAMPAIGN.parent.iterdir():
        line = "" if within is None else f"within = {within}\n"
        (copy / path.name).write_text(WITHIN.sub(line, path.read_text("utf-8")), "utf-8")
    estimate = sum(task.cost for task in make_plan(load_manifest(copy / CAMPAIGN.name)).tasks)
    begun = time.process_time()
    found = nanoslip.run(copy / CAMPAIGN.name, out=copy / "results", progress=False)
    return _Computed(estimate, time.process_time() - begun, found.load())


def _kept(on: xr.DataArray, found: xr.DataArray, within: float) -> tuple[int, int]:
    """Numbers that agree, and how many there are: those that everything on yields."""
    known = np.isfinite(on.values)
    agree = np.abs(found.values - on.values) <= within * np.abs(on.values)
    return int((agree & known).sum()), int(known.sum())
