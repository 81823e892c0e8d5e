"""A number that somebody adds is declared once, where the solver makes it: results, dataset and descriptions follow."""

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.parameter import Quantity, quantity
from nanoslip.solver.sliding import slide as sliding
from nanoslip.solver.sliding.record import FrictionRecord, event
from nanoslip.solver.sliding.slide import slide_to_state
from nanoslip.solver.sliding.statistics import EventStatistics, event_statistics
from nanoslip.study.dataset import file, variables
from nanoslip.study.dataset.access import Accessor
from nanoslip.study.dataset.collect import collect
from nanoslip.study.dataset.file import load_dataset
from nanoslip.study.dataset.variables import describe, rows
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.plan import Plan, make_plan
from nanoslip.study.results.store import Store
from nanoslip.study.tasks import record
from nanoslip.study.tasks.kind import KINDS
from tests.conftest import SMALL
from tests.study.dataset.campaigns import compute

WAY, FALL = "longest way between two events", "fall of F/W in the event"


@dataclass(frozen=True, slots=True)
class LongestStep(EventStatistics):
    """The statistics, and one more of them."""

    longest_step: float = quantity(
        WAY,
        measure="L_x",
        ensemble=True,
        si=Quantity("", WAY, "m", "length"),
    )


@dataclass(frozen=True, slots=True, eq=False)
class WithFalls(FrictionRecord):
    """The record, and one more column of its events."""

    fall: NDArray[np.float64] = event(FALL, "fall", per="normal_load")


def parts_of(value: Any) -> dict[str, Any]:
    return {item.name: getattr(value, item.name) for item in fields(value)}


def counted(record: FrictionRecord) -> LongestStep:
    steps = np.diff(record.displacement, prepend=0.0)
    return LongestStep(**parts_of(event_statistics(record)), longest_step=float(steps.max()))


def slid(*given: Any) -> tuple[WithFalls, Any]:
    record, end = slide_to_state(*given)
    return WithFalls(**parts_of(record), fall=record.force_before - record.force_after), end


def declare(patch: pytest.MonkeyPatch, old: type, new: type) -> None:
    """As if the new dataclass stood where the old one does."""
    kind = KINDS["record"]
    variables.variables_by_name()  # what other modules remember of it is what is declared now
    parts = tuple(part._replace(type=new) if part.type is old else part for part in kind.parts)
    patch.setitem(KINDS.loaded, "record", replace(kind, parts=parts))
    patch.setattr(
        variables, "variables_by_name", variables.variables_by_name.__wrapped__
    )  # which remembers what was declared


def computed(folder: Path) -> tuple[Plan, Store, xr.Dataset]:
    """The small campaign at one point, with its drives, through the file."""
    text = SMALL.replace("[50.0, 100.0]", "[50.0]").replace("[0.25, 0.5]", "[0.5]")
    (folder / "campaign.toml").write_text(text)
    plan, store = make_plan(load_manifest(folder / "campaign.toml")), Store(folder)
    compute(plan, store)
    file.write_netcdf(collect(plan, store), folder / file.FILE)
    with file.open_dataset(folder / file.FILE) as found:
        return plan, store, load_dataset(found)


@pytest.mark.slow
def test_a_new_scalar_is_in_results_dataset_and_descriptions(tmp_path, monkeypatch):
    declare(monkeypatch, EventStatistics, LongestStep)
    monkeypatch.setattr(record, "event_statistics", counted)
    plan, store, found = computed(tmp_path)
    result = store.read(plan.case_tasks[plan.cases[0].case_id]["record", ""])
    longest = float(np.diff(result.arrays["displacement"], prepend=0.0).max())
    assert result.scalars["longest_step"] == [longest]
    assert found["longest_step"].item() == longest
    assert found["longest_step"].dims == found["mean_step"].dims
    assert found["longest_step"].attrs == {
        "long_name": f"{WAY}, in L_x",
        "units": "1",
        "ancillary_variables": "longest_step_uncertainty longest_step_members",
    }
    assert found["longest_step_si"].item() == longest * plan.manifest.scales.slab_width
    assert found["longest_step_si"].attrs["units"] == "m"
    assert describe("longest_step").uncertainty == "longest_step_uncertainty"
    twin = describe("longest_step_si")
    assert (twin.dims, twin.units, twin.meaning) == ("cases", "m", WAY)
    assert "completed" in found["drive_outcome"].values


def test_a_new_column_of_events_is_in_results_dataset_and_descriptions(tmp_path, monkeypatch):
    declare(monkeypatch, FrictionRecord, WithFalls)
    monkeypatch.setattr(sliding, "slide_to_state", slid)
    plan, store, found = computed(tmp_path)
    result = store.read(plan.case_tasks[plan.cases[0].case_id]["record", ""])
    np.testing.assert_array_equal(result.arrays["fall"], result.arrays["force_before"] - result.arrays["force_after"])
    run = Accessor(found).record(intrinsic_friction=0.5)
    assert run["event_fall"].dims == ("event",)
    np.testing.assert_array_equal(run["event_fall"], result.arrays["fall"] * (1.0 / result.scalars["normal_load"][0]))
    assert run["event_fall"].attrs["long_name"] == FALL
    assert describe("event_fall").dims == "event"
    (row,) = (row for row in rows() if row.name == "event_fall")
    assert (row.dims, row.units, row.meaning) == ("event", "1", FALL)
    assert "completed" in found["drive_outcome"].values  # made of the record as it always was


def test_what_is_not_declared_is_nowhere():
    for name in ("longest_step", "event_fall"):
        with pytest.raises(KeyError):
            describe(name)
