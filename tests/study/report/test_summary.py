"""What is said of a dataset's drives in a few lines: how many ended how, and in which regime."""

import numpy as np
import xarray as xr

from study.report.summary import FEW, drive_summary, scalar_table


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
    many = xr.concat([over_axes()] * 10, "pin_mass", data_vars="all")
    assert drive_summary(many) == [
        "drive_outcome of 60 drives: 50 completed, 10 invalid",
        "regime of 60 drives: 30 slides, 10 sticks, 10 stick_slip",
    ]


def test_a_few_drives_need_no_count() -> None:
    assert over_axes().regime.size < FEW
    assert drive_summary(over_axes()) == []


def test_every_drive_of_the_axes_is_a_row_that_names_its_place() -> None:
    table = scalar_table(over_axes())
    assert table.header == ("k", "V_o", "μ_s", "outcome")
    assert table.rows[1] == ("10000", "0.002", "0.3", "completed")
    assert table.rows[4] == ("100000", "0.002", "0.3", "invalid: needs another value")
