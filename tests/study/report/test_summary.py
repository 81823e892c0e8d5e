"""What is said of a dataset's drives in a few lines: how many ended how, and in which regime; and their regime in the table."""

import numpy as np
import xarray as xr

from study.report.summary import drive_summary, scalar_table


def over_axes() -> xr.Dataset:
    """One case, two drives that vary in stiffness and three in velocity."""
    dims = ("intrinsic_friction", "spring_stiffness", "stage_velocity")
    regimes = np.array([[["sticks", "slides", "slides"], ["slides", "", "stick_slip"]]], dtype=object)
    endings = np.where(regimes == "", "invalid", "completed").astype(object)
    return xr.Dataset(
        {
            "outcome": ("intrinsic_friction", np.array(["completed"], dtype=object)),
            "message": ("intrinsic_friction", np.array([""], dtype=object)),
            "static_friction": (dims, np.full(regimes.shape, 0.3)),
            "regime": (dims, regimes),
            "drive_outcome": (dims, endings),
            "drive_message": (dims, np.where(regimes == "", "needs another value", "").astype(object)),
        },
        {"intrinsic_friction": [0.5], "spring_stiffness": [1e4, 1e5], "stage_velocity": [1e-3, 2e-3, 3e-3]},
    )


def test_the_endings_and_regimes_of_many_drives_are_counted() -> None:
    assert drive_summary(over_axes()) == [
        "drive_outcome of 6 drives: 5 completed, 1 invalid",
        "regime of 6 drives: 3 slides, 1 sticks, 1 stick_slip",
    ]


def test_a_single_drive_needs_no_count() -> None:
    assert drive_summary(over_axes().isel(spring_stiffness=[0], stage_velocity=[0])) == []


def test_every_drive_of_the_axes_is_a_row_that_names_its_place() -> None:
    table = scalar_table(over_axes())
    assert table.header == ("spring_stiffness", "stage_velocity", "μ_s", "regime", "outcome")
    assert table.rows[1] == ("10000", "0.002", "0.3", "slides", "completed")
    assert table.rows[4] == ("100000", "0.002", "0.3", "–", "invalid: needs another value")
