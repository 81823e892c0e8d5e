"""A flat table has every number of the dataset once for each row, and says whose each row is."""

import numpy as np
import pytest
import xarray as xr

from nanoslip.study.dataset.access import Column, case_columns, event_columns, sample_columns
from nanoslip.study.dataset.file import carrying, groups_of


def by_name(columns: list[Column]) -> dict[str, list]:
    found = {each.name: each.values for each in columns}
    assert len(found) == len(columns)
    assert len({len(values) for values in found.values()}) == 1
    return found


def test_cases_and_drives_are_rows_that_say_what_the_dataset_says(full: xr.Dataset) -> None:
    columns = case_columns(full)
    assert [each.name for each in columns[:2]] == ["intrinsic_friction", "radius"]
    found = by_name(columns)
    assert len(found["outcome"]) == full.drive_outcome.size == 8
    for row in range(8):
        place = {name: found[name][row] for name in ("intrinsic_friction", "radius", "drive")}
        here = full.sel(place).squeeze()
        for name in ("plateau_mean", "static_friction", "case_id", "stage_velocity", "outcome"):
            assert found[name][row] == here[name].item() or np.isnan(here[name].item())
    apart = {name for name in full.data_vars if name.endswith("_id")}
    assert set(full.variables) - apart == set(found)
    units = {each.name: each.units for each in columns}
    assert (units["stage_velocity"], units["plateau_mean"], units["outcome"]) == ("m s-1", "1", "")


def test_events_and_samples_are_rows_of_their_runs(full: xr.Dataset) -> None:
    events = by_name(event_columns(full))
    one = full.nanoslip.record(intrinsic_friction=0.5, radius=50)
    mine = [
        row
        for row, pair in enumerate(zip(events["intrinsic_friction"], events["radius"], strict=True))
        if pair == (0.5, 50)
    ]
    assert [events["event_number"][row] for row in mine] == one.event.values.tolist()
    assert [events["event_drop"][row] for row in mine] == one.event_drop.values.tolist()
    assert next(iter(events)) == "intrinsic_friction"

    samples = by_name(sample_columns(full))
    run = full.nanoslip.trajectory(intrinsic_friction=0.5, radius=50, drive="fast")
    keys = zip(samples["intrinsic_friction"], samples["radius"], samples["drive"], strict=True)
    mine = [row for row, key in enumerate(keys) if key == (0.5, 50, "fast")]
    assert [samples["time"][row] for row in mine] == run.time.values.tolist()
    assert [samples["sample_spring_force"][row] for row in mine] == run.sample_spring_force.values.tolist()


def test_a_selection_has_its_own_rows_and_what_is_not_there_is_said(full: xr.Dataset) -> None:
    one = full.sel(drive="slow", radius=50.0)
    assert by_name(case_columns(one))["radius"] == [50.0, 50.0]
    assert len(by_name(sample_columns(one))["time"]) == 2 * 41
    assert len(by_name(sample_columns(full))["time"]) == 8 * 41
    others = {name: each for name, each in groups_of(full).items() if name != "record"}
    with pytest.raises(ValueError, match="this dataset has no group record"):
        event_columns(carrying(full.copy(), others))
